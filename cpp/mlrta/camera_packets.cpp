// Beams of a camera's rays: bounds come from the film, and rays are not looked at before
// that is needed. Where one triangle covers a packet they never are.
#include "base/morton.h"
#include "mlrta/beam_packets.h"
#include "mlrta/film_slopes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace mlrt {

namespace {

constexpr uint32_t RUN_RAYS = PACKET_WIDTH * PACKET_WIDTH;

constexpr double ROUNDOFF = FLOAT_ROUNDOFF;
// Covers the roundings of what is kept in single precision.
constexpr double ROUNDED_UP = 1 + 8 * ROUNDOFF;

// Slopes may not be so small wherever rays go, unless all are zero; see SMALLEST_SLOPE.
constexpr double SMALLEST_ERROR = 0x1p-99;

} // namespace

bool BeamPackets::load_camera(const RayGroup &rays, uint32_t first, uint32_t ray_count,
                              const CameraRays &camera) {
    const CameraTile &tile = camera.tile;
    const bool is_whole = ray_count % (ray_count > RUN_RAYS ? RUN_RAYS : PACKET_WIDTH) == 0;
    if (!camera.are_alike || !is_whole || !std::has_single_bit(tile.samples) ||
        !is_finite(rays.common_origin))
        return false;
    const auto film = film_of(tile, first, ray_count);
    if (!film || !film_of(tile, first, PACKET_WIDTH))
        return false;

    const Vec2<double> middle = film->middle();
    set_axes(Vec3f(direction(tile.camera, middle.x, middle.y)));
    const FilmSlopes slopes(tile.camera, *film, axes, side);
    if (!(slopes.main().lo >= SMALLEST_MAIN && slopes.main().hi <= LARGEST_MAIN))
        return false;
    for (int n = 0; n < 2; ++n) {
        const FilmSlopes::Slope &slope = slopes.slope(n);
        if ((slope.error != 0 && slope.error < SMALLEST_ERROR) ||
            !(slope.size() <= GREATEST_SLOPE))
            return false;
        slope_lo[n] = float(slope.range.lo - slope.error);
        slope_hi[n] = float(slope.range.hi + slope.error);
    }

    parallel = false;
    origin = rays.common_origin;
    count = ray_count / PACKET_WIDTH;
    any_active = true;
    any_stray = false;
    covered = {};
    unloaded = Packets::of_first(count);
    for (uint32_t n = 0; n < count; ++n) {
        lanes[n] = {first + n * PACKET_WIDTH, ALL_LANES, 0, 0};
    }
    set_camera_ends(camera.t_min, camera.t_max, slopes.main());
    fit_to_film(tile, first, slopes);
    return true;
}

// Coordinates p and q, here relative to zero slopes, are rounded as fit_rectangle() has it.
// Slopes are relative to the center. The middle of a packet has no greater error than
// slopes that are relative to nothing.
void BeamPackets::fit_to_film(const CameraTile &tile, uint32_t first,
                              const FilmSlopes &slopes) {
    rectangle = {};
    const Vec2<double> along = slopes.along_x();
    const double length = std::sqrt(along.x * along.x + along.y * along.y);
    if (length > 0 && std::isfinite(length)) {
        rectangle.cosine = float(along.x / length);
        rectangle.sine = float(along.y / length);
    }
    const double c = rectangle.cosine, s = rectangle.sine;
    const FilmCoordinate p = slopes.coordinate(c, s), q = slopes.coordinate(-s, c);
    slope_u = float(c * p.middle() - s * q.middle());
    slope_v = float(s * p.middle() + c * q.middle());
    const double center_p = c * slope_u + s * slope_v;
    const double center_q = c * slope_v - s * slope_u;
    const double half_p = std::max(center_p - p.range.lo, p.range.hi - center_p);
    const double half_q = std::max(center_q - q.range.lo, q.range.hi - center_q);
    const double slack = (slopes.slope(0).error + slopes.slope(1).error +
                          64 * ROUNDOFF * std::max(half_p, half_q)) *
                             ROUNDED_UP +
                         LEAST_SLACK;
    rectangle.slack = float(slack);
    rectangle.half_p = float((half_p + slack) * ROUNDED_UP);
    rectangle.half_q = float((half_q + slack) * ROUNDED_UP);

    const auto half_of = [&](const FilmCoordinate &coordinate, const FilmRectangle &part) {
        return float((coordinate.reach(part) + 2 * slack) * ROUNDED_UP);
    };
    const FilmRectangle packet = *film_of(tile, first, PACKET_WIDTH);
    // Boxes may reach beyond the rectangle, since slopes do not change as fast everywhere.
    // |u| + |v| grows by at most sqrt(2) (|p| + |q|).
    const FilmRectangle widest =
        count > PACKET_WIDTH ? *film_of(tile, first, RUN_RAYS) : packet;
    spread = 1.5f * (rectangle.half_p + half_of(p, widest) + rectangle.half_q +
                     half_of(q, widest));
    least_half_p = half_of(p, packet);
    least_half_q = half_of(q, packet);
    for (uint32_t r = 0; r < run_count(); ++r) {
        Run &run = runs[r];
        const uint32_t first_of_run = first + r * RUN_RAYS;
        set_middles(tile, first_of_run, packet, first_lanes(count - r * PACKET_WIDTH), run);
        run.half_p = FloatPacket(least_half_p);
        run.half_q = FloatPacket(least_half_q);
        run.all = {0, 0, rectangle.half_p, rectangle.half_q, run.all.least};
        if (count <= PACKET_WIDTH)
            continue;
        const FilmRectangle part = *film_of(tile, first_of_run, RUN_RAYS);
        const Vec2<double> middle = part.middle();
        const auto [u, v] = slopes.at(middle.x, middle.y);
        run.all.center_p = float(c * u + s * v - center_p);
        run.all.center_q = float(c * v - s * u - center_q);
        run.all.half_p = half_of(p, part);
        run.all.half_q = half_of(q, part);
    }
}

// Of the packets of a run, of which only those `there` are part of the beam. `packet` is
// the film of the first one of the beam.
void BeamPackets::set_middles(const CameraTile &tile, uint32_t first_of_run,
                              const FilmRectangle &packet, LaneBits there, Run &run) const {
    const UIntPacket code = (UIntPacket(first_of_run) + lane_indices() * PACKET_WIDTH) >>
                            uint32_t(std::countr_zero(tile.samples));
    const FloatPacket x = FloatPacket(UIntPacket(tile.x) + even_bits(code)) +
                          (float(0.5 * packet.width) + tile.begin);
    const FloatPacket y = FloatPacket(UIntPacket(tile.y) + even_bits(code >> 1)) +
                          (float(0.5 * packet.height) + tile.begin);
    const auto component = [&](int axis) {
        const CameraMap &map = tile.camera;
        return fused(y, FloatPacket(map.dy[axis]),
                     fused(x, FloatPacket(map.dx[axis]), FloatPacket(map.base[axis])));
    };
    const auto [i, j, k] = axes;
    const FloatPacket reciprocal = 1.0f / (component(k) * side);
    const FloatPacket du = component(i) * reciprocal - slope_u;
    const FloatPacket dv = component(j) * reciprocal - slope_v;
    const FloatPacket c(rectangle.cosine), s(rectangle.sine);
    constexpr float nowhere = std::numeric_limits<float>::quiet_NaN();
    run.center_p = masked(there, fused(du, c, dv * s), nowhere);
    run.center_q = masked(there, fused(dv, c, du * -s), nowhere);
    store(run.least.data(), masked(there, mlrt::load<FloatPacket>(run.least), INFINITE));
}

// As load_packet() does, but for all rays at once.
void BeamPackets::set_camera_ends(float t_min, float t_max, const Range &main) {
    const double begin = std::max({double(t_min), 0.0, double(SMALLEST_DISTANCE)});
    nearest = float((1 - 2 * WIDEN_DEPTH) / (begin * main.hi + LEAST_DEPTH));
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
