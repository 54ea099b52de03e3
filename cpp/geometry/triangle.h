// The triangle as it is stored for tracing, and what identifies it.
#pragma once

#include "base/vec.h"

#include <array>
#include <cstdint>

namespace mlrt {

// Three vertices in world space. The number of a triangle is its position in the list of
// faces that the scene was given, and decides between hits at equal distance: the lower one
// wins.
struct Triangle {
    Vec3f a, b, c;

    constexpr const Vec3f &operator[](int i) const { return i == 0 ? a : i == 1 ? b : c; }
};

inline bool is_finite(const Triangle &triangle) {
    return is_finite(triangle.a) && is_finite(triangle.b) && is_finite(triangle.c);
}

static_assert(sizeof(Triangle) == 36);

inline constexpr uint32_t NO_PRIMITIVE = 0xffffffffu;

} // namespace mlrt
