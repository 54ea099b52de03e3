#include "kdtree/fast_builder.h"

#include "base/parallel.h"
#include "kdtree/relocate.h"
#include "kdtree/top.h"
#include "kdtree/workspaces.h"

#include <chrono>
#include <memory>

namespace mlrt {

namespace {

// Subtrees are dealt out when they have at most this many references: few enough to fit
// the caches of a core, many enough to be worth a task. Not chosen by the number of
// threads, on which the tree must not depend.
constexpr uint64_t MAX_SUBTREE_REFERENCES = 32768;

struct Subtree {
    SubtreeArrays arrays;
    BuildReport report;
    SubtreeCost cost;
    uint64_t first_node = 0, first_reference = 0; // in the whole tree
};

// Cost and depth of the whole tree from those of its subtrees.
class CostOfTop {
public:
    CostOfTop(const Top &top, const std::vector<Subtree> &subtrees,
              const BuildOptions &options)
        : top_(top), options_(options), costs_(top.nodes.size()) {
        for (size_t i = 0; i < subtrees.size(); ++i)
            costs_[top.remainders[i].node] = subtrees[i].cost;
    }

    SubtreeCost operator()() {
        // Children have higher numbers than their parents.
        for (size_t i = top_.nodes.size(); i-- > 0;) {
            const KdNode node = top_.nodes[i];
            if (node.is_leaf())
                continue;
            costs_[i] = joined(options_, top_.cells[i], {node.axis(), node.split(), true},
                               costs_[node.lower_child()], costs_[node.lower_child() + 1]);
        }
        return costs_[0];
    }

private:
    const Top &top_;
    const BuildOptions &options_;
    std::vector<SubtreeCost> costs_;
};

} // namespace

void build_fast(KdTree &tree, BuildReport &report, HugeArray<Reference> references,
                const BuildFrame &frame, const Interruption &interruption) {
    using Clock = std::chrono::steady_clock;
    const auto seconds_since = [](Clock::time_point start) {
        return std::chrono::duration<double>(Clock::now() - start).count();
    };
    const uint64_t count = references.size();
    const std::span<const Triangle> triangles(tree.triangles.begin(), tree.triangles.end());
    Clock::time_point start = Clock::now();
    Top top = build_top(std::move(references), tree.bounds, triangles,
                        whole_allowance(frame.options, count), frame,
                        MAX_SUBTREE_REFERENCES, interruption);
    report.add(top.report);
    report.seconds_top = seconds_since(start);

    start = Clock::now();
    std::vector<Subtree> subtrees(top.remainders.size());
    Workspaces workspaces(triangles, frame.options, interruption, MAX_SUBTREE_REFERENCES);
    parallel_for(
        uint32_t(subtrees.size()),
        [&](uint32_t i) {
            if (interruption())
                return;
            Remainder &part = top.remainders[i];
            Subtree &subtree = subtrees[i];
            auto workspace = workspaces.take_for(part.references.count());
            subtree.arrays.nodes.resize(1);
            subtree.cost = SubtreeBuilder(workspace->method, frame)
                               .build(subtree.arrays, subtree.report, 0, part.cell,
                                      {part.references}, part.allowance);
            part.list.reset();
            workspaces.give_back(std::move(workspace));
        },
        [&] { return interruption(); });
    interruption.check();
    report.seconds_subtrees = seconds_since(start);

    start = Clock::now();
    uint64_t node_count = top.nodes.size(), reference_count = 0;
    for (Subtree &subtree : subtrees) {
        report.add(subtree.report);
        subtree.first_node = node_count;
        subtree.first_reference = reference_count;
        node_count += subtree.arrays.nodes.size() - 1;
        reference_count += subtree.arrays.references.size();
    }
    check_tree_size(node_count, reference_count);
    tree.nodes = HugeArray<KdNode>(node_count);
    tree.references = HugeArray<uint32_t>(reference_count);
    std::copy(top.nodes.begin(), top.nodes.end(), tree.nodes.begin());
    parallel_for(uint32_t(subtrees.size()), [&](uint32_t i) {
        Subtree &subtree = subtrees[i];
        tree.nodes[top.remainders[i].node] =
            relocate(subtree.arrays, subtree.first_node, subtree.first_reference,
                     tree.nodes.data(), tree.references.data());
        subtree.arrays = {};
    });
    const SubtreeCost whole = CostOfTop(top, subtrees, frame.options)();
    tree.depth = report.depth = whole.depth;
    report.sah_cost = whole.cost / frame.options.traversal_cost;
    report.seconds_join = seconds_since(start);
}

} // namespace mlrt
