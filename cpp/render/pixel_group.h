// Which camera rays are traced together.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace mlrt {

struct Pixel {
    uint32_t column = 0, row = 0;
};

// Samples [first_sample, first_sample + sample_count) of each of some pixels. Rays come in
// the order of the pixels and, within each, of samples.
struct PixelGroup {
    static constexpr uint32_t MAX_SIDE = 1024;

    uint32_t left = 0, top = 0;     // on the sampled rectangle
    std::span<const Pixel> offsets; // of the pixels, from (left, top) on
    uint32_t side = 0; // of the square that they fill in Morton order; 0 if they do not
    uint32_t first_sample = 0, sample_count = 0;

    size_t ray_count() const { return offsets.size() * sample_count; }
    Pixel pixel(size_t i) const { return {left + offsets[i].column, top + offsets[i].row}; }
};

} // namespace mlrt
