// Triangles side by side: eight, or as many as a register holds.
#pragma once

#include "base/simd.h"
#include "geometry/triangle.h"

#include <array>
#include <cstdint>

namespace mlrt {

template <typename Real>
struct TriangleBlock {
    static constexpr size_t WIDTH = sizeof(Real) / sizeof(float);

    Vec3<Real> a, b, c;

    // Those with WIDTH numbers, which need not differ.
    TriangleBlock(const Triangle *triangles, const uint32_t *numbers) {
        std::array<const float *, WIDTH> rows;
        std::array<float, WIDTH> last;
        for (size_t n = 0; n < WIDTH; ++n) {
            const Triangle &triangle = triangles[numbers[n]];
            rows[n] = &triangle.a.x;
            last[n] = triangle.c.z;
        }
        const std::array<Real, 8> columns = load_columns(rows);
        a = {columns[0], columns[1], columns[2]};
        b = {columns[3], columns[4], columns[5]};
        c = {columns[6], columns[7], load<Real>(last.data())};
    }
};

} // namespace mlrt
