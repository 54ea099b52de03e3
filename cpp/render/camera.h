// Rays of a pinhole camera as an affine map of the film.
#pragma once

#include "mlrta/beam.h"
#include "render/scene.h"

#include <cmath>

namespace mlrt {

// The ray through the film position (x, y), in pixels of the whole film, is
//   origin + t * (d0 + x * dx + y * dy)
// with a direction whose component along the camera's z is 1. So t is the depth along z,
// all rays share origin and interval, and a rectangle of the film is a rectangle of
// directions. That is what beams are made of.
struct ImagePlane {
    Vec3f origin{};
    Vec3d d0{}, dx{}, dy{};
    CameraMap single; // the same map in single precision, which makes the rays
    float near_clip = 0, far_clip = 0;

    Vec3f direction(float x, float y) const {
        return (single.base + x * single.dx) + y * single.dy;
    }
};

// Mitsuba's perspective.cpp and sensor.h: camera x points to the left of the picture, y up,
// and the field of view spans the width of the whole film.
inline ImagePlane image_plane(const Camera &camera, const Film &film) {
    const double tan_x = camera.tan_half_fov_x;
    const double tan_y = tan_x * film.height / film.width;
    const Vec3d x_axis(camera.axes[0]), y_axis(camera.axes[1]), z_axis(camera.axes[2]);
    const double shift_x = 1 - 2 * double(camera.principal_point_offset.x);
    const double shift_y = 1 - 2 * double(camera.principal_point_offset.y);

    ImagePlane plane;
    plane.origin = camera.origin;
    plane.d0 = z_axis + (shift_x * tan_x) * x_axis + (shift_y * tan_y) * y_axis;
    plane.dx = (-2 * tan_x / film.width) * x_axis;
    plane.dy = (-2 * tan_y / film.height) * y_axis;
    plane.single = {camera.origin, Vec3f(plane.d0), Vec3f(plane.dx), Vec3f(plane.dy)};
    plane.near_clip = camera.near_clip;
    plane.far_clip = camera.far_clip;
    return plane;
}

} // namespace mlrt
