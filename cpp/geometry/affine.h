// Affine maps in double precision, in which the frames of objects are kept.
#pragma once

#include "base/vec.h"

#include <array>

namespace mlrt {

// p -> x * p.x + y * p.y + z * p.z + origin: the columns are the images of the axes.
struct Affine {
    std::array<Vec3d, 3> axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    Vec3d origin{};

    constexpr Vec3d vector(Vec3d v) const {
        return (axes[0] * v.x + axes[1] * v.y) + axes[2] * v.z;
    }
    constexpr Vec3d point(Vec3d p) const { return vector(p) + origin; }

    // Six times the volume that the unit tetrahedron is mapped to, with its sign.
    constexpr double determinant() const { return dot(axes[0], cross(axes[1], axes[2])); }

    // The determinant must not be zero.
    constexpr Affine inverse() const {
        const double scale = 1 / determinant();
        const Vec3d row[3] = {cross(axes[1], axes[2]) * scale,
                              cross(axes[2], axes[0]) * scale,
                              cross(axes[0], axes[1]) * scale};
        Affine inverse;
        for (int k = 0; k < 3; ++k)
            inverse.axes[size_t(k)] = {row[0][k], row[1][k], row[2][k]};
        inverse.origin = -inverse.vector(origin);
        return inverse;
    }
};

} // namespace mlrt
