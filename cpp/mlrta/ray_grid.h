// Which parts of a beam's rectangle its rays go through, finely: triangles that are small
// beside the distance between rays mostly lie between them.
#pragma once

#include "mlrta/beam_packets.h"

#include <array>
#include <cstdint>

namespace mlrt {

class RayGrid {
public:
    static constexpr int SIDE = 64;

    // Marks the cells of all active rays.
    void fill(const BeamPackets &beam);

    // Whether rays may go through a box that is given as those of triangles are: by its
    // center relative to that of the rectangle, and half of its extents.
    bool may_hit(float p, float q, float half_p, float half_q) const {
        // Cells of the whole rectangle fit into int, and NaN does not come here.
        const int first_p = cell((p - half_p) * scale_p_ - margin_p_);
        const int last_p = cell((p + half_p) * scale_p_ + margin_p_);
        const int first_q = cell((q - half_q) * scale_q_ - margin_q_);
        const int last_q = cell((q + half_q) * scale_q_ + margin_q_);
        uint64_t rays = 0;
        for (int row = first_q; row <= last_q; ++row)
            rays |= rows_[row];
        return (rays >> first_p << (SIDE - 1 - (last_p - first_p))) != 0;
    }

private:
    static int cell(float position) {
        const float clamped = std::min(std::max(position + 0.5f * SIDE, 0.0f), SIDE - 1.0f);
        return int(clamped);
    }

    // Rays are where they are computed to be, but for the slack of the beam's rectangle.
    float scale_p_ = 0, scale_q_ = 0;
    float margin_p_ = 0, margin_q_ = 0;
    std::array<uint64_t, SIDE> rows_;
};

} // namespace mlrt
