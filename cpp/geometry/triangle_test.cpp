#include "geometry/triangle_test.h"

#include "base/expansion.h"
#include "geometry/packet_barycentrics.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace mlrt {

namespace {

using ExactVec3 = std::array<Expansion, 3>;

ExactVec3 exact_difference(Vec3f a, Vec3f b) {
    return {Expansion::difference(a.x, b.x), Expansion::difference(a.y, b.y),
            Expansion::difference(a.z, b.z)};
}

ExactVec3 exact_cross(const ExactVec3 &a, const ExactVec3 &b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0]};
}

Expansion exact_dot(const ExactVec3 &a, const ExactVec3 &b) {
    return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2];
}

ExactVec3 exact_vector(Vec3f v) {
    return {Expansion(v.x), Expansion(v.y), Expansion(v.z)};
}

int exact_volume_sign(Vec3f direction, const ExactVec3 &b, const ExactVec3 &c) {
    return exact_dot(exact_vector(direction), exact_cross(b, c)).sign();
}

// det(d, b, c) in double with a bound on its error: each difference, the products, the
// subtraction and the two additions round once, seven in a row (gamma_7); 10 covers the
// rounding of the bound itself.
struct Volume {
    double value, error;

    Volume(Vec3d d, Vec3d b, Vec3d c)
        : value(dot(d, cross(b, c))),
          error(10 * DOUBLE_ROUNDOFF * dot(abs(d), cross_magnitude(b, c))) {}

    // The sign if it is certain, else 0.
    int sign() const { return value > error ? 1 : value < -error ? -1 : 0; }
};

bool same_side(int u, int v, int w) {
    const int least = std::min({u, v, w}), greatest = std::max({u, v, w});
    return (least >= 0 && greatest > 0) || (greatest <= 0 && least < 0);
}

// The float nearest to numerator / denominator, ties to even.
float rounded_quotient(double numerator, double denominator) {
    const double quotient = numerator / denominator;
    const double step = std::abs(quotient) * 0x1p-52;
    const float below = float(quotient - step), above = float(quotient + step);
    // Rounding to double is monotone, so it only loses the side of a midpoint of floats if
    // it ends on that midpoint; then the remainder, which is exact, tells the side.
    const bool at_midpoint =
        below != above && quotient == 0.5 * (double(below) + double(above));
    const double remainder = std::fma(-quotient, denominator, numerator);
    if (!at_midpoint || remainder == 0)
        return float(quotient);
    return (remainder < 0) == (denominator < 0) ? above : below;
}

} // namespace

HitDecision decide_hit(Vec3f origin, Vec3f direction, const Triangle &triangle) {
    const Vec3d o(origin), d(direction);
    const Vec3d a = Vec3d(triangle.a) - o;
    const Vec3d b = Vec3d(triangle.b) - o;
    const Vec3d c = Vec3d(triangle.c) - o;
    const int u = Volume(d, b, c).sign();
    const int v = Volume(d, c, a).sign();
    const int w = Volume(d, a, b).sign();
    if (u * v < 0 || v * w < 0 || w * u < 0)
        return {false, Precision::filtered};
    if (u != 0 && v != 0 && w != 0)
        return {true, Precision::filtered};

    const ExactVec3 ea = exact_difference(triangle.a, origin);
    const ExactVec3 eb = exact_difference(triangle.b, origin);
    const ExactVec3 ec = exact_difference(triangle.c, origin);
    return {same_side(u != 0 ? u : exact_volume_sign(direction, eb, ec),
                      v != 0 ? v : exact_volume_sign(direction, ec, ea),
                      w != 0 ? w : exact_volume_sign(direction, ea, eb)),
            Precision::exact};
}

float exact_distance(Vec3f origin, Vec3f direction, const Triangle &triangle) {
    // A camera that looks straight at a wall sees all of it at one depth, which may be a
    // midpoint of floats for every ray: worth a shorter way.
    for (int k = 0; k < 3; ++k) {
        if (triangle.a[k] != triangle.b[k] || triangle.a[k] != triangle.c[k])
            continue;
        const SumAndError distance = two_sum(triangle.a[k], -double(origin[k]));
        if (distance.error == 0)
            return rounded_quotient(distance.sum, direction[k]);
    }
    const ExactVec3 normal = exact_cross(exact_difference(triangle.b, triangle.a),
                                         exact_difference(triangle.c, triangle.a));
    const Expansion numerator = exact_dot(normal, exact_difference(triangle.a, origin));
    const Expansion denominator = exact_dot(normal, exact_vector(direction));
    // Each estimate is good to a few 2^-53.
    const double t = numerator.estimate() / denominator.estimate();
    const float below = float(t - std::abs(t) * 0x1p-48);
    const float above = float(t + std::abs(t) * 0x1p-48);
    if (below == above || !std::isfinite(below) || !std::isfinite(above))
        return above;
    // Two neighbouring floats: their midpoint is a double, and t is on one side of it or on
    // it.
    const double midpoint = 0.5 * (double(below) + double(above));
    const Expansion difference = numerator - Expansion(midpoint) * denominator;
    const int side = difference.sign() * denominator.sign();
    return side < 0 ? below : side > 0 ? above : float(midpoint);
}

float hit_distance(Vec3f origin, Vec3f direction, const Triangle &triangle,
                   Counters &counters) {
    const TrianglePlane plane(triangle);
    const PlaneNumerator<double> numerator(plane, Vec3d(triangle.a) - Vec3d(origin));
    const Vec3d d(direction);
    const PlaneDistance<double> distance(plane, numerator, d, max_component(abs(d)));
    if (distance.certain<float>())
        return distance.rounded<float>();
    ++counters.exact_distances;
    return exact_distance(origin, direction, triangle);
}

Vec2f barycentrics(Vec3f origin, Vec3f direction, const Triangle &triangle) {
    return barycentrics_of(origin, direction,
                           Corners<float>{triangle.a, triangle.b, triangle.c});
}

} // namespace mlrt
