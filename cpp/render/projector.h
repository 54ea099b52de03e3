// Light of Mitsuba's `projector`, which shines a picture onto the scene from one point.
#pragma once

#include "render/scene.h"

#include <array>
#include <vector>

namespace mlrt {

class Projector {
public:
    // A projector that gives no light.
    Projector() = default;

    explicit Projector(const Emitter &emitter);

    // Unoccluded radiance times distance and cosine terms that arrive at p, by
    // Mitsuba 3.9's projector.cpp, sample_direction. `direction` is unit, towards the
    // light.
    Vec3f light_at(const std::vector<Texture> &textures, Vec3f p, Vec3f direction) const;

private:
    Vec3f position_{}, axis_{};   // not of unit length where it is scaled
    std::array<Vec3d, 3> rows_{}; // of the map to the frame of the projector
    Vec2f half_size_{1, 1};
    Vec3f factor_{};
    uint32_t picture_ = NONE; // NONE: white
};

} // namespace mlrt
