#include "render/environment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace mlrt {

namespace {

constexpr float PI = std::numbers::pi_v<float>;
constexpr float INVERSE_PI = std::numbers::inv_pi_v<float>;
constexpr float INVERSE_TWO_PI = 0.5f * INVERSE_PI;
constexpr float EVERYWHERE = 0.25f * INVERSE_PI; // uniform density over the sphere
// Of the sine of a pole's angle, as in Mitsuba.
constexpr float SMALLEST_SINE = 0x1p-24f;

// Relative luminance of linear sRGB, as Mitsuba rounds its weights (ITU-R BT.709).
float luminance(const float *rgb) {
    return rgb[0] * 0.212671f + rgb[1] * 0.715160f + rgb[2] * 0.072169f;
}

std::array<Vec3f, 3> inverse_of(const std::array<Vec3f, 3> &columns) {
    const Vec3d a(columns[0]), b(columns[1]), c(columns[2]);
    // Rows of the inverse are the products of two columns over the determinant.
    const double scale = 1 / dot(a, cross(b, c));
    const Vec3d rows[3] = {cross(b, c) * scale, cross(c, a) * scale, cross(a, b) * scale};
    std::array<Vec3f, 3> inverse;
    for (int k = 0; k < 3; ++k)
        inverse[k] = {float(rows[0][k]), float(rows[1][k]), float(rows[2][k])};
    return inverse;
}

Vec3<FloatPacket> transform(const std::array<Vec3f, 3> &columns,
                            const Vec3<FloatPacket> &v) {
    Vec3<FloatPacket> result;
    for (int k = 0; k < 3; ++k)
        result[k] = fused(FloatPacket(columns[2][k]), v.z,
                          fused(FloatPacket(columns[1][k]), v.y, columns[0][k] * v.x));
    return result;
}

Vec3<FloatPacket> uniform_direction(const FloatPacket &x, const FloatPacket &y) {
    const FloatPacket one(1.0f);
    const FloatPacket z = fused(FloatPacket(-2.0f), y, one);
    const FloatPacket r = square_root(maximum(fused(-z, z, one), FloatPacket(0.0f)));
    const FloatPacket angle = FloatPacket(2 * PI) * x;
    return {r * cosine(angle), r * sine(angle), z};
}

// Longitude and latitude of a direction in the frame of the emitter, in whole turns and
// half turns.
Vec2<FloatPacket> place_of(const Vec3<FloatPacket> &d) {
    const FloatPacket one(1.0f);
    const FloatPacket height = minimum(maximum(d.y, -one), one);
    return {arc_tangent(d.x, -d.z) * FloatPacket(INVERSE_TWO_PI),
            arc_cosine(height) * FloatPacket(INVERSE_PI)};
}

} // namespace

Environment::Environment(const SceneData &scene) {
    const auto found =
        std::find_if(scene.emitters.begin(), scene.emitters.end(),
                     [](const Emitter &e) { return is_environment(e.type); });
    if (found == scene.emitters.end())
        return;
    exists_ = true;
    radiance_ = found->radiance;
    if (found->type == EmitterType::constant)
        return;

    const EnvironmentPicture &picture = scene.environment;
    width_ = picture.width;
    height_ = picture.height;
    to_world_ = found->axes;
    to_local_ = inverse_of(found->axes);
    picture_.reserve(3 * size_t(width_ + 2) * height_);
    for (uint32_t y = 0; y < height_; ++y) {
        const auto row = picture.rgb.begin() + ptrdiff_t(3 * size_t(width_) * y);
        const auto end = row + ptrdiff_t(3 * size_t(width_));
        picture_.insert(picture_.end(), end - 3, end);
        picture_.insert(picture_.end(), row, end);
        picture_.insert(picture_.end(), row, row + 3);
    }

    // In proportion to the luminance and to the solid angle, which shrinks towards the
    // poles; the first column once more at the end.
    const uint32_t columns = width_ + 1;
    std::vector<float> weights;
    const float offset = found->mis_compensation ? compensation() : 0.0f;
    const float theta_scale = 1.0f / float(height_ - 1) * PI;
    for (uint32_t y = 0; y < height_; ++y) {
        const float sin_theta = std::sin(float(y) * theta_scale);
        for (uint32_t x = 0; x < columns; ++x) {
            const size_t pixel = size_t(y) * (width_ + 2) + x + 1;
            const float light = luminance(&picture_[3 * pixel]);
            weights.push_back(std::max(light - offset, 0.0f) * sin_theta);
        }
    }
    // The sine of single precision's pi is negative.
    for (float &weight : weights)
        weight = std::max(weight, 0.0f);
    warp_ = BilinearWarp(columns, height_, weights);
}

// Mitsuba's envmap.cpp, after Karlik et al., "MIS compensation: optimizing sampling
// techniques in multiple importance sampling" (SIGGRAPH Asia 2019): the mean luminance,
// unless that is all there is.
float Environment::compensation() const {
    constexpr float EVEN = 0.01f;
    float least = std::numeric_limits<float>::infinity();
    double sum = 0;
    for (uint32_t y = 0; y < height_; ++y)
        for (uint32_t x = 0; x < width_; ++x) {
            const float light =
                luminance(&picture_[3 * (size_t(y) * (width_ + 2) + x + 1)]);
            least = std::min(least, light);
            sum += double(light);
        }
    const float mean = float(sum / (double(width_) * double(height_)));
    return mean - least <= EVEN * mean ? 0.0f : mean;
}

// (u, v) is a direction's longitude and latitude: pixels have their places in the middle
// of columns, but the first and the last row lie at the poles.
Vec3<FloatPacket> Environment::look_up(const FloatPacket &u, const FloatPacket &v) const {
    const FloatPacket zero(0.0f), one(1.0f), half(0.5f);
    const float columns = float(width_ + 2), rows = float(height_);
    const FloatPacket wrapped = u - floor(u);
    const FloatPacket clipped = minimum(maximum(v, zero), one);
    const FloatPacket across =
        fused(wrapped, FloatPacket(float(width_)), one) / FloatPacket(columns);
    const FloatPacket down =
        fused(clipped, FloatPacket(rows - 1), half) / FloatPacket(rows);
    // Within the picture, but for rounding; where it takes a place beyond an edge, the
    // pixel there has no weight to speak of.
    const auto place = [&](const FloatPacket &position, float size) {
        const FloatPacket exact = fused(position, FloatPacket(size), -half);
        return minimum(maximum(exact, zero), FloatPacket(size - 1));
    };
    const FloatPacket x = place(across, columns), y = place(down, rows);
    const FloatPacket left = minimum(floor(x), FloatPacket(columns - 2));
    const FloatPacket top = minimum(floor(y), FloatPacket(rows - 2));
    const FloatPacket right_share = x - left, lower_share = y - top;
    const FloatPacket left_share = one - right_share, upper_share = one - lower_share;

    const UIntPacket corner =
        (UIntPacket(left) + UIntPacket(top) * UIntPacket(width_ + 2)) * UIntPacket(3u);
    const float *above = picture_.data(), *below = above + 3 * size_t(width_ + 2);
    Vec3<FloatPacket> colour;
    for (int k = 0; k < 3; ++k) {
        const FloatPacket upper = fused(left_share, gather(above + k, corner),
                                        right_share * gather(above + k + 3, corner));
        const FloatPacket lower = fused(left_share, gather(below + k, corner),
                                        right_share * gather(below + k + 3, corner));
        colour[k] =
            fused(upper_share, upper, lower_share * lower) * FloatPacket(radiance_[k]);
    }
    return colour;
}

Vec3<FloatPacket> Environment::radiance(const Vec3<FloatPacket> &direction) const {
    if (width_ == 0)
        return in_all_lanes(radiance_);
    const Vec2<FloatPacket> at = place_of(transform(to_local_, normalize(direction)));
    return look_up(at.x, at.y);
}

Environment::Samples Environment::sample(const FloatPacket &x, const FloatPacket &y) const {
    const FloatPacket zero(0.0f);
    if (width_ == 0)
        return {uniform_direction(x, y), in_all_lanes(radiance_ * (4 * PI)),
                FloatPacket(EVERYWHERE)};
    if (warp_.empty())
        return {in_all_lanes({0, 1, 0}), in_all_lanes({}), zero};

    const auto [point, density] = warp_.sample(x, y);
    // The grid's columns begin in the middle of the first pixel.
    const FloatPacket u = point.x + FloatPacket(0.5f / float(width_));
    const FloatPacket theta = point.y * FloatPacket(PI), phi = u * FloatPacket(2 * PI);
    const FloatPacket sin_theta = sine(theta);
    const Vec3<FloatPacket> local = {sine(phi) * sin_theta, cosine(theta),
                                     -cosine(phi) * sin_theta};
    const FloatPacket inverse_sine =
        FloatPacket(1.0f) / maximum(sin_theta, FloatPacket(SMALLEST_SINE));
    const FloatPacket per_solid_angle =
        density * inverse_sine * FloatPacket(1.0f / (2 * (PI * PI)));
    const Vec3<FloatPacket> light = look_up(u, point.y);
    Samples samples;
    samples.density = per_solid_angle;
    samples.direction = transform(to_world_, local);
    for (int k = 0; k < 3; ++k)
        samples.weight[k] = select(density > zero, light[k] / per_solid_angle, zero);
    return samples;
}

FloatPacket Environment::density(const Vec3<FloatPacket> &direction) const {
    if (width_ == 0)
        return FloatPacket(EVERYWHERE);
    if (warp_.empty())
        return FloatPacket(0.0f);
    const Vec3<FloatPacket> d = transform(to_local_, direction);
    const Vec2<FloatPacket> at = place_of(d);
    const FloatPacket u = at.x - FloatPacket(0.5f / float(width_));
    const FloatPacket sine_2 =
        maximum(fused(d.x, d.x, d.z * d.z), FloatPacket(SMALLEST_SINE * SMALLEST_SINE));
    return warp_.density({u - floor(u), at.y}) / square_root(sine_2) *
           FloatPacket(1.0f / (2 * (PI * PI)));
}

} // namespace mlrt
