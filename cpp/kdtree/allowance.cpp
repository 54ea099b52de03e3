#include "kdtree/allowance.h"

#include "kdtree/sah.h"
#include "kdtree/tree.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

namespace {

// The paper gives no value for rule 3 (b). A cell is left whole that is smaller than this
// many times the bounds of a typical triangle. Half or twice as much changed the time of a
// frame by a few per cent in conference, building and dragon, where the number of triangles
// alone says little: most of them may be in one small place. The limit is that of scenes of
// few triangles.
constexpr double TYPICAL_TRIANGLES = 6;
constexpr double MAX_AREA_FLOOR = 1e-4;

// Triangles that are asked for what is typical: as many in any scene, evenly spread.
constexpr uint64_t MAX_SAMPLES = 16384;

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

double area_floor_of(const BuildOptions &options, std::span<const Reference> references,
                     double scene_area) {
    if (options.area_floor > 0)
        return options.area_floor;
    // The geometric mean, which a few large triangles do not change.
    const uint64_t stride = (references.size() + MAX_SAMPLES - 1) / MAX_SAMPLES;
    double sum_of_logarithms = 0;
    uint64_t count = 0;
    for (uint64_t i = 0; i < references.size(); i += stride)
        if (const double share = surface_area(references[i].bounds) / scene_area;
            share > 0) {
            sum_of_logarithms += std::log(share);
            ++count;
        }
    if (count == 0)
        return MAX_AREA_FLOOR;
    return std::min(TYPICAL_TRIANGLES * std::exp(sum_of_logarithms / double(count)),
                    MAX_AREA_FLOOR);
}

uint64_t max_references_of(uint64_t count) {
    return MAX_DUPLICATION * count + SPARE_REFERENCES;
}

} // namespace mlrt
