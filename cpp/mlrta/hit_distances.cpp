#include "mlrta/hit_distances.h"

#include "base/check.h"
#include "base/exactness.h"
#include "base/fused_difference.h"
#include "base/magnitude.h"
#include "base/point_doubles.h"
#include "base/reciprocal_estimate.h"
#include "traverse/load_packet.h"

#include <bit>
#include <cmath>

namespace mlrt {

namespace {

// Nothing that matters is lost to underflow or overflow if the size of a normal lies
// between these, since directions of a beam's rays are no smaller than 2^-60 and no larger
// than 2^61.
constexpr float SMALLEST_NORMAL = 0x1p-38f, LARGEST_NORMAL = 0x1p38f;

// Bounds on the error of a distance 1 / (h + l).d, relative to it, see rounded(). With u
// the unit roundoff, P the sum of the |h_i| times the greatest |d_i|, and m >= 1 the ratio
// of P and |(h + l).d|, as long as m is less than 171:
//
// The sums that start from an anchor of 4 P lie within 5/4 of it, and are each rounded by
// at most 5.1 u P. What they lose is that exactly, but for a rounding of 5.1 u^2 P; with
// the l_i d_i it sums up to at most 16.5 u P, in five more roundings, of 45 u^2 P in all.
// Underflow takes at most 2 u^2 P. l is rounded to within u^2 of the normal. That is 64 u^2
// P for q + r, and 64 u^2 m for its reciprocal.
//
// The estimate a of 1 / q is good to 4 u, so that s = 1 - a (q + r) is at most 21 u m. In
// a + a (s + s^2) the next power, s^3, is missing, which is less than 20 u^2 m; s has two
// roundings, the first of 4 u^2, and the second, s + s^2, its product with a, and adding
// the bound have 21 u^2 m each: 108 u^2 m in all.
constexpr double ERROR = 192 * double(FLOAT_ROUNDOFF) * double(FLOAT_ROUNDOFF);
// Of all bounds together: m is less than 2^-33 / ERROR, or 171, then.
constexpr float LARGEST_ERROR = 0x1p-33f;

// Covers the roundings of the bounds themselves.
constexpr double ROUNDED_UP = 1 + 0x1p-20;

Vec3<FloatPacket> directions_of(const RayGroup &rays, uint32_t first_ray) {
    return by_axis(
        [&](int k) { return load_padded(rays.direction[k], first_ray, rays.count); });
}

} // namespace

// With N and D exact, n and d as computed, |N - n| <= e_n and |D - d| <= e_d <= |d| / 2,
//     |N/D - n/d| <= 2 |n/d| (e_n / |n| + e_d / |d|),
// see PlaneDistance. Where e_d is larger that bound exceeds |n/d|, and is of no use. Tiny
// errors must not be rounded to zero.
HitDistances::Plane::Plane(uint32_t number, const Triangle &triangle, Vec3f origin)
    : primitive(number) {
    const PointDoubles a = point_doubles(&triangle.a.x), b = point_doubles(&triangle.b.x);
    const PointDoubles c = point_doubles_behind(&triangle.b.z);
    const PointDoubles to_vertex = a - PointDoubles(origin.x, origin.y, origin.z, 0.0);
    const CrossTerms terms(b - a, c - a);
    const PointDoubles n = terms.plus - terms.minus;
    const PointDoubles magnitude = absolute(terms.plus) + absolute(terms.minus);
    const double inverse = 1 / sum_of_components(n * to_vertex);
    const double size = std::abs(inverse);
    const PointDoubles scaled = n * PointDoubles(inverse);
    const PointPacket high(scaled);
    store(normal, high);
    store(rest, PointPacket(scaled - PointDoubles(high)));
    share = float((20 * DOUBLE_ROUNDOFF * ROUNDED_UP) *
                  (sum_of_components(magnitude * absolute(to_vertex)) * size));
    const double extent = sum_of_components(absolute(scaled));
    const bool moderate = extent >= SMALLEST_NORMAL && extent <= LARGEST_NORMAL;
    anchor = float(4 * ROUNDED_UP * extent);
    direction_share =
        moderate ? float(ROUNDED_UP *
                         (ERROR * extent +
                          (20 * DOUBLE_ROUNDOFF) * (sum_of_components(magnitude) * size)))
                 : INFINITY;
}

const HitDistances::Plane &HitDistances::plane_of(uint32_t primitive) {
    std::optional<Plane> &known = planes_[primitive % SIZE];
    if (!known || known->primitive != primitive)
        known.emplace(primitive, tree_.triangles[primitive], origin_);
    return *known;
}

template <typename Value>
HitDistances::Rounded HitDistances::rounded(const Vec3<FloatPacket> &d,
                                            const Planes<Value> &planes) {
    if constexpr (!EXACT_DISTANCES) {
        const auto of = [&](int k) { return FloatPacket(planes.normal[k]); };
        return {1.0f / fused(d.x, of(0), fused(d.y, of(1), d.z * of(2))), ALL_LANES};
    }
    const FloatPacket largest = largest_component(d);
    // Sums keep of each product what the last place of the anchor holds.
    const FloatPacket anchor = largest * FloatPacket(planes.anchor);
    const FloatPacket one = fused(d.x, FloatPacket(planes.normal[0]), anchor);
    const FloatPacket two = fused(d.y, FloatPacket(planes.normal[1]), one);
    const FloatPacket three = fused(d.z, FloatPacket(planes.normal[2]), two);
    const FloatPacket sum = three - anchor;
    const auto rest_of = [&](int k, const FloatPacket &not_kept) {
        const FloatPacket lost = fused(d[k], FloatPacket(planes.normal[k]), not_kept);
        return fused(d[k], FloatPacket(planes.rest[k]), lost);
    };
    const FloatPacket rest =
        (rest_of(0, anchor - one) + rest_of(1, one - two)) + rest_of(2, two - three);

    const FloatPacket about = reciprocal_estimate(sum);
    const FloatPacket left =
        fused_difference(rest, about, fused_difference(sum, about, FloatPacket(1.0f)));
    const FloatPacket correction = about * fused(left, left, left);
    const FloatPacket error =
        fused(absolute(largest * about), FloatPacket(planes.direction_share),
              FloatPacket(planes.share));
    // Both ends of the range; not equal if anything is not a number.
    const FloatPacket values = about + fused(about, error, correction);
    const FloatPacket others = about + fused_difference(about, error, correction);
    return {values, to_bits((values == others) & (error <= LARGEST_ERROR))};
}

// All that needs a frame of the stack is called at the end, so that this does without.
FloatPacket HitDistances::of(const RayGroup &rays, uint32_t first_ray, LaneBits lanes,
                             const UIntPacket &primitives, Counters &counters) {
    MLRT_CHECK(lanes != 0);
    // Mostly one triangle covers a packet.
    const uint32_t first = lane_of(primitives, uint32_t(std::countr_zero(lanes)));
    if ((lanes & to_bits(primitives != UIntPacket(first))) != 0)
        return of_several(rays, first_ray, lanes, primitives, counters);
    const std::optional<Plane> &plane = planes_[first % SIZE];
    if (!plane || plane->primitive != first)
        return of_new(first, rays, first_ray, lanes, primitives, counters);
    const Rounded distances = rounded<float>(directions_of(rays, first_ray), *plane);
    const LaneBits open = lanes & ~distances.certain;
    if (open == 0) [[likely]]
        return distances.values;
    return with_ones(distances.values, rays, first_ray, open, primitives, counters);
}

[[gnu::noinline]] FloatPacket HitDistances::of_new(uint32_t primitive, const RayGroup &rays,
                                                   uint32_t first_ray, LaneBits lanes,
                                                   const UIntPacket &primitives,
                                                   Counters &counters) {
    plane_of(primitive);
    return of(rays, first_ray, lanes, primitives, counters);
}

[[gnu::noinline]] FloatPacket HitDistances::of_several(const RayGroup &rays,
                                                       uint32_t first_ray, LaneBits lanes,
                                                       const UIntPacket &primitives,
                                                       Counters &counters) {
    Planes<FloatPacket> planes;
    for_each_value(primitives, lanes, [&](uint32_t primitive, LaneBits holders) {
        const Plane &plane = plane_of(primitive);
        const auto mask = from_bits<FloatPacket>(holders);
        const auto put = [&](FloatPacket &values, float value) {
            values = select(mask, FloatPacket(value), values);
        };
        for (int k = 0; k < 3; ++k) {
            put(planes.normal[k], plane.normal[k]);
            put(planes.rest[k], plane.rest[k]);
        }
        put(planes.anchor, plane.anchor);
        put(planes.share, plane.share);
        put(planes.direction_share, plane.direction_share);
    });
    const Rounded distances = rounded(directions_of(rays, first_ray), planes);
    const LaneBits open = lanes & ~distances.certain;
    if (open == 0)
        return distances.values;
    return with_ones(distances.values, rays, first_ray, open, primitives, counters);
}

// Where single precision leaves some open.
[[gnu::noinline]] FloatPacket HitDistances::with_ones(FloatPacket distances,
                                                      const RayGroup &rays,
                                                      uint32_t first_ray, LaneBits open,
                                                      const UIntPacket &primitives,
                                                      Counters &counters) const {
    const LaneArray<uint32_t> numbers = to_lanes<uint32_t>(primitives);
    LaneArray<float> values = to_lanes<float>(distances);
    for_each_lane(open, [&](uint32_t lane) {
        const uint32_t ray = first_ray + lane;
        values[lane] =
            of_one({rays.direction[0][ray], rays.direction[1][ray], rays.direction[2][ray]},
                   numbers[lane], counters);
    });
    return load<FloatPacket>(values);
}

// In double precision, and exactly where that does not suffice.
float HitDistances::of_one(Vec3f direction, uint32_t primitive, Counters &counters) const {
    const Triangle &triangle = tree_.triangles[primitive];
    const TrianglePlane plane(triangle);
    const PlaneNumerator<double> numerator(plane, Vec3d(triangle.a) - Vec3d(origin_));
    const Vec3d d(direction);
    const PlaneDistance<double> distance(plane, numerator, d, max_component(abs(d)));
    if (distance.certain<float>())
        return distance.rounded<float>();
    ++counters.exact_distances;
    return exact_distance(origin_, direction, triangle);
}

} // namespace mlrt
