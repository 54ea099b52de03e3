// Tables of sixteen entries.
#pragma once

#include "base/simd.h"

namespace mlrt {

// entries[indices[lane]] in each lane; indices below 16.
inline FloatPacket look_up(const LaneArray<float> &entries, const UIntPacket &indices) {
#if defined(__AVX512F__)
    return FloatPacket(_mm512_permutexvar_ps(indices.m, _mm512_load_ps(entries.data())));
#else
    return gather(entries.data(), indices);
#endif
}

} // namespace mlrt
