#include "render/picture_film.h"

#include "base/morton.h"
#include "base/pixel_block.h"
#include "base/streamed.h"
#include "base/transpose.h"

#include <algorithm>
#include <array>
#include <utility>

namespace mlrt {

PictureFilm::PictureFilm(const Film &film, uint32_t samples_per_pixel, FilmTarget target)
    : film_(film), samples_per_pixel_(samples_per_pixel), target_(std::move(target)) {
    const ReconstructionFilter filter(film);
    sampled_ = sampled_pixels(film, filter);
    if (!filter.is_box())
        blocks_.emplace(film, channel_count(), samples_per_pixel);
    else if (samples_per_pixel > MOST_PLAIN_SUMMANDS)
        errors_.resize(size_t(channel_count()) * sampled_.width * sampled_.height);
}

void PictureFilm::add(const PixelGroup &group, const float *x, const float *y,
                      const float *const *values) {
    if (!blocks_) {
        if (samples_per_pixel_ == 1)
            write_pixels(group, values);
        else
            add_whole_pixels(group, values);
        return;
    }
    blocks_->add(group, x, y, values);
}

// A packet of a square's rays is a block of four by four pixels. Rows of blocks are put
// together before they are written: rows of a picture may lie so far apart that a cache
// keeps only a few of them at once.
void PictureFilm::write_square(const PixelGroup &group, const float *const *values) {
    constexpr uint32_t STRIP = 64; // pixels along a row that are put together; chosen
    std::array<std::array<float, COLOURS * STRIP>, PIXEL_BLOCK> rows;
    const uint32_t width = std::min(STRIP, group.side);
    for (uint32_t top = 0; top < group.side; top += PIXEL_BLOCK)
        for (uint32_t left = 0; left < group.side; left += width) {
            for (uint32_t column = 0; column < width; column += PIXEL_BLOCK) {
                const uint32_t ray = morton_code(left + column, top);
                store_pixel_block(rows[0].data() + COLOURS * column, rows[0].size(),
                                  load<FloatPacket>(values[0] + ray),
                                  load<FloatPacket>(values[1] + ray),
                                  load<FloatPacket>(values[2] + ray));
            }
            for (uint32_t row = 0; row < PIXEL_BLOCK; ++row) {
                const Pixel first{group.left + left, group.top + top + row};
                stream(target_.image + COLOURS * number_of(first), rows[row].data(),
                       COLOURS * width);
            }
        }
    finish_streaming();
}

// With a box filter the sampled rectangle is the crop.
void PictureFilm::write_pixels(const PixelGroup &group, const float *const *values) {
    const bool in_blocks = group.side >= PIXEL_BLOCK;
    if (in_blocks)
        write_square(group, values);
    for (size_t i = 0; !in_blocks && i < group.offsets.size(); ++i) {
        float *out = target_.image + COLOURS * number_of(group.pixel(i));
        for (uint32_t k = 0; k < COLOURS; ++k)
            out[k] = values[k][i];
    }
    for (uint32_t k = COLOURS; k < channel_count(); ++k)
        for (size_t i = 0; i < group.offsets.size(); ++i)
            channel(k, number_of(group.pixel(i))) = values[k][i];
}

namespace {

// Of the samples of sixteen pixels, a multiple of four each, pixel by pixel: added one
// after the other, sixteen sums at a time.
FloatPacket sums_of(const float *values, uint32_t sample_count) {
    FloatPacket sums(0.0f);
    for (uint32_t sample = 0; sample < sample_count; sample += 4)
        for (const FloatPacket &samples : load_four_columns(values + sample, sample_count))
            sums = sums + samples;
    return sums;
}

} // namespace

// Colours of a square's pixels, all of whose samples are in the group.
void PictureFilm::write_means(const PixelGroup &group, const float *const *values) {
    const auto divisor = FloatPacket(float(samples_per_pixel_));
    const uint32_t samples = group.sample_count;
    for (size_t i = 0; i < group.offsets.size(); i += PACKET_WIDTH) {
        const auto means = [&](uint32_t k) {
            return sums_of(values[k] + i * samples, samples) / divisor;
        };
        store_pixel_block(target_.image + COLOURS * number_of(group.pixel(i)),
                          size_t(COLOURS) * sampled_.width, means(0), means(1), means(2));
    }
}

// A pixel whose samples come in several groups keeps their sum until the last one.
void PictureFilm::add_whole_pixels(const PixelGroup &group, const float *const *values) {
    const bool first = group.first_sample == 0;
    const bool last = group.first_sample + group.sample_count == samples_per_pixel_;
    const float divisor = last ? float(samples_per_pixel_) : 1.0f;
    const bool in_blocks = first && last && errors_.empty() && group.side >= PIXEL_BLOCK &&
                           group.sample_count % 4 == 0;
    if (in_blocks)
        write_means(group, values);
    for (uint32_t k = in_blocks ? COLOURS : 0; k < channel_count(); ++k) {
        const float *value = values[k];
        for (size_t i = 0; i < group.offsets.size(); ++i) {
            const size_t number = number_of(group.pixel(i));
            float &out = channel(k, number);
            float sum = first ? 0.0f : out;
            if (errors_.empty()) {
                for (uint32_t sample = 0; sample < group.sample_count; ++sample)
                    sum += *value++;
            } else {
                float &error = errors_[number * channel_count() + k];
                for (uint32_t sample = 0; sample < group.sample_count; ++sample)
                    add_compensated(*value++, sum, error);
            }
            out = sum / divisor;
        }
    }
}

// Divides the sums by their weights (Mitsuba's hdrfilm.cpp, develop).
void PictureFilm::finish_row(uint32_t row) {
    if (channel_count() == COLOURS) {
        blocks_->develop_colours(row,
                                 target_.image + COLOURS * size_t(row) * film_.crop_width);
        return;
    }
    std::vector<float> sums(channel_count());
    for (uint32_t column = 0; column < film_.crop_width; ++column) {
        const float weight = blocks_->pixel(column, row, sums.data());
        const float divisor = weight == 0 ? 1.0f : weight;
        for (uint32_t k = 0; k < channel_count(); ++k)
            channel(k, size_t(row) * film_.crop_width + column) = sums[k] / divisor;
    }
}

} // namespace mlrt
