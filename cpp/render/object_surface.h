// The surfaces of objects that rays have hit, for those lanes of a packet that have: one
// lane after the other, in double precision.
#pragma once

#include "base/simd.h"
#include "render/prepared_scene.h"
#include "render/surface.h"

#include <cstdint>

namespace mlrt {

// A hit on an object: on a face of the object set, maybe in an instance.
struct ObjectHit {
    Vec3f origin, direction; // of the ray
    float t = 0;
    uint32_t face = 0;
    uint32_t instance = NO_INSTANCE;
};

// Points and normals are in world space, and turned as the shape asks for. Where an
// instance is, they are found in the frame of its group and transformed (Mitsuba's
// instance.cpp).
SurfacePoint<float> object_surface(const PreparedScene &scene, const ObjectHit &hit);

// The lanes whose face is on an object.
LaneBits lanes_on_objects(const PreparedScene &scene, const UIntPacket &faces,
                          LaneBits lanes);

// Sixteen rays that met objects, each with the distance and instance of its hit.
struct ObjectHits {
    const Vec3<FloatPacket> &origin, &direction;
    const FloatPacket &t;
    const UIntPacket &faces, &instances;

    ObjectHit at(uint32_t lane) const;
};

// Fills in the given lanes.
void place_object_surfaces(const PreparedScene &scene, const ObjectHits &hits,
                           LaneBits lanes, SurfacePoint<FloatPacket> &point);

} // namespace mlrt
