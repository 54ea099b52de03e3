#include "mlrta/film_slopes.h"

#include "geometry/triangle_test.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

FilmSlopes::FilmSlopes(const CameraMap &camera, const FilmRectangle &film,
                       const std::array<int, 3> &axes, float side) {
    const auto ordered = [&](const Vec3d &v, double times) -> Vec3d {
        return {v[axes[0]], v[axes[1]], v[axes[2]] * times};
    };
    map_ = {ordered(Vec3d(camera.base), side), ordered(Vec3d(camera.dx), side),
            ordered(Vec3d(camera.dy), side)};
    Range u, v;
    for (uint32_t c = 0; c < 4; ++c) {
        const Vec3d d = direction(film.x + (c & 1 ? film.width : 0),
                                  film.y + (c & 2 ? film.height : 0));
        corners_[c] = {d.x / d.z, d.y / d.z};
        u.add(corners_[c].x);
        v.add(corners_[c].y);
        main_.add(d.z);
    }
    const Vec3d delta = ordered(direction_error(camera, film), 1);
    main_ = {main_.lo - delta.z, main_.hi + delta.z};
    slopes_ = {slope_of(0, u, delta), slope_of(1, v, delta)};
}

// A direction differs by at most delta from that of its place, its slope thus by (delta_i +
// |u| delta_k) / d_k, and by two roundings.
FilmSlopes::Slope FilmSlopes::slope_of(int n, const Range &range,
                                       const Vec3d &delta) const {
    if (map_.base[n] == 0 && map_.dx[n] == 0 && map_.dy[n] == 0)
        return {range, 0};
    const double size = range.magnitude();
    return {range,
            (delta[n] + size * delta.z) / main_.lo + 8 * double(FLOAT_ROUNDOFF) * size};
}

Vec2<double> FilmSlopes::at(double x, double y) const {
    const Vec3d d = direction(x, y);
    return {d.x / d.z, d.y / d.z};
}

Vec2<double> FilmSlopes::along_x() const {
    const auto middle = [&](int n) {
        return 0.5 * (slope(n).range.lo + slope(n).range.hi);
    };
    return {map_.dx.x - middle(0) * map_.dx.z, map_.dx.y - middle(1) * map_.dx.z};
}

FilmCoordinate FilmSlopes::coordinate(double c, double s) const {
    FilmCoordinate result;
    for (const Vec2<double> &corner : corners_)
        result.range.add(c * corner.x + s * corner.y);
    const auto change = [&](const Vec3d &d) {
        const double straight = c * d.x + s * d.y;
        return std::max(std::abs(straight - result.range.lo * d.z),
                        std::abs(straight - result.range.hi * d.z)) /
               main_.lo;
    };
    result.by_x = change(map_.dx);
    result.by_y = change(map_.dy);
    return result;
}

} // namespace mlrt
