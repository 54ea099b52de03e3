#include "mlrta/regroup.h"

#include "base/check.h"
#include "base/partial_packets.h"

#include <algorithm>
#include <bit>

namespace mlrt {

namespace {

// Packets of rays that are in order cover about the occupied part of the rectangle, those
// of some of the rays of a square of pixels up to three times as much. Chosen from 2 to 6
// and no limit, by frames of office, conference, sponza and cornell-box.
constexpr float DISORDER = 4;

// Cells along p (axis 0) or q (axis 1) before each ray.
FloatPacket cell_of(const BeamPackets &beam, const BeamPacket &packet, int axis) {
    const SlopeRectangle &r = beam.rectangle;
    const FloatPacket along = axis == 0 ? beam.along_p(packet) : beam.along_q(packet);
    const float half = axis == 0 ? r.half_p : r.half_q;
    const float scale = 0.5f * Occupancy::SIDE / half;
    return minimum(maximum(along * scale + 0.5f * Occupancy::SIDE, FloatPacket(0.0f)),
                   FloatPacket(Occupancy::SIDE - 0.5f));
}

// Cells of the smallest rectangle around those given.
int area_around(uint64_t cells) {
    if (cells == 0)
        return 0;
    const int rows = (std::bit_width(cells) - 1) / 8 - std::countr_zero(cells) / 8 + 1;
    cells |= cells >> 32;
    cells |= cells >> 16;
    cells |= cells >> 8;
    const auto columns = uint8_t(cells);
    return rows * (std::bit_width(columns) - std::countr_zero(columns));
}

} // namespace

void RayNumbers::add(uint32_t first, LaneBits lanes) {
    store_compressed(number.data() + count, lane_indices() + UIntPacket(first), lanes);
    count += uint32_t(std::popcount(lanes));
}

Occupancy::Occupancy(const BeamPackets &beam) {
    MLRT_CHECK(beam.count * PACKET_WIDTH <= MOST_RAYS);
    // Bits of cells, those of the lower and those of the upper half of the rectangle.
    constexpr uint32_t HALF = SIDE * SIDE / 2;
    const UIntPacket none(0u), one(1u);
    UIntPacket lower = none, upper = none;
    for (uint32_t n = 0; n < beam.count; ++n) {
        const BeamPacket &packet = beam.packets[n];
        const UIntPacket column(cell_of(beam, packet, 0)), row(cell_of(beam, packet, 1));
        const UIntPacket cell = UIntPacket(SIDE) * row + column;
        store(&cell_[n * PACKET_WIDTH], cell);
        const UIntPacket bit = select(from_bits<UIntPacket>(beam.lanes[n].active),
                                      one << (cell & UIntPacket(HALF - 1)), none);
        const auto in_lower = cell < UIntPacket(HALF);
        lower = lower | select(in_lower, bit, none);
        upper = upper | select(in_lower, none, bit);
    }
    cells_ = uint64_t(union_of_lanes(upper)) << HALF | union_of_lanes(lower);
}

std::optional<Occupancy::Cut> Occupancy::best_cut(float share) const {
    int best_area = int(area_around(cells_) * share);
    if (std::popcount(cells_) > best_area) // parts are no smaller than what they hold
        return std::nullopt;
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
    FloatPacket areas = 0.0f;
    for (uint32_t n = 0; n < beam.run_count(); ++n) {
        const BeamPackets::Run &run = beam.runs[n];
        // Packets without rays have negative sides.
        areas =
            areas + select(run.half_p >= 0.0f, run.half_p * run.half_q, FloatPacket(0.0f));
    }
    const float area = sum_of_lanes(areas);
    const SlopeRectangle &r = beam.rectangle;
    return area >
           DISORDER * r.half_p * r.half_q * float(std::popcount(cells_)) / (SIDE * SIDE);
}

void Occupancy::divide(const BeamPackets &beam, Cut cut, RayNumbers &before,
                       RayNumbers &beyond) const {
    for (uint32_t n = 0; n < beam.count; ++n) {
        const PacketLanes &packet = beam.lanes[n];
        const auto cell = load<UIntPacket>(&cell_[n * PACKET_WIDTH]);
        const UIntPacket along =
            cut.axis == 0 ? cell & UIntPacket(SIDE - 1) : cell / UIntPacket(SIDE);
        const LaneBits lanes = to_bits(along >= UIntPacket(uint32_t(cut.cell)));
        before.add(packet.first_ray, packet.active & ~lanes);
        beyond.add(packet.first_ray, packet.active & lanes);
    }
}

RayNumbers Occupancy::sorted(const BeamPackets &beam) const {
    // Bits of a column at even places, of a row at odd ones.
    constexpr std::array<uint8_t, SIDE> spread{0, 1, 4, 5, 16, 17, 20, 21};
    std::array<uint32_t, SIDE * SIDE + 1> first{};
    const auto code = [&](uint32_t cell) {
        return spread[cell % SIDE] | spread[cell / SIDE] << 1;
    };
    const auto for_each_ray = [&](auto &&visit) {
        for (uint32_t n = 0; n < beam.count; ++n)
            for_each_lane(beam.lanes[n].active, [&](uint32_t lane) {
                visit(beam.lanes[n].first_ray + lane, code(cell_[n * PACKET_WIDTH + lane]));
            });
    };
    for_each_ray([&](uint32_t, int cell) { ++first[cell + 1]; });
    for (int cell = 1; cell <= SIDE * SIDE; ++cell)
        first[cell] += first[cell - 1];
    RayNumbers numbers;
    numbers.count = first[SIDE * SIDE];
    for_each_ray([&](uint32_t ray, int cell) { numbers.number[first[cell]++] = ray; });
    return numbers;
}

RegroupedRays::RegroupedRays(const RayGroup &rays, const RayNumbers &numbers)
    : count(numbers.count) {
    std::copy_n(numbers.number.begin(), count, number.begin());
    group = copy_rays(rays, {number.data(), count},
                      {{origin[0].data(), origin[1].data(), origin[2].data()},
                       {direction[0].data(), direction[1].data(), direction[2].data()},
                       t_min.data(),
                       t_max.data()});
    if (rays.cost) {
        std::fill_n(cost.begin(), count, 0.0f);
        group.cost = cost.data();
    }
}

void RegroupedRays::add_cost_to(const RayGroup &from) const {
    if (from.cost)
        for (uint32_t i = 0; i < count; ++i)
            from.cost[number[i]] += cost[i];
}

} // namespace mlrt
