// Sets of lanes from other things than comparisons.
#pragma once

#include "base/simd.h"

#include <cstdint>

namespace mlrt {

// The lowest bits, one after the other, at the places of the lanes that are set.
inline LaneBits spread_to(LaneBits lanes, LaneBits bits) {
#if defined(__BMI2__)
    return _pdep_u32(bits, lanes);
#else
    LaneBits spread = 0;
    for (; lanes != 0; lanes &= lanes - 1, bits >>= 1)
        if (bits & 1u)
            spread |= lanes & (~lanes + 1u);
    return spread;
#endif
}

// Which of sixteen bytes are zero.
inline LaneBits zero_bytes(const uint8_t *bytes) {
#if defined(__SSE2__)
    const __m128i values = _mm_loadu_si128(reinterpret_cast<const __m128i *>(bytes));
    return LaneBits(_mm_movemask_epi8(_mm_cmpeq_epi8(values, _mm_setzero_si128())));
#else
    LaneBits zero = 0;
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane)
        zero |= LaneBits(bytes[lane] == 0) << lane;
    return zero;
#endif
}

} // namespace mlrt
