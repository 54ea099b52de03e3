// Two blocks as one packet: lanes 0 to 7, and 8 to 15.
#pragma once

#include "base/simd.h"

namespace mlrt {

// The same eight values twice.
inline FloatPacket load_twice(const float *values) {
#if defined(__AVX512DQ__)
    return FloatPacket(_mm512_broadcast_f32x8(_mm256_loadu_ps(values)));
#else
    return load_halves<FloatPacket>(values, values);
#endif
}

// One value in all lanes of the first block, another one in those of the second.
inline FloatPacket in_halves(float low, float high) {
    return FloatPacket(FloatBlock(low), FloatBlock(high));
}

} // namespace mlrt
