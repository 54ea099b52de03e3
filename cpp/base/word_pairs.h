// Words of 32 bits and numbers of 64, sixteen side by side, as generators of random numbers
// mix them.
#pragma once

#include "base/simd.h"

#include <cstdint>

namespace mlrt {

using LongPacket = drjit::Packet<uint64_t, PACKET_WIDTH>;

inline LongPacket to_long(const UIntPacket &a) {
    return LongPacket(a);
}

template <int COUNT>
UIntPacket shift_left(const UIntPacket &a) {
    return drjit::sl<COUNT>(a);
}
template <int COUNT>
UIntPacket shift_right(const UIntPacket &a) {
    return drjit::sr<COUNT>(a);
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
    return drjit::reinterpret_array<FloatPacket>(shift_right<9>(words) |
                                                 UIntPacket(0x3f800000u)) -
           FloatPacket(1.0f);
}

// The lower half of each number's bits, and the upper one.
inline UIntPacket low_words(const LongPacket &a) {
#if defined(__AVX512F__)
    const __m512i even =
        _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
    return UIntPacket(_mm512_permutex2var_epi32(drjit::low(a).m, even, drjit::high(a).m));
#else
    return UIntPacket(a);
#endif
}
inline UIntPacket high_words(const LongPacket &a) {
#if defined(__AVX512F__)
    const __m512i odd =
        _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
    return UIntPacket(_mm512_permutex2var_epi32(drjit::low(a).m, odd, drjit::high(a).m));
#else
    return UIntPacket(drjit::sr<32>(a));
#endif
}

} // namespace mlrt
