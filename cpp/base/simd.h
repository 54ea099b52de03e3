// The vocabulary of vector code: the only place that knows Dr.Jit and the width of a register.
//
// A packet is 16 lanes on every processor; narrower instruction sets run it in two or four
// halves. Arithmetic is plain IEEE: the same operations in the same order give the same bits on
// all of them. Use true division: dr::rcp differs between instruction sets.
#pragma once

#include <drjit/packet.h>

#include <cstdint>

namespace mlrt {

inline constexpr uint32_t PACKET_WIDTH = 16;

template <uint32_t W>
using FloatPacket = drjit::Packet<float, W>;
template <uint32_t W>
using DoublePacket = drjit::Packet<double, W>;
template <uint32_t W>
using UIntPacket = drjit::Packet<uint32_t, W>;

// One bit a lane, lane 0 lowest.
using LaneMask = uint32_t;

template <typename Mask>
LaneMask to_bits(const Mask &mask) {
    if constexpr (requires { mask.bitmask_(); }) {
        return LaneMask(mask.bitmask_());
    } else {
        constexpr uint32_t half = uint32_t(drjit::size_v<decltype(drjit::low(mask))>);
        return to_bits(drjit::low(mask)) | (to_bits(drjit::high(mask)) << half);
    }
}

// Calls visit(lane) for each set bit, lowest first.
template <typename Visit>
void for_each_lane(LaneMask bits, Visit &&visit) {
    while (bits) {
        visit(__builtin_ctz(bits));
        bits &= bits - 1;
    }
}

// Keeps denormal numbers while it lives: Dr.Jit's threads flush them to zero.
class KeepDenormals {
private:
    drjit::scoped_flush_denormals scope_{false};
};

} // namespace mlrt
