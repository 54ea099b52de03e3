// What the tests ask of the floating-point environment of the core.
#include "bind/bind.h"

namespace mlrt {

namespace {

// a * b - c, which differs from its fused evaluation for suitable arguments: a test feeds
// it such arguments to prove that the compiler did not contract it.
float multiply_subtract(float a, float b, float c) {
    return a * b - c;
}

} // namespace

void bind_numerics(nanobind::module_ &m) {
    m.def("multiply_subtract", &multiply_subtract);
}

} // namespace mlrt
