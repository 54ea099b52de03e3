// Whether denormal numbers count.
#pragma once

#include "base/simd.h"

namespace mlrt {

// Keeps denormal numbers while it lives: Dr.Jit's threads flush them to zero.
class KeepDenormals {
private:
    drjit::scoped_flush_denormals scope_{false};
};

} // namespace mlrt
