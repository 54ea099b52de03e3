#include "render/glowing_faces.h"

#include "kdtree/builder.h"

#include <algorithm>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace mlrt {

std::shared_ptr<const KdTree> tree_of_glowing_faces(const SceneData &scene) {
    constexpr size_t MOST_FACES = 1 << 14; // built in some milliseconds; chosen
    constexpr size_t SHARE = 4;            // of all faces, inverse; chosen
    std::vector<Triangle> glowing;
    const size_t most = std::min(MOST_FACES, scene.tree->triangles.size() / SHARE);
    for (const Shape &shape : scene.shapes) {
        if (shape.emitter == NONE)
            continue;
        const bool on_objects =
            scene.objects && shape.first_face >= scene.objects->first_face;
        if (on_objects || glowing.size() + shape.face_count > most)
            return nullptr;
        const Triangle *first = scene.tree->triangles.data() + shape.first_face;
        glowing.insert(glowing.end(), first, first + shape.face_count);
    }
    if (glowing.empty())
        return nullptr;
    std::optional<BuiltTree> built =
        build_kd_tree(HugeArray<Triangle>(std::span<const Triangle>(glowing)));
    return std::make_shared<const KdTree>(std::move(built->tree));
}

} // namespace mlrt
