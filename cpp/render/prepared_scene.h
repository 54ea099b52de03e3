// A scene together with what rendering derives from it once.
#pragma once

#include "render/camera.h"
#include "render/distribution.h"
#include "render/environment.h"
#include "render/face_range.h"
#include "render/glowing_faces.h"
#include "render/point_light.h"
#include "render/projector.h"
#include "render/scene.h"
#include "render/texture_sampler.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace mlrt {

// What sampling an emitter needs beyond its description.
struct EmitterTable {
    Distribution face_areas;   // area, on a mesh but a rectangle: of its faces
    Vec3f normal{};            // rectangle, disk: unit, on the side that glows
    float inverse_area = 0;    // area: 1 / area
    TextureSampler texture;    // area, with a texture: of its points
    float edge_scale = 1;      // area: a power of two, 1 unless the area is tiny
    PointLight<float> point{}; // point, spot
    Projector projector;       // projector
    float unevenness = 0;      // rectangle: how far it lies off the plane of its first face
    bool shadow_rays_from_light = false; // of robust shadow rays: they form beams
};

struct PreparedScene {
    SceneData data;
    ImagePlane plane;
    std::vector<uint32_t> shape_of_face;
    std::vector<Material> shape_materials; // one a shape, black where there is none
    bool any_shape_glows = false;
    FaceRange glowing_faces, textured_faces;  // the latter by their materials
    bool all_emitters_are_points = true;      // or spots, of those that are ever chosen
    std::vector<EmitterTable> emitter_tables; // one an emitter
    std::optional<FewPoints> few_points;      // if all are, and at most sixteen
    Distribution emitter_choice;              // empty if all emitters are equally likely
    Environment environment;
    LazyGlowingFaces glowing; // asked for BSDF samples only
    Box3f bounds;             // of all that rays can hit
    Vec3f center{};           // of a sphere around the bounds
    float radius = 0;

    explicit PreparedScene(SceneData scene_data);

    // Whether a face belongs to the object set, not to the tree.
    bool is_on_object(uint32_t face) const {
        return data.objects && face >= data.objects->first_face;
    }
    // The analytic shape that a shape is, or none.
    const AnalyticShape *analytic(const Shape &shape) const {
        return data.objects && data.objects->is_analytic(shape.first_face)
                   ? &data.objects
                          ->analytic[shape.first_face - data.objects->first_analytic_face]
                   : nullptr;
    }
};

} // namespace mlrt
