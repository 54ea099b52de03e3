// The first two rules of Reshetov et al. 2005, section 3.2, which take a plane without
// asking for its cost.
#pragma once

#include "geometry/triangle.h"
#include "kdtree/builder.h"
#include "kdtree/reference.h"

#include <optional>
#include <span>
#include <vector>

namespace mlrt {

// Rule 1: the plane that cuts off the largest empty part of the cell, if that is at least
// `options.empty_cell_share` of it. `contents` are the bounds of what lies in the cell.
// Lengths are compared, whose ratio is that of the volumes and which a flat cell has too.
// Among equals: the first axis, the lower side.
std::optional<SplitPlane> largest_empty_part(const Box3f &contents, const Box3f &cell,
                                             const BuildOptions &options);

// References that lie in the plane {x[axis] = position}, which may be a face of the cell.
struct PlanarGroup {
    int axis;
    float position;
    std::vector<Reference> planar;
};

// Whether those of the group's triangles that lie in the plane as a whole cover all of the
// cell in it.
bool covers(const PlanarGroup &group, const Box3f &cell,
            std::span<const Triangle> triangles);

// An upper limit of the covered area, in shares of what is to be covered: below 1 there is
// no need to ask.
double cover_limit(const Box3f &cell, int axis, double sum_of_bounds);

// Rule 2: the plane of a group that covers the cell; its triangles go to the smaller child,
// the lower one if both are equal. A cell of no extent along an axis has no such plane, so
// no path has two flat cells along one axis.
// `below` and `above` are the other references that reach there.
Candidate flat_cell(const PlanarGroup &group, uint64_t below, uint64_t above,
                    const Box3f &cell, const BuildOptions &options);

// Area of the reference's bounds across an axis.
inline double area_across(const Box3f &bounds, int axis) {
    const int i = (axis + 1) % 3, j = (axis + 2) % 3;
    return (double(bounds.hi[i]) - double(bounds.lo[i])) *
           (double(bounds.hi[j]) - double(bounds.lo[j]));
}

} // namespace mlrt
