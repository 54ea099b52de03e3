#include "kdtree/serialize.h"

#include "geometry/degenerate.h"
#include "kdtree/sah.h"

#include <algorithm>
#include <stdexcept>
#include <string>
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

class Checker {
public:
    explicit Checker(KdTree &tree)
        : tree_(tree), reached_(tree.nodes.size()), referable_(tree.triangles.size()) {}

    void check() {
        if (tree_.nodes.size() == 0)
            refuse("it has no nodes");
        if (tree_.nodes.size() > KdNode::MAX_NODES)
            refuse("it has more than 2^30 nodes");
        find_referable();
        reached_[0] = true;
        tree_.depth = 0;
        stack_.push_back({0, 0, tree_.bounds});
        while (!stack_.empty()) {
            const Visit visit = stack_.back();
            stack_.pop_back();
            if (tree_.nodes[visit.node].is_leaf())
                check_leaf(visit);
            else
                check_inner(visit);
        }
    }

private:
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

    void check_inner(const Visit &visit) {
        const KdNode node = tree_.nodes[visit.node];
        if (visit.depth >= MAX_TREE_DEPTH)
            refuse("it is deeper than " + std::to_string(MAX_TREE_DEPTH) + " levels");
        const uint32_t child = node.lower_child();
        if (uint64_t(child) + 1 >= tree_.nodes.size())
            refuse(name_of(visit.node) + " has a child that does not exist");
        for (const uint32_t i : {child, child + 1}) {
            if (reached_[i])
                refuse(name_of(i) + " is reached twice");
            reached_[i] = true;
        }
        const float split = node.split();
        // Also false for NaN, and in a tree without triangles, whose cell is empty.
        if (!(visit.cell.lo[node.axis()] <= split && split <= visit.cell.hi[node.axis()]))
            refuse(name_of(visit.node) + " has a split plane outside its cell");
        tree_.depth = std::max(tree_.depth, visit.depth + 1);
        stack_.push_back(
            {child + 1, visit.depth + 1, upper_part(visit.cell, node.axis(), split)});
        stack_.push_back(
            {child, visit.depth + 1, lower_part(visit.cell, node.axis(), split)});
    }

    void check_leaf(const Visit &visit) {
        const KdNode node = tree_.nodes[visit.node];
        const uint64_t first = node.first_reference(), count = node.reference_count();
        if (count > 0 && first + count > tree_.references.size())
            refuse(name_of(visit.node) + " has references that do not exist");
        // Leaves that overlap would make the time that this takes explode.
        references_seen_ += count;
        if (references_seen_ > tree_.references.size())
            refuse("its leaves hold more references than it has");
        for (const uint32_t triangle : tree_.references_of(node)) {
            if (triangle >= referable_.size())
                refuse(name_of(visit.node) + " refers to triangle " +
                       std::to_string(triangle) + " of " +
                       std::to_string(referable_.size()));
            if (!referable_[triangle])
                refuse(name_of(visit.node) + " refers to triangle " +
                       std::to_string(triangle) + ", which is degenerate");
        }
    }

    KdTree &tree_;
    std::vector<bool> reached_;   // by node
    std::vector<bool> referable_; // by triangle
    std::vector<Visit> stack_;
    uint64_t references_seen_ = 0;
};

} // namespace

void restore(KdTree &stored) {
    Checker(stored).check();
}

} // namespace mlrt
