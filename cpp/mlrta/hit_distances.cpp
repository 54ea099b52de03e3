#include "mlrta/hit_distances.h"

#include "base/check.h"
#include "base/point_doubles.h"
#include "traverse/load_packet.h"

#include <bit>
#include <cmath>

namespace mlrt {

namespace {

// Nothing that matters is lost to underflow or overflow if the size of the reciprocal
// distance lies between these.
constexpr float SMALLEST_RECIPROCAL = 0x1p-100f, LARGEST_RECIPROCAL = 0x1p100f;

// Bounds on the error of a distance 1 / (h + l).d, relative to it, see of(). With u the
// unit roundoff, P the sum of the |h_i d_i|, and m >= 1 the ratio of a bound of P and
// |(h + l).d|, as long as m is at most 2^10:
//
// The products h_i d_i are taken apart without error into p_i + e_i, and the sum of the p_i
// into q and two remainders, but for underflow, which takes at most 4 u^2 P of a reciprocal
// as large as is asked for. The remainders, the e_i and the l_i d_i sum up to at most 4 u
// P, in seven roundings: 28 u^2 P. l is rounded to within u^2 of the normal. That is 33 u^2
// P for q + r, and 33 u^2 m for its reciprocal, whatever m: 40 covers that q + r is
// compared with q, within 4 u m.
//
// The reciprocal a of q is rounded, so that s = 1 - a (q + r) is at most 6 u m. In a + a (s
// + s^2) the next power, s^3, is missing, which is less than 14 u^2 m; s has two roundings,
// of 2 u^2 and 6 u^2 m, and s + s^2, its product with a, and adding the bound one each, of
// 6 u^2 m: 40 u^2 m.
constexpr double ERROR = 80 * double(FLOAT_ROUNDOFF) * double(FLOAT_ROUNDOFF);
// Of all bounds together: m is less than 2^10 then.
constexpr float LARGEST_ERROR = 0x1p-32f;

// Covers the roundings of the bounds themselves.
constexpr double ROUNDED_UP = 1 + 0x1p-20;

// c - a * b, rounded once.
FloatPacket fused_difference(const FloatPacket &a, const FloatPacket &b,
                             const FloatPacket &c) {
    return drjit::fnmadd(a, b, c);
}

// A sum and what rounding takes from it (Knuth's two-sum).
struct ExactSum {
    FloatPacket sum, rest;

    ExactSum(const FloatPacket &a, const FloatPacket &b) {
        sum = a + b;
        const FloatPacket of_b = sum - a;
        rest = (a - (sum - of_b)) + (b - of_b);
    }
};

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
    direction_share = float(((ERROR + 20 * DOUBLE_ROUNDOFF) * ROUNDED_UP) *
                            (sum_of_components(magnitude) * size)) +
                      0x1p-126f;
}

const HitDistances::Plane &HitDistances::plane_of(uint32_t primitive) {
    std::optional<Plane> &known = planes_[primitive % SIZE];
    if (!known || known->primitive != primitive)
        known.emplace(primitive, tree_.triangles[primitive], origin_);
    return *known;
}

FloatPacket HitDistances::of(const RayGroup &rays, uint32_t first_ray, LaneBits lanes,
                             const UIntPacket &primitives, Counters &counters) {
    MLRT_CHECK(lanes != 0);
    const auto direction = by_axis(
        [&](int k) { return load_padded(rays.direction[k], first_ray, rays.count); });
    // Mostly one triangle covers a packet.
    const uint32_t first = lane_of(primitives, uint32_t(std::countr_zero(lanes)));
    const Plane &plane = plane_of(first);
    const auto in_all = [](const float *v) -> Vec3<FloatPacket> {
        return {FloatPacket(v[0]), FloatPacket(v[1]), FloatPacket(v[2])};
    };
    Vec3<FloatPacket> high = in_all(plane.normal), low = in_all(plane.rest);
    FloatPacket share(plane.share), direction_share(plane.direction_share);
    const LaneBits others = lanes & to_bits(primitives != UIntPacket(first));
    for_each_value(primitives, others, [&](uint32_t primitive, LaneBits holders) {
        const Plane &other = plane_of(primitive);
        const auto mask = from_bits<FloatPacket>(holders);
        for (int k = 0; k < 3; ++k) {
            high[k] = select(mask, FloatPacket(other.normal[k]), high[k]);
            low[k] = select(mask, FloatPacket(other.rest[k]), low[k]);
        }
        share = select(mask, FloatPacket(other.share), share);
        direction_share = select(mask, FloatPacket(other.direction_share), direction_share);
    });

    const auto &d = direction;
    const auto product = by_axis([&](int k) { return high[k] * d[k]; });
    const auto lost = [&](int k) { return fused_difference(high[k], d[k], product[k]); };
    const ExactSum two(product.x, product.y), all(two.sum, product.z);
    const FloatPacket rest = fused(
        low.x, d.x,
        fused(low.y, d.y,
              fused(low.z, d.z, (two.rest + all.rest) - ((lost(0) + lost(1)) + lost(2)))));
    const FloatPacket about = 1.0f / all.sum;
    const FloatPacket left =
        fused_difference(rest, about, fused_difference(all.sum, about, FloatPacket(1.0f)));
    const FloatPacket correction = about * fused(left, left, left);
    const FloatPacket size = absolute(about);
    const FloatPacket largest =
        maximum(absolute(d.x), maximum(absolute(d.y), absolute(d.z)));
    const FloatPacket error = fused(direction_share, largest * size, share);
    const FloatPacket bound = size * error;
    // Not equal if anything is not a number.
    const FloatPacket rounded = about + (correction + bound);
    const LaneBits certain =
        to_bits((about + (correction - bound) == rounded) & (error <= LARGEST_ERROR) &
                (size >= 1 / LARGEST_RECIPROCAL) & (size <= 1 / SMALLEST_RECIPROCAL));
    const LaneBits open = lanes & ~certain;
    if (open == 0)
        return rounded;
    const LaneArray<uint32_t> numbers = to_lanes<uint32_t>(primitives);
    LaneArray<float> distances = to_lanes<float>(rounded);
    for_each_lane(open, [&](uint32_t lane) {
        const uint32_t ray = first_ray + lane;
        distances[lane] =
            of_one({rays.direction[0][ray], rays.direction[1][ray], rays.direction[2][ray]},
                   numbers[lane], counters);
    });
    return load<FloatPacket>(distances);
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
