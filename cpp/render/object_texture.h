// Where textures are asked for on objects: analytic shapes, and whatever is in an instance.
#pragma once

#include "render/object_surface.h"
#include "render/texture.h"

namespace mlrt {

// The (u, v) of a point of an analytic shape (Mitsuba 3.9's sphere.cpp, disk.cpp and
// cylinder.cpp): of a sphere longitude and colatitude, of a disk distance from the centre
// and angle, of a cylinder angle and height, each from 0 to 1.
Vec2f surface_coordinates(const AnalyticShape &shape, Vec3d p);

// At a hit on an object. Attributes of meshes are not looked up there.
TexturePoint object_texture_point(const PreparedScene &scene, const ObjectHit &hit);

} // namespace mlrt
