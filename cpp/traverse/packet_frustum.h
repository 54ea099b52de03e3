// Sixteen rays with a common origin as one frustum: which of eight boxes they may enter.
#pragma once

#include "geometry/ray_packet.h"
#include "kdtree/wide_tree.h"
#include "traverse/parameter_interval.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace mlrt {

// Rays that go along one axis, with slopes of at most 1 to both others. With z the way
// along it from the origin, a ray is at x = u z, and a box that it enters has a point with
// lo <= u z <= hi, max(z_lo, 0) <= z <= z_hi.
class PacketFrustum {
public:
    std::array<int, 3> axes; // the last one is that which the rays go along
    float side;              // of it, that they go to
    uint32_t octant;         // of their middle: bit k towards lower x[k]
    std::array<FloatBlock, 3> origin;
    std::array<FloatPacket, 2> slopes; // d_i / d_k: of either sign of d_k
    float greatest_sum;                // bounds 1 + |slopes| of all rays

    PacketFrustum() = default;
    PacketFrustum(const RayPacket<CommonOrigin> &rays, int main_axis, float main_side)
        : axes{main_axis == 0 ? 1 : 0, main_axis == 2 ? 1 : 2, main_axis}, side(main_side),
          octant(main_side < 0 ? 1u << main_axis : 0u), greatest_sum(1) {
        for (size_t n = 0; n < 3; ++n)
            origin[n] = FloatBlock(rays.origin.point[axes[n]]);
        const auto active = from_bits<FloatPacket>(rays.active);
        for (size_t n = 0; n < 2; ++n) {
            slopes[n] = rays.direction[axes[n]] * rays.reciprocal[main_axis];
            const FloatPacket u = slopes[n] * side;
            float lo = least_lane(select(active, u, FloatPacket(INFINITE)));
            float hi = greatest_lane(select(active, u, FloatPacket(-INFINITE)));
            octant |= uint32_t(lo + hi < 0) << axes[n];
            extents_[n] = hi - lo;
            lo -= std::abs(lo) * WIDEN_SLOPE + LEAST_SLOPE;
            hi += std::abs(hi) * WIDEN_SLOPE + LEAST_SLOPE;
            greatest_sum += std::max(std::abs(lo), std::abs(hi));
            rising_lo_[n] = -std::max(lo, 0.0f);
            falling_lo_[n] = -std::min(lo, 0.0f);
            rising_hi_[n] = -std::max(hi, 0.0f);
            falling_hi_[n] = -std::min(hi, 0.0f);
        }
    }

    struct Boxes {
        MaskOf<FloatBlock> entered; // may be, before the depth z = `end`
        MaskOf<FloatBlock> narrow;  // so that not all rays need enter it
        FloatBlock nearest;         // least z >= 0
    };

    // The faces relative to the origin have one rounding, as has what is fused; the sign of
    // a sum is not lost to rounding. The relative errors of both sides of hi >= u z are
    // less than what slopes are widened by. Of the two factors that a face across z is
    // multiplied with one is zero, and adds nothing.
    Boxes boxes_of(const WideNode &node, float end) const {
        const auto face = [&](size_t n, bool upper) -> FloatBlock {
            return load<FloatBlock>(node.faces[size_t(axes[n] + 3 * upper)].data()) -
                   origin[n];
        };
        const FloatBlock z_lo = maximum(face(2, side < 0) * side, FloatBlock(0.0f)),
                         z_hi = face(2, side > 0) * side;
        Boxes boxes{(z_lo <= z_hi) & (z_lo <= FloatBlock(end)), false, z_lo};
        for (size_t n = 0; n < 2; ++n) {
            const FloatBlock lo = face(n, false), hi = face(n, true);
            boxes.entered &= fused(FloatBlock(rising_lo_[n]), z_lo,
                                   fused(FloatBlock(falling_lo_[n]), z_hi, hi)) >= 0.0f;
            boxes.entered &= fused(FloatBlock(rising_hi_[n]), z_hi,
                                   fused(FloatBlock(falling_hi_[n]), z_lo, lo)) <= 0.0f;
            boxes.narrow |= hi - lo < z_lo * extents_[n];
        }
        return boxes;
    }

private:
    // Of a slope: its two roundings, and those of the faces that it is compared with.
    static constexpr float WIDEN_SLOPE = 8 * FLOAT_ROUNDOFF;
    // More than what underflow may take from one.
    static constexpr float LEAST_SLOPE = 0x1p-120f;

    // Of the slopes u: the greatest difference; the least one, if it is positive and if it
    // is negative, and the greatest one likewise, with the sign changed.
    std::array<float, 2> extents_, rising_lo_, falling_lo_, rising_hi_, falling_hi_;
};

} // namespace mlrt
