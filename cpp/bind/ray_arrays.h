// Rays of a query from Python.
#pragma once

#include "base/counters.h"
#include "bind/mesh_arrays.h"
#include "traverse/ray_group.h"

#include <array>
#include <cstdint>
#include <functional>
#include <nanobind/ndarray.h>
#include <vector>

namespace mlrt {

using Values = nanobind::ndarray<const float, nanobind::shape<-1>, nanobind::c_contig,
                                 nanobind::device::cpu>;

// Rays of a query, as borrowed rows of Python's arrays.
class RayArrays {
public:
    // t_min, t_max: a value for each ray, or one for all. Throws value_error for arrays of
    // other lengths.
    RayArrays(const Points &origins, const Points &directions, const Values &t_min,
              const Values &t_max);

    size_t count() const { return count_; }
    bool have_common_origin() const { return have_common_origin(0, count_); }

    // Calls trace(first, group, counters) on runs of rays, in parallel and without the
    // interpreter's lock. Returns what was counted. Throws what a signal raises.
    using Trace = std::function<void(size_t, const RayGroup &, Counters &)>;
    Counters for_each_group(uint32_t group_size, const Trace &trace) const;

private:
    // A run of rays, one array a component.
    struct Columns {
        std::array<std::vector<float>, 3> origin, direction;
        RayGroup group;
    };

    bool have_common_origin(size_t first, size_t count) const;
    Columns columns(size_t first, size_t count) const;

    const float *origins_, *directions_; // three values a row
    IntervalEnds t_min_, t_max_;
    size_t count_;
};

} // namespace mlrt
