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

// What robust segments need of a sample of an emitter, or of one a lane.
template <typename Real>
struct TargetPlace {
    FacesOf<Real> face; // any for a sample that lies on none
    Real on_face;       // 1 or 0
    Real unevenness;    // of the face's plane
    Real from_light;    // 1 if shadow rays begin there, else 0
};

TargetPlace<float> place_of(const PreparedScene &scene, const OneEmitterSample &light) {
    const EmitterTable &table = scene.emitter_tables[light.emitter];
    const bool on_face = light.target_face != NONE;
    return {on_face ? light.target_face : 0, on_face ? 1.0f : 0.0f, table.unevenness,
            table.shadow_rays_from_light ? 1.0f : 0.0f};
}
TargetPlace<FloatPacket> place_of(const PreparedScene &scene, const EmitterSamples &light) {
    FaceNumbers faces;
    LaneArray<float> on_face, unevenness, from_light;
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
        const OneEmitterSample one{{{}, {}, {}, light.target_face[lane]},
                                   light.emitter[lane]};
        const TargetPlace<float> place = place_of(scene, one);
        faces[lane] = place.face;
        on_face[lane] = place.on_face;
        unevenness[lane] = place.unevenness;
        from_light[lane] = place.from_light;
    }
    return {faces, load<FloatPacket>(on_face), load<FloatPacket>(unevenness),
            load<FloatPacket>(from_light)};
}

// The sample, put back into the plane of its face. The normal is zero if there is none.
template <typename Real, typename Samples>
PlanePoint<DoubleOf<Real>> target_in_double(const PreparedScene &scene,
                                            const Samples &light,
                                            const TargetPlace<Real> &place) {
    PlanePoint<DoubleOf<Real>> point =
        plane_of(double_corners(corners_of(scene, place.face)));
    const auto target = to_double(light.target);
    point.normal = point.normal * to_double(place.on_face);
    point.p = target - point.normal * dot(point.normal, target - point.p);
    for (int k = 0; k < 3; ++k)
        point.error[k] = point.error[k] + to_double(place.unevenness);
    return point;
}

} // namespace

template <typename Real, typename Samples>
ShadowSegment<Real> robust_segment(const PreparedScene &scene, const HitRays<Real> &hits,
                                   const Samples &light) {
    const auto hit = hit_in_double(scene, hits);
    const TargetPlace<Real> place = place_of(scene, light);
    const auto target = target_in_double(scene, light, place);
    const auto way = target.p - hit.p;
    // Of a ray's direction, hence of its far end.
    const auto direction_error = scaled_absolute(way, ROUNDING);
    ShadowSegment<Real> segment;
    segment.start = point_beside_plane<Real>(
        hit.p, hit.normal, hit.error + direction_error * to_double(place.from_light), way);
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
                                             const OneEmitterSample &);
template ShadowSegment<FloatPacket>
robust_segment(const PreparedScene &, const HitRays<FloatPacket> &, const EmitterSamples &);
template Vec3<FloatPacket> robust_passage(const PreparedScene &,
                                          const HitRays<FloatPacket> &);

} // namespace mlrt
