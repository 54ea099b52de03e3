// E3, the frontier: instead of one entry point, a few subtrees that hold every leaf which a
// beam may hit, front to back.
//
// Where a beam crosses a split plane high up in the tree, its entry point is there too,
// however deep the leaves are on both sides. The frontier follows each side down.
#pragma once

#include "mlrta/beam_judge.h"

#include <array>
#include <cstdint>
#include <span>

namespace mlrt {

inline constexpr uint32_t MAX_FRONTIER = 16;

// Disjoint subtrees. If a ray of the beam meets leaves of two of them, then first those of
// the one that comes first.
struct Frontier {
    std::array<Entry, MAX_FRONTIER> entries;
    // No ray has a hit in an entry's subtree with a t that is less, as reported, rounded to
    // float.
    std::array<float, MAX_FRONTIER> earliest_hit;
    uint32_t count = 0;

    explicit Frontier() = default;
    // One subtree, of whose hits nothing is known.
    explicit Frontier(const Entry &entry) : count(1) {
        entries[0] = entry;
        earliest_hit[0] = 0;
    }
};

// Searches at most `capacity` subtrees below those of `start`, which must be a frontier of
// a beam that holds this one, of at most `capacity` entries. Each entry is an entry point:
// the deepest node above what the beam may hit in its part of the tree. With a capacity of
// one it is that of search_entry_point().
//
// The largest entry is replaced by those of its two children, again and again. No entry is
// left if the beam can hit nothing.
Frontier search_frontier(std::span<const KdNode> nodes, const Frontier &start,
                         uint32_t capacity, BeamJudge &judge, SearchOrder order);

} // namespace mlrt
