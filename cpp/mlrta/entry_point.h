// The entry point search: how deep a beam may enter the tree (Reshetov, Soupikov, Hurley
// 2005, section 3.2).
#pragma once

#include "kdtree/tree.h"
#include "traverse/query.h"

#include <array>
#include <optional>
#include <span>

namespace mlrt {

// What a search needs to know of a beam. Nodes are passed with their index and cell.
//
//   Sides   sides(index, node, cell)      children that the beam may enter
//   bool    possible(index, leaf, cell)   whether a non-empty leaf may be hit
//   void    visit(index)                  called for each node that is looked at, in order
struct Sides {
    bool lower, upper;
    bool upper_first = false; // order, if both
};

namespace entry_point_detail {

struct Place {
    uint32_t node;
    Box3f cell;
};

// A node both of whose children may be entered, and the one that waits.
struct Bifurcation {
    Place at, other;
};

inline Place child_of(const Place &place, KdNode node, bool upper) {
    Place child{node.lower_child() + upper, place.cell};
    (upper ? child.cell.lo : child.cell.hi)[node.axis()] = node.split();
    return child;
}

// Goes down from `place` to the first possible leaf, near children first; pushes what
// waits. Where a path ends without one the waiting child of the latest bifurcation is
// tried.
template <typename Judge, typename Stack>
bool find_leaf(std::span<const KdNode> nodes, Place &place, Judge &judge, Stack &stack,
               int &pending) {
    for (;;) {
        const KdNode node = load_node(nodes[place.node]);
        judge.visit(place.node);
        if (!node.is_leaf()) {
            const Sides sides = judge.sides(place.node, node, place.cell);
            if (sides.lower && sides.upper) {
                stack[pending++] = {place, child_of(place, node, !sides.upper_first)};
                place = child_of(place, node, sides.upper_first);
                continue;
            }
            if (sides.lower || sides.upper) {
                place = child_of(place, node, sides.upper);
                continue;
            }
        } else if (node.reference_count() > 0 &&
                   judge.possible(place.node, node, place.cell)) {
            return true;
        }
        if (pending == 0)
            return false;
        // Its first side was barren, so this node is no bifurcation: it leaves the stack
        // for good.
        place = stack[--pending].other;
    }
}

} // namespace entry_point_detail

// E1, the search in the paper's order. Returns the deepest node whose subtree holds every
// leaf that the beam may hit, or nothing if there is no such leaf.
//
// Phase 1 goes down to the first possible leaf. The bifurcations on the way are then
// frozen: from the latest up, each is the new candidate if its other side holds a possible
// leaf. Bifurcations inside those other sides are of no interest, since they lie below the
// candidate; they have a stack of their own.
template <typename Judge>
std::optional<Entry> search_entry_point(std::span<const KdNode> nodes, const Entry &start,
                                        Judge &judge) {
    using namespace entry_point_detail;
    std::array<Bifurcation, MAX_TREE_DEPTH + 1> stack;
    std::array<Bifurcation, MAX_TREE_DEPTH + 1> side_stack;
    int frozen = 0;
    Place place{start.node, start.cell};
    if (!find_leaf(nodes, place, judge, stack, frozen))
        return std::nullopt;
    Entry candidate{place.node, place.cell};
    while (frozen > 0) {
        const Bifurcation &bifurcation = stack[--frozen];
        Place other = bifurcation.other;
        int pending = 0;
        if (find_leaf(nodes, other, judge, side_stack, pending))
            candidate = {bifurcation.at.node, bifurcation.at.cell};
    }
    return candidate;
}

} // namespace mlrt
