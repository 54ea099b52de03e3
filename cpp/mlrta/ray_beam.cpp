#include "base/reciprocal_estimate.h"
#include "base/simd.h"
#include "mlrta/beam.h"
#include "mlrta/packet_range.h"
#include "traverse/load_packet.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace mlrt {

namespace {

// For a beam without better ones: the slopes along its main axis, as planes.
void planes_from_slopes(Beam &beam) {
    for (int k = 0; k < 3; ++k) {
        if (beam.heading[k] == Heading::mixed)
            continue;
        const double sign = beam.heading[k] == Heading::positive ? 1 : -1;
        int plane = 0;
        for (int step = 1; step < 3; ++step) {
            const int j = (k + step) % 3;
            // d_j / d_k >= lo and <= hi, multiplied by d_k.
            Vec3d above{}, below{};
            above[j] = sign;
            above[k] = -sign * beam.slope[k][j].lo;
            below[j] = -sign;
            below[k] = sign * beam.slope[k][j].hi;
            beam.plane_normals[plane++] = above;
            beam.plane_normals[plane++] = below;
        }
        beam.plane_slack = WIDEN_RANGE;
        beam.has_planes = beam.has_common_origin();
        return;
    }
}

// For a beam without better ones: of all d / |d_k|, which lie in a rectangle of slopes. The
// narrowest one is taken.
void corners_from_slopes(Beam &beam) {
    double least_area = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
        if (beam.heading[k] == Heading::mixed)
            continue;
        const double sign = beam.heading[k] == Heading::positive ? 1 : -1;
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const Range &a = beam.slope[k][i], &b = beam.slope[k][j];
        const double area = (a.hi - a.lo) * (b.hi - b.lo);
        if (!(area < least_area))
            continue;
        least_area = area;
        beam.corner_axis = k;
        beam.has_corners = true;
        for (int c = 0; c < 4; ++c) {
            beam.corners[c][k] = sign;
            beam.corners[c][i] = sign * (c & 1 ? a.hi : a.lo);
            beam.corners[c][j] = sign * (c & 2 ? b.hi : b.lo);
        }
    }
}

// An estimate of a reciprocal, a rounding to single precision and those of what follows,
// and quotients that underflow.
constexpr double WIDEN_QUOTIENT = 0x1p-21, SMALLEST_QUOTIENT = 0x1p-120;
static_assert(WIDEN_QUOTIENT > 1.5 * RECIPROCAL_ESTIMATE_ERROR);

// Bounds of what the active rays of a group have. Slopes are those along one axis: those
// along the others follow from them.
struct RayBounds {
    int axis;
    std::array<Range, 3> extent; // of directions
    std::array<Range, 3> slope;  // of d_j / d_axis, for the other axes j
    double greatest_t_min, greatest_t_max;

    // Whether no quotient of directions overflows or loses precision where it matters.
    bool slopes_are_safe() const {
        constexpr double LEAST = 0x1p-60, GREATEST = 0x1p60;
        for (const Range &e : extent)
            if (e.magnitude() > GREATEST ||
                (heading_of(e) != Heading::mixed &&
                 std::min(std::abs(e.lo), std::abs(e.hi)) < LEAST))
                return false;
        return true;
    }
};

// As many rays as a register holds: there are many bounds to be kept in registers.
using Lanes = FloatWide;

[[gnu::always_inline]] inline MaskOf<Lanes> are_active(const RayGroup &rays, uint32_t first,
                                                       uint32_t end) {
    auto active = load_padded<Lanes>(rays.t_min, first, end) <
                  load_padded<Lanes>(rays.t_max, first, end);
    for (const float *component : rays.direction)
        active &= absolute(load_padded<Lanes>(component, first, end)) < Lanes(INFINITY);
    return active;
}

// The axis along which the ray in the middle moves most. It need not be active: any axis
// would do, though bounds are narrower along this one.
int main_axis(const RayGroup &rays, uint32_t first, uint32_t count) {
    const uint32_t middle = first + count / 2;
    return largest_axis(Vec3f{rays.direction[0][middle], rays.direction[1][middle],
                              rays.direction[2][middle]});
}

RayBounds bounds_of(const RayGroup &rays, uint32_t first, uint32_t count, int axis) {
    const uint32_t end = first + count;
    const int i = (axis + 1) % 3, j = (axis + 2) % 3;
    const float *along_i = rays.direction[i], *along_j = rays.direction[j],
                *along_axis = rays.direction[axis];
    PacketRange<Lanes> extent_i, extent_j, extent_axis, slope_i, slope_j;
    Lanes greatest_t_min(-INFINITY), greatest_t_max(-INFINITY);
    const Lanes none(PacketRange<Lanes>::NONE);
    for (uint32_t n = first; n < end; n += LANES_OF<Lanes>) {
        const auto active = are_active(rays, n, end);
        const auto of_active = [&](const auto &values) {
            return select(active, load_padded<Lanes>(values, n, end), none);
        };
        const Lanes d_i = of_active(along_i), d_j = of_active(along_j),
                    d_axis = of_active(along_axis);
        extent_i.add(d_i);
        extent_j.add(d_j);
        extent_axis.add(d_axis);
        const Lanes reciprocal = reciprocal_estimate(d_axis);
        slope_i.add(d_i * reciprocal);
        slope_j.add(d_j * reciprocal);
        greatest_t_min = maximum(of_active(rays.t_min), greatest_t_min);
        greatest_t_max = maximum(of_active(rays.t_max), greatest_t_max);
    }
    RayBounds bounds{
        axis, {}, {}, greatest_lane(greatest_t_min), greatest_lane(greatest_t_max)};
    bounds.extent[i] = extent_i.of_all_lanes();
    bounds.extent[j] = extent_j.of_all_lanes();
    bounds.extent[axis] = extent_axis.of_all_lanes();
    const auto widened = [](const PacketRange<Lanes> &slopes) -> Range {
        const Range rough = slopes.of_all_lanes().widened(WIDEN_QUOTIENT);
        return {rough.lo - SMALLEST_QUOTIENT, rough.hi + SMALLEST_QUOTIENT};
    };
    bounds.slope[i] = widened(slope_i);
    bounds.slope[j] = widened(slope_j);
    return bounds;
}

std::array<Range, 3> origins_of(const RayGroup &rays, uint32_t first, uint32_t count) {
    Vec3<PacketRange<Lanes>> ranges;
    for (uint32_t n = first; n < first + count; n += LANES_OF<Lanes>) {
        const auto active = are_active(rays, n, first + count);
        for (int k = 0; k < 3; ++k)
            ranges[k].add(select(active,
                                 load_padded<Lanes>(rays.origin[k], n, first + count),
                                 Lanes(PacketRange<Lanes>::NONE)));
    }
    return {ranges.x.of_all_lanes(), ranges.y.of_all_lanes(), ranges.z.of_all_lanes()};
}

using SlopesByAxis = std::array<std::array<Range, 3>, 3>;

// d_j / d_k = (d_j / d_m) (d_m / d_k) with the axis m that slopes are known along. Exact
// ranges are quotients of exact ones, as long as rays fill the rectangle of slopes.
void put_other_slopes(const RayBounds &bounds, int k, Beam &beam) {
    const int m = bounds.axis, j = 3 - k - m;
    const Range inverse = bounds.slope[k].reciprocal();
    beam.slope[k][m] = inverse;
    beam.slope[k][j] = bounds.slope[j] * inverse;
}

// The slopes in double precision, for directions of any size.
SlopesByAxis exact_slopes(const RayGroup &rays, uint32_t first, uint32_t count) {
    SlopesByAxis slope;
    for (uint32_t i = first; i < first + count; ++i) {
        const Vec3d d{rays.direction[0][i], rays.direction[1][i], rays.direction[2][i]};
        if (!(rays.t_min[i] < rays.t_max[i]) || !is_finite(d))
            continue;
        // Along an axis with a zero component these are infinite or NaN, and not used.
        for (int k = 0; k < 3; ++k)
            for (int step = 1; step < 3; ++step) {
                const int j = (k + step) % 3;
                slope[k][j].add(d[j] / d[k]);
            }
    }
    return slope;
}

} // namespace

Beam ray_beam(const RayGroup &rays, uint32_t first, uint32_t count) {
    RayBounds bounds = bounds_of(rays, first, count, main_axis(rays, first, count));
    // Where rays go both ways along it, another axis may still do.
    for (int k = 0; k < 3 && heading_of(bounds.extent[bounds.axis]) == Heading::mixed; ++k)
        if (heading_of(bounds.extent[k]) != Heading::mixed)
            bounds = bounds_of(rays, first, count, k);

    Beam beam;
    // A negative t_min counts as zero.
    beam.t_min = std::max(bounds.greatest_t_min, 0.0);
    beam.t_max = bounds.greatest_t_max;
    const bool safe = bounds.slopes_are_safe();
    if (!safe)
        beam.slope = exact_slopes(rays, first, count);
    if (!rays.has_common_origin)
        beam.origin = origins_of(rays, first, count);
    for (int k = 0; k < 3; ++k) {
        if (rays.has_common_origin)
            beam.origin[k] = {rays.common_origin[k], rays.common_origin[k]};
        const Range &extent = bounds.extent[k];
        beam.heading[k] = heading_of(extent);
        if (beam.heading[k] == Heading::mixed)
            continue;
        beam.reciprocal[k] = extent.reciprocal().widened(WIDEN_RANGE);
        if (safe && k == bounds.axis)
            beam.slope[k] = bounds.slope;
        else if (safe && heading_of(bounds.slope[k]) != Heading::mixed)
            put_other_slopes(bounds, k, beam);
        else if (safe)
            beam.heading[k] = Heading::mixed; // as far as is known
        for (Range &slope : beam.slope[k])
            slope = slope.widened(WIDEN_RANGE);
    }
    planes_from_slopes(beam);
    if (rays.has_common_origin)
        corners_from_slopes(beam);
    return beam;
}

} // namespace mlrt
