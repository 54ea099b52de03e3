// Light from points, `point` and `spot`: of one light, or of sixteen side by side.
#pragma once

#include "base/look_up.h"
#include "base/simd.h"

namespace mlrt {

// A spot; a point light is one that shines everywhere.
template <typename Real>
struct PointLight {
    Vec3<Real> position, intensity;
    Vec3<Real> axis;           // zero of a point light
    Real cos_cutoff, cos_beam; // of angles from the axis
    Real cutoff_angle;         // radians
    Real inverse_transition;   // 1 / (cutoff_angle - beam_width)
};

// Calls visit(number, other) for each number that makes a light, and that of another one.
template <typename Numbers, typename Others, typename Visit>
void for_each_number(PointLight<Numbers> &light, const PointLight<Others> &other,
                     Visit &&visit) {
    for (int k = 0; k < 3; ++k) {
        visit(light.position[k], other.position[k]);
        visit(light.intensity[k], other.intensity[k]);
        visit(light.axis[k], other.axis[k]);
    }
    visit(light.cos_cutoff, other.cos_cutoff);
    visit(light.cos_beam, other.cos_beam);
    visit(light.cutoff_angle, other.cutoff_angle);
    visit(light.inverse_transition, other.inverse_transition);
}

inline PointLight<FloatPacket> lights_in_all_lanes(const PointLight<float> &light) {
    PointLight<FloatPacket> lights;
    for_each_number(lights, light,
                    [](FloatPacket &many, float one) { many = FloatPacket(one); });
    return lights;
}

inline void set_lanes(PointLight<FloatPacket> &lights, LaneBits lanes,
                      const PointLight<float> &light) {
    const auto mask = from_bits<FloatPacket>(lanes);
    for_each_number(lights, light, [&](FloatPacket &many, float one) {
        many = select(mask, FloatPacket(one), many);
    });
}

// Up to sixteen lights, of which each lane of a packet takes one without a branch.
using FewPointLights = PointLight<LaneArray<float>>;

inline void set_light(FewPointLights &lights, uint32_t number,
                      const PointLight<float> &light) {
    for_each_number(lights, light,
                    [&](LaneArray<float> &entries, float one) { entries[number] = one; });
}

// The lights of a scene that has no others, and 1 / the probability that each is chosen.
struct FewPoints {
    FewPointLights lights;
    LaneArray<float> choice_weights;
};

inline PointLight<FloatPacket> lights_of(const FewPointLights &lights,
                                         const UIntPacket &numbers) {
    PointLight<FloatPacket> chosen;
    for_each_number(chosen, lights,
                    [&](FloatPacket &many, const LaneArray<float> &entries) {
                        many = look_up(entries, numbers);
                    });
    return chosen;
}

// Mitsuba's spot.cpp, falloff_curve: linear in the angle between beam width and cut-off.
inline FloatPacket falloff(const PointLight<FloatPacket> &light,
                           const FloatPacket &cosine) {
    const FloatPacket zero(0.0f), one(1.0f);
    const auto lit = cosine > light.cos_cutoff;
    const auto full = cosine >= light.cos_beam;
    if ((to_bits(lit) & ~to_bits(full)) == 0)
        return select(lit, one, zero);
    const FloatPacket share =
        (light.cutoff_angle - arc_cosine(minimum(cosine, one))) * light.inverse_transition;
    return select(full, one, select(lit, share, zero));
}
inline float falloff(const PointLight<float> &light, float cosine) {
    return first_lane(falloff(lights_in_all_lanes(light), FloatPacket(cosine)));
}

// What arrives at p, over the distance squared.
template <typename Real>
struct PointLightSample {
    Vec3<Real> direction; // unit, towards the light
    Real factor;          // of its intensity
    MaskOf<Real> has_light;
};

template <typename Real>
[[gnu::always_inline]] inline PointLightSample<Real>
sample_point_light(const PointLight<Real> &light, const Vec3<Real> &p) {
    const Vec3<Real> to_light = light.position - p;
    const Real squared = dot(to_light, to_light);
    const Real inverse = Real(1.0f) / square_root(squared);
    const Vec3<Real> direction = inverse * to_light;
    return {direction, inverse * inverse * falloff(light, -dot(direction, light.axis)),
            squared > Real(0.0f)};
}

} // namespace mlrt
