#include "render/surface.h"

#include "render/point_on_face.h"

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
