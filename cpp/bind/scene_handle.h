// What Python holds of a scene, and the structs that its dicts are read into.
#pragma once

#include "render/prepared_scene.h"
#include "render/spread_samples.h"

#include <memory>
#include <nanobind/nanobind.h>

namespace mlrt {

struct SceneHandle {
    std::shared_ptr<const PreparedScene> scene;
};

Camera camera_from(nanobind::handle dict);
Film film_from(nanobind::handle dict);
Sampler sampler_from(nanobind::handle dict);

} // namespace mlrt
