#include "kdtree/report.h"

#include "kdtree/sah.h"

#include <algorithm>
#include <vector>

namespace mlrt {

namespace {

struct Visit {
    uint32_t node;
    int depth; // inner nodes above
    Box3f cell;
};

bool is_flat(const Box3f &cell) {
    return cell.lo.x == cell.hi.x || cell.lo.y == cell.hi.y || cell.lo.z == cell.hi.z;
}

} // namespace

TreeStatistics statistics_of(const KdTree &tree) {
    TreeStatistics statistics;
    double inner_area = 0, leaf_area = 0, reference_area = 0;
    std::vector<Visit> stack{{0, 0, tree.bounds}};
    while (!stack.empty()) {
        const Visit visit = stack.back();
        stack.pop_back();
        const KdNode node = load_node(tree.nodes[visit.node]);
        const double area = surface_area(visit.cell);
        statistics.depth = std::max(statistics.depth, visit.depth);
        if (!node.is_leaf()) {
            ++statistics.inner_nodes;
            inner_area += area;
            const uint32_t child = node.lower_child();
            stack.push_back({child + 1, visit.depth + 1,
                             upper_part(visit.cell, node.axis(), node.split())});
            stack.push_back({child, visit.depth + 1,
                             lower_part(visit.cell, node.axis(), node.split())});
            continue;
        }
        const uint64_t count = node.reference_count();
        if (node.is_unbuilt()) {
            ++statistics.unbuilt_cells;
            statistics.unbuilt_references += count;
            continue;
        }
        ++statistics.leaves;
        statistics.empty_leaves += count == 0;
        statistics.flat_leaves += count != 0 && is_flat(visit.cell);
        statistics.references += count;
        statistics.max_leaf_count = std::max(statistics.max_leaf_count, count);
        if (count < statistics.leaf_histogram.size())
            ++statistics.leaf_histogram[count];
        leaf_area += area;
        reference_area += area * double(count);
    }
    // An empty tree has no cell that a line could cross.
    if (!tree.bounds.empty()) {
        const double scene_area = surface_area(tree.bounds);
        statistics.expected_traversals = inner_area / scene_area;
        statistics.expected_leaf_visits = leaf_area / scene_area;
        statistics.expected_primitive_visits = reference_area / scene_area;
    }
    return statistics;
}

} // namespace mlrt
