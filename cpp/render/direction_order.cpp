#include "render/direction_order.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

uint32_t DirectionOrder::cell_of(Vec3f d) {
    const Vec3f size = abs(d);
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const float scale = 0.5f * CELLS / size[axis];
    const auto place = [&](float along) {
        const float cell = along * scale + 0.5f * CELLS;
        // Also if the direction is no number.
        return uint32_t(cell > 0 ? std::min(cell, CELLS - 0.5f) : 0);
    };
    const uint32_t face = 2 * uint32_t(axis) + (d[axis] < 0);
    return (face * CELLS + place(d[(axis + 1) % 3])) * CELLS + place(d[(axis + 2) % 3]);
}

void DirectionOrder::sort(const RayGroup &rays) {
    sorted_ = rays;
    sorted_.cost = nullptr;
    numbers_.resize(rays.count);
    cells_.resize(rays.count);
    starts_.fill(0);
    for (uint32_t i = 0; i < rays.count; ++i) {
        cells_[i] =
            cell_of({rays.direction[0][i], rays.direction[1][i], rays.direction[2][i]});
        ++starts_[cells_[i]];
    }
    uint32_t next = 0;
    for (uint32_t &start : starts_) {
        const uint32_t count = start;
        start = next;
        next += count;
    }
    for (uint32_t i = 0; i < rays.count; ++i)
        numbers_[starts_[cells_[i]]++] = i;
    for (int k = 0; k < 3; ++k) {
        origin_[k].resize(rays.count);
        direction_[k].resize(rays.count);
        for (uint32_t i = 0; i < rays.count; ++i) {
            origin_[k][i] = rays.origin[k][numbers_[i]];
            direction_[k][i] = rays.direction[k][numbers_[i]];
        }
        sorted_.origin[k] = origin_[k].data();
        sorted_.direction[k] = direction_[k].data();
    }
}

} // namespace mlrt
