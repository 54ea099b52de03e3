#include "render/object_surface.h"

#include "objects/trace_objects.h"
#include "render/shadow_offset.h"

namespace mlrt {

namespace {

const Shape &shape_of(const PreparedScene &scene, uint32_t face) {
    return scene.data.shapes[scene.shape_of_face[face]];
}

SurfacePoint<float> analytic_surface(const ObjectSet &objects, const Vec3d &origin,
                                     const Vec3d &direction, float t, uint32_t face) {
    const AnalyticPoint point = analytic_point(
        objects.analytic[face - objects.first_analytic_face], origin, direction, t);
    const Vec3f normal(point.normal);
    return {Vec3f(point.p), normal, normal};
}

SurfacePoint<float> group_triangle_surface(const ObjectGroup &group, const Shape &shape,
                                           Vec3f origin, Vec3f direction, uint32_t face) {
    const uint32_t number = face - group.first_face;
    const Triangle &triangle = group.tree->triangles[number];
    const Corners<float> corners{triangle.a, triangle.b, triangle.c};
    if (!shape.vertex_normals)
        return triangle_surface(origin, direction, corners, nullptr);
    const auto &[a, b, c] = group.faces[number];
    const Corners<float> normals{group.normals[a], group.normals[b], group.normals[c]};
    return triangle_surface(origin, direction, corners, &normals);
}

SurfacePlane<double> analytic_plane(const ObjectSet &objects, Vec3f origin, Vec3f direction,
                                    float t, uint32_t face) {
    const AnalyticShape &shape = objects.analytic[face - objects.first_analytic_face];
    const AnalyticPoint point = analytic_point(shape, Vec3d(origin), Vec3d(direction), t);
    return {point.p, point.normal, analytic_error(shape)};
}

SurfacePlane<double> triangle_plane(const ObjectGroup &group, Vec3f origin, Vec3f direction,
                                    uint32_t face) {
    const Triangle &triangle = group.tree->triangles[face - group.first_face];
    return plane_at<float>(origin, direction, {triangle.a, triangle.b, triangle.c});
}

// |L| v for a vector v without negative components.
Vec3d absolute_vector(const Affine &map, Vec3d v) {
    return abs(map.axes[0]) * v.x + abs(map.axes[1]) * v.y + abs(map.axes[2]) * v.z;
}

Vec3f normal_to_world(const Instance &instance, Vec3f n) {
    const auto &[x, y, z] = instance.normal_axes;
    return Vec3f(normalize(Vec3d(x) * double(n.x) + Vec3d(y) * double(n.y) +
                           Vec3d(z) * double(n.z)));
}

} // namespace

SurfacePoint<float> object_surface(const PreparedScene &scene, const ObjectHit &hit) {
    const ObjectSet &objects = *scene.data.objects;
    const Shape &shape = shape_of(scene, hit.face);
    SurfacePoint<float> point;
    if (hit.instance == NO_INSTANCE) {
        point = analytic_surface(objects, Vec3d(hit.origin), Vec3d(hit.direction), hit.t,
                                 hit.face);
    } else {
        const Instance &instance = objects.instances[hit.instance];
        const auto [origin, direction] = to_group(instance, hit.origin, hit.direction);
        point = objects.is_analytic(hit.face)
                    ? analytic_surface(objects, Vec3d(origin), Vec3d(direction), hit.t,
                                       hit.face)
                    : group_triangle_surface(objects.groups[instance.group], shape, origin,
                                             direction, hit.face);
        point.p = Vec3f(instance.to_world.point(Vec3d(point.p)));
        point.face_normal = normal_to_world(instance, point.face_normal);
        point.shading_normal = normal_to_world(instance, point.shading_normal);
    }
    if (shape.flip_normals) {
        point.face_normal = -point.face_normal;
        point.shading_normal = -point.shading_normal;
    }
    return point;
}

SurfacePlane<double> object_plane(const PreparedScene &scene, const ObjectHit &hit) {
    const ObjectSet &objects = *scene.data.objects;
    if (hit.instance == NO_INSTANCE)
        return analytic_plane(objects, hit.origin, hit.direction, hit.t, hit.face);
    const Instance &instance = objects.instances[hit.instance];
    const auto [origin, direction] = to_group(instance, hit.origin, hit.direction);
    const SurfacePlane<double> local =
        objects.is_analytic(hit.face)
            ? analytic_plane(objects, origin, direction, hit.t, hit.face)
            : triangle_plane(objects.groups[instance.group], origin, direction, hit.face);

    const Affine &map = instance.to_world, &back = instance.to_group;
    SurfacePlane<double> plane;
    plane.p = map.point(local.p);
    // Normals are mapped by the transpose of the inverse.
    for (int k = 0; k < 3; ++k)
        plane.normal[k] = dot(back.axes[size_t(k)], local.normal);
    plane.normal = normalize(plane.normal);
    const Vec3d reach = abs(plane.p) + abs(map.origin);
    const Vec3d inverse_error = absolute_vector(back, reach) * 0x1p-50;
    plane.error =
        absolute_vector(map, local.error + abs(local.p) * ROUNDING + inverse_error);
    return plane;
}

LaneBits lanes_on_objects(const PreparedScene &scene, const UIntPacket &faces,
                          LaneBits lanes) {
    if (!scene.data.objects)
        return 0;
    const LaneArray<uint32_t> numbers = to_lanes<uint32_t>(faces);
    LaneBits on_objects = 0;
    for_each_lane(lanes, [&](uint32_t lane) {
        on_objects |= LaneBits(scene.is_on_object(numbers[lane])) << lane;
    });
    return on_objects;
}

ObjectHit ObjectHits::at(uint32_t lane) const {
    ObjectHit hit;
    for (int k = 0; k < 3; ++k) {
        hit.origin[k] = origin[k].entry(lane);
        hit.direction[k] = direction[k].entry(lane);
    }
    hit.t = t.entry(lane);
    hit.face = lane_of(faces, lane);
    hit.instance = lane_of(instances, lane);
    return hit;
}

void place_object_surfaces(const PreparedScene &scene, const ObjectHits &hits,
                           LaneBits lanes, SurfacePoint<FloatPacket> &point) {
    for_each_lane(lanes, [&](uint32_t lane) {
        const SurfacePoint<float> one = object_surface(scene, hits.at(lane));
        for (int k = 0; k < 3; ++k) {
            point.p[k].entry(lane) = one.p[k];
            point.face_normal[k].entry(lane) = one.face_normal[k];
            point.shading_normal[k].entry(lane) = one.shading_normal[k];
        }
    });
}

void place_object_planes(const PreparedScene &scene, const ObjectHits &hits, LaneBits lanes,
                         SurfacePlane<DoublePacket> &plane) {
    for_each_lane(lanes, [&](uint32_t lane) {
        const SurfacePlane<double> one = object_plane(scene, hits.at(lane));
        for (int k = 0; k < 3; ++k) {
            plane.p[k].entry(lane) = one.p[k];
            plane.normal[k].entry(lane) = one.normal[k];
            plane.error[k].entry(lane) = one.error[k];
        }
    });
}

} // namespace mlrt
