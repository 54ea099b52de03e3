// A ray and eight triangles: which of them it hits, as far as single precision can tell.
#pragma once

#include "base/simd.h"
#include "base/vec.h"
#include "geometry/triangle_test.h"

#include <array>
#include <cmath>
#include <cstdint>

namespace mlrt {

// A ray whose direction is sheared onto an axis, the one of its largest component: there
// the volumes of triangle_test.h are areas, but for a common factor (Woop, Benthin and Wald
// 2013, "Watertight Ray/Triangle Intersection").
struct ShearedRay {
    std::array<int, 3> axes; // the last one is that of the direction
    std::array<float, 3> origin;
    float shear_x, shear_y; // of magnitude 1 at most

    ShearedRay() = default;
    // The shears are quotients of the other two components and that of the main axis.
    ShearedRay(Vec3f ray_origin, uint32_t main_axis, float x, float y)
        : axes{main_axis == 0 ? 1 : 0, main_axis == 2 ? 1 : 2, int(main_axis)},
          origin{ray_origin[axes[0]], ray_origin[axes[1]], ray_origin[axes[2]]}, shear_x(x),
          shear_y(y) {}
};

// The volumes U, V and W, divided by the direction's largest component, and a bound on
// their error. They only filter: what they leave open is decided in triangle_test.h.
//
// With u = 2^-24, a vertex x = a - s b of a sheared triangle, where |s| <= 1, and p >= |x|
// and q >= |b| as computed: two differences, a quotient and a fused product are rounded, so
// that x is off by e <= u (|a| + 2 |b| + |x|) <= u (2 p + 3 q) and a little. An area x y' -
// y x' of two vertices is off by 4 p e + 2 e^2 for that, and by 3 u p^2 <= p e for its own
// two roundings.
template <typename Real>
struct ShearedVolumes {
    Real least, greatest; // of the three
    Real error;           // infinite if nothing is known

    // Vertex by vertex, x, y and z of each, a value a triangle.
    ShearedVolumes(const ShearedRay &ray,
                   const std::array<std::array<float, BLOCK_WIDTH>, 9> &coordinates) {
        Real x[3], y[3], p(0.0f), q(0.0f);
        for (int i = 0; i < 3; ++i) {
            const auto relative = [&](int k) {
                return load<Real>(coordinates[3 * i + ray.axes[k]].data()) -
                       Real(ray.origin[k]);
            };
            const Real depth = relative(2);
            x[i] = fused(Real(-ray.shear_x), depth, relative(0));
            y[i] = fused(Real(-ray.shear_y), depth, relative(1));
            p = maximum(p, maximum(absolute(x[i]), absolute(y[i])));
            q = maximum(q, absolute(depth));
        }
        const auto area = [&](int i, int j) { return fused(x[i], y[j], -(y[i] * x[j])); };
        const Real u = area(1, 2), v = area(2, 0), w = area(0, 1);
        least = minimum(u, minimum(v, w));
        greatest = maximum(u, maximum(v, w));
        const Real e = (p + q) * (3.01f * FLOAT_ROUNDOFF) + UNDERFLOW;
        error = select(MaskOf<Real>((p < LARGEST_SIZE) & (q < LARGEST_SIZE)),
                       5.2f * (e * (p + e)) + UNDERFLOW, Real(INFINITY));
    }

    // Comparisons with NaN are false, so what overflowed stays open.
    LaneBits certain_hits() const { return to_bits((least > error) | (greatest < -error)); }
    LaneBits certain_misses() const {
        return to_bits((least < -error) & (greatest > error));
    }

private:
    // Much more than what underflow may lose of a vertex or of an area.
    static constexpr float UNDERFLOW = 0x1p-120f;
    // Nothing overflows on the way to an area of vertices that are less.
    static constexpr float LARGEST_SIZE = 0x1p60f;
};

} // namespace mlrt
