#include "render/prepared_scene.h"

#include "render/shadow_offset.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

namespace {

float face_area(const Triangle &triangle) {
    return 0.5f * length(cross(triangle.b - triangle.a, triangle.c - triangle.a));
}

EmitterTable prepare_emitter(const SceneData &scene, const Emitter &emitter) {
    EmitterTable table;
    if (emitter.type == EmitterType::spot) {
        table.cos_cutoff = float(std::cos(double(emitter.cutoff_angle)));
        table.cos_beam = float(std::cos(double(emitter.beam_width)));
        table.inverse_transition = 1.0f / (emitter.cutoff_angle - emitter.beam_width);
    }
    if (emitter.type != EmitterType::area)
        return table;

    const Shape &shape = scene.shapes[emitter.shape];
    if (emitter.rectangle) {
        const Vec3f normal = cross(emitter.edge_u, emitter.edge_v);
        const float area = length(normal);
        table.inverse_area = area > 0 ? 1.0f / area : 0.0f;
        // A mirrored rectangle glows on the side of its vertex normals, which is not that
        // of its edges' product.
        table.normal = shape.vertex_normals
                           ? scene.normals[scene.faces[shape.first_face][0]]
                           : normal * table.inverse_area;
        if (shape.flip_normals)
            table.normal = -table.normal;
    } else {
        std::vector<float> areas(shape.face_count);
        for (uint32_t i = 0; i < shape.face_count; ++i)
            areas[i] = face_area(scene.tree->triangles[shape.first_face + i]);
        table.face_areas = Distribution(areas);
        table.inverse_area = table.face_areas.normalization();
    }
    return table;
}

} // namespace

PreparedScene::PreparedScene(SceneData scene_data)
    : data(std::move(scene_data)), plane(image_plane(data.camera, data.film)) {
    shape_of_face.resize(data.tree->triangles.size());
    for (uint32_t i = 0; i < data.shapes.size(); ++i) {
        const Shape &shape = data.shapes[i];
        any_shape_glows |= shape.emitter != NONE;
        const Material material =
            shape.material == NONE ? Material{} : data.materials[shape.material];
        shape_colours.push_back({material.front, material.back, shape.emitter});
        std::fill_n(shape_of_face.begin() + shape.first_face, shape.face_count, i);
    }

    std::vector<float> weights;
    for (const Emitter &emitter : data.emitters) {
        emitter_tables.push_back(prepare_emitter(data, emitter));
        weights.push_back(emitter.sampling_weight);
    }
    if (std::any_of(weights.begin(), weights.end(), [](float w) { return w != 1.0f; }))
        emitter_choice = Distribution(weights);

    const Box3f &bounds = data.tree->bounds;
    if (!bounds.empty()) {
        center = (bounds.lo + bounds.hi) * 0.5f;
        radius = std::max(RAY_EPSILON, length(bounds.hi - center) * (1 + RAY_EPSILON));
    }
}

} // namespace mlrt
