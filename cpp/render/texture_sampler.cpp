#include "render/texture_sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace mlrt {

namespace {

// Of linear RGB (Mitsuba's core/spectrum.h).
float luminance(const Texture &texture, size_t texel) {
    if (texture.channels == 1)
        return texture.texels[texel];
    return texture.texels[3 * texel] * 0.212671f +
           texture.texels[3 * texel + 1] * 0.715160f +
           texture.texels[3 * texel + 2] * 0.072169f;
}

struct Place {
    uint32_t index;
    float before, sum; // of the entries before it, and with it
};

// The first sum that is not less than the target.
Place find(std::span<const float> sums, float target) {
    const auto found = std::lower_bound(sums.begin(), sums.end() - 1, target);
    const uint32_t index = uint32_t(found - sums.begin());
    return {index, index > 0 ? sums[index - 1] : 0.0f, *found};
}

// The number that chose an entry, made uniform again.
float reused(const Place &place, float target) {
    const float rest = target - place.before, width = place.sum - place.before;
    return width != 0 ? rest / width : rest;
}

// Mitsuba's warp.h, interval_to_tent: from -1 to 1, most likely 0.
float to_tent(float x) {
    const float centred = x - 0.5f;
    const float root = std::sqrt(std::max(std::fma(std::abs(centred), -2.0f, 1.0f), 0.0f));
    return std::copysign(1.0f - root, centred);
}

float into_unit_interval(float a, WrapMode wrap) {
    if (a < 0)
        return wrap == WrapMode::repeat ? a + 1.0f : -a;
    if (a > 1)
        return wrap == WrapMode::repeat ? a - 1.0f : 2.0f - a;
    return a;
}

} // namespace

TextureSampler::TextureSampler(const Texture &texture) {
    if (texture.type != TextureType::bitmap)
        return;
    width_ = texture.width;
    height_ = texture.height;
    nearest_ = texture.nearest;
    wrap_ = texture.wrap;
    along_rows_.reserve(size_t(width_) * height_);
    rows_.reserve(height_);
    double all = 0;
    for (uint32_t row = 0; row < height_; ++row) {
        double sum = 0;
        for (uint32_t column = 0; column < width_; ++column) {
            sum += double(luminance(texture, size_t(row) * width_ + column));
            along_rows_.push_back(float(sum));
        }
        all += sum;
        rows_.push_back(float(all));
    }
    sum_ = float(all);
    normalization_ = all > 0 ? float(1 / all) : 0.0f;
}

float TextureSampler::texel_probability(uint32_t column, uint32_t row) const {
    const float *sums = along_rows_.data() + size_t(row) * width_;
    return (sums[column] - (column > 0 ? sums[column - 1] : 0.0f)) * normalization_;
}

TextureSampler::Sample TextureSampler::sample(float x, float y) const {
    constexpr float SMALLEST = std::numeric_limits<float>::min();
    constexpr float LARGEST = 1 - 0x1p-24f;
    if (width_ == 0)
        return {{x, y}, 1.0f};
    if (normalization_ == 0)
        return {{x, y}, 0.0f};
    const float row_target = std::clamp(y, SMALLEST, LARGEST) * sum_;
    const Place row = find(rows_, row_target);
    const std::span<const float> sums(along_rows_.data() + size_t(row.index) * width_,
                                      width_);
    const float column_target = std::clamp(x, SMALLEST, LARGEST) * sums.back();
    const Place column = find(sums, column_target);
    const float within_x = reused(column, column_target),
                within_y = reused(row, row_target);

    const float step_u = 1.0f / float(width_), step_v = 1.0f / float(height_);
    Vec2f uv;
    if (nearest_) {
        uv = {(float(column.index) + within_x) * step_u,
              (float(row.index) + within_y) * step_v};
    } else {
        uv = {(float(column.index) + 0.5f + to_tent(within_x)) * step_u,
              (float(row.index) + 0.5f + to_tent(within_y)) * step_v};
        uv = {into_unit_interval(uv.x, wrap_), into_unit_interval(uv.y, wrap_)};
    }
    return {uv, density(uv)};
}

float TextureSampler::density(Vec2f uv) const {
    if (width_ == 0)
        return 1;
    const float texels = float(width_) * float(height_);
    const auto probability = [&](int64_t column, int64_t row) {
        return texel_probability(wrapped_texel(column, width_, wrap_),
                                 wrapped_texel(row, height_, wrap_));
    };
    if (nearest_)
        return probability(int64_t(std::floor(uv.x * float(width_))),
                           int64_t(std::floor(uv.y * float(height_)))) *
               texels;
    const float x = std::fma(uv.x, float(width_), -0.5f);
    const float y = std::fma(uv.y, float(height_), -0.5f);
    const int64_t left = int64_t(std::floor(x)), top = int64_t(std::floor(y));
    const float right = x - float(left), bottom = y - float(top);
    const auto along_row = [&](int64_t row) {
        return std::fma(1.0f - right, probability(left, row),
                        right * probability(left + 1, row));
    };
    return std::fma(1.0f - bottom, along_row(top), bottom * along_row(top + 1)) * texels;
}

} // namespace mlrt
