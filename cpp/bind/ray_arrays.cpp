#include "bind/ray_arrays.h"

#include "base/parallel.h"
#include "base/transpose.h"
#include "bind/watch.h"

#include <algorithm>
#include <mutex>

namespace mlrt {

namespace {

IntervalEnds ends_of(const Values &values, size_t rays) {
    if (values.shape(0) != 1 && values.shape(0) != rays)
        throw nanobind::value_error(
            "t_min and t_max must have one value, or as many as there are rays");
    return values.shape(0) == 1 ? IntervalEnds::of_all(*values.data())
                                : IntervalEnds(values.data());
}

IntervalEnds ends_from(const IntervalEnds &ends, size_t first) {
    return ends.each() ? IntervalEnds(ends.each() + first) : ends;
}

std::array<std::vector<float>, 3> columns_of(const float *rows, size_t count) {
    std::array<std::vector<float>, 3> columns;
    for (std::vector<float> &column : columns)
        column.resize(count);
    size_t i = 0;
    // A value behind the last row is read too.
    for (; i + PACKET_WIDTH < count; i += PACKET_WIDTH) {
        const std::array<FloatPacket, 4> packets = load_four_columns(rows + 3 * i, 3);
        for (size_t k = 0; k < 3; ++k)
            store(&columns[k][i], packets[k]);
    }
    for (; i < count; ++i)
        for (size_t k = 0; k < 3; ++k)
            columns[k][i] = rows[3 * i + k];
    return columns;
}

} // namespace

RayArrays::RayArrays(const Points &origins, const Points &directions, const Values &t_min,
                     const Values &t_max)
    : origins_(origins.data()), directions_(directions.data()), count_(origins.shape(0)) {
    if (directions.shape(0) != count_)
        throw nanobind::value_error("origins and directions must have the same length");
    if (count_ > 0xffffff00u)
        throw nanobind::value_error("at most 2^32 - 256 rays at a time");
    t_min_ = ends_of(t_min, count_);
    t_max_ = ends_of(t_max, count_);
}

bool RayArrays::have_common_origin(size_t first, size_t count) const {
    const float *const rows = origins_ + 3 * first;
    const size_t values = 3 * count;
    // Rows are the same if no value differs from that of the row before. NaN does from
    // itself too.
    size_t i = std::min<size_t>(3, values);
    if (!std::equal(rows, rows + i, rows))
        return false;
    for (; i + PACKET_WIDTH <= values; i += PACKET_WIDTH)
        if (any_lane(load<FloatPacket>(rows + i) != load<FloatPacket>(rows + i - 3)))
            return false;
    return std::equal(rows + i, rows + values, rows + i - 3);
}

RayArrays::Columns RayArrays::columns(size_t first, size_t count) const {
    Columns columns;
    RayGroup &group = columns.group;
    group.count = uint32_t(count);
    // A common origin costs less, and cameras and point lights have one.
    group.has_common_origin = have_common_origin(first, count);
    const float *const origin = origins_ + 3 * first;
    group.common_origin = {origin[0], origin[1], origin[2]};
    if (!group.has_common_origin)
        columns.origin = columns_of(origin, count);
    columns.direction = columns_of(directions_ + 3 * first, count);
    for (size_t k = 0; k < 3; ++k) {
        if (!group.has_common_origin)
            group.origin[k] = columns.origin[k].data();
        group.direction[k] = columns.direction[k].data();
    }
    group.t_min = ends_from(t_min_, first);
    group.t_max = ends_from(t_max_, first);
    return columns;
}

Counters RayArrays::for_each_group(uint32_t group_size, const Trace &trace) const {
    Watch watch;
    Counters total;
    std::mutex mutex;
    const auto trace_one = [&](uint32_t index) {
        const size_t first = size_t(index) * group_size;
        const Columns rays = columns(first, std::min<size_t>(group_size, count_ - first));
        Counters counters;
        trace(first, rays.group, counters);
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

} // namespace mlrt
