// Reciprocals that are not divided for, nor the same on all processors.
//
// Their last digits depend on the processor, so results may be made of them only if they
// are certified: the digits that are kept are known by a bound on the error, or else found
// by true division or exactly. What is kept does not tell then which estimate it came from.
#pragma once

#include "base/fused_difference.h"
#include "base/simd.h"

namespace mlrt {

// The error of an estimate, relative to 1 / a, is less.
inline constexpr float RECIPROCAL_ESTIMATE_ERROR = 0x1p-22f;

// What the processor has.
inline FloatPacket rough_reciprocal(const FloatPacket &a) {
#if defined(__AVX512F__)
    return FloatPacket(_mm512_rcp14_ps(a.m));
#elif defined(__AVX__)
    using Half = std::decay_t<decltype(drjit::low(a))>;
    return FloatPacket(Half(_mm256_rcp_ps(drjit::low(a).m)),
                       Half(_mm256_rcp_ps(drjit::high(a).m)));
#else
    return 1.0f / a;
#endif
}
inline FloatBlock rough_reciprocal(const FloatBlock &a) {
#if defined(__AVX__)
    return FloatBlock(_mm256_rcp_ps(a.m));
#else
    return 1.0f / a;
#endif
}

// About 1 / a, of numbers from 2^-120 to 2^120 in size. It is not finite, or not a number,
// for zero and for what is not finite, except that it may be zero for infinity.
//
// What the processor has is good to 2^-14 or to 1.5 2^-12, and one step of Newton's method
// squares that, with a rounding of what it adds and one of the sum.
template <typename Real>
Real reciprocal_estimate(const Real &a) {
    const Real rough = rough_reciprocal(a);
    const Real left = fused_difference(a, rough, Real(1.0f));
    return fused(rough, left, rough);
}

// About 1 / sqrt(a), to a few units of the last place: for what no result depends on but to
// that accuracy.
inline FloatPacket reciprocal_root_estimate(const FloatPacket &a) {
    return drjit::rsqrt(a);
}

} // namespace mlrt
