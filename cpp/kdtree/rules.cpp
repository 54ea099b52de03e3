#include "kdtree/rules.h"

#include "geometry/cover.h"
#include "kdtree/sah.h"

namespace mlrt {

namespace {

// Shares of the cell's cross-section by which a cover may fall short and still count: the
// seams that rounding leaves between the clipped triangles are far narrower. Chosen.
constexpr double COVER_TOLERANCE = 1e-6;

} // namespace

std::optional<SplitPlane> largest_empty_part(const Box3f &contents, const Box3f &cell,
                                             const BuildOptions &options) {
    std::optional<SplitPlane> plane;
    double largest = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double length = extent(cell, axis);
        if (!(length > 0))
            continue;
        const float first = contents.lo[axis], last = contents.hi[axis];
        const double below = (double(first) - double(cell.lo[axis])) / length;
        const double above = (double(cell.hi[axis]) - double(last)) / length;
        if (below >= options.empty_cell_share && below > largest) {
            largest = below;
            plane = SplitPlane{axis, first, false};
        }
        if (above >= options.empty_cell_share && above > largest) {
            largest = above;
            plane = SplitPlane{axis, last, true};
        }
    }
    return plane;
}

double cover_limit(const Box3f &cell, int axis, double sum_of_bounds) {
    const double section = area_across(cell, axis);
    return section > 0 ? sum_of_bounds / (section * (1 - COVER_TOLERANCE)) : 0;
}

bool covers(const PlanarGroup &group, const Box3f &cell,
            std::span<const Triangle> triangles) {
    const int i = (group.axis + 1) % 3, j = (group.axis + 2) % 3;
    double bounds_sum = 0;
    for (const Reference &reference : group.planar)
        bounds_sum += area_across(reference.bounds, group.axis);
    if (!(cover_limit(cell, group.axis, bounds_sum) >= 1))
        return false;

    const Rectangle section{{double(cell.lo[i]), double(cell.lo[j])},
                            {double(cell.hi[i]), double(cell.hi[j])}};
    double area_sum = 0;
    std::vector<Triangle2> flat;
    for (const Reference &reference : group.planar) {
        const Triangle &triangle = triangles[reference.triangle];
        // What only touches the plane within the cell covers nothing of it.
        if (triangle.a[group.axis] != group.position ||
            triangle.b[group.axis] != group.position ||
            triangle.c[group.axis] != group.position)
            continue;
        Triangle2 projected;
        for (int k = 0; k < 3; ++k)
            projected[k] = {double(triangle[k][i]), double(triangle[k][j])};
        area_sum += area_within(projected, section);
        flat.push_back(projected);
    }
    if (!(cover_limit(cell, group.axis, area_sum) >= 1))
        return false;

    // Overlaps, duplicates above all, are counted twice in the sum.
    const double tolerance = COVER_TOLERANCE * area(section);
    return uncovered_area(section, flat, tolerance) <= tolerance;
}

Candidate flat_cell(const PlanarGroup &group, uint64_t below, uint64_t above,
                    const Box3f &cell, const BuildOptions &options) {
    const double lower_extent = double(group.position) - double(cell.lo[group.axis]);
    const double upper_extent = double(cell.hi[group.axis]) - double(group.position);
    Candidate candidate{
        {group.axis, group.position, lower_extent <= upper_extent}, below, above, 0};
    (candidate.plane.planar_below ? candidate.lower_count : candidate.upper_count) +=
        group.planar.size();
    candidate.cost = SplitCost(options, cell, group.axis)(
        group.position, candidate.lower_count, candidate.upper_count);
    return candidate;
}

} // namespace mlrt
