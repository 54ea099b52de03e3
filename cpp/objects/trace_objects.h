// Rays against an object set, after the triangles of the scene's tree: by one ray at a
// time.
#pragma once

#include "base/counters.h"
#include "objects/object_set.h"
#include "traverse/ray_group.h"

#include <cstdint>

namespace mlrt {

// The nearest hits of rays, by ray: t, number of the face, and of the instance or
// NO_INSTANCE.
struct ObjectHitGroup {
    float *t = nullptr;
    uint32_t *face = nullptr;
    uint32_t *instance = nullptr;
};

// Replaces hits by those that are nearer. On entry `hits` holds what trace_closest() has
// found in the scene's tree, with distances; instances are only written.
void trace_closest_objects(const ObjectSet &objects, const RayGroup &rays,
                           const ObjectHitGroup &hits, Counters &counters);

// Sets occluded[ray] to 1 for rays that any object lies on; those set are not looked at.
void trace_any_objects(const ObjectSet &objects, const RayGroup &rays, uint8_t *occluded,
                       Counters &counters);

// A ray in the frame of an instance's group, in single precision.
struct GroupRay {
    Vec3f origin, direction;
};
GroupRay to_group(const Instance &instance, Vec3f origin, Vec3f direction);

} // namespace mlrt
