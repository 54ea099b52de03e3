#include "mlrta/trace_unordered.h"

#include "mlrta/parallel_rays.h"
#include "mlrta/ray_order.h"
#include "mlrta/shaft_tracer.h"

#include <algorithm>
#include <optional>
#include <vector>

namespace mlrt {

namespace {

bool may_be_regrouped(const RayGroup &rays, const TraceOptions &options) {
    return !rays.cost && rays.count <= RayOrder::MOST_RAYS &&
           (options.traversal == Traversal::beam_leaf ||
            options.traversal == Traversal::adaptive);
}

template <typename Value>
std::vector<Value> in_order(const std::vector<uint32_t> &numbers, const Value *values) {
    std::vector<Value> ordered(numbers.size());
    for (size_t i = 0; i < numbers.size(); ++i)
        ordered[i] = values[numbers[i]];
    return ordered;
}

template <typename Value>
void put_back(const std::vector<uint32_t> &numbers, const std::vector<Value> &ordered,
              Value *values) {
    for (size_t i = 0; i < numbers.size(); ++i)
        values[numbers[i]] = ordered[i];
}

// Copies of rays of a group in an order of their own.
struct OrderedRays {
    std::vector<float> origin[3], direction[3], t_min, t_max;
    RayGroup group;

    OrderedRays(const RayGroup &rays, const std::vector<uint32_t> &numbers) : group(rays) {
        group.count = uint32_t(numbers.size());
        for (int k = 0; k < 3; ++k) {
            direction[k] = in_order(numbers, rays.direction[k]);
            group.direction[k] = direction[k].data();
            if (!rays.has_common_origin) {
                origin[k] = in_order(numbers, rays.origin[k]);
                group.origin[k] = origin[k].data();
            }
        }
        if (rays.t_min.each()) {
            t_min = in_order(numbers, rays.t_min.each());
            group.t_min = IntervalEnds(t_min.data());
        }
        if (rays.t_max.each()) {
            t_max = in_order(numbers, rays.t_max.each());
            group.t_max = IntervalEnds(t_max.data());
        }
    }
    OrderedRays(const OrderedRays &) = delete;
    OrderedRays &operator=(const OrderedRays &) = delete;
};

void trace_any_sorted(const KdTree &tree, const RayGroup &rays, const TraceOptions &options,
                      uint8_t *occluded, Counters &counters) {
    const RayOrder order(rays);
    if (!order.pays()) {
        trace_any(tree, rays, options, occluded, counters);
        return;
    }
    const OrderedRays ordered(rays, order.numbers());
    std::vector<uint8_t> found(rays.count);
    trace_any(tree, ordered.group, options, found.data(), counters);
    put_back(order.numbers(), found, occluded);
}

} // namespace

uint32_t unordered_group_size(const TraceOptions &options, uint64_t rays) {
    constexpr uint64_t ENOUGH_GROUPS = 16; // for all threads to have work; chosen
    const uint64_t usual = std::max(options.initial_tile * options.initial_tile, 1024u);
    return uint32_t(
        std::max(usual, std::min<uint64_t>(rays / ENOUGH_GROUPS, RayOrder::MOST_RAYS)));
}

void trace_closest_unordered(const KdTree &tree, const RayGroup &rays,
                             const TraceOptions &options, HitGroup hits,
                             Counters &counters) {
    std::optional<RayOrder> order;
    if (may_be_regrouped(rays, options))
        order.emplace(rays);
    if (!order || !order->pays()) {
        trace_closest(tree, rays, options, hits, counters);
        return;
    }
    const std::vector<uint32_t> &numbers = order->numbers();
    const OrderedRays ordered(rays, numbers);
    std::vector<float> t(hits.t ? rays.count : 0);
    std::vector<uint32_t> primitive(rays.count);
    trace_closest(tree, ordered.group, options,
                  {hits.t ? t.data() : nullptr, primitive.data()}, counters);
    if (hits.t)
        put_back(numbers, t, hits.t);
    put_back(numbers, primitive, hits.primitive);
}

void trace_any_unordered(const KdTree &tree, const RayGroup &rays,
                         const TraceOptions &options, uint8_t *occluded,
                         Counters &counters) {
    if (!may_be_regrouped(rays, options) || are_parallel(rays)) {
        trace_any(tree, rays, options, occluded, counters);
        return;
    }
    if (rays.has_common_origin) {
        trace_any_sorted(tree, rays, options, occluded, counters);
        return;
    }
    const std::vector<uint32_t> left = ShaftTracer(tree, rays, counters).trace(occluded);
    if (left.size() == rays.count) {
        trace_any_sorted(tree, rays, options, occluded, counters);
        return;
    }
    if (left.empty())
        return;
    const OrderedRays others(rays, left);
    std::vector<uint8_t> found(left.size());
    trace_any_sorted(tree, others.group, options, found.data(), counters);
    put_back(left, found, occluded);
}

} // namespace mlrt
