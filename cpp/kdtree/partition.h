// Distributes the references of a cell to its two children.
#pragma once

#include "base/huge_array.h"
#include "geometry/clip.h"
#include "geometry/triangle.h"
#include "kdtree/chunks.h"
#include "kdtree/reference.h"

#include <functional>
#include <memory>
#include <span>

namespace mlrt {

// What has bounds below the plane goes to the lower child, above to the upper one, in it to
// one of them; what the plane cuts goes to both, with the bounds of its parts. So a
// triangle is left out of a child that it merely touches from the other side: each of its
// points still lies in a closed child that holds it.
struct Halves {
    References lower, upper;
};

class Partitioner {
public:
    Partitioner(std::span<const Triangle> triangles, bool clip)
        : triangles_(triangles), clip_(clip) {}

    // Writes the halves one behind the other to `room`, which holds twice the references.
    Halves split(const References &references, const Box3f &cell, const SplitPlane &plane,
                 Reference *room) const;

    // The same with several threads, into an array that `allocate` gives for a number of
    // references.
    struct OwnHalves : Halves {
        std::shared_ptr<HugeArray<Reference>> list;
    };
    using Allocate = std::function<std::shared_ptr<HugeArray<Reference>>(uint64_t)>;
    OwnHalves split_together(const References &references, const Box3f &cell,
                             const SplitPlane &plane, Crew &crew,
                             const Allocate &allocate) const;

private:
    ClippedHalves cut(const Reference &reference, const Box3f &cell,
                      const SplitPlane &plane) const;

    std::span<const Triangle> triangles_;
    bool clip_;
};

} // namespace mlrt
