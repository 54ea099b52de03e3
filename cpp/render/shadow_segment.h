// Both ends of shadow rays, clear of the surfaces that they lie on by the bounds of
// shadow_offset.h.
#pragma once

#include "render/emitter_sampling.h"
#include "render/prepared_scene.h"
#include "render/surface.h"

namespace mlrt {

// Camera rays, and the faces that they are known to hit.
template <typename Real>
struct HitRays {
    const Vec3<Real> &origin, &direction;
    const FacesOf<Real> &faces;
};

template <typename Real>
struct ShadowSegment {
    Vec3<Real> start, target;
};

// From the hits to samples of emitters. The segment meets neither the plane of the face
// that was hit nor that of the face that the sample lies on, unless they are on different
// sides. It is meant for the rays that ShadowTracer makes of it: those of an emitter whose
// table says so begin at the light.
template <typename Real, typename Samples>
ShadowSegment<Real> robust_segment(const PreparedScene &scene, const HitRays<Real> &hits,
                                   const Samples &light);

// Where rays go on that pass through the faces they hit.
template <typename Real>
Vec3<Real> robust_passage(const PreparedScene &scene, const HitRays<Real> &hits);

} // namespace mlrt
