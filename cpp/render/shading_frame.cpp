#include "render/shading_frame.h"

#include "objects/trace_objects.h"
#include "render/analytic_emitter.h"
#include "render/object_surface.h"

#include <array>
#include <cmath>

namespace mlrt {

namespace {

const Shape &shape_of(const PreparedScene &scene, uint32_t face) {
    return scene.data.shapes[scene.shape_of_face[face]];
}

// Any direction at right angles to a unit vector, the one that Mitsuba takes.
template <typename Real>
Vec3<Real> beside(const Vec3<Real> &n) {
    return from_frame(n, {Real(1.0f), Real(0.0f), Real(0.0f)});
}

// Mitsuba's mesh.cpp, compute_surface_interaction: dp/du of a triangle, of which `uvs` are
// the texture coordinates of the vertices. Without, the weights of the vertices serve.
Vec3f triangle_tangent(const Triangle &triangle, const std::array<Vec2f, 3> *uvs) {
    const Vec3f edge_b = triangle.b - triangle.a, edge_c = triangle.c - triangle.a;
    if (!uvs)
        return edge_b;
    const auto &[a, b, c] = *uvs;
    const Vec2f b_a{b.x - a.x, b.y - a.y}, c_a{c.x - a.x, c.y - a.y};
    const float determinant = std::fma(b_a.x, c_a.y, -(b_a.y * c_a.x));
    if (determinant == 0)
        return beside(Vec3f(normalize(cross(Vec3d(edge_b), Vec3d(edge_c)))));
    const float inverse = 1.0f / determinant;
    Vec3f tangent;
    for (int k = 0; k < 3; ++k)
        tangent[k] = std::fma(c_a.y, edge_b[k], -(b_a.y * edge_c[k])) * inverse;
    return tangent;
}

Vec3f face_tangent(const Triangle &triangle, const std::array<uint32_t, 3> &vertices,
                   const std::vector<Vec2f> &uvs) {
    const std::array<Vec2f, 3> of_vertices{uvs[vertices[0]], uvs[vertices[1]],
                                           uvs[vertices[2]]};
    return triangle_tangent(triangle, &of_vertices);
}

Vec3f mesh_tangent(const PreparedScene &scene, uint32_t face) {
    const SceneData &data = scene.data;
    const Triangle &triangle = data.tree->triangles[face];
    return shape_of(scene, face).texture_coordinates
               ? face_tangent(triangle, data.faces[face], data.uvs)
               : triangle_tangent(triangle, nullptr);
}

// Mitsuba's sphere.cpp, disk.cpp and cylinder.cpp. The length does not matter, but 0 does.
Vec3d analytic_tangent(const AnalyticShape &shape, Vec3d p) {
    const Vec3d local = shape.inverse.point(p);
    if (shape.type == AnalyticType::disk)
        return shape.frame.vector({local.x, local.y, 0});
    return shape.frame.vector({-local.y, local.x, 0});
}

Vec3f object_tangent(const PreparedScene &scene, const ObjectHit &hit) {
    const ObjectSet &objects = *scene.data.objects;
    const auto analytic = [&](Vec3f origin, Vec3f direction) {
        const AnalyticShape &shape =
            objects.analytic[hit.face - objects.first_analytic_face];
        return analytic_tangent(
            shape, analytic_point(shape, Vec3d(origin), Vec3d(direction), hit.t).p);
    };
    if (hit.instance == NO_INSTANCE)
        return Vec3f(analytic(hit.origin, hit.direction));
    const Instance &instance = objects.instances[hit.instance];
    if (objects.is_analytic(hit.face)) {
        const auto [origin, direction] = to_group(instance, hit.origin, hit.direction);
        return Vec3f(instance.to_world.vector(analytic(origin, direction)));
    }
    const ObjectGroup &group = objects.groups[instance.group];
    const uint32_t number = hit.face - group.first_face;
    const Triangle &triangle = group.tree->triangles[number];
    const Vec3f tangent = shape_of(scene, hit.face).texture_coordinates
                              ? face_tangent(triangle, group.faces[number], group.uvs)
                              : triangle_tangent(triangle, nullptr);
    return Vec3f(instance.to_world.vector(Vec3d(tangent)));
}

} // namespace

Vec3<FloatPacket> ShadingFrame::to_world(const Vec3<FloatPacket> &v) const {
    Vec3<FloatPacket> result;
    for (int k = 0; k < 3; ++k)
        result[k] = fused(n[k], v.z, fused(t[k], v.y, s[k] * v.x));
    return result;
}

ShadingFrame shading_frame(const PreparedScene &scene, const HitPacket &hit,
                           const SurfacePoint<FloatPacket> &point) {
    const FloatPacket zero(0.0f);
    const LaneBits on_objects = lanes_on_objects(scene, hit.faces, hit.lanes);
    const LaneArray<uint32_t> faces = to_lanes<uint32_t>(hit.faces);
    LaneArray<float> along[3];
    for (LaneArray<float> &component : along)
        component.fill(0);
    for_each_lane(hit.lanes, [&](uint32_t lane) {
        const Vec3f tangent =
            (on_objects >> lane) & 1u
                ? object_tangent(scene, ObjectHits{hit.origin, hit.direction, hit.t,
                                                   hit.faces, hit.instances}
                                            .at(lane))
                : mesh_tangent(scene, faces[lane]);
        for (int k = 0; k < 3; ++k)
            along[k][lane] = tangent[k];
    });
    ShadingFrame frame;
    frame.n = point.shading_normal;
    const Vec3<FloatPacket> tangent{load<FloatPacket>(along[0]),
                                    load<FloatPacket>(along[1]),
                                    load<FloatPacket>(along[2])};
    const FloatPacket height = -dot(frame.n, tangent);
    Vec3<FloatPacket> in_plane;
    for (int k = 0; k < 3; ++k)
        in_plane[k] = fused(frame.n[k], height, tangent[k]);
    const FloatPacket squared = dot(in_plane, in_plane);
    const Vec3<FloatPacket> unit = normalize(in_plane);
    // Also where the tangent is along the normal, which leaves Mitsuba with no number.
    const auto has_direction = (squared > zero) & (squared < FloatPacket(INFINITY));
    const Vec3<FloatPacket> any = beside(frame.n);
    for (int k = 0; k < 3; ++k)
        frame.s[k] = select(has_direction, unit[k], any[k]);
    frame.t = cross(frame.n, frame.s);
    return frame;
}

} // namespace mlrt
