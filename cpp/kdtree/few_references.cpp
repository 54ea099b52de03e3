#include "kdtree/few_references.h"

#include "base/check.h"
#include "base/simd.h"
#include "kdtree/sah.h"

#include <array>

namespace mlrt {

namespace {

// Costs that differ by less are equal: single precision cannot tell them apart.
constexpr float COST_TIE_OF_FEW = 0x1p-20f;

// The cost of splitting a cell across one axis, in single precision: of planes that differ
// by less either will do.
class CostAcross {
public:
    CostAcross(const BuildOptions &options, const Box3f &cell, int axis)
        : traversal_(options.traversal_cost), intersection_(options.intersection_cost),
          empty_bonus_(options.empty_bonus), lo_(cell.lo[axis]), hi_(cell.hi[axis]) {
        const double u = extent(cell, (axis + 1) % 3), v = extent(cell, (axis + 2) % 3);
        const double length = extent(cell, axis);
        const double area = u * v + length * (u + v);
        base_share_ = float(u * v / area);
        side_share_ = float(length * (u + v) / area);
        // In two factors: one alone may be infinite.
        constexpr double TINY = 0x1p-60;
        enlarge_ = length < TINY ? float(1 / TINY) : 1;
        per_half_length_ = float(2 / (length * enlarge_));
    }

    // Infinite for planes that are not strictly inside the cell.
    FloatPacket operator()(const FloatPacket &position, const FloatPacket &lower_count,
                           const FloatPacket &upper_count) const {
        // Halves, whose difference does not overflow.
        const FloatPacket fraction =
            (position * 0.5f - FloatPacket(lo_ * 0.5f)) * enlarge_ * per_half_length_;
        const FloatPacket lower = fraction * side_share_ + base_share_;
        const FloatPacket upper = (1.0f - fraction) * side_share_ + base_share_;
        const FloatPacket cost =
            (lower * lower_count + upper * upper_count) * intersection_ + traversal_;
        const auto empty = minimum(lower_count, upper_count) == 0.0f;
        const auto inside = (position > lo_) & (position < hi_);
        return select(inside, select(empty, cost * empty_bonus_, cost),
                      FloatPacket(std::numeric_limits<float>::infinity()));
    }

private:
    float traversal_, intersection_, empty_bonus_;
    float lo_, hi_;
    float base_share_, side_share_, enlarge_, per_half_length_;
};

} // namespace

std::optional<Candidate> best_plane_of_few(const References &references, const Box3f &cell,
                                           const BuildOptions &options) {
    MLRT_CHECK(references.count() <= MAX_FEW_REFERENCES);
    // Sixteen planes, with what is in them either below or above.
    struct Planes {
        FloatPacket position, cost, lower_count, upper_count;
        int axis;
        bool planar_below;
    };
    constexpr uint32_t MAX_PACKETS = 2 * uint32_t(MAX_FEW_REFERENCES) / PACKET_WIDTH;
    std::array<Planes, 3 * 2 * MAX_PACKETS> tried;
    uint32_t tried_count = 0;
    float least = std::numeric_limits<float>::infinity();

    for (int axis = 0; axis < 3; ++axis) {
        if (!(cell.lo[axis] < cell.hi[axis]))
            continue;
        const CostAcross cost(options, cell, axis);
        alignas(64) float positions[2 * MAX_FEW_REFERENCES + PACKET_WIDTH];
        bool any_flat = false;
        uint32_t count = 0;
        for (const Reference &reference : references.list) {
            const float lo = reference.bounds.lo[axis], hi = reference.bounds.hi[axis];
            positions[count++] = lo;
            positions[count++] = hi;
            any_flat |= lo == hi;
        }
        // Faces of the cell are never planes to split it.
        store(positions + count, FloatPacket(cell.lo[axis]));

        const auto offer = [&](const FloatPacket &position, const FloatPacket &lower_count,
                               const FloatPacket &upper_count, bool planar_below) {
            const FloatPacket costs = cost(position, lower_count, upper_count);
            least = minimum(least, least_lane(costs));
            tried[tried_count++] = {position,    costs, lower_count,
                                    upper_count, axis,  planar_below};
        };
        for (uint32_t first = 0; first < count; first += PACKET_WIDTH) {
            const FloatPacket position = load<FloatPacket>(positions + first);
            const FloatPacket zero(0.0f), one(1.0f);
            FloatPacket below(0.0f), above(0.0f);
            for (const Reference &reference : references.list) {
                below += select(position > reference.bounds.lo[axis], one, zero);
                above += select(position < reference.bounds.hi[axis], one, zero);
            }
            if (!any_flat) {
                offer(position, below, above, true);
                continue;
            }
            FloatPacket planar(0.0f);
            for (const Reference &reference : references.list)
                if (reference.bounds.lo[axis] == reference.bounds.hi[axis])
                    planar += select(position == reference.bounds.lo[axis], one, zero);
            offer(position, below + planar, above, true);
            offer(position, below, above + planar, false);
        }
    }

    // As in the sweep: rounding must not choose among planes of the same cost.
    const float limit = least * (1 + COST_TIE_OF_FEW);
    std::optional<Candidate> best;
    for (uint32_t i = 0; i < tried_count; ++i) {
        const Planes &planes = tried[i];
        const LaneBits tied = to_bits(planes.cost <= limit) &
                              to_bits(planes.cost < std::numeric_limits<float>::infinity());
        if (tied == 0 || (best && best->plane.axis != planes.axis))
            continue;
        const FloatPacket lowest =
            select(from_bits<FloatPacket>(tied), planes.position,
                   FloatPacket(std::numeric_limits<float>::infinity()));
        const float position = least_lane(lowest);
        if (best && !(position < best->plane.position))
            continue;
        const uint32_t lane = uint32_t(__builtin_ctz(to_bits(lowest == position)));
        best = Candidate{{planes.axis, position, planes.planar_below},
                         uint64_t(to_lanes<float>(planes.lower_count)[lane]),
                         uint64_t(to_lanes<float>(planes.upper_count)[lane]),
                         least};
    }
    return best;
}

std::vector<PlanarGroup> planar_groups_of_few(const References &references,
                                              const Box3f &cell) {
    std::vector<PlanarGroup> groups;
    for (int axis = 0; axis < 3; ++axis) {
        if (!(cell.lo[axis] < cell.hi[axis]))
            continue;
        double flat_area = 0;
        for (const Reference &reference : references.list)
            if (reference.bounds.lo[axis] == reference.bounds.hi[axis])
                flat_area += area_across(reference.bounds, axis);
        if (!(cover_limit(cell, axis, flat_area) >= 1))
            continue;
        const size_t first_group = groups.size();
        for (const Reference &reference : references.list) {
            const float position = reference.bounds.lo[axis];
            if (position != reference.bounds.hi[axis])
                continue;
            auto group = groups.begin() + std::ptrdiff_t(first_group);
            while (group != groups.end() && group->position != position)
                ++group;
            if (group == groups.end())
                group = groups.insert(group, PlanarGroup{axis, position, {}});
            group->planar.push_back(reference);
        }
    }
    return groups;
}

} // namespace mlrt
