#include "traverse/wide_packets.h"

#include "base/block_order.h"
#include "geometry/block_forms.h"
#include "geometry/triangle_test.h"
#include "traverse/parameter_interval.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace mlrt {

namespace {

// Of a slope: two roundings of its own and those of the differences it is compared with.
constexpr float WIDEN_SLOPE = 8 * FLOAT_ROUNDOFF;
constexpr float LEAST_SLOPE = 0x1p-120f;

constexpr float WIDEN_DEPTH = 8 * FLOAT_ROUNDOFF;
constexpr float LEAST_DEPTH = 0x1p-120f;
constexpr float SMALLEST_DISTANCE = 0x1p-125f;

template <Query QUERY>
class PacketWalk {
public:
    void start(const WideTree &tree, const Triangle *triangles, const WidePacket &packet,
               uint32_t number) {
        number_ = number;
        triangles_ = triangles;
        rays_ = packet.rays;
        searching_ = rays_.active;
        const Vec3f o = rays_.origin.point;
        axes_ = {packet.main_axis == 0 ? 1 : 0, packet.main_axis == 2 ? 1 : 2,
                 int(packet.main_axis)};
        side_ = packet.side;
        const int k = axes_[2];
        for (size_t n = 0; n < 3; ++n)
            origin_[n] = FloatBlock(o[axes_[n]]);
        const FloatPacket reciprocal = rays_.reciprocal[k];
        const auto active = from_bits<FloatPacket>(searching_);
        octant_ = side_ < 0 ? 1u << k : 0u;
        slopes_ = 1;
        for (size_t n = 0; n < 2; ++n) {
            const FloatPacket shear = rays_.direction[axes_[n]] * reciprocal;
            store(shears_[n].data(), shear);
            const FloatPacket slope = shear * side_;
            float lo = least_lane(select(active, slope, FloatPacket(INFINITE)));
            float hi = greatest_lane(select(active, slope, FloatPacket(-INFINITE)));
            octant_ |= uint32_t(lo + hi < 0) << axes_[n];
            extent_[n] = hi - lo;
            lo -= std::abs(lo) * WIDEN_SLOPE + LEAST_SLOPE;
            hi += std::abs(hi) * WIDEN_SLOPE + LEAST_SLOPE;
            slopes_ += std::max(std::abs(lo), std::abs(hi));
            lo_rising_[n] = FloatBlock(-std::max(lo, 0.0f));
            lo_falling_[n] = FloatBlock(-std::min(lo, 0.0f));
            hi_rising_[n] = FloatBlock(-std::max(hi, 0.0f));
            hi_falling_[n] = FloatBlock(-std::min(hi, 0.0f));
        }
        for (int n = 0; n < 3; ++n)
            negative_[size_t(n)] = to_bits(rays_.reciprocal[n] < 0.0f);
        search_from_ = rays_.t_min * WIDEN_NEAR;
        search_end_ = to_lanes<float>(rays_.t_max * WIDEN_FAR + SMALLEST_FLOAT);
        const FloatPacket size = absolute(rays_.direction[k]);
        begin_ = to_lanes<float>(maximum(rays_.t_min, FloatPacket(SMALLEST_DISTANCE)) *
                                     size * (1 + WIDEN_DEPTH) +
                                 LEAST_DEPTH);
        const FloatPacket end = rays_.t_max * size;
        best_from_ = to_lanes<float>(end * (1 - WIDEN_DEPTH) - LEAST_DEPTH);
        best_to_ = to_lanes<float>(end * (1 + WIDEN_DEPTH) + LEAST_DEPTH);
        best_.fill(NO_PRIMITIVE);
        update_end();
        pending_ = 1;
        nears_[0] = 0;
        children_[0] = tree.root.bits();
        places_[0] = TESTED;
        lanes_[0] = searching_;
    }

    bool next(const WideTree &tree) {
        for (;;) {
            if (pending_ == 0)
                return false;
            --pending_;
            const float near = nears_[pending_];
            entered_ = lanes_[pending_] & searching_;
            if (entered_ == 0 || !(near <= far_))
                continue;
            next_ = WideChild::from_bits(children_[pending_]);
            const uint32_t place = places_[pending_];
            if (place != TESTED) {
                entered_ &= entering(tree.nodes[place / WideNode::WIDTH],
                                     place % WideNode::WIDTH);
                if (entered_ == 0)
                    continue;
            }
            if (next_.is_block())
                prefetch(&tree.blocks[next_.index()]);
            else
                prefetch(&tree.nodes[next_.index()]);
            return true;
        }
    }
    bool is_at_block() const { return next_.is_block(); }

    void visit_node(const WideTree &tree) {
        const WideNode &node = tree.nodes[next_.index()];
        if (std::popcount(entered_) <= FEW)
            for_each_lane(entered_, [&](uint32_t lane) { visit_for_one(node, lane); });
        else
            visit_for_all(node);
    }

    void visit_block(const WideTree &tree, Counters &counters) {
        const WideBlock &block = tree.blocks[next_.index()];
        const BlockForms forms(block.coordinates, axes_, origin_, slopes_);
        const LaneBits there = to_bits(load<UIntBlock>(block.numbers.data()) !=
                                       UIntBlock(NO_PRIMITIVE));
        LaneBits changed = 0;
        counters.triangle_tests +=
            uint64_t(std::popcount(there) * std::popcount(entered_));
        for_each_lane(entered_, [&](uint32_t ray) {
            const BlockForms::Seen seen =
                forms.seen_by(shears_[0][ray], shears_[1][ray], side_);
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
                if (nearest[lane] > best_to_[ray] || primitive == best_[ray])
                    return;
                if ((seen.certain >> lane & 1) && nearest[lane] > begin_[ray] &&
                    farthest[lane] < best_from_[ray]) {
                    best_[ray] = primitive;
                    best_from_[ray] = nearest[lane];
                    best_to_[ray] = farthest[lane];
                    changed |= 1u << ray;
                } else if (decide(ray, block.triangle(lane), primitive,
                                  seen.certain >> lane & 1, counters)) {
                    changed |= 1u << ray;
                }
            });
        });
        if (changed == 0)
            return;
        if constexpr (QUERY == Query::any) {
            searching_ &= ~changed;
            if (searching_ == 0) {
                pending_ = 0;
                return;
            }
        }
        for_each_lane(changed, [&](uint32_t ray) {
            search_end_[ray] = best_to_[ray] * std::abs(rays_.reciprocal[axes_[2]].entry(ray)) * (1+WIDEN_DEPTH) +
                               SMALLEST_FLOAT;
        });
        update_end();
    }

    uint32_t number() const { return number_; }
    WideHits hits() const {
        WideHits hits;
        hits.primitive = load<UIntPacket>(best_);
        hits.found = to_bits(hits.primitive != UIntPacket(NO_PRIMITIVE)) & rays_.active;
        return hits;
    }
    LaneBits entered() const { return entered_; }

private:
    void visit_for_all(const WideNode &node) {
        const auto face = [&](size_t n, bool upper) -> FloatBlock {
            return load<FloatBlock>(node.faces[size_t(axes_[n] + 3 * upper)].data()) -
                   origin_[n];
        };
        const FloatBlock z_lo = maximum(face(2, side_ < 0) * side_, FloatBlock(0.0f)),
                         z_hi = face(2, side_ > 0) * side_;
        auto entered = (z_lo <= z_hi) & (z_lo <= FloatBlock(far_));
        const auto children = load<UIntBlock>(node.children.data());
        MaskOf<FloatBlock> small = (children & UIntBlock(1u << 31)) != UIntBlock(0u);
        for (size_t n = 0; n < 2; ++n) {
            const FloatBlock lo = face(n, false), hi = face(n, true);
            entered &=
                fused(lo_rising_[n], z_lo, fused(lo_falling_[n], z_hi, hi)) >= 0.0f;
            entered &=
                fused(hi_rising_[n], z_hi, fused(hi_falling_[n], z_lo, lo)) <= 0.0f;
            small |= (hi - lo) < z_lo * (extent_[n] * SMALL);
        }
        const UIntBlock order = four_bits_each(node.back_to_front[octant_]);
        const FloatBlock key = permuted(select(entered, z_lo, FloatBlock(-1.0f)), order);
        const LaneBits lanes = to_bits(key >= 0.0f);
        const UIntBlock places = select(MaskOf<UIntBlock>(small),
            drjit::arange<UIntBlock>() | (next_.index() * WideNode::WIDTH), UIntBlock(TESTED));
        push(key, permuted(children, order), permuted(places, order), lanes, entered_);
    }

    void push(const FloatBlock &near, const UIntBlock &children, const UIntBlock &places,
              LaneBits which, LaneBits lanes) {
        store_compressed(&nears_[pending_], near, which);
        store_compressed(&children_[pending_], children, which);
        store_compressed(&places_[pending_], places, which);
        store(&lanes_[pending_], UIntBlock(lanes));
        pending_ += uint32_t(std::popcount(which));
    }

    void visit_for_one(const WideNode &node, uint32_t lane) {
        FloatBlock near(search_from_.entry(lane)), far(search_end_[lane]);
        uint32_t octant = 0;
        for (int k = 0; k < 3; ++k) {
            const FloatBlock o(rays_.origin.point[k]);
            const FloatBlock reciprocal(rays_.reciprocal[k].entry(lane));
            const uint32_t negative = negative_[size_t(k)] >> lane & 1;
            octant |= negative << k;
            const uint32_t first = uint32_t(k) + 3 * negative,
                           last = 2 * uint32_t(k) + 3 - first;
            const auto parameter = [&](uint32_t face) {
                return (load<FloatBlock>(node.faces[face].data()) - o) * reciprocal;
            };
            near = maximum(parameter(first), near);
            far = minimum(parameter(last), far);
        }
        near = near * WIDEN_NEAR - TINY_PARAMETER;
        far = far * WIDEN_FAR + TINY_PARAMETER;
        const UIntBlock order = four_bits_each(node.back_to_front[octant]);
        near = permuted(near, order);
        const LaneBits entered = to_bits(near <= permuted(far, order));
        const float size = std::abs(rays_.direction[axes_[2]].entry(lane));
        push(near * (size * (1 - WIDEN_DEPTH)) - LEAST_DEPTH, permuted(load<UIntBlock>(node.children.data()), order),
             UIntBlock(TESTED), entered, 1u << lane);
    }

    LaneBits entering(const WideNode &node, uint32_t child) const {
        FloatPacket near = search_from_, far = load<FloatPacket>(search_end_);
        for (int k = 0; k < 3; ++k) {
            const FloatPacket o(rays_.origin.point[k]);
            const FloatPacket lo =
                (FloatPacket(node.faces[size_t(k)][child]) - o) * rays_.reciprocal[k];
            const FloatPacket hi =
                (FloatPacket(node.faces[size_t(k) + 3][child]) - o) * rays_.reciprocal[k];
            const auto negative = from_bits<FloatPacket>(negative_[size_t(k)]);
            near = maximum(select(negative, hi, lo), near);
            far = minimum(select(negative, lo, hi), far);
        }
        near = near * WIDEN_NEAR - TINY_PARAMETER;
        far = far * WIDEN_FAR + TINY_PARAMETER;
        return to_bits(near <= far) & searching_;
    }

    void update_end() {
        far_ = greatest_lane(select(from_bits<FloatPacket>(searching_),
                                    load<FloatPacket>(best_to_), FloatPacket(0.0f)));
    }

    // By the contract of triangle_test.h.
    bool decide(uint32_t ray, const Triangle &triangle, uint32_t primitive,
                bool certainly_hit, Counters &counters) {
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
            const float best = hit_distance(o, d, triangles_[rival]);
            if (t > best || (t == best && primitive > rival))
                return false;
        }
        const double size = std::abs(d[axes_[2]]);
        best_[ray] = primitive;
        best_from_[ray] =
            float((double(t) - double(SMALLEST_FLOAT)) * size * (1 - 0x1p-21)) - LEAST_DEPTH;
        best_to_[ray] =
            float((double(t) + double(SMALLEST_FLOAT)) * size * (1 + 0x1p-21)) + LEAST_DEPTH;
        return true;
    }

    const Triangle *triangles_;
    RayPacket<CommonOrigin> rays_;
    FloatPacket search_from_;
    // Of each ray: the parameter at which its search ends; the depths from which on hits
    // count; and bounds of the depth of its best hit, or of its end.
    LaneArray<float> search_end_, begin_, best_from_, best_to_, shears_[2];
    LaneArray<uint32_t> best_;
    std::array<FloatBlock, 2> lo_rising_, lo_falling_, hi_rising_, hi_falling_;
    std::array<FloatBlock, 3> origin_;
    std::array<int, 3> axes_;
    std::array<LaneBits, 3> negative_;
    std::array<float, 2> extent_;
    float side_, far_, slopes_;
    LaneBits searching_, entered_;
    uint32_t octant_, number_;
    WideChild next_;
    uint32_t pending_;
    static constexpr int FEW = 2;
    static constexpr float SMALL = 1;
    static constexpr uint32_t TESTED = ~0u;
    static constexpr uint32_t STACK =
        (WideNode::WIDTH - 1) * MAX_WIDE_DEPTH + FEW * WideNode::WIDTH + 1;
    // Whole blocks are written.
    std::array<float, STACK + BLOCK_WIDTH> nears_;
    std::array<uint32_t, STACK + BLOCK_WIDTH> children_, places_, lanes_;
};

template <Query QUERY>
void trace(const WideTree &tree, const Triangle *triangles, std::span<const WidePacket> packets, WideHits *hits,
           Counters &counters) {
    constexpr size_t AT_ONCE = 8;
    using Walk = PacketWalk<QUERY>;
    std::array<Walk, AT_ONCE> walks;
    std::array<Walk *, AT_ONCE> running;
    size_t count = 0;
    uint32_t started = 0;
    while (count < AT_ONCE && started < packets.size()) {
        running[count] = &walks[count];
        running[count++]->start(tree, triangles, packets[started], started);
        ++started;
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
            hits[walk.number()] = walk.hits();
            if (QUERY == Query::closest)
                for_each_lane(hits[walk.number()].found, [&](uint32_t lane) {
                    prefetch(&triangles[hits[walk.number()].primitive.entry(lane)]);
                });
            if (started < packets.size()) {
                walk.start(tree, triangles, packets[started], started);
                ++started;
            } else {
                running[i] = running[--count];
            }
        }
        for (size_t i = 0; i < nodes; ++i)
            at_node[i]->visit_node(tree);
        for (size_t i = 0; i < blocks; ++i) {
            counters.frontier_tests += uint64_t(std::popcount(at_block[i]->entered()));
            at_block[i]->visit_block(tree, counters);
        }
        counters.traversal_steps += nodes + blocks;
        counters.leaf_visits += blocks;
    }
}

} // namespace

LaneBits WidePacket::choose_axis(LaneBits lanes) {
    const uint32_t n = uint32_t(std::popcount(lanes));
    LaneBits left = lanes;
    for (uint32_t i = 0; i < n / 2; ++i)
        left &= left - 1;
    const Vec3f d = rays.lane_direction(uint32_t(std::countr_zero(left)));
    const Vec3f size = abs(d);
    main_axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    side = d[int(main_axis)] > 0 ? 1.0f : -1.0f;
    const FloatPacket main = rays.direction[int(main_axis)] * side;
    auto along = main > 0.0f;
    for (int k = 0; k < 3; ++k)
        along &= absolute(rays.direction[k]) <= main;
    return to_bits(along) & lanes;
}

void trace_wide_packets(const WideTree &tree, const Triangle *triangles, std::span<const WidePacket> packets,
                        Query query, WideHits *hits, Counters &counters) {
    if (query == Query::any)
        trace<Query::any>(tree, triangles, packets, hits, counters);
    else
        trace<Query::closest>(tree, triangles, packets, hits, counters);
}

} // namespace mlrt
