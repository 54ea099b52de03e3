// Rays in an order that beams can be made of, whatever order they come in: line by line of
// an image, or none at all. Rays without a common origin make no beams, but packets and
// single rays that go the same way share more of the tree too.
#pragma once

#include "traverse/ray_group.h"

#include <cstdint>
#include <vector>

namespace mlrt {

// Neighbours in this order go in similar directions: directions are mapped to the plane
// through an octahedron (Meyer et al. 2010, "On floating-point normal vectors") and taken
// along a Morton curve. Without a common origin the cells of the curve are so large that
// each holds some rays, in the order in which they came, which is that of their origins.
class RayOrder {
public:
    // More are not worth the memory that they take; chosen.
    static constexpr uint32_t MOST_RAYS = 1u << 16;

    // Of up to MOST_RAYS rays.
    explicit RayOrder(const RayGroup &rays);

    // Whether beams of consecutive rays get much narrower by it.
    bool pays() const { return pays_; }

    // Numbers of rays of the group; only if it pays.
    const std::vector<uint32_t> &numbers() const { return numbers_; }

private:
    void map_to_plane(const RayGroup &rays);
    bool is_scattered() const;
    void sort(uint32_t dropped_bits);
    std::vector<uint32_t> cells_and_numbers(uint32_t dropped_bits) const;

    uint32_t count_ = 0;
    std::vector<float> x_, y_; // of each ray in the plane, in whole packets
    float left_ = 0, top_ = 0, width_ = 0, height_ = 0; // of the rectangle around all
    bool pays_ = false;
    std::vector<uint32_t> numbers_;
};

// Whether beams of consecutive rays are much narrower than those of sixteen times as many,
// at a glance.
bool are_in_order(const RayGroup &rays);

// Whether neighbours go to all sides, at a glance.
bool go_apart(const RayGroup &rays);

} // namespace mlrt
