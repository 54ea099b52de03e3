#include "kernels.h"

#include "base/parallel.h"
#include "geometry/ray_packet.h"
#include "traverse/load_packet.h"
#include "traverse/packet.h"

#include <algorithm>
#include <limits>

namespace mlrt {

namespace bench {

// Marks packets that are to be tested by a kernel.
template <Kernel kernel>
struct KernelOrigins {};

// What a kernel finds out about its rays once.
template <Kernel kernel>
struct Preparation {
    void prepare(const RayPacket<LaneOrigins> &) {}
};

// Axes turned so that z is the one along which a ray goes the furthest, and the shear that
// makes the ray the z axis, with direction (0, 0, 1).
template <>
struct Preparation<Kernel::sheared> {
    LaneBits along_x = 0, along_y = 0;
    Vec3<FloatPacket> shear;

    void prepare(const RayPacket<LaneOrigins> &rays) {
        const Vec3<FloatPacket> &d = rays.direction;
        const FloatPacket x = absolute(d.x), y = absolute(d.y), z = absolute(d.z);
        along_x = to_bits((x >= y) & (x >= z));
        along_y = to_bits(y >= z) & ~along_x;
        const Vec3<FloatPacket> turned = turn(d);
        shear = {turned.x / turned.z, turned.y / turned.z, 1.0f / turned.z};
    }
    Vec3<FloatPacket> turn(const Vec3<FloatPacket> &v) const {
        const auto x = from_bits<FloatPacket>(along_x), y = from_bits<FloatPacket>(along_y);
        return {select(x, v.y, select(y, v.z, v.x)), select(x, v.z, select(y, v.x, v.y)),
                select(x, v.x, select(y, v.y, v.z))};
    }
};

} // namespace bench

template <bench::Kernel kernel>
struct RayPacket<bench::KernelOrigins<kernel>> : RayPacket<LaneOrigins>,
                                                 bench::Preparation<kernel> {};

namespace bench {

namespace {

template <typename Real>
Vec3<Real> in_lanes(Vec3f v) {
    return {Real(v.x), Real(v.y), Real(v.z)};
}

template <typename Real>
PacketCandidates moeller_trumbore(const Vec3<Real> &origin, const Vec3<Real> &direction,
                                  LaneBits lanes, const Triangle &triangle) {
    const Vec3<Real> a = in_lanes<Real>(triangle.a);
    const Vec3<Real> e1 = in_lanes<Real>(triangle.b) - a;
    const Vec3<Real> e2 = in_lanes<Real>(triangle.c) - a;
    const Vec3<Real> p = cross(direction, e2);
    const Real inverse = Real(1.0f) / dot(e1, p);
    const Vec3<Real> s = origin - a;
    const Real u = dot(s, p) * inverse;
    const Vec3<Real> q = cross(s, e1);
    const Real v = dot(direction, q) * inverse;
    PacketCandidates result;
    result.hit =
        lanes & to_bits((u >= Real(0.0f)) & (v >= Real(0.0f)) & (u + v <= Real(1.0f)));
    if (result.hit != 0)
        result.t = FloatPacket(dot(e2, q) * inverse);
    return result;
}

LaneBits of_one_sign(const FloatPacket &u, const FloatPacket &v, const FloatPacket &w) {
    const FloatPacket zero = 0.0f;
    return to_bits(((u >= zero) & (v >= zero) & (w >= zero)) |
                   ((u <= zero) & (v <= zero) & (w <= zero)));
}

PacketCandidates pluecker(const RayPacket<LaneOrigins> &rays, LaneBits lanes,
                          const Triangle &triangle) {
    const Vec3<FloatPacket> &o = rays.origin.point, &d = rays.direction;
    const Vec3<FloatPacket> a = in_lanes<FloatPacket>(triangle.a) - o;
    const Vec3<FloatPacket> b = in_lanes<FloatPacket>(triangle.b) - o;
    const Vec3<FloatPacket> c = in_lanes<FloatPacket>(triangle.c) - o;
    const auto volume = [&](const Vec3<FloatPacket> &p, const Vec3<FloatPacket> &q) {
        return dot(cross(p + q, q - p), d);
    };
    PacketCandidates result;
    const Vec3<FloatPacket> normal = cross(b - a, c - a);
    const FloatPacket denominator = dot(normal, d);
    result.hit = lanes & of_one_sign(volume(a, b), volume(b, c), volume(c, a)) &
                 to_bits(absolute(denominator) > FloatPacket(0.0f));
    if (result.hit != 0)
        result.t = dot(normal, a) / denominator;
    return result;
}

PacketCandidates sheared(const RayPacket<KernelOrigins<Kernel::sheared>> &rays,
                         LaneBits lanes, const Triangle &triangle) {
    const auto seen = [&](const Vec3f &vertex) -> Vec3<FloatPacket> {
        const Vec3<FloatPacket> p =
            rays.turn(in_lanes<FloatPacket>(vertex) - rays.origin.point);
        return {p.x - rays.shear.x * p.z, p.y - rays.shear.y * p.z, rays.shear.z * p.z};
    };
    const Vec3<FloatPacket> a = seen(triangle.a), b = seen(triangle.b),
                            c = seen(triangle.c);
    const FloatPacket u = c.x * b.y - c.y * b.x, v = a.x * c.y - a.y * c.x,
                      w = b.x * a.y - b.y * a.x;
    const FloatPacket determinant = u + v + w;
    PacketCandidates result;
    result.hit =
        lanes & of_one_sign(u, v, w) & to_bits(absolute(determinant) > FloatPacket(0.0f));
    if (result.hit != 0)
        result.t = (u * a.z + v * b.z + w * c.z) / determinant;
    return result;
}

} // namespace

// Found where PacketState tests triangles, by its argument.
template <Kernel kernel>
PacketCandidates intersect(const RayPacket<KernelOrigins<kernel>> &rays, LaneBits lanes,
                           const Triangle &triangle) {
    if constexpr (kernel == Kernel::single_precision)
        return moeller_trumbore(rays.origin.point, rays.direction, lanes, triangle);
    else if constexpr (kernel == Kernel::double_precision)
        return moeller_trumbore(to_double(rays.origin.point), to_double(rays.direction),
                                lanes, triangle);
    else if constexpr (kernel == Kernel::pluecker)
        return pluecker(rays, lanes, triangle);
    else if constexpr (kernel == Kernel::sheared)
        return sheared(rays, lanes, triangle);
    else
        return mlrt::intersect<LaneOrigins>(rays, lanes, triangle);
}

namespace {

template <Kernel kernel>
void trace_packets(const KdTree &tree, const RayGroup &group, uint32_t begin, uint32_t end,
                   HitGroup hits) {
    Counters counters;
    for (uint32_t first = begin; first < end; first += PACKET_WIDTH) {
        RayPacket<KernelOrigins<kernel>> rays;
        static_cast<RayPacket<LaneOrigins> &>(rays) =
            load_packet<LaneOrigins>(group, first).rays;
        rays.prepare(rays);
        PacketState<Query::closest> state(rays);
        trace_packet(tree, rays, root_entry(tree), state, counters);
        const LaneArray<float> t =
            to_lanes<float>(select(from_bits<FloatPacket>(state.hits.found), state.hits.t,
                                   FloatPacket(std::numeric_limits<float>::infinity())));
        const LaneArray<uint32_t> primitive = to_lanes<uint32_t>(state.hits.primitive);
        const uint32_t count = std::min(PACKET_WIDTH, end - first);
        std::copy_n(t.data(), count, hits.t + first);
        for (uint32_t lane = 0; lane < count; ++lane)
            hits.primitive[first + lane] =
                (state.hits.found >> lane & 1) ? primitive[lane] : NO_PRIMITIVE;
    }
}

} // namespace

Seconds trace_with(const KdTree &tree, Kernel kernel, const RayGroup &rays, HitGroup hits) {
    constexpr uint32_t PART = 4096; // rays that a thread takes at a time; chosen
    const auto trace =
        kernel == Kernel::single_precision   ? trace_packets<Kernel::single_precision>
        : kernel == Kernel::double_precision ? trace_packets<Kernel::double_precision>
        : kernel == Kernel::pluecker         ? trace_packets<Kernel::pluecker>
        : kernel == Kernel::sheared          ? trace_packets<Kernel::sheared>
                                             : trace_packets<Kernel::exact>;
    const Stopwatch watch;
    parallel_for((rays.count + PART - 1) / PART, [&](uint32_t i) {
        trace(tree, rays, i * PART, std::min((i + 1) * PART, rays.count), hits);
    });
    return watch.elapsed();
}

} // namespace bench

} // namespace mlrt
