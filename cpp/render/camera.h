// Rays of a camera as affine maps of the film.
#pragma once

#include "mlrta/beam.h"
#include "render/scene.h"

#include <cmath>

namespace mlrt {

// Of a pinhole the ray through the film position (x, y), in pixels of the whole film, is
//   origin + t * (d0 + x * dx + y * dy)
// with a direction whose component along the camera's z is 1. So t is the depth along z,
// all rays share origin and interval, and a rectangle of the film is a rectangle of
// directions. That is what beams are made of.
//
// With a lens a ray begins at a point a of it, and meets the ray through the lens's middle
// where that is in focus, at t = f: it is
//   (origin + a) + t * (d0 + x * dx + y * dy - a / f).
//
// Orthographic rays are parallel to the camera's z, and it is their origins that are
//   d0 + x * dx + y * dy.
struct ImagePlane {
    CameraType type = CameraType::perspective;
    Vec3f origin{};
    Vec3d d0{}, dx{}, dy{};
    CameraMap single; // the same map in single precision, which makes the rays
    float near_clip = 0, far_clip = 0;

    // thinlens: a = u * lens_x + v * lens_y for a point (u, v) of the unit disk
    Vec3f lens_x{}, lens_y{};
    float inverse_focus = 0;

    Vec3f parallel{}; // orthographic: the direction of all rays, of unit length

    bool has_common_origin() const { return type == CameraType::perspective; }

    Vec3f direction(float x, float y) const {
        return (single.base + x * single.dx) + y * single.dy;
    }
};

// Mitsuba's perspective.cpp, thinlens.cpp, orthographic.cpp and sensor.h: camera x points
// to the left of the picture, y up, and the field of view spans the width of the whole
// film.
inline ImagePlane image_plane(const Camera &camera, const Film &film) {
    const Vec3d x_axis(camera.axes[0]), y_axis(camera.axes[1]), z_axis(camera.axes[2]);
    const bool parallel = camera.type == CameraType::orthographic;
    // Half the size of the film where it stands at depth 1, or anywhere.
    const double half_x = parallel ? camera.half_extent.x : camera.tan_half_fov_x;
    const double half_y = double(parallel ? camera.half_extent.y : camera.tan_half_fov_x) *
                          film.height / film.width;
    const double shift_x = 1 - 2 * double(camera.principal_point_offset.x);
    const double shift_y = 1 - 2 * double(camera.principal_point_offset.y);

    ImagePlane plane;
    plane.type = camera.type;
    plane.origin = camera.origin;
    plane.d0 = (parallel ? Vec3d(camera.origin) : z_axis) + (shift_x * half_x) * x_axis +
               (shift_y * half_y) * y_axis;
    plane.dx = (-2 * half_x / film.width) * x_axis;
    plane.dy = (-2 * half_y / film.height) * y_axis;
    plane.single = {camera.origin, Vec3f(plane.d0), Vec3f(plane.dx), Vec3f(plane.dy)};
    plane.near_clip = camera.near_clip;
    plane.far_clip = camera.far_clip;
    plane.lens_x = camera.aperture_radius * camera.axes[0];
    plane.lens_y = camera.aperture_radius * camera.axes[1];
    plane.inverse_focus = 1.0f / camera.focus_distance;
    plane.parallel = camera.axes[2];
    return plane;
}

} // namespace mlrt
