// Rays that start near each other, in an order in which neighbours go the same way too.
#pragma once

#include "traverse/ray_group.h"

#include <array>
#include <cstdint>
#include <vector>

namespace mlrt {

// Copies of rays, sorted by the cell of a cube's surface that their directions point to.
// Rays of a cell stay in their order. Packets of such rays visit fewer nodes; what rays
// hit does not depend on it.
class DirectionOrder {
public:
    // Takes the rays of a group that has no common origin, whose intervals are all the
    // same.
    void sort(const RayGroup &rays);

    // The sorted rays, with the intervals and without the costs of the group.
    const RayGroup &group() const { return sorted_; }

    // Puts what was found for the sorted rays back into the order of the group.
    template <typename Value>
    void put_back(const std::vector<Value> &found, Value *values) const {
        for (uint32_t i = 0; i < sorted_.count; ++i)
            values[numbers_[i]] = found[i];
    }

private:
    // Along each side of a face of the cube; chosen.
    static constexpr uint32_t CELLS = 4;

    static uint32_t cell_of(Vec3f direction);

    RayGroup sorted_;
    std::vector<uint32_t> numbers_, cells_;
    std::array<uint32_t, 6 * CELLS * CELLS> starts_{};
    std::vector<float> origin_[3], direction_[3];
};

} // namespace mlrt
