// Choosing a light and a point on it as seen from points of the scene: for one point, or
// for sixteen side by side with the same operations and hence the same bits.
#pragma once

#include "base/look_up.h"
#include "base/simd.h"
#include "render/prepared_scene.h"
#include "render/surface.h"

#include <cstdint>

namespace mlrt {

template <typename Real>
struct EmitterSample {
    Vec3<Real> weight;    // unoccluded radiance over probability density; 0: no light here
    Vec3<Real> direction; // unit, towards the light; any value if there is none
    Vec3<Real> target;    // where the shadow ray ends; any value if there is none
    FacesOf<Real> target_face; // where it lies on, but for rounding; NONE: on none. Of a
                               // rectangle the first, whose plane is that of all
};

struct OneEmitterSample : EmitterSample<float> {
    uint32_t emitter = NONE;
};

// Light that arrives at p. x and y are uniform in [0, 1); the same numbers give the same
// sample in Mitsuba.
OneEmitterSample sample_emitter(const PreparedScene &scene, Vec3f p, float x, float y);

// The two steps of that for sixteen points: which emitters are chosen, then the light of
// one of them. The scene must have an emitter.
struct EmitterChoices {
    UIntPacket emitter;
    FloatPacket weight; // 1 / the probability of the choice
    FloatPacket x;      // made uniform again; any value if all emitters are points
};
EmitterChoices choose_emitters(const PreparedScene &scene, const FloatPacket &x);

// The same of a scene with few_points.
inline EmitterChoices choose_few_points(const PreparedScene &scene, const FloatPacket &x) {
    const uint32_t count = uint32_t(scene.data.emitters.size());
    UIntPacket emitter(0u);
    if (count > 1 && !scene.emitter_choice.empty()) {
        emitter = scene.emitter_choice.index_of(x);
    } else if (count > 1) {
        // Truncated, as conversion to an integer does; x < 1 may round up to the count.
        emitter = UIntPacket(minimum(FloatPacket(UIntPacket(x * FloatPacket(float(count)))),
                                     FloatPacket(float(count - 1))));
    }
    return {emitter, look_up(scene.few_points->choice_weights, emitter), x};
}

// `density`, if given, is set where there is light: per solid angle at p, the choice of the
// emitter included; infinity for light that comes from one direction.
EmitterSample<FloatPacket> sample_chosen(const PreparedScene &scene, uint32_t emitter,
                                         const EmitterChoices &choices,
                                         const Vec3<FloatPacket> &p, const FloatPacket &y,
                                         FloatPacket *density = nullptr);

// Takes over the given lanes of light of another emitter; not where it lies on.
template <typename Light>
void set_lanes(Light &light, LaneBits lanes, const Light &other) {
    const auto mask = from_bits<FloatPacket>(lanes);
    for (int k = 0; k < 3; ++k) {
        light.weight[k] = select(mask, other.weight[k], light.weight[k]);
        light.direction[k] = select(mask, other.direction[k], light.direction[k]);
        light.target[k] = select(mask, other.target[k], light.target[k]);
    }
}

// Light of the emitters that the given lanes chose, of which there must be one:
// light_of(emitter) is that of one emitter in all lanes, an EmitterSample or its parts of
// the same names. Where it lies on is that of any.
template <typename LightOf>
auto light_of_chosen(const UIntPacket &emitters, LaneBits lanes, LightOf &&light_of) {
    const uint32_t first = lane_of(emitters, uint32_t(__builtin_ctz(lanes)));
    auto light = light_of(first);
    for_each_value(emitters, lanes & ~to_bits(emitters == UIntPacket(first)),
                   [&](uint32_t emitter, LaneBits holders) {
                       set_lanes(light, holders, light_of(emitter));
                   });
    return light;
}

// sample_chosen() for a scene whose emitters are all points, of all that are chosen in the
// given lanes, of which there must be one: each lane gets light of its own.
EmitterSample<FloatPacket> sample_chosen_points(const PreparedScene &scene,
                                                const EmitterChoices &choices,
                                                LaneBits lanes, const Vec3<FloatPacket> &p);

// Of an emitter that is a rectangle. Mitsuba's rectangle.cpp, sample_position.
template <typename Real>
Vec3<Real> point_on_rectangle(const Emitter &emitter, const Real &x, const Real &y) {
    return Vec3<Real>(emitter.corner) + x * Vec3<Real>(emitter.edge_u) +
           y * Vec3<Real>(emitter.edge_v);
}

// Whether the numbers x and y make a difference.
bool needs_light_numbers(const PreparedScene &scene);

} // namespace mlrt
