// A beam: what all rays of a group have in common (Reshetov, Soupikov, Hurley 2005,
// section 3.1).
//
// Bounds are in double precision and hold for the rays as they are stored, in single
// precision: whoever builds a beam accounts for how the directions were computed.
#pragma once

#include "base/vec.h"
#include "mlrta/range.h"
#include "traverse/ray_group.h"

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

namespace mlrt {

enum class Heading : int8_t { negative = -1, mixed = 0, positive = 1 };

inline Heading heading_of(const Range &direction) {
    return direction.lo > 0   ? Heading::positive
           : direction.hi < 0 ? Heading::negative
                              : Heading::mixed;
}

struct Beam {
    std::array<Range, 3> origin; // one point if the rays have a common origin

    // Whether every direction has the same strict sign along an axis. Along an axis of
    // mixed heading there are no slopes, and the beam never culls by planes across it.
    std::array<Heading, 3> heading{};

    // slope[k][j] bounds d_j / d_k and reciprocal[k] bounds 1 / d_k, for k not mixed.
    std::array<std::array<Range, 3>, 3> slope;
    std::array<Range, 3> reciprocal;

    double t_min = std::numeric_limits<double>::infinity(); // no ray begins later
    double t_max = 0;                                       // no ray ends later

    // For covering tests of beams with a common origin: every direction d, or d / |d_k| if
    // corner_axis is an axis k, is a weighted mean of the corners but for at most
    // corner_slack in each component.
    std::array<Vec3d, 4> corners{};
    Vec3d corner_slack{};
    int corner_axis = -1;
    bool has_corners = false;

    // Inward normals n of four planes through a common origin that hold all directions d
    // between them, and how far rounding may carry a direction beyond one: n.d >=
    // -plane_slack times the sum of |n_k| times the largest |d_k|. For the classic frustum
    // test only.
    std::array<Vec3d, 4> plane_normals{};
    double plane_slack = 0;
    bool has_planes = false;

    bool has_common_origin() const {
        return origin[0].lo == origin[0].hi && origin[1].lo == origin[1].hi &&
               origin[2].lo == origin[2].hi;
    }
};

// A camera's rays: direction(x, y) = base + x * dx + y * dy in film coordinates (pixels),
// evaluated in single precision as (base + x * dx) + y * dy by component.
struct CameraMap {
    Vec3f origin;
    Vec3f base, dx, dy;
};

// A square of pixels whose rays form a group: pixels in Morton order (x in the even bits),
// and for each pixel its samples, anywhere in the pixel's unit square or a smaller one.
struct CameraTile {
    CameraMap camera;
    uint32_t x, y;    // of the lower corner, in film coordinates
    uint32_t size;    // pixels along the side, a power of two
    uint32_t samples; // rays a pixel
    // Where in their pixel samples begin and end to lie, along both axes.
    float begin = 0, end = 1;
};

// A part of the film, in film coordinates.
struct FilmRectangle {
    double x, y; // of the lower corner
    double width, height;

    Vec2<double> middle() const { return {x + 0.5 * width, y + 0.5 * height}; }
};

// Where the samples of a run of the tile's rays lie, if its pixels are an aligned square or
// double square, or one.
std::optional<FilmRectangle> film_of(const CameraTile &tile, uint32_t first,
                                     uint32_t count);

// The exact direction at a place of the film, and how far a computed one may be from that
// of its place, by component: delta below.
Vec3d direction(const CameraMap &camera, double x, double y);
Vec3d direction_error(const CameraMap &camera, const FilmRectangle &film);

// A camera's tile and what its rays have in common.
struct CameraRays {
    CameraTile tile;
    float t_min, t_max; // no ray begins or ends later, a negative t_min counting as zero
    bool are_alike;     // all begin and end there, and there is something between
};

CameraRays camera_rays(const RayGroup &rays, const CameraTile &tile);

// B1: the beam of a rectangle of the film, x in [x0, x1], y in [y0, y1].
//
// A slope is a quotient of two functions that are linear in (x, y), so where the
// denominator does not vanish it is monotone along every line and extreme at a corner; this
// holds for directions shifted by a constant too. A computed direction differs from the
// exact one by at most delta_j = 4u (|base_j| + |x dx_j| + |y dy_j|), so the quotients of
// the corners' intervals [d_j - delta_j, d_j + delta_j] bound all of them.
//
// All rays must begin at t_min at the latest and end at t_max at the latest.
Beam camera_beam(const CameraMap &camera, double x0, double x1, double y0, double y1,
                 double t_min, double t_max);

// B1 for a run of the tile's rays. Returns whether there is film_of() it.
bool tile_beam(const CameraTile &tile, uint32_t first, uint32_t count, double t_min,
               double t_max, Beam &beam);

// B2 and B3: the beam of rays as they are. B2 is the case of a common origin, such as a
// light with the points it may reach. Inactive rays do not count. If there is no active one
// the beam is that of no ray, and may exclude anything.
Beam ray_beam(const RayGroup &rays, uint32_t first, uint32_t count);

} // namespace mlrt
