#include "traverse/single.h"

#include "geometry/triangle_test.h"
#include "traverse/parameter_interval.h"

#include <array>
#include <cmath>

namespace mlrt {

namespace {

// Keeps the better of `best` and the hit on triangle number `primitive`, if there is one.
void test_triangle(const KdTree &tree, const Ray &ray, uint32_t primitive, Hit &best,
                   Counters &counters) {
    const Triangle &triangle = tree.triangles[primitive];
    ++counters.triangle_tests;
    const HitDecision decision = decide_hit(ray.origin, ray.direction, triangle);
    counters.exact_tests += decision.precision == Precision::exact;
    if (!decision.hit)
        return;
    const float t = hit_distance(ray.origin, ray.direction, triangle);
    if (t > ray.t_min && t < INFINITE &&
        (t < best.t || (t == best.t && primitive < best.primitive)))
        best = {t, primitive};
}

Hit finished(Hit best) {
    return best.primitive == NO_PRIMITIVE ? Hit{} : best;
}

// Planes are intersected with a ray whose largest direction component lies in [0.5, 1):
// scaling by a power of two changes no rounding, and its parameter is t / scale.
struct ScaledRay {
    Vec3f reciprocal;
    double scale;

    explicit ScaledRay(Vec3f direction) {
        int exponent = 0;
        std::frexp(max_component(abs(direction)), &exponent);
        scale = std::ldexp(1.0, -exponent);
        for (int k = 0; k < 3; ++k) {
            const float d = float(direction[k] * scale);
            // What is this small may have lost digits, but it is not zero.
            reciprocal[k] = direction[k] != 0 && std::abs(d) < 0x1p-100f
                                ? std::numeric_limits<float>::quiet_NaN()
                                : 1 / d;
        }
    }

    float parameter(float t) const { return float(t / scale); }

    // That of the latest distance that may be rounded to t, but for the margin of
    // ParameterInterval: a denormal t is off by more than that share.
    float latest_parameter(float t) const {
        return float((double(t) + SMALLEST_FLOAT) / scale);
    }
};

} // namespace

Hit brute_force(const KdTree &tree, const Ray &ray, Query query, Counters &counters) {
    Hit best{ray.t_max, NO_PRIMITIVE};
    for (uint32_t primitive = 0; primitive < tree.triangles.size(); ++primitive) {
        if (!is_finite(tree.triangles[primitive]))
            continue;
        test_triangle(tree, ray, primitive, best, counters);
        if (query == Query::any && best.primitive != NO_PRIMITIVE)
            break;
    }
    return finished(best);
}

Hit trace_single(const KdTree &tree, const Ray &ray, Query query, const Entry &entry,
                 Counters &counters) {
    const ScaledRay scaled(ray.direction);
    ParameterInterval<float> interval{scaled.parameter(ray.t_min) * WIDEN_NEAR,
                                      scaled.latest_parameter(ray.t_max) * WIDEN_FAR +
                                          TINY_PARAMETER};
    for (int k = 0; k < 3; ++k)
        interval = clip_to_slab(interval, entry.cell.lo[k] - ray.origin[k],
                                entry.cell.hi[k] - ray.origin[k], scaled.reciprocal[k]);

    struct Pending {
        uint32_t node;
        ParameterInterval<float> interval;
    };
    std::array<Pending, MAX_TREE_DEPTH + 1> stack;
    int pending = 0;
    Hit best{ray.t_max, NO_PRIMITIVE};
    uint32_t node_index = entry.node;
    bool visit = interval.not_empty();
    while (visit || pending > 0) {
        if (!visit) {
            const Pending &next = stack[--pending];
            node_index = next.node;
            interval = next.interval;
            visit = interval.near <= scaled.latest_parameter(best.t);
            continue;
        }
        const KdNode node = tree.node(node_index);
        ++counters.traversal_steps;
        if (node.is_leaf()) {
            ++counters.leaf_visits;
            for (uint32_t primitive : tree.references_of(node))
                test_triangle(tree, ray, primitive, best, counters);
            if (query == Query::any && best.primitive != NO_PRIMITIVE)
                break;
            visit = false;
            continue;
        }
        const int k = node.axis();
        const float to_plane = node.split() - ray.origin[k];
        const DividedInterval<float> divided(interval, to_plane * scaled.reciprocal[k]);
        const uint32_t origin_child = node.lower_child() + (to_plane < 0);
        const uint32_t other_child = node.lower_child() + !(to_plane < 0);
        const bool enter_origin = divided.origin_side.not_empty();
        const bool enter_other = divided.other_side.not_empty();
        if (enter_origin && enter_other)
            stack[pending++] = {other_child, divided.other_side};
        node_index = enter_origin ? origin_child : other_child;
        interval = enter_origin ? divided.origin_side : divided.other_side;
        visit = enter_origin || enter_other;
    }
    return finished(best);
}

} // namespace mlrt
