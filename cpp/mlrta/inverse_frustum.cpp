#include "mlrta/inverse_frustum.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

namespace {

// 8u, see the header; and what may be lost to denormal numbers.
constexpr double MARGIN = 0x1p-21, LEAST = 0x1p-140;
constexpr double GREATEST = std::numeric_limits<float>::max();

// Rounding to float loses at most u |x| or 2^-150 of that margin.
float lowered(double x) {
    return float(std::min(x - MARGIN * std::abs(x) - LEAST, GREATEST));
}
float raised(double x) {
    return float(std::max(x + MARGIN * std::abs(x) + LEAST, -GREATEST));
}

std::array<float, 8> lanes_of(const BoxPacket &inside) {
    alignas(32) std::array<float, 8> lanes;
    store(lanes.data(), inside);
    return lanes;
}

} // namespace

InverseFrustum::InverseFrustum(const Beam &beam) {
    for (int k = 0; k < 3; ++k) {
        Axis &axis = axes_[k];
        // Origins are floats. Adding zero makes -0 positive.
        axis.first_origin = float(beam.origin[k].lo) + 0.0f;
        axis.last_origin = float(beam.origin[k].hi) + 0.0f;
        axis.heading = int(beam.heading[k]);
        if (axis.heading == 0)
            continue;
        const double sign = axis.heading;
        alignas(32) std::array<float, 8> outward;
        outward.fill(-std::numeric_limits<float>::infinity());
        for (int step = 1; step < 3; ++step) {
            const int j = (k + step) % 3;
            const double a = sign * beam.slope[k][j].lo, b = sign * beam.slope[k][j].hi;
            outward[size_t(j)] = lowered(-std::max(a, b));
            outward[size_t(j) + 4] = lowered(std::min(a, b));
        }
        axis.outward_slope = load<BoxPacket>(outward.data());
        const double a = sign * beam.reciprocal[k].lo, b = sign * beam.reciprocal[k].hi;
        axis.least_reciprocal = std::max(lowered(std::min(a, b)), 0.0f);
        axis.greatest_reciprocal = raised(std::max(a, b));
    }
    shorten(beam.t_max);
}

// A hit counts if its distance is at most t_max once it has been rounded to float, which
// may be half a unit in the last place less than the exact one.
void InverseFrustum::shorten(double t_max) {
    constexpr double ROUNDED = 1 + 0x1p-23, SMALLEST_FLOAT = 0x1p-149;
    const double end = t_max * ROUNDED + SMALLEST_FLOAT;
    for (Axis &axis : axes_)
        if (axis.heading != 0)
            axis.reach = raised(end / axis.least_reciprocal);
}

// What both modes of step 2 begin with: the cell lies behind the beam or beyond its end.
bool InverseFrustum::out_of_reach(const std::array<float, 8> &inside) const {
    for (size_t k = 0; k < 3; ++k) {
        const int heading = axes_[k].heading;
        if (heading == 0)
            continue;
        const float exit = inside[heading > 0 ? k + 4 : k];
        const float entry = -inside[heading > 0 ? k : k + 4];
        if (exit < 0 || entry > axes_[k].reach)
            return true;
    }
    return false;
}

bool InverseFrustum::may_enter_by_parameters(const BoxPacket &inside) const {
    const std::array<float, 8> face = lanes_of(inside);
    if (out_of_reach(face))
        return false;
    // Products of two floats are exact in double.
    double latest_entry = 0;
    double earliest_exit = std::numeric_limits<double>::infinity();
    for (size_t k = 0; k < 3; ++k) {
        const Axis &axis = axes_[k];
        if (axis.heading == 0)
            continue;
        const double entry = -face[axis.heading > 0 ? k : k + 4];
        const double exit = face[axis.heading > 0 ? k + 4 : k];
        latest_entry = std::max(latest_entry, entry * axis.least_reciprocal);
        earliest_exit = std::min(earliest_exit, exit * axis.greatest_reciprocal);
    }
    // The pairs of unlike axes are the six comparisons; a slab is never left before it is
    // entered.
    return latest_entry <= earliest_exit;
}

// A ray that starts past the exit face never meets the cell, so that the others matter
// only: they leave the slab after a distance of at most that of the exit face. What a ray
// has moved outward by then is at least that distance times M, or, if M is positive, zero,
// and a face with all origins outside of it has inside() < 0.
bool InverseFrustum::may_enter_by_slopes(const BoxPacket &inside) const {
    const std::array<float, 8> face = lanes_of(inside);
    if (out_of_reach(face))
        return false;
    const LaneBits start_outside = to_bits(inside < BoxPacket(0.0f));
    for (size_t k = 0; k < 3; ++k) {
        const Axis &axis = axes_[k];
        if (axis.heading == 0)
            continue;
        const float exit = face[axis.heading > 0 ? k + 4 : k];
        if ((to_bits(exit * axis.outward_slope > inside) & start_outside) != 0)
            return false;
    }
    return true;
}

} // namespace mlrt
