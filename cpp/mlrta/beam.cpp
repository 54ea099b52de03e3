#include "mlrta/beam.h"

#include "base/check.h"
#include "base/morton.h"
#include "base/reciprocal_estimate.h"
#include "base/simd.h"
#include "mlrta/packet_range.h"
#include "traverse/load_packet.h"

#include <algorithm>
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

// For a beam without better ones: of all d / |d_k|, which lie in a rectangle of slopes. The
// narrowest one is taken.
void corners_from_slopes(Beam &beam) {
    double least_area = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
        if (beam.heading[k] == Heading::mixed)
            continue;
        const double sign = beam.heading[k] == Heading::positive ? 1 : -1;
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const Range &a = beam.slope[k][i], &b = beam.slope[k][j];
        const double area = (a.hi - a.lo) * (b.hi - b.lo);
        if (!(area < least_area))
            continue;
        least_area = area;
        beam.corner_axis = k;
        beam.has_corners = true;
        for (int c = 0; c < 4; ++c) {
            beam.corners[c][k] = sign;
            beam.corners[c][i] = sign * (c & 1 ? a.hi : a.lo);
            beam.corners[c][j] = sign * (c & 2 ? b.hi : b.lo);
        }
    }
}

// An estimate of a reciprocal, a rounding to single precision and those of what follows,
// and quotients that underflow.
constexpr double WIDEN_QUOTIENT = 0x1p-21, SMALLEST_QUOTIENT = 0x1p-120;
static_assert(WIDEN_QUOTIENT > 1.5 * RECIPROCAL_ESTIMATE_ERROR);

// Bounds of what the active rays of a group have, sixteen rays at a time.
class RayBounds {
public:
    explicit RayBounds(bool has_common_origin) : has_common_origin_(has_common_origin) {}

    // Adds up to a packet of rays.
    void add(const RayGroup &rays, uint32_t first, uint32_t count) {
        const FloatPacket t_min = load_padded(rays.t_min, first, first + count);
        const FloatPacket t_max = load_padded(rays.t_max, first, first + count);
        auto active = t_min < t_max;
        Vec3<FloatPacket> d;
        for (int k = 0; k < 3; ++k) {
            d[k] = load_padded(rays.direction[k], first, first + count);
            active &= absolute(d[k]) < FloatPacket(INFINITY);
        }
        const FloatPacket none(PacketRange::NONE);
        for (int k = 0; k < 3; ++k)
            d[k] = select(active, d[k], none);
        const Vec3<FloatPacket> r =
            by_axis([&](int k) { return reciprocal_estimate(d[k]); });
        for (int k = 0; k < 3; ++k) {
            extent_[k].add(d[k]);
            for (int step = 1; step < 3; ++step) {
                const int j = (k + step) % 3;
                slope_[k][j].add(d[j] * r[k]);
            }
            if (!has_common_origin_)
                origin_[k].add(select(
                    active, load_padded(rays.origin[k], first, first + count), none));
        }
        greatest_t_min_ = maximum(select(active, t_min, none), greatest_t_min_);
        greatest_t_max_ = maximum(select(active, t_max, none), greatest_t_max_);
    }

    // A negative t_min counts as zero.
    double greatest_t_min() const { return std::max(greatest_lane(greatest_t_min_), 0.0f); }
    double greatest_t_max() const { return greatest_lane(greatest_t_max_); }
    std::array<Range, 3> extent() const { return of_all_lanes(extent_); }
    std::array<Range, 3> origin() const { return of_all_lanes(origin_); }

    // Whether no quotient of directions overflows or loses precision where it matters.
    bool slopes_are_safe(const std::array<Range, 3> &extent) const {
        constexpr double LEAST = 0x1p-60, GREATEST = 0x1p60;
        for (const Range &e : extent)
            if (e.magnitude() > GREATEST ||
                (heading_of(e) != Heading::mixed &&
                 std::min(std::abs(e.lo), std::abs(e.hi)) < LEAST))
                return false;
        return true;
    }

    std::array<std::array<Range, 3>, 3> slope() const {
        std::array<std::array<Range, 3>, 3> slope;
        for (int k = 0; k < 3; ++k)
            for (int step = 1; step < 3; ++step) {
                const int j = (k + step) % 3;
                const Range rough = slope_[k][j].of_all_lanes().widened(WIDEN_QUOTIENT);
                slope[k][j] = {rough.lo - SMALLEST_QUOTIENT, rough.hi + SMALLEST_QUOTIENT};
            }
        return slope;
    }

private:
    static std::array<Range, 3> of_all_lanes(const std::array<PacketRange, 3> &ranges) {
        return {ranges[0].of_all_lanes(), ranges[1].of_all_lanes(),
                ranges[2].of_all_lanes()};
    }

    bool has_common_origin_;
    std::array<PacketRange, 3> extent_, origin_;
    std::array<std::array<PacketRange, 3>, 3> slope_;
    FloatPacket greatest_t_min_ = -INFINITY, greatest_t_max_ = -INFINITY;
};

// The same slopes in double precision, for directions of any size.
std::array<std::array<Range, 3>, 3> exact_slopes(const RayGroup &rays, uint32_t first,
                                                 uint32_t count) {
    std::array<std::array<Range, 3>, 3> slope;
    for (uint32_t i = first; i < first + count; ++i) {
        const Vec3d d{rays.direction[0][i], rays.direction[1][i], rays.direction[2][i]};
        if (!(rays.t_min[i] < rays.t_max[i]) || !is_finite(d))
            continue;
        // Along an axis with a zero component these are infinite or NaN, and not used.
        for (int k = 0; k < 3; ++k)
            for (int step = 1; step < 3; ++step) {
                const int j = (k + step) % 3;
                slope[k][j].add(d[j] / d[k]);
            }
    }
    return slope;
}

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

Beam ray_beam(const RayGroup &rays, uint32_t first, uint32_t count) {
    RayBounds bounds(rays.has_common_origin);
    for (uint32_t i = first; i < first + count; i += PACKET_WIDTH)
        bounds.add(rays, i, std::min(first + count - i, PACKET_WIDTH));

    Beam beam;
    beam.t_min = bounds.greatest_t_min();
    beam.t_max = bounds.greatest_t_max();
    const std::array<Range, 3> extent = bounds.extent();
    const std::array<std::array<Range, 3>, 3> slope =
        bounds.slopes_are_safe(extent) ? bounds.slope() : exact_slopes(rays, first, count);
    if (!rays.has_common_origin)
        beam.origin = bounds.origin();
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
    if (rays.has_common_origin)
        corners_from_slopes(beam);
    return beam;
}

} // namespace mlrt
