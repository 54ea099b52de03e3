// Takes rays of a group through the wide tree: as packets those that have a common origin
// and go along with each other, one at a time the others.
#pragma once

#include "geometry/packet_distances.h"
#include "mlrta/last_occluder.h"
#include "mlrta/ray_cost.h"
#include "mlrta/trace.h"
#include "mlrta/trace_output.h"
#include "traverse/load_packet.h"
#include "traverse/single.h"
#include "traverse/wide.h"
#include "traverse/wide_packets.h"

#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <type_traits>

namespace mlrt {

// The wide tree, where rays that go alone are to take it and it is there.
inline const WideTree *wide_tree_for(const KdTree &tree, const TraceOptions &options) {
    const bool wanted =
        options.traversal == Traversal::adaptive || options.traversal == Traversal::wide;
    return wanted ? tree.widening->tree() : nullptr;
}

template <typename Origin, typename Output>
class WideTracer {
public:
    WideTracer(const KdTree &tree, const WideTree &wide, const RayGroup &rays,
               Output output, Counters &counters)
        : tree_(tree), wide_(wide), rays_(rays), output_(output), counters_(counters) {}

    // Traces a run of rays.
    void trace(uint32_t first, uint32_t count) {
        // What the rays take is shared by those that are next to each other.
        const uint32_t most = rays_.cost ? PACKET_WIDTH : WideRays::MOST;
        for (uint32_t i = first; i < first + count; i += PACKET_WIDTH) {
            add(i, first_lanes(first + count - i));
            if (waiting_ && waiting_->count + PACKET_WIDTH > most)
                flush();
        }
        flush();
    }

    // Traces those of sixteen rays from `first` on whose bit is set, now or with the next
    // ones: all are answered after flush().
    void add(uint32_t first, LaneBits lanes) {
        auto [packet, extreme] = load_packet<Origin>(rays_, first);
        LaneBits active = packet.active & lanes;
        const LaneBits traced = (packet.active | extreme) & lanes;
        counters_.rays += uint64_t(std::popcount(traced));
        counters_.packets += traced != 0;
        for_each_lane(extreme & lanes, [&](uint32_t lane) { trace_extreme(first + lane); });
        if (active != 0) {
            RayCost cost(rays_, counters_);
            const LaneBits stopped =
                occluder_.stop(tree_, packet, active, first, output_, counters_);
            cost.add_to_lanes(first, active);
            active &= ~stopped;
        }
        if constexpr (std::is_same_v<Origin, CommonOrigin>)
            active &= ~add_packet(packet, active, first);
        if (active == 0)
            return;
        if (!waiting_)
            waiting_ = std::make_unique_for_overwrite<WideRays>();
        if (!waiting_->has_room())
            flush();
        waiting_->add(packet, active, first);
    }

    void flush() {
        flush_packets();
        if (!waiting_ || waiting_->count == 0)
            return;
        std::array<Hit, WideRays::MOST> hits;
        RayCost cost(rays_, counters_);
        WideRays &rays = *waiting_;
        trace_wide(wide_, tree_.triangles.data(), rays, Output::query, hits.data(),
                   counters_);
        const float share = cost.share(rays.count);
        for (uint32_t i = 0; i < rays.count; ++i) {
            if (share > 0)
                rays_.cost[rays.number[i]] += share;
            if (hits[i].primitive == NO_PRIMITIVE)
                continue;
            output_.set(rays.number[i], hits[i]);
            occluder_.remember(hits[i].primitive);
        }
        rays.count = 0;
    }

private:
    // Packets of fewer rays are not worth it; chosen.
    static constexpr int LEAST_OF_PACKET = 4;
    static constexpr uint32_t MOST_PACKETS = 64;

    // Puts those of the given lanes off that go along with each other, as a packet, unless
    // they are few. Returns them.
    LaneBits add_packet(const RayPacket<CommonOrigin> &rays, LaneBits lanes,
                        uint32_t first) {
        if (std::popcount(lanes) < LEAST_OF_PACKET)
            return 0;
        if (!packets_)
            packets_ = std::make_unique<std::array<WidePacket, MOST_PACKETS>>();
        WidePacket &packet = (*packets_)[packet_count_];
        packet.rays = rays;
        packet.first = first;
        const LaneBits along = packet.choose_axis(lanes);
        if (std::popcount(along) < LEAST_OF_PACKET)
            return 0;
        packet.rays.active = along;
        // What the rays take is shared by those of a packet.
        if (++packet_count_ == MOST_PACKETS || rays_.cost)
            flush_packets();
        return along;
    }

    void flush_packets() {
        if (packet_count_ == 0)
            return;
        std::array<WideHits, MOST_PACKETS> hits;
        RayCost cost(rays_, counters_);
        trace_wide_packets(wide_, tree_.triangles.data(), {packets_->data(), packet_count_},
                           Output::query, hits.data(), counters_);
        for (uint32_t i = 0; i < packet_count_; ++i) {
            const WidePacket &packet = (*packets_)[i];
            cost.add_to_lanes(packet.first, packet.rays.active);
            if (hits[i].found == 0)
                continue;
            set(packet, hits[i]);
            occluder_.remember(
                lane_of(hits[i].primitive, uint32_t(std::countr_zero(hits[i].found))));
        }
        packet_count_ = 0;
    }

    void set(const WidePacket &packet, const WideHits &hits) {
        if constexpr (Output::query == Query::any)
            output_.set(packet.first, hits.found);
        else if (output_.wants_distances())
            output_.set(packet.first, hits.found,
                        hit_distances(packet.rays, hits.found, hits.primitive,
                                      tree_.triangles.data(), counters_),
                        hits.primitive);
        else
            output_.set(packet.first, hits.found, hits.primitive);
    }

    // By X1.
    void trace_extreme(uint32_t i) {
        RayCost cost(rays_, counters_);
        output_.set(i, trace_single(tree_, ray_of(rays_, i), Output::query,
                                    root_entry(tree_), counters_));
        cost.add_to_run(i, 1);
    }

    const KdTree &tree_;
    const WideTree &wide_;
    const RayGroup &rays_;
    Output output_;
    Counters &counters_;
    LastOccluder<Output> occluder_;
    // Few of the tracers that are made meet rays of either kind.
    std::unique_ptr<WideRays> waiting_;
    std::unique_ptr<std::array<WidePacket, MOST_PACKETS>> packets_;
    uint32_t packet_count_ = 0;
};

} // namespace mlrt
