// Reads textures from Python, and checks that they fit the shapes that they lie on.
#pragma once

#include "render/scene.h"

#include <nanobind/nanobind.h>
#include <vector>

namespace mlrt {

// Dicts whose keys are the fields of Texture (render/texture.h); `texels` is an array of
// float32, or of uint8 with `decoded`, float32 (256,).
std::vector<Texture> textures_from(const nanobind::list &dicts);

// Raises ValueError unless each shape with a textured material has what that needs: vertex
// numbers of faces in the tree, texture coordinates if it claims them, and its share of
// attributes.
void check_textures(const SceneData &scene);

} // namespace mlrt
