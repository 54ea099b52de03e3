// Rays of a query from Python.
#pragma once

#include "base/counters.h"
#include "bind/mesh_arrays.h"
#include "mlrta/ray_lines.h"
#include "mlrta/trace.h"
#include "traverse/ray_group.h"

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <nanobind/ndarray.h>
#include <optional>

namespace mlrt {

using Values = nanobind::ndarray<const float, nanobind::shape<-1>, nanobind::c_contig,
                                 nanobind::device::cpu>;

// Rays that are traced together, one array a component.
class RayRun {
public:
    RayGroup group;

    // Of an image, in Morton order.
    bool is_square() const { return tile_.has_value(); }

    // Where to write the answers for the group: at their place in the array of all, or in
    // memory of their own, from where they are put there.
    template <typename Value>
    class Answers {
    public:
        Answers(const RayRun &run, Value *all) : run_(run), all_(all) {
            if (run.tile_)
                own_ = std::make_unique_for_overwrite<Value[]>(run.group.count);
        }
        Value *data() { return own_ ? own_.get() : all_ + run_.first_; }
        void put_in_place() const {
            if (own_)
                run_.tile_->copy_to(own_.get(), all_);
        }

    private:
        const RayRun &run_;
        Value *all_;
        std::unique_ptr<Value[]> own_;
    };

private:
    friend class RayArrays;

    using Column = std::unique_ptr<float[]>;

    // Of arrays of three values a ray, or of one.
    std::array<Column, 3> columns_of(const float *rows) const;
    IntervalEnds ends_of(const IntervalEnds &all, Column &own) const;
    // Whether arrays of three values hold the same ones for all rays.
    bool have_common(const float *rows) const;
    size_t first_ray() const { return tile_ ? tile_->first_ray() : first_; }

    size_t first_ = 0;              // of consecutive rays
    std::optional<ImageTile> tile_; // else
    std::array<Column, 3> origin_, direction_;
    Column t_min_, t_max_;
};

// Rays of a query, as borrowed rows of Python's arrays.
class RayArrays {
public:
    // t_min, t_max: a value for each ray, or one for all. Throws value_error for arrays of
    // other lengths.
    RayArrays(const Points &origins, const Points &directions, const Values &t_min,
              const Values &t_max);

    size_t count() const { return count_; }

    // Whether some rays, taken from all over the arrays, start in one point.
    bool seem_to_have_common_origin() const;

    // Calls trace(run, counters) on all rays, in parallel and without the interpreter's
    // lock. Returns what was counted. Throws what a signal raises.
    using Trace = std::function<void(const RayRun &, Counters &)>;
    Counters for_each_run(const TraceOptions &options, const Trace &trace) const;

private:
    // Of so many consecutive rays, or of a square.
    RayRun run_of(size_t first, size_t count) const;
    RayRun run_of(ImageTile &&tile) const;
    void load(RayRun &run) const;

    const float *origins_, *directions_; // three values a row
    IntervalEnds t_min_, t_max_;
    size_t count_;
};

} // namespace mlrt
