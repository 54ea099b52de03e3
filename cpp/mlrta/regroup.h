// Splitting the rays of a beam where they leave gaps, as hit points do that lie on both
// sides of a depth edge when they are seen from a light.
#pragma once

#include "mlrta/beam_packets.h"
#include "mlrta/ray_copies.h"

#include <array>
#include <cstdint>
#include <optional>

namespace mlrt {

// Some rays of a beam, by number in the group that it was loaded from. What is written
// there comes in whole packets.
struct RayNumbers {
    static constexpr uint32_t CAPACITY = 256;

    std::array<uint32_t, CAPACITY + PACKET_WIDTH> number;
    uint32_t count = 0;

    // Those of sixteen rays from `first` on whose bit is set.
    void add(uint32_t first, LaneBits lanes);
};

// Which parts of a beam's rectangle its rays go through: one bit a cell of a grid, row by
// row, q upwards in rows and p in columns.
class Occupancy {
public:
    static constexpr int SIDE = 8;
    // Larger beams are not regrouped.
    static constexpr uint32_t MOST_RAYS = 1024;

    // Of a beam of up to MOST_RAYS rays.
    explicit Occupancy(const BeamPackets &beam);

    // A line across the rectangle: rays with less than `cell` cells along the axis (0 for
    // p, 1 for q) lie on one side of it, the others on the other.
    struct Cut {
        int axis, cell;
    };

    // The cut that leaves the smallest rectangles around the occupied cells of both sides,
    // if together they cover no more than a share of that of all.
    std::optional<Cut> best_cut(float share) const;

    // Adds the active rays to the lists of their sides, in their order.
    void divide(const BeamPackets &beam, Cut cut, RayNumbers &before,
                RayNumbers &beyond) const;

    // Whether packets overlap so much that rays had better be sorted.
    bool is_disordered(const BeamPackets &beam) const;

    // The active rays, cell by cell in Morton order.
    RayNumbers sorted(const BeamPackets &beam) const;

private:
    uint64_t cells_ = 0;
    std::array<uint32_t, MOST_RAYS> cell_; // of each ray that is active
};

// Rays in an order of their own, and their numbers in the group that they are taken from.
struct RegroupedRays {
    std::array<std::array<float, RayNumbers::CAPACITY>, 3> direction;
    std::array<std::array<float, RayNumbers::CAPACITY>, 3> origin; // unless it is common
    std::array<float, RayNumbers::CAPACITY> t_min, t_max; // unless they are the same
    std::array<float, RayNumbers::CAPACITY> cost;
    std::array<uint32_t, RayNumbers::CAPACITY> number;
    uint32_t count;
    RayGroup group; // they alone

    RegroupedRays(const RayGroup &rays, const RayNumbers &numbers);
    RegroupedRays(const RegroupedRays &) = delete;
    RegroupedRays &operator=(const RegroupedRays &) = delete;

    // What they took, if the group that they are from keeps account of it.
    void add_cost_to(const RayGroup &from) const;
};

} // namespace mlrt
