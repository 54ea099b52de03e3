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

// The hit is interpolated from the vertices, so that it lies in the plane however far the
// ray has come.
template <typename Real>
PlanePoint<DoubleOf<Real>> hit_in_double(const PreparedScene &scene,
                                         const HitRays<Real> &hits) {
    using Double = DoubleOf<Real>;
    const Corners<Real> corners = corners_of(scene, hits.faces);
    const Vec2<Double> weights =
        double_barycentrics_of(hits.origin, hits.direction, corners);
    const Vec3<Double> a = to_double(corners.a), b = to_double(corners.b),
                       c = to_double(corners.c);
    const Vec3<Double> ab = b - a, ac = c - a;
    PlanePoint<Double> point;
    point.p = (a + weights.x * ab) + weights.y * ac;
    point.normal = normalize(cross(ab, ac));
    for (int k = 0; k < 3; ++k)
        point.error[k] = maximum(maximum(absolute(a[k]), absolute(b[k])), absolute(c[k])) *
                         Double(HIT_ERROR);
    return point;
}

// What the tables of the emitters hold, for one emitter or one a lane.
template <typename Real>
struct EmitterEnds {
    Vec3<Real> error; // of sampled points, towards the faces that they lie on
    Real from_light;  // 1 if shadow rays begin at the light, else 0
};

EmitterEnds<float> ends_of(const PreparedScene &scene, const OneEmitterSample &light) {
    const EmitterTable &table = scene.emitter_tables[light.emitter];
    return {table.point_error, table.shadow_rays_from_light ? 1.0f : 0.0f};
}
EmitterEnds<FloatPacket> ends_of(const PreparedScene &scene, const EmitterSamples &light) {
    LaneArray<float> error[3], from_light;
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
        const EmitterTable &table = scene.emitter_tables[light.emitter[lane]];
        for (int k = 0; k < 3; ++k)
            error[k][lane] = table.point_error[k];
        from_light[lane] = table.shadow_rays_from_light ? 1.0f : 0.0f;
    }
    return {{load<FloatPacket>(error[0]), load<FloatPacket>(error[1]),
             load<FloatPacket>(error[2])},
            load<FloatPacket>(from_light)};
}

} // namespace

template <typename Real, typename Samples>
ShadowSegment<Real> robust_segment(const PreparedScene &scene, const HitRays<Real> &hits,
                                   const Samples &light) {
    using Double = DoubleOf<Real>;
    const PlanePoint<Double> hit = hit_in_double(scene, hits);
    const EmitterEnds<Real> ends = ends_of(scene, light);
    const Vec3<Double> target = to_double(light.target);
    const Vec3<Double> way = target - hit.p;
    // Of a ray's direction, hence of its far end.
    const Vec3<Double> direction_error = scaled_absolute(way, ROUNDING);
    ShadowSegment<Real> segment;
    segment.start = point_beside_plane<Real>(
        hit.p, hit.normal, hit.error + direction_error * to_double(ends.from_light), way);
    segment.target =
        point_beside_plane<Real>(target, to_double(light.target_normal),
                                 to_double(ends.error) + direction_error, -way);
    return segment;
}

template <typename Real>
Vec3<Real> robust_passage(const PreparedScene &scene, const HitRays<Real> &hits) {
    const PlanePoint<DoubleOf<Real>> hit = hit_in_double(scene, hits);
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
