// The rays of a beam with a common origin or a common direction, projected along the beam's
// main axis: what the beam-leaf traversal tests triangles against.
//
// Common origin: with k the main axis and i, j the two that follow it cyclically, the
// direction of a ray is |d_k| (u + slope_u, v + slope_v, side) in the order (i, j, k): u
// and v are its slopes d_i / |d_k| and d_j / |d_k| relative to those in the middle of the
// beam, so that they keep the digits in which rays differ; side is the sign that all d_k
// share. What is linear in the direction is |d_k| times something linear in (u, v), and so
// is one over the depth z = t |d_k| at which a plane is met.
//
// Common direction, but for rounding: with x relative to a point of the beam, u = x_i -
// slope_u z and v = x_j - slope_v z with z = side x_k are the same along a ray, and -z is
// linear in (u, v) on a plane. What is said of reciprocal depths holds for -z then, and
// what is said of slopes for the lengths u and v.
#pragma once

#include "base/simd.h"
#include "mlrta/beam.h"
#include "mlrta/packet_set.h"
#include "mlrta/range.h"
#include "traverse/hit_depth.h"
#include "traverse/ray_group.h"

#include <array>
#include <cstdint>
#include <optional>

namespace mlrt {

class FilmSlopes;

// A rectangle of slopes, turned by an angle: the points center + p (cosine, sine) +
// q (-sine, cosine) with |p| <= half_p and |q| <= half_q.
struct SlopeRectangle {
    float center_u = 0, center_v = 0;
    float cosine = 1, sine = 0;
    float half_p = 0, half_q = 0;
    float slack = 0; // of the extents, for how p and q of a ray are rounded
};

// Sixteen rays of a beam: of the group, and which of them.
struct PacketLanes {
    uint32_t first_ray;
    LaneBits active, found;

    // Rays that do not go along with the beam, or whose direction is so long or short that
    // slopes or depths could lose it. They are not active here.
    LaneBits strays;
};

// Where they go, and the best that they have found.
//
// Depths are compared by their reciprocals. The end of a ray's interval counts as what it
// has found at first. A triangle may be nearer if its reciprocal depth may exceed `least`,
// and is for certain if it certainly exceeds `greatest`. A ray that searches no more, or is
// not active, has infinite `least`.
struct BeamPacket {
    FloatPacket u, v;
    FloatPacket least, greatest; // bounds of 1 / z of the best hit
    UIntPacket primitive;        // of the best hit
};

// Of some rays of a beam, a rectangle parallel to that of the beam and relative to its
// center, and the smallest `least`, infinite if none is active.
struct PacketBounds {
    float center_p, center_q, half_p, half_q;
    float least;
};

struct BeamPackets {
    static constexpr uint32_t RUNS = 16; // of sixteen packets
    static constexpr uint32_t CAPACITY = RUNS * PACKET_WIDTH;
    static constexpr uint32_t MAX_RAYS = CAPACITY * PACKET_WIDTH;
    using Packets = PacketSet<RUNS>;

    bool parallel;           // whether the rays have a common direction, else origin
    Vec3f origin;            // the common one, or a point that coordinates are relative to
    std::array<int, 3> axes; // i, j, k
    float side;
    uint32_t count; // of packets
    // Apart, since of most of a camera's packets little else is looked at.
    std::array<PacketLanes, CAPACITY> lanes;
    std::array<BeamPacket, CAPACITY> packets;
    bool any_active, any_stray;
    float nearest; // reciprocal depths below it lie behind every t_min

    // What the slopes of rays are relative to; of parallel rays the common ones.
    float slope_u, slope_v;
    SlopeRectangle rectangle; // holds (u, v) of all active rays
    float spread;             // the greatest |u| + |v| in it and in the boxes of runs
    // Bounds of slopes relative to nothing; of parallel rays those of (u, v).
    float slope_lo[2], slope_hi[2];

    // Of parallel rays: how far slopes may deviate from the common ones, the greatest
    // coordinate of an origin, and how far u and v may be from what they are there.
    float deviation, origin_reach, origin_error;
    // What a ray hits at more than `greatest` lies behind its t_min for certain, at less
    // than `least` it does not.
    struct Begin {
        FloatPacket least, greatest;
    };
    std::array<Begin, CAPACITY> begins; // of parallel packets

    // Bounds of sixteen packets side by side, as PacketBounds has them, and of all sixteen;
    // and a bound of `greatest` of each packet's active rays.
    struct Run {
        FloatPacket center_p, center_q, half_p, half_q;
        LaneArray<float> least, greatest;
        PacketBounds all;
    };
    std::array<Run, RUNS> runs;
    // No packet's bounds are narrower.
    float least_half_p, least_half_q;

    // Packets that one triangle covers, nearer than all else that was found, and the linear
    // form of its reciprocal depths. Their rays are told so by settle().
    struct Cover {
        uint32_t primitive;
        float constant, of_u, of_v;
        float shrink, grow, error;
    };
    Packets covered;
    std::array<Cover, CAPACITY> covers;

    // Packets of a camera's rays that have not been looked at: of those only `lanes` are
    // known.
    Packets unloaded;

    // How many rays have found something.
    uint32_t found_count() const;

    // Makes all known of those of the given packets of a run of which it is not.
    void settle(const RayGroup &rays, uint32_t run, LaneBits numbers) {
        for_each_lane(numbers & (covered.run(run) | unloaded.run(run)),
                      [&](uint32_t i) { settle_packet(rays, run * PACKET_WIDTH + i); });
    }
    // Makes the slopes of all packets known.
    void load_slopes(const RayGroup &rays);

    uint32_t run_count() const { return (count + PACKET_WIDTH - 1) / PACKET_WIDTH; }

    // Projects up to MAX_RAYS rays from `first` on, which start at the group's common
    // origin. `camera` made them, if it is given: the rectangle is then turned as the film
    // is, else as the rays spread.
    void load(const RayGroup &rays, uint32_t first, uint32_t ray_count,
              const CameraMap *camera);

    // The same for rays of a camera, which are looked at when they are needed. Returns
    // false, and does nothing of use, where that is not possible.
    bool load_camera(const RayGroup &rays, uint32_t first, uint32_t ray_count,
                     const CameraRays &camera);

    // The same for rays with a common direction in a scene with the given bounds. Rays that
    // go another way are strays, or all of them if too little is certain of where they are.
    void load_parallel(const RayGroup &rays, uint32_t first, uint32_t ray_count,
                       const Box3f &scene);

    // How far u and v of a parallel ray may be from those of the packet at points that have
    // no greater coordinate than `reach`.
    template <typename Real>
    Real uncertainty(const Real &reach) const {
        return fused(reach + Real(origin_reach), Real(1.01f * deviation),
                     Real(origin_error));
    }

    // Coordinates p and q of a packet's rays, to within the rectangle's slack.
    FloatPacket along_p(const BeamPacket &packet) const {
        return fused(packet.u - rectangle.center_u, FloatPacket(rectangle.cosine),
                     (packet.v - rectangle.center_v) * rectangle.sine);
    }
    FloatPacket along_q(const BeamPacket &packet) const {
        return fused(packet.v - rectangle.center_v, FloatPacket(rectangle.cosine),
                     (packet.u - rectangle.center_u) * -rectangle.sine);
    }

private:
    // Directions whose main component lies outside lose digits or overflow on the way to
    // slopes and depths.
    static constexpr float SMALLEST_MAIN = 0x1p-60f, LARGEST_MAIN = 0x1p60f;

    // A ray goes along with the beam if no other component of its direction exceeds that of
    // the main axis by more than this factor; chosen.
    static constexpr float GREATEST_SLOPE = 2;

    // Where all rays go straight along the axis, there is nothing to round, but extents
    // that others divide by must not be zero.
    static constexpr float LEAST_SLACK = 0x1p-120f;

    // Ends of rays below it: what is lost to underflow is small beside what is above.
    static constexpr float SMALLEST_END = 0x1p-60f;

    static FloatPacket masked(LaneBits lanes, const FloatPacket &values, float other) {
        return select(from_bits<FloatPacket>(lanes), values, FloatPacket(other));
    }

    // By the way that a ray goes: the slopes of others are relative to its own.
    void set_axes(Vec3f direction);
    // Returns the ray that it was chosen by, if any is active.
    std::optional<uint32_t> choose_axis(const RayGroup &rays, uint32_t first,
                                        uint32_t ray_count);
    // Of active rays: the greatest depths at which they begin, and bounds of the reciprocal
    // depths at which they end.
    using Lanes = FloatWide;
    struct FarthestEnds {
        Lanes begin = 0.0f, greatest = 0.0f;
    };
    [[gnu::always_inline]] inline FarthestEnds load_packet(const RayGroup &rays,
                                                           uint32_t last, uint32_t number);
    FloatPacket load_parallel_packet(const RayGroup &rays, uint32_t last, uint32_t number,
                                     FloatPacket &reach);
    void settle_packet(const RayGroup &rays, uint32_t number);
    void load_camera_packet(const RayGroup &rays, uint32_t number);
    struct Ends {
        Lanes least, greatest; // bounds of reciprocal depths
    };
    static Ends ends_of(const Lanes &t_max, const Lanes &main);
    void fit_to_film(const CameraTile &tile, uint32_t first, const FilmSlopes &slopes);
    void set_middles(const CameraTile &tile, uint32_t first_of_run,
                     const FilmRectangle &packet, LaneBits there, Run &run) const;
    void set_camera_ends(float t_min, float t_max, const Range &main);
    void load_around(uint32_t middle, const RayGroup &rays, uint32_t first,
                     uint32_t ray_count);
    std::optional<uint32_t> stray_of_most() const;
    void set_all_apart();
    void turn_as_film(const CameraMap &camera);
    void turn_as_rays();
    void fit_rectangle();
    void bound_slopes();
};

} // namespace mlrt
