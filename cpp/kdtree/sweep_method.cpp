#include "kdtree/sweep_method.h"

namespace mlrt {

namespace {

// Lists longer than this are given back at once, shorter ones are kept for the next cell.
constexpr uint64_t MAX_KEPT_REFERENCES = 4096;

PlanarGroup group_of(const PlanarEvents &events, const CellContents &contents) {
    PlanarGroup group{events.axis, events.position, {}};
    group.planar.reserve(events.count);
    for (size_t i = 0; i < events.count; ++i)
        group.planar.push_back(
            contents.references[contents.events[events.axis][events.first_event + i]
                                    .reference()]);
    return group;
}

double bounds_sum(const PlanarEvents &events, const CellContents &contents) {
    double sum = 0;
    for (size_t i = 0; i < events.count; ++i)
        sum +=
            area_across(contents
                            .references[contents.events[events.axis][events.first_event + i]
                                            .reference()]
                            .bounds,
                        events.axis);
    return sum;
}

} // namespace

std::optional<SplitPlane> SweepMethod::largest_empty_part(const Contents &contents,
                                                          const Box3f &cell) const {
    Box3f bounds;
    for (int axis = 0; axis < 3; ++axis) {
        bounds.lo[axis] = contents.events[axis].front().position();
        bounds.hi[axis] = contents.events[axis].back().position();
    }
    return mlrt::largest_empty_part(bounds, cell, options_);
}

std::optional<Choice> SweepMethod::choose(const Contents &contents, const Box3f &cell) {
    sweep(contents, cell, options_, swept_);
    if (options_.rule_flat_cell) {
        // Among several: the one of the least cost, then the first axis and the lowest
        // position.
        std::optional<Candidate> flat;
        for (const PlanarEvents &events : swept_.planar_groups) {
            if (!(cover_limit(cell, events.axis, bounds_sum(events, contents)) >= 1))
                continue;
            const PlanarGroup group = group_of(events, contents);
            if (!covers(group, cell, triangles_))
                continue;
            const Candidate candidate =
                flat_cell(group, events.below, events.above, cell, options_);
            if (!flat || is_cheaper(candidate.cost, flat->cost))
                flat = candidate;
        }
        if (flat)
            return Choice{*flat, true};
    }
    if (!swept_.best)
        return std::nullopt;
    return Choice{*swept_.best, false};
}

SweepMethod::Parts SweepMethod::split(Contents contents, const Box3f &cell,
                                      const SplitPlane &plane, bool keep) {
    Parts parts{nothing(), nothing(), nothing()};
    if (keep)
        parts.kept.references = contents.references;
    splitter_.split(contents, cell, plane, parts.lower, parts.upper);
    give_back(std::move(contents));
    return parts;
}

CellContents SweepMethod::nothing() {
    if (spare_.empty())
        return {};
    CellContents contents = std::move(spare_.back());
    spare_.pop_back();
    return contents;
}

void SweepMethod::give_back(Contents contents) {
    if (contents.references.capacity() > MAX_KEPT_REFERENCES)
        return;
    contents.references.clear();
    for (auto &events : contents.events)
        events.clear();
    spare_.push_back(std::move(contents));
}

} // namespace mlrt
