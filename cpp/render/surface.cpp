#include "render/surface.h"

namespace mlrt {

namespace {

// Side by side what three_vectors(lane) tells of each lane.
template <typename ThreeVectors>
Corners<FloatPacket> gather(ThreeVectors &&three_vectors) {
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

const Shape &shape_of(const PreparedScene &scene, uint32_t face) {
    return scene.data.shapes[scene.shape_of_face[face]];
}

// 1, or -1 where the normals of the shape are turned.
float facing(const Shape &shape) {
    return shape.flip_normals ? -1.0f : 1.0f;
}

template <typename Real, typename Corner>
Vec3<Real> interpolate(const Corners<Corner> &v, const Real &wa, const Real &wb,
                       const Real &wc) {
    return by_axis([&](int k) {
        return fused(Real(v.a[k]), wa, fused(Real(v.b[k]), wb, Real(v.c[k]) * wc));
    });
}

// In double precision, where the product of tiny edges does not vanish.
template <typename Real>
Vec3<Real> face_normal_of(const Corners<Real> &corners) {
    const auto a = to_double(corners.a);
    const auto normal =
        normalize(cross(to_double(corners.b) - a, to_double(corners.c) - a));
    return {Real(normal.x), Real(normal.y), Real(normal.z)};
}

// Of faces without normals of their vertices, and not turned (Mitsuba 3.9's mesh.cpp,
// compute_surface_interaction). Corner is float if all rays meet the same face.
template <typename Real, typename Corner>
SurfacePoint<Real> on_face(const Vec2<Real> &at, const Corners<Corner> &corners) {
    const Real w1 = at.x, w2 = at.y, w0 = Real(1.0f) - w1 - w2;
    const auto normal = Vec3<Real>(face_normal_of(corners));
    return {interpolate<Real>(corners, w0, w1, w2), normal, normal};
}

template <typename Real, typename Corner>
Vec3<Real> interpolated_normal(const Vec2<Real> &at, const Corners<Corner> &n,
                               const Vec3<Real> &face_normal) {
    const Real w1 = at.x, w2 = at.y, w0 = Real(1.0f) - w1 - w2;
    const Vec3<Real> mean = interpolate<Real>(Corners<Corner>{n.c, n.b, n.a}, w2, w1, w0);
    // Opposite vertex normals can cancel; the face normal is then as good as any.
    const MaskOf<Real> has_direction = dot(mean, mean) > Real(0.0f);
    const Vec3<Real> unit = normalize(mean);
    return by_axis([&](int k) { return select(has_direction, unit[k], face_normal[k]); });
}

template <typename Real>
void turn(SurfacePoint<Real> &point, const Real &sign) {
    point.face_normal = sign * point.face_normal;
    point.shading_normal = sign * point.shading_normal;
}

template <typename Real, typename Origin>
SurfacePoint<Real> on_one_face(const PreparedScene &scene, const Vec3<Origin> &origin,
                               const Vec3<Real> &direction, uint32_t face) {
    const Shape &shape = shape_of(scene, face);
    const Corners<float> corners = corners_of(scene, face);
    const Vec2<Real> at = barycentrics_of(origin, direction, corners);
    SurfacePoint<Real> point = on_face(at, corners);
    if (shape.vertex_normals)
        point.shading_normal =
            interpolated_normal(at, normals_of(scene, face), point.face_normal);
    turn(point, Real(facing(shape)));
    return point;
}

template <typename Origin>
SurfacePoint<FloatPacket> on_faces(const PreparedScene &scene, const Vec3<Origin> &origin,
                                   const Vec3<FloatPacket> &direction,
                                   const FaceNumbers &faces) {
    const Corners<FloatPacket> corners = corners_of(scene, faces);
    const Vec2<FloatPacket> at = barycentrics_of(origin, direction, corners);
    SurfacePoint<FloatPacket> point = on_face(at, corners);
    LaneArray<float> signs;
    LaneBits interpolated = 0;
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
        const Shape &shape = shape_of(scene, faces[lane]);
        signs[lane] = facing(shape);
        interpolated |= LaneBits(shape.vertex_normals) << lane;
    }
    if (interpolated != 0)
        point.shading_normal =
            interpolated_normal(at, normals_of(scene, faces), point.face_normal);
    turn(point, load<FloatPacket>(signs));
    return point;
}

void replace(SurfacePoint<FloatPacket> &point, LaneBits lanes,
             const SurfacePoint<FloatPacket> &by) {
    const auto mask = from_bits<FloatPacket>(lanes);
    for (int k = 0; k < 3; ++k) {
        point.p[k] = select(mask, by.p[k], point.p[k]);
        point.face_normal[k] = select(mask, by.face_normal[k], point.face_normal[k]);
        point.shading_normal[k] =
            select(mask, by.shading_normal[k], point.shading_normal[k]);
    }
}

} // namespace

Corners<float> corners_of(const PreparedScene &scene, uint32_t face) {
    const Triangle &triangle = scene.data.tree->triangles[face];
    return {triangle.a, triangle.b, triangle.c};
}

Corners<FloatPacket> corners_of(const PreparedScene &scene, const FaceNumbers &faces) {
    return gather([&](uint32_t lane) { return corners_of(scene, faces[lane]); });
}

Corners<float> normals_of(const PreparedScene &scene, uint32_t face) {
    if (!shape_of(scene, face).vertex_normals)
        return {};
    const auto &[a, b, c] = scene.data.faces[face];
    const std::vector<Vec3f> &normals = scene.data.normals;
    return {normals[a], normals[b], normals[c]};
}

Corners<FloatPacket> normals_of(const PreparedScene &scene, const FaceNumbers &faces) {
    return gather([&](uint32_t lane) { return normals_of(scene, faces[lane]); });
}

FaceNumbers faces_in(const UIntPacket &faces, LaneBits lanes) {
    FaceNumbers numbers = to_lanes<uint32_t>(faces);
    const uint32_t any = numbers[uint32_t(__builtin_ctz(lanes))];
    for_each_lane(ALL_LANES & ~lanes, [&](uint32_t lane) { numbers[lane] = any; });
    return numbers;
}

SurfacePoint<float> triangle_surface(Vec3f origin, Vec3f direction,
                                     const Corners<float> &corners,
                                     const Corners<float> *normals) {
    const Vec2f at = barycentrics_of(origin, direction, corners);
    SurfacePoint<float> point = on_face(at, corners);
    if (normals)
        point.shading_normal = interpolated_normal(at, *normals, point.face_normal);
    return point;
}

SurfacePoint<float> hit_surface(const PreparedScene &scene, Vec3f origin, Vec3f direction,
                                uint32_t face) {
    return on_one_face(scene, origin, direction, face);
}

template <typename Origin>
SurfacePoint<FloatPacket>
hit_surfaces(const PreparedScene &scene, const Vec3<Origin> &origin,
             const Vec3<FloatPacket> &direction, const UIntPacket &faces, LaneBits lanes) {
    // Neighbours mostly meet the same few faces, which are then read once, and whose part
    // of the work is done once if the origin is the same too.
    constexpr uint32_t FEW = 4; // chosen
    const auto first_of = [&](LaneBits left) {
        return lane_of(faces, uint32_t(__builtin_ctz(left)));
    };
    uint32_t face = first_of(lanes);
    SurfacePoint<FloatPacket> point = on_one_face(scene, origin, direction, face);
    LaneBits left = lanes & ~to_bits(faces == UIntPacket(face));
    for (uint32_t n = 1; n < FEW && left != 0; ++n) {
        face = first_of(left);
        const LaneBits served = left & to_bits(faces == UIntPacket(face));
        replace(point, served, on_one_face(scene, origin, direction, face));
        left &= ~served;
    }
    if (left != 0)
        replace(point, left, on_faces(scene, origin, direction, faces_in(faces, left)));
    return point;
}

template SurfacePoint<FloatPacket> hit_surfaces(const PreparedScene &, const Vec3f &,
                                                const Vec3<FloatPacket> &,
                                                const UIntPacket &, LaneBits);
template SurfacePoint<FloatPacket> hit_surfaces(const PreparedScene &,
                                                const Vec3<FloatPacket> &,
                                                const Vec3<FloatPacket> &,
                                                const UIntPacket &, LaneBits);

} // namespace mlrt
