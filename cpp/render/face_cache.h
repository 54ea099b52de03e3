// What hits on a face have in common, kept from hit to hit: neighbouring rays mostly meet
// the same few faces.
#pragma once

#include "geometry/packet_barycentrics.h"
#include "render/prepared_scene.h"

#include <array>
#include <cstdint>

namespace mlrt {

// Of a triangle with the corners a, b and c, its unit normal n, and the vectors e_b = b - a
// and e_c = c - a over the length of e_b x e_c: a ray o + t d meets it where the weights of
// b and c are
//     d.((o - a) x e_c) / d.n   and   d.(e_b x (o - a)) / d.n
// (Moeller and Trumbore 1997, "Fast, minimum storage ray-triangle intersection", with the
// triple products turned). In double precision, so that rounded weights are those of the
// queries: from points that differ in their last digits shadow rays end in another pixel.
template <typename Real>
struct WeightForm {
    using Double = DoubleOf<Real>;
    Vec3<Double> normal, b, c; // what d is multiplied by above
};

template <typename Real>
struct FaceParts {
    Corners<Real> corners;
    Vec3<Real> normal; // unit, turned if the shape asks for it
    WeightForm<Real> weights;
};

struct HitFace {
    FaceParts<float> parts; // of rays from the origin that is given
    Vec3d edge_b, edge_c;   // as above
    bool vertex_normals = false;
    Corners<float> normals{}; // of the vertices, if it has them, turned too; else zeros
};

// `normals` are those of the vertices; without, the face normal serves.
HitFace hit_face(Vec3f origin, const Corners<float> &corners, const Corners<float> *normals,
                 bool flip_normals);
HitFace hit_face(const PreparedScene &scene, Vec3f origin, uint32_t face);

class FaceCache {
public:
    // For faces of the scene's tree, and rays from the origin.
    FaceCache(const PreparedScene &scene, Vec3f origin) : scene_(scene), origin_(origin) {}

    // Until the next call.
    const HitFace &of(uint32_t face) {
        Entry &entry = entries_[face % SIZE];
        if (entry.number != face)
            fill(entry, face);
        return entry.face;
    }

private:
    static constexpr uint32_t SIZE = 64; // chosen: 14 KiB

    struct Entry {
        uint32_t number = NONE;
        HitFace face;
    };
    void fill(Entry &entry, uint32_t number);

    const PreparedScene &scene_;
    Vec3f origin_;
    std::array<Entry, SIZE> entries_;
};

} // namespace mlrt
