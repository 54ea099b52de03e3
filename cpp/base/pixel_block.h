// Four by four pixels, from the Morton order that rays have to the rows that pictures have.
#pragma once

#include "base/simd.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace mlrt {

// Pixels along a side.
inline constexpr uint32_t PIXEL_BLOCK = 4;

// Writes red, green and blue of each pixel side by side, row j of the block to
// out + j * stride. Nothing but these rows is written to.
inline void store_pixel_block(float *out, size_t stride, const FloatPacket &red,
                              const FloatPacket &green, const FloatPacket &blue) {
    // The pixels of a row.
    static constexpr std::array<std::array<uint32_t, 4>, 4> ROWS{
        {{0, 1, 4, 5}, {2, 3, 6, 7}, {8, 9, 12, 13}, {10, 11, 14, 15}}};
#if defined(__AVX512F__)
    // Lanes of two packets: those of the second begin at 16.
    struct Indices {
        alignas(64) std::array<uint32_t, 16> red_green{}, and_blue{};
    };
    static constexpr std::array<Indices, 4> INDICES = [] {
        std::array<Indices, 4> indices{};
        for (uint32_t row = 0; row < 4; ++row)
            for (uint32_t i = 0; i < 4; ++i) {
                const uint32_t pixel = ROWS[row][i];
                indices[row].red_green[3 * i] = pixel;
                indices[row].red_green[3 * i + 1] = 16 + pixel;
                indices[row].and_blue[3 * i] = 3 * i;
                indices[row].and_blue[3 * i + 1] = 3 * i + 1;
                indices[row].and_blue[3 * i + 2] = 16 + pixel;
            }
        return indices;
    }();
    constexpr __mmask16 TWELVE = 0x0fff;
    for (size_t row = 0; row < 4; ++row, out += stride) {
        const __m512 red_green = _mm512_permutex2var_ps(
            red.m, _mm512_load_si512(INDICES[row].red_green.data()), green.m);
        _mm512_mask_storeu_ps(
            out, TWELVE,
            _mm512_permutex2var_ps(
                red_green, _mm512_load_si512(INDICES[row].and_blue.data()), blue.m));
    }
#else
    const LaneArray<float> r = to_lanes<float>(red), g = to_lanes<float>(green),
                           b = to_lanes<float>(blue);
    for (size_t row = 0; row < 4; ++row, out += stride)
        for (size_t i = 0; i < 4; ++i) {
            const uint32_t pixel = ROWS[row][i];
            out[3 * i] = r[pixel];
            out[3 * i + 1] = g[pixel];
            out[3 * i + 2] = b[pixel];
        }
#endif
}

} // namespace mlrt
