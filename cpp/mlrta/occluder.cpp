#include "mlrta/occluder.h"

#include "geometry/triangle_test.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace mlrt {

namespace {

// Bounds the error of a difference, a cross product and a scalar product in double relative
// to the sum of the products of magnitudes, seven roundings in a row, and that of the
// corners; several times over.
constexpr double ROUNDING = 0x1p-47;

// Least and greatest |d.(p x q)| over the beam if its sign is `sign` for all d.
struct EdgeVolume {
    std::array<double, 4> at_corner; // times the sign
    double error;

    EdgeVolume(const Beam &beam, const Vec3d &size, const Vec3d &p, const Vec3d &q,
               double sign) {
        const Vec3d normal = cross(p, q);
        error = dot(beam.corner_slack, abs(normal)) +
                ROUNDING * dot(size, cross_magnitude(p, q));
        for (size_t c = 0; c < 4; ++c)
            at_corner[c] = sign * dot(beam.corners[c], normal);
    }

    bool is_positive() const {
        return std::min({at_corner[0], at_corner[1], at_corner[2], at_corner[3]}) > error;
    }
};

} // namespace

std::optional<double> covered_until(const Beam &beam, const Triangle &triangle) {
    if (!beam.has_corners)
        return std::nullopt;
    const Vec3d origin{beam.origin[0].lo, beam.origin[1].lo, beam.origin[2].lo};
    const Vec3d a = Vec3d(triangle.a) - origin;
    const Vec3d b = Vec3d(triangle.b) - origin;
    const Vec3d c = Vec3d(triangle.c) - origin;
    // N > 0 if the triangle is seen from the side that makes the volumes positive.
    const double numerator = dot(a, cross(b, c));
    const double sign = numerator < 0 ? -1 : 1;

    // Greatest absolute components of directions.
    Vec3d size = beam.corner_slack;
    for (int k = 0; k < 3; ++k)
        size[k] += std::max({std::abs(beam.corners[0][k]), std::abs(beam.corners[1][k]),
                             std::abs(beam.corners[2][k]), std::abs(beam.corners[3][k])});
    const EdgeVolume u(beam, size, b, c, sign);
    if (!u.is_positive())
        return std::nullopt;
    const EdgeVolume v(beam, size, c, a, sign);
    if (!v.is_positive())
        return std::nullopt;
    const EdgeVolume w(beam, size, a, b, sign);
    if (!w.is_positive())
        return std::nullopt;
    const double error = ROUNDING * dot(abs(a), cross_magnitude(b, c));
    if (!(sign * numerator > error))
        return std::nullopt;

    double least = std::numeric_limits<double>::infinity(), greatest = 0;
    for (size_t i = 0; i < 4; ++i) {
        const double sum = u.at_corner[i] + v.at_corner[i] + w.at_corner[i];
        least = std::min(least, sum);
        greatest = std::max(greatest, sum);
    }
    const double sum_error = (u.error + v.error + w.error) * (1 + ROUNDING);
    if (!(least > sum_error))
        return std::nullopt;
    // From d / |d_k| to d.
    double least_scale = 1, greatest_scale = 1;
    if (beam.corner_axis >= 0) {
        const Range &reciprocal = beam.reciprocal[size_t(beam.corner_axis)];
        least_scale = std::min(std::abs(reciprocal.lo), std::abs(reciprocal.hi));
        greatest_scale = reciprocal.magnitude();
    }
    // Each is off by a few roundings, and by one to float for a reported distance: half a
    // unit in the last place, or half the smallest float.
    constexpr double BELOW = 1 - 0x1p-22, ABOVE = 1 + 0x1p-22;
    const double first =
        (sign * numerator - error) / (greatest + sum_error) * least_scale * BELOW -
        SMALLEST_FLOAT;
    const double last =
        (sign * numerator + error) / (least - sum_error) * greatest_scale * ABOVE +
        SMALLEST_FLOAT;
    // Infinity stands for a miss.
    if (!(first > beam.t_min) || !(last < std::numeric_limits<float>::max()))
        return std::nullopt;
    return last;
}

} // namespace mlrt
