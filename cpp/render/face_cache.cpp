#include "render/face_cache.h"

#include "render/surface.h"

namespace mlrt {

HitFace hit_face(Vec3f origin, const Corners<float> &corners, const Corners<float> *normals,
                 bool flip_normals) {
    // In double precision, where the product of tiny edges does not vanish.
    const Vec3d a(corners.a);
    const Vec3d edge_b = Vec3d(corners.b) - a, edge_c = Vec3d(corners.c) - a;
    const Vec3d product = cross(edge_b, edge_c);
    const double sign = flip_normals ? -1.0 : 1.0;
    const double scale = sign / length(product);
    HitFace face;
    face.edge_b = Vec3f(edge_b * scale);
    face.edge_c = Vec3f(edge_c * scale);
    const Vec3f way = origin - corners.a;
    face.parts = {corners, Vec3f(product * scale), cross(way, face.edge_c),
                  cross(face.edge_b, way)};
    if (normals) {
        const float turn(sign);
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
