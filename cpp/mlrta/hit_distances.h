// Distances of hits, rounded as geometry/triangle_test.h has it, a packet at a time.
#pragma once

#include "base/counters.h"
#include "geometry/triangle_test.h"
#include "kdtree/tree.h"
#include "traverse/ray_group.h"

#include <array>
#include <cstdint>
#include <optional>

namespace mlrt {

// Of rays with one common origin. Neighbouring packets mostly hit the same triangles: their
// planes are kept in a small direct-mapped table.
//
// Pairs of floats take less time than double precision, of which a register holds half as
// many, and which rays must be converted to. They round nearly all distances for certain.
class HitDistances {
public:
    HitDistances(const KdTree &tree, Vec3f origin) : tree_(tree), origin_(origin) {}

    // Distances at which sixteen rays of a group, from `first_ray` on, meet a triangle
    // each. The rays in the given lanes, one at least, must hit it, and the largest
    // components of their directions must lie between 2^-60 and 2^61; other lanes hold any
    // value.
    FloatPacket of(const RayGroup &rays, uint32_t first_ray, LaneBits lanes,
                   const UIntPacket &primitives, Counters &counters);

private:
    // The distance is 1 / normal.d, of a normal that is the sum of two floats. Relative to
    // it, the error of the computed one is at most `share`, plus `direction_share` times
    // the greatest absolute component of d by the size of normal.d. That component times
    // `anchor` is four times the sum of the absolute products of normal and d, or more.
    //
    // One plane, or one a lane.
    template <typename Value>
    struct Planes {
        Value normal[4], rest[4]; // the fourth is any number
        Value anchor, share, direction_share;
    };
    struct Plane : Planes<float> {
        uint32_t primitive;

        Plane(uint32_t number, const Triangle &triangle, Vec3f origin);
    };
    // Distances, and the lanes in which they are rounded correctly for certain.
    struct Rounded {
        FloatPacket values;
        LaneBits certain;
    };

    const Plane &plane_of(uint32_t primitive);
    FloatPacket of_new(uint32_t primitive, const RayGroup &rays, uint32_t first_ray,
                       LaneBits lanes, const UIntPacket &primitives, Counters &counters);
    FloatPacket of_several(const RayGroup &rays, uint32_t first_ray, LaneBits lanes,
                           const UIntPacket &primitives, Counters &counters);
    template <typename Value>
    static Rounded rounded(const Vec3<FloatPacket> &direction, const Planes<Value> &planes);
    FloatPacket with_ones(FloatPacket distances, const RayGroup &rays, uint32_t first_ray,
                          LaneBits open, const UIntPacket &primitives,
                          Counters &counters) const;
    float of_one(Vec3f direction, uint32_t primitive, Counters &counters) const;

    static constexpr uint32_t SIZE = 64;

    const KdTree &tree_;
    Vec3f origin_;
    std::array<std::optional<Plane>, SIZE> planes_;
};

} // namespace mlrt
