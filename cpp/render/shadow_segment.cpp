#include "render/shadow_segment.h"

#include "render/shadow_offset.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

namespace {

template <typename Double>
Vec3<Double> scaled_absolute(const Vec3<Double> &v, double factor) {
    return {absolute(v.x) * Double(factor), absolute(v.y) * Double(factor),
            absolute(v.z) * Double(factor)};
}

template <typename Double>
SurfacePlane<Double> plane_of(const Corners<Double> &corners) {
    SurfacePlane<Double> plane;
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

uint32_t any_of(uint32_t face) {
    return face;
}
uint32_t any_of(const FaceNumbers &faces) {
    return faces[0];
}

// Samples of an analytic shape, put back onto it.
SurfacePlane<double> beside_analytic(const AnalyticShape &shape, Vec3d target) {
    const AnalyticPoint point = point_on(shape, target);
    return {point.p, point.normal, analytic_error(shape)};
}
SurfacePlane<DoublePacket> beside_analytic(const AnalyticShape &shape,
                                           const Vec3<DoublePacket> &targets) {
    SurfacePlane<DoublePacket> points;
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
        const SurfacePlane<double> one =
            beside_analytic(shape, Vec3d{targets.x.entry(lane), targets.y.entry(lane),
                                         targets.z.entry(lane)});
        for (int k = 0; k < 3; ++k) {
            points.p[k].entry(lane) = one.p[k];
            points.normal[k].entry(lane) = one.normal[k];
            points.error[k].entry(lane) = one.error[k];
        }
    }
    return points;
}

// The sample, put back into the plane of its face. The normal is zero if there is none.
template <typename Real>
SurfacePlane<DoubleOf<Real>> target_in_double(const PreparedScene &scene, uint32_t emitter,
                                              const EmitterSample<Real> &light) {
    using Double = DoubleOf<Real>;
    const auto target = to_double(light.target);
    const Double zero(0.0);
    if (any_of(light.target_face) == NONE)
        return {target, {zero, zero, zero}, {zero, zero, zero}};
    const uint32_t face = any_of(light.target_face);
    if (scene.is_on_object(face))
        return beside_analytic(
            *scene.analytic(scene.data.shapes[scene.shape_of_face[face]]), target);
    SurfacePlane<Double> point =
        plane_of(double_corners(corners_of(scene, light.target_face)));
    point.p = target - point.normal * dot(point.normal, target - point.p);
    for (int k = 0; k < 3; ++k)
        point.error[k] =
            point.error[k] + Double(double(scene.emitter_tables[emitter].unevenness));
    return point;
}

} // namespace

// The hit is interpolated from the vertices, so that it lies in the plane however far the
// ray has come.
template <typename Real>
SurfacePlane<DoubleOf<Real>> plane_at(const Vec3<Real> &origin, const Vec3<Real> &direction,
                                      const Corners<Real> &corners) {
    const auto weights = double_barycentrics_of(origin, direction, corners);
    const auto [a, b, c] = double_corners(corners);
    SurfacePlane<DoubleOf<Real>> point = plane_of<DoubleOf<Real>>({a, b, c});
    point.p = (a + weights.x * (b - a)) + weights.y * (c - a);
    return point;
}

template <typename Real>
SurfacePlane<DoubleOf<Real>> hit_plane(const PreparedScene &scene,
                                       const HitRays<Real> &hits) {
    return plane_at(hits.origin, hits.direction, corners_of(scene, hits.faces));
}

Vec3d analytic_error(const AnalyticShape &shape) {
    constexpr double SHARE = 0x1p-30;
    Vec3d error;
    for (int k = 0; k < 3; ++k)
        error[k] = SHARE * std::max(std::abs(double(shape.box.lo[k])),
                                    std::abs(double(shape.box.hi[k])));
    return error;
}

template <typename Real>
ShadowSegment<Real> robust_segment(const PreparedScene &scene,
                                   const SurfacePlane<DoubleOf<Real>> &hit,
                                   uint32_t emitter, const EmitterSample<Real> &light) {
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
Vec3<Real> robust_passage(const SurfacePlane<DoubleOf<Real>> &hit,
                          const Vec3<Real> &direction) {
    return point_beside_plane<Real>(hit.p, hit.normal, hit.error, to_double(direction));
}

template SurfacePlane<double> plane_at(const Vec3f &, const Vec3f &,
                                       const Corners<float> &);
template SurfacePlane<double> hit_plane(const PreparedScene &, const HitRays<float> &);
template SurfacePlane<DoublePacket> hit_plane(const PreparedScene &,
                                              const HitRays<FloatPacket> &);
template ShadowSegment<float> robust_segment(const PreparedScene &,
                                             const SurfacePlane<double> &, uint32_t,
                                             const EmitterSample<float> &);
template ShadowSegment<FloatPacket> robust_segment(const PreparedScene &,
                                                   const SurfacePlane<DoublePacket> &,
                                                   uint32_t,
                                                   const EmitterSample<FloatPacket> &);
template Vec3<FloatPacket> robust_passage(const SurfacePlane<DoublePacket> &,
                                          const Vec3<FloatPacket> &);

} // namespace mlrt
