#include "traverse/wide_rays.h"

#include "base/partial_packets.h"
#include "base/transpose.h"
#include "kdtree/wide_tree.h"

#include <bit>
#include <cstddef>
#include <cstring>

namespace mlrt {

namespace {

template <typename Value>
Value pick(const MaskOf<FloatPacket> &mask, const Value &yes, const Value &no) {
    return select(MaskOf<Value>(mask), yes, no);
}

// Sixteen rays, word by word.
class Columns {
public:
    // Takes a member of WideRay, or word number `word` of it.
    void set(size_t member, const FloatPacket &values, size_t word = 0) {
        store(words_[member / WORD + word].data(), values);
    }
    void set(size_t member, const UIntPacket &values, size_t word = 0) {
        const LaneArray<uint32_t> bits = to_lanes<uint32_t>(values);
        std::memcpy(words_[member / WORD + word].data(), bits.data(), sizeof(bits));
    }

    // Writes the given lanes one after the other.
    void copy(LaneBits lanes, WideRay *to) const {
        std::array<WideRay *, PACKET_WIDTH> rays;
        for_each_lane(lanes, [&](uint32_t lane) { rays[lane] = to++; });
        for (uint32_t half = 0; half < PACKET_WIDTH; half += BLOCK_WIDTH)
            for (uint32_t word = 0; word < WORDS; word += BLOCK_WIDTH) {
                std::array<const float *, BLOCK_WIDTH> rows;
                for (uint32_t i = 0; i < BLOCK_WIDTH; ++i)
                    rows[i] = words_[word + i].data() + half;
                const std::array<FloatBlock, 8> columns = load_columns(rows);
                for (uint32_t i = 0; i < BLOCK_WIDTH; ++i)
                    if (lanes >> (half + i) & 1)
                        std::memcpy(reinterpret_cast<std::byte *>(rays[half + i]) +
                                        word * WORD,
                                    &columns[i], sizeof(FloatBlock));
            }
    }

private:
    static constexpr size_t WORD = sizeof(float);
    static constexpr uint32_t WORDS = sizeof(WideRay) / WORD;

    std::array<LaneArray<float>, WORDS> words_;
};

void set_boxes(Columns &columns, const RayPacket<LaneOrigins> &rays) {
    UIntPacket octant(0u);
    for (uint32_t k = 0; k < 3; ++k) {
        columns.set(offsetof(WideRay, origin), rays.origin.point[int(k)], k);
        const FloatPacket &reciprocal = rays.reciprocal[int(k)];
        columns.set(offsetof(WideRay, enter), reciprocal * WIDEN_NEAR, k);
        columns.set(offsetof(WideRay, leave), reciprocal * WIDEN_FAR, k);
        const auto negative = reciprocal < 0.0f;
        constexpr uint32_t FACE = sizeof(WideNode{}.faces[0]);
        const auto faces = [](uint32_t first, uint32_t last) {
            return UIntPacket(
                std::bit_cast<uint32_t>(WideRay::Faces{uint16_t(first), uint16_t(last)}));
        };
        const uint32_t lower = k * FACE, upper = (k + 3) * FACE;
        columns.set(offsetof(WideRay, faces),
                    pick(negative, faces(upper, lower), faces(lower, upper)), k);
        octant |= pick(negative, UIntPacket(1u << k), UIntPacket(0u));
    }
    columns.set(offsetof(WideRay, octant), octant);
    columns.set(offsetof(WideRay, search_from), rays.t_min * WIDEN_NEAR);
    columns.set(offsetof(WideRay, search_end),
                latest_distance(rays.t_max) + 2 * TINY_PARAMETER);
}

void set_triangles(Columns &columns, const RayPacket<LaneOrigins> &rays) {
    const Vec3<FloatPacket> &o = rays.origin.point, &d = rays.direction;
    const FloatPacket size_x = absolute(d.x), size_y = absolute(d.y),
                      size_z = absolute(d.z);
    const auto is_x = (size_x > size_y) & (size_x > size_z);
    const auto is_z = ~is_x & ~(size_y > size_z);
    const auto of_axes = [&](const auto &if_x, const auto &if_y, const auto &if_z) {
        return pick(is_x, if_x, pick(is_z, if_z, if_y));
    };
    const auto axes = [](uint8_t first, uint8_t second, uint8_t third) {
        return UIntPacket(
            std::bit_cast<uint32_t>(std::array<uint8_t, 4>{first, second, third, 0}));
    };
    columns.set(offsetof(WideRay, axes),
                of_axes(axes(1, 2, 0), axes(0, 2, 1), axes(0, 1, 2)));
    columns.set(offsetof(WideRay, ordered_origin), of_axes(o.y, o.x, o.x), 0);
    columns.set(offsetof(WideRay, ordered_origin), of_axes(o.z, o.z, o.y), 1);
    columns.set(offsetof(WideRay, ordered_origin), of_axes(o.x, o.y, o.z), 2);

    const FloatPacket along = of_axes(d.x, d.y, d.z), size = absolute(along);
    columns.set(offsetof(WideRay, slopes), of_axes(d.y, d.x, d.x) / size, 0);
    columns.set(offsetof(WideRay, slopes), of_axes(d.z, d.z, d.y) / size, 1);
    columns.set(offsetof(WideRay, side), copy_sign(FloatPacket(1.0f), along));
    columns.set(offsetof(WideRay, size), size);
    columns.set(offsetof(WideRay, per_size), 1.0f / size);

    columns.set(offsetof(WideRay, before), last_depth_before(rays.t_min, size));
    columns.set(offsetof(WideRay, begin), first_certain_depth(rays.t_min, size));
    constexpr size_t BEST = offsetof(WideRay, best);
    columns.set(BEST + offsetof(DepthHit, primitive), UIntPacket(NO_PRIMITIVE));
    columns.set(BEST + offsetof(DepthHit, distance), FloatPacket(UNKNOWN_DISTANCE));
    columns.set(BEST + offsetof(DepthHit, from), least_depth_of_end(rays.t_max, size));
    columns.set(BEST + offsetof(DepthHit, to), greatest_depth_of_end(rays.t_max, size));
}

} // namespace

void WideRays::add(const RayPacket<LaneOrigins> &rays, LaneBits lanes, uint32_t first) {
    const auto keep = [&](auto &values, const auto &packet) {
        store_compressed(&values[count], packet, lanes);
    };
    for (int k = 0; k < 3; ++k) {
        keep(origin[k], rays.origin.point[k]);
        keep(direction[k], rays.direction[k]);
    }
    keep(t_min, rays.t_min);
    keep(t_max, rays.t_max);
    keep(number, UIntPacket(first) + lane_indices());

    Columns columns;
    set_boxes(columns, rays);
    set_triangles(columns, rays);
    columns.set(offsetof(WideRay, number), UIntPacket(0u)); // by lane
    columns.copy(lanes, &beginning[count]);
    for_each_lane(lanes, [&](uint32_t) {
        beginning[count].number = count;
        ++count;
    });
}

} // namespace mlrt
