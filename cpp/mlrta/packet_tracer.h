// Takes packets of a group, or single rays, from a frontier to their answers.
#pragma once

#include "mlrta/frontier.h"
#include "mlrta/last_occluder.h"
#include "mlrta/ray_cost.h"
#include "mlrta/tactics.h"
#include "mlrta/trace.h"
#include "mlrta/trace_output.h"
#include "mlrta/wide_tracer.h"
#include "traverse/brute_force.h"
#include "traverse/interval.h"
#include "traverse/load_packet.h"
#include "traverse/packet.h"
#include "traverse/single.h"

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <span>

namespace mlrt {

template <typename Origin, typename Output>
class PacketTracer {
public:
    // Measured on office, conference and building with a common origin, where steps are
    // saved for each packet; and on conference with area lights, skies and parallel light,
    // where tiles have so little in common that deeper searches take more than they save.
    static constexpr bool COMMON_ORIGIN = std::is_same_v<Origin, CommonOrigin>;
    static constexpr uint32_t MINIMUM_TILE = COMMON_ORIGIN ? 32 : 64;
    static constexpr uint32_t FRONTIER = COMMON_ORIGIN ? 8 : 1;

    PacketTracer(const KdTree &tree, const RayGroup &rays, const TraceOptions &options,
                 Output output, Counters &counters)
        : tree_(tree), rays_(rays), options_(options), output_(output),
          counters_(counters) {
        if (const WideTree *wide = wide_tree_for(tree, options))
            wide_.emplace(tree, *wide, rays, output, counters);
    }

    // Traces a run of rays.
    void trace(uint32_t first, uint32_t count, const Frontier &frontier) {
        if (options_.traversal == Traversal::single ||
            options_.traversal == Traversal::wide)
            trace_singles(first, count, frontier);
        else if (options_.traversal == Traversal::adaptive)
            trace_either_way(first, count, frontier);
        else
            trace_packets(first, count, frontier);
    }

    // Traces those of sixteen rays from `first` on whose bit is set.
    void trace_lanes(uint32_t first, LaneBits lanes, const Frontier &frontier) {
        auto [packet, extreme] = load_packet<Origin>(rays_, first);
        packet.active &= lanes;
        extreme &= lanes;
        counters_.rays += uint64_t(std::popcount(packet.active | extreme));
        counters_.packets += (packet.active | extreme) != 0;
        RayCost cost(rays_, counters_);
        if (packet.active != 0) {
            const LaneBits active = packet.active;
            packet.active &= ~stopped_again(packet, first);
            if (packet.active != 0)
                trace_packet(packet, first, frontier);
            cost.add_to_lanes(first, active);
        }
        for_each_lane(extreme, [&](uint32_t lane) {
            trace_ray(first + lane, frontier);
            cost.add_to_lanes(first, 1u << lane);
        });
    }

    // The same for lanes that a beam is no good for, through the wide tree if it is there:
    // then flush() answers them.
    void trace_stray(uint32_t first, LaneBits lanes, const Frontier &frontier) {
        if (wide_) {
            wide_->add(first, lanes);
            return;
        }
        tree_.widening->miss(uint64_t(std::popcount(lanes)));
        trace_lanes(first, lanes, frontier);
    }
    bool knows_wide_tree() const { return wide_.has_value(); }
    void flush() {
        if (wide_)
            wide_->flush();
    }

private:
    void trace_packets(uint32_t first, uint32_t count, const Frontier &frontier) {
        for (uint32_t i = first; i < first + count; i += PACKET_WIDTH)
            trace_lanes(i, first_lanes(first + count - i), frontier);
    }

    void trace_either_way(uint32_t first, uint32_t count, const Frontier &frontier) {
        if (!wide_)
            tree_.widening->miss(count);
        for (uint32_t done = 0; done < count; done += PacketsOrSingles::RAYS) {
            const uint32_t rays = std::min(count - done, PacketsOrSingles::RAYS);
            const bool singles = tactics_.choose_singles();
            const Counters before = counters_;
            if (singles)
                trace_singles(first + done, rays, frontier);
            else
                trace_packets(first + done, rays, frontier);
            tactics_.learn(singles ? (wide_ ? Way::wide : Way::single) : Way::packet,
                           before, counters_);
        }
    }

    void trace_packet(const RayPacket<Origin> &packet, uint32_t first,
                      const Frontier &frontier) {
        PacketState<Output::query> state(packet);
        trace_from(packet, frontier.entries[0], state);
        for (uint32_t i = 1; i < frontier.count; ++i) {
            if (state.search_end() < frontier.earliest_hit[i])
                continue;
            ++counters_.frontier_tests;
            trace_from(packet, frontier.entries[i], state);
        }
        output_.set(first, packet.active, state);
        if constexpr (Output::query == Query::any)
            if (state.hits.found != 0)
                occluder_.remember(state.occluder);
    }

    // Lanes that stop where one did before.
    LaneBits stopped_again(const RayPacket<Origin> &packet, uint32_t first) {
        if (options_.traversal == Traversal::brute_force)
            return 0;
        return occluder_.stop(tree_, packet, packet.active, first, output_, counters_);
    }

    void trace_from(const RayPacket<Origin> &packet, const Entry &entry,
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
        case Traversal::beam_leaf:
        case Traversal::wide:
        case Traversal::adaptive:
            mlrt::trace_packet(tree_, packet, entry, state, counters_);
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

    // By X1.
    void trace_ray(uint32_t i, const Frontier &frontier) {
        const Ray ray = ray_of(rays_, i);
        Hit hit;
        if (options_.traversal == Traversal::brute_force)
            hit = brute_force(tree_, ray, Output::query, counters_);
        else
            trace_rays({&ray, 1}, &hit, frontier);
        output_.set(i, hit);
    }

    // Traces a run of rays through the wide tree, or by X1.
    void trace_singles(uint32_t first, uint32_t count, const Frontier &frontier) {
        if (wide_) {
            wide_->trace(first, count);
            return;
        }
        constexpr uint32_t MOST = 64;
        std::array<Ray, MOST> rays;
        std::array<uint32_t, MOST> numbers;
        std::array<Hit, MOST> hits;
        for (uint32_t done = 0; done < count;) {
            uint32_t active = 0;
            RayCost cost(rays_, counters_);
            const uint32_t begin = first + done;
            for (; done < count && active + PACKET_WIDTH <= MOST; done += PACKET_WIDTH) {
                auto [packet, extreme] = load_packet<Origin>(rays_, first + done);
                const LaneBits in_run = first_lanes(count - done);
                packet.active &= in_run;
                LaneBits lanes = packet.active | (extreme & in_run);
                counters_.packets += lanes != 0;
                counters_.rays += uint64_t(std::popcount(lanes));
                if (packet.active != 0)
                    lanes &= ~stopped_again(packet, first + done);
                for_each_lane(lanes, [&](uint32_t lane) {
                    numbers[active] = first + done + lane;
                    rays[active] = ray_of(rays_, numbers[active]);
                    ++active;
                });
            }
            if (active > 0)
                trace_rays({rays.data(), active}, hits.data(), frontier);
            for (uint32_t i = 0; i < active; ++i) {
                output_.set(numbers[i], hits[i]);
                if (Output::query == Query::any && hits[i].primitive != NO_PRIMITIVE)
                    occluder_.remember(hits[i].primitive);
            }
            cost.add_to_run(begin, std::min(first + count, first + done) - begin);
        }
    }

    // Through all subtrees of a frontier; what was found in one ends the rays.
    void trace_rays(std::span<const Ray> given, Hit *hits, const Frontier &frontier) {
        mlrt::trace_singles(tree_, given, Output::query, frontier.entries[0], hits,
                            counters_);
        for (uint32_t entry = 1; entry < frontier.count; ++entry)
            for (size_t i = 0; i < given.size(); ++i) {
                const bool found = hits[i].primitive != NO_PRIMITIVE;
                if (found && Output::query == Query::any)
                    continue;
                Ray ray = given[i];
                ray.t_max = std::min(ray.t_max, hits[i].t);
                const Hit hit = trace_single(tree_, ray, Output::query,
                                             frontier.entries[entry], counters_);
                if (hit.t < hits[i].t ||
                    (hit.t == hits[i].t && hit.primitive < hits[i].primitive))
                    hits[i] = hit;
            }
    }

    const KdTree &tree_;
    const RayGroup &rays_;
    const TraceOptions &options_;
    Output output_;
    Counters &counters_;
    PacketsOrSingles tactics_;
    std::optional<WideTracer<Origin, Output>> wide_;
    LastOccluder<Output> occluder_;
};

} // namespace mlrt
