#include "traverse/wide_packets.h"

#include "base/block_order.h"
#include "base/block_pair.h"
#include "geometry/block_volumes.h"
#include "traverse/hit_depth.h"
#include "traverse/packet_frustum.h"
#include "traverse/wide_entry.h"
#include "traverse/wide_scene.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <memory>

namespace mlrt {

namespace {

template <Query QUERY>
class PacketWalk;

// What two rays of a packet may hit of a block: triangles, for the second ray in the upper
// lanes, which of them they certainly hit if the depth is right, and bounds of that.
template <Query QUERY>
struct CandidatesOf {
    LaneArray<float> nearest, farthest;
    PacketWalk<QUERY> *walk;
    std::array<uint32_t, 2> rays;
    LaneBits possible, certain;
};

// A packet on its way through the tree: for each node on the path the children that wait to
// be visited.
//
// Bounds of the depth of a ray's best hit are enough to tell which one is nearer, but for
// few: distances are computed for those only.
template <Query QUERY>
class PacketWalk {
public:
    using Candidates = CandidatesOf<QUERY>;

    // At an entry of its group or, without one, at the root.
    void start(const WideScene &scene, const WidePacket &packet, const WideNode *entry,
               uint32_t number) {
        number_ = number;
        rays_ = &packet.rays;
        searching_ = rays_->active;
        frustum_ = PacketFrustum(*rays_, packet.main_axis, packet.side);
        const FloatPacket size = absolute(rays_->direction[packet.main_axis]);
        begin_ = to_lanes<float>(first_certain_depth(rays_->t_min, size));
        best_from_ = to_lanes<float>(least_depth_of_end(rays_->t_max, size));
        best_to_ = to_lanes<float>(greatest_depth_of_end(rays_->t_max, size));
        best_.fill(NO_PRIMITIVE);
        depth_ = 0;
        entered_ = searching_;
        if (entry) {
            visit(*entry);
            return;
        }
        // As if the root were the only child of a node, which all rays enter.
        Level &level = levels_[0];
        for (size_t n = 0; n < 2; ++n) {
            level.boxes.faces[frustum_.backwards[n]][n][0] = -INFINITE;
            level.boxes.faces[1 - frustum_.backwards[n]][n][0] = INFINITE;
        }
        level.boxes.faces[0][2][0] = 0;
        level.boxes.faces[1][2][0] = INFINITE;
        level.children[0] = scene.root.bits();
        level.back_to_front = 0;
        level.waiting = 1;
        level.lanes = searching_;
        depth_ = 1;
    }

    // Takes a child that waits, one at least, and asks for its memory.
    void take(const WideScene &scene) {
        Level &level = levels_[depth_ - 1];
        const uint32_t place = uint32_t(std::bit_width(level.waiting)) - 1;
        level.waiting ^= 1u << place;
        // What is below the last one takes its place.
        depth_ -= level.waiting == 0;
        const uint32_t child = level.back_to_front >> 4 * place & 7;
        entered_ = level.lanes &
                   frustum_.entering(level.boxes, child, load<FloatPacket>(best_to_));
        next_ = WideChild::from_bits(level.children[child]);
        scene.prefetch_child(next_);
    }
    bool is_at_end() const { return depth_ == 0; }
    // What was taken last: whether rays enter it, and whether it is a block.
    bool is_entered() const { return entered_ != 0; }
    bool is_at_block() const { return next_.is_block(); }

    // Lets those children wait that rays may enter.
    void visit_node(const WideScene &scene) { visit(scene.nodes[next_.index()]); }
    void visit(const WideNode &node) {
        Level &level = levels_[depth_];
        const MaskOf<FloatBlock> entered = frustum_.entered_by(entered_, node, level.boxes);
        level.back_to_front = node.back_to_front[frustum_.middle_octant];
        const FloatBlock is_entered = select(entered, FloatBlock(1.0f), FloatBlock(0.0f));
        level.waiting =
            to_bits(permuted(is_entered, four_bits_each(level.back_to_front)) > 0.0f);
        level.children = node.children;
        level.lanes = entered_;
        depth_ += level.waiting != 0;
    }

    // Adds what its rays may hit of a block.
    Candidates *visit_block(const WideScene &scene, Candidates *found, Counters &counters) {
        const WideBlock &block = scene.blocks[next_.index()];
        const BlockVolumes volumes(block.coordinates, frustum_.axes, frustum_.origin,
                                   frustum_.side);
        const LaneBits there =
            to_bits(load<UIntBlock>(block.numbers.data()) != UIntBlock(NO_PRIMITIVE));
        counters.triangle_tests +=
            uint64_t(std::popcount(there)) * uint64_t(std::popcount(entered_));
        LaneBits left = entered_;
        do {
            const auto first = uint32_t(std::countr_zero(left));
            left &= left - 1;
            const bool two = left != 0;
            const uint32_t second = two ? uint32_t(std::countr_zero(left)) : first;
            left &= left - 1;
            const auto of_both = [&](const LaneArray<float> &lanes) {
                return in_halves(lanes[first], lanes[second]);
            };
            const BlockVolumes::Seen seen =
                volumes.seen_by(of_both(frustum_.slopes[0]), of_both(frustum_.slopes[1]));
            const LaneBits possible = seen.possible &
                                      (there | (two ? there << BLOCK_WIDTH : 0)) &
                                      ~to_bits((seen.nearest > of_both(best_to_)) |
                                               (seen.farthest < FloatPacket(0.0f)));
            found->walk = this;
            found->rays = {first, second};
            found->possible = possible;
            found->certain = seen.certain;
            store(found->nearest.data(), seen.nearest);
            store(found->farthest.data(), seen.farthest);
            found += possible != 0;
        } while (left != 0);
        return found;
    }

    void test(const WideScene &scene, const Candidates &candidates, Counters &counters) {
        const WideBlock &block = scene.blocks[next_.index()];
        for_each_lane(candidates.possible, [&](uint32_t lane) {
            const uint32_t ray = candidates.rays[lane / BLOCK_WIDTH];
            const uint32_t place = lane % BLOCK_WIDTH;
            const uint32_t primitive = block.numbers[place];
            const float nearest = candidates.nearest[lane],
                        farthest = candidates.farthest[lane];
            // Of large triangles many blocks have a copy.
            if (primitive == best_[ray] || nearest > best_to_[ray])
                return;
            const bool certain = candidates.certain >> lane & 1;
            if (certain && nearest > begin_[ray] && farthest < best_from_[ray])
                set_best(ray, {primitive, UNKNOWN_DISTANCE, nearest, farthest});
            else
                decide(ray, block.triangle(place), primitive, certain, scene.triangles,
                       counters);
        });
    }

    uint32_t number() const { return number_; }
    WideHits hits() const {
        const auto primitive = load<UIntPacket>(best_);
        return {primitive, to_bits(primitive != UIntPacket(NO_PRIMITIVE)) & rays_->active};
    }

private:
    void decide(uint32_t ray, const Triangle &triangle, uint32_t primitive,
                bool certainly_hit, const Triangle *triangles, Counters &counters) {
        const Vec3f direction = rays_->lane_direction(ray);
        const DepthRay depth_ray{rays_->origin.point, direction, rays_->t_min.entry(ray),
                                 rays_->t_max.entry(ray),
                                 std::abs(direction[frustum_.axes[2]])};
        DepthHit best{best_[ray], best_distance_[ray], best_from_[ray], best_to_[ray]};
        if (decide_best(depth_ray, triangle, primitive, certainly_hit, triangles, best,
                        counters))
            set_best(ray, best);
        else
            best_distance_[ray] = best.distance; // may have been found
    }

    void set_best(uint32_t ray, const DepthHit &hit) {
        best_[ray] = hit.primitive;
        if constexpr (QUERY == Query::any) {
            best_to_[ray] = -INFINITE; // nothing is of interest any more
            searching_ &= ~(1u << ray);
            if (searching_ == 0)
                depth_ = 0;
        } else {
            best_distance_[ray] = hit.distance;
            best_from_[ray] = hit.from;
            best_to_[ray] = hit.to;
        }
    }

    // A node on the path, with those of its children that are not yet visited.
    struct alignas(CACHE_LINE) Level {
        SeenBoxes boxes;
        std::array<uint32_t, WideNode::WIDTH> children; // bits of a WideChild
        uint32_t back_to_front;                         // as in WideNode
        uint32_t waiting;                               // bits of places in that order
        LaneBits lanes;                                 // that entered the node
    };

    const RayPacket<CommonOrigin> *rays_;
    PacketFrustum frustum_;
    // Of each ray: the depth from which on hits count for certain, and a DepthHit.
    LaneArray<float> begin_, best_from_, best_to_, best_distance_;
    LaneArray<uint32_t> best_;
    LaneBits searching_, entered_;
    uint32_t number_;
    WideChild next_;
    uint32_t depth_; // of levels on which some children wait
    std::array<Level, MAX_WIDE_DEPTH + 1> levels_;
};

// Takes packets to their ends, AT_ONCE of them at a time, as a step mostly waits for
// memory. Steps of a kind are done together, and walks are sorted by what they do next
// without branches: processors lose more by guessing it wrong.
template <Query QUERY>
void trace(const WideTree &tree, const Triangle *triangles,
           std::span<const WidePacket> packets, WideHits *hits, Counters &counters) {
    constexpr size_t AT_ONCE = 16; // chosen from 12 to 24 by rays in dragon
    using Walk = PacketWalk<QUERY>;
    struct Memory {
        std::array<Walk, AT_ONCE> walks;
        std::array<CandidatesOf<QUERY>, AT_ONCE * PACKET_WIDTH / 2> candidates;
    };
    // Too much for the stacks of some threads.
    thread_local const auto memory = std::make_unique<Memory>();
    const WideScene scene(tree, triangles);
    const WideEntry entry(tree, packets);
    std::array<Walk *, AT_ONCE> running, at_node, at_block;
    size_t started = 0, left = 0;
    const auto start = [&](Walk *walk) {
        const WidePacket &packet = packets[started];
        walk->start(scene, packet, entry.of(packet), uint32_t(started++));
        running[left++] = walk;
    };
    const auto finish = [&](const Walk &walk) {
        const WideHits &found = hits[walk.number()] = walk.hits();
        // Their distances are computed soon.
        if constexpr (QUERY == Query::closest) {
            const LaneArray<uint32_t> primitives = to_lanes<uint32_t>(found.primitive);
            for_each_lane(found.found,
                          [&](uint32_t lane) { prefetch(&triangles[primitives[lane]]); });
        }
    };
    while (left < std::min(AT_ONCE, packets.size()))
        start(&memory->walks[left]);
    while (left > 0) {
        size_t nodes = 0, blocks = 0;
        for (size_t i = 0; i < left;) {
            Walk *const walk = running[i];
            if (walk->is_at_end()) {
                finish(*walk);
                running[i] = running[--left];
                if (started < packets.size())
                    start(walk);
                continue;
            }
            walk->take(scene);
            at_node[nodes] = at_block[blocks] = walk;
            const size_t entered = walk->is_entered(), is_block = walk->is_at_block();
            nodes += entered & ~is_block;
            blocks += entered & is_block;
            ++i;
        }
        counters.traversal_steps += nodes + blocks;
        counters.leaf_visits += blocks;
        for (size_t i = 0; i < nodes; ++i)
            at_node[i]->visit_node(scene);
        CandidatesOf<QUERY> *const candidates = memory->candidates.data(),
                                   *end = candidates;
        for (size_t i = 0; i < blocks; ++i)
            end = at_block[i]->visit_block(scene, end, counters);
        for (const CandidatesOf<QUERY> *next = candidates; next < end; ++next)
            next->walk->test(scene, *next, counters);
    }
}

} // namespace

LaneBits WidePacket::choose_axis(LaneBits lanes) {
    LaneBits left = lanes;
    for (int i = std::popcount(lanes) / 2; i > 0; --i)
        left &= left - 1;
    const Vec3f d = rays.lane_direction(uint32_t(std::countr_zero(left)));
    main_axis = largest_axis(d);
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
