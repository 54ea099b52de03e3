// Where a ray met a surface, and how the surface lies there.
#pragma once

#include "geometry/triangle_test.h"
#include "render/prepared_scene.h"

#include <cmath>
#include <cstdint>

namespace mlrt {

struct SurfacePoint {
    Vec3f p{};
    Vec3f face_normal{};    // unit; by the order of the vertices, not turned to the ray
    Vec3f shading_normal{}; // unit
    uint32_t shape = NONE;
};

// `at` holds the weights of the second and third vertex.
SurfacePoint surface_point(const PreparedScene &scene, uint32_t primitive, Vec2f at);

inline SurfacePoint hit_surface(const PreparedScene &scene, Vec3f origin, Vec3f direction,
                                uint32_t primitive) {
    const Triangle &triangle = scene.data.tree->triangles[primitive];
    return surface_point(scene, primitive, barycentrics(origin, direction, triangle));
}

} // namespace mlrt
