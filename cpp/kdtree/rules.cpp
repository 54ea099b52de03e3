#include "kdtree/rules.h"

#include "geometry/cover.h"
#include "kdtree/sah.h"

namespace mlrt {

namespace {

// Shares of the cell's cross-section by which a cover may fall short and still count: the
// seams that rounding leaves between the clipped triangles are far narrower. Chosen.
constexpr double COVER_TOLERANCE = 1e-6;

bool covers(const CellContents &contents, const Box3f &cell,
            std::span<const Triangle> triangles, const PlanarGroup &group) {
    const int i = (group.axis + 1) % 3, j = (group.axis + 2) % 3;
    const Rectangle section{{double(cell.lo[i]), double(cell.lo[j])},
                            {double(cell.hi[i]), double(cell.hi[j])}};
    const double needed = area(section) * (1 - COVER_TOLERANCE);
    if (!(needed > 0))
        return false;
    const auto planar =
        std::span(contents.events[group.axis]).subspan(group.first_event, group.count);

    // Two upper limits of the covered area, the cheap one first.
    double bounds_sum = 0;
    for (const Event &event : planar) {
        const Box3f &bounds = contents.references[event.reference()].bounds;
        bounds_sum += extent(bounds, i) * extent(bounds, j);
    }
    if (bounds_sum < needed)
        return false;

    double area_sum = 0;
    std::vector<Triangle2> flat;
    for (const Event &event : planar) {
        const Triangle &triangle =
            triangles[contents.references[event.reference()].triangle];
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
    if (area_sum < needed)
        return false;

    // Overlaps, duplicates above all, are counted twice in the sum.
    return uncovered_area(section, flat, COVER_TOLERANCE * area(section)) <=
           COVER_TOLERANCE * area(section);
}

} // namespace

std::optional<SplitPlane> largest_empty_part(const CellContents &contents,
                                             const Box3f &cell,
                                             const BuildOptions &options) {
    std::optional<SplitPlane> plane;
    double largest = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double length = extent(cell, axis);
        if (!(length > 0))
            continue;
        const float first = contents.events[axis].front().position();
        const float last = contents.events[axis].back().position();
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

std::optional<Candidate> covered_plane(const CellContents &contents, const Box3f &cell,
                                       std::span<const Triangle> triangles,
                                       std::span<const PlanarGroup> groups,
                                       const BuildOptions &options) {
    std::optional<Candidate> best;
    for (const PlanarGroup &group : groups) {
        if (!covers(contents, cell, triangles, group))
            continue;
        const double below = double(group.position) - double(cell.lo[group.axis]);
        const double above = double(cell.hi[group.axis]) - double(group.position);
        Candidate candidate{
            {group.axis, group.position, below <= above}, group.below, group.above, 0};
        (candidate.plane.planar_below ? candidate.lower_count : candidate.upper_count) +=
            group.count;
        candidate.cost = SplitCost(options, cell, group.axis)(
            group.position, candidate.lower_count, candidate.upper_count);
        if (!best || is_cheaper(candidate.cost, best->cost))
            best = candidate;
    }
    return best;
}

} // namespace mlrt
