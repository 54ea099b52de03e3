// Triangles as a beam of parallel rays sees them.
#include "base/exactness.h"
#include "base/magnitude.h"
#include "geometry/triangle_block.h"
#include "geometry/triangle_test.h"
#include "mlrta/form_layout.h"
#include "traverse/parameter_interval.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

namespace {

// What exceeds it might overflow on the way to a form, what falls below might lose digits
// to underflow.
constexpr float LARGEST_BOUND = 0x1p80f, SMALLEST_AREA = 0x1p-80f;

// More than what underflow may take from what is divided by an area.
constexpr float UNDERFLOW = 0x1p-126f;

// Bounds on errors, in units of roundoff.
//
// Let l be the greatest |u| or |v| of a vertex, h that of the beam's rays, s the greatest
// coordinate relative to the beam and e that of an edge, sheared ones included. Vertices,
// edges, areas and planes come from double precision: with 8 roundings of s or e in a
// vertex or an edge, areas are good to 64 roundings of e^2, constants of edges to 64 of s
// e, and those of planes to 128 of s e^2.
constexpr double DOUBLE_ROUNDINGS = 64 * DOUBLE_ROUNDOFF;
// Edges: coefficients are rounded twice, to single precision and by the product with the
// reciprocal of the area, a form over a rectangle is evaluated with less than 16 roundings
// (see triangle_forms.cpp), of at most 2 (l + h) e each. That is 36 (l + h) e; 48 covers
// products of roundings and the bound itself.
constexpr float EDGE_ROUNDINGS = 48 * FLOAT_ROUNDOFF;
// Depth: the same roundings of the sum of its three terms.
//
// A ray is taken to pass the triangle where it starts, at (u, v), but is within
// `uncertainty` of it there: edges move by that times their lengths, and the depth by that
// times its slopes. A certain hit stays one at every depth of the triangle, so it passes
// the triangle within `uncertainty` of (u, v), where depths are at most s.
constexpr float PLANE_ROUNDINGS = 24 * FLOAT_ROUNDOFF;

template <typename Real>
Vec3<Real> in_single(const Vec3<DoubleOf<Real>> &v) {
    return {Real(v.x), Real(v.y), Real(v.z)};
}

} // namespace

template <typename Real>
void TriangleForms::set_parallel_block(const BeamPackets &beam, float least,
                                       const Triangle *triangles, const uint32_t *numbers,
                                       uint32_t count) {
    using Double = DoubleOf<Real>;
    const TriangleBlock<Real> block(triangles, numbers);
    const auto [i, j, k] = beam.axes;
    const auto in_order = [&](const Vec3<Real> &v) -> Vec3<Double> {
        return {Double(v[i]), Double(v[j]), Double(v[k])};
    };
    // (u, v, z) of a vector.
    const auto sheared = [&](const Vec3<Double> &v) -> Vec3<Double> {
        const Double z = v.z * double(beam.side);
        return {fused(z, Double(-double(beam.slope_u)), v.x),
                fused(z, Double(-double(beam.slope_v)), v.y), z};
    };
    const Vec3<Double> va = in_order(block.a), vb = in_order(block.b),
                       vc = in_order(block.c);
    const Vec3<Double> o{Double(double(beam.origin[i])), Double(double(beam.origin[j])),
                         Double(double(beam.origin[k]))};
    const Vec3<Double> a = sheared(va - o), b = sheared(vb - o), c = sheared(vc - o);
    const Vec3<Double> ab = sheared(vb - va), bc = sheared(vc - vb), ca = sheared(va - vc);
    const Vec3<Double> normal = cross(ca, ab);
    const Double plane = dot(a, normal);

    const Real area(normal.z);
    const Real inverse = 1.0f / area, inverse_size = absolute(inverse);
    const Vec3<Real> fa = in_single<Real>(a), fb = in_single<Real>(b),
                     fc = in_single<Real>(c);
    const Vec3<Real> edges[3] = {in_single<Real>(bc), in_single<Real>(ca),
                                 in_single<Real>(ab)};
    const Real size = maximum(largest_component(fa),
                              maximum(largest_component(fb), largest_component(fc)));
    const Real edge =
        maximum(largest_component(edges[0]),
                maximum(largest_component(edges[1]), largest_component(edges[2])));
    const auto along = [](const Vec3<Real> &v) {
        return maximum(absolute(v.x), absolute(v.y));
    };
    const Real local = maximum(along(fa), maximum(along(fb), along(fc)));
    const Real rays(std::max(std::max(-beam.slope_lo[0], beam.slope_hi[0]),
                             std::max(-beam.slope_lo[1], beam.slope_hi[1])));
    Real share(0.0f), uncertainty(0.0f), edge_bound(0.0f);
    MaskOf<Real> safe = absolute(area) > SMALLEST_AREA;
    if constexpr (EXACT) {
        share = float(DOUBLE_ROUNDINGS) * (edge * edge) * inverse_size + 2 * FLOAT_ROUNDOFF;
        uncertainty = beam.uncertainty(size);
        edge_bound = ((EDGE_ROUNDINGS * (local + rays) + 2.0f * uncertainty +
                       float(DOUBLE_ROUNDINGS) * size) *
                          edge +
                      UNDERFLOW) *
                     inverse_size;
        safe &= (share <= LARGEST_SHARE) & (edge_bound < LARGEST_BOUND);
    }
    const LaneBits given = (1u << count) - 1;
    const LaneBits safe_bits = to_bits(safe) & given;
    unsafe = EXACT ? given & ~safe_bits : 0;
    possible = 0;
    if (safe_bits == 0)
        return;
    store(edge_error, edge_bound);
    store(ray_error, edge_bound);

    // Where the vertices lie in the rectangle: two roundings and what double precision
    // leaves, a difference, two products and a sum, and the middle and extent of all.
    const LaidRectangle<Real> rectangle(beam.rectangle);
    const VertexBox<Real> box(rectangle, {Vec2<Real>{fa.x, fa.y}, Vec2<Real>{fb.x, fb.y},
                                          Vec2<Real>{fc.x, fc.y}});
    const Real slack = (32 * FLOAT_ROUNDOFF) * (local + rays) +
                       float(DOUBLE_ROUNDINGS) * size + 2.0f * uncertainty;
    MaskOf<Real> inside = safe & ~put_box(rectangle, box, slack, MaskOf<Real>(true));
    possible = to_bits(inside) & safe_bits;
    if (possible == 0)
        return;

    const Vec3<Double> *vertices[3] = {&b, &c, &a};
    const Vec3<Double> *directions[3] = {&bc, &ca, &ab};
    for (int form = 0; form < 4; ++form) {
        Real form_1, form_u, form_v;
        if (form == DEPTH) {
            form_1 = -Real(plane) * inverse;
            form_u = Real(normal.x) * inverse;
            form_v = Real(normal.y) * inverse;
        } else {
            const Vec3<Double> &p = *vertices[form], &d = *directions[form];
            form_1 = Real(p.x * d.y - p.y * d.x) * inverse;
            form_u = -edges[form].y * inverse;
            form_v = edges[form].x * inverse;
        }
        const Real greatest = put_form(form, rectangle, form_1, form_u, form_v);
        if (form == DEPTH) {
            // The area's error acts on a depth of at most the size.
            const Real slopes = absolute(form_u) + absolute(form_v);
            const Real error =
                EXACT_DISTANCES
                    ? 2.0f * (PLANE_ROUNDINGS * fused(slopes, rays, absolute(form_1)) +
                              slopes * uncertainty + 2.0f * (share * size) +
                              UNDERFLOW * inverse_size)
                    : Real(0.0f);
            store(depth_error, error);
            store(depth_grow, Real(1.0f));
            store(depth_shrink, Real(1.0f));
            inside &= greatest + error >= least;
        } else {
            inside &= greatest >= -edge_bound;
        }
    }
    possible = to_bits(inside) & safe_bits;
}

void TriangleForms::set_parallel(const BeamPackets &beam, float least,
                                 const Triangle *triangles, const uint32_t *numbers,
                                 uint32_t count) {
    if (wide_)
        set_parallel_block<FloatWide>(beam, least, triangles, numbers, count);
    else
        set_parallel_block<FloatBlock>(beam, least, triangles, numbers, count);
}

} // namespace mlrt
