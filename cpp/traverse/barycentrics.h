// Where rays cross the triangles that they hit.
#pragma once

#include "kdtree/tree.h"
#include "traverse/ray_group.h"

namespace mlrt {

// For each ray of a group the weights u and v of the second and third vertex of the
// triangle that it is known to hit, those of barycentrics() in triangle_test.h bit for bit;
// zeros where `primitive` is NO_PRIMITIVE. All three arrays hold as many values as the
// group.
void find_barycentrics(const KdTree &tree, const RayGroup &rays, const uint32_t *primitive,
                       float *u, float *v);

} // namespace mlrt
