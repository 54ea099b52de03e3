#include "mlrta/hit_distances.h"

#include "base/check.h"
#include "base/exactness.h"
#include "base/fused_difference.h"
#include "base/magnitude.h"
#include "base/reciprocal_estimate.h"
#include "base/transpose.h"
#include "geometry/triangle_block.h"
#include "traverse/load_packet.h"

#include <algorithm>
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

Vec3<FloatWide> directions_of(const RayGroup &rays, uint32_t first_ray) {
    return by_axis([&](int k) {
        return load_padded<FloatWide>(rays.direction[k], first_ray, rays.count);
    });
}

} // namespace

// With N and D exact, n and d as computed, |N - n| <= e_n and |D - d| <= e_d <= |d| / 2,
//     |N/D - n/d| <= 2 |n/d| (e_n / |n| + e_d / |d|),
// see PlaneDistance. Where e_d is larger that bound exceeds |n/d|, and is of no use. The
// share e_n / |n| is no more than that times the sum of absolute products of normal and d
// by the size of normal.d. Tiny errors must not be rounded to zero.
void HitDistances::put_planes(const std::array<uint32_t, BLOCK_WIDTH> &primitives) {
    using Real = DoubleBlock;
    const TriangleBlock<FloatBlock> block(tree_->triangles.data(), primitives.data());
    const Vec3<Real> a = to_double(block.a);
    const PlaneOf<Real> plane(a, to_double(block.b), to_double(block.c));
    const Vec3d o(origin_);
    const PlaneNumerator<Real> numerator(plane, {a.x - o.x, a.y - o.y, a.z - o.z});
    const Real inverse = 1.0 / numerator.value, size = absolute(inverse);

    constexpr size_t COLUMNS = 8; // as Planes has them
    static_assert(sizeof(Plane) == COLUMNS * sizeof(float));
    std::array<std::array<float, BLOCK_WIDTH>, COLUMNS> columns;
    Real extent = 0.0;
    for (int k = 0; k < 3; ++k) {
        const Real scaled = plane.normal[k] * inverse;
        extent = extent + absolute(scaled);
        const FloatBlock normal(scaled);
        store(columns[size_t(k)].data(), normal);
        store(columns[size_t(4 + k)].data(), FloatBlock(scaled - Real(normal)));
    }
    store(columns[3].data(), FloatBlock(4 * ROUNDED_UP * extent));
    const auto moderate = (extent >= SMALLEST_NORMAL) & (extent <= LARGEST_NORMAL);
    const Real error = extent * (ERROR + 2.0 * (numerator.error * size)) +
                       2.0 * (plane.denominator_error() * size);
    store(columns[7].data(),
          FloatBlock(select(moderate, ROUNDED_UP * error, Real(INFINITY))));

    std::array<const float *, COLUMNS> rows;
    for (size_t n = 0; n < COLUMNS; ++n)
        rows[n] = columns[n].data();
    const std::array<FloatBlock, BLOCK_WIDTH> by_plane = load_columns(rows);
    for (size_t n = 0; n < BLOCK_WIDTH; ++n) {
        store(reinterpret_cast<float *>(&planes_[primitives[n] % SIZE]), by_plane[n]);
        known_[primitives[n] % SIZE] = primitives[n];
    }
}

void HitDistances::prepare(std::span<const uint32_t> primitives) {
    std::array<uint32_t, BLOCK_WIDTH> missing;
    uint32_t count = 0;
    for (const uint32_t primitive : primitives) {
        missing[count] = primitive;
        count += !knows(primitive);
        if (count == BLOCK_WIDTH) {
            put_planes(missing);
            count = 0;
        }
    }
    if (count == 0)
        return;
    std::fill(missing.begin() + count, missing.end(), missing[0]);
    put_planes(missing);
}

template <typename Value>
HitDistances::Rounded HitDistances::rounded(const Vec3<FloatWide> &d,
                                            const Planes<Value> &planes) {
    using Lanes = FloatWide;
    if constexpr (!EXACT_DISTANCES) {
        const auto of = [&](int k) { return Lanes(planes.normal[k]); };
        return {1.0f / fused(d.x, of(0), fused(d.y, of(1), d.z * of(2))), ALL_LANES};
    }
    const Lanes largest = largest_component(d);
    // Sums keep of each product what the last place of the anchor holds.
    const Lanes anchor = largest * Lanes(planes.anchor);
    const Lanes one = fused(d.x, Lanes(planes.normal[0]), anchor);
    const Lanes two = fused(d.y, Lanes(planes.normal[1]), one);
    const Lanes three = fused(d.z, Lanes(planes.normal[2]), two);
    const Lanes sum = three - anchor;
    const auto rest_of = [&](int k, const Lanes &not_kept) {
        const Lanes lost = fused(d[k], Lanes(planes.normal[k]), not_kept);
        return fused(d[k], Lanes(planes.rest[k]), lost);
    };
    const Lanes rest =
        (rest_of(0, anchor - one) + rest_of(1, one - two)) + rest_of(2, two - three);

    const Lanes about = reciprocal_estimate(sum);
    const Lanes left =
        fused_difference(rest, about, fused_difference(sum, about, Lanes(1.0f)));
    const Lanes correction = about * fused(left, left, left);
    const Lanes error = absolute(largest * about) * Lanes(planes.error);
    // Both ends of the range; not equal if anything is not a number.
    const Lanes values = about + fused(about, error, correction);
    const Lanes others = about + fused_difference(about, error, correction);
    return {values, to_bits((values == others) & (error <= LARGEST_ERROR))};
}

const HitDistances::Plane &HitDistances::plane_of(uint32_t primitive) {
    if (!knows(primitive)) [[unlikely]]
        prepare({&primitive, 1});
    return planes_[primitive % SIZE];
}

bool HitDistances::knows_all(const UIntPacket &primitives) const {
    const LaneArray<uint32_t> numbers = to_lanes<uint32_t>(primitives);
    for (const uint32_t primitive : numbers)
        if (!knows(primitive)) [[unlikely]]
            return false;
    return true;
}

// Returns the lanes of which that is not possible, as others take their places.
[[gnu::noinline]] LaneBits HitDistances::prepare_all(const UIntPacket &primitives) {
    std::array<uint32_t, PACKET_WIDTH> distinct;
    uint32_t count = 0;
    for_each_value(primitives, ALL_LANES,
                   [&](uint32_t primitive, LaneBits) { distinct[count++] = primitive; });
    prepare({distinct.data(), count});
    LaneBits unknown = 0;
    for_each_value(primitives, ALL_LANES, [&](uint32_t primitive, LaneBits holders) {
        if (!knows(primitive))
            unknown |= holders;
    });
    return unknown;
}

// Of triangles that are all known where that is asked for.
HitDistances::Planes<FloatWide> HitDistances::planes_of(const UIntPacket &primitives,
                                                        uint32_t lane) {
    std::array<FloatWide, 8> columns;
    if constexpr (BY_TRIANGLE) {
        // From both ends, since there are few triangles, and one takes long to be told from
        // the next.
        const auto put = [&](uint32_t primitive, LaneBits holders) {
            const auto *const row = reinterpret_cast<const float *>(&plane_of(primitive));
            const auto mask = from_bits<FloatWide>(holders);
            for (size_t n = 0; n < columns.size(); ++n)
                columns[n] = select(mask, FloatWide(row[n]), columns[n]);
        };
        for (LaneBits left = ALL_LANES; left != 0;) {
            const uint32_t one = lane_of(primitives, uint32_t(std::countr_zero(left)));
            const uint32_t other = lane_of(primitives, uint32_t(std::bit_width(left)) - 1);
            const LaneBits of_one = to_bits(primitives == UIntPacket(one));
            const LaneBits of_other = to_bits(primitives == UIntPacket(other));
            put(one, of_one);
            put(other, of_other);
            left &= ~(of_one | of_other);
        }
    } else {
        std::array<const float *, WIDE_WIDTH> rows;
        for (uint32_t n = 0; n < WIDE_WIDTH; ++n)
            rows[n] = reinterpret_cast<const float *>(
                &planes_[lane_of(primitives, lane + n) % SIZE]);
        columns = load_columns(rows);
    }
    return {{columns[0], columns[1], columns[2]},
            columns[3],
            {columns[4], columns[5], columns[6]},
            columns[7]};
}

// All that needs a frame of the stack is called at the end, with no more arguments than go
// into registers, so that this does without.
FloatPacket HitDistances::of(const RayGroup &rays, uint32_t first_ray, LaneBits lanes,
                             const UIntPacket &primitives, Counters &counters) {
    MLRT_CHECK(lanes != 0);
    // Mostly one triangle covers a packet.
    const uint32_t first = lane_of(primitives, uint32_t(std::countr_zero(lanes)));
    if ((lanes & to_bits(primitives != UIntPacket(first))) != 0)
        return of_several(rays, first_ray, lanes, primitives, counters);
    if (!knows(first)) [[unlikely]]
        return of_new(rays, first_ray, lanes, primitives, counters);
    const Plane &plane = planes_[first % SIZE];
    FloatPacket values;
    LaneBits open = lanes;
    for_each_register([&](uint32_t lane) __attribute__((always_inline)) {
        const Rounded part = rounded<float>(directions_of(rays, first_ray + lane), plane);
        store_register(values, lane, part.values);
        open &= ~(part.certain << lane);
    });
    if (open == 0) [[likely]]
        return values;
    return with_ones(values, rays, first_ray, open, primitives, counters);
}

[[gnu::noinline]] FloatPacket HitDistances::of_new(const RayGroup &rays, uint32_t first_ray,
                                                   LaneBits lanes,
                                                   const UIntPacket &primitives,
                                                   Counters &counters) {
    const uint32_t primitive = lane_of(primitives, uint32_t(std::countr_zero(lanes)));
    prepare({&primitive, 1});
    return of(rays, first_ray, lanes, primitives, counters);
}

[[gnu::noinline]] FloatPacket HitDistances::of_several(const RayGroup &rays,
                                                       uint32_t first_ray, LaneBits lanes,
                                                       const UIntPacket &primitives,
                                                       Counters &counters) {
    FloatPacket values;
    LaneBits open = lanes;
    // Lanes that are not asked for have what another one has.
    const UIntPacket any(lane_of(primitives, uint32_t(std::countr_zero(lanes))));
    const UIntPacket held = select(from_bits<UIntPacket>(lanes), primitives, any);
    const LaneBits unknown = BY_TRIANGLE || knows_all(held) ? 0 : prepare_all(held);
    for_each_register([&](uint32_t lane) __attribute__((always_inline)) {
        const Rounded part =
            rounded(directions_of(rays, first_ray + lane), planes_of(held, lane));
        store_register(values, lane, part.values);
        open &= ~(part.certain << lane);
    });
    open |= lanes & unknown;
    if (open == 0)
        return values;
    return with_ones(values, rays, first_ray, open, primitives, counters);
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
        const Vec3f direction{rays.direction[0][ray], rays.direction[1][ray],
                              rays.direction[2][ray]};
        values[lane] =
            hit_distance(origin_, direction, tree_->triangles[numbers[lane]], counters);
    });
    return load<FloatPacket>(values);
}

} // namespace mlrt
