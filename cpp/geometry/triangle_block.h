// Eight triangles side by side.
#pragma once

#include "base/simd.h"
#include "geometry/triangle.h"

#include <array>
#include <cstdint>

namespace mlrt {

struct TriangleBlock {
    Vec3<FloatBlock> a, b, c;

    // Those with eight numbers, which need not differ.
    TriangleBlock(const Triangle *triangles, const uint32_t *numbers) {
        std::array<const float *, BLOCK_WIDTH> rows;
        std::array<float, BLOCK_WIDTH> last;
        for (uint32_t n = 0; n < BLOCK_WIDTH; ++n) {
            const Triangle &triangle = triangles[numbers[n]];
            rows[n] = &triangle.a.x;
            last[n] = triangle.c.z;
        }
        const std::array<FloatBlock, BLOCK_WIDTH> columns = load_columns(rows);
        a = {columns[0], columns[1], columns[2]};
        b = {columns[3], columns[4], columns[5]};
        c = {columns[6], columns[7], load<FloatBlock>(last.data())};
    }
};

} // namespace mlrt
