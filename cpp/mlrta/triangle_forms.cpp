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

// Bounds on errors, in units of roundoff.
//
// Edges: let s be the largest component of a vertex relative to the origin, e that of an
// edge, and S the greatest 1 + |u| + |v|. A relative vertex is rounded once and an edge
// once, so that each product of a normal's component has three roundings and their
// difference a fourth, of at most 2 s e. Dividing by the volume rounds twice more. Slopes
// have two roundings, and evaluating a form two: 10 in a row, of at most 2 s e S each. Over
// a rectangle two roundings lead to the form's value at the center, three to its change
// along a side, and at most five to the sum of all: 16 in a row. That is 32 s e S, and 20 s
// e S for a ray; 40 and 21 cover products of roundings and the bound itself.
constexpr float EDGE_ROUNDINGS = 40 * FLOAT_ROUNDOFF, RAY_ROUNDINGS = 21 * FLOAT_ROUNDOFF;
// Depth: N comes from double precision, where thin triangles keep its digits. With n its
// largest component, 12 roundings of at most n S are left, and that of the bound.
constexpr float PLANE_ROUNDINGS = 16 * FLOAT_ROUNDOFF;
// The volume a.N in double: N has a difference, a product and another difference, the rest
// a difference, a product and two sums: 8 roundings in a row of three terms of 2 s e^2.
constexpr double VOLUME_ROUNDINGS = 52 * DOUBLE_ROUNDOFF;

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
    const Vec3<Real> a = va - o, b = vb - o, c = vc - o;
    const Real size =
        maximum(largest_component(a), maximum(largest_component(b), largest_component(c)));
    const Real sum(beam.greatest_sum);
    const LaneBits given = (1u << count) - 1;
    MaskOf<Real> safe = EXACT ? size < LARGEST_SIZE : MaskOf<Real>(true);

    // Where the vertices lie in the rectangle. A slope has four roundings, a difference,
    // two products and a sum follow, and the middle and extent of all: less than 16 of at
    // most the greatest coordinate and S.
    const LaidRectangle<Real> rectangle(beam.rectangle);
    const auto slopes = [&](const Vec3<Real> &v) -> Vec2<Real> {
        const Real reciprocal = 1.0f / (v.z * beam.side);
        return {v.x * reciprocal, v.y * reciprocal};
    };
    const VertexBox<Real> box(rectangle, {slopes(a), slopes(b), slopes(c)});
    const Real slack = (32 * FLOAT_ROUNDOFF) * (box.farthest() + sum);
    const auto ahead = minimum(a.z * beam.side, minimum(b.z * beam.side, c.z * beam.side)) >
                       SMALLEST_DEPTH;
    // The box is right for all triangles whose vertices are moderate. A block that misses
    // with all of them needs nothing else, though some may be degenerate.
    const MaskOf<Real> misses = put_box(rectangle, box, slack, ahead);
    possible = unsafe = 0;
    if ((given & ~to_bits(misses & safe)) == 0)
        return;

    const Vec3<Real> ab = vb - va, bc = vc - vb, ca = va - vc;
    Vec3<Real> normals[4] = {cross(b, bc), cross(c, ca), cross(a, ab)};
    Real volume;
    if constexpr (EXACT) {
        using Double = DoubleOf<Real>;
        const Vec3<Double> da = to_double(va);
        const Vec3<Double> p = to_double(vb) - da, q = to_double(vc) - da;
        const Vec3<Double> normal{fused_difference(p.z, q.y, Double(p.y * q.z)),
                                  fused_difference(p.x, q.z, Double(p.z * q.x)),
                                  fused_difference(p.y, q.x, Double(p.x * q.y))};
        normals[DEPTH] = {Real(normal.x), Real(normal.y), Real(normal.z)};
        const Vec3<Double> to_vertex = da - to_double(o);
        volume = Real(fused(to_vertex.x, normal.x,
                            fused(to_vertex.y, normal.y, Double(to_vertex.z * normal.z))));
    } else {
        normals[DEPTH] = cross(ca, ab);
        volume = dot(a, normals[DEPTH]);
    }

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
        edge_bound = (EDGE_ROUNDINGS * (size * edge) + UNDERFLOW) * sum * inverse_size;
        ray_bound = (RAY_ROUNDINGS * (size * edge) + UNDERFLOW) * sum * inverse_size;
        depth_bound = (PLANE_ROUNDINGS * largest_component(normals[DEPTH]) + UNDERFLOW) *
                      sum * inverse_size;
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

LaneBits TriangleForms::possible_covers(const BeamPackets &beam) const {
    return possible & to_bits((load<FloatWide>(box_half_p) >= beam.least_half_p) &
                              (load<FloatWide>(box_half_q) >= beam.least_half_q));
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
