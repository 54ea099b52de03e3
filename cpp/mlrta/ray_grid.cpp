#include "mlrta/ray_grid.h"

#include <algorithm>

namespace mlrt {

namespace {

// Cells, for what rounds on the way to one: a few units of 64.
constexpr float ROUNDING = 0x1p-12f;

template <typename T>
T clamped(const T &cell) {
    return minimum(maximum(cell, T(0.0f)), T(RayGrid::SIDE - 1.0f));
}

} // namespace

void RayGrid::fill(const BeamPackets &beam) {
    const SlopeRectangle &r = beam.rectangle;
    scale_p_ = 0.5f * SIDE / r.half_p;
    scale_q_ = 0.5f * SIDE / r.half_q;
    margin_p_ = r.slack * scale_p_ + ROUNDING;
    margin_q_ = r.slack * scale_q_ + ROUNDING;
    std::array<uint64_t, SIDE> &rows = rows_[0];
    rows.fill(0);
    const auto cells = [](const FloatPacket &along, float scale) {
        return to_lanes<uint32_t>(
            UIntPacket(clamped(along * scale + FloatPacket(0.5f * SIDE))));
    };
    for (uint32_t n = 0; n < beam.count; ++n) {
        const BeamPacket &packet = beam.packets[n];
        const LaneArray<uint32_t> p = cells(beam.along_p(packet), scale_p_);
        const LaneArray<uint32_t> q = cells(beam.along_q(packet), scale_q_);
        for_each_lane(beam.lanes[n].active,
                      [&](uint32_t lane) { rows[q[lane]] |= uint64_t(1) << p[lane]; });
    }
    for (size_t k = 1; k < rows_.size(); ++k)
        for (size_t row = 0; row < SIDE; ++row) {
            const size_t next = std::min<size_t>(row + (1u << (k - 1)), SIDE - 1);
            rows_[k][row] = rows_[k - 1][row] | rows_[k - 1][next];
        }
}

LaneBits RayGrid::may_hit(const TriangleForms &forms, LaneBits triangles) const {
    using Cells = std::array<int32_t, WIDE_WIDTH>;
    // NaN does not come here.
    const auto cells = [](const FloatWide &position) {
        Cells cells;
        store(cells.data(), IntWide(clamped(position + 0.5f * SIDE)));
        return cells;
    };
    const auto first = [&](const float *middle, const float *half, float scale,
                           float margin) {
        return cells((load<FloatWide>(middle) - load<FloatWide>(half)) * scale - margin);
    };
    const auto last = [&](const float *middle, const float *half, float scale,
                          float margin) {
        return cells((load<FloatWide>(middle) + load<FloatWide>(half)) * scale + margin);
    };
    const Cells first_p = first(forms.box_p, forms.box_half_p, scale_p_, margin_p_);
    const Cells last_p = last(forms.box_p, forms.box_half_p, scale_p_, margin_p_);
    const Cells first_q = first(forms.box_q, forms.box_half_q, scale_q_, margin_q_);
    const Cells last_q = last(forms.box_q, forms.box_half_q, scale_q_, margin_q_);
    LaneBits hit = 0;
    for_each_lane(triangles, [&](uint32_t lane) {
        const uint32_t count = uint32_t(last_q[lane] - first_q[lane] + 1);
        const uint32_t k = uint32_t(std::bit_width(count)) - 1;
        const auto &rows = rows_[k];
        const uint64_t rays =
            rows[size_t(first_q[lane])] | rows[size_t(last_q[lane] + 1 - (1 << k))];
        const uint64_t within = rays >> first_p[lane]
                                            << (SIDE - 1 - (last_p[lane] - first_p[lane]));
        hit |= LaneBits(within != 0) << lane;
    });
    return hit;
}

} // namespace mlrt
