// Textures: values that vary over surfaces, as plain data and their evaluation.
#pragma once

#include "base/vec.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace mlrt {

enum class TextureType : uint32_t {
    constant,
    checkerboard,
    bitmap,
    vertex_attribute,
    face_attribute
};

enum class WrapMode : uint32_t { repeat, mirror, clamp };

// Numbers of an image or of a mesh: floats, or bytes with what each byte stands for.
struct Texels {
    std::vector<float> values;
    std::vector<uint8_t> bytes;
    std::array<float, 256> decoded{};

    size_t size() const { return values.size() + bytes.size(); } // one of them is empty
    float operator[](size_t i) const {
        return bytes.empty() ? values[i] : decoded[bytes[i]];
    }
};

struct Texture {
    TextureType type = TextureType::constant;
    Vec3f colour{}; // constant
    // Checkerboard, bitmap: rows of the affine map from a surface's (u, v, 1) to (u, v)
    // here.
    std::array<Vec3f, 2> to_uv{{{1, 0, 0}, {0, 1, 0}}};
    // Checkerboard: textures of its squares, of lower numbers than its own. The first is
    // that of the square at the origin.
    std::array<uint32_t, 2> squares{};
    // Bitmap, in rows from v = 0.
    uint32_t width = 0, height = 0;
    bool nearest = false; // else bilinear
    WrapMode wrap = WrapMode::repeat;
    // Attribute: the number, in the scene, of its first vertex or face.
    uint32_t first = 0;
    // Bitmap, attribute: texels have one channel or three side by side.
    uint32_t channels = 3;
    Texels texels;
};

// Where a texture is asked for.
struct TexturePoint {
    Vec2f uv; // of the surface
    uint32_t face = 0;
    std::array<uint32_t, 3> vertices{}; // of the face
    Vec3f weights{};                    // of the vertices
};

// Where a place in a row or column of texels lies in the image, as the mode has it.
uint32_t wrapped_texel(int64_t position, uint32_t size, WrapMode mode);

// Value of a texture, one channel spread over all three. The same operations in the same
// order as in Mitsuba 3.9 (bitmap.cpp with Dr.Jit's texture_impl.h, checkerboard.cpp,
// mesh.h), but that weights of vertices are those of the hit and not computed anew.
Vec3f evaluate(const std::vector<Texture> &textures, uint32_t number,
               const TexturePoint &at);

} // namespace mlrt
