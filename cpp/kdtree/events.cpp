#include "kdtree/events.h"

#include "kdtree/cut_reference.h"

#include <algorithm>

namespace mlrt {

namespace {

void append_events(std::vector<Event> &events, const Box3f &bounds, int axis,
                   uint32_t reference) {
    if (bounds.lo[axis] == bounds.hi[axis]) {
        events.emplace_back(bounds.lo[axis], EventType::planar, reference);
    } else {
        events.emplace_back(bounds.lo[axis], EventType::start, reference);
        events.emplace_back(bounds.hi[axis], EventType::end, reference);
    }
}

// Merges the sorted `fresh` into the sorted `events` from the back, which needs no second
// copy.
void merge_into(std::vector<Event> &events, const std::vector<Event> &fresh) {
    size_t old = events.size(), added = fresh.size();
    events.resize(old + added);
    for (size_t out = events.size(); added > 0; --out) {
        if (old > 0 && fresh[added - 1] < events[old - 1])
            events[out - 1] = events[--old];
        else
            events[out - 1] = fresh[--added];
    }
}

// Where a reference of the parent goes: number among the references of the child, and
// which.
constexpr uint32_t CUT = 0xffffffffu;
constexpr uint32_t destination(uint64_t number, bool above) {
    return uint32_t(number << 1) | uint32_t(above);
}

} // namespace

CellContents make_contents(std::vector<Reference> references) {
    CellContents contents;
    contents.references = std::move(references);
    for (int k = 0; k < 3; ++k) {
        std::vector<Event> &events = contents.events[k];
        events.reserve(2 * contents.count());
        for (uint32_t i = 0; i < contents.count(); ++i)
            append_events(events, contents.references[i].bounds, k, i);
        std::sort(events.begin(), events.end());
    }
    return contents;
}

void ContentsSplitter::add_part(const Box3f &part, uint32_t triangle, int side,
                                CellContents &contents) {
    if (part.empty())
        return;
    const uint32_t number = uint32_t(contents.count());
    contents.references.push_back({part, triangle});
    for (int k = 0; k < 3; ++k)
        append_events(fresh_[side][k], part, k, number);
}

void ContentsSplitter::split(const CellContents &contents, const Box3f &cell,
                             const SplitPlane &plane, CellContents &lower,
                             CellContents &upper) {
    const auto [axis, position, planar_below] = plane;
    for (auto &side : fresh_)
        for (auto &events : side)
            events.clear();

    destinations_.resize(contents.count());
    lower.references.clear();
    upper.references.clear();
    for (uint64_t i = 0; i < contents.count(); ++i) {
        const Reference &reference = contents.references[i];
        const bool below = reference.bounds.lo[axis] < position;
        const bool above = reference.bounds.hi[axis] > position;
        if (below && above) {
            destinations_[i] = CUT;
            const ClippedHalves parts =
                parts_of(reference, triangles_[reference.triangle], cell, plane, clip_);
            add_part(parts.lower, reference.triangle, 0, lower);
            add_part(parts.upper, reference.triangle, 1, upper);
        } else {
            const bool to_upper = above || (!below && !planar_below);
            CellContents &child = to_upper ? upper : lower;
            destinations_[i] = destination(child.count(), to_upper);
            child.references.push_back(reference);
        }
    }

    for (int k = 0; k < 3; ++k) {
        const std::vector<Event> &events = contents.events[k];
        std::array<std::vector<Event> *, 2> out{&lower.events[k], &upper.events[k]};
        uint64_t room[2] = {2 * lower.count(), 2 * upper.count()};
        // One spare each: every event is written to both and kept by one.
        for (int side = 0; side < 2; ++side)
            out[side]->resize(std::min<uint64_t>(room[side], events.size()) + 1);
        Event *next_lower = out[0]->data(), *next_upper = out[1]->data();
        for (const Event &event : events) {
            const uint32_t where = destinations_[event.reference()];
            const bool kept = where != CUT;
            const Event moved(event.position(), event.type(), where >> 1);
            *next_lower = moved;
            *next_upper = moved;
            next_lower += kept & !(where & 1u);
            next_upper += kept & (where & 1u);
        }
        out[0]->resize(size_t(next_lower - out[0]->data()));
        out[1]->resize(size_t(next_upper - out[1]->data()));
        for (int side = 0; side < 2; ++side) {
            std::vector<Event> &fresh = fresh_[side][k];
            std::sort(fresh.begin(), fresh.end());
            merge_into(*out[side], fresh);
        }
    }
}

} // namespace mlrt
