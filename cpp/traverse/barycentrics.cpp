#include "traverse/barycentrics.h"

#include "base/transpose.h"
#include "geometry/packet_barycentrics.h"
#include "traverse/load_packet.h"

#include <array>
#include <bit>

namespace mlrt {

namespace {

Corners<float> corners_of(const Triangle &triangle) {
    return {triangle.a, triangle.b, triangle.c};
}

// A triangle in each lane.
Corners<FloatPacket> corners_of(const KdTree &tree, const LaneArray<uint32_t> &numbers) {
    std::array<const float *, PACKET_WIDTH> rows;
    LaneArray<float> last;
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
        const Triangle &triangle = tree.triangles[numbers[lane]];
        rows[lane] = &triangle.a.x;
        last[lane] = triangle.c.z;
    }
    const std::array<FloatPacket, 8> first = load_columns(rows);
    return {{first[0], first[1], first[2]},
            {first[3], first[4], first[5]},
            {first[6], first[7], load<FloatPacket>(last)}};
}

class Barycentrics {
public:
    Barycentrics(const KdTree &tree, const RayGroup &rays) : tree_(tree), rays_(rays) {}

    // Of the rays from `first` on; `primitive` has a triangle in the given lanes, one or
    // more.
    Vec2<FloatPacket> operator()(uint32_t first, const UIntPacket &primitive,
                                 LaneBits lanes) const {
        const uint32_t number = lane_of(primitive, uint32_t(std::countr_zero(lanes)));
        const auto missed = from_bits<UIntPacket>(ALL_LANES & ~lanes);
        const UIntPacket numbers = select(missed, UIntPacket(number), primitive);
        if (to_bits(numbers == number) == ALL_LANES) // as it mostly is
            return with_origin(first, corners_of(tree_.triangles[number]));
        return with_origin(first, corners_of(tree_, to_lanes<uint32_t>(numbers)));
    }

private:
    template <typename Corner>
    Vec2<FloatPacket> with_origin(uint32_t first, const Corners<Corner> &corners) const {
        const Vec3<FloatPacket> direction = vectors(rays_.direction, first);
        if (rays_.has_common_origin)
            return barycentrics_of(rays_.common_origin, direction, corners);
        return barycentrics_of(vectors(rays_.origin, first), direction, corners);
    }

    Vec3<FloatPacket> vectors(const float *const (&components)[3], uint32_t first) const {
        return by_axis(
            [&](int k) { return load_padded(components[k], first, rays_.count); });
    }

    const KdTree &tree_;
    const RayGroup &rays_;
};

} // namespace

void find_barycentrics(const KdTree &tree, const RayGroup &rays, const uint32_t *primitive,
                       float *u, float *v) {
    const Barycentrics barycentrics(tree, rays);
    // Of sixteen rays from `first` on.
    const auto find = [&](uint32_t first, const UIntPacket &numbers) {
        const LaneBits lanes = to_bits(numbers != NO_PRIMITIVE);
        const auto hit = from_bits<FloatPacket>(lanes);
        const Vec2<FloatPacket> uv =
            lanes == 0 ? Vec2<FloatPacket>{} : barycentrics(first, numbers, lanes);
        return Vec2<FloatPacket>{select(hit, uv.x, FloatPacket(0.0f)),
                                 select(hit, uv.y, FloatPacket(0.0f))};
    };
    uint32_t first = 0;
    for (; first + PACKET_WIDTH <= rays.count; first += PACKET_WIDTH) {
        const Vec2<FloatPacket> uv = find(first, load<UIntPacket>(primitive + first));
        store(u + first, uv.x);
        store(v + first, uv.y);
    }
    if (first < rays.count) {
        LaneArray<uint32_t> padded;
        padded.fill(NO_PRIMITIVE);
        std::copy(primitive + first, primitive + rays.count, padded.begin());
        const Vec2<FloatPacket> uv = find(first, load<UIntPacket>(padded));
        std::copy_n(to_lanes<float>(uv.x).begin(), rays.count - first, u + first);
        std::copy_n(to_lanes<float>(uv.y).begin(), rays.count - first, v + first);
    }
}

} // namespace mlrt
