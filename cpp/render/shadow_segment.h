// Both ends of shadow rays, clear of the surfaces that they lie on by the bounds of
// shadow_offset.h.
#pragma once

#include "render/emitter_sampling.h"
#include "render/prepared_scene.h"
#include "render/surface.h"

#include <cstdint>

namespace mlrt {

// Camera rays, and the faces of the scene's tree that they are known to hit.
template <typename Real>
struct HitRays {
    const Vec3<Real> &origin, &direction;
    const FacesOf<Real> &faces;
};

// A point of a surface in double precision, with the unit normal of the plane that touches
// it there, and how far rounding may have taken it off.
template <typename Double>
struct SurfacePlane {
    Vec3<Double> p, normal, error;
};

// How far a point of an analytic shape lies off it, at most, and more: see
// object_surface.h.
Vec3d analytic_error(const AnalyticShape &shape);

// Where a ray hits a triangle.
template <typename Real>
SurfacePlane<DoubleOf<Real>> plane_at(const Vec3<Real> &origin, const Vec3<Real> &direction,
                                      const Corners<Real> &corners);

template <typename Real>
SurfacePlane<DoubleOf<Real>> hit_plane(const PreparedScene &scene,
                                       const HitRays<Real> &hits);

template <typename Real>
struct ShadowSegment {
    Vec3<Real> start, target;
};

// From the hits to samples of an emitter. The segment meets neither the plane of the face
// that was hit nor that of the face that the sample lies on, unless they are on different
// sides. It is meant for the rays that ShadowRays makes of it: those of an emitter whose
// table says so begin at the light.
template <typename Real>
ShadowSegment<Real> robust_segment(const PreparedScene &scene,
                                   const SurfacePlane<DoubleOf<Real>> &hit,
                                   uint32_t emitter, const EmitterSample<Real> &light);

// Where rays go on that pass through the surfaces they hit.
template <typename Real>
Vec3<Real> robust_passage(const SurfacePlane<DoubleOf<Real>> &hit,
                          const Vec3<Real> &direction);

} // namespace mlrt
