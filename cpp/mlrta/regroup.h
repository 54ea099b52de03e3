// Splitting the rays of a beam where they leave gaps, as hit points do that lie on both
// sides of a depth edge when they are seen from a light.
#pragma once

#include "mlrta/beam_packets.h"

#include <array>
#include <cstdint>
#include <optional>

namespace mlrt {

// Which parts of a beam's rectangle its rays go through: one bit a cell of a grid, row by
// row, q upwards in rows and p in columns.
class Occupancy {
public:
    static constexpr int SIDE = 8;

    explicit Occupancy(const BeamPackets &beam);

    // A line across the rectangle: rays with less than `cell` cells along the axis (0 for
    // p, 1 for q) lie on one side of it, the others on the other.
    struct Cut {
        int axis, cell;
    };

    // The cut that leaves the smallest rectangles around the occupied cells of both sides,
    // if together they cover no more than a share of that of all.
    std::optional<Cut> best_cut(float share) const;

    bool is_beyond(uint32_t ray, Cut cut) const {
        return int(cut.axis == 0 ? cell_[ray] & 7 : cell_[ray] >> 3) >= cut.cell;
    }

    // Whether packets overlap so much that rays had better be sorted.
    bool is_disordered(const BeamPackets &beam) const;

    // Numbers of the active rays, from the beam's first on, cell by cell in Morton order.
    uint32_t sorted(const BeamPackets &beam,
                    std::array<uint8_t, BeamPackets::MAX_RAYS> &rays) const;

private:
    uint64_t cells_ = 0;
    std::array<uint8_t, BeamPackets::MAX_RAYS> cell_;
};

// Rays in an order of their own, and their numbers in the group that they are taken from.
struct RegroupedRays {
    std::array<std::array<float, BeamPackets::MAX_RAYS>, 3> direction;
    std::array<float, BeamPackets::MAX_RAYS> t_min, t_max;
    std::array<float, BeamPackets::MAX_RAYS> cost;
    std::array<uint32_t, BeamPackets::MAX_RAYS> number;
    uint32_t count = 0;

    void add(const RayGroup &rays, uint32_t ray);

    // They alone, with the origin of the group that they are from.
    RayGroup group(const RayGroup &from);

    // What they took, if the group that they are from keeps account of it.
    void add_cost_to(const RayGroup &from) const;
};

} // namespace mlrt
