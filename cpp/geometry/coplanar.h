// Triangles that lie in one plane.
#pragma once

#include "geometry/triangle.h"

namespace mlrt {

// Whether two triangles, if both have an area, certainly lie in one plane: one across an
// axis, or that of the same three vertices. Surfaces that were modelled twice do.
inline bool in_one_plane(const Triangle &one, const Triangle &other) {
    for (int k = 0; k < 3; ++k) {
        const float at = one.a[k];
        if (one.b[k] == at && one.c[k] == at)
            return other.a[k] == at && other.b[k] == at && other.c[k] == at;
    }
    const auto is_of_one = [&](Vec3f v) { return v == one.a || v == one.b || v == one.c; };
    return is_of_one(other.a) && is_of_one(other.b) && is_of_one(other.c);
}

} // namespace mlrt
