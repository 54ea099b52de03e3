// Beams of rays with a common direction.
#include "base/exactness.h"
#include "geometry/triangle_test.h"
#include "mlrta/beam_packets.h"
#include "mlrta/parallel_rays.h"
#include "traverse/load_packet.h"
#include "traverse/parameter_interval.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace mlrt {

namespace {

// Of a depth: the roundings of a relative coordinate, of a product and a sum, and that of a
// distance to float.
constexpr float DEPTH_ROUNDINGS = 8 * FLOAT_ROUNDOFF;
// More than what underflow may take from a depth, and than the depth of the smallest
// distance that is not denormal.
constexpr float TINY_DEPTH = 0x1p-60f;

// Where u and v are so uncertain beside the extent of a beam, little is certain of what its
// rays hit; chosen.
constexpr float LARGEST_UNCERTAINTY = 0x1p-5f;

Vec3f vector_of(const float *const (&components)[3], uint32_t i) {
    return {components[0][i], components[1][i], components[2][i]};
}

} // namespace

bool are_parallel(const RayGroup &rays) {
    if (rays.has_common_origin || rays.count == 0)
        return false;
    // The first active ray from there on, or the last ray.
    const auto direction_at = [&](uint32_t i) {
        while (i + 1 < rays.count &&
               !(rays.t_min[i] < rays.t_max[i] &&
                 max_component(abs(vector_of(rays.direction, i))) > 0))
            ++i;
        return vector_of(rays.direction, i);
    };
    const Vec3f middle = direction_at(rays.count / 2);
    const float size = max_component(abs(middle));
    for (const uint32_t i : {0u, rays.count / 4, rays.count - 1}) {
        const Vec3f d = direction_at(i);
        const Vec3f difference = d * (size / max_component(abs(d))) - middle;
        if (!(max_component(abs(difference)) <= LARGEST_GROUP_DEVIATION * size))
            return false;
    }
    return true;
}

// Returns how far slopes of the rays deviate from the beam's, zero where they are not
// active, and widens `reach` to the coordinates of their origins.
FloatPacket BeamPackets::load_parallel_packet(const RayGroup &rays, uint32_t last,
                                              uint32_t number, FloatPacket &reach) {
    BeamPacket &packet = packets[number];
    PacketLanes &of_rays = lanes[number];
    Begin &begin = begins[number];
    const uint32_t first = of_rays.first_ray;
    const auto [i, j, k] = axes;
    const FloatPacket di = load_padded(rays.direction[i], first, last);
    const FloatPacket dj = load_padded(rays.direction[j], first, last);
    const FloatPacket dk = load_padded(rays.direction[k], first, last);
    const FloatPacket oi = load_padded(rays.origin[i], first, last);
    const FloatPacket oj = load_padded(rays.origin[j], first, last);
    const FloatPacket ok = load_padded(rays.origin[k], first, last);
    const FloatPacket xi = oi - origin[i], xj = oj - origin[j];
    const FloatPacket z = (ok - origin[k]) * side;
    // In this order NaN stays NaN, and the ray inactive.
    const FloatPacket t_min =
        maximum(FloatPacket(0.0f), load_padded(rays.t_min, first, last));
    const FloatPacket t_max = load_padded(rays.t_max, first, last);
    const FloatPacket main = dk * side;
    const FloatPacket reciprocal = 1.0f / main;
    packet.u = xi - slope_u * z;
    packet.v = xj - slope_v * z;

    const FloatPacket deviates =
        maximum(absolute(di * reciprocal - slope_u), absolute(dj * reciprocal - slope_v));
    const FloatPacket own_reach = maximum(absolute(xi), maximum(absolute(xj), absolute(z)));
    const auto inside = (main >= SMALLEST_MAIN) & (main <= LARGEST_MAIN) &
                        (deviates <= LARGEST_SLOPE_DEVIATION) &
                        (own_reach < LARGEST_PARALLEL_REACH);
    const LaneBits finite =
        to_bits((absolute(di) < INFINITE) & (absolute(dj) < INFINITE) &
                (absolute(dk) < INFINITE) & (absolute(oi) < INFINITE) &
                (absolute(oj) < INFINITE) & (absolute(ok) < INFINITE) & (t_min < t_max));
    packet.primitive = UIntPacket(NO_PRIMITIVE);
    of_rays.active = to_bits(inside) & finite;
    of_rays.found = 0;
    of_rays.strays =
        finite & ~of_rays.active & to_bits((di != 0.0f) | (dj != 0.0f) | (dk != 0.0f));
    reach = maximum(masked(of_rays.active, own_reach, 0.0f), reach);

    const auto around = [&](const FloatPacket &t, FloatPacket &least,
                            FloatPacket &greatest) {
        const FloatPacket way = t * main;
        const FloatPacket depth = z + way;
        const FloatPacket error = EXACT_DISTANCES
                                      ? DEPTH_ROUNDINGS * (absolute(z) + way) + TINY_DEPTH
                                      : FloatPacket(0.0f);
        // Nothing is nearer than what lies infinitely far.
        const auto far = ~(way < INFINITE);
        least = select(far, FloatPacket(-INFINITE), -(depth + error));
        greatest = select(far, FloatPacket(-INFINITE), -(depth - error));
    };
    FloatPacket least;
    around(t_max, least, packet.greatest);
    packet.least = masked(of_rays.active, least, INFINITE);
    around(t_min, begin.least, begin.greatest);
    begin.greatest = masked(of_rays.active, begin.greatest, -INFINITE);
    return masked(of_rays.active, deviates, 0.0f);
}

// Loads rays relative to one of them, and keeps how far they deviate from it.
void BeamPackets::load_around(uint32_t middle, const RayGroup &rays, uint32_t first,
                              uint32_t ray_count) {
    count = 0;
    any_active = any_stray = false;
    origin = vector_of(rays.origin, middle);
    set_axes(vector_of(rays.direction, middle));
    FloatPacket most_deviation = 0.0f, reach = 0.0f;
    for (uint32_t at = first; at < first + ray_count; at += PACKET_WIDTH) {
        const uint32_t n = count++;
        lanes[n].first_ray = at;
        most_deviation = maximum(load_parallel_packet(rays, first + ray_count, n, reach),
                                 most_deviation);
        any_active |= lanes[n].active != 0;
        any_stray |= lanes[n].strays != 0;
    }
    // A slope has two roundings and its deviation one; u and v have four.
    const float slopes = 1 + std::max(std::abs(slope_u), std::abs(slope_v));
    deviation = greatest_lane(most_deviation) + 4 * FLOAT_ROUNDOFF * slopes;
    origin_reach = greatest_lane(reach);
    origin_error = 8 * FLOAT_ROUNDOFF * origin_reach * slopes;
}

void BeamPackets::load_parallel(const RayGroup &rays, uint32_t first, uint32_t ray_count,
                                const Box3f &scene) {
    parallel = true;
    covered = unloaded = {};
    nearest = 0;
    count = 0;
    any_active = any_stray = false;
    const std::optional<uint32_t> middle = choose_axis(rays, first, ray_count);
    if (!middle)
        return;
    load_around(*middle, rays, first, ray_count);
    if (any_stray)
        if (const std::optional<uint32_t> other = stray_of_most())
            load_around(*other, rays, first, ray_count);
    if (!any_active)
        return;

    const float scene_reach = std::max(max_component(abs(scene.lo - origin)),
                                       max_component(abs(scene.hi - origin)));
    rectangle = {};
    turn_as_rays();
    fit_rectangle();
    if (!(scene_reach < LARGEST_PARALLEL_REACH) ||
        !(uncertainty(scene_reach) <=
          LARGEST_UNCERTAINTY * std::max(rectangle.half_p, rectangle.half_q)))
        set_all_apart();
}

// A ray of those that were set apart, if these are the most: the one that the others were
// compared with was a stray itself.
std::optional<uint32_t> BeamPackets::stray_of_most() const {
    int active = 0, strays = 0;
    std::optional<uint32_t> first;
    for (uint32_t n = 0; n < count; ++n) {
        const PacketLanes &packet = lanes[n];
        active += std::popcount(packet.active);
        strays += std::popcount(packet.strays);
        if (!first && packet.strays != 0)
            first = packet.first_ray + uint32_t(std::countr_zero(packet.strays));
    }
    return strays > active ? first : std::nullopt;
}

void BeamPackets::set_all_apart() {
    for (uint32_t n = 0; n < count; ++n) {
        lanes[n].strays |= lanes[n].active;
        lanes[n].active = 0;
    }
    any_active = false;
    any_stray = true;
}

} // namespace mlrt
