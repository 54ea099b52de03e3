#include "kdtree/bins.h"

#include <algorithm>
#include <map>

namespace mlrt {

namespace {

// More bins find better planes and cost more to search; chosen by measurement.
constexpr uint64_t MANY_REFERENCES = 4096;
constexpr int FEW_BINS = 32;

// Bins are swept as long as one may hold a plane that is better by this factor.
constexpr int MAX_SWEEPS = 6;
constexpr double WORTH_A_SWEEP = 0.98;

struct BoundsPackets {
    PointPacket lo, hi; // the fourth lane is zero
};

BoundsPackets bounds_packets(const Reference &reference) {
    const float *numbers = &reference.bounds.lo.x;
    // The fourth lanes are a coordinate and the bits of a triangle's number.
    const auto point = PointPacket(0, 0, 0, 1) == 0.0f;
    const PointPacket zero(0.0f);
    return {select(point, load<PointPacket>(numbers), zero),
            select(point, load<PointPacket>(numbers + 3), zero)};
}

} // namespace

BinGrid::BinGrid(const Box3f &cell, int count)
    : origin_{cell.lo.x, cell.lo.y, cell.lo.z, 0}, last_(float(count - 1)) {
    for (int k = 0; k < 3; ++k)
        if (const double length = extent(cell, k); length > 0)
            scale_[k] = float(count / length);
}

Bins::Bins(const References &references, const Box3f &cell, Threads threads)
    : references_(references), cell_(cell), threads_(threads),
      bin_count_(references.count() >= MANY_REFERENCES ? MAX_BINS : FEW_BINS),
      grid_(cell, bin_count_) {
    const uint64_t count = references.count();
    if (count <= CHUNK) {
        count_range(0, count, counts_);
        return;
    }
    std::vector<Counts> parts(chunk_count(count));
    for_each_chunk(count, threads, [&](uint32_t chunk, uint64_t first, uint64_t last) {
        count_range(first, last, parts[chunk]);
    });
    for (const Counts &part : parts) {
        counts_.any_flat |= part.any_flat;
        for (int k = 0; k < 3; ++k)
            for (int i = 0; i < bin_count_; ++i) {
                counts_.begin[k][i] += part.begin[k][i];
                counts_.end[k][i] += part.end[k][i];
                counts_.flat_area[k][i] += part.flat_area[k][i];
            }
    }
}

void Bins::count_range(uint64_t first, uint64_t last, Counts &counts) const {
    const LaneBits axes = 7;
    for (uint64_t i = first; i < last; ++i) {
        const auto [lo, hi] = bounds_packets(references_.list[i]);
        const auto begin = grid_.indices(lo), end = grid_.indices(hi);
        for (int k = 0; k < 3; ++k) {
            ++counts.begin[k][begin[k]];
            ++counts.end[k][end[k]];
        }
        if (const LaneBits flat = to_bits(lo == hi) & axes; flat != 0) [[unlikely]] {
            counts.any_flat = true;
            for_each_lane(flat, [&](uint32_t k) {
                counts.flat_area[k][begin[k]] +=
                    area_across(references_.list[i].bounds, int(k));
            });
        }
    }
}

std::optional<Candidate> Bins::best_plane(const BuildOptions &options) const {
    // What begins in front of a bin is below all of its planes, what ends behind it is
    // above them: the least that a plane inside can cost, and what its sweep starts from.
    struct BinBound {
        double cost;
        uint64_t below, above;
    };
    std::array<std::array<BinBound, MAX_BINS>, 3> bounds;
    // Only two planes an axis have nothing on one side, and they need no bins. All others
    // are without the bonus.
    BuildOptions without_bonus = options;
    without_bonus.empty_bonus = 1;
    BestPlane best;
    const uint64_t count = references_.count();
    for (int k = 0; k < 3; ++k) {
        const bool flat = !(cell_.lo[k] < cell_.hi[k]);
        const SplitCost cost(without_bonus, cell_, k);
        if (!flat) {
            const SweptAxis swept(options, cell_, k);
            const float first = references_.bounds.lo[k], last = references_.bounds.hi[k];
            if (swept.lo < first)
                swept.offer(first, 0, count, false, best);
            if (last < swept.hi)
                swept.offer(last, count, 0, true, best);
        }
        const double width = extent(cell_, k) / bin_count_;
        uint64_t below = 0, above = count;
        for (int i = 0; i < bin_count_; ++i) {
            const uint64_t above_behind = above - counts_.end[k][i];
            const double first = cell_.lo[k] + i * width;
            bounds[k][i] = {flat ? std::numeric_limits<double>::infinity()
                                 : std::min(cost(first, below, above_behind),
                                            cost(first + width, below, above_behind)),
                            below, above};
            below += counts_.begin[k][i];
            above = above_behind;
        }
    }

    for (int sweeps = 0; sweeps < MAX_SWEEPS; ++sweeps) {
        int axis = 0, bin = 0;
        for (int k = 0; k < 3; ++k)
            for (int i = 0; i < bin_count_; ++i)
                if (bounds[k][i].cost < bounds[axis][bin].cost)
                    axis = k, bin = i;
        BinBound &bound = bounds[axis][bin];
        if (!(bound.cost < best.cost * WORTH_A_SWEEP))
            break;
        const SweptAxis swept(options, cell_, axis);
        const std::vector<Event> events = events_within(axis, bin);
        sweep_events(events, bound.below, bound.above, swept, best);
        // The border too: nothing may begin or end in the bins beside it.
        const float border = float(swept.lo + bin * (extent(cell_, axis) / bin_count_));
        if (swept.lo < border && border < swept.hi &&
            (events.empty() || border < events.front().position()))
            swept.offer(border, bound.below, bound.above, true, best);
        bound.cost = std::numeric_limits<double>::infinity();
    }
    return best.candidate();
}

std::vector<Event> Bins::events_within(int axis, int bin) const {
    const auto inside = [&](float position) { return grid_.index(axis, position) == bin; };
    std::vector<std::vector<Event>> parts(chunk_count(references_.count()));
    for_each_chunk(references_.count(), threads_,
                   [&](uint32_t chunk, uint64_t first, uint64_t last) {
                       std::vector<Event> &events = parts[chunk];
                       for (uint64_t i = first; i < last; ++i) {
                           const Box3f &bounds = references_.list[i].bounds;
                           const float lo = bounds.lo[axis], hi = bounds.hi[axis];
                           if (inside(lo))
                               events.emplace_back(
                                   lo, lo == hi ? EventType::planar : EventType::start, 0);
                           if (lo != hi && inside(hi))
                               events.emplace_back(hi, EventType::end, 0);
                       }
                   });
    std::vector<Event> events = std::move(parts[0]);
    for (size_t i = 1; i < parts.size(); ++i)
        events.insert(events.end(), parts[i].begin(), parts[i].end());
    std::sort(events.begin(), events.end());
    return events;
}

std::vector<PlanarGroup> Bins::planar_groups() const {
    std::vector<PlanarGroup> groups;
    if (!counts_.any_flat)
        return groups;
    for (int axis = 0; axis < 3; ++axis)
        for (int bin = 0; bin < bin_count_; ++bin) {
            if (!(cell_.lo[axis] < cell_.hi[axis]) ||
                !(cover_limit(cell_, axis, counts_.flat_area[axis][bin]) >= 1))
                continue;
            std::map<float, PlanarGroup> by_position;
            for (const Reference &reference : references_.list) {
                const float position = reference.bounds.lo[axis];
                if (position != reference.bounds.hi[axis] ||
                    grid_.index(axis, position) != bin)
                    continue;
                PlanarGroup &group =
                    by_position.try_emplace(position, PlanarGroup{axis, position, {}, 0, 0})
                        .first->second;
                group.planar.push_back(reference);
            }
            for (auto &[position, group] : by_position) {
                double area = 0;
                for (const Reference &reference : group.planar)
                    area += area_across(reference.bounds, axis);
                if (!(cover_limit(cell_, axis, area) >= 1))
                    continue;
                for (const Reference &reference : references_.list) {
                    group.below += reference.bounds.lo[axis] < position;
                    group.above += reference.bounds.hi[axis] > position;
                }
                groups.push_back(std::move(group));
            }
        }
    return groups;
}

} // namespace mlrt
