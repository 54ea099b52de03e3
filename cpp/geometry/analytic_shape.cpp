#include "geometry/analytic_shape.h"

#include <cmath>
#include <limits>
#include <utility>

namespace mlrt {

namespace {

// Both solutions of |f + t d|^2 = r^2, for vectors of two or three dimensions given by
// their products: a = d.d, b = -f.d, c = f.f - r^2, and rest = r^2 - |f + (b / a) d|^2,
// which the discriminant is a multiple of.
//
// Haines, Guenther and Akenine-Moeller, "Precision improvements for ray/sphere
// intersection", Ray Tracing Gems (2019), chapter 7: the rest is what is left of the square
// of the radius at the point of the line nearest to the centre, where nothing large
// cancels (their equation 5), and of both solutions the one that does not cancel gives the
// other (Press et al., Numerical Recipes, section 5.6).
Crossings solve(double a, double b, double c, double rest) {
    Crossings crossings;
    if (!(a > 0 && rest >= 0))
        return crossings;
    const double q = b + std::copysign(std::sqrt(a * rest), b);
    crossings.t[0] = q / a;
    crossings.t[1] = q != 0 ? c / q : q / a;
    if (crossings.t[1] < crossings.t[0])
        std::swap(crossings.t[0], crossings.t[1]);
    crossings.count = 2;
    return crossings;
}

double squared(double x) {
    return x * x;
}

Crossings cross_sphere(const AnalyticShape &sphere, Vec3d origin, Vec3d direction) {
    const Vec3d f = origin - sphere.frame.origin;
    const double a = dot(direction, direction), b = -dot(f, direction);
    const Vec3d nearest = f + direction * (b / a);
    return solve(a, b, dot(f, f) - squared(sphere.radius),
                 squared(sphere.radius) - dot(nearest, nearest));
}

Crossings cross_disk(const AnalyticShape &disk, Vec3d origin, Vec3d direction) {
    const Vec3d o = disk.inverse.point(origin), d = disk.inverse.vector(direction);
    const double t = -o.z / d.z;
    Crossings crossings;
    // False also where the ray lies in the plane and t is not a number.
    if (squared(o.x + t * d.x) + squared(o.y + t * d.y) <= 1) {
        crossings.t[0] = t;
        crossings.count = 1;
    }
    return crossings;
}

Crossings cross_cylinder(const AnalyticShape &cylinder, Vec3d origin, Vec3d direction) {
    const Vec3d o = cylinder.inverse.point(origin);
    const Vec3d d = cylinder.inverse.vector(direction);
    const double a = squared(d.x) + squared(d.y), b = -(o.x * d.x + o.y * d.y);
    const double x = o.x + d.x * (b / a), y = o.y + d.y * (b / a);
    const Crossings wall =
        solve(a, b, squared(o.x) + squared(o.y) - 1, 1 - (squared(x) + squared(y)));
    Crossings crossings;
    for (int i = 0; i < wall.count; ++i) {
        const double z = o.z + wall.t[i] * d.z;
        if (z >= 0 && z <= 1)
            crossings.t[crossings.count++] = wall.t[i];
    }
    return crossings;
}

Vec3d absolute_hypotenuse(Vec3d u, Vec3d v) {
    return {std::hypot(u.x, v.x), std::hypot(u.y, v.y), std::hypot(u.z, v.z)};
}

// The box around two points, each with half the extent `reach` in all directions.
Box3f box_around(Vec3d p, Vec3d q, Vec3d reach) {
    constexpr double WIDER = 0x1p-40; // far above the rounding of all this
    constexpr float INFINITE = std::numeric_limits<float>::infinity();
    Box3f box;
    for (int k = 0; k < 3; ++k) {
        const double slack = WIDER * (std::max(std::abs(p[k]), std::abs(q[k])) + reach[k]);
        box.lo[k] =
            std::nextafter(float(std::min(p[k], q[k]) - reach[k] - slack), -INFINITE);
        box.hi[k] =
            std::nextafter(float(std::max(p[k], q[k]) + reach[k] + slack), INFINITE);
    }
    return box;
}

Box3f box_of(const AnalyticShape &shape) {
    const Affine &frame = shape.frame;
    const Vec3d centre = frame.origin;
    if (shape.type == AnalyticType::sphere)
        return box_around(centre, centre, {shape.radius, shape.radius, shape.radius});
    // A disk reaches sqrt(x_k^2 + y_k^2) far along the axis k.
    const Vec3d reach = absolute_hypotenuse(frame.axes[0], frame.axes[1]);
    const bool has_length = shape.type == AnalyticType::cylinder;
    return box_around(centre, has_length ? centre + frame.axes[2] : centre, reach);
}

} // namespace

AnalyticShape::AnalyticShape(AnalyticType shape_type, const Affine &shape_frame)
    : type(shape_type), frame(shape_frame), inverse(shape_frame.inverse()),
      radius(length(shape_frame.axes[0])) {
    box = box_of(*this);
}

Crossings crossings_of(const AnalyticShape &shape, Vec3d origin, Vec3d direction) {
    switch (shape.type) {
    case AnalyticType::sphere:
        return cross_sphere(shape, origin, direction);
    case AnalyticType::disk:
        return cross_disk(shape, origin, direction);
    case AnalyticType::cylinder:
        return cross_cylinder(shape, origin, direction);
    }
    return {};
}

float nearest_crossing(const AnalyticShape &shape, Vec3d origin, Vec3d direction,
                       float t_min, float t_max) {
    constexpr float INFINITE = std::numeric_limits<float>::infinity();
    const Crossings crossings = crossings_of(shape, origin, direction);
    for (int i = 0; i < crossings.count; ++i) {
        const float t = float(crossings.t[i]);
        if (t > t_min && t <= t_max && t < INFINITE)
            return t;
    }
    return INFINITE;
}

AnalyticPoint point_on(const AnalyticShape &shape, Vec3d p) {
    const Affine &frame = shape.frame;
    switch (shape.type) {
    case AnalyticType::sphere: {
        const Vec3d normal = normalize(p - frame.origin);
        return {frame.origin + normal * shape.radius, normal};
    }
    case AnalyticType::disk: {
        Vec3d normal = normalize(cross(frame.axes[0], frame.axes[1]));
        if (frame.determinant() < 0)
            normal = -normal;
        return {p + normal * dot(normal, frame.origin - p), normal};
    }
    case AnalyticType::cylinder: {
        const Vec3d local = shape.inverse.point(p);
        const double size = std::hypot(local.x, local.y);
        const Vec3d on_wall{local.x / size, local.y / size, local.z};
        // Along dp/du x dp/dv of Mitsuba's cylinder.cpp.
        const Vec3d around = frame.vector({-on_wall.y, on_wall.x, 0});
        return {frame.point(on_wall), normalize(cross(around, frame.axes[2]))};
    }
    }
    return {};
}

AnalyticPoint analytic_point(const AnalyticShape &shape, Vec3d origin, Vec3d direction,
                             float t) {
    // The distance again, without its rounding.
    double exact = t;
    const Crossings crossings = crossings_of(shape, origin, direction);
    for (int i = 0; i < crossings.count; ++i)
        if (float(crossings.t[i]) == t) {
            exact = crossings.t[i];
            break;
        }
    return point_on(shape, origin + direction * exact);
}

} // namespace mlrt
