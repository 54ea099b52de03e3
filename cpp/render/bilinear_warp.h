// Points of the unit square in proportion to a function that is known on a grid.
#pragma once

#include "base/simd.h"

#include <cstdint>
#include <span>
#include <vector>

namespace mlrt {

// The function interpolates the grid bilinearly. A random point is taken from the whole
// square to a quarter of it, then to a quarter of that, each in proportion to what the
// function holds there, down to a cell of the grid (Clarberg, Jarosz, Akenine-Moeller and
// Jensen 2005, "Wavelet importance sampling", section 4), and there by inverting the
// distribution of a bilinear function.
//
// As Mitsuba's Hierarchical2D without parameters, so that equal numbers give equal points.
class BilinearWarp {
public:
    struct Samples {
        Vec2<FloatPacket> point;
        FloatPacket density; // over the unit square; 0 or NaN where the function vanishes
    };

    BilinearWarp() = default;

    // values: width * height, row by row, none negative, both sides at least 2. The first
    // lies at (0, 0), the last at (1, 1).
    BilinearWarp(uint32_t width, uint32_t height, std::span<const float> values);

    // Whether the function vanishes everywhere.
    bool empty() const { return values_.empty(); }

    // Needs a function that does not vanish everywhere. x and y are in [0, 1).
    Samples sample(const FloatPacket &x, const FloatPacket &y) const;

    // The density at points of the square; the same need.
    FloatPacket density(const Vec2<FloatPacket> &point) const;

private:
    // Sums over cells, or over squares of them. The four of a square lie side by side.
    struct Level {
        uint32_t width = 0; // a multiple of 2
        std::vector<float> sums;

        Level(uint32_t columns, uint32_t rows);

        template <typename Index>
        Index place(const Index &x, const Index &y) const {
            const Index even_x = x & ~1u, even_y = y & ~1u;
            return (x & 1u) + 2u * (even_x + (y & 1u)) + even_y * width;
        }
    };

    uint32_t width_ = 0;
    Vec2f cells_{}; // how many along each side
    Vec2f cell_size_{};
    std::vector<float> values_; // mean 1 over the unit square
    std::vector<Level> levels_; // the finest first
};

} // namespace mlrt
