// The entry point search: how deep a beam may enter the tree (Reshetov, Soupikov, Hurley
// 2005, section 3.2).
#pragma once

#include "kdtree/tree.h"
#include "mlrta/inverse_frustum.h"
#include "traverse/query.h"

#include <array>
#include <bit>
#include <optional>
#include <span>

namespace mlrt {

// What a search needs to know of a beam:
//
//   Cell                              what the judge wants to know of a node's cell
//   bool  knows(box)                  whether it can judge what lies in that box at all
//   Cell  start(box)                  the cell that is that box
//   Sides sides(index, node, cell)    children that the beam may enter
//   Cell  child(cell, node, upper)    the cell of a child
//   bool  possible(index, leaf, cell) whether a non-empty leaf may be hit
//   void  visit(index)                called for each node that is looked at, in order
//   void  found(index, leaf)          called for each possible leaf that is found
//   bool  found_blocker()             whether one of them was seen to end the beam
//   bool  reaches(cell)               whether the beam may still get as far as that

// As a value, where ?: would choose between places in memory.
inline KdNode chosen(bool second, KdNode a, KdNode b) {
    return std::bit_cast<KdNode>(second ? std::bit_cast<uint64_t>(b)
                                        : std::bit_cast<uint64_t>(a));
}

namespace entry_point_detail {

// A node on a path from the start of a search, `depth` nodes below it.
template <typename Cell>
struct Place {
    uint32_t node;
    int depth;
    Cell cell;
};

// A node both of whose children may be entered, and the one that waits.
template <typename Cell>
struct Bifurcation {
    uint32_t node;
    Place<Cell> other;
};

template <typename Cell>
using BifurcationStack = std::array<Bifurcation<Cell>, MAX_TREE_DEPTH + 1>;
using NodePath = std::array<uint32_t, MAX_TREE_DEPTH + 1>;

// Goes down from `place` to the first possible leaf, near children first; pushes what
// waits. Where a path ends without one the waiting child of the latest bifurcation is
// tried. Records the nodes from the start to the leaf by depth.
template <typename Judge, typename Cell>
bool find_leaf(std::span<const KdNode> nodes, Place<Cell> &place, Judge &judge,
               BifurcationStack<Cell> &stack, int &pending, NodePath &path) {
    // Apart, so that they stay in registers.
    uint32_t index = place.node;
    int depth = place.depth;
    Cell cell = place.cell;
    KdNode node = load_node(nodes[index]);
    for (;;) {
        judge.visit(index);
        path[size_t(depth)] = index;
        if (!node.is_leaf()) {
            // Read both before the choice between them is known.
            const KdNode lower = load_node(nodes[node.lower_child()]);
            const KdNode upper = load_node(nodes[node.lower_child() + 1]);
            const Sides sides = judge.sides(index, node, cell);
            const bool to_upper = sides.near == sides.upper_is_near;
            if (sides.near && sides.far)
                stack[size_t(pending++)] = {index,
                                            {node.lower_child() + !to_upper, depth + 1,
                                             judge.child(cell, node, !to_upper)}};
            if (sides.near || sides.far) {
                cell = judge.child(cell, node, to_upper);
                index = node.lower_child() + to_upper;
                ++depth;
                node = chosen(to_upper, lower, upper);
                continue;
            }
        } else if (node.reference_count() > 0 && judge.possible(index, node, cell)) {
            judge.found(index, node);
            place = {index, depth, cell};
            return true;
        }
        if (pending == 0)
            return false;
        // Its first side was barren, so this node is no bifurcation: it leaves the stack
        // for good.
        const Place<Cell> &other = stack[size_t(--pending)].other;
        index = other.node;
        depth = other.depth;
        cell = other.cell;
        node = load_node(nodes[index]);
    }
}

// The node `depth` nodes below the start of a path.
inline Entry entry_at(std::span<const KdNode> nodes, const Entry &start,
                      const NodePath &path, int depth) {
    Entry entry = start;
    for (size_t i = 0; i < size_t(depth); ++i) {
        const KdNode node = load_node(nodes[path[i]]);
        const bool upper = path[i + 1] != node.lower_child();
        (upper ? entry.cell.lo : entry.cell.hi)[node.axis()] = node.split();
    }
    entry.node = path[size_t(depth)];
    return entry;
}

} // namespace entry_point_detail

// Order in which the second phase of a search asks the bifurcations.
enum class SearchOrder : uint32_t {
    paper,         // E1: from the latest up
    shallow_first, // E2: from the first down, which can stop at the first success
};

// Returns the deepest node whose subtree holds every leaf that the beam may hit, or nothing
// if there is no such leaf.
//
// Phase 1 goes down to the first possible leaf. The bifurcations on the way are then
// frozen, and the answer is the first of them whose other side holds a possible leaf too,
// or the leaf itself. In the paper's order each one that does is the new candidate.
// Bifurcations inside those other sides are of no interest, since they lie below the
// candidate; they have a stack of their own.
//
// What ends the beam may be found in leaves on the way. If it was in the first one, then
// the paper's order is taken, near to far, so that what is found next is found before what
// lies behind it. Either order then gives a node above all leaves that a ray may have its
// first hit in.
template <typename Judge>
std::optional<Entry> search_entry_point(std::span<const KdNode> nodes, const Entry &start,
                                        Judge &judge, SearchOrder order) {
    using namespace entry_point_detail;
    using Cell = typename Judge::Cell;
    if (!judge.knows(start.cell))
        return start;
    BifurcationStack<Cell> stack, side_stack;
    NodePath path, side_path;
    int frozen = 0;
    Place<Cell> place{start.node, 0, judge.start(start.cell)};
    if (!judge.reaches(place.cell) || !find_leaf(nodes, place, judge, stack, frozen, path))
        return std::nullopt;
    int candidate = place.depth;
    const bool shallow_first =
        order == SearchOrder::shallow_first && !judge.found_blocker();
    for (int i = 0; i < frozen; ++i) {
        Place<Cell> other = stack[size_t(shallow_first ? i : frozen - 1 - i)].other;
        const int depth = other.depth - 1;
        int pending = 0;
        if (judge.reaches(other.cell) &&
            find_leaf(nodes, other, judge, side_stack, pending, side_path)) {
            candidate = depth;
            if (shallow_first)
                break;
        }
    }
    return entry_at(nodes, start, path, candidate);
}

} // namespace mlrt
