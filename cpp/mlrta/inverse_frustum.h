// Inverse frustum culling: instead of testing a cell against the planes of a frustum, ask
// where the beam crosses the planes of the cell (Reshetov, Soupikov, Hurley 2005,
// section 3.2.1).
//
// Both steps only ever say what no ray of the beam can do. "May" means that it could not be
// excluded.
#pragma once

#include "base/simd.h"
#include "mlrta/beam.h"

#include <array>

namespace mlrt {

struct AxisPlane {
    int axis;
    float position;
};

// Children of an inner node that rays of a beam may enter. Near is the child on the side of
// the plane that the rays start on; if they start on both sides, or in the plane, both may
// be entered. If neither may, no ray meets the cell.
struct Sides {
    bool near, far;
    bool upper_is_near;
};

// A beam made ready for many cells.
//
// Cells are given by what their six faces look like from the rays' origins: inside() of a
// face is how far the innermost of the origins lies on the face's inner side. In lanes 0 to
// 2 that is max o_k - lo_k for the lower faces, in lanes 4 to 6 hi_k - min o_k for the
// upper ones. It is negative where all rays start outside of the face.
//
// Error bounds. A ray that has gone the distance x along its heading of axis k has moved
// outward of a face of another axis j by x m, where m = +-d_j / |d_k|. The rays have all
// left the face's inner side for certain if the least x m exceeds inside(). Let M be the
// lower bound of m, and x1 <= x <= x2, so that x m >= min(x1 M, x2 M). Computed are
// inside() (1 + e), x1 (1 + e), x2 (1 + e), |e| <= u = 2^-24: differences of two floats,
// which don't underflow. M is lowered by 8u |M| and some more when it is made a float, so
// that
//     float(x1) float(M) <= x1 M - 5u |x1 M|.
// If that product, once rounded, exceeds the float inside() (1 + e), it does so before,
// because rounding is monotone. And p - 5u |p| > i (1 + e) implies p > i: for i >= 0
// because then p (1 - 5u) > i (1 - u), for p < 0 because then |p| (1 + 5u) < |i| (1 + u),
// and else i < 0 <= p. Distances along the heading have bounds with the same margin.
// Nothing overflows in the cells of which the beam says_something().
class InverseFrustum {
public:
    explicit InverseFrustum(const Beam &beam);

    // Lets the beam end at t_max at the latest.
    void shorten(double t_max);

    BoxPacket inside(const Box3f &cell) const {
        alignas(32) std::array<float, 8> faces{};
        for (int k = 0; k < 3; ++k) {
            faces[size_t(k)] = axes_[k].last_origin - cell.lo[k];
            faces[size_t(k) + 4] = cell.hi[k] - axes_[k].first_origin;
        }
        return load<BoxPacket>(faces.data());
    }

    // Whether the beam can exclude anything in a cell: it has a heading along an axis, and
    // distances to all planes across the cell are finite, with a margin.
    bool says_something(const BoxPacket &inside) const {
        return (axes_[0].heading != 0 || axes_[1].heading != 0 || axes_[2].heading != 0) &&
               !any_lane(~(absolute(inside) < BoxPacket(0x1p126f)));
    }

    // Faces of a child of a cell that is split.
    BoxPacket child(const BoxPacket &inside, AxisPlane plane, bool upper) const {
        const Axis &axis = axes_[plane.axis];
        const float of_plane =
            upper ? axis.last_origin - plane.position : plane.position - axis.first_origin;
        const BoxLanes lane(plane.axis + (upper ? 0 : 4));
        return select(MaskOf<BoxPacket>(lane_numbers<BoxLanes>() == lane),
                      BoxPacket(of_plane), inside);
    }

    // Whether the upper child is the near one, if one is.
    bool upper_is_near(AxisPlane plane) const {
        return axes_[plane.axis].first_origin > plane.position;
    }

    // Step 1, at an inner node.
    Sides sides(const BoxPacket &inside, AxisPlane plane) const {
        const Axis &axis = axes_[plane.axis];
        const float nearest = axis.heading * (plane.position - axis.nearest_origin);
        const float farthest = axis.heading * (plane.position - axis.farthest_origin);
        const bool upper = upper_is_near(plane);
        // If not, then rays start on both sides or in the plane, their headings differ, or
        // all of them move away from it.
        if (!(nearest > 0))
            return {true, !(farthest < 0), upper};
        BoxPacket moved = nearest * axis.outward_slope;
        if (nearest != farthest)
            moved = minimum(moved, BoxPacket(farthest * axis.outward_slope));
        // Where the rays cross the plane they are outside of these faces. If all rays start
        // outside of such a face, none has reached its inner side yet, and they can meet
        // the cell only beyond the plane. If not, all of them move outward: those that
        // started inside have left, the others move away.
        const LaneBits outside = to_bits(moved > inside);
        const LaneBits start_outside = to_bits(inside < BoxPacket(0.0f));
        return {(outside & start_outside) == 0,
                (outside & ~start_outside) == 0 && !(nearest > axis.reach), upper};
    }

    // Whether the cell lies behind the beam or beyond its end: what step 2 begins with.
    bool out_of_reach(const BoxPacket &inside) const {
        return to_bits(inside < least_inside_) != 0;
    }

    // No ray meets the cell before this parameter.
    float earliest_entry(const BoxPacket &inside) const;

    // Step 2, at a leaf: whether a ray of the beam may pass through its cell.

    // Mode P (the paper): compares, for each pair of axes, when the beam as a whole has
    // entered the one slab and left the other. Ends are intervals over the beam, not values
    // of a ray.
    bool may_enter_by_parameters(const BoxPacket &inside) const;

    // Mode S: the same question through slopes, where the beam leaves one slab has it
    // reached the other? Tighter, because a slope keeps the correlation of d_j and d_k that
    // mode P loses.
    //
    // A ray that starts past the exit face never meets the cell, so that the others matter
    // only: they leave the slab after a distance of at most that of the exit face. What a
    // ray has moved outward by then is at least that distance times M, or, if M is
    // positive, zero; and where all origins lie outside of a face inside() is negative.
    bool may_enter_by_slopes(const BoxPacket &inside) const {
        if (out_of_reach(inside))
            return false;
        const LaneBits start_outside = to_bits(inside < BoxPacket(0.0f));
        if (start_outside == 0)
            return true;
        alignas(32) std::array<float, 8> face;
        store(face.data(), inside);
        LaneBits still_outside = 0;
        for (const Axis &axis : axes_)
            still_outside |= to_bits(face[axis.exit_face] * axis.outward_slope > inside);
        return (still_outside & start_outside) == 0;
    }

private:
    struct alignas(64) Axis {
        // Lower bounds of d_j / |d_k| outward of each face, for k this axis; not a number
        // for faces across it, or if its heading is mixed.
        BoxPacket outward_slope;
        float first_origin, last_origin;
        float heading;                         // sign of d_k, 0 if mixed
        float nearest_origin, farthest_origin; // from what lies ahead
        float reach;                           // no ray goes farther along this axis
        uint32_t entry_face, exit_face;        // lanes
    };

    std::array<Axis, 3> axes_;
    BoxPacket least_inside_; // of cells that may be reached
    std::array<double, 3> least_reciprocal_, greatest_reciprocal_; // of |d_k|
};

} // namespace mlrt
