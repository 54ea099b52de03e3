// Eight triangles as rays with a common origin see them: linear forms in the slopes of a
// ray, which many rays share.
//
// Of a triangle (a, b, c) relative to the origin and a direction d_k (x, y, 1), with the
// slopes x = d_i / d_k and y = d_j / d_k, the volumes U, V, W of triangle_test.h are d_k
// (n_k + x n_i + y n_j) with the edge normals n = b x c, c x a, a x b, and the depth t d_k
// is N.a / (N_k + x N_i + y N_j) with N = (b - a) x (c - a). The axes may be in any order:
// all volumes change their sign together.
#pragma once

#include "base/magnitude.h"
#include "base/simd.h"
#include "base/vec.h"
#include "geometry/triangle_test.h"

#include <array>
#include <cmath>
#include <cstdint>

namespace mlrt {

class BlockForms {
    using Real = FloatBlock;

public:
    // Coordinates are vertex by vertex, x, y and z of each, a value a triangle; the origin
    // has the order of the axes. `slopes` bounds 1 + |x| + |y| of the rays, 3 at most.
    //
    // With u = 2^-24, s the largest component of a vertex relative to the origin and e that
    // of an edge: vertices and edges have one rounding, so that a component of an edge
    // normal has four in a row, of at most 2 s e. A slope has two, evaluating a form three:
    // nine, of 2 s e each, for three terms, which are at most `slopes`: 18 u s e times
    // that; 20 covers products of roundings and the bound itself. N has the same roundings
    // with e for s. N.a has eight: four of N, one of a, three of its own, of three terms of
    // at most 2 e^2 s: 48 u e^2 s; 52 covers the rest. What underflow takes from N it takes
    // s times from N.a.
    BlockForms(const std::array<std::array<float, BLOCK_WIDTH>, 9> &coordinates,
               const std::array<int, 3> &axes, const std::array<Real, 3> &origin,
               float slopes) {
        const auto vertex = [&](int first) -> Vec3<Real> {
            return {load<Real>(coordinates[size_t(first + axes[0])].data()),
                    load<Real>(coordinates[size_t(first + axes[1])].data()),
                    load<Real>(coordinates[size_t(first + axes[2])].data())};
        };
        const Vec3<Real> va = vertex(0), vb = vertex(3), vc = vertex(6);
        const Vec3<Real> o{origin[0], origin[1], origin[2]};
        const Vec3<Real> a = va - o, b = vb - o, c = vc - o;
        const Vec3<Real> ab = vb - va, bc = vc - vb, ca = va - vc;
        const auto product = [](const Vec3<Real> &p, const Vec3<Real> &q) -> Vec3<Real> {
            return {fused(p.y, q.z, -(p.z * q.y)), fused(p.z, q.x, -(p.x * q.z)),
                    fused(p.x, q.y, -(p.y * q.x))};
        };
        edges_[0] = product(b, bc);
        edges_[1] = product(c, ca);
        edges_[2] = product(a, ab);
        normal_ = product(ca, ab);
        numerator_ = fused(normal_.x, a.x, fused(normal_.y, a.y, normal_.z * a.z));
        const auto largest = [](const Vec3<Real> &p, const Vec3<Real> &q,
                                const Vec3<Real> &r) {
            return greatest_size(greatest_size(largest_component(p), largest_component(q)),
                                 largest_component(r));
        };
        const Real size = largest(a, b, c), edge = largest(ab, bc, ca);
        const auto moderate = (size < LARGEST_SIZE) & (edge < LARGEST_SIZE);
        edge_error_ =
            select(moderate, (20 * FLOAT_ROUNDOFF * slopes) * (size * edge) + UNDERFLOW,
                   Real(INFINITY));
        const Real square = edge * edge;
        normal_error_ = (20 * FLOAT_ROUNDOFF * slopes) * square + UNDERFLOW;
        const Real error =
            (52 * FLOAT_ROUNDOFF) * (square * size) + UNDERFLOW * (size + 1.0f);
        // Nothing is known of the depth if it is more than a quarter, or not a number.
        numerator_share_ = error / absolute(numerator_);
    }

    // What is certain of a ray.
    struct Seen {
        LaneBits possible, certain; // hits, anywhere on its line
        // Bounds of |t d_k| of a hit that is possible: of its size, since a ray has no hit
        // behind its origin unless `behind` is set.
        Real nearest, farthest;
    };

    // `side` is the sign of d_k.
    //
    // With n and d computed, and their errors at most shares r and s of them, r, s <= 1/4:
    // N / D is within (r + s) / (1 - s) of n / d, relative to that, but for three roundings
    // of the quotient.
    Seen seen_by(float x, float y, float side) const {
        const auto form = [&](const Vec3<Real> &n) {
            return fused(n.x, Real(x), fused(n.y, Real(y), n.z));
        };
        const Real u = form(edges_[0]), v = form(edges_[1]), w = form(edges_[2]);
        const Real least = minimum(u, minimum(v, w)), greatest = maximum(u, maximum(v, w));
        Seen seen{};
        seen.possible = ~to_bits((least < -edge_error_) & (greatest > edge_error_)) &
                        ((1u << BLOCK_WIDTH) - 1);
        if (seen.possible == 0)
            return seen;
        seen.certain = to_bits((least > edge_error_) | (greatest < -edge_error_));
        const Real reciprocal = 1.0f / form(normal_);
        const Real depth = numerator_ * side * reciprocal;
        const Real own_share = normal_error_ * absolute(reciprocal);
        const Real share = 1.5f * (numerator_share_ + own_share) + WIDEN_DEPTH;
        const auto known = (numerator_share_ <= 0.25f) & (own_share <= 0.25f);
        const Real slack = absolute(depth) * share;
        seen.nearest = select(known, depth - slack, Real(-INFINITY));
        seen.farthest = select(known, depth + slack, Real(INFINITY));
        return seen;
    }

private:
    static constexpr float LARGEST_SIZE = 0x1p40f;
    // Much more than what underflow may take.
    static constexpr float UNDERFLOW = 0x1p-120f;
    static constexpr float WIDEN_DEPTH = 12 * FLOAT_ROUNDOFF;

    Vec3<Real> edges_[3], normal_;
    Real numerator_, numerator_share_, edge_error_, normal_error_;
};

} // namespace mlrt
