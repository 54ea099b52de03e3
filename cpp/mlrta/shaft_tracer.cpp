#include "mlrta/shaft_tracer.h"

#include "mlrta/packet_range.h"
#include "traverse/load_packet.h"
#include "traverse/packet_state.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace mlrt {

namespace {

// Bounds of points.
class PointBounds {
public:
    // In the given lanes.
    void add(LaneBits lanes, const Vec3<FloatPacket> &p) {
        const auto mask = from_bits<FloatPacket>(lanes);
        for (int k = 0; k < 3; ++k)
            ranges_[k].add(select(mask, p[k], FloatPacket(PacketRange<>::NONE)));
    }

    Box3f box() const {
        return {by_axis([&](int k) { return least_lane(ranges_[k].lo); }),
                by_axis([&](int k) { return greatest_lane(ranges_[k].hi); })};
    }

private:
    Vec3<PacketRange<>> ranges_;
};

float reach_of(const Box3f &box) {
    return std::max(max_component(abs(box.lo)), max_component(abs(box.hi)));
}

} // namespace

ShaftTracer::ShaftTracer(const KdTree &tree, const RayGroup &rays, Counters &counters)
    : tree_(tree), rays_(rays), counters_(counters),
      patience_(patience_of_thread<ShaftTracer>(tree)) {}

std::vector<uint32_t> ShaftTracer::trace(uint8_t *occluded) {
    occluded_ = occluded;
    for (uint32_t first = 0; first < rays_.count;) {
        const uint32_t count = std::min(run_, rays_.count - first);
        if (patience_.spares_next())
            leave(first, count);
        else
            trace_run(first, count);
        first += count;
    }
    return std::move(left_);
}

void ShaftTracer::trace_run(uint32_t first, uint32_t count) {
    const std::optional<Shaft> shaft = shaft_of(first, count);
    if (active_ == 0) {
        std::fill_n(occluded_ + first, count, uint8_t(0));
        return;
    }
    if (shaft && find_candidates(*shaft)) {
        patience_.win();
        test_candidates(first, count);
        return;
    }
    ++counters_.fallbacks;
    if (count <= SMALL) {
        patience_.lose();
        leave(first, count);
        return;
    }
    const uint32_t part = std::max(SMALL, std::bit_ceil(count) / 4);
    run_ = part;
    for (uint32_t i = 0; i < count; i += part)
        trace_run(first + i, std::min(part, count - i));
}

// A hit may lie beyond the end of its interval by a rounding of its parameter, which is not
// a small share of one that is denormal, and the end is computed with two.
std::optional<Shaft> ShaftTracer::shaft_of(uint32_t first, uint32_t count) {
    PointBounds begin, end;
    active_ = 0;
    for (uint32_t i = first; i < first + count; i += PACKET_WIDTH) {
        const auto load = [&](const float *const component[3]) {
            return by_axis(
                [&](int k) { return load_padded(component[k], i, first + count); });
        };
        const FloatPacket t_min = load_padded(rays_.t_min, i, first + count);
        const FloatPacket t_max = load_padded(rays_.t_max, i, first + count);
        const Vec3<FloatPacket> o = load(rays_.origin), d = load(rays_.direction);
        auto active = maximum(t_min, FloatPacket(0.0f)) < t_max;
        for (int k = 0; k < 3; ++k)
            active &= (absolute(o[k]) < INFINITE) & (absolute(d[k]) < INFINITE);
        const LaneBits lanes = to_bits(active);
        active_ += uint32_t(std::popcount(lanes));
        begin.add(lanes, o);
        end.add(lanes, o + latest_distance(t_max) * d);
    }
    if (active_ == 0)
        return std::nullopt;
    const Box3f from = begin.box();
    Box3f to = end.box();
    const float reach =
        std::max(reach_of(tree_.bounds), std::max(reach_of(from), reach_of(to)));
    if (!(reach < LARGEST_COORDINATE))
        return std::nullopt;
    const float rounding = 8 * FLOAT_ROUNDOFF * reach + std::numeric_limits<float>::min();
    for (int k = 0; k < 3; ++k) {
        to.lo[k] -= rounding;
        to.hi[k] += rounding;
    }
    return Shaft(from, to, 2 * reach);
}

// Returns false if the shaft meets too much.
bool ShaftTracer::find_candidates(const Shaft &shaft) {
    struct Part {
        uint32_t node;
        Box3f cell;
    };
    candidate_count_ = triangles_ = 0;
    mailbox_.clear();
    std::array<Part, MAX_TREE_DEPTH + 1> waiting;
    uint32_t pending = 0;
    waiting[pending++] = {0, tree_.bounds};
    for (uint32_t steps = 0; pending > 0; ++steps) {
        if (steps == MOST_STEPS)
            return false;
        const Part part = waiting[--pending];
        ++counters_.beam_steps;
        const KdNode node = tree_.node(part.node);
        if (node.is_leaf()) {
            if (!add_candidates(shaft, node))
                return false;
            continue;
        }
        const int axis = node.axis();
        const float split = node.split();
        const auto wait = [&](uint32_t child, const Box3f &cell) {
            if (!shaft.misses(cell))
                waiting[pending++] = {child, cell};
        };
        if (shaft.bounds().lo[axis] <= split) {
            Box3f lower = part.cell;
            lower.hi[axis] = split;
            wait(node.lower_child(), lower);
        }
        if (shaft.bounds().hi[axis] >= split) {
            Box3f upper = part.cell;
            upper.lo[axis] = split;
            wait(node.lower_child() + 1, upper);
        }
    }
    return true;
}

bool ShaftTracer::add_candidates(const Shaft &shaft, KdNode leaf) {
    counters_.leaf_visits += leaf.reference_count() > 0;
    for (const uint32_t primitive : tree_.references_of(leaf)) {
        if (mailbox_.put(primitive))
            continue;
        if (++triangles_ > MOST_TRIANGLES)
            return false;
        if (shaft.misses(tree_.triangles[primitive]))
            continue;
        if (candidate_count_ == MOST_CANDIDATES)
            return false;
        candidates_[candidate_count_++] = primitive;
        ++counters_.beam_triangles;
    }
    return true;
}

void ShaftTracer::test_candidates(uint32_t first, uint32_t count) {
    ++counters_.beams;
    std::fill_n(occluded_ + first, count, uint8_t(0));
    if (candidate_count_ == 0) {
        counters_.rays += active_;
        return;
    }
    for (uint32_t i = first; i < first + count; i += PACKET_WIDTH) {
        auto [packet, extreme] = load_packet<LaneOrigins>(rays_, i);
        const LaneBits in_run = first_lanes(first + count - i);
        packet.active &= in_run;
        counters_.rays += uint64_t(std::popcount(packet.active));
        counters_.packets += packet.active != 0;
        PacketState<Query::any> state(packet);
        for (uint32_t c = 0; c < candidate_count_ && state.searching != 0; ++c)
            state.test(packet, state.searching, tree_.triangles[candidates_[c]],
                       candidates_[c], counters_);
        for_each_lane(state.hits.found, [&](uint32_t lane) { occluded_[i + lane] = 1; });
        for_each_lane(extreme & in_run, [&](uint32_t lane) { left_.push_back(i + lane); });
    }
}

void ShaftTracer::leave(uint32_t first, uint32_t count) {
    for (uint32_t i = first; i < first + count; ++i)
        left_.push_back(i);
}

} // namespace mlrt
