// The first two rules of Reshetov et al. 2005, section 3.2, which take a plane without
// asking for its cost.
#pragma once

#include "kdtree/sweep.h"

#include <optional>
#include <span>

namespace mlrt {

// Rule 1: the plane that cuts off the largest empty part of the cell, if that is at least
// `options.empty_cell_share` of it. Lengths are compared, whose ratio is that of the
// volumes and which a flat cell has too. Among equals: the first axis, the lower side.
std::optional<SplitPlane> largest_empty_part(const CellContents &contents,
                                             const Box3f &cell,
                                             const BuildOptions &options);

// Rule 2: a plane that the triangles lying in it cover wholly within the cell, be it a face
// of the cell; they go to the smaller child, the lower one if both are equal. Among
// several: the one of the least SAH cost, then the first axis and the lowest position. A
// cell of no extent along an axis is not split along it again, so no path has two flat
// cells along one axis.
std::optional<Candidate> covered_plane(const CellContents &contents, const Box3f &cell,
                                       std::span<const Triangle> triangles,
                                       std::span<const PlanarGroup> groups,
                                       const BuildOptions &options);

} // namespace mlrt
