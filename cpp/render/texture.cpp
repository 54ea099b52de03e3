#include "render/texture.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

namespace {

Vec3f value_at(const Texture &texture, size_t texel) {
    if (texture.channels == 1) {
        const float value = texture.texels[texel];
        return {value, value, value};
    }
    return {texture.texels[3 * texel], texture.texels[3 * texel + 1],
            texture.texels[3 * texel + 2]};
}

Vec2f transformed(const Texture &texture, Vec2f uv) {
    const auto coordinate = [&](const Vec3f &row) {
        return std::fma(row.y, uv.y, std::fma(row.x, uv.x, row.z));
    };
    return {coordinate(texture.to_uv[0]), coordinate(texture.to_uv[1])};
}

// Fraction of a whole number below a, the squares of a checkerboard are halves of.
bool in_second_half(float a) {
    return a - std::floor(a) > 0.5f;
}

// The whole number below a; 0 for what is far beyond any image, or not a number.
int64_t floor_to_integer(float a) {
    constexpr float FAR = 1e15f;
    return std::abs(a) < FAR ? int64_t(std::floor(a)) : 0;
}

Vec3f nearest_texel(const Texture &texture, Vec2f uv) {
    const int64_t column = floor_to_integer(uv.x * float(texture.width));
    const int64_t row = floor_to_integer(uv.y * float(texture.height));
    return value_at(texture, size_t(wrapped_texel(row, texture.height, texture.wrap)) *
                                     texture.width +
                                 wrapped_texel(column, texture.width, texture.wrap));
}

Vec3f bilinear(const Texture &texture, Vec2f uv) {
    const float x = std::fma(uv.x, float(texture.width), -0.5f);
    const float y = std::fma(uv.y, float(texture.height), -0.5f);
    const int64_t left = floor_to_integer(x), top = floor_to_integer(y);
    const float right_weight = x - float(left), bottom_weight = y - float(top);
    const float weights_x[2] = {1.0f - right_weight, right_weight};
    const float weights_y[2] = {1.0f - bottom_weight, bottom_weight};
    uint32_t columns[2], rows[2];
    for (int k = 0; k < 2; ++k) {
        columns[k] = wrapped_texel(left + k, texture.width, texture.wrap);
        rows[k] = wrapped_texel(top + k, texture.height, texture.wrap);
    }
    Vec3f sum{};
    for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i) {
            const float weight = weights_x[i] * weights_y[j];
            const Vec3f texel =
                value_at(texture, size_t(rows[j]) * texture.width + columns[i]);
            for (int k = 0; k < 3; ++k)
                sum[k] = std::fma(texel[k], weight, sum[k]);
        }
    return sum;
}

Vec3f interpolated(const Texture &texture, const TexturePoint &at) {
    const Vec3f a = value_at(texture, at.vertices[0] - texture.first);
    const Vec3f b = value_at(texture, at.vertices[1] - texture.first);
    const Vec3f c = value_at(texture, at.vertices[2] - texture.first);
    Vec3f mean;
    for (int k = 0; k < 3; ++k)
        mean[k] =
            std::fma(a[k], at.weights.x, std::fma(b[k], at.weights.y, c[k] * at.weights.z));
    return mean;
}

} // namespace

// Mirror reflects every other period of the image.
uint32_t wrapped_texel(int64_t position, uint32_t size, WrapMode mode) {
    if (position >= 0 && position < int64_t(size))
        return uint32_t(position);
    if (mode == WrapMode::clamp)
        return position < 0 ? 0 : size - 1;
    const int64_t period = position >= 0 ? position / size : (position + 1) / size - 1;
    const uint32_t rest = uint32_t(position - period * size);
    return mode == WrapMode::mirror && period % 2 != 0 ? size - 1 - rest : rest;
}

Vec3f evaluate(const std::vector<Texture> &textures, uint32_t number,
               const TexturePoint &at) {
    const Texture &texture = textures[number];
    switch (texture.type) {
    case TextureType::constant:
        break;
    case TextureType::checkerboard: {
        const Vec2f uv = transformed(texture, at.uv);
        const bool second = in_second_half(uv.x) != in_second_half(uv.y);
        return evaluate(textures, texture.squares[second], at);
    }
    case TextureType::bitmap: {
        const Vec2f uv = transformed(texture, at.uv);
        return texture.nearest ? nearest_texel(texture, uv) : bilinear(texture, uv);
    }
    case TextureType::vertex_attribute:
        return interpolated(texture, at);
    case TextureType::face_attribute:
        return value_at(texture, at.face - texture.first);
    }
    return texture.colour;
}

} // namespace mlrt
