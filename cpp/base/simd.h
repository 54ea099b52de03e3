// The vocabulary of vector code. In the core, only this folder names Dr.Jit and what a
// processor has instructions for; this file is the core of it.
//
// A packet is 16 lanes on every processor; narrower instruction sets run it in two or four
// parts. Arithmetic is plain IEEE: the same operations in the same order give the same bits
// on all of them. Division is true division: approximate reciprocals differ between
// processors (see reciprocal_estimate.h for where they may be used).
//
// Everything here works for scalars too, so that a formula is written once for both.
#pragma once

#include "base/mask_register.h"
#include "base/prefetch.h"
#include "base/vec.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <drjit/math.h>
#include <drjit/packet.h>
#include <type_traits>
#include <utility>

namespace mlrt {

inline constexpr uint32_t PACKET_WIDTH = 16;

using FloatPacket = drjit::Packet<float, PACKET_WIDTH>;
using DoublePacket = drjit::Packet<double, PACKET_WIDTH>;
using UIntPacket = drjit::Packet<uint32_t, PACKET_WIDTH>;

// Eight lanes, one register wherever packets take two: for a few triangles side by side.
inline constexpr uint32_t BLOCK_WIDTH = 8;
using FloatBlock = drjit::Packet<float, BLOCK_WIDTH>;
using DoubleBlock = drjit::Packet<double, BLOCK_WIDTH>;
using UIntBlock = drjit::Packet<uint32_t, BLOCK_WIDTH>;

// As many triangles as one register holds: where there are many of them.
#if defined(__AVX512F__)
inline constexpr uint32_t WIDE_WIDTH = 16;
#else
inline constexpr uint32_t WIDE_WIDTH = BLOCK_WIDTH;
#endif
using FloatWide = drjit::Packet<float, WIDE_WIDTH>;
using IntWide = drjit::Packet<int32_t, WIDE_WIDTH>;
using UIntWide = drjit::Packet<uint32_t, WIDE_WIDTH>;

// Four lanes: the coordinates of a point, and whatever lies behind them in memory.
using PointPacket = drjit::Packet<float, 4>;
using PointIndices = drjit::Packet<int32_t, 4>;

// Eight lanes: the faces of a box, lower ones in lanes 0 to 2, upper ones in lanes 4 to 6.
using BoxPacket = drjit::Packet<float, 8>;
using BoxLanes = drjit::Packet<int32_t, 8>;

template <typename Packet>
inline constexpr uint32_t LANES_OF = uint32_t(drjit::size_v<Packet>);

// What comparing two T gives: bool, or one truth value a lane.
template <typename T>
using MaskOf = drjit::mask_t<T>;

// One bit a lane, lane 0 lowest.
using LaneBits = uint32_t;
inline constexpr LaneBits ALL_LANES = (1u << PACKET_WIDTH) - 1;

// As many lanes as are given, or all.
constexpr LaneBits first_lanes(uint32_t count) {
    return count >= PACKET_WIDTH ? ALL_LANES : (1u << count) - 1;
}

template <typename T>
T absolute(const T &a) {
    return drjit::abs(a);
}

template <typename T>
T select(const MaskOf<T> &mask, const T &if_true, const T &if_false) {
    return drjit::select(mask, if_true, if_false);
}

// The lesser (greater) of both; the second operand where they are unordered, as on x86.
template <typename T>
T minimum(const T &a, const T &b) {
    if constexpr (std::is_arithmetic_v<T>) {
        return a < b ? a : b;
#if defined(__AVX__)
    } else if constexpr (std::is_same_v<T, FloatBlock>) {
        return T(_mm256_min_ps(a.m, b.m));
#endif
#if defined(__AVX512F__)
    } else if constexpr (std::is_same_v<T, FloatPacket>) {
        return T(_mm512_min_ps(a.m, b.m));
#elif defined(__AVX__)
    } else if constexpr (std::is_same_v<T, FloatPacket>) {
        using Half = std::decay_t<decltype(drjit::low(a))>;
        return T(Half(_mm256_min_ps(drjit::low(a).m, drjit::low(b).m)),
                 Half(_mm256_min_ps(drjit::high(a).m, drjit::high(b).m)));
#endif
    } else {
        return drjit::select(a < b, a, b);
    }
}

template <typename T>
T maximum(const T &a, const T &b) {
    if constexpr (std::is_arithmetic_v<T>) {
        return a > b ? a : b;
#if defined(__AVX__)
    } else if constexpr (std::is_same_v<T, FloatBlock>) {
        return T(_mm256_max_ps(a.m, b.m));
#endif
#if defined(__AVX512F__)
    } else if constexpr (std::is_same_v<T, FloatPacket>) {
        return T(_mm512_max_ps(a.m, b.m));
#elif defined(__AVX__)
    } else if constexpr (std::is_same_v<T, FloatPacket>) {
        using Half = std::decay_t<decltype(drjit::low(a))>;
        return T(Half(_mm256_max_ps(drjit::low(a).m, drjit::low(b).m)),
                 Half(_mm256_max_ps(drjit::high(a).m, drjit::high(b).m)));
#endif
    } else {
        return drjit::select(a > b, a, b);
    }
}

// Correctly rounded.
template <typename T>
T square_root(const T &a) {
    return drjit::sqrt(a);
}

// As Mitsuba computes it, to within a few units in the last place.
inline FloatPacket arc_cosine(const FloatPacket &a) {
    return drjit::acos(a);
}

inline FloatPacket sine(const FloatPacket &a) {
    return drjit::sin(a);
}
inline FloatPacket cosine(const FloatPacket &a) {
    return drjit::cos(a);
}

// The angle of the point (x, y), from -pi to pi.
inline FloatPacket arc_tangent(const FloatPacket &y, const FloatPacket &x) {
    return drjit::atan2(y, x);
}

inline FloatPacket floor(const FloatPacket &a) {
    return drjit::floor(a);
}

// a * b + c, rounded once: every processor we build for has it as an instruction.
template <typename T>
T fused(const T &a, const T &b, const T &c) {
    if constexpr (std::is_arithmetic_v<T>)
        return std::fma(a, b, c);
    else
        return drjit::fmadd(a, b, c);
}

// a where t is 0, b where it is 1, and linear between them, rounded as Mitsuba does it.
inline FloatPacket mix(const FloatPacket &a, const FloatPacket &b, const FloatPacket &t) {
    return fused(b, t, fused(-a, t, a));
}

// The size of a with the sign of b.
template <typename T>
T copy_sign(const T &a, const T &b) {
    if constexpr (std::is_arithmetic_v<T>)
        return std::copysign(a, b);
    else
        return drjit::copysign(a, b);
}

// Least and greatest lane. Lanes must be ordered (no NaN).
template <typename T>
float least_lane(const T &a) {
    return drjit::min(a);
}
template <typename T>
float greatest_lane(const T &a) {
    return drjit::max(a);
}

inline float sum_of_lanes(const FloatPacket &a) {
    return drjit::sum(a);
}

// Bits that any lane has.
inline uint32_t union_of_lanes(const UIntPacket &a) {
#if defined(__AVX512F__)
    return uint32_t(_mm512_reduce_or_epi32(a.m));
#else
    const auto eight = drjit::low(a) | drjit::high(a);
    const auto four = drjit::low(eight) | drjit::high(eight);
    return four.entry(0) | four.entry(1) | four.entry(2) | four.entry(3);
#endif
}

inline bool any_lane(bool mask) {
    return mask;
}
template <typename Mask>
bool any_lane(const Mask &mask) {
    return drjit::any(mask);
}

template <typename Mask>
LaneBits to_bits(const Mask &mask) {
    if constexpr (requires { mask.k; }) {
        return bits_of_register(mask.k);
    } else if constexpr (requires { mask.bitmask_(); }) {
        return LaneBits(mask.bitmask_());
    } else {
        constexpr uint32_t half = uint32_t(drjit::size_v<decltype(drjit::low(mask))>);
        return to_bits(drjit::low(mask)) | (to_bits(drjit::high(mask)) << half);
    }
}

// A value a lane in memory, for what is computed or looked up lane by lane.
template <typename Value>
struct alignas(64) LaneArray : std::array<Value, PACKET_WIDTH> {};

constexpr LaneArray<uint32_t> bit_of_each_lane() {
    LaneArray<uint32_t> bits{};
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane)
        bits[lane] = 1u << lane;
    return bits;
}

// The lanes whose bit is set, as a mask over T.
template <typename T>
[[gnu::always_inline]] inline MaskOf<T> from_bits(LaneBits bits) {
#if defined(__AVX512F__)
    if constexpr (std::is_same_v<T, FloatPacket> || std::is_same_v<T, UIntPacket>)
        return MaskOf<T>::from_k(uint16_t(bits));
    if constexpr (std::is_same_v<T, DoublePacket>) {
        using Half = std::decay_t<decltype(drjit::low(MaskOf<T>()))>;
        return MaskOf<T>(Half::from_k(uint8_t(bits)), Half::from_k(uint8_t(bits >> 8)));
    }
#endif
    using Bits = drjit::Packet<uint32_t, LANES_OF<T>>;
    static constexpr LaneArray<uint32_t> LANE_BIT = bit_of_each_lane();
    const auto lane_bit = drjit::load_aligned<Bits>(LANE_BIT.data());
    return MaskOf<T>((Bits(bits) & lane_bit) == lane_bit);
}

inline float first_lane(const FloatPacket &packet) {
    return packet.entry(0);
}
inline uint32_t lane_of(const UIntPacket &packet, uint32_t lane) {
#if defined(__AVX512F__)
    return uint32_t(_mm512_cvtsi512_si32(
        _mm512_permutexvar_epi32(_mm512_set1_epi32(int(lane)), packet.m)));
#else
    return packet.entry(lane);
#endif
}

// 0, 1, 2 ...
template <typename Packet = FloatPacket>
Packet lane_numbers() {
    return drjit::arange<Packet>();
}
inline UIntPacket lane_indices() {
    return drjit::arange<UIntPacket>();
}

// Calls visit(lane) for each set bit, lowest first.
template <typename Visit>
void for_each_lane(LaneBits bits, Visit &&visit) {
    while (bits) {
        visit(uint32_t(__builtin_ctz(bits)));
        bits &= bits - 1;
    }
}

// Calls visit(value, lanes) for each value that some of the given lanes hold, with those
// that do.
template <typename Visit>
void for_each_value(const UIntPacket &values, LaneBits lanes, Visit &&visit) {
    while (lanes != 0) {
        const uint32_t value = lane_of(values, uint32_t(__builtin_ctz(lanes)));
        const LaneBits holders = lanes & to_bits(values == UIntPacket(value));
        visit(value, holders);
        lanes &= ~holders;
    }
}

template <typename Packet, typename Value>
Packet load(const Value *values) {
    return drjit::load<Packet>(values);
}

template <typename Packet, typename Value>
void store(Value *values, const Packet &packet) {
    drjit::store(values, packet);
}

// values[indices[lane]] in each lane; indices below 2^31.
inline FloatPacket gather(const float *values, const UIntPacket &indices) {
    return drjit::gather<FloatPacket>(values, indices);
}

// Lanes 0 to 7 to one place, lanes 8 to 15 to another.
template <typename Packet, typename Value>
void store_halves(Value *low, Value *high, const Packet &packet) {
    drjit::store(low, drjit::low(packet));
    drjit::store(high, drjit::high(packet));
}

template <typename Packet, typename Value>
Packet load_halves(const Value *low, const Value *high) {
    using Half = std::decay_t<decltype(drjit::low(Packet()))>;
    return Packet(drjit::load<Half>(low), drjit::load<Half>(high));
}

template <typename Packet, typename Value>
Packet load(const LaneArray<Value> &lanes) {
    return drjit::load_aligned<Packet>(lanes.data());
}

// Calls work(lane) with the first lane of each register that a packet takes: where it takes
// two, work on many packets at once keeps its values in registers only so.
template <typename Work>
[[gnu::always_inline]] inline void for_each_register(Work &&work) {
    for (uint32_t lane = 0; lane < PACKET_WIDTH; lane += WIDE_WIDTH)
        work(lane);
}
// That register of a packet.
#if defined(__AVX512F__)
inline void store_register(FloatPacket &packet, uint32_t, const FloatWide &values) {
    packet = values;
}
inline const FloatWide &load_register(const FloatPacket &packet, uint32_t) {
    return packet;
}
#else
inline void store_register(FloatPacket &packet, uint32_t lane, const FloatWide &values) {
    drjit::store_aligned(reinterpret_cast<float *>(&packet) + lane, values);
}
inline FloatWide load_register(const FloatPacket &packet, uint32_t lane) {
    return drjit::load_aligned<FloatWide>(reinterpret_cast<const float *>(&packet) + lane);
}
#endif

template <typename Value, typename Packet>
LaneArray<Value> to_lanes(const Packet &packet) {
    LaneArray<Value> lanes;
    drjit::store_aligned(lanes.data(), packet);
    return lanes;
}

// The same vector in all lanes.
inline Vec3<FloatPacket> in_all_lanes(Vec3f v) {
    return {FloatPacket(v.x), FloatPacket(v.y), FloatPacket(v.z)};
}

inline double to_double(float a) {
    return a;
}
inline DoublePacket to_double(const FloatPacket &a) {
    return DoublePacket(a);
}
inline DoubleBlock to_double(const FloatBlock &a) {
    return DoubleBlock(a);
}
inline Vec3<DoubleBlock> to_double(const Vec3<FloatBlock> &v) {
    return {DoubleBlock(v.x), DoubleBlock(v.y), DoubleBlock(v.z)};
}
inline Vec3d to_double(Vec3f v) {
    return Vec3d(v);
}
inline Vec3<DoublePacket> to_double(const Vec3<FloatPacket> &v) {
    return {DoublePacket(v.x), DoublePacket(v.y), DoublePacket(v.z)};
}

// The type that to_double() gives.
template <typename Real>
using DoubleOf = decltype(to_double(std::declval<Real>()));

} // namespace mlrt
