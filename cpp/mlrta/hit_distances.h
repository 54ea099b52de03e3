// Distances of hits, rounded as geometry/triangle_test.h has it, a packet at a time.
#pragma once

#include "base/counters.h"
#include "geometry/triangle_test.h"
#include "kdtree/tree.h"
#include "traverse/ray_group.h"

#include <array>
#include <cstdint>
#include <span>

namespace mlrt {

// Of rays with one common origin. Neighbouring packets mostly hit the same triangles: their
// planes are kept in a small direct-mapped table. Planes are made side by side.
//
// Pairs of floats take less time than double precision, of which a register holds half as
// many, and which rays must be converted to. They round nearly all distances for certain.
class HitDistances {
public:
    // For rays with this origin, before they are asked for.
    void start(const KdTree &tree, Vec3f origin) {
        tree_ = &tree;
        origin_ = origin;
        known_.fill(NO_PRIMITIVE);
    }

    // Makes planes of triangles that of() is likely to be asked for. More of them than
    // these would leave each other no room; with 256 dragon takes up to 13 % longer at
    // 16 spp, where the largest beams hit some hundred triangles.
    static constexpr uint32_t MOST_PREPARED = 1024;
    void prepare(std::span<const uint32_t> primitives);

    // Distances at which sixteen rays of a group, from `first_ray` on, meet a triangle
    // each. The rays in the given lanes, one at least, must hit it, and the largest
    // components of their directions must lie between 2^-60 and 2^61; other lanes hold any
    // value.
    FloatPacket of(const RayGroup &rays, uint32_t first_ray, LaneBits lanes,
                   const UIntPacket &primitives, Counters &counters);

private:
    // The distance is 1 / normal.d, of a normal that is the sum of two floats. Relative to
    // it, the error of the computed one is at most `error` times the greatest absolute
    // component of d by the size of normal.d. That component times `anchor` is four times
    // the sum of the absolute products of normal and d, or more.
    //
    // One plane, or one a lane.
    template <typename Value>
    struct Planes {
        Value normal[3], anchor, rest[3], error;
    };
    struct alignas(32) Plane : Planes<float> {};
    // Distances, and the lanes in which they are rounded correctly for certain.
    struct Rounded {
        FloatWide values;
        LaneBits certain;
    };

    const Plane &plane_of(uint32_t primitive);
    [[gnu::always_inline]] inline bool knows_all(const UIntPacket &primitives) const;
    LaneBits prepare_all(const UIntPacket &primitives);
    [[gnu::always_inline]] inline Planes<FloatWide> planes_of(const UIntPacket &primitives,
                                                              uint32_t lane);
    void put_planes(const std::array<uint32_t, BLOCK_WIDTH> &primitives);
    FloatPacket of_new(const RayGroup &rays, uint32_t first_ray, LaneBits lanes,
                       const UIntPacket &primitives, Counters &counters);
    FloatPacket of_several(const RayGroup &rays, uint32_t first_ray, LaneBits lanes,
                           const UIntPacket &primitives, Counters &counters);
    template <typename Value>
    [[gnu::always_inline]] static inline Rounded rounded(const Vec3<FloatWide> &direction,
                                                         const Planes<Value> &planes);
    FloatPacket with_ones(FloatPacket distances, const RayGroup &rays, uint32_t first_ray,
                          LaneBits open, const UIntPacket &primitives,
                          Counters &counters) const;

    static constexpr uint32_t SIZE = 2048;

    // Whether planes of several triangles are put into the lanes that hold them, one after
    // the other, and not turned from rows to columns: that is faster where instructions
    // have masks, and slower by 1 to 4 % of frames of rays on AVX2.
    static constexpr bool BY_TRIANGLE = WIDE_WIDTH == PACKET_WIDTH;

    bool knows(uint32_t primitive) const { return known_[primitive % SIZE] == primitive; }

    const KdTree *tree_ = nullptr;
    Vec3f origin_;
    std::array<uint32_t, SIZE> known_; // whose planes there are
    std::array<Plane, SIZE> planes_;
};

} // namespace mlrt
