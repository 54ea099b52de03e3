#include "mlrta/frontier.h"

#include "base/check.h"

#include <algorithm>
#include <optional>

namespace mlrt {

namespace {

double half_area(const Box3f &cell) {
    const Vec3d e = Vec3d(cell.hi) - Vec3d(cell.lo);
    return e.x * e.y + e.y * e.z + e.z * e.x;
}

Entry child_of(const Entry &entry, KdNode node, bool upper) {
    Entry child{node.lower_child() + upper, entry.cell};
    (upper ? child.cell.lo : child.cell.hi)[node.axis()] = node.split();
    return child;
}

// The entry that is worth most to be replaced by its children's, or the count if none can
// be.
uint32_t largest_inner(std::span<const KdNode> nodes, const Frontier &frontier) {
    uint32_t best = frontier.count;
    double best_area = -1;
    for (uint32_t i = 0; i < frontier.count; ++i) {
        const double area = half_area(frontier.entries[i].cell);
        if (area > best_area && !load_node(nodes[frontier.entries[i].node]).is_leaf()) {
            best = i;
            best_area = area;
        }
    }
    return best;
}

} // namespace

Frontier search_frontier(std::span<const KdNode> nodes, const Frontier &start,
                         uint32_t capacity, BeamJudge &judge, SearchOrder order) {
    MLRT_CHECK(capacity <= MAX_FRONTIER && start.count <= capacity);
    Frontier frontier;
    for (uint32_t i = 0; i < start.count; ++i)
        if (const auto found = search_entry_point(nodes, start.entries[i], judge, order))
            frontier.entries[frontier.count++] = *found;
    while (frontier.count > 0 && frontier.count < capacity) {
        const uint32_t i = largest_inner(nodes, frontier);
        if (i == frontier.count)
            break;
        const Entry parent = frontier.entries[i];
        if (!judge.knows(parent.cell))
            break;
        const KdNode node = load_node(nodes[parent.node]);
        const bool upper_first =
            judge.sides(parent.node, node, judge.start(parent.cell)).upper_is_near;
        const auto near =
            search_entry_point(nodes, child_of(parent, node, upper_first), judge, order);
        const auto far =
            search_entry_point(nodes, child_of(parent, node, !upper_first), judge, order);
        Entry *at = frontier.entries.data() + i;
        Entry *const end = frontier.entries.data() + frontier.count;
        if (near && far) {
            std::move_backward(at + 1, end, end + 1);
            ++frontier.count;
            *at++ = *near;
            *at = *far;
        } else if (near || far) {
            *at = near ? *near : *far;
        } else {
            std::move(at + 1, end, at);
            --frontier.count;
        }
    }
    for (uint32_t i = 0; i < frontier.count; ++i) {
        const Box3f &cell = frontier.entries[i].cell;
        frontier.earliest_hit[i] = judge.knows(cell) ? judge.earliest_hit(cell) : 0;
    }
    return frontier;
}

} // namespace mlrt
