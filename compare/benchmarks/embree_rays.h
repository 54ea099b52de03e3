// Rays in the memory layouts that Embree takes, in blocks of sixteen, and what it finds
// for them.
//
// What is the same for all rays of a frame is written once. A block is set, traced, and
// then read; rays that are not active end before they begin.
#pragma once

#include "embree_engine.h"
#include "frame.h"
#include "geometry/triangle.h"

#include <type_traits>
#include <vector>

namespace mlrt::bench {

inline constexpr float INACTIVE_END = -1;

inline FloatPacket ends(LaneBits active, float t_max) {
    return active == ALL_LANES ? FloatPacket(t_max)
                               : select(from_bits<FloatPacket>(active), FloatPacket(t_max),
                                        FloatPacket(INACTIVE_END));
}

// What the rays of a buffer have in common.
struct CommonRays {
    uint32_t block_count = 0;
    Vec3f origin;
    float t_min = 0;

    friend bool operator==(const CommonRays &, const CommonRays &) = default;
};

template <uint32_t N>
struct PacketsOf;
template <>
struct PacketsOf<8> {
    using Rays = RTCRay8;
    using Hits = RTCHit8;
    using RaysAndHits = RTCRayHit8;
};
template <>
struct PacketsOf<16> {
    using Rays = RTCRay16;
    using Hits = RTCHit16;
    using RaysAndHits = RTCRayHit16;
};

// Structures of arrays of N rays each.
template <uint32_t N, typename Element>
class RaysInPackets {
public:
    void prepare(const CommonRays &common) {
        if (common == common_)
            return;
        common_ = common;
        elements_.assign(common.block_count * PER_BLOCK, Element{});
        for (uint32_t i = 0; i < common.block_count; ++i) {
            put(i, &Rays::org_x, FloatPacket(common.origin.x));
            put(i, &Rays::org_y, FloatPacket(common.origin.y));
            put(i, &Rays::org_z, FloatPacket(common.origin.z));
            put(i, &Rays::tnear, FloatPacket(common.t_min));
            put(i, &Rays::mask, UIntPacket(0xffffffffu));
        }
    }

    void set(uint32_t block, const Vec3<FloatPacket> &direction, LaneBits active,
             float t_max) {
        put(block, &Rays::dir_x, direction.x);
        put(block, &Rays::dir_y, direction.y);
        put(block, &Rays::dir_z, direction.z);
        put(block, &Rays::tfar, ends(active, t_max));
        if constexpr (HAS_HITS)
            put(block, &Hits::geomID, UIntPacket(RTC_INVALID_GEOMETRY_ID));
    }
    void disable(uint32_t block) { put(block, &Rays::tfar, FloatPacket(INACTIVE_END)); }

    LaneBits hit(uint32_t block) const {
        return to_bits(get<UIntPacket>(block, &Hits::geomID) != RTC_INVALID_GEOMETRY_ID);
    }
    FloatPacket t(uint32_t block) const { return get<FloatPacket>(block, &Rays::tfar); }
    UIntPacket primitives(uint32_t block) const {
        return select(from_bits<UIntPacket>(hit(block)),
                      get<UIntPacket>(block, &Hits::primID), UIntPacket(NO_PRIMITIVE));
    }
    Vec3<FloatPacket> directions(uint32_t block) const {
        return {get<FloatPacket>(block, &Rays::dir_x),
                get<FloatPacket>(block, &Rays::dir_y),
                get<FloatPacket>(block, &Rays::dir_z)};
    }
    Vec3<FloatPacket> normals(uint32_t block) const {
        return {get<FloatPacket>(block, &Hits::Ng_x), get<FloatPacket>(block, &Hits::Ng_y),
                get<FloatPacket>(block, &Hits::Ng_z)};
    }
    // Embree marks an occluded ray by an end at minus infinity.
    LaneBits unoccluded(uint32_t block) const {
        return to_bits(get<FloatPacket>(block, &Rays::tfar) >= 0.0f);
    }

    Element *elements() { return elements_.data(); }
    static constexpr uint32_t PER_BLOCK = PACKET_WIDTH / N;

private:
    using Rays = typename PacketsOf<N>::Rays;
    using Hits = typename PacketsOf<N>::Hits;
    static constexpr bool HAS_HITS = !std::is_same_v<Element, Rays>;

    template <typename Part, typename Value>
    static auto *field_of(auto &element, Value (Part::*field)[N]) {
        if constexpr (!HAS_HITS)
            return &(element.*field)[0];
        else if constexpr (std::is_same_v<Part, Rays>)
            return &(element.ray.*field)[0];
        else
            return &(element.hit.*field)[0];
    }

    template <typename Part, typename Value, typename Packet>
    void put(uint32_t block, Value (Part::*field)[N], const Packet &packet) {
        Element *first = &elements_[block * PER_BLOCK];
        if constexpr (PER_BLOCK == 1)
            store(field_of(first[0], field), packet);
        else
            store_halves(field_of(first[0], field), field_of(first[1], field), packet);
    }
    template <typename Packet, typename Part, typename Value>
    Packet get(uint32_t block, Value (Part::*field)[N]) const {
        const Element *first = &elements_[block * PER_BLOCK];
        if constexpr (PER_BLOCK == 1)
            return load<Packet>(field_of(first[0], field));
        else
            return load_halves<Packet>(field_of(first[0], field),
                                       field_of(first[1], field));
    }

    CommonRays common_;
    std::vector<Element> elements_;
};

// One structure for each ray.
template <typename Element>
class RaysOneByOne {
public:
    void prepare(const CommonRays &common) {
        if (common == common_)
            return;
        common_ = common;
        elements_.assign(size_t(common.block_count) * PACKET_WIDTH, Element{});
        for (Element &element : elements_) {
            RTCRay &ray = ray_of(element);
            ray.org_x = common.origin.x;
            ray.org_y = common.origin.y;
            ray.org_z = common.origin.z;
            ray.tnear = common.t_min;
            ray.mask = 0xffffffffu;
        }
    }

    void set(uint32_t block, const Vec3<FloatPacket> &direction, LaneBits active,
             float t_max) {
        const auto x = to_lanes<float>(direction.x), y = to_lanes<float>(direction.y),
                   z = to_lanes<float>(direction.z),
                   end = to_lanes<float>(ends(active, t_max));
        for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
            Element &element = at(block, lane);
            RTCRay &ray = ray_of(element);
            ray.dir_x = x[lane];
            ray.dir_y = y[lane];
            ray.dir_z = z[lane];
            ray.tfar = end[lane];
            if constexpr (HAS_HITS)
                element.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        }
    }
    void disable(uint32_t block) {
        for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane)
            ray_of(at(block, lane)).tfar = INACTIVE_END;
    }

    LaneBits hit(uint32_t block) const {
        LaneBits bits = 0;
        for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane)
            bits |= LaneBits(at(block, lane).hit.geomID != RTC_INVALID_GEOMETRY_ID) << lane;
        return bits;
    }
    FloatPacket t(uint32_t block) const {
        return gather<FloatPacket>(block, [](const Element &e) { return ray_of(e).tfar; });
    }
    UIntPacket primitives(uint32_t block) const {
        return gather<UIntPacket>(block, [](const Element &e) {
            return e.hit.geomID != RTC_INVALID_GEOMETRY_ID ? e.hit.primID : NO_PRIMITIVE;
        });
    }
    Vec3<FloatPacket> directions(uint32_t block) const {
        return {gather<FloatPacket>(block, [](const Element &e) { return e.ray.dir_x; }),
                gather<FloatPacket>(block, [](const Element &e) { return e.ray.dir_y; }),
                gather<FloatPacket>(block, [](const Element &e) { return e.ray.dir_z; })};
    }
    Vec3<FloatPacket> normals(uint32_t block) const {
        return {gather<FloatPacket>(block, [](const Element &e) { return e.hit.Ng_x; }),
                gather<FloatPacket>(block, [](const Element &e) { return e.hit.Ng_y; }),
                gather<FloatPacket>(block, [](const Element &e) { return e.hit.Ng_z; })};
    }
    LaneBits unoccluded(uint32_t block) const { return to_bits(t(block) >= 0.0f); }

    Element *elements() { return elements_.data(); }

private:
    static constexpr bool HAS_HITS = !std::is_same_v<Element, RTCRay>;

    static auto &ray_of(auto &element) {
        if constexpr (HAS_HITS)
            return element.ray;
        else
            return element;
    }
    Element &at(uint32_t block, uint32_t lane) {
        return elements_[size_t(block) * PACKET_WIDTH + lane];
    }
    const Element &at(uint32_t block, uint32_t lane) const {
        return elements_[size_t(block) * PACKET_WIDTH + lane];
    }
    template <typename Packet, typename Read>
    Packet gather(uint32_t block, Read &&read) const {
        LaneArray<std::decay_t<decltype(read(at(0, 0)))>> lanes;
        for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane)
            lanes[lane] = read(at(block, lane));
        return load<Packet>(lanes);
    }

    CommonRays common_;
    std::vector<Element> elements_;
};

// The modes: how a number of blocks is traced.

struct PacketMode {
    static constexpr bool IS_STREAM = false;
    static constexpr RTCIntersectContextFlags FLAGS = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    using Primary = RaysInPackets<16, RTCRayHit16>;
    using Shadow = RaysInPackets<16, RTCRay16>;

    static void intersect(RTCScene scene, RTCIntersectContext &context, Primary &rays,
                          uint32_t block_count) {
        for (uint32_t i = 0; i < block_count; ++i) {
            RTCRayHit16 &packet = rays.elements()[i];
            rtcIntersect16(valid(packet.ray).data(), scene, &context, &packet);
        }
    }
    static void occlude(RTCScene scene, RTCIntersectContext &context, Shadow &rays,
                        uint32_t block_count) {
        for (uint32_t i = 0; i < block_count; ++i) {
            RTCRay16 &packet = rays.elements()[i];
            rtcOccluded16(valid(packet).data(), scene, &context, &packet);
        }
    }

private:
    static LaneArray<int> valid(const RTCRay16 &rays) {
        const auto active = load<FloatPacket>(rays.tfar) >= 0.0f;
        return to_lanes<int>(
            select(MaskOf<UIntPacket>(active), UIntPacket(0xffffffffu), UIntPacket(0u)));
    }
};

template <uint32_t N>
struct PacketStreamMode {
    static constexpr bool IS_STREAM = true;
    static constexpr RTCIntersectContextFlags FLAGS = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    using Primary = RaysInPackets<N, typename PacketsOf<N>::RaysAndHits>;
    using Shadow = RaysInPackets<N, typename PacketsOf<N>::Rays>;

    static void intersect(RTCScene scene, RTCIntersectContext &context, Primary &rays,
                          uint32_t block_count) {
        rtcIntersectNM(scene, &context, reinterpret_cast<RTCRayHitN *>(rays.elements()), N,
                       block_count * Primary::PER_BLOCK, sizeof(*rays.elements()));
    }
    static void occlude(RTCScene scene, RTCIntersectContext &context, Shadow &rays,
                        uint32_t block_count) {
        rtcOccludedNM(scene, &context, reinterpret_cast<RTCRayN *>(rays.elements()), N,
                      block_count * Shadow::PER_BLOCK, sizeof(*rays.elements()));
    }
};

struct SingleStreamMode {
    static constexpr bool IS_STREAM = true;
    static constexpr RTCIntersectContextFlags FLAGS = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    using Primary = RaysOneByOne<RTCRayHit>;
    using Shadow = RaysOneByOne<RTCRay>;

    static void intersect(RTCScene scene, RTCIntersectContext &context, Primary &rays,
                          uint32_t block_count) {
        rtcIntersect1M(scene, &context, rays.elements(), block_count * PACKET_WIDTH,
                       sizeof(RTCRayHit));
    }
    static void occlude(RTCScene scene, RTCIntersectContext &context, Shadow &rays,
                        uint32_t block_count) {
        rtcOccluded1M(scene, &context, rays.elements(), block_count * PACKET_WIDTH,
                      sizeof(RTCRay));
    }
};

} // namespace mlrt::bench
