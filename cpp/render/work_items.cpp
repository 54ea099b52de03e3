#include "render/work_items.h"

#include <algorithm>

namespace mlrt {

namespace {

// The even bits of a Morton code.
uint32_t even_bits(uint32_t code) {
    code &= 0x55555555u;
    code = (code | (code >> 1)) & 0x33333333u;
    code = (code | (code >> 2)) & 0x0f0f0f0fu;
    code = (code | (code >> 4)) & 0x00ff00ffu;
    return (code | (code >> 8)) & 0x0000ffffu;
}

} // namespace

WorkItems::WorkItems(const PixelRect &sampled, uint32_t samples_per_pixel,
                     uint32_t rays_per_group)
    : width_(sampled.width), height_(sampled.height), samples_(samples_per_pixel) {
    constexpr uint32_t MAX_SIDE = 1024; // a square of it is numbered in 20 bits
    while (group_side_ < MAX_SIDE &&
           uint64_t(4) * group_side_ * group_side_ * samples_ <= rays_per_group)
        group_side_ *= 2;
    group_samples_ = group_side_ > 1 ? samples_ : std::min(samples_, rays_per_group);
    side_ = std::max(group_side_, FilmBlocks::BLOCK_SIZE);
    across_ = (width_ + side_ - 1) / side_;
    down_ = (height_ + side_ - 1) / side_;
}

void WorkItems::collect_pixels(uint32_t item, uint32_t first_code,
                               PixelGroup &group) const {
    const uint32_t left = item % across_ * side_, top = item / across_ * side_;
    const uint32_t count = group_side_ * group_side_;
    group.pixels.clear();
    for (uint32_t code = first_code; code < first_code + count; ++code) {
        const uint32_t column = left + even_bits(code), row = top + even_bits(code >> 1);
        if (column < width_ && row < height_)
            group.pixels.push_back({column, row});
    }
    group.side = group.pixels.size() == count ? group_side_ : 0;
}

} // namespace mlrt
