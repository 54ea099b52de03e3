#include "mlrta/hit_distances.h"

#include "base/check.h"
#include "traverse/load_packet.h"

#include <bit>
#include <cmath>

namespace mlrt {

namespace {

// The reciprocal of a denominator is taken in single precision, where it needs few cycles,
// and is good to two roundings if the denominator lies between these.
constexpr float SMALLEST_DENOMINATOR = 0x1p-120f, LARGEST_DENOMINATOR = 0x1p120f;

// With 1 + s the product of the denominator and its computed reciprocal, |s| <= 2^-22, one
// step of Newton's method leaves s^2; three roundings of double precision, which are those
// of the step and of the ends of the range, are far less.
constexpr double NEWTON = 0x1p-43;

// Covers the roundings of the shares and of the bound.
constexpr double ROUNDED_UP = 1 + 0x1p-20;

} // namespace

// With N and D exact, n and d as computed, |N - n| <= e_n and |D - d| <= e_d <= |d| / 2,
//     |N/D - n/d| <= 2 |n/d| (e_n / |n| + e_d / |d|),
// see PlaneDistance. Where e_d is larger that bound exceeds |n/d|, and is of no use. Tiny
// errors must not be rounded to zero.
HitDistances::Plane::Plane(uint32_t number, const Triangle &triangle, Vec3f origin)
    : primitive(number) {
    const TrianglePlane plane(triangle);
    const PlaneNumerator<double> distance(plane, Vec3d(triangle.a) - Vec3d(origin));
    normal = plane.normal;
    numerator = distance.value;
    share = float((2 * distance.error / std::abs(distance.value) + NEWTON) * ROUNDED_UP);
    denominator_share = float(2 * plane.denominator_error() * ROUNDED_UP + 0x1p-126);
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
    const Vec3<DoublePacket> d = to_double(direction);
    const auto denominator_of = [&](const Plane &plane) {
        return fused(d.x, DoublePacket(plane.normal.x),
                     fused(d.y, DoublePacket(plane.normal.y), d.z * plane.normal.z));
    };
    // Mostly one triangle covers a packet.
    const uint32_t first = lane_of(primitives, uint32_t(std::countr_zero(lanes)));
    const Plane &plane = plane_of(first);
    DoublePacket numerator(plane.numerator), denominator = denominator_of(plane);
    FloatPacket share(plane.share), denominator_share(plane.denominator_share);
    const LaneBits others = lanes & to_bits(primitives != UIntPacket(first));
    for_each_value(primitives, others, [&](uint32_t primitive, LaneBits holders) {
        const Plane &other = plane_of(primitive);
        const auto wide = from_bits<DoublePacket>(holders);
        const auto mask = from_bits<FloatPacket>(holders);
        numerator = select(wide, DoublePacket(other.numerator), numerator);
        denominator = select(wide, denominator_of(other), denominator);
        share = select(mask, FloatPacket(other.share), share);
        denominator_share =
            select(mask, FloatPacket(other.denominator_share), denominator_share);
    });

    const FloatPacket size(denominator);
    const FloatPacket reciprocal = 1.0f / size;
    const FloatPacket relative_size =
        maximum(absolute(direction.x),
                maximum(absolute(direction.y), absolute(direction.z))) *
        absolute(reciprocal);
    const DoublePacket rough = to_double(reciprocal);
    const DoublePacket quotient = numerator * rough;
    const DoublePacket t =
        fused(quotient, fused(-denominator, rough, DoublePacket(1.0)), quotient);
    const DoublePacket error =
        t * to_double(fused(denominator_share, relative_size, share));
    // Not equal if anything is NaN. A relative size that underflows bounds nothing.
    const FloatPacket rounded(t + error);
    const auto certain =
        (FloatPacket(t - error) == rounded) & (relative_size >= 0x1p-126f) &
        (absolute(size) >= SMALLEST_DENOMINATOR) & (absolute(size) <= LARGEST_DENOMINATOR);
    const LaneBits open = lanes & ~to_bits(certain);
    if (open == 0)
        return rounded;
    counters.exact_distances += uint64_t(std::popcount(open));
    const LaneArray<uint32_t> numbers = to_lanes<uint32_t>(primitives);
    LaneArray<float> distances = to_lanes<float>(rounded);
    for_each_lane(open, [&](uint32_t lane) {
        const uint32_t ray = first_ray + lane;
        distances[lane] = exact_distance(
            origin_,
            {rays.direction[0][ray], rays.direction[1][ray], rays.direction[2][ray]},
            tree_.triangles[numbers[lane]]);
    });
    return load<FloatPacket>(distances);
}

} // namespace mlrt
