#include "render/glowing_faces.h"

#include "kdtree/builder.h"

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

namespace mlrt {

std::optional<GlowingFaces> glowing_faces(const SceneData &scene) {
    constexpr size_t MOST_FACES = 1 << 14; // built in some milliseconds; chosen
    constexpr size_t SHARE = 4;            // of all faces, inverse; chosen
    const size_t triangle_count = scene.tree->triangles.size();
    const ObjectSet *objects = scene.objects.get();
    const size_t face_count = objects ? objects->face_end() : triangle_count;
    const size_t most = std::min(MOST_FACES, face_count / SHARE);
    std::vector<Triangle> triangles;
    ObjectSet glowing_objects;
    for (const Shape &shape : scene.shapes) {
        if (shape.emitter == NONE)
            continue;
        if (shape.first_face < triangle_count) {
            const Triangle *first = scene.tree->triangles.data() + shape.first_face;
            triangles.insert(triangles.end(), first, first + shape.face_count);
        } else {
            const uint32_t number = shape.first_face - objects->first_analytic_face;
            if (!objects->is_analytic(shape.first_face) ||
                number >= objects->scene_analytic_count)
                return std::nullopt;
            glowing_objects.analytic.push_back(objects->analytic[number]);
        }
        if (triangles.size() + glowing_objects.analytic.size() > most)
            return std::nullopt;
    }
    if (triangles.empty() && glowing_objects.analytic.empty())
        return std::nullopt;
    GlowingFaces glowing;
    std::optional<BuiltTree> built =
        build_kd_tree(HugeArray<Triangle>(std::span<const Triangle>(triangles)));
    glowing.tree = std::make_shared<const KdTree>(std::move(built->tree));
    if (!glowing_objects.analytic.empty()) {
        glowing_objects.scene_analytic_count = uint32_t(glowing_objects.analytic.size());
        glowing_objects.finish();
        glowing.objects = std::make_shared<const ObjectSet>(std::move(glowing_objects));
    }
    return glowing;
}

} // namespace mlrt
