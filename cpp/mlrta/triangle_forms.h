// Triangles as a beam sees them, a register of them side by side: linear forms in the
// slopes of its rays.
//
// Of a triangle (a, b, c) relative to the common origin and a ray of direction
// d = |d_k| (u, v, side), the volumes U, V, W of geometry/triangle_test.h are
// |d_k| (n_k side + n_i u + n_j v) with the edge normals n = b x c, c x a, a x b, and the
// reciprocal of the depth z = t |d_k| is (N_k side + N_i u + N_j v) / a.N with
// N = (b - a) x (c - a). Divided by a.N, whose sign is theirs wherever t > 0, all three
// volumes are >= 0 if and only if the ray hits.
//
// For parallel rays the volumes are areas in the plane of (u, v), linear as well, and -z is
// one; all are divided by the area of the triangle.
//
// The forms are evaluated in single precision with bounds on their error: they say what is
// certain. The rest is decided exactly.
#pragma once

#include "geometry/triangle.h"
#include "mlrta/beam_packets.h"

#include <cstdint>

namespace mlrt {

template <typename Real>
struct LaidRectangle;
template <typename Real>
struct VertexBox;

struct alignas(64) TriangleForms {
    static constexpr uint32_t CAPACITY = WIDE_WIDTH;
    static constexpr int DEPTH = 3; // after the three edges
    using Lanes = float[CAPACITY];

    // value = constant + u * of_u + v * of_v
    Lanes constant[4], of_u[4], of_v[4];

    // The same over the beam's rectangle: value = center + p * of_p + q * of_q; and how
    // much a form changes by unit of half a rectangle's sides.
    Lanes center[4], of_p[4], of_q[4];
    Lanes size_p[4], size_q[4];

    // A rectangle around what the beam sees of the triangle, as those of packets are:
    // infinite if a vertex does not lie ahead.
    Lanes box_p, box_q, box_half_p, box_half_q;

    // A computed edge form is within edge_error of the exact one, anywhere in the beam, and
    // within ray_error of it if it is computed for a ray.
    // With x a computed reciprocal depth, the exact one, if positive, is at least x *
    // depth_shrink - depth_error and at most x * depth_grow + depth_error.
    Lanes edge_error, ray_error, depth_error, depth_shrink, depth_grow;

    // Triangles that rays of the beam may hit nearer than all of them already have, and
    // those of which the forms say nothing.
    LaneBits possible = 0, unsafe = 0;

    // Takes in up to CAPACITY triangles; `numbers` has as many entries, of which those
    // behind the first `count` name any triangle.
    void set(const BeamPackets &beam, float least, const Triangle *triangles,
             const uint32_t *numbers, uint32_t count);

    // Packets of a run that triangle `lane` may be hit by, nearer than their rays already
    // have.
    LaneBits packets_for(uint32_t lane, const BeamPackets::Run &run) const;
    // The same, and of those the packets of which all active rays hit it for certain,
    // nearer than they already have: it covers them.
    struct Coverage {
        LaneBits possible, covered;
        FloatPacket least, greatest; // bounds of reciprocal depths, where it covers packets
    };
    Coverage coverage_of(uint32_t lane, const BeamPackets &beam,
                         const BeamPackets::Run &run) const;
    // Of the possible triangles those that are large enough to cover a packet.
    LaneBits possible_covers(const BeamPackets &beam) const;
    // Of the possible triangles those that any packet of the run may be hit by so.
    LaneBits possible_for(const BeamPackets::Run &run) const;

private:
    // What is certain of a volume or an area: that no more than this share of it is error.
    static constexpr float LARGEST_SHARE = 0.25f;

    template <typename Real>
    MaskOf<Real> put_box(const LaidRectangle<Real> &rectangle, const VertexBox<Real> &box,
                         const Real &slack, const MaskOf<Real> &ahead);
    template <typename Real>
    Real put_form(int form, const LaidRectangle<Real> &rectangle, const Real &form_1,
                  const Real &form_u, const Real &form_v);
    // Value in the middle of a rectangle, and the greatest and least over it.
    template <typename Real, typename Bounds, typename ValueOf>
    Real middle(int form, const Bounds &bounds, ValueOf &&value_of) const;
    template <typename Real, typename Bounds, typename ValueOf>
    Real greatest(int form, const Bounds &bounds, ValueOf &&value_of) const;
    template <typename Real, typename Bounds, typename ValueOf>
    Real least(int form, const Bounds &bounds, ValueOf &&value_of) const;
    template <typename Real, typename Bounds, typename ValueOf>
    MaskOf<Real> may_hit(const Bounds &bounds, const Real &least, ValueOf &&value_of) const;
    template <typename Real>
    LaneBits block_for(const PacketBounds &bounds) const;
    template <typename Real>
    void set_block(const BeamPackets &beam, float least, const Triangle *triangles,
                   const uint32_t *numbers, uint32_t count);

    void set_parallel(const BeamPackets &beam, float least, const Triangle *triangles,
                      const uint32_t *numbers, uint32_t count);
    template <typename Real>
    void set_parallel_block(const BeamPackets &beam, float least, const Triangle *triangles,
                            const uint32_t *numbers, uint32_t count);

    bool wide_ = false; // whether there are more than a narrow block
};

} // namespace mlrt
