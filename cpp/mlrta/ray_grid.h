// Which parts of a beam's rectangle its rays go through, finely: triangles that are small
// beside the distance between rays mostly lie between them.
#pragma once

#include "mlrta/beam_packets.h"
#include "mlrta/triangle_forms.h"

#include <array>
#include <bit>
#include <cstdint>

namespace mlrt {

class RayGrid {
public:
    static constexpr int SIDE = 64;

    // Marks the cells of all active rays.
    void fill(const BeamPackets &beam);

    // Those of a block of triangles whose boxes rays may go through.
    LaneBits may_hit(const TriangleForms &forms, LaneBits triangles) const;

private:
    // Rays are where they are computed to be, but for the slack of the beam's rectangle.
    float scale_p_ = 0, scale_q_ = 0;
    float margin_p_ = 0, margin_q_ = 0;
    // Entry k of a row holds the cells of the 2^k rows from there on, as far as there are
    // any: two of them hold those of any number of rows.
    std::array<std::array<uint64_t, SIDE>, std::bit_width(uint32_t(SIDE))> rows_;
};

} // namespace mlrt
