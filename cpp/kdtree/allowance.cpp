#include "kdtree/allowance.h"

#include "kdtree/tree.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

namespace {

// The paper gives no value for rule 3 (b); c / N within these limits was found to save
// memory without slowing traversal.
constexpr double AREA_FLOOR_NUMERATOR = 0.3;
constexpr double MIN_AREA_FLOOR = 1e-7;
constexpr double MAX_AREA_FLOOR = 1e-4;

// Limit of the splits on a path, in the form of Havran 2000 with the constants of pbrt.
// Splits of rule 1 only cut off empty space and do not count for it, or they would leave
// cells full of triangles unsplit; they do count for MAX_TREE_DEPTH and for a limit that
// the caller sets.
constexpr double DEPTH_OFFSET = 8;
constexpr double DEPTH_PER_DOUBLING = 1.3;

// Splits on a path that cost more than a leaf but may open the way to a good one. Whether
// it did is seen when the subtree is finished; if not, it is taken back.
constexpr int MAX_BAD_SPLITS = 2;

// A cell may be split while the references along its path have not multiplied beyond this
// many times the triangles of the scene. A safeguard against scenes made to explode;
// chosen.
constexpr uint64_t MAX_DUPLICATION = 8;
constexpr uint64_t SPARE_REFERENCES = 65536;

} // namespace

Allowance whole_allowance(const BuildOptions &options, uint64_t count) {
    return {options.max_depth > 0 ? std::min(options.max_depth, MAX_TREE_DEPTH)
                                  : MAX_TREE_DEPTH,
            int(DEPTH_OFFSET + DEPTH_PER_DOUBLING * std::log2(double(count))),
            MAX_BAD_SPLITS, double(max_references_of(count)) / double(count)};
}

double area_floor_of(const BuildOptions &options, uint64_t count) {
    if (options.area_floor > 0)
        return options.area_floor;
    return std::clamp(AREA_FLOOR_NUMERATOR / double(count), MIN_AREA_FLOOR, MAX_AREA_FLOOR);
}

uint64_t max_references_of(uint64_t count) {
    return MAX_DUPLICATION * count + SPARE_REFERENCES;
}

} // namespace mlrt
