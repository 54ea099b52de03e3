#include "mlrta/trace.h"

#include "mlrta/frontier.h"
#include "mlrta/tile.h"
#include "traverse/brute_force.h"
#include "traverse/interval.h"
#include "traverse/load_packet.h"
#include "traverse/packet.h"
#include "traverse/single.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

namespace mlrt {

namespace {

// Where the answers of a query go.
struct ClosestOutput {
    static constexpr Query query = Query::closest;
    HitGroup hits;

    void clear(uint32_t count) {
        std::fill_n(hits.t, count, std::numeric_limits<float>::infinity());
        std::fill_n(hits.primitive, count, NO_PRIMITIVE);
    }
    void set(uint32_t ray, const Hit &hit) {
        hits.t[ray] = hit.t;
        hits.primitive[ray] = hit.primitive;
    }
    void set(uint32_t first, LaneBits lanes, const PacketState<query> &state) {
        alignas(64) std::array<float, PACKET_WIDTH> t;
        alignas(64) std::array<uint32_t, PACKET_WIDTH> primitive;
        store(t.data(), state.hits.t);
        store(primitive.data(), state.hits.primitive);
        for_each_lane(lanes & state.hits.found, [&](uint32_t lane) {
            hits.t[first + lane] = t[lane];
            hits.primitive[first + lane] = primitive[lane];
        });
    }
};

struct AnyOutput {
    static constexpr Query query = Query::any;
    uint8_t *occluded;

    void clear(uint32_t count) { std::fill_n(occluded, count, uint8_t(0)); }
    void set(uint32_t ray, const Hit &hit) {
        occluded[ray] = hit.primitive != NO_PRIMITIVE;
    }
    void set(uint32_t first, LaneBits lanes, const PacketState<query> &state) {
        for_each_lane(lanes & state.hits.found,
                      [&](uint32_t lane) { occluded[first + lane] = 1; });
    }
};

// Takes one group through one tree.
template <typename Origin, typename Output>
class GroupTracer {
public:
    GroupTracer(const KdTree &tree, const RayGroup &rays, const TraceOptions &options,
                const CameraTile *tile, Output output, Counters &counters)
        : tree_(tree), rays_(rays), options_(options), tile_(tile), output_(output),
          counters_(counters) {}

    void trace() {
        output_.clear(rays_.count);
        const Frontier root(root_entry(tree_));
        if (options_.traversal == Traversal::brute_force || !options_.entry_points) {
            trace_packets(0, rays_.count, root);
            return;
        }
        const uint32_t initial = options_.initial_tile * options_.initial_tile;
        if (tile_ != nullptr)
            find_ends();
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
        Beam beam;
        if (tile_ == nullptr ||
            !tile_beam(*tile_, first, count, greatest_t_min_, greatest_t_max_, beam))
            beam = ray_beam(rays_, first, count);
        beam.t_max = std::min(beam.t_max, t_end);
        BeamJudge judge(tree_, beam, options_, counters_);
        counters_.fallbacks += !judge.knows(parent.entries[0].cell);
        const Frontier frontier =
            search_frontier({tree_.nodes.data(), tree_.nodes.capacity()}, parent,
                            options_.frontier, judge, options_.search_order);
        if (frontier.count == 0) {
            ++counters_.missed_tiles;
            return;
        }
        const uint32_t minimum =
            std::max(options_.minimum_tile * options_.minimum_tile, PACKET_WIDTH);
        if (count <= minimum ||
            (frontier.count == 1 && tree_.node(frontier.entries[0].node).is_leaf())) {
            trace_packets(first, count, frontier);
            return;
        }
        ++counters_.splits;
        for_each_child(Tile{first, count}, options_.split_factor, [&](Tile child) {
            trace_tile(child.first, child.count, frontier, judge.t_max());
        });
    }

    // Of all rays, since those of a camera have the same.
    void find_ends() {
        FloatPacket t_min(0.0f), t_max(-std::numeric_limits<float>::infinity());
        for (uint32_t i = 0; i < rays_.count; i += PACKET_WIDTH) {
            t_min = maximum(load_padded(rays_.t_min, i, rays_.count), t_min);
            t_max = maximum(load_padded(rays_.t_max, i, rays_.count), t_max);
        }
        greatest_t_min_ = greatest_lane(t_min);
        greatest_t_max_ = greatest_lane(t_max);
    }

    void trace_packets(uint32_t first, uint32_t count, const Frontier &frontier) {
        for (uint32_t i = first; i < first + count; i += PACKET_WIDTH) {
            auto [packet, extreme] = load_packet<Origin>(rays_, i);
            const LaneBits in_range = first + count - i >= PACKET_WIDTH
                                          ? ALL_LANES
                                          : (1u << (first + count - i)) - 1;
            packet.active &= in_range;
            extreme &= in_range;
            if (options_.traversal == Traversal::single) {
                extreme |= packet.active;
                packet.active = 0;
            }
            counters_.rays += uint64_t(std::popcount(packet.active | extreme));
            counters_.packets += (packet.active | extreme) != 0;
            if (packet.active != 0)
                trace_one_packet(packet, i, frontier);
            for_each_lane(extreme,
                          [&](uint32_t lane) { trace_one_ray(i + lane, frontier); });
        }
    }

    void trace_one_packet(const RayPacket<Origin> &packet, uint32_t first,
                          const Frontier &frontier) {
        PacketState<Output::query> state(packet);
        trace_from_entry(packet, frontier.entries[0], state);
        for (uint32_t i = 1; i < frontier.count; ++i) {
            if (state.search_end() < frontier.earliest_hit[i])
                continue;
            ++counters_.frontier_tests;
            trace_from_entry(packet, frontier.entries[i], state);
        }
        output_.set(first, packet.active, state);
    }

    void trace_from_entry(const RayPacket<Origin> &packet, const Entry &entry,
                          PacketState<Output::query> &state) {
        switch (options_.traversal) {
        case Traversal::brute_force:
            trace_brute_force(tree_, packet, state, counters_);
            break;
        case Traversal::interval:
            if constexpr (std::is_same_v<Origin, CommonOrigin>)
                trace_interval(tree_, packet, packet.active, entry, state, counters_);
            else
                for_each_octant(packet, [&](LaneBits lanes) {
                    trace_interval(tree_, packet, lanes, entry, state, counters_);
                });
            break;
        case Traversal::packet:
        case Traversal::single:
            trace_packet(tree_, packet, entry, state, counters_);
            break;
        }
    }

    // One interval for rays that go apart would cover most of the tree, so rays without a
    // common origin are traced by octants of their directions: calls trace(lanes) for the
    // lanes of each.
    template <typename Trace>
    static void for_each_octant(const RayPacket<Origin> &packet, Trace &&trace) {
        std::array<LaneBits, 3> negative;
        for (int k = 0; k < 3; ++k)
            negative[k] = to_bits(packet.direction[k] < 0.0f);
        for (LaneBits left = packet.active; left != 0;) {
            const int lane = std::countr_zero(left);
            LaneBits lanes = left;
            for (int k = 0; k < 3; ++k)
                lanes &= (negative[k] >> lane & 1) ? negative[k] : ~negative[k];
            trace(lanes);
            left &= ~lanes;
        }
    }

    void trace_one_ray(uint32_t i, const Frontier &frontier) {
        Ray ray;
        ray.origin = rays_.common_origin;
        for (int k = 0; k < 3; ++k) {
            if constexpr (std::is_same_v<Origin, LaneOrigins>)
                ray.origin[k] = rays_.origin[k][i];
            ray.direction[k] = rays_.direction[k][i];
        }
        ray.t_min = std::max(rays_.t_min[i], 0.0f);
        ray.t_max = rays_.t_max[i];
        if (options_.traversal == Traversal::brute_force) {
            output_.set(i, brute_force(tree_, ray, Output::query, counters_));
            return;
        }
        Hit best;
        for (uint32_t entry = 0; entry < frontier.count; ++entry) {
            const Hit hit =
                trace_single(tree_, ray, Output::query, frontier.entries[entry], counters_);
            if (hit.t < best.t || (hit.t == best.t && hit.primitive < best.primitive)) {
                best = hit;
                ray.t_max = hit.t;
                if (Output::query == Query::any)
                    break;
            }
        }
        output_.set(i, best);
    }

    const KdTree &tree_;
    const RayGroup &rays_;
    const TraceOptions &options_;
    const CameraTile *tile_;
    Output output_;
    Counters &counters_;
    double greatest_t_min_ = 0, greatest_t_max_ = 0; // of all rays, for camera tiles
};

template <typename Output>
void trace_group(const KdTree &tree, const RayGroup &rays, const TraceOptions &options,
                 const CameraTile *tile, Output output, Counters &counters) {
    if (rays.has_common_origin)
        GroupTracer<CommonOrigin, Output>(tree, rays, options, tile, output, counters)
            .trace();
    else
        GroupTracer<LaneOrigins, Output>(tree, rays, options, tile, output, counters)
            .trace();
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
