#include "mlrta/frustum_planes.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace mlrt {

bool may_enter_by_planes(const Beam &beam, const BoxPacket &inside) {
    if (!beam.has_planes)
        return true;
    // The differences have been rounded to float.
    constexpr double ROUNDING = 0x1p-22;
    alignas(32) std::array<float, 8> face;
    store(face.data(), inside);
    for (const Vec3d &normal : beam.plane_normals) {
        double inner = 0; // of the corner farthest along the normal
        double farthest = 0;
        for (int k = 0; k < 3; ++k) {
            const double lo = -face[size_t(k)], hi = face[size_t(k) + 4];
            inner += std::max(normal[k] * lo, normal[k] * hi);
            farthest = std::max({farthest, std::abs(lo), std::abs(hi)});
        }
        const double size = std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z);
        if (inner < -(beam.plane_slack + ROUNDING) * size * farthest)
            return false;
    }
    return true;
}

} // namespace mlrt
