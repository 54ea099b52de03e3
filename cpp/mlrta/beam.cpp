#include "mlrta/beam.h"

#include <bit>
#include <cmath>

namespace mlrt {

namespace {

// Covers the few roundings of a quotient or product of doubles, many times over.
constexpr double WIDEN = 0x1p-45;

Heading heading_of(const Range &direction) {
    return direction.lo > 0   ? Heading::positive
           : direction.hi < 0 ? Heading::negative
                              : Heading::mixed;
}

// For a beam without better ones: the slopes along its main axis, as planes.
void planes_from_slopes(Beam &beam) {
    for (int k = 0; k < 3; ++k) {
        if (beam.heading[k] == Heading::mixed)
            continue;
        const double sign = beam.heading[k] == Heading::positive ? 1 : -1;
        int plane = 0;
        for (int step = 1; step < 3; ++step) {
            const int j = (k + step) % 3;
            // d_j / d_k >= lo and <= hi, multiplied by d_k.
            Vec3d above{}, below{};
            above[j] = sign;
            above[k] = -sign * beam.slope[k][j].lo;
            below[j] = -sign;
            below[k] = sign * beam.slope[k][j].hi;
            beam.plane_normals[plane++] = above;
            beam.plane_normals[plane++] = below;
        }
        beam.plane_slack = WIDEN;
        beam.has_planes = beam.has_common_origin();
        return;
    }
}

} // namespace

Beam camera_beam(const CameraMap &camera, double x0, double x1, double y0, double y1,
                 double t_max) {
    constexpr double u = 0x1p-24;
    Beam beam;
    for (int k = 0; k < 3; ++k)
        beam.origin[k] = {camera.origin[k], camera.origin[k]};
    beam.t_max = t_max;

    // In order around the rectangle, as the planes need them.
    const std::array<Vec2<double>, 4> corners{{{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}};
    std::array<Vec3d, 4> directions;
    Vec3d delta{};
    for (int c = 0; c < 4; ++c)
        directions[c] = Vec3d(camera.base) + Vec3d(camera.dx) * corners[c].x +
                        Vec3d(camera.dy) * corners[c].y;
    for (int k = 0; k < 3; ++k) {
        const double size = std::abs(camera.base[k]) +
                            std::max(std::abs(x0), std::abs(x1)) * std::abs(camera.dx[k]) +
                            std::max(std::abs(y0), std::abs(y1)) * std::abs(camera.dy[k]);
        delta[k] = 4 * u * size + 0x1p-140;
    }

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
        beam.reciprocal[k] = beam.reciprocal[k].widened(WIDEN);
        for (Range &slope : beam.slope[k])
            slope = slope.widened(WIDEN);
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
    beam.plane_slack = 64 * max_component(delta) / smallest + WIDEN;
    return beam;
}

bool tile_beam(const CameraTile &tile, uint32_t first, uint32_t count, double t_max,
               Beam &beam) {
    if (first % tile.samples != 0 || count % tile.samples != 0)
        return false;
    const uint32_t pixel = first / tile.samples, pixels = count / tile.samples;
    if (!std::has_single_bit(pixels) || pixel % pixels != 0)
        return false;
    // Even bits of a Morton index are x, odd ones y.
    uint32_t x = 0, y = 0;
    for (int bit = 0; bit < 16; ++bit) {
        x |= ((pixel >> (2 * bit)) & 1u) << bit;
        y |= ((pixel >> (2 * bit + 1)) & 1u) << bit;
    }
    const int levels = std::countr_zero(pixels);
    const double x0 = tile.x + x, y0 = tile.y + y;
    beam = camera_beam(tile.camera, x0, x0 + (1u << ((levels + 1) / 2)), y0,
                       y0 + (1u << (levels / 2)), t_max);
    return true;
}

Beam ray_beam(const RayGroup &rays, uint32_t first, uint32_t count) {
    Beam beam;
    beam.t_max = -std::numeric_limits<double>::infinity();
    std::array<Range, 3> extent;
    std::array<std::array<Range, 3>, 3> slope;
    for (uint32_t i = first; i < first + count; ++i) {
        if (!(rays.t_min[i] < rays.t_max[i]))
            continue;
        const Vec3d d{rays.direction[0][i], rays.direction[1][i], rays.direction[2][i]};
        if (!is_finite(d))
            continue;
        for (int k = 0; k < 3; ++k)
            extent[k].add(d[k]);
        // Along an axis with a zero component these are infinite or NaN, and not used.
        const double rx = 1.0 / d.x, ry = 1.0 / d.y, rz = 1.0 / d.z;
        slope[0][1].add(d.y * rx);
        slope[0][2].add(d.z * rx);
        slope[1][0].add(d.x * ry);
        slope[1][2].add(d.z * ry);
        slope[2][0].add(d.x * rz);
        slope[2][1].add(d.y * rz);
        beam.t_max = std::max(beam.t_max, double(rays.t_max[i]));
        if (!rays.has_common_origin)
            for (int k = 0; k < 3; ++k)
                beam.origin[k].add(rays.origin[k][i]);
    }
    for (int k = 0; k < 3; ++k) {
        if (rays.has_common_origin)
            beam.origin[k] = {rays.common_origin[k], rays.common_origin[k]};
        beam.heading[k] = heading_of(extent[k]);
        if (beam.heading[k] == Heading::mixed)
            continue;
        beam.reciprocal[k] = Range{1 / extent[k].hi, 1 / extent[k].lo}.widened(WIDEN);
        for (int step = 1; step < 3; ++step) {
            const int j = (k + step) % 3;
            beam.slope[k][j] = slope[k][j].widened(WIDEN);
        }
    }
    planes_from_slopes(beam);
    return beam;
}

} // namespace mlrt
