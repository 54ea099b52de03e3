#include "render/face_cache.h"

#include "render/surface.h"

namespace mlrt {

HitFace hit_face(Vec3f origin, const Corners<float> &corners, const Corners<float> *normals,
                 bool flip_normals) {
    // In double precision also because the product of tiny edges vanishes else.
    const Vec3d a(corners.a), way = Vec3d(origin) - a;
    const Vec3d edge_b = Vec3d(corners.b) - a, edge_c = Vec3d(corners.c) - a;
    const Vec3d product = cross(edge_b, edge_c);
    const double scale = 1.0 / length(product);
    const float turn = flip_normals ? -1.0f : 1.0f;
    HitFace face;
    face.edge_b = edge_b * scale;
    face.edge_c = edge_c * scale;
    const Vec3d normal = product * scale;
    face.parts = {corners,
                  turn * Vec3f(normal),
                  {normal, cross(way, face.edge_c), cross(face.edge_b, way)}};
    if (normals) {
        face.vertex_normals = true;
        face.normals = {turn * normals->a, turn * normals->b, turn * normals->c};
    }
    return face;
}

HitFace hit_face(const PreparedScene &scene, Vec3f origin, uint32_t face) {
    const Shape &shape = scene.data.shapes[scene.shape_of_face[face]];
    const Corners<float> normals = normals_of(scene, face);
    return hit_face(origin, corners_of(scene, face),
                    shape.vertex_normals ? &normals : nullptr, shape.flip_normals);
}

void FaceCache::fill(Entry &entry, uint32_t number) {
    entry.number = number;
    entry.face = hit_face(scene_, origin_, number);
}

} // namespace mlrt
