// Sixteen rays that meet surfaces, on meshes or on objects, and how the surfaces lie there.
#pragma once

#include "base/simd.h"
#include "render/prepared_scene.h"
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

// `common_origin`: the rays start where all of the camera's do.
SurfacePoint<FloatPacket> surface_of(const PreparedScene &scene, const HitPacket &hit,
                                     bool common_origin);

// The same for robust shadow rays.
SurfacePlane<DoublePacket> plane_of(const PreparedScene &scene, const HitPacket &hit);

} // namespace mlrt
