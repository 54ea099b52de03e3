// Meshes as NumPy arrays.
#pragma once

#include "base/huge_array.h"
#include "geometry/triangle.h"
#include "kdtree/chunks.h"
#include "kdtree/events.h"

#include <nanobind/ndarray.h>
#include <stdexcept>
#include <string>

namespace mlrt {

using Points = nanobind::ndarray<const float, nanobind::shape<-1, 3>, nanobind::c_contig,
                                 nanobind::device::cpu>;
using Faces = nanobind::ndarray<const uint32_t, nanobind::shape<-1, 3>, nanobind::c_contig,
                                nanobind::device::cpu>;

// Raises ValueError or IndexError for what makes no mesh. Without the interpreter's lock.
inline HugeArray<Triangle> triangles_of(const Points &vertices, const Faces &faces) {
    const size_t vertex_count = vertices.shape(0), face_count = faces.shape(0);
    if (face_count > Event::MAX_REFERENCES)
        throw std::invalid_argument("a tree holds at most 2^30 faces");
    const nanobind::gil_scoped_release release;
    HugeArray<Triangle> triangles(face_count);
    for_each_chunk(face_count, all_threads(), [&](uint32_t, uint64_t first, uint64_t last) {
        for (uint64_t i = first; i < last; ++i) {
            Vec3f corner[3];
            for (int j = 0; j < 3; ++j) {
                const uint32_t v = faces(i, size_t(j));
                if (v >= vertex_count)
                    throw std::out_of_range("face " + std::to_string(i) +
                                            " refers to vertex " + std::to_string(v) +
                                            ", but there are only " +
                                            std::to_string(vertex_count));
                corner[j] = {vertices(v, 0), vertices(v, 1), vertices(v, 2)};
            }
            triangles[i] = {corner[0], corner[1], corner[2]};
        }
    });
    return triangles;
}

} // namespace mlrt
