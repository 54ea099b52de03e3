#include "render/film_blocks.h"

#include "base/check.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

namespace {

FloatPacket side_by_side(const PointPacket &a, const PointPacket &b, const PointPacket &c,
                         const PointPacket &d) {
    return FloatPacket(FloatBlock(a, b), FloatBlock(c, d));
}
FloatPacket four_times(const PointPacket &a) {
    return side_by_side(a, a, a, a);
}

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
    weights.taps = taps();
    MLRT_CHECK(weights.taps <= Footprint::MOST_TAPS);
    constexpr int width = int(PACKET_WIDTH);
    const FloatPacket lane = lane_numbers();
    for (int i = 0; i < weights.taps; i += width) {
        store(&weights.columns[i], filter_.weight(FloatPacket(left) + (lane + float(i))));
        store(&weights.rows[i], filter_.weight(FloatPacket(top) + (lane + float(i))));
    }
    return weights;
}

// The first entry of the footprint of a pixel's samples.
float *FilmBlocks::corner_of(Pixel pixel) {
    MLRT_CHECK(pixel.column < sampled_.width && pixel.row < sampled_.height);
    const uint32_t block =
        pixel.row / BLOCK_SIZE * blocks_across_ + pixel.column / BLOCK_SIZE;
    const uint32_t inner_column = pixel.column % BLOCK_SIZE,
                   inner_row = pixel.row % BLOCK_SIZE;
    // The buffer begins `reach` pixels before the block.
    return sums_.data() + ((size_t(block) * stride_ + inner_row) * stride_ + inner_column) *
                              (channel_count_ + 1);
}

void FilmBlocks::add(uint32_t column, uint32_t row, size_t first, size_t count,
                     const float *x, const float *y, const float *const *values) {
    float *corner = corner_of({column, row});
    const int reach = filter_.reach();
    const float center_x = float(sampled_.x + int(column) - reach) + 0.5f;
    const float center_y = float(sampled_.y + int(row) - reach) + 0.5f;
    for (size_t i = first; i < first + count; ++i) {
        const Footprint weights = footprint(center_x - x[i], center_y - y[i]);
        if (!errors_.empty())
            spread_compensated(corner, weights, values, i);
        else
            spread(corner, weights, values, i);
    }
}

// As a footprint, of the samples of a packet; and with each colour's weight in front of it.
struct FilmBlocks::PacketWeights {
    FloatPacket columns[Footprint::MOST_TAPS], rows[Footprint::MOST_TAPS];
    float entries[PACKET_WIDTH][4];
};

void FilmBlocks::add(const PixelGroup &group, const float *x, const float *y,
                     const float *const *values) {
    if (errors_.empty() && channel_count_ == 3) {
        PacketWeights weights;
        for (size_t ray = 0; ray < group.ray_count(); ray += PACKET_WIDTH)
            add_colours(group, ray, x, y, values, weights);
        return;
    }
    for (size_t i = 0; i < group.offsets.size(); ++i) {
        const Pixel pixel = group.pixel(i);
        add(pixel.column, pixel.row, i * group.sample_count, group.sample_count, x, y,
            values);
    }
}

// The samples from the given one on, as many as a packet holds.
void FilmBlocks::add_colours(const PixelGroup &group, size_t first, const float *x,
                             const float *y, const float *const *values,
                             PacketWeights &weights) {
    const uint32_t count =
        uint32_t(std::min<size_t>(PACKET_WIDTH, group.ray_count() - first));
    const int reach = filter_.reach();
    // Lanes behind the last sample repeat it.
    LaneArray<float> center_x, center_y;
    size_t number = first / group.sample_count;
    size_t next = (number + 1) * group.sample_count; // first sample of the next pixel
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
        const size_t sample = first + std::min(lane, count - 1);
        if (sample == next) {
            ++number;
            next += group.sample_count;
        }
        const Pixel pixel = group.pixel(number);
        center_x[lane] = float(sampled_.x + int(pixel.column) - reach) + 0.5f;
        center_y[lane] = float(sampled_.y + int(pixel.row) - reach) + 0.5f;
        weights.entries[lane][0] = 1;
        for (int k = 0; k < 3; ++k)
            weights.entries[lane][1 + k] = values[k][sample];
    }
    const FloatPacket left = load<FloatPacket>(center_x) - load<FloatPacket>(x + first);
    const FloatPacket top = load<FloatPacket>(center_y) - load<FloatPacket>(y + first);
    for (int i = 0; i < taps(); ++i) {
        weights.columns[i] = filter_.weight(left + FloatPacket(float(i)));
        weights.rows[i] = filter_.weight(top + FloatPacket(float(i)));
    }
    size_t pixel = first / group.sample_count;
    for (uint32_t begin = 0; begin < count; ++pixel) {
        const size_t next = (pixel + 1) * group.sample_count;
        const uint32_t end = uint32_t(std::min<size_t>(count, next - first));
        spread_colours(corner_of(group.pixel(pixel)), weights, begin, end);
        begin = end;
    }
}

// The same as spread() of samples of one pixel, of which sums stay in registers, four taps
// of a row side by side with weight and colours: 1 * weight is exact.
void FilmBlocks::spread_colours(float *corner, const PacketWeights &weights, uint32_t begin,
                                uint32_t end) const {
    constexpr int SIDE_BY_SIDE = 4;
    const auto column = [&](int i, uint32_t sample) {
        return PointPacket(weights.columns[i].entry(sample));
    };
    int first = 0;
    for (; first + SIDE_BY_SIDE <= taps(); first += SIDE_BY_SIDE) {
        FloatPacket entries[PACKET_WIDTH], columns[PACKET_WIDTH];
        for (uint32_t sample = begin; sample < end; ++sample) {
            entries[sample] = four_times(load<PointPacket>(weights.entries[sample]));
            columns[sample] =
                side_by_side(column(first, sample), column(first + 1, sample),
                             column(first + 2, sample), column(first + 3, sample));
        }
        for (int j = 0; j < taps(); ++j) {
            float *out = corner + (size_t(j) * stride_ + size_t(first)) * 4;
            FloatPacket sums = load<FloatPacket>(out);
            for (uint32_t sample = begin; sample < end; ++sample)
                sums = fused(entries[sample],
                             columns[sample] * FloatPacket(weights.rows[j].entry(sample)),
                             sums);
            store(out, sums);
        }
    }
    for (; first < taps(); ++first)
        for (int j = 0; j < taps(); ++j) {
            float *out = corner + (size_t(j) * stride_ + size_t(first)) * 4;
            PointPacket sums = load<PointPacket>(out);
            for (uint32_t sample = begin; sample < end; ++sample)
                sums = fused(load<PointPacket>(weights.entries[sample]),
                             column(first, sample) *
                                 PointPacket(weights.rows[j].entry(sample)),
                             sums);
            store(out, sums);
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

const float *FilmBlocks::at(uint32_t block, int column, int row) const {
    return sums_.data() +
           ((size_t(block) * stride_ + uint32_t(row)) * stride_ + uint32_t(column)) *
               (channel_count_ + 1);
}

// Blocks whose pixels lie within reach of one, along one axis.
struct FilmBlocks::BlockRange {
    int first, last;
};
FilmBlocks::BlockRange FilmBlocks::blocks_near(int position, uint32_t blocks) const {
    const int reach = filter_.reach(), size = int(BLOCK_SIZE);
    return {std::max(position - reach, 0) / size,
            std::min((position + reach) / size, int(blocks) - 1)};
}

template <typename Visit>
void FilmBlocks::for_each_entry(int column, int row, BlockRange down, Visit &&visit) const {
    const int reach = filter_.reach(), size = int(BLOCK_SIZE);
    const BlockRange across = blocks_near(column, blocks_across_);
    for (int j = down.first; j <= down.last; ++j)
        for (int i = across.first; i <= across.last; ++i)
            visit(at(uint32_t(j) * blocks_across_ + uint32_t(i), column - i * size + reach,
                     row - j * size + reach));
}

float FilmBlocks::pixel(uint32_t crop_column, uint32_t crop_row, float *sums) const {
    const int column = int(film_.crop_x + crop_column) - sampled_.x;
    const int row = int(film_.crop_y + crop_row) - sampled_.y;
    float weight = 0;
    std::fill_n(sums, channel_count_, 0.0f);
    for_each_entry(column, row, blocks_near(row, blocks_down_), [&](const float *in) {
        weight += in[0];
        for (uint32_t k = 0; k < channel_count_; ++k)
            sums[k] += in[1 + k];
    });
    return weight;
}

void FilmBlocks::develop_colours(uint32_t crop_row, float *colours) const {
    const int left = int(film_.crop_x) - sampled_.x;
    const int row = int(film_.crop_y + crop_row) - sampled_.y;
    const BlockRange down = blocks_near(row, blocks_down_);
    for (uint32_t column = 0; column < film_.crop_width; ++column, colours += 3) {
        PointPacket sums(0.0f);
        for_each_entry(left + int(column), row, down,
                       [&](const float *in) { sums = sums + load<PointPacket>(in); });
        const float weight = sums.entry(0);
        const PointPacket quotients = sums / PointPacket(weight == 0 ? 1.0f : weight);
        for (size_t k = 0; k < 3; ++k)
            colours[k] = quotients.entry(1 + k);
    }
}

} // namespace mlrt
