#include "kdtree/partition.h"

#include "kdtree/cut_reference.h"

#include <cstring>
#include <vector>

namespace mlrt {

namespace {

// Appends to lists with room enough. `on_cut` gives the two parts of what is cut.
struct Writer {
    Reference *lower, *upper;
    Box3f lower_bounds, upper_bounds;

    template <typename OnCut>
    void distribute(std::span<const Reference> list, const SplitPlane &plane,
                    OnCut &&on_cut) {
        const auto [axis, position, planar_below] = plane;
        for (const Reference &reference : list) {
            const bool below = reference.bounds.lo[axis] < position;
            const bool above = reference.bounds.hi[axis] > position;
            if (below && above) {
                const ClippedHalves parts = on_cut(reference);
                if (!parts.lower.empty()) {
                    *lower++ = {parts.lower, reference.triangle};
                    add_bounds(lower_bounds, parts.lower);
                }
                if (!parts.upper.empty()) {
                    *upper++ = {parts.upper, reference.triangle};
                    add_bounds(upper_bounds, parts.upper);
                }
            } else if (above || (!below && !planar_below)) {
                *upper++ = reference;
                add_bounds(upper_bounds, reference.bounds);
            } else {
                *lower++ = reference;
                add_bounds(lower_bounds, reference.bounds);
            }
        }
    }
};

} // namespace

ClippedHalves Partitioner::cut(const Reference &reference, const Box3f &cell,
                               const SplitPlane &plane) const {
    return parts_of(reference, triangles_[reference.triangle], cell, plane, clip_);
}

Halves Partitioner::split(const References &references, const Box3f &cell,
                          const SplitPlane &plane, Reference *room) const {
    Reference *const upper_room = room + references.count();
    Writer writer{room, upper_room, {}, {}};
    writer.distribute(references.list, plane, [&](const Reference &reference) {
        return cut(reference, cell, plane);
    });
    return {{{room, writer.lower}, writer.lower_bounds},
            {{upper_room, writer.upper}, writer.upper_bounds}};
}

Partitioner::OwnHalves Partitioner::split_together(const References &references,
                                                   const Box3f &cell,
                                                   const SplitPlane &plane, Crew &crew,
                                                   const Allocate &allocate) const {
    const auto [axis, position, planar_below] = plane;
    struct Part {
        uint64_t lower_count = 0, upper_count = 0;
        std::vector<ClippedHalves> cut;
        Box3f lower_bounds, upper_bounds;
    };
    const uint64_t count = references.count();
    std::vector<Part> parts(chunk_count(count));

    // First count, so that each chunk knows where it writes.
    for_each_chunk(count, crew, [&](uint32_t chunk, uint64_t first, uint64_t last) {
        Part &part = parts[chunk];
        for (const Reference &reference : references.list.subspan(first, last - first)) {
            const bool below = reference.bounds.lo[axis] < position;
            const bool above = reference.bounds.hi[axis] > position;
            if (below && above) {
                const ClippedHalves halves = cut(reference, cell, plane);
                part.lower_count += !halves.lower.empty();
                part.upper_count += !halves.upper.empty();
                part.cut.push_back(halves);
            } else {
                const bool to_upper = above || (!below && !planar_below);
                part.lower_count += !to_upper;
                part.upper_count += to_upper;
            }
        }
    });
    uint64_t lower_count = 0, upper_count = 0;
    std::vector<std::pair<uint64_t, uint64_t>> starts;
    for (const Part &part : parts) {
        starts.emplace_back(lower_count, upper_count);
        lower_count += part.lower_count;
        upper_count += part.upper_count;
    }
    OwnHalves halves;
    halves.list = allocate(lower_count + upper_count);
    Reference *const lower = halves.list->data(), *const upper = lower + lower_count;
    halves.lower.list = {lower, lower_count};
    halves.upper.list = {upper, upper_count};
    for_each_chunk(count, crew, [&](uint32_t chunk, uint64_t first, uint64_t last) {
        Part &part = parts[chunk];
        Writer writer{lower + starts[chunk].first, upper + starts[chunk].second, {}, {}};
        auto next_cut = part.cut.begin();
        writer.distribute(references.list.subspan(first, last - first), plane,
                          [&](const Reference &) { return *next_cut++; });
        part.lower_bounds = writer.lower_bounds;
        part.upper_bounds = writer.upper_bounds;
    });
    for (const Part &part : parts) {
        add_bounds(halves.lower.bounds, part.lower_bounds);
        add_bounds(halves.upper.bounds, part.upper_bounds);
    }
    return halves;
}

} // namespace mlrt
