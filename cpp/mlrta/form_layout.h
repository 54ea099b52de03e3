// How triangles and their forms lie over the rectangle of a beam, whose rays have a common
// origin or a common direction.
#pragma once

#include "base/simd.h"
#include "base/vec.h"
#include "mlrta/triangle_forms.h"
#include "traverse/parameter_interval.h"

#include <array>

namespace mlrt {

// The rectangle's numbers, in all lanes.
template <typename Real>
struct LaidRectangle {
    Real center_u, center_v, cosine, sine, half_p, half_q;

    explicit LaidRectangle(const SlopeRectangle &r)
        : center_u(r.center_u), center_v(r.center_v), cosine(r.cosine), sine(r.sine),
          half_p(r.half_p), half_q(r.half_q) {}
};

// A rectangle parallel to that of the beam around the vertices of each triangle, which are
// given by their (u, v). A difference, two products and a sum lead to the coordinates of a
// vertex.
template <typename Real>
struct VertexBox {
    Real lo_p{INFINITE}, hi_p{-INFINITE}, lo_q{INFINITE}, hi_q{-INFINITE};

    VertexBox(const LaidRectangle<Real> &r, const std::array<Vec2<Real>, 3> &vertices) {
        for (const Vec2<Real> &vertex : vertices) {
            const Real du = vertex.x - r.center_u, dv = vertex.y - r.center_v;
            const Real p = fused(du, r.cosine, dv * r.sine);
            const Real q = fused(dv, r.cosine, -(du * r.sine));
            lo_p = minimum(p, lo_p);
            hi_p = maximum(p, hi_p);
            lo_q = minimum(q, lo_q);
            hi_q = maximum(q, hi_q);
        }
    }

    // The greatest size of a coordinate.
    Real farthest() const { return maximum(maximum(-lo_p, hi_p), maximum(-lo_q, hi_q)); }
};

// Stores the box, wider by `slack` on each side, and without bounds where a vertex does not
// lie ahead. Returns whether it is known to miss the beam's rectangle.
template <typename Real>
MaskOf<Real> TriangleForms::put_box(const LaidRectangle<Real> &rectangle,
                                    const VertexBox<Real> &box, const Real &slack,
                                    const MaskOf<Real> &ahead) {
    const auto put = [&](const Real &lo, const Real &hi, const Real &half, Lanes &middles,
                         Lanes &extents) {
        const Real middle = select(ahead, 0.5f * (lo + hi), Real(0.0f));
        const Real extent = select(ahead, 0.5f * (hi - lo) + slack, Real(INFINITE));
        store(middles, middle);
        store(extents, extent);
        return absolute(middle) > extent + half;
    };
    return put(box.lo_p, box.hi_p, rectangle.half_p, box_p, box_half_p) |
           put(box.lo_q, box.hi_q, rectangle.half_q, box_q, box_half_q);
}

// Stores a form, also as it is over the rectangle. Returns the greatest value there.
template <typename Real>
Real TriangleForms::put_form(int form, const LaidRectangle<Real> &r, const Real &form_1,
                             const Real &form_u, const Real &form_v) {
    const Real middle = fused(form_u, r.center_u, fused(form_v, r.center_v, form_1));
    const Real form_p = fused(form_u, r.cosine, form_v * r.sine);
    const Real form_q = fused(form_v, r.cosine, -(form_u * r.sine));
    store(constant[form], form_1);
    store(of_u[form], form_u);
    store(of_v[form], form_v);
    store(center[form], middle);
    store(of_p[form], form_p);
    store(of_q[form], form_q);
    const Real along_p = absolute(form_p), along_q = absolute(form_q);
    store(size_p[form], along_p);
    store(size_q[form], along_q);
    return middle + fused(along_p, r.half_p, along_q * r.half_q);
}

} // namespace mlrt
