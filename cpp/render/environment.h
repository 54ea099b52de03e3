// Light from all around the scene: that of the emitters `constant` and `envmap`.
#pragma once

#include "base/simd.h"
#include "render/bilinear_warp.h"
#include "render/scene.h"

#include <array>
#include <cstdint>
#include <vector>

namespace mlrt {

// At most one emitter of a scene. Formulas are those of Mitsuba 3.9's constant.cpp and
// envmap.cpp.
class Environment {
public:
    // No light.
    Environment() = default;

    explicit Environment(const SceneData &scene);

    bool exists() const { return exists_; }

    // What arrives from where the vectors point to, which need not have unit length.
    Vec3<FloatPacket> radiance(const Vec3<FloatPacket> &direction) const;

    struct Samples {
        Vec3<FloatPacket> direction;
        Vec3<FloatPacket> weight; // radiance over density per solid angle; 0: no light
        FloatPacket density;
    };

    // x and y are uniform in [0, 1); the same numbers give the same sample in Mitsuba.
    Samples sample(const FloatPacket &x, const FloatPacket &y) const;

    // The density per solid angle with which sample() takes directions, which have unit
    // length.
    FloatPacket density(const Vec3<FloatPacket> &direction) const;

private:
    // What sampling takes off the luminance of the picture.
    float compensation() const;
    Vec3<FloatPacket> look_up(const FloatPacket &u, const FloatPacket &v) const;

    bool exists_ = false;
    Vec3f radiance_{}; // of a constant one, else what the picture is multiplied by
    uint32_t width_ = 0, height_ = 0; // of the picture, which a constant one lacks
    // Red, green and blue side by side. In front of the first column lies the last, behind
    // the last the first, for what is interpolated between them.
    std::vector<float> picture_;
    BilinearWarp warp_;
    std::array<Vec3f, 3> to_world_{}, to_local_{}; // columns
};

} // namespace mlrt
