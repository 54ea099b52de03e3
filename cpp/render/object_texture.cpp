#include "render/object_texture.h"

#include "geometry/triangle_test.h"
#include "objects/trace_objects.h"
#include "render/textured_material.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mlrt {

namespace {

// From 0 to 1 around the z axis.
float turn(double x, double y) {
    const double angle = std::atan2(y, x) / (2 * std::numbers::pi);
    return float(angle < 0 ? angle + 1 : angle);
}

} // namespace

Vec2f surface_coordinates(const AnalyticShape &shape, Vec3d p) {
    const Vec3d local = shape.inverse.point(p);
    switch (shape.type) {
    case AnalyticType::sphere: {
        const double cosine = std::clamp(local.z / length(local), -1.0, 1.0);
        return {turn(local.x, local.y), float(std::acos(cosine) / std::numbers::pi)};
    }
    case AnalyticType::disk:
        return {float(std::hypot(local.x, local.y)), turn(local.x, local.y)};
    case AnalyticType::cylinder:
        return {turn(local.x, local.y), float(local.z)};
    }
    return {};
}

TexturePoint object_texture_point(const PreparedScene &scene, const ObjectHit &hit) {
    const ObjectSet &objects = *scene.data.objects;
    Vec3f origin = hit.origin, direction = hit.direction;
    const Instance *instance =
        hit.instance == NO_INSTANCE ? nullptr : &objects.instances[hit.instance];
    if (instance) {
        const GroupRay ray = to_group(*instance, origin, direction);
        origin = ray.origin;
        direction = ray.direction;
    }
    TexturePoint at;
    at.face = hit.face;
    if (objects.is_analytic(hit.face)) {
        const AnalyticShape &shape =
            objects.analytic[hit.face - objects.first_analytic_face];
        at.uv = surface_coordinates(
            shape, analytic_point(shape, Vec3d(origin), Vec3d(direction), hit.t).p);
        return at;
    }
    const ObjectGroup &group = objects.groups[instance->group];
    const uint32_t number = hit.face - group.first_face;
    const Vec2f weights = barycentrics(origin, direction, group.tree->triangles[number]);
    const Shape &shape = scene.data.shapes[scene.shape_of_face[hit.face]];
    at.weights = {1.0f - weights.x - weights.y, weights.x, weights.y};
    at.uv = shape.texture_coordinates
                ? mean_coordinates(group.uvs, group.faces[number], at.weights)
                : weights;
    return at;
}

} // namespace mlrt
