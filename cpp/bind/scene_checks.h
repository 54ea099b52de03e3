// Whether the parts of a scene fit together; ValueError is raised if they do not.
#pragma once

#include "render/scene.h"

namespace mlrt {

// Whether the faces of a shape are not in the tree but in the set of objects.
bool is_object(const SceneData &scene, const Shape &shape);

// Light from all around comes from one emitter at most, and a picture belongs to it.
void check_environment(const SceneData &scene);

// Shapes cover the faces in order, and refer to their emitters as these refer to them.
void check_shapes(const SceneData &scene);

// Faces refer to normals that exist and are finite.
void check_vertices(const SceneData &scene);

} // namespace mlrt
