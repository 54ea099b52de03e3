// The lanes of a block in another order, or one of them replaced.
#pragma once

#include "base/simd.h"

#include <cstdint>
#include <type_traits>

namespace mlrt {

// In the lowest bits of each lane four bits of a word, the lowest ones in lane 0; what lies
// above them is undefined.
inline UIntBlock four_bits_each(uint32_t word) {
    return UIntBlock(word) >> (drjit::arange<UIntBlock>() * 4u);
}

// block[order[lane]] in each lane; only the lowest three bits of an order count.
template <typename Block>
Block permuted(const Block &block, const UIntBlock &order) {
#if defined(__AVX2__)
    if constexpr (std::is_same_v<Block, FloatBlock>)
        return Block(_mm256_permutevar8x32_ps(block.m, order.m));
    else
        return Block(_mm256_permutevar8x32_epi32(block.m, order.m));
#else
    Block result;
    for (uint32_t lane = 0; lane < BLOCK_WIDTH; ++lane)
        result.entry(lane) = block.entry(order.entry(lane) & (BLOCK_WIDTH - 1));
    return result;
#endif
}

// The block with another value in one lane.
inline FloatBlock with_lane(const FloatBlock &block, uint32_t lane, float value) {
    return select(MaskOf<FloatBlock>(drjit::arange<UIntBlock>() == lane), FloatBlock(value),
                  block);
}

} // namespace mlrt
