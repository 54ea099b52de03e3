#include "render/work_items.h"

#include "base/morton.h"

#include <algorithm>

namespace mlrt {

WorkItems::WorkItems(const PixelRect &sampled, uint32_t samples_per_pixel,
                     uint32_t rays_per_group)
    : width_(sampled.width), height_(sampled.height), samples_(samples_per_pixel) {
    while (group_side_ < PixelGroup::MAX_SIDE &&
           uint64_t(4) * group_side_ * group_side_ * samples_ <= rays_per_group)
        group_side_ *= 2;
    group_samples_ = group_side_ > 1 ? samples_ : std::min(samples_, rays_per_group);
    side_ = std::max(group_side_, FilmBlocks::BLOCK_SIZE);
    across_ = (width_ + side_ - 1) / side_;
    down_ = (height_ + side_ - 1) / side_;
    for (uint32_t code = 0; code < group_side_ * group_side_; ++code) {
        const MortonPoint at = of_morton_code(code);
        square_.push_back({at.column, at.row});
    }
}

PixelGroup WorkItems::group_at(uint32_t item, uint32_t number,
                               std::vector<Pixel> &clipped) const {
    const MortonPoint at = of_morton_code(number);
    PixelGroup group;
    group.left = item % across_ * side_ + at.column * group_side_;
    group.top = item / across_ * side_ + at.row * group_side_;
    if (group.left + group_side_ <= width_ && group.top + group_side_ <= height_) {
        group.side = group_side_;
        group.offsets = square_;
        return group;
    }
    clipped.clear();
    for (const Pixel offset : square_)
        if (group.left + offset.column < width_ && group.top + offset.row < height_)
            clipped.push_back(offset);
    group.offsets = clipped;
    return group;
}

} // namespace mlrt
