// Least and greatest of packets of numbers.
#pragma once

#include "base/simd.h"
#include "mlrta/range.h"

#include <limits>

namespace mlrt {

// Lane by lane: the second operand of minimum() and maximum() stays where the first is not
// a number, so that what is to be left out is made one.
template <typename Real = FloatPacket>
struct PacketRange {
    static constexpr float NONE = std::numeric_limits<float>::quiet_NaN();

    Real lo = std::numeric_limits<float>::infinity();
    Real hi = -std::numeric_limits<float>::infinity();

    void add(const Real &x) {
        lo = minimum(x, lo);
        hi = maximum(x, hi);
    }
    Range of_all_lanes() const { return {least_lane(lo), greatest_lane(hi)}; }
};

} // namespace mlrt
