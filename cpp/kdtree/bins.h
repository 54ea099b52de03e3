// The planes of a cell that are worth a look, found without sorting: the bounds of all
// references are counted in bins along each axis (min-max binning, Shevtsov et al. 2007),
// and what lies in the bins that promise most is swept plane by plane.
#pragma once

#include "base/simd.h"
#include "kdtree/chunks.h"
#include "kdtree/rules.h"
#include "kdtree/sweep.h"

#include <array>
#include <limits>
#include <optional>
#include <vector>

namespace mlrt {

// Numbers the bins, which are of equal width along each axis of a cell. Monotone: what is
// not below has no lower number, so the count of what begins in front of a bin is exact.
class BinGrid {
public:
    BinGrid(const Box3f &cell, int count);

    int index(int axis, float position) const {
        const float scaled = (position - origin_[axis]) * enlarge_[axis] * scale_[axis];
        return int(minimum(maximum(scaled, 0.0f), last_));
    }

    // The positions that one bin holds.
    struct Interval {
        float origin, enlarge, scale, first, last;

        bool contains(float position) const {
            const float scaled = (position - origin) * enlarge * scale;
            return scaled >= first && scaled < last;
        }
    };
    Interval interval(int axis, int bin, int count) const {
        constexpr float infinite = std::numeric_limits<float>::infinity();
        return {origin_[axis], enlarge_[axis], scale_[axis],
                bin == 0 ? -infinite : float(bin),
                bin == count - 1 ? infinite : float(bin + 1)};
    }

    // Along all axes at once.
    std::array<int32_t, 4> indices(const PointPacket &point) const {
        const PointPacket bins = (point - load<PointPacket>(origin_)) *
                                 load<PointPacket>(enlarge_) * load<PointPacket>(scale_);
        std::array<int32_t, 4> result;
        store(result.data(),
              PointIndices(minimum(maximum(bins, PointPacket(0.0f)), PointPacket(last_))));
        return result;
    }

private:
    // The scale is in two factors: one alone may be infinite for a cell of tiny extent.
    float origin_[4], enlarge_[4], scale_[4] = {};
    float last_;
};

class Bins {
public:
    // Counts `references`, which lie in `cell`.
    Bins(const References &references, const Box3f &cell, Crew &crew);

    // The cheapest plane found strictly inside the cell.
    std::optional<Candidate> best_plane(const BuildOptions &options) const;

    // Groups of references in one plane whose bounds are large enough to cover the cell.
    std::vector<PlanarGroup> planar_groups() const;

    static constexpr int MAX_BINS = 128;

    // How many bounds begin and end in each bin, and the area across the axis of what is
    // flat and lies in it.
    struct Counts {
        std::array<std::array<uint32_t, MAX_BINS>, 3> begin{}, end{};
        std::array<std::array<double, MAX_BINS>, 3> flat_area{};
        bool any_flat = false;
    };

private:
    void count_range(uint64_t first, uint64_t last, Counts &counts) const;
    // What collect(first, last, found) adds to `found` for ranges of the references, in
    // their order.
    template <typename T, typename Collect>
    std::vector<T> gather(Collect &&collect) const;
    // Events of the references in a bin, in any order.
    std::vector<Event> events_within(int axis, int bin) const;

    const References &references_;
    const Box3f &cell_;
    Crew &crew_;
    int bin_count_;
    BinGrid grid_;
    Counts counts_;
};

} // namespace mlrt
