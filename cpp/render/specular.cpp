#include "render/specular.h"

#include <algorithm>
#include <cmath>

namespace mlrt {

namespace {

float root(float x) {
    return std::sqrt(std::max(x, 0.0f));
}

Vec3f reflected(Vec3f back) {
    return {-back.x, -back.y, back.z};
}

} // namespace

DielectricReflectance reflectance_of_dielectric(float cosine, float ior) {
    const bool outside = cosine >= 0;
    const float index = outside ? ior : 1 / ior; // of the other side over that of this one
    const float ratio = outside ? 1 / ior : ior;
    const float here = std::abs(cosine);
    const float there = root(1 - (1 - cosine * cosine) * ratio * ratio);
    const float across = (here - index * there) / (here + index * there);
    const float along = (there - index * here) / (there + index * here);
    float share = 0.5f * (across * across + along * along);
    if (ior == 1)
        share = 0;
    else if (cosine == 0)
        share = 1;
    return {share, outside ? -there : there, ratio};
}

float reflectance_of_conductor(float cosine, float eta, float k) {
    const float cosine_2 = cosine * cosine, sine_2 = 1 - cosine_2;
    const float difference = eta * eta - k * k - sine_2;
    const float sum = root(difference * difference + 4 * k * k * eta * eta);
    const float a = root(0.5f * (sum + difference));
    const float even = sum + cosine_2, odd = 2 * cosine * a;
    const float across = (even - odd) / (even + odd);
    const float even_along = sum * cosine_2 + sine_2 * sine_2, odd_along = odd * sine_2;
    const float along = across * (even_along - odd_along) / (even_along + odd_along);
    return 0.5f * (across + along);
}

SpecularSample sample_specular(const Specular &specular, Vec3f back, float part) {
    if (specular.type == SpecularType::conductor) {
        Vec3f weight = specular.reflectance;
        for (int channel = 0; channel < 3; ++channel)
            weight[channel] *= reflectance_of_conductor(
                std::abs(back.z), specular.eta[channel], specular.k[channel]);
        return {reflected(back), weight};
    }
    const bool thin = specular.type == SpecularType::thindielectric;
    const DielectricReflectance at =
        reflectance_of_dielectric(thin ? std::abs(back.z) : back.z, specular.ior);
    // Between two planes light is reflected any number of times.
    const float share = thin ? at.share * 2 / (1 + at.share) : at.share;
    if (part <= share)
        return {reflected(back), specular.reflectance};
    if (thin)
        return {-back, specular.transmittance};
    // Radiance is squeezed into a narrower cone.
    return {{-at.ratio * back.x, -at.ratio * back.y, at.cosine},
            specular.transmittance * (at.ratio * at.ratio)};
}

} // namespace mlrt
