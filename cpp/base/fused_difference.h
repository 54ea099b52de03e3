// c - a * b, rounded once: what a product takes from a number, without negating it first.
#pragma once

#include "base/simd.h"

namespace mlrt {

template <typename Packet>
Packet fused_difference(const Packet &a, const Packet &b, const Packet &c) {
    return drjit::fnmadd(a, b, c);
}

} // namespace mlrt
