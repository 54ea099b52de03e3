#include "mlrta/beam.h"

#include "base/check.h"
#include "base/morton.h"
#include "base/simd.h"
#include "traverse/load_packet.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace mlrt {

namespace {

// Where no coordinate exceeds those.
Vec3d direction_error(const CameraMap &camera, double largest_x, double largest_y) {
    constexpr double u = 0x1p-24;
    Vec3d delta;
    for (int k = 0; k < 3; ++k)
        delta[k] = 4 * u *
                       (std::abs(camera.base[k]) + largest_x * std::abs(camera.dx[k]) +
                        largest_y * std::abs(camera.dy[k])) +
                   0x1p-140;
    return delta;
}

} // namespace

Vec3d direction(const CameraMap &camera, double x, double y) {
    return Vec3d(camera.base) + Vec3d(camera.dx) * x + Vec3d(camera.dy) * y;
}

Vec3d direction_error(const CameraMap &camera, const FilmRectangle &film) {
    return direction_error(camera, film.x + film.width, film.y + film.height);
}

Beam camera_beam(const CameraMap &camera, double x0, double x1, double y0, double y1,
                 double t_min, double t_max) {
    Beam beam;
    for (int k = 0; k < 3; ++k)
        beam.origin[k] = {camera.origin[k], camera.origin[k]};
    beam.t_min = t_min;
    beam.t_max = t_max;

    // In order around the rectangle, as the planes need them.
    const std::array<Vec3d, 4> directions{
        direction(camera, x0, y0), direction(camera, x1, y0), direction(camera, x1, y1),
        direction(camera, x0, y1)};
    const Vec3d delta = direction_error(camera, std::max(std::abs(x0), std::abs(x1)),
                                        std::max(std::abs(y0), std::abs(y1)));
    // Of the 4u in delta, rounding to float takes 3u and a little: there is room for the
    // rounding of the corners.
    beam.corners = directions;
    beam.corner_slack = delta;
    beam.has_corners = true;

    std::array<Range, 3> extent;
    for (int k = 0; k < 3; ++k) {
        for (const Vec3d &d : directions) {
            extent[k].add(d[k] - delta[k]);
            extent[k].add(d[k] + delta[k]);
        }
        beam.heading[k] = heading_of(extent[k]);
    }
    for (int k = 0; k < 3; ++k) {
        if (beam.heading[k] == Heading::mixed)
            continue;
        for (const Vec3d &d : directions) {
            const Range inverse{1 / (d[k] + delta[k]), 1 / (d[k] - delta[k])};
            beam.reciprocal[k].add(inverse);
            for (int step = 1; step < 3; ++step) {
                const int j = (k + step) % 3;
                beam.slope[k][j].add(Range{d[j] - delta[j], d[j] + delta[j]} * inverse);
            }
        }
        beam.reciprocal[k] = beam.reciprocal[k].widened(WIDEN_RANGE);
        for (Range &slope : beam.slope[k])
            slope = slope.widened(WIDEN_RANGE);
    }

    const Vec3d middle = directions[0] + directions[1] + directions[2] + directions[3];
    beam.has_planes = true;
    for (int c = 0; c < 4; ++c) {
        Vec3d normal = cross(directions[c], directions[(c + 1) % 4]);
        const double side = dot(normal, middle);
        if (side < 0)
            normal = -normal;
        // A tile of no extent, or one wider than a half space, has no inside.
        beam.has_planes &= side != 0;
        beam.plane_normals[c] = normal;
    }
    const double smallest =
        std::min({max_component(abs(directions[0])), max_component(abs(directions[1])),
                  max_component(abs(directions[2])), max_component(abs(directions[3]))});
    // Between the corners a direction may be shorter than at them; 64 leaves room for that.
    beam.plane_slack = 64 * max_component(delta) / smallest + WIDEN_RANGE;
    return beam;
}

std::optional<FilmRectangle> film_of(const CameraTile &tile, uint32_t first,
                                     uint32_t count) {
    MLRT_CHECK(uint64_t(first) + count <= uint64_t(tile.size) * tile.size * tile.samples);
    const auto square = [&](uint32_t code, uint32_t pixels) -> FilmRectangle {
        const MortonPoint corner = of_morton_code(code);
        const int levels = std::countr_zero(pixels);
        const double begin = tile.begin, beyond_last = double(tile.end) - begin - 1;
        return {(tile.x + corner.column) + begin, (tile.y + corner.row) + begin,
                (1u << ((levels + 1) / 2)) + beyond_last,
                (1u << (levels / 2)) + beyond_last};
    };
    if (count == 0)
        return std::nullopt;
    if (tile.samples % count == 0 && first % count == 0)
        return square(first / tile.samples, 1);
    if (first % tile.samples != 0 || count % tile.samples != 0)
        return std::nullopt;
    const uint32_t pixel = first / tile.samples, pixels = count / tile.samples;
    if (!std::has_single_bit(pixels) || pixel % pixels != 0)
        return std::nullopt;
    return square(pixel, pixels);
}

bool tile_beam(const CameraTile &tile, uint32_t first, uint32_t count, double t_min,
               double t_max, Beam &beam) {
    const auto film = film_of(tile, first, count);
    if (!film)
        return false;
    beam = camera_beam(tile.camera, film->x, film->x + film->width, film->y,
                       film->y + film->height, t_min, t_max);
    return true;
}

CameraRays camera_rays(const RayGroup &rays, const CameraTile &tile) {
    CameraRays camera{tile, 0, -INFINITY, false};
    if (rays.count == 0)
        return camera;
    if (!rays.t_min.each() && !rays.t_max.each()) {
        const float t_min = std::max(rays.t_min.common(), 0.0f);
        const float t_max = rays.t_max.common();
        return t_min < t_max ? CameraRays{tile, t_min, t_max, true} : camera;
    }
    FloatPacket greatest_t_min(0.0f), greatest_t_max(-INFINITY);
    const FloatPacket first_t_min(rays.t_min[0]), first_t_max(rays.t_max[0]);
    MaskOf<FloatPacket> alike = true;
    for (uint32_t i = 0; i < rays.count; i += PACKET_WIDTH) {
        const FloatPacket t_min = load_padded(rays.t_min, i, rays.count);
        const FloatPacket t_max = load_padded(rays.t_max, i, rays.count);
        greatest_t_min = maximum(t_min, greatest_t_min);
        greatest_t_max = maximum(t_max, greatest_t_max);
        alike &= (t_min == first_t_min) & (t_max == first_t_max);
    }
    camera.t_min = greatest_lane(greatest_t_min);
    camera.t_max = greatest_lane(greatest_t_max);
    camera.are_alike = to_bits(alike) == ALL_LANES && camera.t_min < camera.t_max;
    return camera;
}

} // namespace mlrt
