// The greatest of absolute values.
#pragma once

#include "base/simd.h"
#include "base/vec.h"

namespace mlrt {

// Of two. Where one is NaN, the result is any number.
template <typename Real>
Real greatest_size(const Real &a, const Real &b) {
#if defined(__AVX512DQ__) && defined(__AVX512VL__)
    // The greater one of absolute values, without its sign.
    constexpr int GREATER_SIZE = 0b1011;
    if constexpr (std::is_same_v<Real, FloatPacket>)
        return Real(_mm512_range_ps(a.m, b.m, GREATER_SIZE));
    if constexpr (std::is_same_v<Real, FloatBlock>)
        return Real(_mm256_range_ps(a.m, b.m, GREATER_SIZE));
#endif
    return maximum(absolute(a), absolute(b));
}

// Of the components of a vector.
template <typename Real>
Real largest_component(const Vec3<Real> &v) {
    return greatest_size(greatest_size(v.x, v.y), v.z);
}

} // namespace mlrt
