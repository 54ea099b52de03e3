// Where a ray met a surface, and how the surface lies there.
#pragma once

#include "geometry/triangle.h"
#include "render/prepared_scene.h"

#include <cmath>
#include <cstdint>

namespace mlrt {

// Weights of the second and third vertex.
struct Barycentrics {
    float u = 0, v = 0;
};

struct SurfacePoint {
    Vec3f p{};
    Vec3f face_normal{};    // unit; by the order of the vertices, not turned to the ray
    Vec3f shading_normal{}; // unit
    uint32_t shape = NONE;
};

// Barycentrics of a ray that is known to hit the triangle, in double precision because they
// decide where shadow rays start (Moeller and Trumbore 1997, section 2.4, with Cramer's
// rule written out). Rounding may leave them outside of the triangle by a rounding error of
// single precision; they are moved into it.
Barycentrics hit_barycentrics(Vec3f origin, Vec3f direction, const Triangle &triangle);

SurfacePoint surface_point(const PreparedScene &scene, uint32_t primitive, Barycentrics at);

inline SurfacePoint hit_surface(const PreparedScene &scene, Vec3f origin, Vec3f direction,
                                uint32_t primitive) {
    const Triangle &triangle = scene.data.tree->triangles[primitive];
    return surface_point(scene, primitive, hit_barycentrics(origin, direction, triangle));
}

} // namespace mlrt
