// Where the answers of a query go, by ray of the group.
#pragma once

#include "mlrta/regroup.h"
#include "traverse/packet_state.h"
#include "traverse/single.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

namespace mlrt {

struct ClosestOutput {
    static constexpr Query query = Query::closest;
    HitGroup hits;

    bool wants_distances() const { return hits.t != nullptr; }
    void clear(uint32_t count) {
        if (wants_distances())
            std::fill_n(hits.t, count, std::numeric_limits<float>::infinity());
        std::fill_n(hits.primitive, count, NO_PRIMITIVE);
    }
    void set(uint32_t ray, const Hit &hit) {
        if (wants_distances())
            hits.t[ray] = hit.t;
        hits.primitive[ray] = hit.primitive;
    }
    void set(uint32_t first, LaneBits lanes, const PacketState<query> &state) {
        set(first, lanes & state.hits.found, state.hits.t, state.hits.primitive);
    }
    void set(uint32_t first, LaneBits lanes, const FloatPacket &t,
             const UIntPacket &primitive) {
        set(first, lanes, primitive);
        if (wants_distances())
            set_lanes(hits.t + first, lanes, t);
    }
    // Without distances, where they are not wanted.
    void set(uint32_t first, LaneBits lanes, const UIntPacket &primitive) {
        set_lanes(hits.primitive + first, lanes, primitive);
    }

    // Room for the answers of rays that were regrouped.
    struct Buffer {
        std::array<float, RayNumbers::CAPACITY> t;
        std::array<uint32_t, RayNumbers::CAPACITY> primitive;
    };
    ClosestOutput into(Buffer &buffer) const {
        return {{wants_distances() ? buffer.t.data() : nullptr, buffer.primitive.data()}};
    }
    void set(const RegroupedRays &rays, const Buffer &buffer) {
        for (uint32_t i = 0; i < rays.count; ++i) {
            if (wants_distances())
                hits.t[rays.number[i]] = buffer.t[i];
            hits.primitive[rays.number[i]] = buffer.primitive[i];
        }
    }

private:
    template <typename Value, typename Packet>
    static void set_lanes(Value *values, LaneBits lanes, const Packet &packet) {
        if (lanes == ALL_LANES) {
            store(values, packet);
            return;
        }
        const LaneArray<Value> from = to_lanes<Value>(packet);
        for_each_lane(lanes, [&](uint32_t lane) { values[lane] = from[lane]; });
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
        set(first, lanes & state.hits.found);
    }
    void set(uint32_t first, LaneBits lanes) {
        if (lanes == ALL_LANES)
            std::fill_n(occluded + first, PACKET_WIDTH, uint8_t(1));
        else
            for_each_lane(lanes, [&](uint32_t lane) { occluded[first + lane] = 1; });
    }

    struct Buffer {
        std::array<uint8_t, RayNumbers::CAPACITY> occluded;
    };
    AnyOutput into(Buffer &buffer) const { return {buffer.occluded.data()}; }
    void set(const RegroupedRays &rays, const Buffer &buffer) {
        for (uint32_t i = 0; i < rays.count; ++i)
            occluded[rays.number[i]] = buffer.occluded[i];
    }
};

} // namespace mlrt
