#include "traverse/wide_packets.h"

#include "base/block_order.h"
#include "geometry/block_forms.h"
#include "geometry/triangle_test.h"
#include "traverse/packet_frustum.h"
#include "traverse/parameter_interval.h"

#include <array>
#include <bit>
#include <cmath>

namespace mlrt {

namespace {

// Of a depth t |d_k|: the rounding of a distance to float, that of the product, and those
// of what follows.
constexpr float WIDEN_DEPTH = 8 * FLOAT_ROUNDOFF;
// More than what underflow may take from a depth.
constexpr float LEAST_DEPTH = 0x1p-120f;
// Distances below it may be denormal, and then equal where depths differ.
constexpr float SMALLEST_DISTANCE = 0x1p-125f;

// A packet on its way through the tree: what waits to be visited is on a stack, the nearest
// on top.
//
// Bounds of the depth of a ray's best hit are enough to tell which one is nearer, but for
// few: distances are computed for those only.
template <Query QUERY>
class PacketWalk {
public:
    void start(const WideTree &tree, const WidePacket &packet, uint32_t number) {
        number_ = number;
        rays_ = packet.rays;
        searching_ = rays_.active;
        frustum_ = PacketFrustum(rays_, packet.main_axis, packet.side);
        main_axis_ = packet.main_axis;
        for (size_t n = 0; n < 2; ++n)
            slopes_[n] = to_lanes<float>(frustum_.slopes[n]);
        for (int k = 0; k < 3; ++k)
            negative_[size_t(k)] = to_bits(rays_.reciprocal[k] < 0.0f);
        search_from_ = rays_.t_min * WIDEN_NEAR;
        search_end_ = to_lanes<float>(latest_distance(rays_.t_max));
        const FloatPacket size = absolute(rays_.direction[main_axis_]);
        begin_ = to_lanes<float>(maximum(rays_.t_min, FloatPacket(SMALLEST_DISTANCE)) *
                                     size * (1 + WIDEN_DEPTH) +
                                 LEAST_DEPTH);
        const FloatPacket end = rays_.t_max * size;
        best_from_ = to_lanes<float>(end * (1 - WIDEN_DEPTH) - LEAST_DEPTH);
        best_to_ = to_lanes<float>(end * (1 + WIDEN_DEPTH) + LEAST_DEPTH);
        best_.fill(NO_PRIMITIVE);
        update_end();
        pending_ = 1;
        nearest_[0] = 0;
        children_[0] = tree.root.bits();
        parents_[0] = TESTED;
        lanes_[0] = searching_;
    }

    // Takes what is to be visited next, and asks for its memory. Returns whether there is
    // anything.
    bool next(const WideTree &tree) {
        while (pending_ > 0) {
            --pending_;
            const uint32_t lanes = lanes_[pending_];
            entered_ = lanes & searching_;
            if (entered_ == 0 || !(nearest_[pending_] <= far_))
                continue;
            if (const uint32_t parent = parents_[pending_]; parent != TESTED) {
                entered_ &= entering(tree.nodes[parent], lanes >> PACKET_WIDTH);
                if (entered_ == 0)
                    continue;
            }
            next_ = WideChild::from_bits(children_[pending_]);
            if (next_.is_block())
                prefetch(&tree.blocks[next_.index()]);
            else
                prefetch(&tree.nodes[next_.index()]);
            return true;
        }
        return false;
    }
    bool is_at_block() const { return next_.is_block(); }

    // Puts those children on the stack that rays may enter.
    void visit_node(const WideTree &tree) {
        const WideNode &node = tree.nodes[next_.index()];
        if (std::popcount(entered_) > FEW)
            visit_for_all(node);
        else
            for_each_lane(entered_, [&](uint32_t lane) { visit_for_one(node, lane); });
    }

    void visit_block(const WideTree &tree, const Triangle *triangles, Counters &counters) {
        const WideBlock &block = tree.blocks[next_.index()];
        const BlockForms forms(block.coordinates, frustum_.axes, frustum_.origin,
                               frustum_.greatest_sum);
        const LaneBits there =
            to_bits(load<UIntBlock>(block.numbers.data()) != UIntBlock(NO_PRIMITIVE));
        counters.triangle_tests +=
            uint64_t(std::popcount(there)) * uint64_t(std::popcount(entered_));
        LaneBits changed = 0;
        for_each_lane(entered_, [&](uint32_t ray) {
            const BlockForms::Seen seen =
                forms.seen_by(slopes_[0][ray], slopes_[1][ray], frustum_.side);
            LaneBits possible = there & seen.possible;
            if (possible == 0)
                return;
            possible &= ~to_bits((seen.nearest > best_to_[ray]) | (seen.farthest < 0.0f));
            if (possible == 0)
                return;
            std::array<float, BLOCK_WIDTH> nearest, farthest;
            store(nearest.data(), seen.nearest);
            store(farthest.data(), seen.farthest);
            for_each_lane(possible, [&](uint32_t lane) {
                const uint32_t primitive = block.numbers[lane];
                // Of large triangles many blocks have a copy.
                if (primitive == best_[ray] || nearest[lane] > best_to_[ray])
                    return;
                const bool certain = seen.certain >> lane & 1;
                if (certain && nearest[lane] > begin_[ray] &&
                    farthest[lane] < best_from_[ray]) {
                    best_[ray] = primitive;
                    best_from_[ray] = nearest[lane];
                    best_to_[ray] = farthest[lane];
                    changed |= 1u << ray;
                } else if (decide(ray, block.triangle(lane), primitive, certain, triangles,
                                  counters)) {
                    changed |= 1u << ray;
                }
            });
        });
        if (changed != 0)
            learn(changed);
    }

    uint32_t number() const { return number_; }
    WideHits hits() const {
        const auto primitive = load<UIntPacket>(best_);
        return {primitive, to_bits(primitive != UIntPacket(NO_PRIMITIVE)) & rays_.active};
    }

private:
    // In place of a parent, where it is known which rays may enter.
    static constexpr uint32_t TESTED = ~0u;

    // As many rays, or fewer, enter children one by one; chosen.
    static constexpr int FEW = 2;

    // Children that all of the rays may enter, as far as the frustum tells.
    void visit_for_all(const WideNode &node) {
        const PacketFrustum::Boxes boxes = frustum_.boxes_of(node, far_);
        const UIntBlock order = four_bits_each(node.back_to_front[frustum_.octant]);
        const FloatBlock nearest =
            permuted(select(boxes.entered, boxes.nearest, FloatBlock(-1.0f)), order);
        const UIntBlock parents =
            select(MaskOf<UIntBlock>(boxes.narrow) | node.are_blocks(),
                   UIntBlock(next_.index()), UIntBlock(TESTED));
        push(node, order, nearest, permuted(parents, order), to_bits(nearest >= 0.0f),
             entered_);
    }

    // As visit_node() in wide.cpp.
    void visit_for_one(const WideNode &node, uint32_t lane) {
        FloatBlock near(search_from_.entry(lane)), far(search_end_[lane]);
        uint32_t octant = 0;
        for (uint32_t k = 0; k < 3; ++k) {
            const FloatBlock o(rays_.origin.point[int(k)]);
            const FloatBlock reciprocal(rays_.reciprocal[int(k)].entry(lane));
            const uint32_t negative = negative_[k] >> lane & 1;
            octant |= negative << k;
            const uint32_t first = k + 3 * negative, last = 2 * k + 3 - first;
            const auto parameter = [&](uint32_t face) {
                return (load<FloatBlock>(node.faces[face].data()) - o) * reciprocal;
            };
            // Where it is not a number it shortens nothing.
            near = maximum(parameter(first), near);
            far = minimum(parameter(last), far);
        }
        near = near * WIDEN_NEAR - TINY_PARAMETER;
        far = far * WIDEN_FAR + TINY_PARAMETER;
        const UIntBlock order = four_bits_each(node.back_to_front[octant]);
        near = permuted(near, order);
        const float size = std::abs(rays_.direction[main_axis_].entry(lane));
        push(node, order, near * (size * (1 - WIDEN_DEPTH)) - LEAST_DEPTH,
             UIntBlock(TESTED), to_bits(near <= permuted(far, order)), 1u << lane);
    }

    // Puts those of a node's children on the stack, in the given order.
    void push(const WideNode &node, const UIntBlock &order, const FloatBlock &nearest,
              const UIntBlock &parents, LaneBits which, LaneBits lanes) {
        store_compressed(&nearest_[pending_], nearest, which);
        store_compressed(&children_[pending_],
                         permuted(load<UIntBlock>(node.children.data()), order), which);
        store_compressed(&parents_[pending_], parents, which);
        store_compressed(&lanes_[pending_],
                         ((order & 7u) << PACKET_WIDTH) | UIntBlock(lanes), which);
        pending_ += uint32_t(std::popcount(which));
    }

    // Rays that enter a child, by their intervals.
    LaneBits entering(const WideNode &node, uint32_t child) const {
        FloatPacket near = search_from_, far = load<FloatPacket>(search_end_);
        for (uint32_t k = 0; k < 3; ++k) {
            const auto parameter = [&](uint32_t face) {
                return FloatPacket(node.faces[face][child] - rays_.origin.point[int(k)]) *
                       rays_.reciprocal[int(k)];
            };
            const FloatPacket lo = parameter(k), hi = parameter(k + 3);
            const auto negative = from_bits<FloatPacket>(negative_[k]);
            near = maximum(select(negative, hi, lo), near);
            far = minimum(select(negative, lo, hi), far);
        }
        near = near * WIDEN_NEAR - TINY_PARAMETER;
        far = far * WIDEN_FAR + TINY_PARAMETER;
        return to_bits(near <= far);
    }

    // By the contract of triangle_test.h. Returns whether it is the best hit now.
    bool decide(uint32_t ray, const Triangle &triangle, uint32_t primitive,
                bool certainly_hit, const Triangle *triangles, Counters &counters) {
        const Vec3f o = rays_.origin.point, d = rays_.lane_direction(ray);
        if (!certainly_hit) {
            const HitDecision decision = decide_hit(o, d, triangle);
            ++counters.double_tests;
            counters.exact_tests += decision.precision == Precision::exact;
            if (!decision.hit)
                return false;
        }
        const float t = hit_distance(o, d, triangle);
        if (!(t > rays_.t_min.entry(ray) && t < INFINITE))
            return false;
        if (const uint32_t rival = best_[ray]; rival == NO_PRIMITIVE) {
            if (t > rays_.t_max.entry(ray))
                return false;
        } else {
            const float best = hit_distance(o, d, triangles[rival]);
            if (t > best || (t == best && primitive > rival))
                return false;
        }
        // In double, where a denormal distance is as far off as others.
        const double size = std::abs(d[main_axis_]), least = double(SMALLEST_FLOAT);
        best_[ray] = primitive;
        best_from_[ray] = float((t - least) * size * (1 - 0x1p-21)) - LEAST_DEPTH;
        best_to_[ray] = float((t + least) * size * (1 + 0x1p-21)) + LEAST_DEPTH;
        return true;
    }

    // After some rays have found something.
    void learn(LaneBits changed) {
        if constexpr (QUERY == Query::any) {
            searching_ &= ~changed;
            if (searching_ == 0)
                pending_ = 0;
        } else {
            for_each_lane(changed, [&](uint32_t ray) {
                const float to_distance = std::abs(rays_.reciprocal[main_axis_].entry(ray));
                search_end_[ray] = latest_distance(best_to_[ray] * to_distance) * WIDEN_FAR;
            });
        }
        update_end();
    }

    void update_end() {
        far_ = greatest_lane(select(from_bits<FloatPacket>(searching_),
                                    load<FloatPacket>(best_to_), FloatPacket(0.0f)));
    }

    RayPacket<CommonOrigin> rays_;
    PacketFrustum frustum_;
    FloatPacket search_from_;
    // Of each ray: the parameter at which its search ends; the depth from which on hits
    // count for certain; bounds of the depth of its best hit or, without one, of its end.
    LaneArray<float> search_end_, begin_, best_from_, best_to_;
    LaneArray<uint32_t> best_;
    std::array<LaneArray<float>, 2> slopes_;
    std::array<LaneBits, 3> negative_; // directions, by axis
    int main_axis_;
    float far_; // no greater depth is of interest
    LaneBits searching_, entered_;
    uint32_t number_;
    WideChild next_;
    uint32_t pending_;
    // A ray leaves the others once on its way down.
    static constexpr uint32_t STACK =
        (WideNode::WIDTH - 1) * MAX_WIDE_DEPTH + FEW * WideNode::WIDTH + 1;
    // Whole blocks are written.
    std::array<float, STACK + BLOCK_WIDTH> nearest_; // least depths
    std::array<uint32_t, STACK + BLOCK_WIDTH> children_, parents_;
    std::array<uint32_t, STACK + BLOCK_WIDTH> lanes_; // and number of the child, above
};

template <Query QUERY>
void trace(const WideTree &tree, const Triangle *triangles,
           std::span<const WidePacket> packets, WideHits *hits, Counters &counters) {
    constexpr size_t AT_ONCE = 8; // chosen from 8 and 16 by rays in dragon
    using Walk = PacketWalk<QUERY>;
    std::array<Walk, AT_ONCE> walks;
    std::array<Walk *, AT_ONCE> running;
    size_t count = 0;
    uint32_t started = 0;
    const auto start = [&](Walk &walk) {
        walk.start(tree, packets[started], started);
        ++started;
    };
    while (count < AT_ONCE && started < packets.size()) {
        running[count] = &walks[count];
        start(*running[count++]);
    }
    while (count > 0) {
        std::array<Walk *, AT_ONCE> at_node, at_block;
        size_t nodes = 0, blocks = 0;
        for (size_t i = 0; i < count;) {
            Walk &walk = *running[i];
            if (walk.next(tree)) {
                (walk.is_at_block() ? at_block[blocks++] : at_node[nodes++]) = &walk;
                ++i;
                continue;
            }
            const WideHits &found = hits[walk.number()] = walk.hits();
            // Their distances are computed soon.
            if constexpr (QUERY == Query::closest) {
                const LaneArray<uint32_t> primitives = to_lanes<uint32_t>(found.primitive);
                for_each_lane(found.found, [&](uint32_t lane) {
                    prefetch(&triangles[primitives[lane]]);
                });
            }
            if (started < packets.size())
                start(walk);
            else
                running[i] = running[--count];
        }
        for (size_t i = 0; i < nodes; ++i)
            at_node[i]->visit_node(tree);
        for (size_t i = 0; i < blocks; ++i)
            at_block[i]->visit_block(tree, triangles, counters);
        counters.traversal_steps += nodes + blocks;
        counters.leaf_visits += blocks;
    }
}

} // namespace

LaneBits WidePacket::choose_axis(LaneBits lanes) {
    LaneBits left = lanes;
    for (int i = std::popcount(lanes) / 2; i > 0; --i)
        left &= left - 1;
    const Vec3f d = rays.lane_direction(uint32_t(std::countr_zero(left)));
    const Vec3f size = abs(d);
    main_axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    side = d[main_axis] > 0 ? 1.0f : -1.0f;
    const FloatPacket along = rays.direction[main_axis] * side;
    MaskOf<FloatPacket> with = along > 0.0f;
    for (int k = 0; k < 3; ++k)
        with &= absolute(rays.direction[k]) <= along;
    return to_bits(with) & lanes;
}

void trace_wide_packets(const WideTree &tree, const Triangle *triangles,
                        std::span<const WidePacket> packets, Query query, WideHits *hits,
                        Counters &counters) {
    if (query == Query::any)
        trace<Query::any>(tree, triangles, packets, hits, counters);
    else
        trace<Query::closest>(tree, triangles, packets, hits, counters);
}

} // namespace mlrt
