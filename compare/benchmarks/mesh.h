// The triangles that both engines are given.
#pragma once

#include "geometry/triangle.h"

#include <array>
#include <cstdint>
#include <vector>

namespace mlrt::bench {

struct Mesh {
    // Embree reads 16 bytes of each vertex of a shared buffer, so one more follows the
    // last.
    std::vector<Vec3f> vertices;
    std::vector<std::array<uint32_t, 3>> faces;

    size_t vertex_count() const { return vertices.size() - 1; }

    std::vector<Triangle> triangles() const {
        std::vector<Triangle> result(faces.size());
        for (size_t i = 0; i < faces.size(); ++i)
            result[i] = {vertices[faces[i][0]], vertices[faces[i][1]],
                         vertices[faces[i][2]]};
        return result;
    }
};

} // namespace mlrt::bench
