#include "render/film_blocks.h"

#include "base/check.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

namespace {

uint32_t divide_up(uint32_t a, uint32_t b) {
    return (a + b - 1) / b;
}

} // namespace

FilmBlocks::FilmBlocks(const Film &film, uint32_t channel_count, uint32_t samples_per_pixel)
    : film_(film), filter_(film), sampled_(sampled_pixels(film, filter_)),
      channel_count_(channel_count), blocks_across_(divide_up(sampled_.width, BLOCK_SIZE)),
      blocks_down_(divide_up(sampled_.height, BLOCK_SIZE)),
      stride_(BLOCK_SIZE + 2 * uint32_t(filter_.reach())) {
    sums_.resize(size_t(blocks_across_) * blocks_down_ * stride_ * stride_ *
                 (channel_count_ + 1));
    if (samples_per_pixel > MOST_PLAIN_SUMMANDS)
        errors_.resize(sums_.size());
}

// Weights of a sample's pixels, of which the first lies (left, top) from it.
struct FilmBlocks::Footprint {
    static constexpr int MOST_TAPS = 64;
    int taps;
    float columns[MOST_TAPS], rows[MOST_TAPS];
};

FilmBlocks::Footprint FilmBlocks::footprint(float left, float top) const {
    Footprint weights;
    weights.taps = 2 * filter_.reach() + 1;
    MLRT_CHECK(weights.taps <= Footprint::MOST_TAPS);
    constexpr int width = int(PACKET_WIDTH);
    const FloatPacket lane = lane_numbers();
    for (int i = 0; i < weights.taps; i += width) {
        store(&weights.columns[i], filter_.weight(FloatPacket(left) + (lane + float(i))));
        store(&weights.rows[i], filter_.weight(FloatPacket(top) + (lane + float(i))));
    }
    return weights;
}

void FilmBlocks::add(uint32_t column, uint32_t row, size_t first, size_t count,
                     const float *x, const float *y, const float *const *values) {
    MLRT_CHECK(column < sampled_.width && row < sampled_.height);
    const uint32_t block = row / BLOCK_SIZE * blocks_across_ + column / BLOCK_SIZE;
    const uint32_t inner_column = column % BLOCK_SIZE, inner_row = row % BLOCK_SIZE;
    const size_t entry = channel_count_ + 1;
    // The buffer begins `reach` pixels before the block: this is the footprint's first
    // entry.
    float *corner =
        sums_.data() +
        ((size_t(block) * stride_ + inner_row) * stride_ + inner_column) * entry;
    const int reach = filter_.reach();
    const float center_x = float(sampled_.x + int(column) - reach) + 0.5f;
    const float center_y = float(sampled_.y + int(row) - reach) + 0.5f;
    for (size_t i = first; i < first + count; ++i) {
        const Footprint weights = footprint(center_x - x[i], center_y - y[i]);
        if (!errors_.empty())
            spread_compensated(corner, weights, values, i);
        else if (channel_count_ == 3)
            spread_colour(corner, weights, values, i);
        else
            spread(corner, weights, values, i);
    }
}

void FilmBlocks::spread(float *corner, const Footprint &weights, const float *const *values,
                        size_t sample) const {
    const size_t entry = channel_count_ + 1;
    for (int j = 0; j < weights.taps; ++j) {
        float *out = corner + size_t(j) * stride_ * entry;
        for (int i = 0; i < weights.taps; ++i, out += entry) {
            const float weight = weights.columns[i] * weights.rows[j];
            out[0] += weight;
            for (uint32_t k = 0; k < channel_count_; ++k)
                out[1 + k] = std::fma(values[k][sample], weight, out[1 + k]);
        }
    }
}

void FilmBlocks::spread_compensated(float *corner, const Footprint &weights,
                                    const float *const *values, size_t sample) {
    const size_t entry = channel_count_ + 1;
    for (int j = 0; j < weights.taps; ++j) {
        float *out = corner + size_t(j) * stride_ * entry;
        for (int i = 0; i < weights.taps; ++i, out += entry) {
            const float weight = weights.columns[i] * weights.rows[j];
            float *errors = errors_.data() + (out - sums_.data());
            add_compensated(weight, out[0], errors[0]);
            for (uint32_t k = 0; k < channel_count_; ++k)
                add_compensated(values[k][sample] * weight, out[1 + k], errors[1 + k]);
        }
    }
}

// The same as spread() with the weight and three channels side by side: 1 * weight is
// exact.
void FilmBlocks::spread_colour(float *corner, const Footprint &weights,
                               const float *const *values, size_t sample) const {
    const PointPacket entry(1.0f, values[0][sample], values[1][sample], values[2][sample]);
    for (int j = 0; j < weights.taps; ++j) {
        float *out = corner + size_t(j) * stride_ * 4;
        for (int i = 0; i < weights.taps; ++i, out += 4)
            store(out, fused(entry, PointPacket(weights.columns[i] * weights.rows[j]),
                             load<PointPacket>(out)));
    }
}

const float *FilmBlocks::at(uint32_t block, int column, int row) const {
    return sums_.data() +
           ((size_t(block) * stride_ + uint32_t(row)) * stride_ + uint32_t(column)) *
               (channel_count_ + 1);
}

float FilmBlocks::pixel(uint32_t crop_column, uint32_t crop_row, float *sums) const {
    const int reach = filter_.reach();
    const int column = int(film_.crop_x + crop_column) - sampled_.x;
    const int row = int(film_.crop_y + crop_row) - sampled_.y;
    const int size = int(BLOCK_SIZE);
    // Blocks whose pixels lie within reach of this one.
    const int first_across = std::max(column - reach, 0) / size;
    const int last_across = std::min((column + reach) / size, int(blocks_across_) - 1);
    const int first_down = std::max(row - reach, 0) / size;
    const int last_down = std::min((row + reach) / size, int(blocks_down_) - 1);

    float weight = 0;
    std::fill_n(sums, channel_count_, 0.0f);
    for (int down = first_down; down <= last_down; ++down) {
        for (int across = first_across; across <= last_across; ++across) {
            const float *in = at(uint32_t(down) * blocks_across_ + uint32_t(across),
                                 column - across * size + reach, row - down * size + reach);
            weight += in[0];
            for (uint32_t k = 0; k < channel_count_; ++k)
                sums[k] += in[1 + k];
        }
    }
    return weight;
}

} // namespace mlrt
