// Beams of rays that neither start in one point nor go one way, such as those to an area
// light: whether anything may lie in the shaft between where they begin and where they end.
#pragma once

#include "base/counters.h"
#include "kdtree/tree.h"
#include "mlrta/mailbox.h"
#include "mlrta/patience.h"
#include "mlrta/shaft.h"
#include "traverse/ray_group.h"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace mlrt {

// X4 where any hit will do, each ray has its own origin, and intervals end. The shaft of a
// run of rays walks the tree, once for all of them, and what it meets is tested against
// their packets. Runs whose shafts meet much are divided, and given up in the end.
class ShaftTracer {
public:
    // Of a group with own origins.
    ShaftTracer(const KdTree &tree, const RayGroup &rays, Counters &counters);

    // Writes 1 for rays that are occluded and 0 for others, but not for those whose numbers
    // it returns, in ascending order: these are left to others.
    std::vector<uint32_t> trace(uint8_t *occluded);

private:
    static constexpr uint32_t LARGE = 1024, SMALL = 64; // rays of a run

    // Triangles that may be tested against each packet of a run; and nodes and triangles
    // that may be tested against its shaft. Chosen, as the sizes of runs, by frames of
    // cornell-box, living-room and conference with an area light, from 2 to 64 triangles;
    // most shafts that meet a dozen meet hundreds.
    static constexpr uint32_t MOST_CANDIDATES = 12;
    static constexpr uint32_t MOST_STEPS = 256, MOST_TRIANGLES = 64;

    void trace_run(uint32_t first, uint32_t count);
    std::optional<Shaft> shaft_of(uint32_t first, uint32_t count);
    bool find_candidates(const Shaft &shaft);
    bool add_candidates(const Shaft &shaft, KdNode leaf);
    void test_candidates(uint32_t first, uint32_t count);
    void leave(uint32_t first, uint32_t count);

    const KdTree &tree_;
    const RayGroup &rays_;
    Counters &counters_;
    Patience &patience_;
    uint8_t *occluded_ = nullptr;
    uint32_t run_ = LARGE;
    uint32_t active_ = 0; // rays of the last shaft
    Mailbox mailbox_;
    std::array<uint32_t, MOST_CANDIDATES> candidates_;
    uint32_t candidate_count_ = 0, triangles_ = 0;
    std::vector<uint32_t> left_;
};

} // namespace mlrt
