// Eight triangles as one ray sees them, or two with a common origin.
//
// With the axis k that rays go along, x = d_i / |d_k| and y = d_j / |d_k|, and points
// relative to the origin, z along d_k: a point is sheared to (p_i - x p_z, p_j - y p_z).
// The volumes U, V, W of triangle_test.h are |d_k| times b x c, c x a, a x b of the sheared
// vertices, all with the same sign, and the depth t |d_k| of a hit is the mean of the
// vertices' z with these weights. The axes may be in any order: all volumes change their
// sign together.
#pragma once

#include "base/block_pair.h"
#include "base/magnitude.h"
#include "base/simd.h"
#include "base/vec.h"
#include "geometry/triangle_test.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <type_traits>

namespace mlrt {

// Of one ray (a FloatBlock) or of two (a FloatPacket).
template <typename Real>
class VolumesOf {
    static constexpr bool ONE_RAY = std::is_same_v<Real, FloatBlock>;

public:
    // Coordinates are vertex by vertex, x, y and z of each, a value a triangle. The origin
    // has the order of the axes; `side` is the sign of d_k.
    VolumesOf(const std::array<std::array<float, BLOCK_WIDTH>, 9> &coordinates,
              const std::array<int, 3> &axes, const Vec3f &origin, float side)
        : a_(relative(coordinates, 0, axes, origin, side)),
          b_(relative(coordinates, 3, axes, origin, side)),
          c_(relative(coordinates, 6, axes, origin, side)) {
        depth_ = greatest_size(greatest_size(a_.z, b_.z), c_.z);
        linear_error_ = depth_ * (17 * FLOAT_ROUNDOFF);
        least_error_ = fused(depth_ * depth_, Real(34 * FLOAT_ROUNDOFF * FLOAT_ROUNDOFF),
                             Real(UNDERFLOW));
    }

    // What is certain of the rays: of the first one in lanes 0 to 7, of the second one, if
    // there is one, above.
    struct Seen {
        LaneBits possible, certain; // hits, anywhere on the line
        // Bounds of the depth of a hit that is possible, if any is: of its sign, and of its
        // size if it is not negative.
        Real nearest, farthest;
    };

    // Slopes in the lanes of their rays, of at most 1 but for rounding.
    //
    // With u = 2^-24, Z the largest z and m the largest sheared coordinate: a slope has two
    // roundings and vertices have one, so that a sheared coordinate is off by at most
    // E = 4.03 u Z + 2.01 u m. A volume has two products, each off by 2 m E + E^2, and
    // roundings of 3.01 u m^2: together less than m (16.3 u Z + 11.2 u m) + 33 u^2 Z^2 = e.
    //
    // With D = U + V + W, which is off by 3.01 e + 2.02 u |D|, and a hit, of which all
    // volumes have the same sign, V / D is off by 4.01 e / |D| + 2.02 u, and likewise W /
    // D. They multiply edges of at most 2 Z: by roundings alone the depth is off by less
    // than 24 u Z, by the volumes by 8.1 e / |D| times the depth of the triangle. It lies
    // between the vertices in any case.
    Seen seen_by(const Real &x, const Real &y) const {
        const auto sheared = [&](const Vec3<Real> &p) -> std::array<Real, 2> {
            return {fused(-x, p.z, p.x), fused(-y, p.z, p.y)};
        };
        const std::array<Real, 2> a = sheared(a_), b = sheared(b_), c = sheared(c_);
        const auto product = [](const std::array<Real, 2> &p,
                                const std::array<Real, 2> &q) {
            return fused(p[0], q[1], -(p[1] * q[0]));
        };
        const Real u = product(b, c), v = product(c, a), w = product(a, b);
        const Real size = greatest_size(
            greatest_size(greatest_size(a[0], a[1]), greatest_size(b[0], b[1])),
            greatest_size(c[0], c[1]));
        Real error = fused(size, fused(size, Real(12 * FLOAT_ROUNDOFF), linear_error_),
                           least_error_);
        error = select(size < LARGEST_SIZE, error, Real(INFINITY));
        const Real least = minimum(u, minimum(v, w)), greatest = maximum(u, maximum(v, w));
        Seen seen;
        // Which rays see nothing is hard to foretell, so all is computed in any case.
        seen.possible = ALL_LANES & ~to_bits((least < -error) & (greatest > error));
        seen.certain = to_bits((least > error) | (greatest < -error));
        const Real reciprocal = 1.0f / (u + v + w);
        const Real depth =
            fused(v * reciprocal, b_.z - a_.z, fused(w * reciprocal, c_.z - a_.z, a_.z));
        const Real lo = minimum(a_.z, minimum(b_.z, c_.z)),
                   hi = maximum(a_.z, maximum(b_.z, c_.z));
        const Real slack = fused(error * absolute(reciprocal), (hi - lo) * 8.5f,
                                 fused(depth_, Real(24 * FLOAT_ROUNDOFF), Real(UNDERFLOW)));
        // Where nothing is known of the depth it is not a number: the vertices remain.
        seen.nearest = maximum(depth - slack, lo) * (1 - WIDEN_COMPUTED_DEPTH);
        seen.farthest = minimum(depth + slack, hi) * (1 + WIDEN_COMPUTED_DEPTH);
        return seen;
    }

private:
    static constexpr float LARGEST_SIZE = 0x1p60f;
    // Much more than what underflow may take.
    static constexpr float UNDERFLOW = 0x1p-120f;
    // Of vertices and of distances to float, and those of what follows.
    static constexpr float WIDEN_COMPUTED_DEPTH = 12 * FLOAT_ROUNDOFF;

    static Vec3<Real>
    relative(const std::array<std::array<float, BLOCK_WIDTH>, 9> &coordinates, size_t first,
             const std::array<int, 3> &axes, const Vec3f &origin, float side) {
        const auto coordinate = [&](size_t n) {
            const float *const values =
                &coordinates[0][0] + BLOCK_WIDTH * uint32_t(axes[n]) + first * BLOCK_WIDTH;
            if constexpr (ONE_RAY)
                return load<Real>(values);
            else
                return load_twice(values);
        };
        return {coordinate(0) - origin.x, coordinate(1) - origin.y,
                fused(coordinate(2), Real(side), Real(-side * origin.z))};
    }

    Vec3<Real> a_, b_, c_;
    Real depth_, linear_error_, least_error_;
};

using RayVolumes = VolumesOf<FloatBlock>;
using BlockVolumes = VolumesOf<FloatPacket>;

} // namespace mlrt
