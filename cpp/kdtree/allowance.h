// What ends the splitting besides its cost.
#pragma once

#include "kdtree/builder.h"
#include "kdtree/reference.h"

#include <span>

namespace mlrt {

// What the path from the root leaves to a cell.
struct Allowance {
    int depth;  // levels that are left
    int splits; // of which others than those of rule 1
    int bad_splits;
    double duplication; // factor by which references may still multiply
};

// Of the root of a tree over `count` triangles.
Allowance whole_allowance(const BuildOptions &options, uint64_t count);

// Rule 3 (b): share of the scene's surface area, `scene_area`, below which a cell stays
// whole, as the options give it or by the size of a typical triangle. `references` have the
// bounds of whole triangles.
double area_floor_of(const BuildOptions &options, std::span<const Reference> references,
                     double scene_area);

// No tree over `count` triangles has more references, as the duplication is limited.
uint64_t max_references_of(uint64_t count);

// Cells of up to this many references are not worth a split that costs more than a leaf
// (the stopping count of Mitsuba's builder).
inline constexpr uint64_t MAX_PLAIN_LEAF = 3;

} // namespace mlrt
