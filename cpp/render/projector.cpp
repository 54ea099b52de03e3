#include "render/projector.h"

#include <numbers>

namespace mlrt {

Projector::Projector(const Emitter &emitter)
    : position_(emitter.position), axis_(emitter.axes[2]), half_size_(emitter.half_size),
      factor_(emitter.radiance * std::numbers::pi_v<float>),
      picture_(emitter.radiance_texture) {
    const Vec3d a(emitter.axes[0]), b(emitter.axes[1]), c(emitter.axes[2]);
    // Rows of the inverse are the products of two columns over the determinant.
    const double scale = 1 / dot(a, cross(b, c));
    rows_ = {cross(b, c) * scale, cross(c, a) * scale, cross(a, b) * scale};
}

Vec3f Projector::light_at(const std::vector<Texture> &textures, Vec3f p,
                          Vec3f direction) const {
    const Vec3d way = Vec3d(p) - Vec3d(position_);
    const Vec3f local{float(dot(rows_[0], way)), float(dot(rows_[1], way)),
                      float(dot(rows_[2], way))};
    // As of a camera, x points left.
    TexturePoint at;
    at.uv = {0.5f - 0.5f * local.x / (local.z * half_size_.x),
             0.5f - 0.5f * local.y / (local.z * half_size_.y)};
    if (!(local.z > 0 && at.uv.x >= 0 && at.uv.x <= 1 && at.uv.y >= 0 && at.uv.y <= 1))
        return {};
    const float falloff = 1.0f / (local.z * local.z * -dot(axis_, direction));
    const Vec3f light = factor_ * falloff;
    return picture_ == NONE ? light : light * evaluate(textures, picture_, at);
}

} // namespace mlrt
