#include "kdtree/serialize.h"

#include "base/parallel.h"
#include "geometry/degenerate.h"
#include "kdtree/sah.h"

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace mlrt {

namespace {

struct Visit {
    uint32_t node;
    int depth; // inner nodes above
    Box3f cell;
};

[[noreturn]] void refuse(const std::string &reason) {
    throw std::invalid_argument(reason);
}

std::string name_of(uint32_t node) {
    return "node " + std::to_string(node);
}

// Subtrees that are walked side by side; enough of them even the threads' shares.
constexpr size_t SUBTREES = 256;

class Checker {
public:
    explicit Checker(KdTree &tree)
        : tree_(tree), reached_(tree.nodes.size() / 64 + 1),
          referable_(tree.triangles.size()) {}

    void check() {
        if (tree_.nodes.size() == 0)
            refuse("it has no nodes");
        if (tree_.nodes.size() > KdNode::MAX_NODES)
            refuse("it has more than 2^30 nodes");
        find_referable();
        reach(0);
        Walk top;
        std::vector<Visit> level{{0, 0, tree_.bounds}};
        while (!level.empty() && level.size() < SUBTREES) {
            const std::vector<Visit> above = std::exchange(level, {});
            for (const Visit &visit : above)
                visit_node(visit, top, level);
        }
        std::vector<Walk> walks(level.size());
        std::vector<std::string> faults(level.size());
        parallel_for(uint32_t(level.size()), [&](uint32_t i) {
            try {
                std::vector<Visit> stack{level[i]};
                while (!stack.empty()) {
                    const Visit visit = stack.back();
                    stack.pop_back();
                    visit_node(visit, walks[i], stack);
                }
            } catch (const std::invalid_argument &fault) {
                faults[i] = fault.what();
            }
        });
        for (const std::string &fault : faults)
            if (!fault.empty())
                refuse(fault);
        for (const Walk &walk : walks) {
            top.depth = std::max(top.depth, walk.depth);
            count_references(top, walk.references);
        }
        tree_.depth = top.depth;
    }

private:
    struct Walk {
        int depth = 0;
        uint64_t references = 0;
    };

    // Triangles that a builder keeps, and their bounds, which are those of the tree.
    void find_referable() {
        tree_.bounds = {};
        for (size_t i = 0; i < tree_.triangles.size(); ++i) {
            const Triangle &triangle = tree_.triangles[i];
            referable_[i] = !is_degenerate(triangle);
            if (referable_[i])
                for (int corner = 0; corner < 3; ++corner)
                    tree_.bounds.add(triangle[corner]);
        }
    }

    // Checks a node and appends its children.
    void visit_node(const Visit &visit, Walk &walk, std::vector<Visit> &next) {
        const KdNode node = tree_.nodes[visit.node];
        if (node.is_leaf())
            return check_leaf(visit.node, node, walk);
        if (visit.depth >= MAX_TREE_DEPTH)
            refuse("it is deeper than " + std::to_string(MAX_TREE_DEPTH) + " levels");
        const uint32_t child = node.lower_child();
        if (uint64_t(child) + 1 >= tree_.nodes.size())
            refuse(name_of(visit.node) + " has a child that does not exist");
        reach(child);
        reach(child + 1);
        const int axis = node.axis();
        const float split = node.split();
        // Also false for NaN, and in a tree without triangles, whose cell is empty.
        if (!(visit.cell.lo[axis] <= split && split <= visit.cell.hi[axis]))
            refuse(name_of(visit.node) + " has a split plane outside its cell");
        walk.depth = std::max(walk.depth, visit.depth + 1);
        next.push_back({child + 1, visit.depth + 1, upper_part(visit.cell, axis, split)});
        next.push_back({child, visit.depth + 1, lower_part(visit.cell, axis, split)});
    }

    void check_leaf(uint32_t index, KdNode node, Walk &walk) {
        if (node.is_unbuilt())
            refuse(name_of(index) + " is not built");
        const uint64_t first = node.first_reference(), count = node.reference_count();
        if (count > 0 && first + count > tree_.references.size())
            refuse(name_of(index) + " has references that do not exist");
        count_references(walk, count);
        for (const uint32_t triangle : tree_.references_of(node)) {
            if (triangle >= referable_.size())
                refuse(name_of(index) + " refers to triangle " + std::to_string(triangle) +
                       " of " + std::to_string(referable_.size()));
            if (!referable_[triangle])
                refuse(name_of(index) + " refers to triangle " + std::to_string(triangle) +
                       ", which is degenerate");
        }
    }

    // Leaves that share references would make the time that this takes explode.
    void count_references(Walk &walk, uint64_t count) {
        walk.references += count;
        if (walk.references > tree_.references.size())
            refuse("its leaves hold more references than it has");
    }

    void reach(uint32_t node) {
        const uint64_t bit = uint64_t(1) << (node % 64);
        if (reached_[node / 64].fetch_or(bit, std::memory_order_relaxed) & bit)
            refuse(name_of(node) + " is reached twice");
    }

    KdTree &tree_;
    std::vector<std::atomic<uint64_t>> reached_; // a bit for each node
    std::vector<bool> referable_;                // by triangle
};

} // namespace

void restore(KdTree &stored) {
    Checker(stored).check();
}

} // namespace mlrt
