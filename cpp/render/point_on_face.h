// Where a ray that is known to hit a face meets it, and how the face lies there: formulas
// for one ray and for sixteen.
#pragma once

#include "base/fused_dot.h"
#include "base/simd.h"
#include "render/face_cache.h"
#include "render/surface.h"

namespace mlrt {

// A Part is a number of one face, float, or of a face a lane, Real.
template <typename Real, typename Part>
Vec3<Real> interpolate(const Corners<Part> &v, const Real &wa, const Real &wb,
                       const Real &wc) {
    return by_axis([&](int k) {
        return fused(Real(v.a[k]), wa, fused(Real(v.b[k]), wb, Real(v.c[k]) * wc));
    });
}

// What the direction of a ray is multiplied by, of a WeightForm, times the direction.
template <typename Double>
struct WeightProducts {
    Double normal, b, c;
};

template <typename Double, typename Part>
WeightProducts<Double> products_of(const Vec3<Double> &direction,
                                   const WeightForm<Part> &form) {
    return {fused_dot(direction, form.normal), fused_dot(direction, form.b),
            fused_dot(direction, form.c)};
}

// As a ray has them that is known to hit; where they are no numbers, some point of the
// face.
template <typename Real>
[[gnu::always_inline]] inline Vec2<Real>
weights_of(const WeightProducts<DoubleOf<Real>> &products) {
    using Double = DoubleOf<Real>;
    const Double scale = Double(1.0) / products.normal;
    const Real zero(0.0f), one(1.0f);
    const Real b = maximum(Real(products.b * scale), zero);
    const Real c = maximum(Real(products.c * scale), zero);
    const Real weight_b = minimum(b, one);
    return {weight_b, minimum(c, one - weight_b)};
}

template <typename Real, typename Part>
Vec3<Real> interpolated_normal(const Vec2<Real> &at, const Corners<Part> &n,
                               const Vec3<Part> &face_normal) {
    const Real w1 = at.x, w2 = at.y, w0 = Real(1.0f) - w1 - w2;
    const Vec3<Real> mean = interpolate<Real>(Corners<Part>{n.c, n.b, n.a}, w2, w1, w0);
    // Opposite vertex normals can cancel; the face normal is then as good as any.
    const MaskOf<Real> has_direction = dot(mean, mean) > Real(0.0f);
    const Vec3<Real> unit = normalize(mean);
    return by_axis(
        [&](int k) { return select(has_direction, unit[k], Real(face_normal[k])); });
}

// Mitsuba 3.9's mesh.cpp, compute_surface_interaction. Normals of vertices are zeros where
// the face normal serves; there need be none if it does everywhere.
template <typename Real, typename Part>
[[gnu::always_inline]] inline SurfacePoint<Real>
point_at(const Vec2<Real> &at, const Corners<Part> &corners, const Vec3<Part> &face_normal,
         const Corners<Part> *normals) {
    const Vec3<Real> normal(face_normal);
    return {interpolate(corners, Real(1.0f) - at.x - at.y, at.x, at.y), normal,
            normals ? interpolated_normal(at, *normals, face_normal) : normal};
}

template <typename Real>
[[gnu::always_inline]] inline SurfacePoint<Real> point_on(const Vec3<Real> &direction,
                                                          const HitFace &face) {
    return point_at(weights_of<Real>(products_of(to_double(direction), face.parts.weights)),
                    face.parts.corners, face.parts.normal,
                    face.vertex_normals ? &face.normals : nullptr);
}

} // namespace mlrt
