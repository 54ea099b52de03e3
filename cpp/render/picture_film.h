// The film of a picture: samples in, the finished values of pixels out.
#pragma once

#include "render/film_blocks.h"
#include "render/pixel_group.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace mlrt {

// Where the values of a channel go: data[stride * pixel], pixels of the crop row by row.
struct FilmChannel {
    float *data = nullptr;
    uint32_t stride = 1;
};

// Red, green and blue of a pixel side by side in `image`, then whatever else there is.
struct FilmTarget {
    float *image = nullptr;
    std::vector<FilmChannel> others;
};

// What becomes of samples depends on the film and their number only, bit for bit, not on
// how they are grouped. With a box filter a pixel is finished with its last sample; wider
// filters need blocks, and a second step.
class PictureFilm {
public:
    PictureFilm(const Film &film, uint32_t samples_per_pixel, FilmTarget target);

    static constexpr uint32_t COLOURS = 3;

    const PixelRect &sampled() const { return sampled_; }
    uint32_t channel_count() const { return COLOURS + uint32_t(target_.others.size()); }

    // Whether a sample's position matters, and not only the pixel that it lies in.
    bool needs_positions() const { return blocks_.has_value(); }

    // Adds the samples of a group, which lie at (x[i], y[i]) on the film and have
    // values[channel][i], channels as in the target. The groups of a pixel come in the
    // order of samples; calls for groups of one block must not overlap in time.
    void add(const PixelGroup &group, const float *x, const float *y,
             const float *const *values);

    // Rows that are left to do with finish_row() once all samples are there, each by
    // itself.
    uint32_t rows_to_finish() const { return blocks_ ? film_.crop_height : 0; }
    void finish_row(uint32_t row);

    // The pixel's number in the crop; false if it lies outside.
    bool in_crop(Pixel pixel, size_t &number) const {
        const uint32_t column = pixel.column + uint32_t(sampled_.x) - film_.crop_x;
        const uint32_t row = pixel.row + uint32_t(sampled_.y) - film_.crop_y;
        number = size_t(row) * film_.crop_width + column;
        return column < film_.crop_width && row < film_.crop_height;
    }

private:
    // In a crop that is all that is sampled.
    size_t number_of(Pixel pixel) const {
        return size_t(pixel.row) * sampled_.width + pixel.column;
    }
    float &channel(uint32_t k, size_t pixel) {
        if (k < COLOURS)
            return target_.image[COLOURS * pixel + k];
        const FilmChannel &other = target_.others[k - COLOURS];
        return other.data[other.stride * pixel];
    }
    void write_pixels(const PixelGroup &group, const float *const *values);
    void write_square(const PixelGroup &group, const float *const *values);
    void write_means(const PixelGroup &group, const float *const *values);
    void add_whole_pixels(const PixelGroup &group, const float *const *values);

    Film film_;
    uint32_t samples_per_pixel_;
    FilmTarget target_;
    PixelRect sampled_;
    std::optional<FilmBlocks> blocks_; // unless the filter is a box
    std::vector<float> errors_; // of the sums of a box: pixel, channel; if compensated
};

} // namespace mlrt
