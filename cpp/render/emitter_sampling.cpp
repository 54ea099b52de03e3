#include "render/emitter_sampling.h"

#include "render/analytic_emitter.h"
#include "render/area_light.h"
#include "render/point_light.h"
#include "render/textured_light.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <vector>

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

template <typename Real>
struct AreaPoint {
    Vec3<Real> p;
    Vec3<Real> normal; // unit, on the glowing side
    FacesOf<Real> face;
};

// The face that y chooses, and y made uniform again.
float choose_face(const EmitterTable &table, uint32_t first_face, float y, uint32_t &face) {
    const Distribution::Choice choice = table.face_areas.choose(y);
    face = first_face + choice.index;
    return choice.reused;
}
FloatPacket choose_face(const EmitterTable &table, uint32_t first_face,
                        const FloatPacket &y, FaceNumbers &faces) {
    const Distribution::Choices choices = table.face_areas.choose(y);
    faces = to_lanes<uint32_t>(choices.index + UIntPacket(first_face));
    return choices.reused(y);
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

// Mitsuba's mesh.cpp, sample_position.
template <typename Real>
[[gnu::noinline]] AreaPoint<Real> sample_mesh(const PreparedScene &scene,
                                              const Shape &shape, const EmitterTable &table,
                                              const Real &x, const Real &y) {
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
        const Real scale(table.edge_scale);
        point.normal = cross(scale * e0, scale * e1);
    }
    point.normal = normalize(point.normal);
    if (shape.flip_normals)
        point.normal = -point.normal;
    return point;
}

template <typename Real>
AreaPoint<Real> sample_rectangle(const Emitter &emitter, const Shape &shape,
                                 const EmitterTable &table, const Real &x, const Real &y) {
    return {point_on_rectangle(emitter, x, y), spread<Real>(table.normal),
            all_of<Real>(shape.first_face)};
}

// A point of an analytic shape that glows, with its density by solid angle.
template <typename Real>
struct AnalyticLight {
    Vec3<Real> p, direction;
    Real density;
    MaskOf<Real> is_lit;
};

template <typename Real>
AnalyticLight<Real> sample_analytic(const PreparedScene &scene,
                                    const AnalyticShape &analytic, uint32_t emitter,
                                    const Vec3<Real> &p, const Real &x, const Real &y) {
    const EmitterTable &table = scene.emitter_tables[emitter];
    const bool flipped = scene.data.shapes[scene.data.emitters[emitter].shape].flip_normals;
    const bool by_solid_angle = analytic.type == AnalyticType::sphere;
    AnalyticSample<Real> sample =
        by_solid_angle ? sample_sphere(analytic, flipped, table.inverse_area, p, x, y)
        : analytic.type == AnalyticType::disk ? sample_disk(analytic, table.normal, x, y)
                                              : sample_cylinder(analytic, x, y);
    // That of a disk is turned already.
    if (flipped && analytic.type != AnalyticType::disk)
        sample.normal = -sample.normal;
    const Vec3<Real> to_light = sample.p - p;
    const Real squared = dot(to_light, to_light);
    AnalyticLight<Real> light;
    light.p = sample.p;
    light.direction = to_light * (Real(1.0f) / square_root(squared));
    const Real cosine = dot(light.direction, sample.normal);
    light.density =
        by_solid_angle ? sample.density : Real(table.inverse_area) * (squared / -cosine);
    light.is_lit = (cosine < Real(0.0f)) & (light.density > Real(0.0f)) &
                   (light.density < Real(INFINITY));
    return light;
}

PointLight<float> light_for(const PointLight<float> &light, float) {
    return light;
}
PointLight<FloatPacket> light_for(const PointLight<float> &light, const FloatPacket &) {
    return lights_in_all_lanes(light);
}

// In line, or lights would go through memory.
template <typename Real>
[[gnu::always_inline]] inline EmitterSample<Real>
from_point(const PointLight<Real> &light, const Real &choice_weight, const Vec3<Real> &p) {
    const PointLightSample<Real> point = sample_point_light(light, p);
    const Real factor = point.factor * choice_weight;
    return {by_axis([&](int k) {
                return select(point.has_light, factor * light.intensity[k], Real(0.0f));
            }),
            point.direction, light.position, all_of<Real>(NONE)};
}

[[gnu::noinline]] EmitterSample<float> from_projector(const PreparedScene &scene,
                                                      uint32_t number, float choice_weight,
                                                      const Vec3f &p) {
    const Emitter &emitter = scene.data.emitters[number];
    EmitterSample<float> sample;
    sample.target = emitter.position;
    sample.target_face = NONE;
    sample.direction = normalize(emitter.position - p);
    sample.weight = scene.emitter_tables[number].projector.light_at(scene.data.textures, p,
                                                                    sample.direction) *
                    choice_weight;
    return sample;
}
[[gnu::noinline]] EmitterSample<FloatPacket>
from_projector(const PreparedScene &scene, uint32_t number,
               const FloatPacket &choice_weight, const Vec3<FloatPacket> &p) {
    EmitterSample<FloatPacket> samples;
    samples.target = spread<FloatPacket>(scene.data.emitters[number].position);
    samples.target_face = all_of<FloatPacket>(NONE);
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
        const EmitterSample<float> one =
            from_projector(scene, number, choice_weight.entry(lane),
                           Vec3f{p.x.entry(lane), p.y.entry(lane), p.z.entry(lane)});
        for (int k = 0; k < 3; ++k) {
            samples.direction[k].entry(lane) = one.direction[k];
            samples.weight[k].entry(lane) = one.weight[k];
        }
    }
    return samples;
}

// Mitsuba's constant.cpp and envmap.cpp, sample_direction.
[[gnu::noinline]] Environment::Samples
sample_environment(const PreparedScene &scene, const FloatPacket &x, const FloatPacket &y) {
    return scene.environment.sample(x, y);
}
struct OneEnvironmentSample {
    Vec3f direction, weight;
    float density;
};
OneEnvironmentSample sample_environment(const PreparedScene &scene, float x, float y) {
    const auto [d, w, density] = scene.environment.sample(FloatPacket(x), FloatPacket(y));
    return {{first_lane(d.x), first_lane(d.y), first_lane(d.z)},
            {first_lane(w.x), first_lane(w.y), first_lane(w.z)},
            first_lane(density)};
}

// A distance that leads out of the scene, wherever p is.
template <typename Real>
Real way_out(const PreparedScene &scene, const Vec3<Real> &p) {
    return Real(2.0f) * maximum(Real(scene.radius), length(p - spread<Real>(scene.center)));
}

// The arguments and the result of the next two are those of sample_one.
template <typename Real>
[[gnu::noinline]] EmitterSample<Real>
from_analytic(const PreparedScene &scene, const AnalyticShape &analytic, uint32_t number,
              const Real &choice_weight, const Vec3<Real> &p, const Real &x, const Real &y,
              Real *density) {
    const Emitter &emitter = scene.data.emitters[number];
    const AnalyticLight<Real> light = sample_analytic(scene, analytic, number, p, x, y);
    const Real factor = choice_weight / light.density;
    if (density)
        *density = light.density / choice_weight;
    return {by_axis([&](int k) {
                return select(light.is_lit, factor * emitter.radiance[k], Real(0.0f));
            }),
            light.direction, light.p,
            all_of<Real>(scene.data.shapes[emitter.shape].first_face)};
}

// Of a shape that has an area.
template <typename Real>
EmitterSample<Real> from_surface(const PreparedScene &scene, uint32_t number,
                                 const Real &choice_weight, const Vec3<Real> &p,
                                 const Real &x, const Real &y, Real *density) {
    const Emitter &emitter = scene.data.emitters[number];
    const EmitterTable &table = scene.emitter_tables[number];
    const Shape &shape = scene.data.shapes[emitter.shape];
    AreaPoint<Real> point;
    Real by_area(table.inverse_area);
    Vec3<Real> radiance = spread<Real>(emitter.radiance);
    if (emitter.radiance_texture != NONE) {
        const LightPoint<Real> chosen = sample_textured_light(scene, number, x, y);
        point = {chosen.p, chosen.normal, all_of<Real>(shape.first_face)};
        by_area = chosen.density;
        radiance = chosen.radiance;
    } else if (emitter.rectangle) {
        point = sample_rectangle(emitter, shape, table, x, y);
    } else {
        point = sample_mesh(scene, shape, table, x, y);
    }
    const AreaLightSample<Real> light =
        sample_area_light(point.p, point.normal, by_area, p);
    const Real factor = choice_weight / light.density;
    if (density)
        *density = light.density / choice_weight;
    return {by_axis([&](int k) {
                return select(light.has_light, factor * radiance[k], Real(0.0f));
            }),
            light.direction, point.p, point.face};
}

// Light of one emitter; choice_weight is 1 / the probability that it was chosen. `density`
// as in sample_chosen.
template <typename Real>
EmitterSample<Real> sample_one(const PreparedScene &scene, uint32_t number,
                               const Real &choice_weight, const Vec3<Real> &p,
                               const Real &x, const Real &y, Real *density = nullptr) {
    const Emitter &emitter = scene.data.emitters[number];
    const EmitterTable &table = scene.emitter_tables[number];
    EmitterSample<Real> sample;
    sample.target_face = all_of<Real>(NONE);
    if (density)
        *density = Real(INFINITY);
    switch (emitter.type) {
    case EmitterType::point:
    case EmitterType::spot:
        return from_point(light_for(table.point, choice_weight), choice_weight, p);
    case EmitterType::projector:
        return from_projector(scene, number, choice_weight, p);
    case EmitterType::directional: {
        // Mitsuba's directional.cpp.
        sample.target = p - way_out(scene, p) * spread<Real>(emitter.direction);
        sample.direction = spread<Real>(-emitter.direction);
        sample.weight = choice_weight * spread<Real>(emitter.radiance);
        break;
    }
    case EmitterType::constant:
    case EmitterType::envmap: {
        const auto [direction, weight, by_direction] = sample_environment(scene, x, y);
        sample.direction = direction;
        sample.target = p + way_out(scene, p) * direction;
        sample.weight = choice_weight * weight;
        if (density)
            *density = by_direction / choice_weight;
        break;
    }
    case EmitterType::area: {
        if (!(table.inverse_area > 0))
            return {spread<Real>({}), spread<Real>({}), spread<Real>({}),
                    all_of<Real>(NONE)};
        const AnalyticShape *analytic = scene.analytic(scene.data.shapes[emitter.shape]);
        if (analytic && emitter.radiance_texture == NONE)
            return from_analytic(scene, *analytic, number, choice_weight, p, x, y, density);
        return from_surface(scene, number, choice_weight, p, x, y, density);
    }
    }
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

EmitterChoices choose_emitters(const PreparedScene &scene, const FloatPacket &x) {
    if (scene.few_points)
        return choose_few_points(scene, x);
    const uint32_t count = uint32_t(scene.data.emitters.size());
    if (count == 1)
        return {UIntPacket(0u), FloatPacket(1.0f), x};
    if (scene.emitter_choice.empty()) {
        const FloatPacket scaled = x * FloatPacket(float(count));
        // Truncated, as conversion to an integer does; x < 1 may round up to the count.
        const FloatPacket index =
            minimum(FloatPacket(UIntPacket(scaled)), FloatPacket(float(count - 1)));
        return {UIntPacket(index), FloatPacket(float(count)), scaled - index};
    }
    const Distribution::Choices choices = scene.emitter_choice.choose(x);
    return {choices.index, FloatPacket(1.0f) / choices.probability,
            scene.all_emitters_are_points ? x : choices.reused(x)};
}

EmitterSample<FloatPacket> sample_chosen(const PreparedScene &scene, uint32_t emitter,
                                         const EmitterChoices &choices,
                                         const Vec3<FloatPacket> &p, const FloatPacket &y,
                                         FloatPacket *density) {
    return sample_one(scene, emitter, choices.weight, p, choices.x, y, density);
}

EmitterSample<FloatPacket> sample_chosen_points(const PreparedScene &scene,
                                                const EmitterChoices &choices,
                                                LaneBits lanes,
                                                const Vec3<FloatPacket> &p) {
    if (scene.few_points)
        return from_point(lights_of(scene.few_points->lights, choices.emitter),
                          choices.weight, p);
    const uint32_t first = lane_of(choices.emitter, uint32_t(__builtin_ctz(lanes)));
    PointLight<FloatPacket> lights = lights_in_all_lanes(scene.emitter_tables[first].point);
    const LaneBits others = lanes & ~to_bits(choices.emitter == UIntPacket(first));
    for_each_value(choices.emitter, others, [&](uint32_t emitter, LaneBits holders) {
        set_lanes(lights, holders, scene.emitter_tables[emitter].point);
    });
    return from_point(lights, choices.weight, p);
}

bool needs_light_numbers(const PreparedScene &scene) {
    const std::vector<Emitter> &emitters = scene.data.emitters;
    return emitters.size() > 1 ||
           std::any_of(emitters.begin(), emitters.end(), [](const Emitter &emitter) {
               return emitter.type == EmitterType::area || is_environment(emitter.type);
           });
}

} // namespace mlrt
