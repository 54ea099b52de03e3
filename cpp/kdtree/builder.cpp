#include "kdtree/builder.h"

#include "base/simd.h"
#include "geometry/clip.h"
#include "geometry/degenerate.h"
#include "kdtree/events.h"
#include "kdtree/rules.h"
#include "kdtree/sah.h"
#include "kdtree/sweep.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

namespace mlrt {

namespace {

// Rule 3 (b): share of the scene's surface area below which a cell stays whole. The paper
// gives no value; c / N within these limits was found to save memory without slowing
// traversal.
constexpr double AREA_FLOOR_NUMERATOR = 0.3;
constexpr double MIN_AREA_FLOOR = 1e-7;
constexpr double MAX_AREA_FLOOR = 1e-4;

// Limit of the splits on a path, in the form of Havran 2000 with the constants of pbrt.
// Splits of rule 1 only cut off empty space and do not count for it, or they would leave
// cells full of triangles unsplit; they do count for MAX_TREE_DEPTH and for a limit that
// the caller sets.
constexpr double DEPTH_OFFSET = 8;
constexpr double DEPTH_PER_DOUBLING = 1.3;

// Splits on a path that cost more than a leaf but may open the way to a good one. Whether
// it did is seen when the subtree is finished; if not, it is taken back. Cells of up to
// MAX_PLAIN_LEAF references are not worth the try (the stopping count of Mitsuba's
// builder).
constexpr int MAX_BAD_SPLITS = 2;
constexpr uint64_t MAX_PLAIN_LEAF = 3;

// A cell may be split while the references along its path have not multiplied beyond this
// many times the triangles of the scene. A safeguard against scenes made to explode;
// chosen.
constexpr double MAX_DUPLICATION = 8;
constexpr double SPARE_REFERENCES = 65536;

// Lists longer than this are given back at once, shorter ones are kept for the next cell.
constexpr uint64_t MAX_KEPT_REFERENCES = 4096;

double area_floor_of(const BuildOptions &options, uint64_t count) {
    if (options.area_floor > 0)
        return options.area_floor;
    return std::clamp(AREA_FLOOR_NUMERATOR / double(count), MIN_AREA_FLOOR, MAX_AREA_FLOOR);
}

int max_depth_of(const BuildOptions &options) {
    return options.max_depth > 0 ? std::min(options.max_depth, MAX_TREE_DEPTH)
                                 : MAX_TREE_DEPTH;
}

int max_splits_of(uint64_t count) {
    return int(DEPTH_OFFSET + DEPTH_PER_DOUBLING * std::log2(double(count)));
}

// Whoever waits is asked whether to go on at cells of at least this many references: they
// are few, and what happens below one of the others takes well under a millisecond.
constexpr uint64_t MIN_CANCELLABLE = 256;

// Unwinds a build that was cancelled.
struct Cancelled {};

// What the path from the root leaves to a cell.
struct Allowance {
    int depth;  // levels that are left
    int splits; // of which others than those of rule 1
    int bad_splits;
    double duplication; // factor by which references may still multiply
};

struct Subtree {
    double cost; // expected, for a ray that enters its cell; in the units of BuildOptions
    int depth;   // inner nodes on the longest path
};

class SweepBuilder {
public:
    SweepBuilder(KdTree &tree, BuildReport &report, const BuildOptions &options,
                 const std::function<bool()> &cancelled, uint64_t reference_count)
        : tree_(tree), report_(report), options_(options), cancelled_(cancelled),
          splitter_(tree.triangles, options.clip), scene_area_(surface_area(tree.bounds)),
          area_floor_(area_floor_of(options, reference_count)) {}

    // Builds the subtree of node `node`, whose contents are used up.
    Subtree build(uint32_t node, const Box3f &cell, CellContents contents,
                  const Allowance &allowance) {
        const uint64_t count = contents.count();
        if (count >= MIN_CANCELLABLE && cancelled_ && cancelled_())
            throw Cancelled();
        const double area = surface_area(cell);
        if (count == 0 || allowance.depth == 0 || !(area > 0))
            return make_leaf(node, std::move(contents));
        if (options_.rule_area_floor && area < area_floor_ * scene_area_) {
            ++report_.area_floor_leaves;
            return make_leaf(node, std::move(contents));
        }

        if (options_.rule_empty_cell) {
            if (const auto plane = largest_empty_part(contents, cell, options_)) {
                ++report_.empty_cell_splits;
                CellContents empty = take_contents();
                return plane->planar_below ? split(node, cell, *plane, std::move(contents),
                                                   std::move(empty), allowance)
                                           : split(node, cell, *plane, std::move(empty),
                                                   std::move(contents), allowance);
            }
        }

        if (allowance.splits == 0)
            return make_leaf(node, std::move(contents));
        sweep(contents, cell, options_, swept_);
        std::optional<Candidate> chosen;
        if (options_.rule_flat_cell)
            chosen = covered_plane(contents, cell, tree_.triangles, swept_.planar_groups,
                                   options_);
        const bool flat = chosen.has_value();
        if (!flat)
            chosen = swept_.best;
        if (!chosen)
            return make_leaf(node, std::move(contents));

        const double leaf_cost = options_.intersection_cost * double(count);
        const bool bad = !flat && !(chosen->cost < leaf_cost);
        if (bad && (allowance.bad_splits == 0 || count <= MAX_PLAIN_LEAF))
            return make_leaf(node, std::move(contents));
        Allowance rest = allowance;
        --rest.splits;
        rest.bad_splits -= bad;
        rest.duplication *=
            double(count) / double(chosen->lower_count + chosen->upper_count);
        if (rest.duplication < 1)
            return make_leaf(node, std::move(contents));

        const BuildReport report_before = report_;
        const size_t nodes_before = tree_.nodes.size();
        const size_t references_before = tree_.references.size();
        std::vector<Reference> kept;
        if (bad)
            kept = contents.references;
        report_.flat_cell_splits += flat;

        CellContents lower = take_contents(), upper = take_contents();
        splitter_.split(contents, cell, chosen->plane, lower, upper);
        give_back(std::move(contents));
        const Subtree subtree =
            split(node, cell, chosen->plane, std::move(lower), std::move(upper), rest);
        if (bad && !(subtree.cost < leaf_cost)) {
            report_ = report_before;
            tree_.nodes.resize(nodes_before);
            tree_.references.resize(references_before);
            CellContents again = take_contents();
            again.references = std::move(kept);
            return make_leaf(node, std::move(again));
        }
        return subtree;
    }

private:
    // Makes `node` an inner node and builds its children, each with the contents given.
    Subtree split(uint32_t node, const Box3f &cell, const SplitPlane &plane,
                  CellContents lower, CellContents upper, Allowance allowance) {
        const uint64_t children = tree_.nodes.size();
        if (children + 2 > KdNode::MAX_NODES)
            throw std::length_error(
                "the kd-tree needs more than 2^30 nodes; build it with a "
                "larger area floor or a smaller depth");
        tree_.nodes.resize(children + 2);
        tree_.nodes[node] = KdNode::inner(plane.axis, plane.position, uint32_t(children));
        ++report_.inner_nodes;
        --allowance.depth;

        const Box3f lower_cell = lower_part(cell, plane.axis, plane.position);
        const Box3f upper_cell = upper_part(cell, plane.axis, plane.position);
        const Subtree below =
            build(uint32_t(children), lower_cell, std::move(lower), allowance);
        const Subtree above =
            build(uint32_t(children + 1), upper_cell, std::move(upper), allowance);
        const double area = surface_area(cell);
        return {options_.traversal_cost + surface_area(lower_cell) / area * below.cost +
                    surface_area(upper_cell) / area * above.cost,
                1 + std::max(below.depth, above.depth)};
    }

    Subtree make_leaf(uint32_t node, CellContents contents) {
        const uint64_t count = contents.count();
        const uint64_t first = tree_.references.size();
        if (count > KdNode::MAX_LEAF_COUNT)
            throw std::length_error(
                "a leaf of the kd-tree needs " + std::to_string(count) +
                " references, more than it can hold (2^24 - 1); the scene "
                "has too many triangles in one place");
        if (first + count > std::numeric_limits<uint32_t>::max())
            throw std::length_error("the kd-tree needs more than 2^32 references; build it "
                                    "with a larger area floor or a smaller depth");
        for (const Reference &reference : contents.references)
            tree_.references.push_back(reference.triangle);
        tree_.nodes[node] = KdNode::leaf(uint32_t(first), uint32_t(count));
        ++report_.leaves;
        report_.empty_leaves += count == 0;
        report_.max_leaf_count = std::max(report_.max_leaf_count, count);
        give_back(std::move(contents));
        return {options_.intersection_cost * double(count), 0};
    }

    CellContents take_contents() {
        if (spare_.empty())
            return {};
        CellContents contents = std::move(spare_.back());
        spare_.pop_back();
        return contents;
    }

    void give_back(CellContents &&contents) {
        if (contents.references.capacity() > MAX_KEPT_REFERENCES)
            return void(CellContents(std::move(contents)));
        contents.references.clear();
        for (auto &events : contents.events)
            events.clear();
        spare_.push_back(std::move(contents));
    }

    KdTree &tree_;
    BuildReport &report_;
    const BuildOptions &options_;
    const std::function<bool()> &cancelled_;
    ContentsSplitter splitter_;
    SweepResult swept_;
    std::vector<CellContents> spare_;
    double scene_area_;
    double area_floor_;
};

} // namespace

std::optional<BuiltTree> build_kd_tree(std::vector<Triangle> triangles,
                                       const BuildOptions &options,
                                       const std::function<bool()> &cancelled) try {
    const KeepDenormals keep_denormals;
    const auto start = std::chrono::steady_clock::now();
    BuiltTree built;
    KdTree &tree = built.tree;
    BuildReport &report = built.report;
    tree.triangles = std::move(triangles);
    if (tree.triangles.size() > Event::MAX_REFERENCES)
        throw std::length_error("the scene has " + std::to_string(tree.triangles.size()) +
                                " triangles, more than a kd-tree can hold (2^30)");

    std::vector<Reference> references;
    references.reserve(tree.triangles.size());
    for (uint32_t i = 0; i < tree.triangles.size(); ++i) {
        if (is_degenerate(tree.triangles[i])) {
            ++report.dropped_triangles;
            continue;
        }
        const Box3f bounds = bounds_of(tree.triangles[i]);
        tree.bounds.add(bounds.lo);
        tree.bounds.add(bounds.hi);
        references.push_back({bounds, i});
    }

    tree.nodes.resize(1);
    const uint64_t count = references.size();
    if (count == 0) {
        report.leaves = report.empty_leaves = 1;
    } else {
        SweepBuilder builder(tree, report, options, cancelled, count);
        const Subtree root =
            builder.build(0, tree.bounds, make_contents(std::move(references)),
                          {max_depth_of(options), max_splits_of(count), MAX_BAD_SPLITS,
                           MAX_DUPLICATION + SPARE_REFERENCES / double(count)});
        tree.depth = report.depth = root.depth;
        report.sah_cost = root.cost / options.traversal_cost;
    }
    tree.nodes.shrink_to_fit();
    tree.references.shrink_to_fit();
    report.references = tree.references.size();
    report.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return built;
} catch (const Cancelled &) {
    return std::nullopt;
}

} // namespace mlrt
