// Packets of which memory holds only some lanes.
#pragma once

#include "base/simd.h"

#include <array>
#include <cstdint>
#include <type_traits>

namespace mlrt {

namespace simd_detail {

// The numbers of the bits that are set in each byte, lowest first, a byte each.
constexpr std::array<uint64_t, 256> numbers_of_set_bits() {
    std::array<uint64_t, 256> numbers{};
    for (uint32_t byte = 0; byte < numbers.size(); ++byte)
        for (uint32_t bit = 0, place = 0; bit < 8; ++bit)
            if (byte >> bit & 1)
                numbers[byte] |= uint64_t(bit) << 8 * place++;
    return numbers;
}
inline constexpr std::array<uint64_t, 256> NUMBERS_OF_SET_BITS = numbers_of_set_bits();

#if defined(__AVX2__)
// Lanes below `count`, which may be negative.
inline __m256i lanes_below(int32_t count) {
    return _mm256_cmpgt_epi32(_mm256_set1_epi32(count),
                              _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
}

// Writes the lanes whose bit is set, of the lowest eight, and something else behind them.
inline void store_compressed(void *values, __m256i lanes, LaneBits bits) {
    const __m128i order = _mm_loadl_epi64(
        reinterpret_cast<const __m128i *>(&NUMBERS_OF_SET_BITS[bits & 0xff]));
    _mm256_storeu_si256(reinterpret_cast<__m256i *>(values),
                        _mm256_permutevar8x32_epi32(lanes, _mm256_cvtepu8_epi32(order)));
}

template <typename Block>
__m256i register_of(const Block &block) {
    if constexpr (std::is_same_v<drjit::scalar_t<Block>, float>)
        return _mm256_castps_si256(block.m);
    else
        return block.m;
}
#endif

} // namespace simd_detail

// The first values, fewer than there are lanes, and zeros; nothing behind them is read. Of
// packets of one register among several, `count` may be less than zero, as a signed number.
template <typename Packet = FloatPacket>
[[gnu::always_inline]] inline Packet load_first(const float *values, uint32_t count) {
#if defined(__AVX512F__)
    if constexpr (std::is_same_v<Packet, FloatPacket>)
        return Packet(_mm512_maskz_loadu_ps(__mmask16(first_lanes(count)), values));
#endif
#if defined(__AVX2__)
    const auto load_block = [&](int32_t first) {
        return FloatBlock(_mm256_maskload_ps(
            values + first, simd_detail::lanes_below(int32_t(count) - first)));
    };
    if constexpr (std::is_same_v<Packet, FloatPacket>)
        return Packet(load_block(0), load_block(BLOCK_WIDTH));
    if constexpr (std::is_same_v<Packet, FloatBlock>)
        return load_block(0);
#endif
    std::array<float, LANES_OF<Packet>> padded{};
    for (int32_t lane = 0; lane < int32_t(count); ++lane)
        padded[size_t(lane)] = values[lane];
    return load<Packet>(padded.data());
}

// Writes the lanes whose bit is set one after the other, and something else behind them:
// there must be room for a whole packet.
template <typename Packet, typename Value>
void store_compressed(Value *values, const Packet &packet, LaneBits bits) {
    if (LANES_OF<Packet> == PACKET_WIDTH && bits == ALL_LANES) {
        store(values, packet);
        return;
    }
#if defined(__AVX512F__)
    if constexpr (std::is_same_v<Packet, FloatPacket>) {
        store(values, Packet(_mm512_maskz_compress_ps(__mmask16(bits), packet.m)));
        return;
    } else if constexpr (std::is_same_v<Packet, UIntPacket>) {
        store(values, Packet(_mm512_maskz_compress_epi32(__mmask16(bits), packet.m)));
        return;
    } else if constexpr (std::is_same_v<Packet, FloatBlock>) {
        store(values, Packet(_mm256_maskz_compress_ps(__mmask8(bits), packet.m)));
        return;
    } else if constexpr (std::is_same_v<Packet, UIntBlock>) {
        store(values, Packet(_mm256_maskz_compress_epi32(__mmask8(bits), packet.m)));
        return;
    }
#elif defined(__AVX2__)
    static_assert(sizeof(Value) == 4);
    if constexpr (LANES_OF<Packet> == BLOCK_WIDTH) {
        simd_detail::store_compressed(values, simd_detail::register_of(packet), bits);
        return;
    } else if constexpr (LANES_OF<Packet> == PACKET_WIDTH) {
        const auto low = drjit::low(packet), high = drjit::high(packet);
        simd_detail::store_compressed(values, simd_detail::register_of(low), bits);
        simd_detail::store_compressed(values + __builtin_popcount(bits & 0xff),
                                      simd_detail::register_of(high), bits >> 8);
        return;
    }
#endif
    std::array<Value, LANES_OF<Packet>> lanes;
    store(lanes.data(), packet);
    for_each_lane(bits, [&](uint32_t lane) { *values++ = lanes[lane]; });
}

} // namespace mlrt
