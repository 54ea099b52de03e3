// Beams of a camera's rays: bounds come from the film, and rays are not looked at before
// that is needed. Where one triangle covers a packet it never is.
#include "mlrta/beam_packets.h"
#include "traverse/load_packet.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

namespace mlrt {

namespace {

constexpr uint32_t RUN_RAYS = PACKET_WIDTH * PACKET_WIDTH;

constexpr double ROUNDOFF = FLOAT_ROUNDOFF;
// Covers the roundings of what is kept in single precision.
constexpr double ROUNDED_UP = 1 + 8 * ROUNDOFF;

// Slopes may not be so small wherever rays go, unless all are zero; see SMALLEST_SLOPE.
constexpr double SMALLEST_ERROR = 0x1p-99;

// A coordinate of slopes over a part of the film.
struct Coordinate {
    Range range;
    double by_x = 0, by_y = 0; // bounds of how fast it changes, by pixel

    // How far it may be from its value in the middle of a part of the film.
    float reach(const FilmRectangle &film, double slack) const {
        return float((0.5 * (by_x * film.width + by_y * film.height) + slack) * ROUNDED_UP);
    }
};

// The bits at even places, side by side.
UIntPacket even_bits(UIntPacket bits) {
    bits = bits & 0x55555555u;
    bits = (bits | bits >> 1) & 0x33333333u;
    bits = (bits | bits >> 2) & 0x0f0f0f0fu;
    bits = (bits | bits >> 4) & 0x00ff00ffu;
    return (bits | bits >> 8) & 0x0000ffffu;
}

// Directions of a camera in the order (i, j, k), the last component times `side`.
struct SlopeMap {
    Vec3d base, dx, dy;

    SlopeMap(const CameraMap &camera, const std::array<int, 3> &axes, float side) {
        const auto ordered = [&](Vec3f v) -> Vec3d {
            return {v[axes[0]], v[axes[1]], v[axes[2]] * side};
        };
        base = ordered(camera.base);
        dx = ordered(camera.dx);
        dy = ordered(camera.dy);
    }
    Vec3d direction(double x, double y) const { return base + dx * x + dy * y; }
};

} // namespace

// The slopes of directions (d_i, d_j, d_k) of which the components are linear in the film
// are extreme at its corners, as in camera_beam(), and so is P = c u + s v. Its derivative
// along x is (c d_i' + s d_j' - P d_k') / d_k with d' = dx: linear in P, and thus extreme
// at an end of its range, where d_k is least.
//
// A direction differs by at most delta from that of its place on the film, its slopes thus
// by (delta_i + |u| delta_k) / d_k, and by their two roundings. Coordinates p and q are
// rounded as fit_rectangle() has it. The middle of a packet is computed as its rays are,
// with the same error.
bool BeamPackets::load_camera(const RayGroup &rays, uint32_t first, uint32_t ray_count,
                              const CameraRays &camera) {
    const CameraTile &tile = camera.tile;
    const bool is_whole = ray_count % (ray_count > RUN_RAYS ? RUN_RAYS : PACKET_WIDTH) == 0;
    if (!camera.are_alike || !is_whole || !std::has_single_bit(tile.samples) ||
        !is_finite(rays.common_origin))
        return false;
    const auto film = film_of(tile, first, ray_count);
    const auto of_packet = film_of(tile, first, PACKET_WIDTH);
    if (!film || !of_packet)
        return false;

    const Vec2<double> middle = film->middle();
    set_axes(Vec3f(direction(tile.camera, middle.x, middle.y)));
    const SlopeMap map(tile.camera, axes, side);
    Range u, v, main;
    std::array<Vec2<double>, 4> corners;
    for (uint32_t c = 0; c < 4; ++c) {
        const Vec3d d = map.direction(film->x + (c & 1 ? film->width : 0),
                                      film->y + (c & 2 ? film->height : 0));
        corners[c] = {d.x / d.z, d.y / d.z};
        u.add(corners[c].x);
        v.add(corners[c].y);
        main.add(d.z);
    }
    const Vec3d delta = direction_error(tile.camera, *film);
    main = {main.lo - delta[axes[2]], main.hi + delta[axes[2]]};
    if (!(main.lo >= SMALLEST_MAIN && main.hi <= LARGEST_MAIN))
        return false;
    // Returns how far a slope may be from that of its place.
    const auto slope_error = [&](int n, const Range &slope) -> std::optional<double> {
        if (map.base[n] == 0 && map.dx[n] == 0 && map.dy[n] == 0)
            return 0;
        const double size = slope.magnitude();
        const double error = (delta[axes[size_t(n)]] + size * delta[axes[2]]) / main.lo +
                             8 * ROUNDOFF * size;
        if (error < SMALLEST_ERROR || !(size + error <= GREATEST_SLOPE))
            return std::nullopt;
        return error;
    };
    const auto error_u = slope_error(0, u), error_v = slope_error(1, v);
    if (!error_u || !error_v)
        return false;

    parallel = false;
    origin = rays.common_origin;
    slope_lo[0] = float(u.lo - *error_u);
    slope_hi[0] = float(u.hi + *error_u);
    slope_lo[1] = float(v.lo - *error_v);
    slope_hi[1] = float(v.hi + *error_v);

    // The image of the film's x axis.
    const double middle_u = 0.5 * (u.lo + u.hi), middle_v = 0.5 * (v.lo + v.hi);
    const Vec2<double> along{map.dx.x - middle_u * map.dx.z,
                             map.dx.y - middle_v * map.dx.z};
    const double length = std::sqrt(along.x * along.x + along.y * along.y);
    rectangle = {};
    if (length > 0 && std::isfinite(length)) {
        rectangle.cosine = float(along.x / length);
        rectangle.sine = float(along.y / length);
    }
    const double c = rectangle.cosine, s = rectangle.sine;
    const auto coordinate = [&](double of_u, double of_v) {
        Coordinate result;
        for (const Vec2<double> &corner : corners)
            result.range.add(of_u * corner.x + of_v * corner.y);
        const auto change = [&](const Vec3d &d) {
            const double straight = of_u * d.x + of_v * d.y;
            return std::max(std::abs(straight - result.range.lo * d.z),
                            std::abs(straight - result.range.hi * d.z)) /
                   main.lo;
        };
        result.by_x = change(map.dx);
        result.by_y = change(map.dy);
        return result;
    };
    const Coordinate p = coordinate(c, s), q = coordinate(-s, c);
    const double middle_p = 0.5 * (p.range.lo + p.range.hi);
    const double middle_q = 0.5 * (q.range.lo + q.range.hi);
    rectangle.center_u = float(c * middle_p - s * middle_q);
    rectangle.center_v = float(s * middle_p + c * middle_q);
    const double center_p = c * rectangle.center_u + s * rectangle.center_v;
    const double center_q = c * rectangle.center_v - s * rectangle.center_u;
    const double half_p = std::max(center_p - p.range.lo, p.range.hi - center_p);
    const double half_q = std::max(center_q - q.range.lo, q.range.hi - center_q);
    const double slack =
        (*error_u + *error_v + 64 * ROUNDOFF * std::max(half_p, half_q)) * ROUNDED_UP +
        LEAST_SLACK;
    rectangle.slack = float(slack);
    rectangle.half_p = float((half_p + slack) * ROUNDED_UP);
    rectangle.half_q = float((half_q + slack) * ROUNDED_UP);

    count = ray_count / PACKET_WIDTH;
    any_active = true;
    any_stray = false;
    covered = 0;
    unloaded = ~uint64_t(0) >> (CAPACITY - count);
    for (uint32_t n = 0; n < count; ++n) {
        BeamPacket &packet = packets[n];
        packet.first_ray = first + n * PACKET_WIDTH;
        packet.active = ALL_LANES;
        packet.found = packet.strays = 0;
    }
    set_camera_ends(camera.t_min, camera.t_max, main);

    const float packet_p = p.reach(*of_packet, 2 * slack);
    const float packet_q = q.reach(*of_packet, 2 * slack);
    // Boxes may reach beyond the rectangle, since slopes do not change as fast everywhere.
    // |u| + |v| grows by at most sqrt(2) (|p| + |q|).
    const FilmRectangle widest =
        count > PACKET_WIDTH ? *film_of(tile, first, RUN_RAYS) : *of_packet;
    greatest_sum = 1 + std::abs(rectangle.center_u) + std::abs(rectangle.center_v) +
                   1.5f * (rectangle.half_p + p.reach(widest, 2 * slack) +
                           rectangle.half_q + q.reach(widest, 2 * slack));
    const CameraMap &linear = tile.camera;
    const float middle_x = float(0.5 * of_packet->width) + tile.begin;
    const float middle_y = float(0.5 * of_packet->height) + tile.begin;
    const auto [i, j, k] = axes;
    for (uint32_t r = 0; r < run_count(); ++r) {
        const uint32_t first_of_run = first + r * RUN_RAYS;
        const UIntPacket code =
            (UIntPacket(first_of_run) + lane_indices() * PACKET_WIDTH) >>
            uint32_t(std::countr_zero(tile.samples));
        const FloatPacket x = FloatPacket(UIntPacket(tile.x) + even_bits(code)) + middle_x;
        const FloatPacket y =
            FloatPacket(UIntPacket(tile.y) + even_bits(code >> 1)) + middle_y;
        const auto component = [&](int axis) {
            return fused(
                y, FloatPacket(linear.dy[axis]),
                fused(x, FloatPacket(linear.dx[axis]), FloatPacket(linear.base[axis])));
        };
        const FloatPacket reciprocal = 1.0f / (component(k) * side);
        const FloatPacket du = component(i) * reciprocal - rectangle.center_u;
        const FloatPacket dv = component(j) * reciprocal - rectangle.center_v;
        const LaneBits there = first_lanes(count - r * PACKET_WIDTH);
        constexpr float nowhere = std::numeric_limits<float>::quiet_NaN();
        Run &run = runs[r];
        run.center_p = masked(
            there, fused(du, FloatPacket(rectangle.cosine), dv * rectangle.sine), nowhere);
        run.center_q = masked(
            there, fused(dv, FloatPacket(rectangle.cosine), du * -rectangle.sine), nowhere);
        run.half_p = FloatPacket(packet_p);
        run.half_q = FloatPacket(packet_q);
        store(run.least.data(),
              masked(there, mlrt::load<FloatPacket>(run.least), INFINITE));
        run.all = {0, 0, rectangle.half_p, rectangle.half_q, run.all.least};
        if (count <= PACKET_WIDTH)
            continue;
        const FilmRectangle part = *film_of(tile, first_of_run, RUN_RAYS);
        const Vec2<double> at = part.middle();
        const Vec3d d = map.direction(at.x, at.y);
        run.all.center_p = float((c * d.x + s * d.y) / d.z - center_p);
        run.all.center_q = float((c * d.y - s * d.x) / d.z - center_q);
        run.all.half_p = p.reach(part, 2 * slack);
        run.all.half_q = q.reach(part, 2 * slack);
    }
    return true;
}

// As load_packet() does, but for all rays at once.
void BeamPackets::set_camera_ends(float t_min, float t_max, const Range &main) {
    const double begin = std::max({double(t_min), 0.0, double(SMALLEST_DISTANCE)});
    nearest = float((1 - 2 * WIDEN_DEPTH) / (begin * main.hi + SMALLEST_DEPTH));
    float least = 0, greatest = INFINITE;
    if (t_max >= SMALLEST_END && t_max * main.lo >= SMALLEST_END) {
        least = float((1 - 2 * WIDEN_DEPTH) / (t_max * main.hi));
        greatest = float((1 + 2 * WIDEN_DEPTH) / (t_max * main.lo));
    }
    for (uint32_t r = 0; r < run_count(); ++r) {
        runs[r].least.fill(least);
        runs[r].greatest.fill(greatest);
        runs[r].all.least = least;
    }
}

} // namespace mlrt
