// A scene together with what rendering derives from it once.
#pragma once

#include "render/camera.h"
#include "render/distribution.h"
#include "render/environment.h"
#include "render/scene.h"

#include <cstdint>
#include <vector>

namespace mlrt {

// What sampling an emitter needs beyond its description.
struct EmitterTable {
    Distribution face_areas;      // area, unless a rectangle: of the faces of its shape
    Vec3f normal{};               // rectangle: unit, on the side that glows
    float inverse_area = 0;       // area: 1 / area
    float cos_cutoff = 0;         // spot
    float cos_beam = 0;           // spot
    float inverse_transition = 0; // spot: 1 / (cutoff_angle - beam_width)
    float unevenness = 0; // rectangle: how far it lies off the plane of its first face
    bool shadow_rays_from_light = false; // of robust shadow rays: they form beams
};

struct PreparedScene {
    SceneData data;
    ImagePlane plane;
    std::vector<uint32_t> shape_of_face;
    std::vector<Material> shape_materials; // one a shape, black where there is none
    bool any_shape_glows = false;
    std::vector<EmitterTable> emitter_tables; // one an emitter
    Distribution emitter_choice;              // empty if all emitters are equally likely
    Environment environment;
    Vec3f center{}; // of a sphere around all triangles
    float radius = 0;

    explicit PreparedScene(SceneData scene_data);
};

} // namespace mlrt
