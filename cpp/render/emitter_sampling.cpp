#include "render/emitter_sampling.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace mlrt {

namespace {

struct OneChoice {
    uint32_t emitter;
    float weight, reused;
};

// Mitsuba's scene.cpp, sample_emitter.
OneChoice choose_emitter(const PreparedScene &scene, float x) {
    const uint32_t count = uint32_t(scene.data.emitters.size());
    if (count == 1)
        return {0, 1, x};
    if (!scene.emitter_choice.empty()) {
        const Distribution::Choice choice = scene.emitter_choice.choose(x);
        return {choice.index, 1.0f / choice.probability, choice.reused};
    }
    const float scaled = x * float(count);
    const uint32_t index = std::min(uint32_t(scaled), count - 1);
    return {index, float(count), scaled - float(index)};
}

struct Choices {
    UIntPacket emitter;
    FloatPacket weight, reused;
};

// The same for sixteen numbers.
Choices choose_emitters(const PreparedScene &scene, const FloatPacket &x) {
    constexpr size_t FEW = 16; // compared with all; chosen
    const uint32_t count = uint32_t(scene.data.emitters.size());
    if (scene.emitter_choice.empty()) {
        const FloatPacket scaled = x * FloatPacket(float(count));
        // Truncated, as conversion to an integer does; x < 1 may round up to the count.
        const FloatPacket index =
            minimum(FloatPacket(UIntPacket(scaled)), FloatPacket(float(count - 1)));
        return {UIntPacket(index), FloatPacket(float(count)), scaled - index};
    }
    if (scene.emitter_choice.size() <= FEW) {
        const Distribution::Choices choices = scene.emitter_choice.choose(x);
        return {choices.index, FloatPacket(1.0f) / choices.probability, choices.reused};
    }
    const LaneArray<float> random = to_lanes<float>(x);
    LaneArray<uint32_t> emitter;
    LaneArray<float> weight, reused;
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
        const OneChoice choice = choose_emitter(scene, random[lane]);
        emitter[lane] = choice.emitter;
        weight[lane] = choice.weight;
        reused[lane] = choice.reused;
    }
    return {load<UIntPacket>(emitter), load<FloatPacket>(weight),
            load<FloatPacket>(reused)};
}

template <typename Real>
struct AreaPoint {
    Vec3<Real> p;
    Vec3<Real> normal; // unit, on the glowing side
    FacesOf<Real> face;
};

// Calls function(value) for the values of all lanes.
template <typename Function>
float by_lane(float value, Function &&function) {
    return function(value);
}
template <typename Function>
FloatPacket by_lane(const FloatPacket &values, Function &&function) {
    LaneArray<float> lanes = to_lanes<float>(values);
    for (float &value : lanes)
        value = function(value);
    return load<FloatPacket>(lanes);
}

// The face that y chooses, and y made uniform again.
float choose_face(const EmitterTable &table, uint32_t first_face, float y, uint32_t &face) {
    const Distribution::Choice choice = table.face_areas.choose(y);
    face = first_face + choice.index;
    return choice.reused;
}
FloatPacket choose_face(const EmitterTable &table, uint32_t first_face,
                        const FloatPacket &y, FaceNumbers &faces) {
    LaneArray<float> lanes = to_lanes<float>(y);
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane)
        lanes[lane] = choose_face(table, first_face, lanes[lane], faces[lane]);
    return load<FloatPacket>(lanes);
}

template <typename Real>
Vec3<Real> spread(Vec3f v) {
    return {Real(v.x), Real(v.y), Real(v.z)};
}

// The same face in all lanes.
template <typename Real>
FacesOf<Real> all_of(uint32_t face) {
    if constexpr (std::is_same_v<Real, float>) {
        return face;
    } else {
        FaceNumbers faces;
        faces.fill(face);
        return faces;
    }
}

// Mitsuba's rectangle.cpp and mesh.cpp, sample_position.
template <typename Real>
AreaPoint<Real> sample_area(const PreparedScene &scene, const Emitter &emitter,
                            const EmitterTable &table, const Real &x, const Real &y) {
    const Shape &shape = scene.data.shapes[emitter.shape];
    if (emitter.rectangle)
        return {spread<Real>(emitter.corner) + x * spread<Real>(emitter.edge_u) +
                    y * spread<Real>(emitter.edge_v),
                spread<Real>(table.normal), all_of<Real>(shape.first_face)};

    AreaPoint<Real> point;
    FacesOf<Real> &faces = point.face;
    const Real reused = choose_face(table, shape.first_face, y, faces);
    const Corners<Real> corners = corners_of(scene, faces);
    const Vec3<Real> e0 = corners.b - corners.a, e1 = corners.c - corners.a;
    const Real root = square_root(maximum(Real(1.0f) - x, Real(0.0f)));
    const Real b0 = Real(1.0f) - root, b1 = root * reused;

    for (int k = 0; k < 3; ++k)
        point.p[k] = fused(e0[k], b0, fused(e1[k], b1, corners.a[k]));
    if (shape.vertex_normals) {
        const Corners<Real> normals = normals_of(scene, faces);
        point.normal =
            (Real(1.0f) - b0 - b1) * normals.a + (b0 * normals.b + b1 * normals.c);
    } else {
        point.normal = cross(e0, e1);
    }
    point.normal = normalize(point.normal);
    if (shape.flip_normals)
        point.normal = -point.normal;
    return point;
}

// Mitsuba's spot.cpp, falloff_curve: linear in the angle between beam width and cut-off.
float spot_falloff(const Emitter &emitter, const EmitterTable &table, float cosine) {
    if (!(cosine > table.cos_cutoff))
        return 0;
    if (cosine >= table.cos_beam)
        return 1;
    const float angle = float(std::acos(std::min(double(cosine), 1.0)));
    return (emitter.cutoff_angle - angle) * table.inverse_transition;
}

// Light of one emitter; choice_weight is 1 / the probability that it was chosen.
template <typename Real>
EmitterSample<Real> sample_one(const PreparedScene &scene, uint32_t number,
                               const Real &choice_weight, const Vec3<Real> &p,
                               const Real &x, const Real &y) {
    const Emitter &emitter = scene.data.emitters[number];
    const EmitterTable &table = scene.emitter_tables[number];
    const Real zero(0.0f), one(1.0f);
    EmitterSample<Real> sample;
    sample.target_face = all_of<Real>(NONE);
    MaskOf<Real> has_light(true);
    Real factor = zero;

    switch (emitter.type) {
    case EmitterType::point:
    case EmitterType::spot: {
        sample.target = spread<Real>(emitter.position);
        const Vec3<Real> to_light = sample.target - p;
        const Real squared = dot(to_light, to_light);
        has_light = squared > zero;
        const Real inverse = one / square_root(squared);
        sample.direction = inverse * to_light;
        factor = inverse * inverse * choice_weight;
        if (emitter.type == EmitterType::spot) {
            const Real cosine = -dot(sample.direction, spread<Real>(emitter.direction));
            factor = factor * by_lane(cosine, [&](float lane_cosine) {
                         return spot_falloff(emitter, table, lane_cosine);
                     });
        }
        break;
    }
    case EmitterType::directional: {
        // Far enough away to lie outside of the scene (Mitsuba's directional.cpp).
        const Real distance = Real(2.0f) * maximum(Real(scene.radius),
                                                   length(p - spread<Real>(scene.center)));
        sample.target = p - distance * spread<Real>(emitter.direction);
        sample.direction = spread<Real>(-emitter.direction);
        factor = choice_weight;
        break;
    }
    case EmitterType::area: {
        if (!(table.inverse_area > 0))
            return {spread<Real>({}), spread<Real>({}), spread<Real>({}),
                    all_of<Real>(NONE)};
        const AreaPoint<Real> point = sample_area(scene, emitter, table, x, y);
        const Vec3<Real> to_light = point.p - p;
        const Real squared = dot(to_light, to_light);
        const Real distance = square_root(squared);
        sample.target = point.p;
        sample.target_face = point.face;
        sample.direction = to_light * (one / distance);
        const Real cosine = dot(sample.direction, point.normal);
        const Real density = Real(table.inverse_area) * (squared / -cosine);
        // False also for a point on the light itself, where the direction is not a number.
        has_light = (cosine < zero) & (density > zero) & (density < Real(INFINITY));
        factor = choice_weight / density;
        break;
    }
    }
    for (int k = 0; k < 3; ++k)
        sample.weight[k] = select(has_light, factor * Real(emitter.radiance[k]), zero);
    return sample;
}

} // namespace

OneEmitterSample sample_emitter(const PreparedScene &scene, Vec3f p, float x, float y) {
    if (scene.data.emitters.empty())
        return {};
    const OneChoice choice = choose_emitter(scene, x);
    return {sample_one(scene, choice.emitter, choice.weight, p, choice.reused, y),
            choice.emitter};
}

EmitterSamples sample_emitter(const PreparedScene &scene, const Vec3<FloatPacket> &p,
                              const FloatPacket &x, const FloatPacket &y, LaneBits lanes) {
    EmitterSamples samples;
    if (scene.data.emitters.size() == 1) {
        samples.emitter.fill(0);
        static_cast<EmitterSample<FloatPacket> &>(samples) =
            sample_one(scene, 0, FloatPacket(1.0f), p, x, y);
        return samples;
    }
    const Choices choices = choose_emitters(scene, x);
    // Lanes that chose the same emitter are served together.
    const UIntPacket emitters = choices.emitter;
    samples.emitter = to_lanes<uint32_t>(emitters);
    samples.weight = samples.direction = samples.target = spread<FloatPacket>({});
    samples.target_face.fill(NONE);
    while (lanes != 0) {
        const uint32_t emitter = samples.emitter[uint32_t(std::countr_zero(lanes))];
        const LaneBits served = to_bits(emitters == UIntPacket(emitter));
        const EmitterSample<FloatPacket> part =
            sample_one(scene, emitter, choices.weight, p, choices.reused, y);
        const MaskOf<FloatPacket> mask = from_bits<FloatPacket>(served);
        for (int k = 0; k < 3; ++k) {
            samples.weight[k] = select(mask, part.weight[k], samples.weight[k]);
            samples.direction[k] = select(mask, part.direction[k], samples.direction[k]);
            samples.target[k] = select(mask, part.target[k], samples.target[k]);
        }
        for_each_lane(served, [&](uint32_t lane) {
            samples.target_face[lane] = part.target_face[lane];
        });
        lanes &= ~served;
    }
    return samples;
}

} // namespace mlrt
