// Both ends of shadow rays, clear of the surfaces that they lie on by the bounds of
// shadow_offset.h.
#pragma once

#include "render/emitter_sampling.h"
#include "render/prepared_scene.h"
#include "render/surface.h"

#include <cstdint>

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

// From the hits to samples of an emitter. The segment meets neither the plane of the face
// that was hit nor that of the face that the sample lies on, unless they are on different
// sides. It is meant for the rays that ShadowRays makes of it: those of an emitter whose
// table says so begin at the light.
template <typename Real>
ShadowSegment<Real> robust_segment(const PreparedScene &scene, const HitRays<Real> &hits,
                                   uint32_t emitter, const EmitterSample<Real> &light);

// Where rays go on that pass through the faces they hit.
template <typename Real>
Vec3<Real> robust_passage(const PreparedScene &scene, const HitRays<Real> &hits);

} // namespace mlrt
