#include "render/surface.h"

#include "render/face_cache.h"

#include <optional>

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

// A Part is a number of one face, float, or of a face a lane, Real.
template <typename Real, typename Part>
Vec3<Real> interpolate(const Corners<Part> &v, const Real &wa, const Real &wb,
                       const Real &wc) {
    return by_axis([&](int k) {
        return fused(Real(v.a[k]), wa, fused(Real(v.b[k]), wb, Real(v.c[k]) * wc));
    });
}

template <typename Real, typename Part>
Real fused_dot(const Vec3<Real> &a, const Vec3<Part> &b) {
    return fused(a.x, Real(b.x), fused(a.y, Real(b.y), a.z * Real(b.z)));
}

// What the direction of a ray is multiplied by, of a WeightForm, times the direction.
template <typename Double>
struct WeightProducts {
    Double normal, b, c;
};

template <typename Double, typename Part>
WeightProducts<Double> products_of(const Vec3<Double> &direction,
                                   const WeightForm<Part> &form) {
    return {fused_dot(direction, form.normal), fused_dot(direction, form.b),
            fused_dot(direction, form.c)};
}

// As a ray has them that is known to hit; where they are no numbers, some point of the
// face.
template <typename Real>
[[gnu::always_inline]] inline Vec2<Real>
weights_of(const WeightProducts<DoubleOf<Real>> &products) {
    using Double = DoubleOf<Real>;
    const Double scale = Double(1.0) / products.normal;
    const Real zero(0.0f), one(1.0f);
    const Real b = maximum(Real(products.b * scale), zero);
    const Real c = maximum(Real(products.c * scale), zero);
    const Real weight_b = minimum(b, one);
    return {weight_b, minimum(c, one - weight_b)};
}

template <typename Real, typename Part>
Vec3<Real> interpolated_normal(const Vec2<Real> &at, const Corners<Part> &n,
                               const Vec3<Part> &face_normal) {
    const Real w1 = at.x, w2 = at.y, w0 = Real(1.0f) - w1 - w2;
    const Vec3<Real> mean = interpolate<Real>(Corners<Part>{n.c, n.b, n.a}, w2, w1, w0);
    // Opposite vertex normals can cancel; the face normal is then as good as any.
    const MaskOf<Real> has_direction = dot(mean, mean) > Real(0.0f);
    const Vec3<Real> unit = normalize(mean);
    return by_axis(
        [&](int k) { return select(has_direction, unit[k], Real(face_normal[k])); });
}

// Mitsuba 3.9's mesh.cpp, compute_surface_interaction. Normals of vertices are zeros where
// the face normal serves; there need be none if it does everywhere.
template <typename Real, typename Part>
SurfacePoint<Real> point_at(const Vec2<Real> &at, const Corners<Part> &corners,
                            const Vec3<Part> &face_normal, const Corners<Part> *normals) {
    const Vec3<Real> normal(face_normal);
    return {interpolate(corners, Real(1.0f) - at.x - at.y, at.x, at.y), normal,
            normals ? interpolated_normal(at, *normals, face_normal) : normal};
}

template <typename Real>
SurfacePoint<Real> point_on(const Vec3<Real> &direction, const HitFace &face) {
    return point_at(weights_of<Real>(products_of(to_double(direction), face.parts.weights)),
                    face.parts.corners, face.parts.normal,
                    face.vertex_normals ? &face.normals : nullptr);
}

// Sets the given lanes.
void place(Vec3<FloatPacket> &vectors, LaneBits lanes, Vec3f vector) {
    const auto mask = from_bits<FloatPacket>(lanes);
    for (int k = 0; k < 3; ++k)
        vectors[k] = select(mask, FloatPacket(vector[k]), vectors[k]);
}
void place(Vec3<DoublePacket> &vectors, LaneBits lanes, Vec3d vector) {
    const auto mask = from_bits<DoublePacket>(lanes);
    for (int k = 0; k < 3; ++k)
        vectors[k] = select(mask, DoublePacket(vector[k]), vectors[k]);
}
void place(Corners<FloatPacket> &corners, LaneBits lanes, const Corners<float> &values) {
    place(corners.a, lanes, values.a);
    place(corners.b, lanes, values.b);
    place(corners.c, lanes, values.c);
}

Corners<FloatPacket> corners_in_all_lanes(const Corners<float> &corners) {
    return {in_all_lanes(corners.a), in_all_lanes(corners.b), in_all_lanes(corners.c)};
}

void place(DoublePacket &values, LaneBits lanes, const DoublePacket &others) {
    values = select(from_bits<DoublePacket>(lanes), others, values);
}

// The faces of sixteen rays from the origin of the cache.
class FaceLanes {
public:
    // All lanes take the first face.
    FaceLanes(const Vec3<FloatPacket> &direction, const HitFace &face)
        : direction_(to_double(direction)),
          corners_(corners_in_all_lanes(face.parts.corners)),
          normal_(in_all_lanes(face.parts.normal)),
          products_(products_of(direction_, face.parts.weights)) {
        if (face.vertex_normals)
            normals_ = corners_in_all_lanes(face.normals);
    }

    void set(LaneBits lanes, const HitFace &face) {
        place(corners_, lanes, face.parts.corners);
        place(normal_, lanes, face.parts.normal);
        // Products take less room than what they are made of.
        const auto products = products_of(direction_, face.parts.weights);
        place(products_.normal, lanes, products.normal);
        place(products_.b, lanes, products.b);
        place(products_.c, lanes, products.c);
        if (face.vertex_normals && !normals_)
            normals_ = corners_in_all_lanes({});
        if (normals_)
            place(*normals_, lanes, face.normals);
    }

    // If the rays begin elsewhere, with what belongs to the lanes' faces there.
    void start_at(const Vec3<FloatPacket> &origin, const Vec3<DoublePacket> &edge_b,
                  const Vec3<DoublePacket> &edge_c) {
        const Vec3<DoublePacket> way = to_double(origin) - to_double(corners_.a);
        products_.b = fused_dot(direction_, cross(way, edge_c));
        products_.c = fused_dot(direction_, cross(edge_b, way));
    }

    SurfacePoint<FloatPacket> points() const {
        return point_at(weights_of<FloatPacket>(products_), corners_, normal_,
                        normals_ ? &*normals_ : nullptr);
    }

private:
    Vec3<DoublePacket> direction_;
    Corners<FloatPacket> corners_;
    Vec3<FloatPacket> normal_;
    WeightProducts<DoublePacket> products_;
    std::optional<Corners<FloatPacket>> normals_; // of the vertices, if any face has them
};

// All lanes are on the first face but for the others, which are on several.
[[gnu::noinline]] SurfacePoint<FloatPacket>
points_on_faces(FaceCache &cache, const Vec3<FloatPacket> &direction,
                const UIntPacket &faces, uint32_t first, LaneBits others) {
    FaceLanes met(direction, cache.of(first));
    for_each_value(faces, others, [&](uint32_t number, LaneBits holders) {
        met.set(holders, cache.of(number));
    });
    return met.points();
}

// The same of rays with origins of their own.
[[gnu::noinline]] SurfacePoint<FloatPacket>
points_of_rays(FaceCache &cache, const Vec3<FloatPacket> &origin,
               const Vec3<FloatPacket> &direction, const UIntPacket &faces, uint32_t first,
               LaneBits others) {
    const HitFace &first_face = cache.of(first);
    FaceLanes met(direction, first_face);
    Vec3<DoublePacket> edge_b(first_face.edge_b), edge_c(first_face.edge_c);
    for_each_value(faces, others, [&](uint32_t number, LaneBits holders) {
        const HitFace &face = cache.of(number);
        met.set(holders, face);
        place(edge_b, holders, face.edge_b);
        place(edge_c, holders, face.edge_c);
    });
    met.start_at(origin, edge_b, edge_c);
    return met.points();
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
    return point_on(direction, hit_face(origin, corners, normals, false));
}

SurfacePoint<float> hit_surface(const PreparedScene &scene, Vec3f origin, Vec3f direction,
                                uint32_t face) {
    return point_on(direction, hit_face(scene, origin, face));
}

SurfacePoint<FloatPacket> hit_surfaces(FaceCache &cache, const Vec3<FloatPacket> *origin,
                                       const Vec3<FloatPacket> &direction,
                                       const UIntPacket &faces, LaneBits lanes) {
    const uint32_t first = lane_of(faces, uint32_t(__builtin_ctz(lanes)));
    const LaneBits others = lanes & ~to_bits(faces == UIntPacket(first));
    if (origin)
        return points_of_rays(cache, *origin, direction, faces, first, others);
    if (others == 0)
        return point_on(direction, cache.of(first));
    return points_on_faces(cache, direction, faces, first, others);
}

} // namespace mlrt
