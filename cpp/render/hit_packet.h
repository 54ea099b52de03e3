// Sixteen rays that meet surfaces, on meshes or on objects, and how the surfaces lie there.
#pragma once

#include "base/simd.h"
#include "render/emitter_sampling.h"
#include "render/prepared_scene.h"
#include "render/shadow_offset.h"
#include "render/shadow_segment.h"
#include "render/surface.h"

#include <cstddef>
#include <optional>

namespace mlrt {

// Up to sixteen rays that meet a surface.
struct HitPacket {
    LaneBits lanes = 0;
    std::optional<size_t> first; // ray in lane 0, if the others follow it
    UIntPacket ray, faces;
    Vec3<FloatPacket> origin, direction;
    // If the scene has objects: the distance, and the instance or NO_INSTANCE.
    FloatPacket t;
    UIntPacket instances;
};

inline LaneBits not_black(const Vec3<FloatPacket> &colour) {
    const FloatPacket zero(0.0f);
    return to_bits((colour.x != zero) | (colour.y != zero) | (colour.z != zero));
}

// What an array with an entry a ray holds for the packet.
inline FloatPacket of_rays(const HitPacket &hit, const float *values) {
    return hit.first ? load<FloatPacket>(values + *hit.first) : gather(values, hit.ray);
}

// `common_origin`: the rays start where all of the cache's do.
SurfacePoint<FloatPacket> surface_of(const PreparedScene &scene, FaceCache &cache,
                                     const HitPacket &hit, bool common_origin);

// The same for robust shadow rays.
SurfacePlane<DoublePacket> plane_of(const PreparedScene &scene, const HitPacket &hit);

// The shadow ray from the hits to samples of any emitters, with Mitsuba's offset.
inline ShadowSegment<FloatPacket> mitsuba_segment(const SurfacePoint<FloatPacket> &point,
                                                  const EmitterSample<FloatPacket> &light) {
    return {offset_point(point.p, point.face_normal, light.target - point.p), light.target};
}

// The same to samples of one emitter.
inline ShadowSegment<FloatPacket> shadow_segment(const PreparedScene &scene,
                                                 ShadowOffset offset, const HitPacket &hit,
                                                 const SurfacePoint<FloatPacket> &point,
                                                 uint32_t emitter,
                                                 const EmitterSample<FloatPacket> &light) {
    if (offset == ShadowOffset::robust)
        return robust_segment<FloatPacket>(scene, plane_of(scene, hit), emitter, light);
    return mitsuba_segment(point, light);
}

// Where rays begin that leave the surface in the given directions, or pass through it.
inline Vec3<FloatPacket> onward_start(const PreparedScene &scene, ShadowOffset offset,
                                      const HitPacket &hit,
                                      const SurfacePoint<FloatPacket> &point,
                                      const Vec3<FloatPacket> &direction) {
    return offset == ShadowOffset::robust
               ? robust_passage<FloatPacket>(plane_of(scene, hit), direction)
               : offset_point(point.p, point.face_normal, direction);
}

} // namespace mlrt
