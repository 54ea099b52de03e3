#include "render/surface.h"

#include <algorithm>

namespace mlrt {

namespace {

bool all_equal(const FaceNumbers &faces) {
    return std::all_of(faces.begin(), faces.end(),
                       [&](uint32_t face) { return face == faces[0]; });
}

// Side by side what three_vectors(lane) tells of each lane. Neighbours often meet the same
// face, whose vectors are then read once.
template <typename ThreeVectors>
Corners<FloatPacket> gather(bool lanes_are_equal, ThreeVectors &&three_vectors) {
    if (lanes_are_equal) {
        const Corners<float> v = three_vectors(0);
        return {in_all_lanes(v.a), in_all_lanes(v.b), in_all_lanes(v.c)};
    }
    LaneArray<float> a[3], b[3], c[3];
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
        const Corners<float> v = three_vectors(lane);
        for (int k = 0; k < 3; ++k) {
            a[k][lane] = v.a[k];
            b[k][lane] = v.b[k];
            c[k][lane] = v.c[k];
        }
    }
    const auto vector = [](const LaneArray<float>(&v)[3]) -> Vec3<FloatPacket> {
        return {load<FloatPacket>(v[0]), load<FloatPacket>(v[1]), load<FloatPacket>(v[2])};
    };
    return {vector(a), vector(b), vector(c)};
}

bool is_interpolated(const PreparedScene &scene, uint32_t face) {
    return scene.data.shapes[scene.shape_of_face[face]].vertex_normals;
}
bool any_interpolated(const PreparedScene &scene, uint32_t face) {
    return is_interpolated(scene, face);
}
bool any_interpolated(const PreparedScene &scene, const FaceNumbers &faces) {
    return std::any_of(faces.begin(), faces.end(),
                       [&](uint32_t face) { return is_interpolated(scene, face); });
}

// 1, or -1 where the normals of the shape are turned.
float facing(const PreparedScene &scene, uint32_t face) {
    return scene.data.shapes[scene.shape_of_face[face]].flip_normals ? -1.0f : 1.0f;
}
FloatPacket facing(const PreparedScene &scene, const FaceNumbers &faces) {
    LaneArray<float> signs;
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane)
        signs[lane] = facing(scene, faces[lane]);
    return load<FloatPacket>(signs);
}

template <typename Real>
Vec3<Real> interpolate(const Vec3<Real> &a, const Vec3<Real> &b, const Vec3<Real> &c,
                       const Real &wa, const Real &wb, const Real &wc) {
    return {fused(a.x, wa, fused(b.x, wb, c.x * wc)),
            fused(a.y, wa, fused(b.y, wb, c.y * wc)),
            fused(a.z, wa, fused(b.z, wb, c.z * wc))};
}

} // namespace

Corners<float> corners_of(const PreparedScene &scene, uint32_t face) {
    const Triangle &triangle = scene.data.tree->triangles[face];
    return {triangle.a, triangle.b, triangle.c};
}

Corners<FloatPacket> corners_of(const PreparedScene &scene, const FaceNumbers &faces) {
    return gather(all_equal(faces),
                  [&](uint32_t lane) { return corners_of(scene, faces[lane]); });
}

Corners<float> normals_of(const PreparedScene &scene, uint32_t face) {
    if (!is_interpolated(scene, face))
        return {};
    const auto &[a, b, c] = scene.data.faces[face];
    const std::vector<Vec3f> &normals = scene.data.normals;
    return {normals[a], normals[b], normals[c]};
}

Corners<FloatPacket> normals_of(const PreparedScene &scene, const FaceNumbers &faces) {
    return gather(all_equal(faces),
                  [&](uint32_t lane) { return normals_of(scene, faces[lane]); });
}

// Mitsuba 3.9's mesh.cpp, compute_surface_interaction.
template <typename Real>
SurfacePoint<Real> hit_surface(const PreparedScene &scene, const Vec3<Real> &origin,
                               const Vec3<Real> &direction, const FacesOf<Real> &faces) {
    const Corners<Real> corners = corners_of(scene, faces);
    const Vec2<Real> at = barycentrics_of(origin, direction, corners);
    const Real w1 = at.x, w2 = at.y, w0 = Real(1.0f) - w1 - w2;
    SurfacePoint<Real> point;
    point.p = interpolate(corners.a, corners.b, corners.c, w0, w1, w2);

    // In double precision, where the product of tiny edges does not vanish.
    const auto a = to_double(corners.a);
    const auto normal =
        normalize(cross(to_double(corners.b) - a, to_double(corners.c) - a));
    point.face_normal = {Real(normal.x), Real(normal.y), Real(normal.z)};
    point.shading_normal = point.face_normal;
    if (any_interpolated(scene, faces)) {
        const Corners<Real> n = normals_of(scene, faces);
        const Vec3<Real> mean = interpolate(n.c, n.b, n.a, w2, w1, w0);
        // Opposite vertex normals can cancel; the face normal is then as good as any.
        const MaskOf<Real> has_direction = dot(mean, mean) > Real(0.0f);
        const Vec3<Real> unit = normalize(mean);
        for (int k = 0; k < 3; ++k)
            point.shading_normal[k] =
                select(has_direction, unit[k], point.shading_normal[k]);
    }
    const Real sign = facing(scene, faces);
    point.face_normal = sign * point.face_normal;
    point.shading_normal = sign * point.shading_normal;
    return point;
}

template SurfacePoint<float> hit_surface(const PreparedScene &, const Vec3f &,
                                         const Vec3f &, const uint32_t &);
template SurfacePoint<FloatPacket> hit_surface(const PreparedScene &,
                                               const Vec3<FloatPacket> &,
                                               const Vec3<FloatPacket> &,
                                               const FaceNumbers &);

} // namespace mlrt
