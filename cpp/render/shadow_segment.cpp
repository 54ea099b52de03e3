#include "render/shadow_segment.h"

#include "render/shadow_offset.h"

namespace mlrt {

namespace {

// A point of a plane, and how far rounding may have taken it off.
template <typename Double>
struct PlanePoint {
    Vec3<Double> p, normal, error;
};

template <typename Double>
Vec3<Double> scaled_absolute(const Vec3<Double> &v, double factor) {
    return {absolute(v.x) * Double(factor), absolute(v.y) * Double(factor),
            absolute(v.z) * Double(factor)};
}

template <typename Double>
PlanePoint<Double> plane_of(const Corners<Double> &corners) {
    PlanePoint<Double> plane;
    plane.p = corners.a;
    plane.normal = normalize(cross(corners.b - corners.a, corners.c - corners.a));
    for (int k = 0; k < 3; ++k)
        plane.error[k] = maximum(maximum(absolute(corners.a[k]), absolute(corners.b[k])),
                                 absolute(corners.c[k])) *
                         Double(PLANE_ERROR);
    return plane;
}

template <typename Real>
Corners<DoubleOf<Real>> double_corners(const Corners<Real> &corners) {
    return {to_double(corners.a), to_double(corners.b), to_double(corners.c)};
}

// The hit is interpolated from the vertices, so that it lies in the plane however far the
// ray has come.
template <typename Real>
PlanePoint<DoubleOf<Real>> hit_in_double(const PreparedScene &scene,
                                         const HitRays<Real> &hits) {
    const Corners<Real> corners = corners_of(scene, hits.faces);
    const auto weights = double_barycentrics_of(hits.origin, hits.direction, corners);
    const auto [a, b, c] = double_corners(corners);
    PlanePoint<DoubleOf<Real>> point = plane_of<DoubleOf<Real>>({a, b, c});
    point.p = (a + weights.x * (b - a)) + weights.y * (c - a);
    return point;
}

uint32_t any_of(uint32_t face) {
    return face;
}
uint32_t any_of(const FaceNumbers &faces) {
    return faces[0];
}

// The sample, put back into the plane of its face. The normal is zero if there is none.
template <typename Real>
PlanePoint<DoubleOf<Real>> target_in_double(const PreparedScene &scene, uint32_t emitter,
                                            const EmitterSample<Real> &light) {
    using Double = DoubleOf<Real>;
    const auto target = to_double(light.target);
    const Double zero(0.0);
    if (any_of(light.target_face) == NONE)
        return {target, {zero, zero, zero}, {zero, zero, zero}};
    PlanePoint<Double> point =
        plane_of(double_corners(corners_of(scene, light.target_face)));
    point.p = target - point.normal * dot(point.normal, target - point.p);
    for (int k = 0; k < 3; ++k)
        point.error[k] =
            point.error[k] + Double(double(scene.emitter_tables[emitter].unevenness));
    return point;
}

} // namespace

template <typename Real>
ShadowSegment<Real> robust_segment(const PreparedScene &scene, const HitRays<Real> &hits,
                                   uint32_t emitter, const EmitterSample<Real> &light) {
    const auto hit = hit_in_double(scene, hits);
    const auto target = target_in_double(scene, emitter, light);
    const auto way = target.p - hit.p;
    // Of a ray's direction, hence of its far end.
    const auto direction_error = scaled_absolute(way, ROUNDING);
    const auto start_error = scene.emitter_tables[emitter].shadow_rays_from_light
                                 ? hit.error + direction_error
                                 : hit.error;
    ShadowSegment<Real> segment;
    segment.start = point_beside_plane<Real>(hit.p, hit.normal, start_error, way);
    segment.target = point_beside_plane<Real>(target.p, target.normal,
                                              target.error + direction_error, -way);
    return segment;
}

template <typename Real>
Vec3<Real> robust_passage(const PreparedScene &scene, const HitRays<Real> &hits) {
    const auto hit = hit_in_double(scene, hits);
    return point_beside_plane<Real>(hit.p, hit.normal, hit.error,
                                    to_double(hits.direction));
}

template ShadowSegment<float> robust_segment(const PreparedScene &, const HitRays<float> &,
                                             uint32_t, const EmitterSample<float> &);
template ShadowSegment<FloatPacket> robust_segment(const PreparedScene &,
                                                   const HitRays<FloatPacket> &, uint32_t,
                                                   const EmitterSample<FloatPacket> &);
template Vec3<FloatPacket> robust_passage(const PreparedScene &,
                                          const HitRays<FloatPacket> &);

} // namespace mlrt
