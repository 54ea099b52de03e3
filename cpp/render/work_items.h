// How the pixels of a picture are dealt to work items and traced in groups.
#pragma once

#include "render/film_blocks.h"
#include "render/pixel_group.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace mlrt {

// The sampled rectangle is cut into squares whose side is a power of two. Pixels of a
// square are taken in Morton order and cut into groups of up to about `rays_per_group`
// rays: all samples of some pixels, or, if one pixel has more samples than that, some
// samples of one pixel.
//
// A square is never smaller than a block of the film, and groups come in Morton order, so
// each block's samples come in the same order whatever the size of a group is.
class WorkItems {
public:
    WorkItems(const PixelRect &sampled, uint32_t samples_per_pixel,
              uint32_t rays_per_group);

    uint32_t count() const { return across_ * down_; }

    // Calls visit(group) for each group of an item, in order.
    template <typename Visit>
    void for_each_group(uint32_t item, Visit &&visit) const {
        std::vector<Pixel> clipped;
        const uint32_t groups = (side_ / group_side_) * (side_ / group_side_);
        for (uint32_t i = 0; i < groups; ++i) {
            PixelGroup group = group_at(item, i, clipped);
            if (group.offsets.empty())
                continue;
            for (uint32_t first = 0; first < samples_; first += group_samples_) {
                group.first_sample = first;
                group.sample_count = std::min(group_samples_, samples_ - first);
                visit(group);
            }
        }
    }

private:
    // Without samples as yet. Those that the edge of the picture cuts keep their pixels in
    // `clipped`.
    PixelGroup group_at(uint32_t item, uint32_t number, std::vector<Pixel> &clipped) const;

    uint32_t width_, height_;
    uint32_t samples_;
    uint32_t group_side_ = 1;    // pixels along the side of a group, a power of two
    uint32_t group_samples_ = 1; // fewer than samples_ only if group_side_ is 1
    uint32_t side_ = FilmBlocks::BLOCK_SIZE;
    uint32_t across_ = 0, down_ = 0;
    std::vector<Pixel> square_; // offsets of the pixels of a whole group
};

} // namespace mlrt
