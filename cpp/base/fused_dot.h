// The dot product, of which all but one product are not rounded.
#pragma once

#include "base/simd.h"

namespace mlrt {

// A Part is a number that all lanes have in common, or of a lane each, as Real.
template <typename Real, typename Part>
Real fused_dot(const Vec3<Real> &a, const Vec3<Part> &b) {
    return fused(a.x, Real(b.x), fused(a.y, Real(b.y), a.z * Real(b.z)));
}

} // namespace mlrt
