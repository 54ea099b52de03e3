// The cheapest plane of a cell that holds few references: every plane is tried by counting
// all references, sixteen planes at a time. Nothing is sorted and nothing is kept.
#pragma once

#include "kdtree/builder.h"
#include "kdtree/reference.h"
#include "kdtree/rules.h"

#include <optional>
#include <vector>

namespace mlrt {

inline constexpr uint64_t MAX_FEW_REFERENCES = 32;

// Among equals: the first axis, then the lowest position.
std::optional<Candidate> best_plane_of_few(const References &references, const Box3f &cell,
                                           const BuildOptions &options);

// References in one plane whose bounds are large enough to cover the cell.
std::vector<PlanarGroup> planar_groups_of_few(const References &references,
                                              const Box3f &cell);

} // namespace mlrt
