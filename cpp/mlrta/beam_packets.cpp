#include "mlrta/beam_packets.h"

#include "base/fused_difference.h"
#include "base/transpose.h"
#include "traverse/load_packet.h"
#include "traverse/parameter_interval.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace mlrt {

namespace {

// Slopes that are smaller, but not zero, lose digits on the way to where planes are
// crossed.
constexpr float SMALLEST_SLOPE = 0x1p-100f;

} // namespace

// The axis along which the ray in the middle of those that are active moves most.
std::optional<uint32_t> BeamPackets::choose_axis(const RayGroup &rays, uint32_t first,
                                                 uint32_t ray_count) {
    for (uint32_t n = 0; n < ray_count; ++n) {
        const uint32_t i = first + (n + ray_count / 2) % ray_count;
        const Vec3f d{rays.direction[0][i], rays.direction[1][i], rays.direction[2][i]};
        if (!(std::max(rays.t_min[i], 0.0f) < rays.t_max[i]) || !is_finite(d) ||
            !(max_component(abs(d)) > 0))
            continue;
        set_axes(d);
        return i;
    }
    return std::nullopt;
}

void BeamPackets::set_axes(Vec3f d) {
    const int k = largest_axis(d);
    axes = {(k + 1) % 3, (k + 2) % 3, k};
    side = d[k] > 0 ? 1.0f : -1.0f;
    slope_u = d[axes[0]] / std::abs(d[k]);
    slope_v = d[axes[1]] / std::abs(d[k]);
}

// A register at a time, as all of its values would not fit into them else.
BeamPackets::FarthestEnds BeamPackets::load_packet(const RayGroup &rays, uint32_t last,
                                                   uint32_t number) {
    BeamPacket &packet = packets[number];
    PacketLanes &of_rays = lanes[number];
    const auto [i, j, k] = axes;
    const uint32_t first_ray = of_rays.first_ray;
    LaneBits all_active = 0, strays = 0;
    FarthestEnds farthest;
    for_each_register([&](uint32_t lane) __attribute__((always_inline)) {
        const uint32_t first = first_ray + lane;
        const Lanes di = load_padded<Lanes>(rays.direction[i], first, last);
        const Lanes dj = load_padded<Lanes>(rays.direction[j], first, last);
        const Lanes dk = load_padded<Lanes>(rays.direction[k], first, last);
        const Lanes main = dk * side;
        const Lanes reciprocal = 1.0f / main;
        store_register(packet.u, lane,
                       fused_difference(main, Lanes(slope_u), di) * reciprocal);
        store_register(packet.v, lane,
                       fused_difference(main, Lanes(slope_v), dj) * reciprocal);
        const auto inside = (main >= SMALLEST_MAIN) & (main <= LARGEST_MAIN) &
                            (maximum(absolute(di), absolute(dj)) <= GREATEST_SLOPE * main);
        // In this order NaN stays NaN, and the ray inactive.
        const Lanes t_min =
            maximum(Lanes(0.0f), load_padded<Lanes>(rays.t_min, first, last));
        const Lanes t_max = load_padded<Lanes>(rays.t_max, first, last);
        const auto finite = (absolute(di) < INFINITE) & (absolute(dj) < INFINITE) &
                            (absolute(dk) < INFINITE) & (t_min < t_max);
        const auto active = inside & finite;
        const LaneBits active_bits = to_bits(active), finite_bits = to_bits(finite);
        all_active |= active_bits << lane;
        if (active_bits != finite_bits)
            strays |= (finite_bits & ~active_bits &
                       to_bits((di != 0.0f) | (dj != 0.0f) | (dk != 0.0f)))
                      << lane;

        const auto [least, greatest] = ends_of(t_max, main);
        store_register(packet.least, lane, select(active, least, Lanes(INFINITE)));
        store_register(packet.greatest, lane, greatest);
        farthest.greatest =
            maximum(select(active, greatest, Lanes(0.0f)), farthest.greatest);
        farthest.begin = maximum(
            select(active, first_certain_depth(t_min, main), Lanes(0.0f)), farthest.begin);
    });
    packet.primitive = UIntPacket(NO_PRIMITIVE);
    of_rays.active = all_active;
    of_rays.found = 0;
    of_rays.strays = strays;
    return farthest;
}

// One division for both bounds. What is rounded to a small t_max may exceed it by more than
// that share, and small depths may have lost digits: nothing is certain of them.
BeamPackets::Ends BeamPackets::ends_of(const Lanes &t_max, const Lanes &main) {
    const Lanes end = t_max * main;
    const Lanes at_end = 1.0f / end;
    const auto moderate = (t_max >= SMALLEST_END) & (end >= SMALLEST_END);
    return {select(moderate, at_end * (1 - WIDEN_DEPTH), Lanes(0.0f)),
            select(moderate, at_end * (1 + WIDEN_DEPTH), Lanes(INFINITE))};
}

// Of a packet whose rays are known to be active.
void BeamPackets::load_camera_packet(const RayGroup &rays, uint32_t number) {
    BeamPacket &packet = packets[number];
    for_each_register([&](uint32_t lane) __attribute__((always_inline)) {
        const uint32_t first = lanes[number].first_ray + lane;
        const auto component = [&](int axis) {
            return mlrt::load<Lanes>(rays.direction[axis] + first);
        };
        const Lanes main = component(axes[2]) * side;
        const Lanes reciprocal = 1.0f / main;
        const auto relative = [&](int axis, float slope) {
            return fused_difference(main, Lanes(slope), component(axis)) * reciprocal;
        };
        store_register(packet.u, lane, relative(axes[0], slope_u));
        store_register(packet.v, lane, relative(axes[1], slope_v));
        const auto [least, greatest] =
            ends_of(load_padded<Lanes>(rays.t_max, first, rays.count), main);
        store_register(packet.least, lane, least);
        store_register(packet.greatest, lane, greatest);
    });
    packet.primitive = UIntPacket(NO_PRIMITIVE);
    unloaded.remove(number);
}

void BeamPackets::load_slopes(const RayGroup &rays) {
    for (uint32_t n = 0; n < count; ++n)
        if (unloaded.has(n))
            load_camera_packet(rays, n);
}

// The image of the film's x axis in slopes, at the ray that they are relative to.
void BeamPackets::turn_as_film(const CameraMap &camera) {
    const auto [i, j, k] = axes;
    const float x = camera.dx[i] - slope_u * side * camera.dx[k];
    const float y = camera.dx[j] - slope_v * side * camera.dx[k];
    // In double, where squares neither underflow nor overflow.
    const double length = std::sqrt(double(x) * x + double(y) * y);
    if (!(length > 0) || !std::isfinite(length))
        return;
    rectangle.cosine = float(x / length);
    rectangle.sine = float(y / length);
}

// The direction in which slopes vary most: the greater main axis of their covariance. Where
// none of the packets that are looked at has rays, the rectangle is left as it is.
void BeamPackets::turn_as_rays() {
    FloatPacket sum_u = 0.0f, sum_v = 0.0f, sum_uu = 0.0f, sum_uv = 0.0f, sum_vv = 0.0f;
    uint32_t active = 0;
    // Sixteen packets, spread over all, tell as much.
    const uint32_t step = std::max(count / PACKET_WIDTH, 1u);
    for (uint32_t n = 0; n < count; n += step) {
        const BeamPacket &packet = packets[n];
        const LaneBits of_packet = lanes[n].active;
        const FloatPacket u =
            masked(of_packet, packet.u - FloatPacket(rectangle.center_u), 0.0f);
        const FloatPacket v =
            masked(of_packet, packet.v - FloatPacket(rectangle.center_v), 0.0f);
        sum_u = sum_u + u;
        sum_v = sum_v + v;
        sum_uu = fused(u, u, sum_uu);
        sum_uv = fused(u, v, sum_uv);
        sum_vv = fused(v, v, sum_vv);
        active += uint32_t(__builtin_popcount(of_packet));
    }
    const float share = 1.0f / float(active);
    const float mean_u = sum_of_lanes(sum_u) * share, mean_v = sum_of_lanes(sum_v) * share;
    const float uu = sum_of_lanes(sum_uu) * share - mean_u * mean_u;
    const float uv = sum_of_lanes(sum_uv) * share - mean_u * mean_v;
    const float vv = sum_of_lanes(sum_vv) * share - mean_v * mean_v;
    // In double, where squares of small lengths keep their digits.
    const double difference = double(uu) - double(vv);
    const double root = std::sqrt(difference * difference + 4 * double(uv) * double(uv));
    if (!(root > 0) || !std::isfinite(root))
        return;
    const double double_cosine = difference / root;
    rectangle.cosine = float(std::sqrt(std::max(0.5 * (1 + double_cosine), 0.0)));
    rectangle.sine =
        std::copysign(float(std::sqrt(std::max(0.5 * (1 - double_cosine), 0.0))), uv);
}

// Bounds of the slopes of each packet and of all, along the rectangle's sides.
//
// With r the greatest |p| or |q| relative to the first ray, the coordinates of a ray are
// computed with an error of at most 6 roundings of 2 r, and cosine and sine have unit
// length but for 4 roundings: 64 u r covers both, there and back. The center is rounded
// once more, with an error of at most 4 u (|u| + |v|).
void BeamPackets::fit_rectangle() {
    const float c = rectangle.cosine, s = rectangle.sine;
    const Lanes first_u(rectangle.center_u), first_v(rectangle.center_v);
    // Packets that are missing, and lanes that are not active, bound nothing.
    const Lanes none_lo(INFINITE), none_hi(-INFINITE);
    Lanes lo_u = none_lo, hi_u = none_hi, lo_v = none_lo, hi_v = none_hi;
    // Of each packet of a run, a lane each.
    struct Extents {
        FloatPacket p0, p1, q0, q1;
    };
    std::array<Extents, RUNS> extents;
    Extents widest{INFINITE, -INFINITE, INFINITE, -INFINITE};
    for (uint32_t r = 0; r < run_count(); ++r) {
        PacketRows lo_p, hi_p, lo_q, hi_q, least_of;
        for (uint32_t i = 0; i < PACKET_WIDTH; ++i) {
            const uint32_t n = r * PACKET_WIDTH + i;
            if (n >= count || lanes[n].active == 0) {
                lo_p[i] = lo_q[i] = least_of[i] = none_lo;
                hi_p[i] = hi_q[i] = none_hi;
                continue;
            }
            const BeamPacket &packet = packets[n];
            for_each_register([&](uint32_t lane) __attribute__((always_inline)) {
                const auto active = from_bits<Lanes>(lanes[n].active >> lane);
                const Lanes packet_u = load_register(packet.u, lane);
                const Lanes packet_v = load_register(packet.v, lane);
                // Inactive lanes repeat the first ray of all.
                const Lanes u = select(active, packet_u, first_u);
                const Lanes v = select(active, packet_v, first_v);
                lo_u = minimum(u, lo_u);
                hi_u = maximum(u, hi_u);
                lo_v = minimum(v, lo_v);
                hi_v = maximum(v, hi_v);
                const Lanes du = packet_u - first_u, dv = packet_v - first_v;
                const Lanes p = fused(du, Lanes(c), dv * s);
                const Lanes q = fused(dv, Lanes(c), du * -s);
                const auto add = [&](Lanes &row, const Lanes &values, auto &&better) {
                    row = lane == 0 ? values : better(values, row);
                };
                const auto lower = minimum<Lanes>, upper = maximum<Lanes>;
                add(lo_p[i], select(active, p, none_lo), lower);
                add(hi_p[i], select(active, p, none_hi), upper);
                add(lo_q[i], select(active, q, none_lo), lower);
                add(hi_q[i], select(active, q, none_hi), upper);
                add(least_of[i], load_register(packet.least, lane), lower);
            });
        }
        store(runs[r].least.data(), least_lanes(least_of));
        const Extents &of_run = extents[r] = {least_lanes(lo_p), greatest_lanes(hi_p),
                                              least_lanes(lo_q), greatest_lanes(hi_q)};
        widest = {minimum(of_run.p0, widest.p0), maximum(of_run.p1, widest.p1),
                  minimum(of_run.q0, widest.q0), maximum(of_run.q1, widest.q1)};
    }
    slope_lo[0] = least_lane(lo_u);
    slope_hi[0] = greatest_lane(hi_u);
    slope_lo[1] = least_lane(lo_v);
    slope_hi[1] = greatest_lane(hi_v);
    const float size_u = std::max(std::abs(slope_lo[0]), std::abs(slope_hi[0]));
    const float size_v = std::max(std::abs(slope_lo[1]), std::abs(slope_hi[1]));

    const float beam_p0 = least_lane(widest.p0), beam_p1 = greatest_lane(widest.p1);
    const float beam_q0 = least_lane(widest.q0), beam_q1 = greatest_lane(widest.q1);
    const float mid_p = 0.5f * (beam_p0 + beam_p1), mid_q = 0.5f * (beam_q0 + beam_q1);
    rectangle.center_u += mid_p * c - mid_q * s;
    rectangle.center_v += mid_p * s + mid_q * c;
    const float reach = std::max({-beam_p0, beam_p1, -beam_q0, beam_q1});
    const float slack = rectangle.slack =
        FLOAT_ROUNDOFF *
            (64 * reach + 8 * (std::abs(rectangle.center_u) + std::abs(rectangle.center_v) +
                               size_u + size_v)) +
        LEAST_SLACK;
    rectangle.half_p = 0.5f * (beam_p1 - beam_p0) + slack;
    rectangle.half_q = 0.5f * (beam_q1 - beam_q0) + slack;
    spread = std::abs(rectangle.center_u) + std::abs(rectangle.center_v) +
             2 * (rectangle.half_p + rectangle.half_q);
    least_half_p = least_half_q = 0;
    // Without rays the center is NaN, the sides are negative, and `least` is infinite.
    for (uint32_t r = 0; r < run_count(); ++r) {
        Run &run = runs[r];
        const auto &[p0, p1, q0, q1] = extents[r];
        run.center_p = 0.5f * (p0 + p1) - mid_p;
        run.center_q = 0.5f * (q0 + q1) - mid_q;
        run.half_p = 0.5f * (p1 - p0) + slack;
        run.half_q = 0.5f * (q1 - q0) + slack;
        const float run_p0 = least_lane(p0), run_p1 = greatest_lane(p1);
        const float run_q0 = least_lane(q0), run_q1 = greatest_lane(q1);
        run.all = {0.5f * (run_p0 + run_p1) - mid_p, 0.5f * (run_q0 + run_q1) - mid_q,
                   0.5f * (run_p1 - run_p0) + slack, 0.5f * (run_q1 - run_q0) + slack,
                   least_lane(mlrt::load<FloatPacket>(run.least))};
    }
}

// A relative slope has three roundings, and may lose what is smaller than a float by unit
// of the main component. A range that ends near zero, but not there, ends at a slope that
// keeps its digits or at zero, whichever is further out.
void BeamPackets::bound_slopes() {
    constexpr double LOST = 2 * double(SMALLEST_FLOAT) / double(SMALLEST_MAIN);
    const float relative_to[2] = {slope_u, slope_v};
    for (int n = 0; n < 2; ++n) {
        const auto slope = [&](double relative, double outwards) {
            const double error = 4 * double(FLOAT_ROUNDOFF) * std::abs(relative) + LOST;
            const double value = relative_to[n] + relative + outwards * error;
            if (std::abs(value) >= double(SMALLEST_SLOPE))
                return float(value);
            return value * outwards > 0 ? float(outwards) * SMALLEST_SLOPE : 0.0f;
        };
        slope_lo[n] = slope(slope_lo[n], -1);
        slope_hi[n] = slope(slope_hi[n], 1);
    }
}

uint32_t BeamPackets::found_count() const {
    uint32_t found = 0;
    for (uint32_t n = 0; n < count; ++n)
        found += uint32_t(std::popcount(covered.has(n) ? lanes[n].active : lanes[n].found));
    return found;
}

void BeamPackets::settle_packet(const RayGroup &rays, uint32_t number) {
    if (unloaded.has(number))
        load_camera_packet(rays, number);
    if (!covered.has(number))
        return;
    BeamPacket &packet = packets[number];
    const Cover &cover = covers[number];
    covered.remove(number);
    const FloatPacket depth =
        fused(packet.u, FloatPacket(cover.of_u),
              fused(packet.v, FloatPacket(cover.of_v), FloatPacket(cover.constant)));
    const FloatPacket error(cover.error);
    const LaneBits active = lanes[number].active;
    lanes[number].found = active;
    packet.primitive = UIntPacket(cover.primitive);
    packet.least =
        masked(active, fused(depth, FloatPacket(cover.shrink), -error), INFINITE);
    packet.greatest = fused(depth, FloatPacket(cover.grow), error);
}

void BeamPackets::load(const RayGroup &rays, uint32_t first, uint32_t ray_count,
                       const CameraMap *camera) {
    parallel = false;
    origin = rays.common_origin;
    count = 0;
    any_active = any_stray = false;
    if (!is_finite(origin) || !choose_axis(rays, first, ray_count))
        return;
    covered = unloaded = {};
    std::optional<uint32_t> first_active;
    FarthestEnds farthest;
    for (uint32_t i = first; i < first + ray_count; i += PACKET_WIDTH) {
        const uint32_t n = count++;
        lanes[n].first_ray = i;
        const FarthestEnds ends = load_packet(rays, first + ray_count, n);
        farthest.begin = maximum(ends.begin, farthest.begin);
        farthest.greatest = maximum(ends.greatest, farthest.greatest);
        if (lanes[n].active != 0 && !first_active)
            first_active = n;
        any_stray |= lanes[n].strays != 0;
    }
    if (!first_active)
        return;
    any_active = true;
    nearest = (1 - WIDEN_DEPTH) / greatest_lane(farthest.begin);
    const uint32_t lane = uint32_t(__builtin_ctz(lanes[*first_active].active));
    rectangle = {};
    rectangle.center_u = to_lanes<float>(packets[*first_active].u)[lane];
    rectangle.center_v = to_lanes<float>(packets[*first_active].v)[lane];
    if (camera)
        turn_as_film(*camera);
    else
        turn_as_rays();
    fit_rectangle();
    bound_slopes();
    const float end = greatest_lane(farthest.greatest);
    for (uint32_t r = 0; r < run_count(); ++r)
        runs[r].greatest.fill(end);
}

} // namespace mlrt
