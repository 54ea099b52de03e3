// Points of a texture that glows, chosen more often where it is brighter.
#pragma once

#include "render/texture.h"

#include <cstdint>
#include <vector>

namespace mlrt {

// Mitsuba 3.9's bitmap.cpp and texture.cpp, sample_position, and distr_2d.h: in proportion
// to the luminance of the texels of a bitmap, uniform over (u, v) in [0, 1]^2 for any other
// texture. The same numbers give the same points in Mitsuba.
//
// Like Mitsuba it knows nothing of the map to_uv, so that a bitmap that is scaled or turned
// is only sampled less well, except that texels without light are never chosen.
class TextureSampler {
public:
    struct Sample {
        Vec2f uv;
        float density; // per unit square; 0: no light
    };

    // Uniform.
    TextureSampler() = default;

    explicit TextureSampler(const Texture &texture);

    // x and y are uniform in [0, 1).
    Sample sample(float x, float y) const;

    float density(Vec2f uv) const;

private:
    float texel_probability(uint32_t column, uint32_t row) const;

    uint32_t width_ = 0, height_ = 0; // 0: uniform
    bool nearest_ = false;
    WrapMode wrap_ = WrapMode::repeat;
    // Sums of luminances along each row, up to and including each texel, and of all rows.
    std::vector<float> along_rows_, rows_;
    float sum_ = 0, normalization_ = 0; // 1 / sum, 0 if there is no light
};

} // namespace mlrt
