#include "kdtree/bins.h"

#include <algorithm>

namespace mlrt {

namespace {

// More bins find better planes and cost more to search; chosen by measurement.
constexpr uint64_t MANY_REFERENCES = 4096;
constexpr int FEW_BINS = 32;

// Bins are swept as long as one may hold a plane that is better by this factor.
constexpr int MAX_SWEEPS = 6;
constexpr double WORTH_A_SWEEP = 0.98;

// A stretch of an axis. What begins in front of it is below all of its planes, what ends
// behind it is above them: so much a plane in it costs at least.
struct Stretch {
    double least_cost = std::numeric_limits<double>::infinity();
    uint64_t below = 0, above = 0; // at its beginning
};

// The cost is linear between `first` and `last` as long as the counts stay.
double least_cost(const SplitCost &cost, double first, double last, uint64_t below,
                  uint64_t above) {
    return std::min(cost(first, below, above), cost(last, below, above));
}

// As sweep_events, for events in any order. Of many events only those are sorted that lie
// where the best plane may be.
constexpr size_t MANY_EVENTS = 2048;

void sweep_unsorted(std::vector<Event> &events, uint64_t below, uint64_t above,
                    const SweptAxis &axis, BestPlane &best) {
    if (events.size() <= MANY_EVENTS) {
        std::sort(events.begin(), events.end());
        sweep_events(events, below, above, axis, best);
        return;
    }
    const auto [first, last] = std::minmax_element(
        events.begin(), events.end(),
        [](const Event &a, const Event &b) { return a.position() < b.position(); });
    const float lo = first->position(), hi = last->position();
    const float scale = float(Bins::MAX_BINS / (double(hi) - double(lo)));
    const auto bin_of = [&](const Event &event) {
        return std::min(int((event.position() - lo) * scale), Bins::MAX_BINS - 1);
    };
    if (!(scale < std::numeric_limits<float>::infinity())) {
        std::sort(events.begin(), events.end());
        sweep_events(events, below, above, axis, best);
        return;
    }
    std::array<uint64_t, Bins::MAX_BINS> begin{}, end{};
    for (const Event &event : events) {
        begin[bin_of(event)] += event.type() != EventType::end;
        end[bin_of(event)] += event.type() != EventType::start;
    }
    std::array<Stretch, Bins::MAX_BINS> stretches;
    const double width = (double(hi) - double(lo)) / Bins::MAX_BINS;
    for (int i = 0; i < Bins::MAX_BINS; ++i) {
        const uint64_t above_behind = above - end[i];
        const double start = lo + i * width;
        stretches[i] = {least_cost(axis.cost, start, start + width, below, above_behind),
                        below, above};
        below += begin[i];
        above = above_behind;
    }
    const auto chosen = std::min_element(
        stretches.begin(), stretches.end(),
        [](const Stretch &a, const Stretch &b) { return a.least_cost < b.least_cost; });
    const int bin = int(chosen - stretches.begin());
    std::erase_if(events, [&](const Event &event) { return bin_of(event) != bin; });
    std::sort(events.begin(), events.end());
    sweep_events(events, chosen->below, chosen->above, axis, best);
}

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
    : origin_{cell.lo.x, cell.lo.y, cell.lo.z, 0}, enlarge_{1, 1, 1, 1},
      last_(float(count - 1)) {
    constexpr double TINY = 0x1p-60;
    for (int k = 0; k < 3; ++k)
        if (const double length = extent(cell, k); length > 0) {
            enlarge_[k] = length < TINY ? float(1 / TINY) : 1;
            scale_[k] = float(count / (length * enlarge_[k]));
        }
}

Bins::Bins(const References &references, const Box3f &cell, Crew &crew)
    : references_(references), cell_(cell), crew_(crew),
      bin_count_(references.count() >= MANY_REFERENCES ? MAX_BINS : FEW_BINS),
      grid_(cell, bin_count_) {
    const uint64_t count = references.count();
    if (count <= CHUNK) {
        count_range(0, count, counts_);
        return;
    }
    std::vector<Counts> parts(chunk_count(count));
    for_each_chunk(count, crew, [&](uint32_t chunk, uint64_t first, uint64_t last) {
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
    // Only two planes an axis have nothing on one side, and they need no bins. All others
    // are without the bonus.
    BuildOptions without_bonus = options;
    without_bonus.empty_bonus = 1;
    BestPlane best;
    std::array<std::array<Stretch, MAX_BINS>, 3> stretches;
    const uint64_t count = references_.count();
    for (int k = 0; k < 3; ++k) {
        if (!(cell_.lo[k] < cell_.hi[k])) {
            std::fill_n(stretches[k].begin(), bin_count_, Stretch{});
            continue;
        }
        const SweptAxis swept(options, cell_, k);
        const float first = references_.bounds.lo[k], last = references_.bounds.hi[k];
        if (swept.lo < first)
            swept.offer(first, 0, count, false, best);
        if (last < swept.hi)
            swept.offer(last, count, 0, true, best);
        const SplitCost cost(without_bonus, cell_, k);
        const double width = extent(cell_, k) / bin_count_;
        uint64_t below = 0, above = count;
        for (int i = 0; i < bin_count_; ++i) {
            const uint64_t above_behind = above - counts_.end[k][i];
            const double start = cell_.lo[k] + i * width;
            stretches[k][i] = {least_cost(cost, start, start + width, below, above_behind),
                               below, above};
            below += counts_.begin[k][i];
            above = above_behind;
        }
    }

    for (int sweeps = 0; sweeps < MAX_SWEEPS; ++sweeps) {
        int axis = 0, bin = 0;
        for (int k = 0; k < 3; ++k)
            for (int i = 0; i < bin_count_; ++i)
                if (stretches[k][i].least_cost < stretches[axis][bin].least_cost)
                    axis = k, bin = i;
        Stretch &chosen = stretches[axis][bin];
        if (!(chosen.least_cost < best.cost * WORTH_A_SWEEP))
            break;
        const SweptAxis swept(options, cell_, axis);
        // The border in front too: nothing may begin or end near it.
        const float border = float(swept.lo + bin * (extent(cell_, axis) / bin_count_));
        std::vector<Event> events = events_within(axis, bin);
        const bool border_is_free =
            std::none_of(events.begin(), events.end(),
                         [&](const Event &event) { return event.position() <= border; });
        if (border_is_free && swept.lo < border && border < swept.hi)
            swept.offer(border, chosen.below, chosen.above, true, best);
        sweep_unsorted(events, chosen.below, chosen.above, swept, best);
        chosen.least_cost = std::numeric_limits<double>::infinity();
    }
    return best.candidate();
}

template <typename T, typename Collect>
std::vector<T> Bins::gather(Collect &&collect) const {
    std::vector<T> all;
    const uint64_t count = references_.count();
    if (count <= CHUNK) {
        collect(0, count, all);
        return all;
    }
    std::vector<std::vector<T>> parts(chunk_count(count));
    for_each_chunk(count, crew_, [&](uint32_t chunk, uint64_t first, uint64_t last) {
        collect(first, last, parts[chunk]);
    });
    for (const std::vector<T> &part : parts)
        all.insert(all.end(), part.begin(), part.end());
    return all;
}

std::vector<Event> Bins::events_within(int axis, int bin) const {
    const BinGrid::Interval interval = grid_.interval(axis, bin, bin_count_);
    return gather<Event>([&](uint64_t first, uint64_t last, std::vector<Event> &events) {
        for (uint64_t i = first; i < last; ++i) {
            const Box3f &bounds = references_.list[i].bounds;
            const float lo = bounds.lo[axis], hi = bounds.hi[axis];
            if (interval.contains(lo))
                events.emplace_back(lo, lo == hi ? EventType::planar : EventType::start, 0);
            if (lo != hi && interval.contains(hi))
                events.emplace_back(hi, EventType::end, 0);
        }
    });
}

std::vector<PlanarGroup> Bins::planar_groups() const {
    std::vector<PlanarGroup> groups;
    if (!counts_.any_flat)
        return groups;
    struct Flat {
        float position;
        uint32_t number; // in the list

        bool operator<(const Flat &other) const {
            return position < other.position ||
                   (position == other.position && number < other.number);
        }
    };
    for (int axis = 0; axis < 3; ++axis) {
        std::array<bool, MAX_BINS> full{};
        bool any_full = false;
        if (cell_.lo[axis] < cell_.hi[axis])
            for (int bin = 0; bin < bin_count_; ++bin) {
                full[bin] = cover_limit(cell_, axis, counts_.flat_area[axis][bin]) >= 1;
                any_full |= full[bin];
            }
        if (!any_full)
            continue;
        std::vector<Flat> flats =
            gather<Flat>([&](uint64_t first, uint64_t last, std::vector<Flat> &found) {
                for (uint64_t i = first; i < last; ++i) {
                    const Box3f &bounds = references_.list[i].bounds;
                    if (bounds.lo[axis] == bounds.hi[axis] &&
                        full[grid_.index(axis, bounds.lo[axis])])
                        found.push_back({bounds.lo[axis], uint32_t(i)});
                }
            });
        std::sort(flats.begin(), flats.end());
        for (size_t first = 0, last = 0; first < flats.size(); first = last) {
            const float position = flats[first].position;
            double area = 0;
            for (; last < flats.size() && flats[last].position == position; ++last)
                area += area_across(references_.list[flats[last].number].bounds, axis);
            if (!(cover_limit(cell_, axis, area) >= 1))
                continue;
            PlanarGroup group{axis, position, {}};
            for (size_t i = first; i < last; ++i)
                group.planar.push_back(references_.list[flats[i].number]);
            groups.push_back(std::move(group));
        }
    }
    return groups;
}

} // namespace mlrt
