#include "traverse/wide.h"

#include "base/block_order.h"
#include "geometry/sheared_volumes.h"
#include "geometry/triangle_test.h"
#include "traverse/parameter_interval.h"
#include "traverse/take_turns.h"

#include <array>
#include <bit>

namespace mlrt {

namespace {

// A ray on its way through the tree: what waits to be visited is on a stack, the nearest on
// top.
template <Query QUERY>
class WideWalk {
public:
    void start(const WideTree &tree, const WideRays &rays, uint32_t number) {
        number_ = number;
        for (int k = 0; k < 3; ++k) {
            origin_[k] = rays.origin[k][number];
            direction_[k] = rays.direction[k][number];
            reciprocal_[k] = rays.reciprocal[k][number];
        }
        const uint32_t main = rays.main_axis[number];
        sheared_ = ShearedRay(origin_, main, rays.shear_x[number], rays.shear_y[number]);
        octant_ = 0;
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t negative = reciprocal_[int(k)] < 0;
            first_face_[k] = k + 3 * negative;
            octant_ |= negative << k;
        }
        t_min_ = rays.t_min[number];
        best_ = {rays.t_max[number], NO_PRIMITIVE};
        search_from_ = t_min_ * WIDEN_NEAR;
        search_end_ = latest_distance(best_.t);
        pending_ = 1;
        nears_[0] = search_from_;
        children_[0] = tree.root.bits();
    }

    // Takes what is to be visited next, and asks for its memory. Returns whether there is
    // anything.
    bool next(const WideTree &tree) {
        do {
            if (pending_ == 0)
                return false;
            --pending_;
        } while (!(nears_[pending_] <= search_end_));
        next_ = WideChild::from_bits(children_[pending_]);
        if (next_.is_block())
            prefetch(&tree.blocks[next_.index()]);
        else
            prefetch(&tree.nodes[next_.index()]);
        return true;
    }
    bool is_at_block() const { return next_.is_block(); }

    // Puts those children on the stack that the ray enters.
    void visit_node(const WideTree &tree) {
        const WideNode &node = tree.nodes[next_.index()];
        FloatBlock near(search_from_), far(search_end_);
        for (int k = 0; k < 3; ++k) {
            const uint32_t first = first_face_[size_t(k)],
                           last = 2 * uint32_t(k) + 3 - first;
            const auto parameter = [&](uint32_t face) {
                return (load<FloatBlock>(node.faces[face].data()) - origin_[k]) *
                       reciprocal_[k];
            };
            // Where it is not a number it shortens nothing.
            near = maximum(parameter(first), near);
            far = minimum(parameter(last), far);
        }
        near = near * WIDEN_NEAR - TINY_PARAMETER;
        far = far * WIDEN_FAR + TINY_PARAMETER;
        const UIntBlock order = four_bits_each(node.back_to_front[octant_]);
        near = permuted(near, order);
        far = permuted(far, order);
        const LaneBits entered = to_bits(near <= far);
        store_compressed(&nears_[pending_], near, entered);
        store_compressed(&children_[pending_],
                         permuted(load<UIntBlock>(node.children.data()), order), entered);
        pending_ += uint32_t(std::popcount(entered));
    }

    void visit_block(const WideTree &tree, Counters &counters) {
        const WideBlock &block = tree.blocks[next_.index()];
        const ShearedVolumes<FloatBlock> volumes(sheared_, block.coordinates);
        const auto numbers = load<UIntBlock>(block.numbers.data());
        const LaneBits there = to_bits(numbers != UIntBlock(NO_PRIMITIVE));
        counters.triangle_tests += uint64_t(std::popcount(there));
        const LaneBits certain_hits = volumes.certain_hits();
        for_each_lane(there & ~volumes.certain_misses(), [&](uint32_t lane) {
            // Of large triangles many blocks have a copy.
            if (block.numbers[lane] != best_.primitive)
                test(block.triangle(lane), block.numbers[lane], certain_hits >> lane & 1,
                     counters);
        });
        if (QUERY == Query::any && best_.primitive != NO_PRIMITIVE)
            pending_ = 0;
        search_end_ = latest_distance(best_.t);
    }

    uint32_t number() const { return number_; }
    Hit hit() const { return best_.primitive == NO_PRIMITIVE ? Hit{} : best_; }

private:
    void test(const Triangle &triangle, uint32_t primitive, bool certainly_hit,
              Counters &counters) {
        if (!certainly_hit) {
            const HitDecision decision = decide_hit(origin_, direction_, triangle);
            ++counters.double_tests;
            counters.exact_tests += decision.precision == Precision::exact;
            if (!decision.hit)
                return;
        }
        const float t = hit_distance(origin_, direction_, triangle);
        if (t > t_min_ && t < INFINITE &&
            (t < best_.t || (t == best_.t && primitive < best_.primitive)))
            best_ = {t, primitive};
    }

    Vec3f origin_, direction_, reciprocal_;
    ShearedRay sheared_;
    std::array<uint32_t, 3> first_face_; // of a box that the ray crosses, by axis
    uint32_t octant_, number_;
    float t_min_;
    float search_from_, search_end_; // no parameter outside is of interest
    Hit best_;
    WideChild next_;
    uint32_t pending_;
    static constexpr uint32_t STACK = (WideNode::WIDTH - 1) * MAX_WIDE_DEPTH + 1;
    // Whole blocks are written.
    std::array<float, STACK + BLOCK_WIDTH> nears_;
    std::array<uint32_t, STACK + BLOCK_WIDTH> children_; // bits of a WideChild
};

template <Query QUERY>
void trace(const WideTree &tree, const WideRays &rays, Hit *hits, Counters &counters) {
    constexpr size_t AT_ONCE = 8; // chosen from 1 to 16 by incoherent rays in conference
    using Walk = WideWalk<QUERY>;
    uint32_t started = 0;
    take_turns<Walk, AT_ONCE>(
        tree, rays.count, counters, [&](Walk &walk) { walk.start(tree, rays, started++); },
        [&](Walk &walk) { walk.visit_block(tree, counters); },
        [&](const Walk &walk) { hits[walk.number()] = walk.hit(); });
}

} // namespace

void trace_wide(const WideTree &tree, const WideRays &rays, Query query, Hit *hits,
                Counters &counters) {
    if (query == Query::any)
        trace<Query::any>(tree, rays, hits, counters);
    else
        trace<Query::closest>(tree, rays, hits, counters);
}

} // namespace mlrt
