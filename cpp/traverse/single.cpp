#include "traverse/single.h"

#include "geometry/ray_packet.h"
#include "geometry/triangle_block.h"
#include "geometry/triangle_test.h"
#include "traverse/parameter_interval.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace mlrt {

namespace {

// One ray against eight triangles: those that it may hit.
LaneBits may_hit(const Vec3<FloatBlock> &origin, const Vec3<FloatBlock> &direction,
                 const TriangleBlock<FloatBlock> &block) {
    const FilteredVolumes<FloatBlock> volumes(origin, direction, block.a, block.b, block.c);
    return ~volumes.certain_misses() & ((1u << BLOCK_WIDTH) - 1);
}

// Keeps the better of `best` and the hit on triangle number `primitive`, if there is one.
void test_triangle(const KdTree &tree, const Ray &ray, uint32_t primitive, Hit &best,
                   Counters &counters) {
    const Triangle &triangle = tree.triangles[primitive];
    const HitDecision decision = decide_hit(ray.origin, ray.direction, triangle);
    counters.exact_tests += decision.precision == Precision::exact;
    if (!decision.hit)
        return;
    const float t = hit_distance(ray.origin, ray.direction, triangle, counters);
    if (t > ray.t_min && t < INFINITE &&
        (t < best.t || (t == best.t && primitive < best.primitive)))
        best = {t, primitive};
}

// Eight triangles of a leaf at a time.
void test_leaf(const KdTree &tree, const Ray &ray, KdNode leaf, Hit &best,
               Counters &counters) {
    const auto origin = Vec3<FloatBlock>(ray.origin);
    const auto direction = Vec3<FloatBlock>(ray.direction);
    const std::span<const uint32_t> references = tree.references_of(leaf);
    for (size_t first = 0; first < references.size(); first += BLOCK_WIDTH) {
        const size_t count = std::min<size_t>(references.size() - first, BLOCK_WIDTH);
        std::array<uint32_t, BLOCK_WIDTH> numbers;
        numbers.fill(references[first]);
        std::copy_n(references.begin() + ptrdiff_t(first), count, numbers.begin());
        counters.triangle_tests += count;
        const TriangleBlock<FloatBlock> block(tree.triangles.data(), numbers.data());
        for_each_lane(may_hit(origin, direction, block) & ((1u << count) - 1),
                      [&](uint32_t lane) {
                          test_triangle(tree, ray, numbers[lane], best, counters);
                      });
    }
}

Hit finished(Hit best) {
    return best.primitive == NO_PRIMITIVE ? Hit{} : best;
}

// Planes are intersected with a ray whose largest direction component lies in [0.5, 1):
// scaling by a power of two changes no rounding, and its parameter is t / scale.
struct ScaledRay {
    Vec3f reciprocal;
    double inverse; // one over what it was scaled by

    ScaledRay() = default;
    explicit ScaledRay(Vec3f direction) {
        int exponent = 0;
        std::frexp(max_component(abs(direction)), &exponent);
        const double scale = std::ldexp(1.0, -exponent);
        inverse = std::ldexp(1.0, exponent);
        for (int k = 0; k < 3; ++k) {
            const float d = float(direction[k] * scale);
            // What is this small may have lost digits, but it is not zero.
            reciprocal[k] = direction[k] != 0 && std::abs(d) < 0x1p-100f
                                ? std::numeric_limits<float>::quiet_NaN()
                                : 1 / d;
        }
    }

    float parameter(float t) const { return float(t * inverse); }
    // That of the latest distance that may be rounded to t.
    float latest_parameter(float t) const {
        return float(latest_distance(double(t)) * inverse);
    }
};

// A ray on its way through a subtree.
class SingleWalk {
public:
    // Returns whether there is anything to visit.
    bool start(const KdTree &tree, const Ray &ray, const Entry &entry, size_t number) {
        ray_ = ray;
        number_ = number;
        best_ = {ray.t_max, NO_PRIMITIVE};
        scaled_ = ScaledRay(ray.direction);
        search_end_ = scaled_.latest_parameter(ray.t_max);
        interval_ = {scaled_.parameter(ray.t_min) * WIDEN_NEAR,
                     search_end_ * WIDEN_FAR + TINY_PARAMETER};
        for (int k = 0; k < 3; ++k) {
            const float reciprocal = scaled_.reciprocal[k];
            axes_[k] = {ray.origin[k], reciprocal, std::signbit(reciprocal)};
            interval_ = clip_to_slab(interval_, entry.cell.lo[k] - ray.origin[k],
                                     entry.cell.hi[k] - ray.origin[k], reciprocal);
        }
        pending_ = 0;
        node_ = entry.node;
        prefetch(&tree.nodes[node_]);
        return interval_.not_empty();
    }

    // Visits a node. Returns whether there are more.
    bool step(const KdTree &tree, Query query, Counters &counters) {
        const KdNode node = tree.node(node_);
        ++counters.traversal_steps;
        if (node.is_leaf()) {
            ++counters.leaf_visits;
            if (node.reference_count() > 0) {
                test_leaf(tree, ray_, node, best_, counters);
                if (query == Query::any && best_.primitive != NO_PRIMITIVE)
                    return false;
                search_end_ = scaled_.latest_parameter(best_.t);
            }
            do {
                if (pending_ == 0)
                    return false;
                --pending_;
            } while (!(stack_[pending_].interval.near <= search_end_));
            node_ = stack_[pending_].node;
            interval_ = stack_[pending_].interval;
        } else {
            const Axis &axis = axes_[size_t(node.axis())];
            const float parameter = (node.split() - axis.origin) * axis.reciprocal;
            // Where the parameter is not a number it shortens nothing.
            const float leave =
                minimum(parameter * WIDEN_FAR + TINY_PARAMETER, interval_.far);
            const float enter =
                maximum(parameter * WIDEN_NEAR - TINY_PARAMETER, interval_.near);
            const bool enter_near = interval_.near <= leave;
            const bool enter_far = enter <= interval_.far;
            // Without branches: one side at least is entered, and what waits is written
            // even if it does not wait.
            stack_[pending_] = {node.lower_child() + 1 - axis.near_side,
                                {enter, interval_.far}};
            pending_ += uint32_t(enter_near & enter_far);
            node_ = node.lower_child() + (axis.near_side ^ uint32_t(!enter_near));
            interval_.far = enter_near ? leave : interval_.far;
        }
        prefetch(&tree.nodes[node_]);
        return true;
    }

    size_t number() const { return number_; }
    Hit hit() const { return finished(best_); }

private:
    struct Axis {
        float origin, reciprocal;
        uint32_t near_side; // of a plane, 1 above: where a ray is before it crosses it
    };
    struct Pending {
        uint32_t node;
        ParameterInterval<float> interval;
    };

    Ray ray_;
    size_t number_;
    Hit best_;
    ScaledRay scaled_;
    float search_end_; // no parameter beyond it is of interest
    uint32_t node_, pending_;
    ParameterInterval<float> interval_;
    std::array<Axis, 3> axes_;
    std::array<Pending, MAX_TREE_DEPTH + 1> stack_;
};

} // namespace

Ray ray_of(const RayGroup &rays, uint32_t i) {
    Ray ray;
    for (int k = 0; k < 3; ++k) {
        ray.origin[k] = rays.has_common_origin ? rays.common_origin[k] : rays.origin[k][i];
        ray.direction[k] = rays.direction[k][i];
    }
    ray.t_min = std::max(rays.t_min[i], 0.0f);
    ray.t_max = rays.t_max[i];
    return ray;
}

Hit brute_force(const KdTree &tree, const Ray &ray, Query query, Counters &counters) {
    Hit best{ray.t_max, NO_PRIMITIVE};
    for (uint32_t primitive = 0; primitive < tree.triangles.size(); ++primitive) {
        if (!is_finite(tree.triangles[primitive]))
            continue;
        ++counters.triangle_tests;
        test_triangle(tree, ray, primitive, best, counters);
        if (query == Query::any && best.primitive != NO_PRIMITIVE)
            break;
    }
    return finished(best);
}

void trace_singles(const KdTree &tree, std::span<const Ray> rays, Query query,
                   const Entry &entry, Hit *hits, Counters &counters) {
    // A step waits for the node and for the plane's parameter; meanwhile others go on.
    // Chosen from 1, 4, 8 and 16 by incoherent rays in office, conference and sponza.
    constexpr size_t AT_ONCE = 8;
    std::array<SingleWalk, AT_ONCE> walks;
    size_t next = 0, running = 0;
    const auto start = [&](SingleWalk &walk) {
        while (next < rays.size()) {
            const size_t number = next++;
            if (walk.start(tree, rays[number], entry, number))
                return true;
            hits[number] = walk.hit();
        }
        return false;
    };
    while (running < AT_ONCE && start(walks[running]))
        ++running;
    while (running > 0)
        for (size_t i = 0; i < running; ++i) {
            if (walks[i].step(tree, query, counters))
                continue;
            hits[walks[i].number()] = walks[i].hit();
            if (!start(walks[i]))
                walks[i--] = walks[--running];
        }
}

Hit trace_single(const KdTree &tree, const Ray &ray, Query query, const Entry &entry,
                 Counters &counters) {
    Hit hit;
    trace_singles(tree, {&ray, 1}, query, entry, &hit, counters);
    return hit;
}

} // namespace mlrt
