#include "base/exactness.h"
#include "base/fused_difference.h"
#include "base/magnitude.h"
#include "geometry/triangle_block.h"
#include "geometry/triangle_test.h"
#include "mlrta/form_layout.h"
#include "traverse/parameter_interval.h"

namespace mlrt {

namespace {

// What exceeds these might overflow on the way to a form, what falls below might lose
// digits to underflow.
constexpr float LARGEST_SIZE = 0x1p40f, SMALLEST_VOLUME = 0x1p-100f;
constexpr float SMALLEST_DEPTH = 0x1p-60f;

// What underflow may take from a component of a normal, and from a volume by unit of size.
constexpr float UNDERFLOW = 0x1p-146f;

// Bounds on errors, in units of roundoff, with u of single and U of double precision.
//
// Vectors are sheared to (x - slope_u side z, y - slope_v side z, z), which leaves volumes
// as they are, and the slopes of the beam's rays small. Let l be the largest x or y of a
// sheared vertex relative to the origin, s its largest component before the shear, e that
// of a sheared edge, and w the greatest |u| + |v| of rays. Slopes that others are relative
// to do not exceed 2, so that the shear, or its inverse, makes no component more than three
// times as large.
//
// Edges: a vertex is rounded to within u l along x and y and u s along z, after 8 U s in
// double precision; an edge, in single precision, to within 6 u e and u e. A component of a
// normal along x or y then has an error of at most u e (4 l + 9 s), and 18 u l e along z,
// but for 8 U s e and 16 U s e. Dividing by the volume rounds twice more, of at most (l +
// s) e and 2 l e, u and v have three roundings, and evaluating a form two: 26 u l e and w u
// e (11 l + 16 s) in all. Over a rectangle there are six more: 38 u l e and w u e (17 l +
// 22 s). With r = l + w (l + s) that is at most 26 u r e and 38 u r e; 28 and 40 cover
// products of roundings and the bound itself, as 32 does for U s e (1 + w).
constexpr float EDGE_ROUNDINGS = 40 * FLOAT_ROUNDOFF, RAY_ROUNDINGS = 28 * FLOAT_ROUNDOFF;
constexpr float SHEAR_ROUNDINGS = float(32 * DOUBLE_ROUNDOFF);
// Depth: N comes from double precision, where thin triangles keep its digits. With n the
// largest of its components along x and y before the shear, and m its value where u and v
// are zero, 12 roundings of at most m + w n are left, that of the bound, and of m in double
// precision few of 5 times the largest component.
constexpr float PLANE_ROUNDINGS = 16 * FLOAT_ROUNDOFF;
// The volume a.N in double: N has a difference, a product and another difference, the rest
// a difference, a product and two sums: 8 roundings in a row of three terms of 2 s e^2,
// with e before the shear.
constexpr double VOLUME_ROUNDINGS = 9 * 52 * DOUBLE_ROUNDOFF;

} // namespace

template <typename Real>
void TriangleForms::set_block(const BeamPackets &beam, float least,
                              const Triangle *triangles, const uint32_t *numbers,
                              uint32_t count) {
    const TriangleBlock<Real> block(triangles, numbers);
    // In the order (i, j, k), which is cyclic and keeps the sign of products.
    const auto [i, j, k] = beam.axes;
    const auto vertex = [&](const Vec3<Real> &v) -> Vec3<Real> {
        return {v[i], v[j], v[k]};
    };
    const Vec3<Real> o{Real(beam.origin[i]), Real(beam.origin[j]), Real(beam.origin[k])};
    const Vec3<Real> va = vertex(block.a), vb = vertex(block.b), vc = vertex(block.c);
    const Vec3<Real> oa = va - o, ob = vb - o, oc = vc - o;
    const Real size = maximum(largest_component(oa),
                              maximum(largest_component(ob), largest_component(oc)));
    const LaneBits given = (1u << count) - 1;
    MaskOf<Real> safe = EXACT ? size < LARGEST_SIZE : MaskOf<Real>(true);

    // Where the vertices lie in the rectangle. A slope has four roundings, the center one,
    // a difference, two products and a sum follow, and the middle and extent of all: less
    // than 16 of at most the greatest coordinate and slope.
    const auto slopes = [&](const Vec3<Real> &v) -> Vec2<Real> {
        const Real reciprocal = 1.0f / (v.z * beam.side);
        return {v.x * reciprocal, v.y * reciprocal};
    };
    LaidRectangle<Real> rectangle(beam.rectangle);
    const Real center_u = rectangle.center_u, center_v = rectangle.center_v;
    rectangle.center_u = center_u + beam.slope_u;
    rectangle.center_v = center_v + beam.slope_v;
    const VertexBox<Real> box(rectangle, {slopes(oa), slopes(ob), slopes(oc)});
    const Real slack =
        (32 * FLOAT_ROUNDOFF) * (box.farthest() + (1 + std::abs(beam.slope_u) +
                                                   std::abs(beam.slope_v) + beam.spread));
    const auto ahead =
        minimum(oa.z * beam.side, minimum(ob.z * beam.side, oc.z * beam.side)) >
        SMALLEST_DEPTH;
    // The box is right for all triangles whose vertices are moderate. A block that misses
    // with all of them needs nothing else, though some may be degenerate.
    const MaskOf<Real> misses = put_box(rectangle, box, slack, ahead);
    possible = unsafe = 0;
    if ((given & ~to_bits(misses & safe)) == 0)
        return;

    using Precise = std::conditional_t<EXACT, DoubleOf<Real>, Real>;
    const Vec3<Precise> pa(va), pb(vb), pc(vc), po(o);
    // Gives z as it is rounded already.
    const auto sheared = [&](const auto &v, const Real &z) -> Vec3<Real> {
        using Component = std::decay_t<decltype(v.x)>;
        const Component slope_u(beam.side * beam.slope_u);
        const Component slope_v(beam.side * beam.slope_v);
        return {Real(fused_difference(v.z, slope_u, v.x)),
                Real(fused_difference(v.z, slope_v, v.y)), z};
    };
    const Vec3<Precise> to_vertex = pa - po;
    const Vec3<Real> a = sheared(to_vertex, oa.z), b = sheared(pb - po, ob.z),
                     c = sheared(pc - po, oc.z);
    const auto edge_between = [&](const Vec3<Real> &from, const Vec3<Real> &to) {
        const Vec3<Real> edge = to - from;
        return sheared(edge, edge.z);
    };
    const Vec3<Real> ab = edge_between(va, vb), bc = edge_between(vb, vc),
                     ca = edge_between(vc, va);
    Vec3<Real> normals[4] = {cross(b, bc), cross(c, ca), cross(a, ab)};
    const Vec3<Precise> p = pb - pa, q = pc - pa;
    const Vec3<Precise> normal{fused_difference(p.z, q.y, Precise(p.y * q.z)),
                               fused_difference(p.x, q.z, Precise(p.z * q.x)),
                               fused_difference(p.y, q.x, Precise(p.x * q.y))};
    const Precise along_middle =
        fused(normal.x, Precise(beam.side * beam.slope_u),
              fused(normal.y, Precise(beam.side * beam.slope_v), normal.z));
    normals[DEPTH] = {Real(normal.x), Real(normal.y), Real(along_middle)};
    const Real volume(fused(to_vertex.x, normal.x,
                            fused(to_vertex.y, normal.y, Precise(to_vertex.z * normal.z))));

    const Real inverse = 1.0f / volume;
    safe &= absolute(volume) > SMALLEST_VOLUME;
    Real share, edge_bound, ray_bound, depth_bound;
    if constexpr (EXACT) {
        const Real edge = maximum(largest_component(ab),
                                  maximum(largest_component(bc), largest_component(ca)));
        const Real volume_error = float(VOLUME_ROUNDINGS) * (size * (edge * edge)) +
                                  (2 * FLOAT_ROUNDOFF) * absolute(volume);
        const Real inverse_size = absolute(inverse);
        share = volume_error * inverse_size;
        safe &= share <= LARGEST_SHARE;
        const auto across = [](const Vec3<Real> &v) {
            return maximum(absolute(v.x), absolute(v.y));
        };
        const Real local = maximum(across(a), maximum(across(b), across(c)));
        const Real spread(beam.spread), sum = 1.0f + spread;
        const Real reach = fused(spread, local + size, local);
        const Real lost = (SHEAR_ROUNDINGS * (size * edge) + UNDERFLOW) * sum;
        edge_bound = fused(EDGE_ROUNDINGS * reach, edge, lost) * inverse_size;
        ray_bound = fused(RAY_ROUNDINGS * reach, edge, lost) * inverse_size;
        const Real across_plane = across(normals[DEPTH]),
                   middle = absolute(normals[DEPTH].z);
        const Real plane_lost = SHEAR_ROUNDINGS * (across_plane + middle) + UNDERFLOW;
        depth_bound = fused(Real(PLANE_ROUNDINGS), fused(spread, across_plane, middle),
                            plane_lost * sum) *
                      inverse_size;
        unsafe = given & ~to_bits(safe);
    } else {
        share = edge_bound = ray_bound = depth_bound = Real(0.0f);
        unsafe = 0;
    }
    const LaneBits safe_bits = to_bits(safe) & given;
    if (safe_bits == 0)
        return;
    store(edge_error, edge_bound);
    store(ray_error, ray_bound);

    MaskOf<Real> inside = safe & ~misses;
    possible = to_bits(inside) & safe_bits;
    if (possible == 0)
        return;

    rectangle.center_u = center_u;
    rectangle.center_v = center_v;
    Real greatest;
    for (int form = 0; form < 4; ++form) {
        greatest =
            put_form(form, rectangle, Real(normals[form].z * (inverse * beam.side)),
                     Real(normals[form].x * inverse), Real(normals[form].y * inverse));
        if (form != DEPTH)
            inside &= greatest >= -edge_bound;
    }
    // With the exact value y and the computed one x = y (1 + r) + f, |r| <= share <= 1/4
    // and |f| <= depth_bound: y is at most (x + f) (1 + 2 share) and at least (x - f) (1 -
    // share), for x of either sign as far as y is positive.
    const Real grow = 1.0f + 2.0f * share, shrink = 1.0f - 2.0f * share;
    const Real error = 2.0f * depth_bound;
    store(depth_grow, grow * (1 + 4 * FLOAT_ROUNDOFF));
    store(depth_shrink, shrink * (1 - 4 * FLOAT_ROUNDOFF));
    store(depth_error, error);
    inside &= fused(greatest, grow * (1 + 4 * FLOAT_ROUNDOFF), error) >= least;
    possible = to_bits(inside) & safe_bits;
}

template <typename Real, typename Bounds, typename ValueOf>
Real TriangleForms::middle(int form, const Bounds &bounds, ValueOf &&value_of) const {
    return fused(
        value_of(of_p[form]), Real(bounds.center_p),
        fused(value_of(of_q[form]), Real(bounds.center_q), value_of(center[form])));
}

template <typename Real, typename Bounds, typename ValueOf>
Real TriangleForms::greatest(int form, const Bounds &bounds, ValueOf &&value_of) const {
    return fused(value_of(size_p[form]), Real(bounds.half_p),
                 fused(value_of(size_q[form]), Real(bounds.half_q),
                       middle<Real>(form, bounds, value_of)));
}

template <typename Real, typename Bounds, typename ValueOf>
Real TriangleForms::least(int form, const Bounds &bounds, ValueOf &&value_of) const {
    return fused_difference(value_of(size_p[form]), Real(bounds.half_p),
                            fused_difference(value_of(size_q[form]), Real(bounds.half_q),
                                             middle<Real>(form, bounds, value_of)));
}

// Whether rays within a rectangle may hit a triangle, nearer than `least`: one triangle and
// rectangles side by side, or the other way round.
template <typename Real, typename Bounds, typename ValueOf>
MaskOf<Real> TriangleForms::may_hit(const Bounds &bounds, const Real &least,
                                    ValueOf &&value_of) const {
    const Real center_p(bounds.center_p), center_q(bounds.center_q);
    const Real half_p(bounds.half_p), half_q(bounds.half_q);
    const auto touched =
        (absolute(center_p - value_of(box_p)) <= half_p + value_of(box_half_p)) &
        (absolute(center_q - value_of(box_q)) <= half_q + value_of(box_half_q));
    const auto greatest_of = [&](int form) {
        return greatest<Real>(form, bounds, value_of);
    };
    const Real edges = minimum(greatest_of(0), minimum(greatest_of(1), greatest_of(2)));
    const Real depth = greatest_of(DEPTH);
    const Real highest =
        EXACT_DISTANCES ? fused(depth, value_of(depth_grow), value_of(depth_error)) : depth;
    const Real edge_bound = EXACT ? value_of(edge_error) : Real(0.0f);
    return touched & (edges + edge_bound >= 0.0f) & (highest >= least);
}

LaneBits TriangleForms::packets_for(uint32_t lane, const BeamPackets::Run &run) const {
    return to_bits(may_hit(run, load<FloatPacket>(run.least), [lane](const Lanes &lanes) {
        return FloatPacket(lanes[lane]);
    }));
}

// The least value of a form is the greatest of the negative one, turned around, and has the
// same error. What is certain of a ray by test_packet() is certain here of all.
TriangleForms::Coverage TriangleForms::coverage_of(uint32_t lane, const BeamPackets &beam,
                                                   const BeamPackets::Run &run) const {
    const auto value_of = [lane](const Lanes &lanes) { return FloatPacket(lanes[lane]); };
    // Without branches: nobody foresees where triangles lie.
    Coverage packets;
    packets.possible = to_bits(may_hit(run, load<FloatPacket>(run.least), value_of));
    const auto least_of = [&](int form) { return least<FloatPacket>(form, run, value_of); };
    const FloatPacket edges = minimum(least_of(0), minimum(least_of(1), least_of(2)));
    const auto inside = edges > (EXACT ? value_of(edge_error) : FloatPacket(0.0f));
    packets.least = least_of(DEPTH);
    packets.greatest = greatest<FloatPacket>(DEPTH, run, value_of);
    if constexpr (EXACT_DISTANCES) {
        const FloatPacket error = value_of(depth_error);
        packets.least = fused(packets.least, value_of(depth_shrink), -error);
        packets.greatest = fused(packets.greatest, value_of(depth_grow), error);
    }
    const auto nearer = (packets.least > load<FloatPacket>(run.greatest)) &
                        (packets.greatest < FloatPacket(beam.nearest));
    packets.covered = packets.possible & to_bits(inside & nearer);
    return packets;
}

// With P and Q the sides of the box around a triangle, the sides p and q of a rectangle in
// the triangle satisfy p / P + q / Q <= 1.
LaneBits TriangleForms::possible_covers(const BeamPackets &beam) const {
    const auto half_p = load<FloatWide>(box_half_p), half_q = load<FloatWide>(box_half_q);
    return possible & to_bits(fused(half_q, FloatWide(beam.least_half_p),
                                    half_p * beam.least_half_q) <= half_p * half_q);
}

template <typename Real>
LaneBits TriangleForms::block_for(const PacketBounds &bounds) const {
    return to_bits(may_hit(bounds, Real(bounds.least),
                           [](const Lanes &lanes) { return load<Real>(lanes); }));
}

LaneBits TriangleForms::possible_for(const BeamPackets::Run &run) const {
    return possible &
           (wide_ ? block_for<FloatWide>(run.all) : block_for<FloatBlock>(run.all));
}

void TriangleForms::set(const BeamPackets &beam, float least, const Triangle *triangles,
                        const uint32_t *numbers, uint32_t count) {
    wide_ = count > BLOCK_WIDTH;
    if (beam.parallel)
        set_parallel(beam, least, triangles, numbers, count);
    else if (wide_)
        set_block<FloatWide>(beam, least, triangles, numbers, count);
    else
        set_block<FloatBlock>(beam, least, triangles, numbers, count);
}

} // namespace mlrt
