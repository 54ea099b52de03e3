// What a ray is expected to pay for a cell: the surface area heuristic (MacDonald and Booth
// 1990).
#pragma once

#include "base/vec.h"
#include "kdtree/builder.h"

namespace mlrt {

inline double extent(const Box3f &cell, int axis) {
    return double(cell.hi[axis]) - double(cell.lo[axis]);
}

// In double: neither overflows nor underflows for any cell of finite floats.
inline double surface_area(const Box3f &cell) {
    const double x = extent(cell, 0), y = extent(cell, 1), z = extent(cell, 2);
    return 2 * (x * y + y * z + z * x);
}

inline Box3f lower_part(Box3f cell, int axis, float position) {
    cell.hi[axis] = position;
    return cell;
}

inline Box3f upper_part(Box3f cell, int axis, float position) {
    cell.lo[axis] = position;
    return cell;
}

// Costs that differ by less are equal, and the plane found first is kept. Planes with as
// many references on the one side as on the other all cost the same: rounding must not
// choose.
constexpr double COST_TIE = 0x1p-40;

inline bool is_cheaper(double cost, double than) {
    return cost < than * (1 - COST_TIE);
}

// Expected costs of a ray that enters a cell of positive area, which is split across one
// axis:
//     C_split = K_T + K_I (A_L / A N_L + A_R / A N_R)   C_leaf = K_I N
// (Wald and Havran 2006, equation 4 and section 3.3), C_split times the bonus if a side is
// empty.
class SplitCost {
public:
    SplitCost(const BuildOptions &options, const Box3f &cell, int axis)
        : traversal_(options.traversal_cost), intersection_(options.intersection_cost),
          empty_bonus_(options.empty_bonus), lo_(cell.lo[axis]), hi_(cell.hi[axis]) {
        const double u = extent(cell, (axis + 1) % 3), v = extent(cell, (axis + 2) % 3);
        const double area = u * v + extent(cell, axis) * (u + v);
        base_share_ = u * v / area;
        share_per_length_ = (u + v) / area;
    }

    double operator()(double position, uint64_t lower_count, uint64_t upper_count) const {
        const double lower = base_share_ + share_per_length_ * (position - lo_);
        const double upper = base_share_ + share_per_length_ * (hi_ - position);
        const double cost = traversal_ + intersection_ * (lower * double(lower_count) +
                                                          upper * double(upper_count));
        return lower_count == 0 || upper_count == 0 ? empty_bonus_ * cost : cost;
    }

private:
    double traversal_, intersection_, empty_bonus_;
    double lo_, hi_;
    double base_share_, share_per_length_;
};

} // namespace mlrt
