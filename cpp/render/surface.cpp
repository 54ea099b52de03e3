#include "render/surface.h"

namespace mlrt {

namespace {

Vec3f interpolate(Vec3f a, Vec3f b, Vec3f c, float wa, float wb, float wc) {
    return {std::fma(a.x, wa, std::fma(b.x, wb, c.x * wc)),
            std::fma(a.y, wa, std::fma(b.y, wb, c.y * wc)),
            std::fma(a.z, wa, std::fma(b.z, wb, c.z * wc))};
}

} // namespace

// Mitsuba 3.9's mesh.cpp, compute_surface_interaction.
SurfacePoint surface_point(const PreparedScene &scene, uint32_t primitive, Vec2f at) {
    const Triangle &triangle = scene.data.tree->triangles[primitive];
    SurfacePoint point;
    point.shape = scene.shape_of_face[primitive];
    const Shape &shape = scene.data.shapes[point.shape];

    const float w1 = at.x, w2 = at.y, w0 = 1.0f - w1 - w2;
    point.p = interpolate(triangle.a, triangle.b, triangle.c, w0, w1, w2);

    // In double precision, where the product of tiny edges does not vanish.
    const Vec3d a(triangle.a);
    point.face_normal =
        Vec3f(normalize(cross(Vec3d(triangle.b) - a, Vec3d(triangle.c) - a)));
    point.shading_normal = point.face_normal;
    if (shape.vertex_normals) {
        const auto &face = scene.data.faces[primitive];
        const Vec3f normal =
            interpolate(scene.data.normals[face[2]], scene.data.normals[face[1]],
                        scene.data.normals[face[0]], w2, w1, w0);
        // Opposite vertex normals can cancel; the face normal is then as good as any.
        if (dot(normal, normal) > 0)
            point.shading_normal = normalize(normal);
    }
    if (shape.flip_normals) {
        point.face_normal = -point.face_normal;
        point.shading_normal = -point.shading_normal;
    }
    return point;
}

} // namespace mlrt
