#include "render/emitter_sampling.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

namespace {

struct EmitterChoice {
    uint32_t emitter;
    float weight; // 1 / probability
    float reused;
};

// Mitsuba's scene.cpp, sample_emitter.
EmitterChoice choose_emitter(const PreparedScene &scene, float x) {
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

struct AreaPoint {
    Vec3f p;
    Vec3f normal; // unit, on the glowing side
};

// Mitsuba's rectangle.cpp and mesh.cpp, sample_position.
AreaPoint sample_area(const PreparedScene &scene, const Emitter &emitter,
                      const EmitterTable &table, float x, float y) {
    if (emitter.rectangle)
        return {emitter.corner + x * emitter.edge_u + y * emitter.edge_v, table.normal};

    const Shape &shape = scene.data.shapes[emitter.shape];
    const Distribution::Choice choice = table.face_areas.choose(y);
    const uint32_t face = shape.first_face + choice.index;
    const Triangle &triangle = scene.data.tree->triangles[face];
    const Vec3f e0 = triangle.b - triangle.a, e1 = triangle.c - triangle.a;
    const float root = std::sqrt(std::max(1.0f - x, 0.0f));
    const float b0 = 1.0f - root, b1 = root * choice.reused;

    AreaPoint point;
    for (int k = 0; k < 3; ++k)
        point.p[k] = std::fma(e0[k], b0, std::fma(e1[k], b1, triangle.a[k]));
    if (shape.vertex_normals) {
        const auto &vertices = scene.data.faces[face];
        point.normal =
            (1.0f - b0 - b1) * scene.data.normals[vertices[0]] +
            (b0 * scene.data.normals[vertices[1]] + b1 * scene.data.normals[vertices[2]]);
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

} // namespace

EmitterSample sample_emitter(const PreparedScene &scene, Vec3f p, float x, float y) {
    if (scene.data.emitters.empty())
        return {};
    const EmitterChoice choice = choose_emitter(scene, x);
    const Emitter &emitter = scene.data.emitters[choice.emitter];
    const EmitterTable &table = scene.emitter_tables[choice.emitter];
    EmitterSample sample;
    sample.emitter = choice.emitter;

    switch (emitter.type) {
    case EmitterType::point:
    case EmitterType::spot: {
        const Vec3f to_light = emitter.position - p;
        const float squared = dot(to_light, to_light);
        if (!(squared > 0))
            return {};
        const float inverse = 1.0f / std::sqrt(squared);
        sample.target = emitter.position;
        sample.direction = inverse * to_light;
        float factor = inverse * inverse * choice.weight;
        if (emitter.type == EmitterType::spot)
            factor *=
                spot_falloff(emitter, table, -dot(sample.direction, emitter.direction));
        sample.weight = factor * emitter.radiance;
        break;
    }
    case EmitterType::directional: {
        // Far enough away to lie outside of the scene (Mitsuba's directional.cpp).
        const float distance = 2 * std::max(scene.radius, length(p - scene.center));
        sample.target = p - distance * emitter.direction;
        sample.direction = -emitter.direction;
        sample.weight = choice.weight * emitter.radiance;
        break;
    }
    case EmitterType::area: {
        if (!(table.inverse_area > 0))
            return {};
        const AreaPoint point = sample_area(scene, emitter, table, choice.reused, y);
        const Vec3f to_light = point.p - p;
        const float squared = dot(to_light, to_light);
        const float distance = std::sqrt(squared);
        sample.target = point.p;
        sample.direction = to_light * (1.0f / distance);
        const float cosine = dot(sample.direction, point.normal);
        // False also for a point on the light itself, where the direction is not a number.
        if (!(cosine < 0))
            return {};
        const float density = table.inverse_area * (squared / -cosine);
        if (!(density > 0 && std::isfinite(density)))
            return {};
        sample.weight = (choice.weight / density) * emitter.radiance;
        break;
    }
    }
    return sample;
}

} // namespace mlrt
