#include "mlrta/parallel_walk.h"

#include "geometry/triangle_test.h"
#include "traverse/parameter_interval.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

// With (p, q) the coordinates in the beam's rectangle, a side is the plane
// +-(p - center) = half, where p = cosine u + sine v and so on, with u = x_i - slope_u z.
ParallelWalk::ParallelWalk(const KdTree &tree, const BeamPackets &beam,
                           BeamTriangleTests<Query::any> &tests, Counters &counters)
    : tree_(tree), beam_(beam), tests_(tests), counters_(counters) {
    const SlopeRectangle &r = beam.rectangle;
    const auto [i, j, k] = beam.axes;
    const float c = r.cosine, s = r.sine;
    const float of_p = -beam.side * (c * beam.slope_u + s * beam.slope_v);
    const float of_q = -beam.side * (c * beam.slope_v - s * beam.slope_u);
    const std::array<float, 4> normal_i{c, -c, -s, s}, normal_j{s, -s, c, -c};
    const std::array<float, 4> normal_k{of_p, -of_p, of_q, -of_q};
    side_normals_[i] = load<PointPacket>(normal_i.data());
    side_normals_[j] = load<PointPacket>(normal_j.data());
    side_normals_[k] = load<PointPacket>(normal_k.data());

    // Sixteen roundings of terms of at most this size are more than there are.
    const Box3f &bounds = tree.bounds;
    const float reach = std::max(max_component(abs(bounds.lo - beam.origin)),
                                 max_component(abs(bounds.hi - beam.origin)));
    const float slopes = 1 + std::abs(beam.slope_u) + std::abs(beam.slope_v);
    const float center = std::abs(r.center_u) + std::abs(r.center_v);
    const float slack =
        16 * FLOAT_ROUNDOFF * (2 * slopes * reach + 2 * center + r.half_p + r.half_q) +
        2 * beam.uncertainty(reach) + 0x1p-100f;
    const float at_p = r.center_u * c + r.center_v * s;
    const float at_q = r.center_v * c - r.center_u * s;
    const std::array<float, 4> offsets{at_p + r.half_p + slack, -at_p + r.half_p + slack,
                                       at_q + r.half_q + slack, -at_q + r.half_q + slack};
    side_offsets_ = load<PointPacket>(offsets.data());

    FloatPacket begin = INFINITE;
    for (uint32_t n = 0; n < beam.count; ++n)
        begin = minimum(select(from_bits<FloatPacket>(beam.lanes[n].active),
                               -beam.begins[n].greatest, FloatPacket(INFINITE)),
                        begin);
    begin_ = least_lane(begin);
    depth_slack_ = 4 * FLOAT_ROUNDOFF * reach + 0x1p-100f;

    descends_[i] = beam.slope_u < 0;
    descends_[j] = beam.slope_v < 0;
    descends_[k] = beam.side < 0;
}

bool ParallelWalk::may_enter() const {
    const int k = beam_.axes[2];
    const float first = beam_.side > 0 ? cell_[k] : -cell_[3 + k];
    const float last = beam_.side > 0 ? cell_[3 + k] : -cell_[k];
    if (first - depth_slack_ > tests_.far_end() || last + depth_slack_ < begin_)
        return false;
    PointPacket innermost = -side_offsets_;
    for (int axis = 0; axis < 3; ++axis)
        innermost = innermost + minimum(side_normals_[axis] * PointPacket(cell_[axis]),
                                        side_normals_[axis] * PointPacket(cell_[3 + axis]));
    return !any_lane(innermost > 0.0f);
}

bool ParallelWalk::walk(const Entry &entry) {
    // A child that waits for the nearer one.
    struct Pending {
        uint32_t node;
        uint32_t changes; // of the cell, up to its parent
        uint32_t bound;   // that its plane moves, and where to
        float split;
    };
    struct Change {
        uint32_t bound;
        float before;
    };
    std::array<Pending, MAX_TREE_DEPTH + 1> stack;
    std::array<Change, MAX_TREE_DEPTH + 1> changes;
    uint32_t pending = 0, changed = 0;
    for (int axis = 0; axis < 3; ++axis) {
        cell_[axis] = entry.cell.lo[axis] - beam_.origin[axis];
        cell_[3 + axis] = entry.cell.hi[axis] - beam_.origin[axis];
    }
    const auto change = [&](uint32_t bound, float value) {
        changes[changed++] = {bound, cell_[bound]};
        cell_[bound] = value;
    };
    const auto undo = [&](uint32_t kept) {
        while (changed > kept) {
            --changed;
            cell_[changes[changed].bound] = changes[changed].before;
        }
    };
    if (tests_.all_done() || !may_enter())
        return true;
    uint32_t index = entry.node;
    for (;;) {
        ++counters_.beam_steps;
        const KdNode node = tree_.node(index);
        bool enters = false;
        if (!node.is_leaf()) {
            const uint32_t axis = uint32_t(node.axis());
            const float split = node.split() - beam_.origin[int(axis)];
            const bool to_upper = descends_[axis];
            // The nearer child ends at the plane, the farther one begins there.
            const uint32_t near_bound = to_upper ? axis : 3 + axis;
            const uint32_t far_bound = to_upper ? 3 + axis : axis;
            stack[pending++] = {node.lower_child() + !to_upper, changed, far_bound, split};
            change(near_bound, split);
            index = node.lower_child() + to_upper;
            enters = may_enter();
        } else if (node.reference_count() > 0) {
            ++counters_.leaf_visits;
            tests_.test_leaf(node);
            if (tests_.spent())
                return false;
        }
        while (!enters) {
            if (pending == 0)
                tests_.flush();
            if (pending == 0 || tests_.all_done())
                return true;
            const Pending &next = stack[--pending];
            undo(next.changes);
            change(next.bound, next.split);
            index = next.node;
            enters = may_enter();
        }
    }
}

} // namespace mlrt
