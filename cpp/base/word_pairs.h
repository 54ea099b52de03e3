// Words of 32 bits and numbers of 64, sixteen side by side, as generators of random numbers
// mix them.
#pragma once

#include "base/simd.h"

#include <cstdint>

namespace mlrt {

using LongPacket = drjit::Packet<uint64_t, PACKET_WIDTH>;

template <int BITS>
UIntPacket shifted_left(const UIntPacket &a) {
    return drjit::sl<BITS>(a);
}
template <int BITS>
UIntPacket shifted_right(const UIntPacket &a) {
    return drjit::sr<BITS>(a);
}

// By counts below 32.
inline UIntPacket rotate_right(const UIntPacket &a, const UIntPacket &counts) {
#if defined(__AVX512F__)
    return UIntPacket(_mm512_rorv_epi32(a.m, counts.m));
#else
    return (a >> counts) | (a << ((UIntPacket(32u) - counts) & UIntPacket(31u)));
#endif
}

// Uniform in [0, 1) if the words are uniform: their upper 23 bits as the mantissas of
// numbers in [1, 2).
inline FloatPacket unit_floats(const UIntPacket &words) {
    return drjit::reinterpret_array<FloatPacket>(drjit::sr<9>(words) |
                                                 UIntPacket(0x3f800000u)) -
           FloatPacket(1.0f);
}

#if defined(__AVX512F__)
// Every second word of the numbers, from the given one on, 0 or 1.
inline UIntPacket every_second_word(const LongPacket &a, int first) {
    const __m512i even =
        _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
    const __m512i from = _mm512_add_epi32(even, _mm512_set1_epi32(first));
    return UIntPacket(_mm512_permutex2var_epi32(drjit::low(a).m, from, drjit::high(a).m));
}
#endif

// The lower half of each number's bits, and the upper one.
inline UIntPacket low_words(const LongPacket &a) {
#if defined(__AVX512F__)
    return every_second_word(a, 0);
#else
    return UIntPacket(a);
#endif
}
inline UIntPacket high_words(const LongPacket &a) {
#if defined(__AVX512F__)
    return every_second_word(a, 1);
#else
    return UIntPacket(drjit::sr<32>(a));
#endif
}

} // namespace mlrt
