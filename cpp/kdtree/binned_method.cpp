#include "kdtree/binned_method.h"

namespace mlrt {

namespace {

struct Around {
    uint64_t below = 0, above = 0;
};

// References that reach below and above the plane of a group.
Around count_around(const PlanarGroup &group, const References &references, Crew &crew) {
    std::vector<Around> parts(chunk_count(references.count()));
    for_each_chunk(references.count(), crew,
                   [&](uint32_t chunk, uint64_t first, uint64_t last) {
                       Around part;
                       for (uint64_t i = first; i < last; ++i) {
                           const Box3f &bounds = references.list[i].bounds;
                           part.below += bounds.lo[group.axis] < group.position;
                           part.above += bounds.hi[group.axis] > group.position;
                       }
                       parts[chunk] = part;
                   });
    Around sum;
    for (const Around &part : parts) {
        sum.below += part.below;
        sum.above += part.above;
    }
    return sum;
}

} // namespace

std::optional<Choice> choose_fast(const References &references, const Box3f &cell,
                                  std::span<const Triangle> triangles,
                                  const BuildOptions &options, Crew &crew) {
    const bool few = references.count() <= MAX_FEW_REFERENCES;
    std::optional<Bins> bins;
    if (!few)
        bins.emplace(references, cell, crew);
    if (options.rule_flat_cell) {
        std::optional<Candidate> flat;
        for (const PlanarGroup &group :
             few ? planar_groups_of_few(references, cell) : bins->planar_groups())
            if (covers(group, cell, triangles)) {
                const auto [below, above] = count_around(group, references, crew);
                const Candidate candidate = flat_cell(group, below, above, cell, options);
                if (!flat || is_cheaper(candidate.cost, flat->cost))
                    flat = candidate;
            }
        if (flat)
            return Choice{*flat, true};
    }
    const std::optional<Candidate> best =
        few ? best_plane_of_few(references, cell, options) : bins->best_plane(options);
    if (!best)
        return std::nullopt;
    return Choice{*best, false};
}

BinnedMethod::BinnedMethod(std::span<const Triangle> triangles, const BuildOptions &options,
                           const Interruption &interruption, uint64_t max_references)
    : triangles_(triangles), options_(options), interruption_(interruption),
      partitioner_(triangles, options.clip),
      // No child has more references than its parent, and at most two children a level
      // are on the stack, in twice the room of the parent's at most.
      stack_(0, 2 * uint64_t(MAX_TREE_DEPTH) * std::max<uint64_t>(max_references, 1)) {}

BinnedMethod::Parts BinnedMethod::split(Contents contents, const Box3f &cell,
                                        const SplitPlane &plane, bool) {
    contents.stack_before = stack_.size();
    const Halves halves =
        partitioner_.split(contents, cell, plane, stack_.data() + stack_.size());
    const uint64_t top =
        uint64_t(halves.upper.list.data() + halves.upper.count() - stack_.data());
    stack_.set_size(top);
    return {contents, {halves.lower}, {halves.upper}};
}

} // namespace mlrt
