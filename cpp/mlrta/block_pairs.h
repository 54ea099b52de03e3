// Pairs of a triangle of a block and packets of a beam, to be gone through in long loops,
// whose ends are easy to foresee.
#pragma once

#include "base/partial_packets.h"
#include "base/simd.h"
#include "mlrta/beam_packets.h"

#include <array>
#include <bit>
#include <cstdint>
#include <span>

namespace mlrt {

// A pair of a triangle and a packet, or a run of packets, is a number: CAPACITY of a beam
// times the triangle's lane plus the packet, or the first one of the run.
constexpr uint32_t lane_of_pair(uint32_t pair) {
    return pair / BeamPackets::CAPACITY;
}
constexpr uint32_t packet_of_pair(uint32_t pair) {
    return pair % BeamPackets::CAPACITY;
}
constexpr uint32_t run_of_pair(uint32_t pair) {
    return packet_of_pair(pair) / PACKET_WIDTH;
}

class RunPairs {
public:
    // Adds those of a run with the triangles in the given lanes.
    void add(uint32_t run, LaneBits triangles) {
        store_compressed(pairs_.data() + count_,
                         lane_numbers<UIntWide>() * BeamPackets::CAPACITY +
                             UIntWide(run * PACKET_WIDTH),
                         triangles);
        count_ += uint32_t(std::popcount(triangles));
    }

    std::span<const uint32_t> all() const { return {pairs_.data(), count_}; }

private:
    // What is written comes in whole registers.
    std::array<uint32_t, BeamPackets::RUNS * WIDE_WIDTH + WIDE_WIDTH> pairs_;
    uint32_t count_ = 0;
};

} // namespace mlrt
