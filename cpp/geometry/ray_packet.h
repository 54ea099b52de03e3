// Sixteen rays side by side, and one triangle against all of them.
#pragma once

#include "base/exactness.h"
#include "base/simd.h"
#include "base/vec.h"
#include "geometry/triangle_test.h"

#include <limits>

namespace mlrt {

// Where the rays of a packet start: all in one point, or each in its own.
struct CommonOrigin {
    Vec3f point{};

    Vec3f of_lane(uint32_t) const { return point; }
};

struct LaneOrigins {
    Vec3<FloatPacket> point;

    Vec3f of_lane(uint32_t lane) const {
        return {point.x.entry(lane), point.y.entry(lane), point.z.entry(lane)};
    }
};

// Lanes that are not active hold a ray that is harmless to compute with.
template <typename Origin>
struct RayPacket {
    Origin origin;
    Vec3<FloatPacket> direction;
    Vec3<FloatPacket> reciprocal; // 1 / direction, infinite for zero
    FloatPacket t_min, t_max;     // a hit counts if t_min < t <= t_max
    Vec3f max_direction;          // greatest |direction| of any lane, by component
    LaneBits active = 0;

    Vec3f lane_direction(uint32_t lane) const {
        return {direction.x.entry(lane), direction.y.entry(lane), direction.z.entry(lane)};
    }
};

// Lanes whose ray hits a triangle anywhere on its line, and where.
struct PacketCandidates {
    LaneBits hit = 0;
    FloatPacket t;                // of the lanes that hit
    uint32_t double_tests = 0;    // lanes that single precision left undecided
    uint32_t exact_tests = 0;     // ... and that double precision left undecided
    uint32_t exact_distances = 0; // lanes whose distance double precision could not round
};

// The volumes U, V, W of triangle_test.h in single precision, and a bound on their error
// that holds for all active lanes: of sixteen rays and a triangle, or of a ray and eight
// triangles. They only filter: what they leave open is decided exactly, so they may be
// evaluated in any way that keeps the bound.
template <typename Real>
struct FilteredVolumes {
    Real u, v, w;
    Real error;

    // Edge normals belong to the triangle and the origin: three dot products a lane remain.
    FilteredVolumes(const RayPacket<CommonOrigin> &rays, const Triangle &triangle) {
        const Vec3d o(rays.origin.point);
        const Vec3d a = Vec3d(triangle.a) - o;
        const Vec3d b = Vec3d(triangle.b) - o;
        const Vec3d c = Vec3d(triangle.c) - o;
        const Vec3d max_direction(rays.max_direction);
        // Rounding the normal to float, the product and two sums: four in a row, 5 with the
        // rounding of the bound. The normal's own error in double adds as in
        // triangle_test.cpp.
        const auto edge = [&](const Vec3d &p, const Vec3d &q, Real &volume) {
            const Vec3d normal = cross(p, q);
            if (!(max_component(abs(normal)) < LARGEST_NORMAL))
                return double(INFINITY);
            const Vec3f n(normal);
            volume = fused(rays.direction.x, FloatPacket(n.x),
                           fused(rays.direction.y, FloatPacket(n.y),
                                 FloatPacket(rays.direction.z * n.z)));
            return 5.0 * double(FLOAT_ROUNDOFF) * dot(abs(normal), max_direction) +
                   10 * DOUBLE_ROUNDOFF * dot(cross_magnitude(p, q), max_direction) +
                   double(UNDERFLOW) *
                       (max_direction.x + max_direction.y + max_direction.z);
        };
        const double bound =
            std::max({edge(b, c, u), edge(c, a, v), edge(a, b, w), double(SMALLEST_BOUND)});
        error = FloatPacket(bound < LARGEST_BOUND ? float(bound * 1.000001) : INFINITY);
    }

    // Differences, products, subtraction, product and sums: seven roundings in a row, each
    // of the six terms of a volume at most |d|_1 times the square of the largest component.
    FilteredVolumes(const Vec3<Real> &origin, const Vec3<Real> &direction,
                    const Vec3<Real> &vertex_a, const Vec3<Real> &vertex_b,
                    const Vec3<Real> &vertex_c) {
        const auto largest = [](const Vec3<Real> &p) {
            return maximum(absolute(p.x), maximum(absolute(p.y), absolute(p.z)));
        };
        const Vec3<Real> a = vertex_a - origin, b = vertex_b - origin,
                         c = vertex_c - origin;
        u = dot(direction, cross(b, c));
        v = dot(direction, cross(c, a));
        w = dot(direction, cross(a, b));
        const Real size = maximum(largest(a), maximum(largest(b), largest(c)));
        const Real direction_sum =
            absolute(direction.x) + absolute(direction.y) + absolute(direction.z);
        // More than UNDERFLOW, which processors take a hundred cycles to multiply by.
        error =
            direction_sum * ((2 * 9 * FLOAT_ROUNDOFF) * (size * size) + SMALLEST_BOUND) +
            SMALLEST_BOUND;
        error = select(MaskOf<Real>((size < LARGEST_SIZE) & (error < LARGEST_BOUND)), error,
                       Real(INFINITY));
    }
    FilteredVolumes(const RayPacket<LaneOrigins> &rays, const Triangle &triangle)
        : FilteredVolumes(rays.origin.point, rays.direction, in_all_lanes(triangle.a),
                          in_all_lanes(triangle.b), in_all_lanes(triangle.c)) {}

    // Lanes that certainly hit, and lanes that neither certainly hit nor certainly miss.
    // Comparisons with NaN are false, so what overflowed stays undecided.
    LaneBits certain_hits() const {
        return to_bits((least() > error) | (greatest() < -error));
    }
    LaneBits certain_misses() const {
        return to_bits((least() < -error) & (greatest() > error));
    }

private:
    // What underflow may lose: 2^-150 in each component of a normal, times the direction,
    // and as much in each product with the direction.
    static constexpr float UNDERFLOW = 0x1p-147f;
    static constexpr float SMALLEST_BOUND = 0x1p-120f;
    // What exceeds these might overflow on the way to a volume, and leaves it undecided:
    // terms of a volume are less than a bound / u, those of an edge normal than a size
    // squared.
    static constexpr float LARGEST_BOUND = 0x1p100f;
    static constexpr double LARGEST_NORMAL = 0x1p120;
    static constexpr float LARGEST_SIZE = 0x1p60f;

    Real least() const { return minimum(u, minimum(v, w)); }
    Real greatest() const { return maximum(u, maximum(v, w)); }
};

template <typename Origin>
auto plane_numerator(const RayPacket<Origin> &rays, const TrianglePlane &plane,
                     const Triangle &triangle) {
    const Vec3d a(triangle.a);
    if constexpr (std::is_same_v<Origin, CommonOrigin>) {
        return PlaneNumerator<double>(plane, a - Vec3d(rays.origin.point));
    } else {
        const Vec3<DoublePacket> o = to_double(rays.origin.point);
        return PlaneNumerator<DoublePacket>(
            plane, Vec3<DoublePacket>{a.x - o.x, a.y - o.y, a.z - o.z});
    }
}

// As single precision has them.
template <typename Origin>
FloatPacket distances_inexactly(const RayPacket<Origin> &rays, const Triangle &triangle) {
    const auto to_vertex = [&] {
        if constexpr (std::is_same_v<Origin, CommonOrigin>)
            return triangle.a - rays.origin.point;
        else
            return in_all_lanes(triangle.a) - rays.origin.point;
    }();
    const Vec3f normal = cross(triangle.b - triangle.a, triangle.c - triangle.a);
    return (to_vertex.x * normal.x + to_vertex.y * normal.y + to_vertex.z * normal.z) /
           (rays.direction.x * normal.x + rays.direction.y * normal.y +
            rays.direction.z * normal.z);
}

// What intersect() is where hits are not exact: the signs of the volumes and the distance
// as single precision has them.
template <typename Origin>
PacketCandidates intersect_inexactly(const RayPacket<Origin> &rays, LaneBits lanes,
                                     const Triangle &triangle) {
    const auto volume = [&](const auto &p, const auto &q) {
        const auto n = cross(p, q);
        return rays.direction.x * n.x + rays.direction.y * n.y + rays.direction.z * n.z;
    };
    const auto relative = [&](const Vec3f &p) {
        if constexpr (std::is_same_v<Origin, CommonOrigin>)
            return p - rays.origin.point;
        else
            return in_all_lanes(p) - rays.origin.point;
    };
    const auto a = relative(triangle.a), b = relative(triangle.b), c = relative(triangle.c);
    const FloatPacket u = volume(b, c), v = volume(c, a), w = volume(a, b);
    PacketCandidates result;
    result.hit = lanes & to_bits((minimum(u, minimum(v, w)) >= 0.0f) |
                                 (maximum(u, maximum(v, w)) <= 0.0f));
    if (result.hit != 0)
        result.t = distances_inexactly(rays, triangle);
    return result;
}

// Tests one triangle against the given lanes, with the decisions and distances of
// triangle_test.h, whatever the packet.
template <typename Origin>
PacketCandidates intersect(const RayPacket<Origin> &rays, LaneBits lanes,
                           const Triangle &triangle) {
    if constexpr (!EXACT)
        return intersect_inexactly(rays, lanes, triangle);
    PacketCandidates result;
    const FilteredVolumes<FloatPacket> volumes(rays, triangle);
    const LaneBits misses = volumes.certain_misses();
    if ((lanes & ~misses) == 0)
        return result;
    result.hit = volumes.certain_hits() & lanes;
    for_each_lane(lanes & ~(misses | result.hit), [&](uint32_t lane) {
        const HitDecision decision =
            decide_hit(rays.origin.of_lane(lane), rays.lane_direction(lane), triangle);
        result.hit |= LaneBits(decision.hit) << lane;
        ++result.double_tests;
        result.exact_tests += decision.precision == Precision::exact;
    });
    if (result.hit == 0)
        return result;
    if constexpr (!EXACT_DISTANCES) {
        result.t = distances_inexactly(rays, triangle);
        return result;
    }

    const TrianglePlane plane(triangle);
    const Vec3<DoublePacket> direction = to_double(rays.direction);
    const DoublePacket max_direction = maximum(
        absolute(direction.x), maximum(absolute(direction.y), absolute(direction.z)));
    const PlaneDistance<DoublePacket> distance(
        plane, plane_numerator(rays, plane, triangle), direction, max_direction);
    result.t = distance.template rounded<FloatPacket>();
    const LaneBits certain = to_bits(distance.template certain<FloatPacket>());
    for_each_lane(result.hit & ~certain, [&](uint32_t lane) {
        ++result.exact_distances;
        result.t.entry(lane) =
            exact_distance(rays.origin.of_lane(lane), rays.lane_direction(lane), triangle);
    });
    return result;
}

} // namespace mlrt
