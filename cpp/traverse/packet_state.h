// What a packet has found so far.
#pragma once

#include "base/counters.h"
#include "geometry/ray_packet.h"
#include "traverse/parameter_interval.h"
#include "traverse/query.h"

namespace mlrt {

// Best hits of the lanes. While tracing, t of a lane without a hit is its t_max, so that
// one comparison serves both the end of the interval and the nearest hit.
struct PacketHits {
    FloatPacket t;
    UIntPacket primitive = UIntPacket(NO_PRIMITIVE);
    LaneBits found = 0;

    explicit PacketHits(const FloatPacket &t_max) : t(t_max) {}
};

template <Query query>
struct PacketState {
    PacketHits hits;
    LaneBits searching;               // active lanes that may still find something
    uint32_t occluder = NO_PRIMITIVE; // found last, of Query::any

    template <typename Origin>
    explicit PacketState(const RayPacket<Origin> &rays)
        : hits(rays.t_max), searching(rays.active) {}

    // Greatest t that any lane may still improve on; minus infinity if none may.
    float search_end() const {
        return greatest_lane(
            select(from_bits<FloatPacket>(searching), hits.t, FloatPacket(-INFINITE)));
    }

    // Tests a triangle for the given lanes.
    template <typename Origin>
    void test(const RayPacket<Origin> &rays, LaneBits lanes, const Triangle &triangle,
              uint32_t primitive, Counters &counters) {
        ++counters.triangle_tests;
        const PacketCandidates candidates = intersect(rays, lanes, triangle);
        counters.double_tests += candidates.double_tests;
        counters.exact_tests += candidates.exact_tests;
        counters.exact_distances += candidates.exact_distances;
        if (candidates.hit == 0)
            return;
        // Infinity stands for a miss.
        const auto in_front = (candidates.t > rays.t_min) & (candidates.t < INFINITE);
        // Dr.Jit compares unsigned integers as signed ones on AVX-512, where NO_PRIMITIVE
        // is the least: a lane without a hit is told by `found` instead.
        const LaneBits lower_number =
            to_bits(UIntPacket(primitive) < hits.primitive) | ~hits.found;
        const LaneBits nearer = to_bits(candidates.t < hits.t) |
                                (to_bits(candidates.t == hits.t) & lower_number);
        const LaneBits better = to_bits(in_front) & nearer & candidates.hit;
        if (better == 0)
            return;
        hits.found |= better;
        if constexpr (query == Query::any) {
            searching &= ~better;
            occluder = primitive;
        } else {
            hits.t = select(from_bits<FloatPacket>(better), candidates.t, hits.t);
            hits.primitive = select(from_bits<UIntPacket>(better), UIntPacket(primitive),
                                    hits.primitive);
        }
    }

    template <typename Origin>
    void test_leaf(const KdTree &tree, const RayPacket<Origin> &rays, LaneBits lanes,
                   KdNode leaf, Counters &counters) {
        for (uint32_t primitive : tree.references_of(leaf)) {
            test(rays, lanes, tree.triangles[primitive], primitive, counters);
            if constexpr (query == Query::any) {
                lanes &= searching;
                if (lanes == 0)
                    return;
            }
        }
    }
};

// The interval of each lane in a cell; empty for lanes that are not active.
template <typename Origin>
ParameterInterval<FloatPacket> clip_to_cell(const RayPacket<Origin> &rays,
                                            const Box3f &cell) {
    const auto active = from_bits<FloatPacket>(rays.active);
    ParameterInterval<FloatPacket> interval{
        select(active, rays.t_min * WIDEN_NEAR, FloatPacket(INFINITE)),
        select(active, rays.t_max * WIDEN_FAR + TINY_PARAMETER, FloatPacket(-INFINITE))};
    for (int k = 0; k < 3; ++k)
        interval = clip_to_slab(interval, cell.lo[k] - rays.origin.point[k],
                                cell.hi[k] - rays.origin.point[k], rays.reciprocal[k]);
    return interval;
}

} // namespace mlrt
