#include "kdtree/builder.h"

#include "base/denormals.h"
#include "geometry/clip.h"
#include "geometry/degenerate.h"
#include "kdtree/chunks.h"
#include "kdtree/fast_builder.h"
#include "kdtree/lazy.h"
#include "kdtree/relocate.h"
#include "kdtree/sweep_method.h"

#include <chrono>
#include <stdexcept>

namespace mlrt {

namespace {

// From here on the exact builder takes more time than its better tree saves. Mitsuba's
// builder turns to bins at the same number.
constexpr uint64_t MIN_FAST_TRIANGLES = 65536;

void build_exact(KdTree &tree, BuildReport &report, HugeArray<Reference> references,
                 const BuildFrame &frame, const Interruption &interruption) {
    const uint64_t count = references.size();
    SweepMethod method({tree.triangles.begin(), tree.triangles.end()}, frame.options,
                       interruption);
    SubtreeArrays arrays;
    arrays.nodes.resize(1);
    CellContents contents = make_contents({references.begin(), references.end()});
    references = {};
    const SubtreeCost root = SubtreeBuilder(method, frame)
                                 .build(arrays, report, 0, tree.bounds, std::move(contents),
                                        whole_allowance(frame.options, count));
    tree.nodes = HugeArray<KdNode>(std::span<const KdNode>(arrays.nodes));
    tree.references = HugeArray<uint32_t>(std::span<const uint32_t>(arrays.references));
    tree.depth = report.depth = root.depth;
    report.sah_cost = root.cost / frame.options.traversal_cost;
}

// Bounds of all triangles that can be hit, and their common bounds.
HugeArray<Reference> make_references(const HugeArray<Triangle> &triangles, Box3f &bounds) {
    struct Part {
        uint64_t count = 0;
        Box3f bounds;
    };
    std::vector<Part> parts(chunk_count(triangles.size()));
    HugeArray<Reference> references(triangles.size());
    for_each_chunk(triangles.size(), all_threads(),
                   [&](uint32_t chunk, uint64_t first, uint64_t last) {
                       Part &part = parts[chunk];
                       for (uint64_t i = first; i < last; ++i) {
                           if (is_degenerate(triangles[i]))
                               continue;
                           const Box3f box = bounds_of(triangles[i]);
                           add_bounds(part.bounds, box);
                           references[first + part.count++] = {box, uint32_t(i)};
                       }
                   });
    uint64_t count = 0;
    for (uint32_t chunk = 0; chunk < parts.size(); ++chunk) {
        const uint64_t first = chunk * CHUNK;
        if (count < first)
            std::copy(references.begin() + first,
                      references.begin() + first + parts[chunk].count,
                      references.begin() + count);
        count += parts[chunk].count;
        add_bounds(bounds, parts[chunk].bounds);
    }
    references.set_size(count);
    return references;
}

Builder chosen_builder(Builder asked, uint64_t count) {
    if (asked != Builder::automatic)
        return asked;
    return count < MIN_FAST_TRIANGLES ? Builder::exact : Builder::fast;
}

} // namespace

void BuildReport::add(const BuildReport &part) {
    inner_nodes += part.inner_nodes;
    leaves += part.leaves;
    empty_leaves += part.empty_leaves;
    max_leaf_count = std::max(max_leaf_count, part.max_leaf_count);
    empty_cell_splits += part.empty_cell_splits;
    flat_cell_splits += part.flat_cell_splits;
    area_floor_leaves += part.area_floor_leaves;
}

std::optional<BuiltTree> build_kd_tree(HugeArray<Triangle> triangles,
                                       const BuildOptions &options,
                                       const std::function<bool()> &cancelled) try {
    using Clock = std::chrono::steady_clock;
    const auto seconds_since = [](Clock::time_point start) {
        return std::chrono::duration<double>(Clock::now() - start).count();
    };
    const KeepDenormals keep_denormals;
    const Clock::time_point start = Clock::now();
    if (triangles.size() > Event::MAX_REFERENCES)
        throw std::length_error("the scene has " + std::to_string(triangles.size()) +
                                " triangles, more than a kd-tree can hold (2^30)");
    const Interruption interruption(cancelled);
    BuiltTree built;
    KdTree &tree = built.tree;
    BuildReport &report = built.report;
    tree.triangles = std::move(triangles);
    HugeArray<Reference> references = make_references(tree.triangles, tree.bounds);
    report.dropped_triangles = tree.triangles.size() - references.size();
    report.seconds_bounds = seconds_since(start);

    const uint64_t count = references.size();
    report.builder = chosen_builder(options.builder, count);
    if (count == 0) {
        tree.nodes = HugeArray<KdNode>(1);
        tree.nodes[0] = KdNode::leaf(0, 0);
        report.leaves = report.empty_leaves = 1;
    } else {
        const BuildFrame frame{options, surface_area(tree.bounds),
                               area_floor_of(options,
                                             {references.begin(), references.end()},
                                             surface_area(tree.bounds))};
        const auto build = report.builder == Builder::exact  ? build_exact
                           : report.builder == Builder::fast ? build_fast
                                                             : build_lazy;
        build(tree, report, std::move(references), frame, interruption);
    }
    report.references = tree.references.size();
    report.seconds = seconds_since(start);
    return built;
} catch (const Cancelled &) {
    return std::nullopt;
}

} // namespace mlrt
