// The surfaces of objects that rays have hit, for those lanes of a packet that have: one
// lane after the other, in double precision.
#pragma once

#include "base/simd.h"
#include "render/prepared_scene.h"
#include "render/shadow_segment.h"
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

// The same in double precision, for robust shadow rays. How far the point may lie off the
// surface:
//
// On an analytic shape, by the rounding of double precision; the error that is given is
// 2^-30 of the largest coordinate, which a ray of single precision does not notice, so that
// also the intersection, which is not exact, takes the start of the ray to lie beside the
// surface.
//
// In an instance, with the map p = L q + T of the point q of the group, by what comes of
// rounding a ray that starts there to single precision in the frame of the group,
// |L| (u |q|), and by the error of the inverse of L in double precision, |L| |L^-1|
// (|p| + |T|) 2^-50.
SurfacePlane<double> object_plane(const PreparedScene &scene, const ObjectHit &hit);

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
void place_object_planes(const PreparedScene &scene, const ObjectHits &hits, LaneBits lanes,
                         SurfacePlane<DoublePacket> &plane);

} // namespace mlrt
