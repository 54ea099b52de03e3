// Some of the packets of a beam.
#pragma once

#include "base/simd.h"

#include <array>
#include <cstdint>

namespace mlrt {

// By runs of sixteen packets, whose masks can be taken apart and put together as such.
template <uint32_t RUNS>
class PacketSet {
public:
    static PacketSet of_first(uint32_t count) {
        PacketSet set;
        for (uint32_t r = 0; r * PACKET_WIDTH < count; ++r)
            set.runs_[r] = first_lanes(count - r * PACKET_WIDTH);
        return set;
    }

    LaneBits &run(uint32_t number) { return runs_[number]; }
    LaneBits run(uint32_t number) const { return runs_[number]; }

    bool has(uint32_t packet) const {
        return runs_[packet / PACKET_WIDTH] >> packet % PACKET_WIDTH & 1;
    }
    void remove(uint32_t packet) {
        runs_[packet / PACKET_WIDTH] &= ~(LaneBits(1) << packet % PACKET_WIDTH);
    }

private:
    std::array<LaneBits, RUNS> runs_{};
};

} // namespace mlrt
