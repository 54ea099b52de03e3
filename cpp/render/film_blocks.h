// Weighted sums of samples of filters wider than a pixel, accumulated in an order that
// nothing but the film decides.
#pragma once

#include "render/compensated_sum.h"
#include "render/filter.h"
#include "render/pixel_group.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace mlrt {

// The sampled rectangle is cut into square blocks of a fixed size. The samples of a block's
// pixels are added to a buffer of its own, which is wider by the reach of the filter; at
// the end the buffers that overlap at a pixel are added in the order of the blocks. Whoever
// adds the samples of one block in a fixed order therefore gets the same picture from any
// number of threads.
class FilmBlocks {
public:
    static constexpr uint32_t BLOCK_SIZE = 32; // chosen: 32 x 32 x 4 floats are 16 KiB

    // samples_per_pixel: from MOST_PLAIN_SUMMANDS on sums are compensated.
    FilmBlocks(const Film &film, uint32_t channel_count, uint32_t samples_per_pixel);

    const PixelRect &sampled() const { return sampled_; }
    uint32_t channel_count() const { return channel_count_; }

    // Adds samples first to first + count - 1, at film positions (x[i], y[i]) inside the
    // pixel (column, row) of the sampled rectangle, with values[channel][i]. Calls for
    // pixels of one block must not overlap in time.
    void add(uint32_t column, uint32_t row, size_t first, size_t count, const float *x,
             const float *y, const float *const *values);

    // The same for the samples of a group, which come pixel by pixel; arrays are those of
    // whole packets.
    void add(const PixelGroup &group, const float *x, const float *y,
             const float *const *values);

    // Sum of weight * value of one pixel of the crop, for each channel, and of the weights.
    float pixel(uint32_t crop_column, uint32_t crop_row, float *sums) const;

    // Of a row of the crop, if the channels are red, green and blue: the sums over those of
    // the weights, side by side, pixel by pixel.
    void develop_colours(uint32_t crop_row, float *colours) const;

private:
    int taps() const { return 2 * filter_.reach() + 1; } // along a row or column
    struct Footprint;
    Footprint footprint(float left, float top) const;
    void spread(float *corner, const Footprint &weights, const float *const *values,
                size_t sample) const;
    void spread_compensated(float *corner, const Footprint &weights,
                            const float *const *values, size_t sample);
    float *corner_of(Pixel pixel);
    struct PacketWeights;
    void add_colours(const PixelGroup &group, size_t first, const float *x, const float *y,
                     const float *const *values, PacketWeights &weights);
    void spread_colours(float *corner, const PacketWeights &weights, uint32_t begin,
                        uint32_t end) const;
    struct BlockRange;
    BlockRange blocks_near(int position, uint32_t blocks) const;
    template <typename Visit>
    void for_each_entry(int column, int row, BlockRange down, Visit &&visit) const;
    const float *at(uint32_t block, int column, int row) const;

    Film film_;
    ReconstructionFilter filter_;
    PixelRect sampled_;
    uint32_t channel_count_;
    uint32_t blocks_across_ = 0, blocks_down_ = 0;
    uint32_t stride_ = 0;       // pixels along the side of a block's buffer
    std::vector<float> sums_;   // block, row, column, then the weight and the channels
    std::vector<float> errors_; // of the sums, in the same order, if they are compensated
};

} // namespace mlrt
