#include "objects/object_set.h"

#include <cmath>
#include <limits>

namespace mlrt {

namespace {

Box3f box_of(const Instance &instance, const Box3f &bounds) {
    constexpr float INFINITE = std::numeric_limits<float>::infinity();
    Box3f box;
    if (bounds.empty())
        return box;
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3d p{corner & 1 ? bounds.hi.x : bounds.lo.x,
                      corner & 2 ? bounds.hi.y : bounds.lo.y,
                      corner & 4 ? bounds.hi.z : bounds.lo.z};
        box.add(Vec3f(instance.to_world.point(p)));
    }
    for (int k = 0; k < 3; ++k) {
        box.lo[k] = std::nextafter(box.lo[k], -INFINITE);
        box.hi[k] = std::nextafter(box.hi[k], INFINITE);
    }
    return box;
}

} // namespace

void ObjectSet::finish() {
    for (ObjectGroup &group : groups) {
        std::vector<Box3f> boxes;
        for (uint32_t i = 0; i < group.analytic_count; ++i)
            boxes.push_back(analytic[group.first_analytic + i].box);
        group.hierarchy = BoxHierarchy(boxes);
        group.bounds = group.hierarchy.bounds();
        if (group.tree && !group.tree->bounds.empty()) {
            group.bounds.add(group.tree->bounds.lo);
            group.bounds.add(group.tree->bounds.hi);
        }
    }
    std::vector<Box3f> boxes;
    for (uint32_t i = 0; i < scene_analytic_count; ++i)
        boxes.push_back(analytic[i].box);
    for (const Instance &instance : instances)
        boxes.push_back(box_of(instance, groups[instance.group].bounds));
    hierarchy = BoxHierarchy(boxes);
}

} // namespace mlrt
