#include "mlrta/regroup.h"

#include <algorithm>
#include <bit>

namespace mlrt {

namespace {

// Packets of rays that are in order cover about the occupied part of the rectangle; chosen
// from 1.5 and 2.
constexpr float DISORDER = 2;

// Cells along p (axis 0) or q (axis 1) before each ray.
FloatPacket cell_of(const BeamPackets &beam, const BeamPacket &packet, int axis) {
    const SlopeRectangle &r = beam.rectangle;
    const FloatPacket along = axis == 0 ? beam.along_p(packet) : beam.along_q(packet);
    const float half = axis == 0 ? r.half_p : r.half_q;
    const float scale = 0.5f * Occupancy::SIDE / half;
    return minimum(maximum(along * scale + 0.5f * Occupancy::SIDE, FloatPacket(0.0f)),
                   FloatPacket(Occupancy::SIDE - 0.5f));
}

// Columns and rows that any of the cells lies in, as bits.
uint32_t columns_of(uint64_t cells) {
    cells |= cells >> 32;
    cells |= cells >> 16;
    cells |= cells >> 8;
    return uint32_t(cells & 0xff);
}
uint32_t rows_of(uint64_t cells) {
    uint32_t rows = 0;
    for (int row = 0; row < 8; ++row)
        rows |= uint32_t((cells >> (8 * row) & 0xff) != 0) << row;
    return rows;
}

int length_of(uint32_t bits) {
    return bits == 0 ? 0 : std::bit_width(bits) - std::countr_zero(bits);
}

// Cells of the smallest rectangle around those given.
int area_around(uint64_t cells) {
    return length_of(columns_of(cells)) * length_of(rows_of(cells));
}

} // namespace

Occupancy::Occupancy(const BeamPackets &beam) {
    for (uint32_t n = 0; n < beam.count; ++n) {
        const BeamPacket &packet = beam.packets[n];
        const LaneArray<float> p = to_lanes<float>(cell_of(beam, packet, 0));
        const LaneArray<float> q = to_lanes<float>(cell_of(beam, packet, 1));
        for_each_lane(packet.active, [&](uint32_t lane) {
            const uint32_t cell = uint32_t(8 * int(q[lane]) + int(p[lane]));
            cell_[n * PACKET_WIDTH + lane] = uint8_t(cell);
            cells_ |= uint64_t(1) << cell;
        });
    }
}

std::optional<Occupancy::Cut> Occupancy::best_cut(float share) const {
    int best_area = int(area_around(cells_) * share);
    std::optional<Cut> best;
    for (int cell = 1; cell < SIDE; ++cell) {
        const uint64_t row_mask = ((1ull << cell) - 1) * 0x0101010101010101ull;
        const uint64_t column_mask = (1ull << (8 * cell)) - 1;
        for (int axis = 0; axis < 2; ++axis) {
            const uint64_t before = cells_ & (axis == 0 ? row_mask : column_mask);
            const uint64_t after = cells_ & ~before;
            const int area = area_around(before) + area_around(after);
            if (before != 0 && after != 0 && area <= best_area) {
                best_area = area - 1;
                best = Cut{axis, cell};
            }
        }
    }
    return best;
}

bool Occupancy::is_disordered(const BeamPackets &beam) const {
    const LaneArray<float> half_p = to_lanes<float>(beam.half_p);
    const LaneArray<float> half_q = to_lanes<float>(beam.half_q);
    float area = 0;
    for (uint32_t n = 0; n < beam.count; ++n)
        if (beam.packets[n].active != 0)
            area += half_p[n] * half_q[n];
    const SlopeRectangle &r = beam.rectangle;
    return area >
           DISORDER * r.half_p * r.half_q * float(std::popcount(cells_)) / (SIDE * SIDE);
}

uint32_t Occupancy::sorted(const BeamPackets &beam,
                           std::array<uint8_t, BeamPackets::MAX_RAYS> &rays) const {
    // Bits of a column at even places, of a row at odd ones.
    constexpr std::array<uint8_t, 8> spread{0, 1, 4, 5, 16, 17, 20, 21};
    std::array<uint16_t, 65> first{};
    const auto code = [&](uint32_t ray) {
        return spread[cell_[ray] & 7] | spread[cell_[ray] >> 3] << 1;
    };
    for (uint32_t n = 0; n < beam.count; ++n)
        for_each_lane(beam.packets[n].active,
                      [&](uint32_t lane) { ++first[code(n * PACKET_WIDTH + lane) + 1]; });
    for (int cell = 1; cell <= 64; ++cell)
        first[cell] += first[cell - 1];
    const uint32_t count = first[64];
    for (uint32_t n = 0; n < beam.count; ++n)
        for_each_lane(beam.packets[n].active, [&](uint32_t lane) {
            const uint32_t ray = n * PACKET_WIDTH + lane;
            rays[first[code(ray)]++] = uint8_t(ray);
        });
    return count;
}

void RegroupedRays::add(const RayGroup &rays, uint32_t ray) {
    for (int k = 0; k < 3; ++k)
        direction[k][count] = rays.direction[k][ray];
    t_min[count] = rays.t_min[ray];
    t_max[count] = rays.t_max[ray];
    number[count++] = ray;
}

RayGroup RegroupedRays::group(const RayGroup &from) {
    RayGroup group = from;
    group.count = count;
    for (int k = 0; k < 3; ++k)
        group.direction[k] = direction[k].data();
    group.t_min = t_min.data();
    group.t_max = t_max.data();
    if (from.cost) {
        std::fill_n(cost.begin(), count, 0.0f);
        group.cost = cost.data();
    }
    return group;
}

void RegroupedRays::add_cost_to(const RayGroup &from) const {
    if (from.cost)
        for (uint32_t i = 0; i < count; ++i)
            from.cost[number[i]] += cost[i];
}

} // namespace mlrt
