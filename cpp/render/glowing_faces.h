// Which faces glow. Rays that materials send out to find lights bring nothing back unless
// they meet one: most are done with once they are known to meet none, which is found out
// much faster than what they meet.
#pragma once

#include "kdtree/tree.h"
#include "objects/object_set.h"
#include "render/scene.h"

#include <memory>
#include <mutex>
#include <optional>

namespace mlrt {

// The faces that glow, numbered in no particular order.
struct GlowingFaces {
    std::shared_ptr<const KdTree> tree;       // maybe empty
    std::shared_ptr<const ObjectSet> objects; // maybe none
};

// None if nothing glows, or so much that looking for it would not pay, or if some of it is
// in instances.
std::optional<GlowingFaces> glowing_faces(const SceneData &scene);

// The same, found out when it is first asked for, by any thread.
class LazyGlowingFaces {
public:
    const std::optional<GlowingFaces> &of(const SceneData &scene) const {
        std::call_once(once_, [&] { faces_ = glowing_faces(scene); });
        return faces_;
    }

private:
    mutable std::once_flag once_;
    mutable std::optional<GlowingFaces> faces_;
};

} // namespace mlrt
