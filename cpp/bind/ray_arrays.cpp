#include "bind/ray_arrays.h"

#include "base/parallel.h"
#include "base/quarters.h"
#include "base/simd.h"
#include "bind/watch.h"
#include "mlrta/trace_unordered.h"

#include <algorithm>
#include <mutex>
#include <utility>

namespace mlrt {

namespace {

IntervalEnds ends_of(const Values &values, size_t rays) {
    if (values.shape(0) != 1 && values.shape(0) != rays)
        throw nanobind::value_error(
            "t_min and t_max must have one value, or as many as there are rays");
    return values.shape(0) == 1 ? IntervalEnds::of_all(*values.data())
                                : IntervalEnds(values.data());
}

// As ImageTile does it, of consecutive rows.
void copy_columns(const float *rows, size_t count, const std::array<float *, 3> &to) {
    size_t i = 0;
    for (; i + PACKET_WIDTH <= count; i += PACKET_WIDTH) {
        std::array<const float *, QUARTERS> places;
        for (size_t n = 0; n < QUARTERS; ++n)
            places[n] = rows + 3 * (i + n * QUARTER_WIDTH);
        const std::array<FloatPacket, 3> columns = load_three_columns(places);
        for (size_t k = 0; k < 3; ++k)
            store(to[k] + i, columns[k]);
    }
    for (; i < count; ++i)
        for (size_t k = 0; k < 3; ++k)
            to[k][i] = rows[3 * i + k];
}

// Whether rows of three values are the same.
bool are_the_same(const float *rows, size_t count) {
    const size_t values = 3 * count;
    // They are if no value differs from that of the row before. NaN does from itself too.
    size_t i = std::min<size_t>(3, values);
    if (!std::equal(rows, rows + i, rows))
        return false;
    for (; i + PACKET_WIDTH <= values; i += PACKET_WIDTH)
        if (any_lane(load<FloatPacket>(rows + i) != load<FloatPacket>(rows + i - 3)))
            return false;
    return std::equal(rows + i, rows + values, rows + i - 3);
}

} // namespace

std::array<RayRun::Column, 3> RayRun::columns_of(const float *rows) const {
    std::array<Column, 3> columns;
    std::array<float *, 3> to;
    for (size_t k = 0; k < 3; ++k) {
        columns[k] = std::make_unique_for_overwrite<float[]>(group.count);
        to[k] = columns[k].get();
    }
    if (tile_)
        tile_->copy_columns(rows, to);
    else
        copy_columns(rows + 3 * first_, group.count, to);
    return columns;
}

IntervalEnds RayRun::ends_of(const IntervalEnds &all, Column &own) const {
    if (!all.each())
        return all;
    if (!tile_)
        return IntervalEnds(all.each() + first_);
    own = std::make_unique_for_overwrite<float[]>(group.count);
    tile_->copy_from(all.each(), own.get());
    return IntervalEnds(own.get());
}

bool RayRun::have_common(const float *rows) const {
    if (!tile_)
        return are_the_same(rows + 3 * first_, group.count);
    const float *const one = rows + 3 * tile_->first_ray();
    return tile_->all_lines([&](size_t first, size_t count) {
        const float *const line = rows + 3 * first;
        return std::equal(one, one + 3, line) && are_the_same(line, count);
    });
}

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

bool RayArrays::seem_to_have_common_origin() const {
    constexpr size_t FEW = 4096, SAMPLES = 256;
    if (count_ <= FEW)
        return are_the_same(origins_, count_);
    for (size_t n = 1; n <= SAMPLES; ++n)
        if (!std::equal(origins_, origins_ + 3,
                        origins_ + 3 * (n * (count_ - 1) / SAMPLES)))
            return false;
    return true;
}

RayRun RayArrays::run_of(size_t first, size_t count) const {
    RayRun run;
    run.first_ = first;
    run.group.count = uint32_t(count);
    load(run);
    return run;
}

RayRun RayArrays::run_of(ImageTile &&tile) const {
    RayRun run;
    run.tile_ = std::move(tile);
    run.group.count = run.tile_->count();
    if (run.group.count > 0)
        load(run);
    return run;
}

void RayArrays::load(RayRun &run) const {
    RayGroup &group = run.group;
    // A common origin costs less, and cameras and point lights have one.
    group.has_common_origin = run.have_common(origins_);
    const float *const origin = origins_ + 3 * run.first_ray();
    group.common_origin = {origin[0], origin[1], origin[2]};
    if (!group.has_common_origin)
        run.origin_ = run.columns_of(origins_);
    run.direction_ = run.columns_of(directions_);
    for (size_t k = 0; k < 3; ++k) {
        group.origin[k] = run.origin_[k].get();
        group.direction[k] = run.direction_[k].get();
    }
    group.t_min = run.ends_of(t_min_, run.t_min_);
    group.t_max = run.ends_of(t_max_, run.t_max_);
}

Counters RayArrays::for_each_run(const TraceOptions &options, const Trace &trace) const {
    Watch watch;
    Counters total;
    std::mutex mutex;
    const auto trace_all = [&](size_t runs, const auto &make_run) {
        const auto trace_one = [&](uint32_t number) {
            const RayRun run = make_run(number);
            if (run.group.count == 0)
                return;
            Counters counters;
            trace(run, counters);
            const std::lock_guard lock(mutex);
            total += counters;
        };
        parallel_for(uint32_t(runs), trace_one, [&] { return watch(); });
    };
    {
        nanobind::gil_scoped_release release;
        std::optional<RayLines> lines;
        if (squares_pay(options, ImageTile::SQUARE))
            lines = RayLines::find(directions_, count_);
        if (lines) {
            trace_all(lines->tile_count(),
                      [&](uint32_t number) { return run_of(lines->tile(number)); });
        } else {
            const size_t size = unordered_group_size(options, count_);
            trace_all((count_ + size - 1) / size, [&](size_t number) {
                return run_of(number * size, std::min(size, count_ - number * size));
            });
        }
    }
    watch.rethrow();
    return total;
}

} // namespace mlrt
