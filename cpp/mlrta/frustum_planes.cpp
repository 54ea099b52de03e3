#include "mlrta/frustum_planes.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

bool may_enter_by_planes(const Beam &beam, const Box3f &cell) {
    if (!beam.has_planes)
        return true;
    const Vec3d origin{beam.origin[0].lo, beam.origin[1].lo, beam.origin[2].lo};
    for (const Vec3d &normal : beam.plane_normals) {
        double inner = 0; // of the corner farthest along the normal
        double farthest = 0;
        for (int k = 0; k < 3; ++k) {
            const double lo = cell.lo[k] - origin[k], hi = cell.hi[k] - origin[k];
            inner += std::max(normal[k] * lo, normal[k] * hi);
            farthest = std::max({farthest, std::abs(lo), std::abs(hi)});
        }
        const double size = std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z);
        if (inner < -(beam.plane_slack + 0x1p-45) * size * farthest)
            return false;
    }
    return true;
}

} // namespace mlrt
