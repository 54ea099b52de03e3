#include "mlrta/trace_unordered.h"

#include "base/simd.h"
#include "mlrta/parallel_rays.h"
#include "mlrta/ray_copies.h"
#include "mlrta/ray_order.h"
#include "mlrta/shaft_tracer.h"
#include "mlrta/wide_tracer.h"

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

namespace mlrt {

namespace {

bool may_be_regrouped(const RayGroup &rays, const TraceOptions &options) {
    return !rays.cost && rays.count <= RayOrder::MOST_RAYS && has_beams(options.traversal);
}

// The options for rays that go apart, if these are such and the wide tree is there: it
// takes them in any order equally fast, and sooner than it takes to sort them and to look
// for entry points, shafts and packets.
std::optional<TraceOptions> options_apart(const KdTree &tree, const RayGroup &rays,
                                          const TraceOptions &options) {
    if (rays.has_common_origin || rays.cost || !has_beams(options.traversal) ||
        !wide_tree_for(tree, options) || !go_apart(rays))
        return std::nullopt;
    TraceOptions apart = options;
    apart.traversal = Traversal::wide;
    return apart;
}

template <typename Value>
void put_back(const std::vector<uint32_t> &numbers, const std::vector<Value> &ordered,
              Value *values) {
    for (size_t i = 0; i < numbers.size(); ++i)
        values[numbers[i]] = ordered[i];
}

// Rays of a group in an order of their own.
class OrderedRays {
public:
    OrderedRays(const RayGroup &rays, const std::vector<uint32_t> &numbers) {
        const size_t room =
            (numbers.size() + PACKET_WIDTH - 1) / PACKET_WIDTH * PACKET_WIDTH;
        const auto column = [&](size_t number, bool needed) {
            if (needed)
                columns_[number].resize(room);
            return columns_[number].data();
        };
        const bool origins = !rays.has_common_origin;
        group_ = copy_rays(rays, numbers,
                           {{column(0, origins), column(1, origins), column(2, origins)},
                            {column(3, true), column(4, true), column(5, true)},
                            column(6, rays.t_min.each() != nullptr),
                            column(7, rays.t_max.each() != nullptr)});
    }
    OrderedRays(const OrderedRays &) = delete;
    OrderedRays &operator=(const OrderedRays &) = delete;

    const RayGroup &group() const { return group_; }

private:
    std::array<std::vector<float>, 8> columns_;
    RayGroup group_;
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
    trace_any(tree, ordered.group(), options, found.data(), counters);
    put_back(order.numbers(), found, occluded);
}

} // namespace

uint32_t unordered_group_size(const TraceOptions &options, uint64_t rays) {
    constexpr uint64_t ENOUGH_GROUPS = 16; // for all threads to have work; chosen
    const uint64_t usual = std::max(options.initial_tile * options.initial_tile, 1024u);
    return uint32_t(
        std::max(usual, std::min<uint64_t>(rays / ENOUGH_GROUPS, RayOrder::MOST_RAYS)));
}

bool squares_pay(const TraceOptions &options, uint32_t rays) {
    return has_beams(options.traversal) &&
           options.initial_tile * options.initial_tile <= rays;
}

void trace_closest_unordered(const KdTree &tree, const RayGroup &rays,
                             const TraceOptions &options, HitGroup hits, Counters &counters,
                             bool square) {
    if (const auto apart = options_apart(tree, rays, options)) {
        trace_closest(tree, rays, *apart, hits, counters);
        return;
    }
    std::optional<RayOrder> order;
    if (may_be_regrouped(rays, options) && !(square && are_in_order(rays)))
        order.emplace(rays);
    if (!order || !order->pays()) {
        trace_closest(tree, rays, options, hits, counters);
        return;
    }
    const std::vector<uint32_t> &numbers = order->numbers();
    const OrderedRays ordered(rays, numbers);
    std::vector<float> t(hits.t ? rays.count : 0);
    std::vector<uint32_t> primitive(rays.count);
    trace_closest(tree, ordered.group(), options,
                  {hits.t ? t.data() : nullptr, primitive.data()}, counters);
    if (hits.t)
        put_back(numbers, t, hits.t);
    put_back(numbers, primitive, hits.primitive);
}

void trace_any_unordered(const KdTree &tree, const RayGroup &rays,
                         const TraceOptions &options, uint8_t *occluded, Counters &counters,
                         bool square) {
    if (const auto apart = options_apart(tree, rays, options)) {
        trace_any(tree, rays, *apart, occluded, counters);
        return;
    }
    if (!may_be_regrouped(rays, options) || are_parallel(rays) ||
        (square && rays.has_common_origin && are_in_order(rays))) {
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
    trace_any_sorted(tree, others.group(), options, found.data(), counters);
    put_back(left, found, occluded);
}

} // namespace mlrt
