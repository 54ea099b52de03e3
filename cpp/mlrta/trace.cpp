#include "mlrta/trace.h"

#include "mlrta/beam_tracer.h"
#include "mlrta/frontier.h"
#include "mlrta/kept_by_thread.h"
#include "mlrta/packet_tracer.h"
#include "mlrta/parallel_rays.h"
#include "mlrta/ray_cost.h"
#include "mlrta/tile.h"
#include "traverse/load_packet.h"

#include <algorithm>
#include <limits>
#include <optional>

namespace mlrt {

namespace {

// Cuts a group into tiles, finds entry points for them, and hands runs of rays on.
//
// Runs is what traces them: void trace(first, count, frontier), with the tiles and frontier
// that are usual for it.
template <typename Runs, typename Output>
class TileTracer {
public:
    TileTracer(const KdTree &tree, const RayGroup &rays, const TraceOptions &options,
               const CameraRays *camera, Runs &runs, Output &output, Counters &counters)
        : tree_(tree), rays_(rays), options_(options), camera_(camera), runs_(runs),
          output_(output), counters_(counters),
          minimum_tile_(options.minimum_tile ? options.minimum_tile : Runs::MINIMUM_TILE),
          most_entries_(options.frontier ? options.frontier : Runs::FRONTIER) {}

    void trace() {
        const Frontier root(root_entry(tree_));
        if (options_.traversal == Traversal::brute_force ||
            options_.traversal == Traversal::wide || !options_.entry_points) {
            runs_.trace(0, rays_.count, root);
            return;
        }
        const uint32_t initial = options_.initial_tile * options_.initial_tile;
        for (uint32_t first = 0; first < rays_.count; first += initial)
            trace_tile(first, std::min(initial, rays_.count - first), root,
                       std::numeric_limits<double>::infinity());
    }

private:
    // Searches entry points for the tile's beam, starting at those of the tile it is part
    // of, and splits the tile unless it is small, or its entry point is a leaf and cannot
    // get any deeper. A packet is never split. No ray has a first hit beyond t_end.
    void trace_tile(uint32_t first, uint32_t count, const Frontier &parent, double t_end) {
        ++counters_.tiles;
        RayCost cost(rays_, counters_);
        Beam beam;
        if (!camera_ ||
            !tile_beam(camera_->tile, first, count, camera_->t_min, camera_->t_max, beam))
            beam = ray_beam(rays_, first, count);
        beam.t_max = std::min(beam.t_max, t_end);
        BeamJudge judge(tree_, beam, options_, counters_);
        counters_.fallbacks += !judge.knows(parent.entries[0].cell);
        if constexpr (Output::query == Query::any) {
            // Neighbouring tiles are often covered by the same triangle.
            const uint32_t last = last_blocker();
            if (has_beams(options_.traversal) && last != NO_PRIMITIVE)
                judge.try_blocker(last);
            if (stopped_by_blocker(first, count, judge)) {
                cost.add_to_run(first, count);
                return;
            }
        }
        const Frontier frontier =
            search_frontier({tree_.nodes.data(), tree_.nodes.capacity()}, parent,
                            most_entries_, judge, options_.search_order);
        cost.add_to_run(first, count);
        if (stopped_by_blocker(first, count, judge))
            return;
        if (frontier.count == 0) {
            ++counters_.missed_tiles;
            return;
        }
        const uint32_t minimum = std::max(minimum_tile_ * minimum_tile_, PACKET_WIDTH);
        if (count <= minimum ||
            (frontier.count == 1 && tree_.node(frontier.entries[0].node).is_leaf())) {
            runs_.trace(first, count, frontier);
            return;
        }
        ++counters_.splits;
        for_each_child(Tile{first, count}, options_.split_factor, [&](Tile child) {
            trace_tile(child.first, child.count, frontier, judge.t_max());
        });
    }

    // Whether a triangle stops all rays of the tile, of Query::any: it answers them then.
    bool stopped_by_blocker(uint32_t first, uint32_t count, const BeamJudge &judge) {
        if constexpr (Output::query == Query::any) {
            if (!has_beams(options_.traversal) || !judge.found_blocker() ||
                !(judge.t_max() <= first_end(first, count)))
                return false;
            last_blocker() = judge.blocker();
            for (uint32_t i = first; i < first + count; i += PACKET_WIDTH)
                output_.set(i, active_rays(i, first + count));
            return true;
        }
        return false;
    }

    // The smallest t_max of active rays.
    float first_end(uint32_t first, uint32_t count) const {
        if (!rays_.t_max.each())
            return rays_.t_max.common();
        float end = std::numeric_limits<float>::infinity();
        for (uint32_t i = first; i < first + count; ++i)
            if (rays_.t_min[i] < rays_.t_max[i])
                end = std::min(end, rays_.t_max[i]);
        return end;
    }

    // Of up to sixteen rays from `first` on, all of them before `last`.
    LaneBits active_rays(uint32_t first, uint32_t last) const {
        const auto active = [](const auto &packet) {
            return packet.rays.active | packet.extreme;
        };
        return first_lanes(last - first) &
               (rays_.has_common_origin ? active(load_packet<CommonOrigin>(rays_, first))
                                        : active(load_packet<LaneOrigins>(rays_, first)));
    }

    // The last triangle that stopped all rays of a tile.
    struct LastBlocker {
        uint32_t primitive = NO_PRIMITIVE;
    };
    uint32_t &last_blocker() const {
        return kept_by_thread<LastBlocker, LastBlocker>(tree_).primitive;
    }

    const KdTree &tree_;
    const RayGroup &rays_;
    const TraceOptions &options_;
    const CameraRays *camera_;
    Runs &runs_;
    Output &output_;
    Counters &counters_;
    uint32_t minimum_tile_, most_entries_;
};

// Whether coordinates are so large that only rays one by one are safe from overflow, as
// they are scaled.
bool is_huge(const KdTree &tree, const RayGroup &rays) {
    const auto reaches = [](Vec3f v) {
        return max_component(abs(v)) >= LARGEST_COORDINATE;
    };
    return reaches(tree.bounds.lo) || reaches(tree.bounds.hi) ||
           (rays.has_common_origin && reaches(rays.common_origin));
}

// How rays are traced: as is asked for, unless that is not safe.
TraceOptions safe_options(const KdTree &tree, const RayGroup &rays, TraceOptions options) {
    if (options.traversal != Traversal::brute_force && is_huge(tree, rays)) {
        options.traversal = Traversal::single;
        options.entry_points = false;
    }
    return options;
}

template <typename Output>
void trace_group(const KdTree &tree, const RayGroup &rays, const TraceOptions &asked,
                 const CameraTile *tile, Output output, Counters &counters) {
    const TraceOptions options = safe_options(tree, rays, asked);
    std::optional<CameraRays> camera;
    if (tile)
        camera = camera_rays(rays, *tile);
    const auto trace_runs = [&](auto runs) {
        TileTracer(tree, rays, options, camera ? &*camera : nullptr, runs, output, counters)
            .trace();
    };
    output.clear(rays.count);
    const bool beams = has_beams(options.traversal);
    if (!rays.has_common_origin) {
        if constexpr (Output::query == Query::any)
            if (beams && are_parallel(rays)) {
                trace_runs(BeamTracer<LaneOrigins, Output>(
                    tree, rays, options, nullptr, output, counters,
                    BeamMemory::of_thread(tree, {})));
                return;
            }
        trace_runs(
            PacketTracer<LaneOrigins, Output>(tree, rays, options, output, counters));
    } else if (beams) {
        trace_runs(BeamTracer<CommonOrigin, Output>(
            tree, rays, options, camera ? &*camera : nullptr, output, counters,
            BeamMemory::of_thread(tree, rays.common_origin)));
    } else {
        trace_runs(
            PacketTracer<CommonOrigin, Output>(tree, rays, options, output, counters));
    }
}

} // namespace

void trace_closest(const KdTree &tree, const RayGroup &rays, const TraceOptions &options,
                   HitGroup hits, Counters &counters, const CameraTile *tile) {
    trace_group(tree, rays, options, tile, ClosestOutput{hits}, counters);
}

void trace_any(const KdTree &tree, const RayGroup &rays, const TraceOptions &options,
               uint8_t *occluded, Counters &counters) {
    trace_group(tree, rays, options, nullptr, AnyOutput{occluded}, counters);
}

} // namespace mlrt
