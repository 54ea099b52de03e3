// Triangles as the tests hand them over.
#pragma once

#include "base/huge_array.h"
#include "geometry/triangle.h"

#include <cstring>
#include <nanobind/ndarray.h>

namespace mlrt {

using TriangleArray =
    nanobind::ndarray<const float, nanobind::ndim<3>, nanobind::shape<-1, 3, 3>,
                      nanobind::c_contig, nanobind::device::cpu>;

inline HugeArray<Triangle> triangles_of(const TriangleArray &array) {
    HugeArray<Triangle> triangles(array.shape(0));
    if (!triangles.empty())
        std::memcpy(static_cast<void *>(triangles.data()), array.data(), triangles.bytes());
    return triangles;
}

} // namespace mlrt
