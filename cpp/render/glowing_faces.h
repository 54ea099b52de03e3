// Which faces glow. Rays that materials send out to find lights bring nothing back unless
// they meet one: most are done with once they are known to meet none, which is found out
// much faster than what they meet.
#pragma once

#include "kdtree/tree.h"
#include "render/scene.h"

#include <memory>

namespace mlrt {

// A tree of the faces that glow, in no particular order; none if looking into it would not
// pay, or some are not triangles of the scene's tree.
std::shared_ptr<const KdTree> tree_of_glowing_faces(const SceneData &scene);

} // namespace mlrt
