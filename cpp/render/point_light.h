// Light from points, `point` and `spot`: of one light, or of sixteen side by side.
#pragma once

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

// Calls visit(of_many, of_one) for each number that makes a light.
template <typename Visit>
void for_each_number(PointLight<FloatPacket> &many, const PointLight<float> &one,
                     Visit &&visit) {
    for (int k = 0; k < 3; ++k) {
        visit(many.position[k], one.position[k]);
        visit(many.intensity[k], one.intensity[k]);
        visit(many.axis[k], one.axis[k]);
    }
    visit(many.cos_cutoff, one.cos_cutoff);
    visit(many.cos_beam, one.cos_beam);
    visit(many.cutoff_angle, one.cutoff_angle);
    visit(many.inverse_transition, one.inverse_transition);
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
PointLightSample<Real> sample_point_light(const PointLight<Real> &light,
                                          const Vec3<Real> &p) {
    const Vec3<Real> to_light = light.position - p;
    const Real squared = dot(to_light, to_light);
    const Real inverse = Real(1.0f) / square_root(squared);
    const Vec3<Real> direction = inverse * to_light;
    return {direction, inverse * inverse * falloff(light, -dot(direction, light.axis)),
            squared > Real(0.0f)};
}

} // namespace mlrt
