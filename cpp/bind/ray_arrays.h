// Rays of a query from Python.
#pragma once

#include "base/counters.h"
#include "base/parallel.h"
#include "bind/mesh_arrays.h"
#include "bind/watch.h"
#include "traverse/ray_group.h"

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <nanobind/ndarray.h>
#include <vector>

namespace mlrt {

using Values = nanobind::ndarray<const float, nanobind::shape<-1>, nanobind::c_contig,
                                 nanobind::device::cpu>;

// Rays of a query, one array a component.
class RayArrays {
public:
    RayArrays(const Points &origins, const Points &directions, const Values &t_min,
              const Values &t_max)
        : t_min_(t_min.data()), t_max_(t_max.data()), count_(origins.shape(0)) {
        if (directions.shape(0) != count_ || t_min.shape(0) != count_ ||
            t_max.shape(0) != count_)
            throw nanobind::value_error(
                "origins, directions, t_min and t_max must have the same length");
        if (count_ > 0xffffff00u)
            throw nanobind::value_error("at most 2^32 - 256 rays at a time");
        nanobind::gil_scoped_release release;
        for (int k = 0; k < 3; ++k) {
            origins_[k].resize(count_);
            directions_[k].resize(count_);
            for (size_t i = 0; i < count_; ++i) {
                origins_[k][i] = origins(i, size_t(k));
                directions_[k][i] = directions(i, size_t(k));
            }
        }
    }

    size_t count() const { return count_; }

    bool have_common_origin() const {
        for (size_t i = 1; i < count_; ++i)
            if (!(origin(i) == origin(0)))
                return false;
        return true;
    }

    Vec3f origin(size_t i) const {
        return {origins_[0][i], origins_[1][i], origins_[2][i]};
    }
    Vec3f direction(size_t i) const {
        return {directions_[0][i], directions_[1][i], directions_[2][i]};
    }

    RayGroup group(size_t first, size_t count) const {
        RayGroup group;
        group.count = uint32_t(count);
        for (int k = 0; k < 3; ++k) {
            group.origin[k] = origins_[k].data() + first;
            group.direction[k] = directions_[k].data() + first;
        }
        group.t_min = IntervalEnds(t_min_ + first);
        group.t_max = IntervalEnds(t_max_ + first);
        // A common origin costs less, and cameras and point lights have one.
        group.common_origin = origin(first);
        group.has_common_origin = true;
        for (size_t i = first; i < first + count && group.has_common_origin; ++i)
            group.has_common_origin = origin(i) == group.common_origin;
        return group;
    }

    // Calls trace(first, group, counters) on runs of rays, in parallel. Returns what was
    // counted.
    template <typename Trace>
    Counters for_each_group(uint32_t group_size, Trace &&trace) const {
        Watch watch;
        Counters total;
        std::mutex mutex;
        const auto trace_one = [&](uint32_t index) {
            const size_t first = size_t(index) * group_size;
            Counters counters;
            trace(first, group(first, std::min<size_t>(group_size, count_ - first)),
                  counters);
            const std::lock_guard lock(mutex);
            total += counters;
        };
        {
            nanobind::gil_scoped_release release;
            parallel_for(uint32_t((count_ + group_size - 1) / group_size), trace_one,
                         [&] { return watch(); });
        }
        watch.rethrow();
        return total;
    }

private:
    std::vector<float> origins_[3], directions_[3];
    const float *t_min_, *t_max_;
    size_t count_;
};

} // namespace mlrt
