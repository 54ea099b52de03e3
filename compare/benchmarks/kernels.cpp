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

} // namespace bench

template <bench::Kernel kernel>
struct RayPacket<bench::KernelOrigins<kernel>> : RayPacket<LaneOrigins> {};

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
                                             : trace_packets<Kernel::exact>;
    const Stopwatch watch;
    parallel_for((rays.count + PART - 1) / PART, [&](uint32_t i) {
        trace(tree, rays, i * PART, std::min((i + 1) * PART, rays.count), hits);
    });
    return watch.elapsed();
}

} // namespace bench

} // namespace mlrt
