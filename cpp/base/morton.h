// The Morton curve through a square grid: the bits of the column at even places of a
// number, those of the row at odd ones.
#pragma once

#include <cstdint>
#include <drjit/array.h>
#include <drjit/morton.h>

namespace mlrt {

struct MortonPoint {
    uint32_t column = 0, row = 0;
};

// The bits at even places of a number, side by side; one or sixteen.
template <typename UInt>
constexpr UInt even_bits(UInt bits) {
    bits = bits & 0x55555555u;
    bits = (bits | bits >> 1) & 0x33333333u;
    bits = (bits | bits >> 2) & 0x0f0f0f0fu;
    bits = (bits | bits >> 4) & 0x00ff00ffu;
    return (bits | bits >> 8) & 0x0000ffffu;
}

// Of coordinates below 2^16, one each or sixteen.
template <typename UInt>
UInt morton_code(const UInt &column, const UInt &row) {
    return drjit::morton_encode(drjit::Array<UInt, 2>(column, row));
}

inline MortonPoint of_morton_code(uint32_t code) {
    const auto point = drjit::morton_decode<drjit::Array<uint32_t, 2>>(code);
    return {point.entry(0), point.entry(1)};
}

} // namespace mlrt
