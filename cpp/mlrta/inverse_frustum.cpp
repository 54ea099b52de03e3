#include "mlrta/inverse_frustum.h"

#include "geometry/triangle_test.h"

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

} // namespace

InverseFrustum::InverseFrustum(const Beam &beam) {
    for (size_t k = 0; k < 3; ++k) {
        Axis &axis = axes_[k];
        const bool upward = beam.heading[k] == Heading::positive;
        // Origins are floats. Adding zero makes -0 positive.
        axis.first_origin = float(beam.origin[k].lo) + 0.0f;
        axis.last_origin = float(beam.origin[k].hi) + 0.0f;
        axis.heading = float(beam.heading[k]);
        axis.nearest_origin = upward ? axis.last_origin : axis.first_origin;
        axis.farthest_origin = upward ? axis.first_origin : axis.last_origin;
        axis.entry_face = uint32_t(upward ? k : k + 4);
        axis.exit_face = uint32_t(upward ? k + 4 : k);
        alignas(32) std::array<float, 8> outward;
        outward.fill(std::numeric_limits<float>::quiet_NaN());
        if (axis.heading != 0) {
            const double sign = axis.heading;
            for (size_t step = 1; step < 3; ++step) {
                const size_t j = (k + step) % 3;
                const Range &slope = beam.slope[k][j];
                outward[j] = lowered(upward ? -slope.hi : slope.lo);
                outward[j + 4] = lowered(upward ? slope.lo : -slope.hi);
            }
            const Range &reciprocal = beam.reciprocal[k];
            const double a = sign * reciprocal.lo, b = sign * reciprocal.hi;
            least_reciprocal_[k] = std::min(a, b) * (1 - MARGIN);
            greatest_reciprocal_[k] = std::max(a, b) * (1 + MARGIN);
        }
        axis.outward_slope = load<BoxPacket>(outward.data());
    }
    shorten(beam.t_max);
}

// A hit counts if its distance is at most t_max once it has been rounded to float, which
// may be half a unit in the last place less than the exact one.
void InverseFrustum::shorten(double t_max) {
    constexpr double ROUNDED = 1 + 0x1p-23;
    constexpr float INFINITE = std::numeric_limits<float>::infinity();
    const double end = t_max * ROUNDED + SMALLEST_FLOAT;
    alignas(32) std::array<float, 8> least;
    least.fill(-INFINITE);
    for (size_t k = 0; k < 3; ++k) {
        Axis &axis = axes_[k];
        axis.reach = INFINITE;
        if (axis.heading == 0)
            continue;
        axis.reach = raised(end / least_reciprocal_[k]);
        least[axis.entry_face] = -axis.reach;
        least[axis.exit_face] = 0;
    }
    least_inside_ = load<BoxPacket>(least.data());
}

float InverseFrustum::earliest_entry(const BoxPacket &inside) const {
    alignas(32) std::array<float, 8> face;
    store(face.data(), inside);
    double earliest = 0;
    for (size_t k = 0; k < 3; ++k)
        if (axes_[k].heading != 0)
            earliest =
                std::max(earliest, -face[axes_[k].entry_face] * least_reciprocal_[k]);
    return std::max(lowered(earliest), 0.0f);
}

bool InverseFrustum::may_enter_by_parameters(const BoxPacket &inside) const {
    if (out_of_reach(inside))
        return false;
    alignas(32) std::array<float, 8> face;
    store(face.data(), inside);
    double latest_entry = 0;
    double earliest_exit = std::numeric_limits<double>::infinity();
    for (size_t k = 0; k < 3; ++k) {
        const Axis &axis = axes_[k];
        if (axis.heading == 0)
            continue;
        latest_entry =
            std::max(latest_entry, -face[axis.entry_face] * least_reciprocal_[k]);
        earliest_exit =
            std::min(earliest_exit, face[axis.exit_face] * greatest_reciprocal_[k]);
    }
    // The pairs of unlike axes are the six comparisons; a slab is never left before it is
    // entered.
    return latest_entry <= earliest_exit;
}

} // namespace mlrt
