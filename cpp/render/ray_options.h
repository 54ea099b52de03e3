// How the rays of a picture go through the scene's tree, by how many there are.
#pragma once

#include "render/render.h"

#include <functional>
#include <optional>

namespace mlrt {

// Makes the wide tree for a picture of that many samples, if it asks for it or if it is
// worth it, and chooses options that fit: none of them changes the picture. Gives nothing
// if it was cancelled.
std::optional<RayOptions> prepare_rays(const PreparedScene &scene,
                                       const RenderSettings &settings, double samples,
                                       const std::function<bool()> &cancelled);

} // namespace mlrt
