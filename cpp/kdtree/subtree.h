// The rules by which a cell is split, and the recursion that applies them. How the contents
// of a cell are kept and searched for planes is left to a method: sorted events
// (sweep_method.h) or bins (binned_method.h).
#pragma once

#include "kdtree/allowance.h"
#include "kdtree/reference.h"
#include "kdtree/sah.h"
#include "kdtree/tree.h"

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace mlrt {

// What does not change in the course of a build.
struct BuildFrame {
    const BuildOptions &options;
    double scene_area;
    double area_floor; // share of scene_area
};

// What becomes of a cell.
struct Decision {
    enum class Kind { leaf, empty_cell, split };
    Kind kind = Kind::leaf;
    SplitPlane plane{};
    bool flat = false;       // taken by rule 2
    bool bad = false;        // costs more than a leaf
    bool area_floor = false; // a leaf by rule 3 (b)
    Allowance rest{};        // what is left to the children
};

// A plane that the method found, and whether rule 2 demands it.
struct Choice {
    Candidate candidate;
    bool flat = false;
};

// The three rules in their order, then the cost (Reshetov et al. 2005, section 3.2).
template <typename Method>
Decision decide(Method &method, const typename Method::Contents &contents,
                const Box3f &cell, const Allowance &allowance, const BuildFrame &frame) {
    const BuildOptions &options = frame.options;
    const uint64_t count = contents.count();
    const double area = surface_area(cell);
    Decision decision;
    decision.rest = allowance;
    --decision.rest.depth;
    if (count == 0 || allowance.depth == 0 || !(area > 0))
        return decision;
    if (options.rule_area_floor && area < frame.area_floor * frame.scene_area) {
        decision.area_floor = true;
        return decision;
    }
    if (options.rule_empty_cell) {
        if (const auto plane = method.largest_empty_part(contents, cell)) {
            decision.kind = Decision::Kind::empty_cell;
            decision.plane = *plane;
            return decision;
        }
    }
    if (allowance.splits == 0)
        return decision;
    const std::optional<Choice> choice = method.choose(contents, cell);
    if (!choice)
        return decision;
    const Candidate &candidate = choice->candidate;
    decision.flat = choice->flat;
    decision.bad =
        !choice->flat && !(candidate.cost < options.intersection_cost * double(count));
    if (decision.bad && (allowance.bad_splits == 0 || count <= MAX_PLAIN_LEAF))
        return decision;
    --decision.rest.splits;
    decision.rest.bad_splits -= decision.bad;
    decision.rest.duplication *=
        double(count) / double(candidate.lower_count + candidate.upper_count);
    if (decision.rest.duplication < 1)
        return decision;
    decision.kind = Decision::Kind::split;
    decision.plane = candidate.plane;
    return decision;
}

// Throws std::length_error if indices do not reach so far.
void check_tree_size(uint64_t node_count, uint64_t reference_count);

// A subtree on its own: its root is node 0, and indices count from here.
struct SubtreeArrays {
    std::vector<KdNode> nodes;
    std::vector<uint32_t> references;
};

struct SubtreeCost {
    double cost = 0; // expected, for a ray that enters its cell; in units of BuildOptions
    int depth = 0;   // inner nodes on the longest path
};

// Cost of an inner node whose children's costs are known.
inline SubtreeCost joined(const BuildOptions &options, const Box3f &cell,
                          const SplitPlane &plane, const SubtreeCost &lower,
                          const SubtreeCost &upper) {
    const double area = surface_area(cell);
    const double lower_area = surface_area(lower_part(cell, plane.axis, plane.position));
    const double upper_area = surface_area(upper_part(cell, plane.axis, plane.position));
    return {options.traversal_cost + lower_area / area * lower.cost +
                upper_area / area * upper.cost,
            1 + std::max(lower.depth, upper.depth)};
}

// Builds subtrees one after the other, depth first.
template <typename Method>
class SubtreeBuilder {
public:
    using Contents = typename Method::Contents;

    SubtreeBuilder(Method &method, const BuildFrame &frame)
        : method_(method), frame_(frame) {}

    // Builds the subtree of node `node` of `out`, whose contents are used up.
    SubtreeCost build(SubtreeArrays &out, BuildReport &report, uint32_t node,
                      const Box3f &cell, Contents contents, const Allowance &allowance) {
        method_.pause(contents);
        const Decision decision = decide(method_, contents, cell, allowance, frame_);
        if (decision.kind == Decision::Kind::leaf) {
            report.area_floor_leaves += decision.area_floor;
            return make_leaf(out, report, node, std::move(contents));
        }
        if (decision.kind == Decision::Kind::empty_cell) {
            ++report.empty_cell_splits;
            Contents empty = method_.nothing();
            return decision.plane.planar_below
                       ? split(out, report, node, cell, decision, std::move(contents),
                               std::move(empty))
                       : split(out, report, node, cell, decision, std::move(empty),
                               std::move(contents));
        }
        const double leaf_cost =
            frame_.options.intersection_cost * double(contents.count());
        const BuildReport report_before = report;
        const size_t nodes_before = out.nodes.size();
        const size_t references_before = out.references.size();
        report.flat_cell_splits += decision.flat;
        auto [kept, lower, upper] =
            method_.split(std::move(contents), cell, decision.plane, decision.bad);
        const SubtreeCost subtree =
            split(out, report, node, cell, decision, std::move(lower), std::move(upper));
        if (decision.bad && !(subtree.cost < leaf_cost)) {
            report = report_before;
            out.nodes.resize(nodes_before);
            out.references.resize(references_before);
            return make_leaf(out, report, node, std::move(kept));
        }
        method_.give_back(std::move(kept));
        return subtree;
    }

private:
    // Makes `node` an inner node and builds its children, each with the contents given.
    SubtreeCost split(SubtreeArrays &out, BuildReport &report, uint32_t node,
                      const Box3f &cell, const Decision &decision, Contents lower,
                      Contents upper) {
        const uint64_t children = out.nodes.size();
        check_tree_size(children + 2, out.references.size());
        const auto [axis, position, planar_below] = decision.plane;
        out.nodes.resize(children + 2);
        out.nodes[node] = KdNode::inner(axis, position, uint32_t(children));
        ++report.inner_nodes;
        const SubtreeCost below =
            build(out, report, uint32_t(children), lower_part(cell, axis, position),
                  std::move(lower), decision.rest);
        const SubtreeCost above =
            build(out, report, uint32_t(children + 1), upper_part(cell, axis, position),
                  std::move(upper), decision.rest);
        return joined(frame_.options, cell, decision.plane, below, above);
    }

    SubtreeCost make_leaf(SubtreeArrays &out, BuildReport &report, uint32_t node,
                          Contents contents) {
        const uint64_t count = contents.count();
        const uint64_t first = out.references.size();
        if (count > KdNode::MAX_LEAF_COUNT)
            throw std::length_error(
                "a leaf of the kd-tree needs " + std::to_string(count) +
                " references, more than it can hold (2^24 - 1); the scene "
                "has too many triangles in one place");
        check_tree_size(out.nodes.size(), first + count);
        method_.for_each_triangle(
            contents, [&](uint32_t triangle) { out.references.push_back(triangle); });
        out.nodes[node] = KdNode::leaf(uint32_t(first), uint32_t(count));
        ++report.leaves;
        report.empty_leaves += count == 0;
        report.max_leaf_count = std::max(report.max_leaf_count, count);
        method_.give_back(std::move(contents));
        return {frame_.options.intersection_cost * double(count), 0};
    }

    Method &method_;
    const BuildFrame &frame_;
};

} // namespace mlrt
