#include "mlrta/inverse_frustum.h"

#include <algorithm>

namespace mlrt {

namespace {

// Covers the roundings of a difference, a product and a sum in double, many times over.
constexpr double ROUNDING = 0x1p-45;

// Coordinate j of the beam where it crosses the plane {x_k = position}, for k not mixed.
Range crossing(const Beam &beam, int k, double position, int j) {
    const Range distance{position - beam.origin[k].hi, position - beam.origin[k].lo};
    const Range offset = distance * beam.slope[k][j];
    const double slack = ROUNDING * (beam.origin[j].magnitude() + offset.magnitude() +
                                     std::abs(position) * beam.slope[k][j].magnitude());
    return {beam.origin[j].lo + offset.lo - slack, beam.origin[j].hi + offset.hi + slack};
}

// Ray parameters at which the beam crosses the plane {x_k = position}, for k not mixed.
Range crossing_parameter(const Beam &beam, int k, double position) {
    const Range distance{position - beam.origin[k].hi, position - beam.origin[k].lo};
    const Range t = distance * beam.reciprocal[k];
    const double slack =
        ROUNDING * (t.magnitude() + std::abs(position) * beam.reciprocal[k].magnitude());
    return {t.lo - slack, t.hi + slack};
}

// Whether every ray ends before it crosses the plane {x_k = position}, for k not mixed. A
// hit counts if its distance is at most t_max once it has been rounded to float, which may
// be half a unit in the last place less than the exact one.
bool crosses_beyond_end(const Beam &beam, int k, double position) {
    constexpr double ROUNDED = 1 + 0x1p-23, SMALLEST_FLOAT = 0x1p-149;
    return crossing_parameter(beam, k, position).lo > beam.t_max * ROUNDED + SMALLEST_FLOAT;
}

struct Slab {
    double entry_face, exit_face;
};

Slab slab_of(const Beam &beam, const Box3f &cell, int k) {
    return beam.heading[k] == Heading::positive ? Slab{cell.lo[k], cell.hi[k]}
                                                : Slab{cell.hi[k], cell.lo[k]};
}

// Whether every ray moves away from the slab from the start.
bool behind(const Beam &beam, const Box3f &cell, int k) {
    return (beam.heading[k] == Heading::positive && cell.hi[k] < beam.origin[k].lo) ||
           (beam.heading[k] == Heading::negative && cell.lo[k] > beam.origin[k].hi);
}

// What both modes of step 2 begin with: the cell lies behind the beam or beyond its end.
bool out_of_reach(const Beam &beam, const Box3f &cell) {
    for (int k = 0; k < 3; ++k) {
        if (beam.heading[k] == Heading::mixed)
            continue;
        if (behind(beam, cell, k) ||
            crosses_beyond_end(beam, k, slab_of(beam, cell, k).entry_face))
            return true;
    }
    return false;
}

} // namespace

Cull cull_children(const Beam &beam, const Box3f &cell, AxisPlane plane) {
    const int k = plane.axis;
    const Range &o = beam.origin[k];
    if (o.lo <= plane.position && plane.position <= o.hi)
        return Cull::both;
    if (beam.heading[k] == Heading::mixed)
        return Cull::both;
    if ((plane.position > o.hi) != (beam.heading[k] == Heading::positive))
        return Cull::near_only;
    if (crosses_beyond_end(beam, k, plane.position))
        return Cull::near_only;
    for (int step = 1; step < 3; ++step) {
        const int j = (k + step) % 3;
        const Range at_plane = crossing(beam, k, plane.position, j);
        // Beside the cell's slab where it crosses the plane: if all rays start on that same
        // side, none has reached the slab yet, and they can meet the cell only beyond the
        // plane. If not, all of them move towards that side: those that start in the slab
        // or past it have left it, the others move away from it.
        if (at_plane.hi < cell.lo[j])
            return beam.origin[j].hi < cell.lo[j] ? Cull::far_only : Cull::near_only;
        if (at_plane.lo > cell.hi[j])
            return beam.origin[j].lo > cell.hi[j] ? Cull::far_only : Cull::near_only;
    }
    return Cull::both;
}

bool may_enter_by_parameters(const Beam &beam, const Box3f &cell) {
    if (out_of_reach(beam, cell))
        return false;
    double latest_entry = -std::numeric_limits<double>::infinity();
    double earliest_exit = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
        if (beam.heading[k] == Heading::mixed)
            continue;
        const Slab slab = slab_of(beam, cell, k);
        latest_entry =
            std::max(latest_entry, crossing_parameter(beam, k, slab.entry_face).lo);
        earliest_exit =
            std::min(earliest_exit, crossing_parameter(beam, k, slab.exit_face).hi);
    }
    // The pairs of unlike axes are the six comparisons; a slab is never left before it is
    // entered.
    return latest_entry <= earliest_exit;
}

bool may_enter_by_slopes(const Beam &beam, const Box3f &cell) {
    if (out_of_reach(beam, cell))
        return false;
    for (int k = 0; k < 3; ++k) {
        if (beam.heading[k] == Heading::mixed)
            continue;
        const double exit_face = slab_of(beam, cell, k).exit_face;
        for (int step = 1; step < 3; ++step) {
            const int j = (k + step) % 3;
            const Range at_exit = crossing(beam, k, exit_face, j);
            if ((beam.origin[j].hi < cell.lo[j] && at_exit.hi < cell.lo[j]) ||
                (beam.origin[j].lo > cell.hi[j] && at_exit.lo > cell.hi[j]))
                return false;
        }
    }
    return true;
}

} // namespace mlrt
