#include "traverse/wide.h"

#include "base/block_order.h"
#include "base/partial_packets.h"
#include "geometry/block_volumes.h"
#include "geometry/packet_distances.h"
#include "traverse/wide_scene.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <memory>
#include <utility>

namespace mlrt {

namespace {

// A ray on its way through the tree: what waits to be visited is on a stack, the nearest on
// top.
//
// Steps do not ask whether they are of any use, as processors lose more by guessing the
// answer wrong.
template <Query QUERY>
class WideWalk {
public:
    void start(const WideRay &ray, WideChild root) {
        ray_ = ray;
        next_ = root;
        children_[0] = WideChild::block(0).bits(); // never visited
        pending_ = 1;
    }

    bool is_at_block() const { return next_.is_block(); }
    bool is_at_end() const { return pending_ == 0; }

    // Goes on to the nearest of the children that the ray enters, and puts the others on
    // the stack.
    void visit_node(const WideScene &scene) {
        const WideNode &node = scene.nodes[next_.index()];
        const auto face = [&](uint16_t place) {
            return load<FloatBlock>(reinterpret_cast<const float *>(
                reinterpret_cast<const std::byte *>(&node) + place));
        };
        FloatBlock near(ray_.search_from), far(ray_.search_end);
        for (size_t k = 0; k < 3; ++k) {
            const FloatBlock o(ray_.origin[k]);
            // Where it is not a number it shortens nothing. What underflow may take is
            // added to one end of the interval, which does for both.
            near =
                maximum((face(ray_.faces[k].first) - o) * FloatBlock(ray_.enter[k]), near);
            far = minimum(fused(face(ray_.faces[k].last) - o, FloatBlock(ray_.leave[k]),
                                FloatBlock(2 * TINY_PARAMETER)),
                          far);
        }
        const UIntBlock order = four_bits_each(node.back_to_front[ray_.octant]);
        near = permuted(near, order);
        far = permuted(far, order);
        const LaneBits entered = to_bits(near <= far);
        const uint32_t pending = pending_;
        if constexpr (QUERY == Query::closest)
            store_compressed(&nears_[pending], near, entered);
        store_compressed(&children_[pending],
                         permuted(load<UIntBlock>(node.children.data()), order), entered);
        go_on(scene, pending + uint32_t(std::popcount(entered)));
    }

    // Looks at a block, which is left by one of the two ways below.
    void visit_block(const WideScene &scene, Counters &counters) {
        const WideBlock &block = scene.blocks[next_.index()];
        const auto &[axis_x, axis_y, axis_z, unused] = ray_.axes;
        const auto &[x, y, z] = ray_.ordered_origin;
        const RayVolumes volumes(block.coordinates, {axis_x, axis_y, axis_z}, {x, y, z},
                                 ray_.side);
        const RayVolumes::Seen seen =
            volumes.seen_by(FloatBlock(ray_.slopes[0]), FloatBlock(ray_.slopes[1]));
        const LaneBits there =
            to_bits(load<UIntBlock>(block.numbers.data()) != UIntBlock(NO_PRIMITIVE));
        counters.triangle_tests += uint64_t(std::popcount(there));
        candidates_ = seen.possible & there &
                      ~to_bits((seen.nearest > FloatBlock(ray_.best.to)) |
                               (seen.farthest < FloatBlock(ray_.before)));
        certain_ = seen.certain;
        store(nearest_.data(), seen.nearest);
        store(farthest_.data(), seen.farthest);
    }
    bool has_candidates() const { return candidates_ != 0; }
    void leave_block(const WideScene &scene) { go_on(scene, pending_); }

    void test_candidates(const WideScene &scene, const WideRays &rays, Counters &counters) {
        const WideBlock &block = scene.blocks[next_.index()];
        const float to = ray_.best.to;
        for_each_lane(candidates_, [&](uint32_t lane) {
            const uint32_t primitive = block.numbers[lane];
            // Of large triangles many blocks have a copy.
            if (primitive == ray_.best.primitive || nearest_[lane] > ray_.best.to)
                return;
            const bool certain = certain_ >> lane & 1;
            if (certain && nearest_[lane] > ray_.begin && farthest_[lane] < ray_.best.from)
                ray_.best = {primitive, UNKNOWN_DISTANCE, nearest_[lane],
                             QUERY == Query::any ? -INFINITE : farthest_[lane]};
            else
                decide(block.triangle(lane), primitive, certain, scene.triangles, rays,
                       counters);
        });
        if (ray_.best.to != to)
            shorten();
        go_on(scene, pending_);
    }

    // What was found, without its distance.
    uint32_t number() const { return ray_.number; }
    uint32_t primitive() const { return ray_.best.primitive; }

private:
    // To what is on top of the stack, whose memory it asks for.
    void go_on(const WideScene &scene, uint32_t pending) {
        pending_ = --pending;
        next_ = WideChild::from_bits(children_[pending]);
        scene.prefetch_child(next_);
    }

    // Leaves on the stack only what may hold a nearer hit.
    void shorten() {
        if constexpr (QUERY == Query::any) {
            pending_ = 1;
            return;
        }
        // WIDEN_FAR covers the roundings of a reciprocal and of three products.
        ray_.search_end = ray_.best.to * ray_.per_size * WIDEN_FAR + 2 * TINY_PARAMETER;
        uint32_t kept = 1;
        for (uint32_t i = 1; i < pending_; i += BLOCK_WIDTH) {
            const auto near = load<FloatBlock>(&nears_[i]);
            const auto children = load<UIntBlock>(&children_[i]);
            const LaneBits keep =
                to_bits(near <= FloatBlock(ray_.search_end)) & first_lanes(pending_ - i);
            store_compressed(&nears_[kept], near, keep);
            store_compressed(&children_[kept], children, keep);
            kept += uint32_t(std::popcount(keep));
        }
        pending_ = kept;
    }

    void decide(const Triangle &triangle, uint32_t primitive, bool certainly_hit,
                const Triangle *triangles, const WideRays &rays, Counters &counters) {
        const uint32_t number = ray_.number;
        const DepthRay ray{{ray_.origin[0], ray_.origin[1], ray_.origin[2]},
                           {rays.direction[0][number], rays.direction[1][number],
                            rays.direction[2][number]},
                           rays.t_min[number],
                           rays.t_max[number],
                           ray_.size};
        const bool wins = decide_best(ray, triangle, primitive, certainly_hit, triangles,
                                      ray_.best, counters);
        if (QUERY == Query::any && wins)
            ray_.best.to = -INFINITE; // nothing is of interest any more
    }

    WideRay ray_;
    WideChild next_;
    uint32_t pending_;
    // Triangles of a block that may be hit, nearer than what was found, and that certainly
    // are, and bounds of their depths.
    LaneBits candidates_, certain_;
    std::array<float, BLOCK_WIDTH> nearest_, farthest_;
    static constexpr uint32_t STACK = (WideNode::WIDTH - 1) * MAX_WIDE_DEPTH + 2;
    // Whole blocks are written. Any hit ends a walk, so what is farther is not of interest.
    std::array<float, STACK + BLOCK_WIDTH> nears_;
    std::array<uint32_t, STACK + BLOCK_WIDTH> children_; // bits of a WideChild
};

// Walks by what they do next.
template <typename Walk, size_t MOST>
struct WaitingWalks {
    std::array<Walk *, MOST> at_node, at_block, at_end;
    size_t nodes = 0, blocks = 0, ends = 0;

    void add(Walk *walk) {
        const size_t is_block = walk->is_at_block(), is_end = walk->is_at_end();
        at_node[nodes] = at_block[blocks] = at_end[ends] = walk;
        nodes += 1 - is_block;
        blocks += is_block - is_end;
        ends += is_end;
    }
    bool is_empty() const { return nodes + blocks + ends == 0; }
};

// Takes rays to their ends, AT_ONCE of them at a time, as a step mostly waits for memory.
// Steps of a kind are done together: the longer a loop, the less often processors guess
// wrong what comes next.
template <Query QUERY>
void trace(const WideScene &scene, const WideRays &rays, Hit *hits, Counters &counters) {
    constexpr size_t AT_ONCE = 24;      // chosen from 8 to 64 by incoherent rays in office
    constexpr size_t FEW = AT_ONCE / 2; // and conference
    using Walk = WideWalk<QUERY>;
    // Too much for the stacks of some threads.
    thread_local const auto memory = std::make_unique<std::array<Walk, AT_ONCE>>();
    WaitingWalks<Walk, AT_ONCE> waiting;
    uint32_t started = 0;
    for (Walk &walk : *memory) {
        if (started == rays.count)
            break;
        walk.start(rays.beginning[started++], scene.root);
        waiting.add(&walk);
    }
    while (!waiting.is_empty()) {
        while (waiting.nodes > FEW ||
               (waiting.nodes > 0 && waiting.blocks + waiting.ends == 0)) {
            const size_t nodes = std::exchange(waiting.nodes, 0);
            counters.traversal_steps += nodes;
            for (size_t i = 0; i < nodes; ++i) {
                Walk *const walk = waiting.at_node[i];
                walk->visit_node(scene);
                waiting.add(walk);
            }
        }

        const size_t blocks = std::exchange(waiting.blocks, 0);
        counters.traversal_steps += blocks;
        counters.leaf_visits += blocks;
        std::array<Walk *, AT_ONCE> hopeful, hopeless;
        size_t hopes = 0;
        for (size_t i = 0; i < blocks; ++i) {
            Walk *const walk = waiting.at_block[i];
            walk->visit_block(scene, counters);
            hopeful[hopes] = hopeless[i - hopes] = walk;
            hopes += walk->has_candidates();
        }
        for (size_t i = 0; i < blocks - hopes; ++i) {
            hopeless[i]->leave_block(scene);
            waiting.add(hopeless[i]);
        }
        for (size_t i = 0; i < hopes; ++i) {
            hopeful[i]->test_candidates(scene, rays, counters);
            waiting.add(hopeful[i]);
        }

        const size_t ends = std::exchange(waiting.ends, 0);
        for (size_t i = 0; i < ends; ++i) {
            Walk *const walk = waiting.at_end[i];
            hits[walk->number()] = {INFINITE, walk->primitive()};
            // Its distance is computed soon.
            if (QUERY == Query::closest && walk->primitive() != NO_PRIMITIVE)
                prefetch(&scene.triangles[walk->primitive()]);
            if (started == rays.count)
                continue;
            walk->start(rays.beginning[started++], scene.root);
            waiting.add(walk);
        }
    }
}

// Distances of what was found.
void find_distances(const Triangle *triangles, const WideRays &rays, Hit *hits,
                    Counters &counters) {
    for (uint32_t i = 0; i < rays.count; i += PACKET_WIDTH) {
        LaneArray<uint32_t> primitive{};
        LaneBits found = 0;
        for (uint32_t j = 0; j < std::min(rays.count - i, PACKET_WIDTH); ++j) {
            primitive[j] = hits[i + j].primitive;
            found |= LaneBits(primitive[j] != NO_PRIMITIVE) << j;
        }
        if (found == 0)
            continue;
        RayPacket<LaneOrigins> packet;
        for (int k = 0; k < 3; ++k) {
            packet.origin.point[k] = load<FloatPacket>(&rays.origin[k][i]);
            packet.direction[k] = load<FloatPacket>(&rays.direction[k][i]);
        }
        const auto t = to_lanes<float>(
            hit_distances(packet, found, load<UIntPacket>(primitive), triangles, counters));
        for_each_lane(found, [&](uint32_t lane) { hits[i + lane].t = t[lane]; });
    }
}

} // namespace

void trace_wide(const WideTree &tree, const Triangle *triangles, const WideRays &rays,
                Query query, Hit *hits, Counters &counters) {
    const WideScene scene(tree, triangles);
    if (query == Query::any) {
        trace<Query::any>(scene, rays, hits, counters);
    } else {
        trace<Query::closest>(scene, rays, hits, counters);
        find_distances(triangles, rays, hits, counters);
    }
}

} // namespace mlrt
