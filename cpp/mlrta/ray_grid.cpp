#include "mlrta/ray_grid.h"

namespace mlrt {

namespace {

// Cells, for what rounds on the way to one: a few units of 64.
constexpr float ROUNDING = 0x1p-12f;

} // namespace

void RayGrid::fill(const BeamPackets &beam) {
    const SlopeRectangle &r = beam.rectangle;
    scale_p_ = 0.5f * SIDE / r.half_p;
    scale_q_ = 0.5f * SIDE / r.half_q;
    margin_p_ = r.slack * scale_p_ + ROUNDING;
    margin_q_ = r.slack * scale_q_ + ROUNDING;
    rows_.fill(0);
    const auto cells = [](const FloatPacket &along, float scale) {
        return to_lanes<float>(
            minimum(maximum(along * scale + 0.5f * SIDE, FloatPacket(0.0f)),
                    FloatPacket(SIDE - 1.0f)));
    };
    for (uint32_t n = 0; n < beam.count; ++n) {
        const BeamPacket &packet = beam.packets[n];
        const LaneArray<float> p = cells(beam.along_p(packet), scale_p_);
        const LaneArray<float> q = cells(beam.along_q(packet), scale_q_);
        for_each_lane(packet.active, [&](uint32_t lane) {
            rows_[int(q[lane])] |= uint64_t(1) << int(p[lane]);
        });
    }
}

} // namespace mlrt
