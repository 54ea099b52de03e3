// Rays with a common origin by their slopes: which of them may enter which of eight boxes.
#pragma once

#include "geometry/ray_packet.h"
#include "kdtree/wide_tree.h"
#include "traverse/parameter_interval.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace mlrt {

// Eight boxes relative to an origin: faces across the axes of a frustum, a value a box.
struct SeenBoxes {
    // Those that rays pass first, and last.
    std::array<std::array<std::array<float, BLOCK_WIDTH>, 3>, 2> faces;
};

// The slopes u of some rays: the least one, if it is positive and if it is negative, and
// the greatest one likewise, widened, with the sign changed.
struct SlopeRange {
    float rising_lo, falling_lo, rising_hi, falling_hi;

    SlopeRange() = default;
    SlopeRange(float lo, float hi) {
        // Of a slope: its two roundings, and those of the faces that it is compared with.
        constexpr float WIDEN_SLOPE = 8 * FLOAT_ROUNDOFF;
        // More than what underflow may take from one.
        constexpr float LEAST_SLOPE = 0x1p-120f;
        lo -= std::abs(lo) * WIDEN_SLOPE + LEAST_SLOPE;
        hi += std::abs(hi) * WIDEN_SLOPE + LEAST_SLOPE;
        rising_lo = -std::max(lo, 0.0f);
        falling_lo = -std::min(lo, 0.0f);
        rising_hi = -std::max(hi, 0.0f);
        falling_hi = -std::min(hi, 0.0f);
    }
};

// Rays that go along one axis, with slopes of at most 1 to both others. With z the way
// along it from the origin, a ray is at x = u z, and a box that it enters has a point with
// lo <= u z <= hi, max(z_lo, 0) <= z <= z_hi.
class SlopeFrustum {
public:
    std::array<int, 3> axes;             // the last one is that which the rays go along
    float side;                          // of it, that they go to
    Vec3f origin;                        // in the order of the axes
    std::array<uint32_t, 2> backwards{}; // 1: rays go to the lower side of this axis

    SlopeFrustum() = default;
    SlopeFrustum(Vec3f start, int main_axis, float main_side)
        : axes{main_axis == 0 ? 1 : 0, main_axis == 2 ? 1 : 2, main_axis}, side(main_side),
          origin{start[axes[0]], start[axes[1]], start[axes[2]]} {}

    // Slopes d_i / |d_k| to an axis other than the last one.
    FloatPacket slopes_of(const RayPacket<CommonOrigin> &rays, size_t n) const {
        return rays.direction[axes[n]] * rays.reciprocal[axes[2]] * side;
    }

    // Bit k: rays with slopes in the middle of the given bounds go towards lower x[k].
    uint32_t octant(const std::array<float, 2> &least,
                    const std::array<float, 2> &greatest) const {
        uint32_t result = uint32_t(side < 0) << axes[2];
        for (size_t n = 0; n < 2; ++n)
            result |= uint32_t(least[n] + greatest[n] < 0) << axes[n];
        return result;
    }

    // Those of a node's boxes that rays with such slopes may enter.
    //
    // The faces relative to the origin have one rounding, as has what is fused; the sign of
    // a sum is not lost to rounding. The relative errors of both sides of hi >= u z are
    // less than what slopes are widened by. Of the two factors that a face across z is
    // multiplied with one is zero, and adds nothing.
    MaskOf<FloatBlock> entered(const WideNode &node,
                               const std::array<SlopeRange, 2> &ranges,
                               SeenBoxes &boxes) const {
        const auto depth = [&](bool upper) {
            return fused(load<FloatBlock>(node.faces[size_t(axes[2] + 3 * upper)].data()),
                         FloatBlock(side), FloatBlock(-side * origin.z));
        };
        const FloatBlock z_lo = maximum(depth(side < 0), FloatBlock(0.0f)),
                         z_hi = depth(side > 0);
        store(boxes.faces[0][2].data(), z_lo);
        store(boxes.faces[1][2].data(), z_hi);
        MaskOf<FloatBlock> entered = z_lo <= z_hi;
        for (size_t n = 0; n < 2; ++n) {
            const auto face = [&](bool upper) -> FloatBlock {
                return load<FloatBlock>(node.faces[size_t(axes[n] + 3 * upper)].data()) -
                       origin[int(n)];
            };
            const FloatBlock lo = face(false), hi = face(true);
            const SlopeRange &range = ranges[n];
            entered &= fused(FloatBlock(range.rising_lo), z_lo,
                             fused(FloatBlock(range.falling_lo), z_hi, hi)) >= 0.0f;
            entered &= fused(FloatBlock(range.rising_hi), z_hi,
                             fused(FloatBlock(range.falling_hi), z_lo, lo)) <= 0.0f;
            store(boxes.faces[backwards[n]][n].data(), lo);
            store(boxes.faces[1 - backwards[n]][n].data(), hi);
        }
        return entered;
    }
};

// That of sixteen rays, and each of them.
class PacketFrustum : public SlopeFrustum {
public:
    uint32_t middle_octant;
    std::array<LaneArray<float>, 2> slopes; // of each ray

    PacketFrustum() = default;
    PacketFrustum(const RayPacket<CommonOrigin> &rays, int main_axis, float main_side)
        : SlopeFrustum(rays.origin.point, main_axis, main_side) {
        const auto active = from_bits<FloatPacket>(rays.active);
        std::array<float, 2> least, greatest;
        for (size_t n = 0; n < 2; ++n) {
            const FloatPacket u = slopes_of(rays, n);
            slopes[n] = to_lanes<float>(u);
            least[n] = least_lane(select(active, u, FloatPacket(INFINITE)));
            greatest[n] = greatest_lane(select(active, u, FloatPacket(-INFINITE)));
            all_[n] = SlopeRange(least[n], greatest[n]);
            const FloatPacket d = rays.direction[axes[n]];
            const FloatPacket inverse =
                absolute(rays.direction[main_axis]) * rays.reciprocal[axes[n]];
            const LaneBits negative = to_bits(inverse < 0.0f) & rays.active;
            backwards[n] = negative == rays.active;
            negative_[n] = backwards[n] ? 0 : negative;
            // One that is too large may have overflowed, and tells nothing.
            inverse_[n] = to_lanes<float>(
                select((absolute(inverse) < LARGEST_INVERSE) | (d == 0.0f), inverse,
                       FloatPacket(std::numeric_limits<float>::quiet_NaN())));
        }
        is_mixed_ = (negative_[0] | negative_[1]) != 0;
        middle_octant = octant(least, greatest);
    }

    // Those of a node's boxes that rays may enter: the given ones, one at least, if they
    // are few, or any of the packet.
    MaskOf<FloatBlock> entered_by(LaneBits lanes, const WideNode &node,
                                  SeenBoxes &boxes) const {
        return entered(node, std::popcount(lanes) <= FEW ? of_few(lanes) : all_, boxes);
    }

    // Rays that may enter one of the boxes before their depth z = `end`.
    //
    // A ray is at a face across another axis at the depth x / u, which is computed with
    // four roundings: they are compared with more slack than those of both.
    LaneBits entering(const SeenBoxes &boxes, uint32_t box, const FloatPacket &end) const {
        FloatPacket near(boxes.faces[0][2][box]),
            far = minimum(FloatPacket(boxes.faces[1][2][box]), end);
        for (size_t n = 0; n < 2; ++n) {
            const auto inverse = load<FloatPacket>(inverse_[n]);
            FloatPacket first = inverse * boxes.faces[0][n][box],
                        last = inverse * boxes.faces[1][n][box];
            if (is_mixed_) {
                const auto negative = from_bits<FloatPacket>(negative_[n]);
                const FloatPacket other = first;
                first = select(negative, last, first);
                last = select(negative, other, last);
            }
            // Where it is not a number it shortens nothing.
            near = maximum(first, near);
            far = minimum(last, far);
        }
        return to_bits(fused(near, FloatPacket(NEARER), FloatPacket(-TINY_PARAMETER)) <=
                       far);
    }

private:
    static constexpr float LARGEST_INVERSE = 0x1p100f;
    static constexpr float NEARER = 1 - 16 * FLOAT_ROUNDOFF;
    // As many rays are taken for themselves; chosen.
    static constexpr int FEW = 2;

    // Of one or two rays.
    std::array<SlopeRange, 2> of_few(LaneBits lanes) const {
        const auto first = uint32_t(std::countr_zero(lanes)),
                   last = uint32_t(std::bit_width(lanes)) - 1;
        const auto range = [&](const LaneArray<float> &u) {
            return SlopeRange(std::min(u[first], u[last]), std::max(u[first], u[last]));
        };
        return {range(slopes[0]), range(slopes[1])};
    }

    std::array<SlopeRange, 2> all_;
    std::array<LaneArray<float>, 2> inverse_; // slopes
    // Rays that pass faces in the other order than the packet.
    std::array<LaneBits, 2> negative_;
    bool is_mixed_; // there are such rays
};

} // namespace mlrt
