// The triangles that both engines are given.
#pragma once

#include "base/huge_array.h"
#include "geometry/triangle.h"
#include "kdtree/chunks.h"

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

    // As the plugin makes them of its arrays.
    HugeArray<Triangle> triangles() const {
        HugeArray<Triangle> result(faces.size());
        for_each_chunk(faces.size(), all_threads(),
                       [&](uint32_t, uint64_t first, uint64_t last) {
                           for (uint64_t i = first; i < last; ++i)
                               result[i] = {vertices[faces[i][0]], vertices[faces[i][1]],
                                            vertices[faces[i][2]]};
                       });
        return result;
    }
};

} // namespace mlrt::bench
