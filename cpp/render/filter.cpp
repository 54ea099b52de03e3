#include "render/filter.h"

#include "render/shadow_offset.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mlrt {

namespace {

// Minimax fit to exp(-x / 2) on [0, 16], lowest power first, which Mitsuba 3.9 uses on
// processors without a fast exponential (gaussian.cpp). It deviates from the exponential by
// up to 7e-4, so a picture can only be equal with the same one.
constexpr std::array<double, 10> GAUSSIAN_FIT{
    9.992604880e-1,  -4.977025247e-1, 1.222248550e-1,  -1.932406282e-2, 2.136713061e-3,
    -1.679873860e-4, 9.202145248e-6,  -3.329417433e-7, 7.128382794e-9,  -6.821193280e-11};

} // namespace

ReconstructionFilter::ReconstructionFilter(const Film &film)
    : type_(film.filter), radius_(is_box() ? 0.5f : film.filter_radius) {
    if (is_box())
        return;
    reach_ = int(std::ceil(radius_ - 0.5f));
    border_ = std::max(0, int(std::ceil(radius_ - 0.5f - 2 * RAY_EPSILON)));
    if (type_ == FilterType::gaussian)
        fit_gaussian(film.filter_stddev);
    else if (type_ == FilterType::mitchell)
        fit_cubic(double(film.filter_b), double(film.filter_c));
    else if (type_ == FilterType::catmullrom)
        fit_cubic(0, 0.5);
}

FloatPacket ReconstructionFilter::weight(const FloatPacket &x) const {
    const FloatPacket zero(0.0f), one(1.0f);
    switch (type_) {
    case FilterType::box:
        break;
    case FilterType::tent:
        return maximum(one - absolute(x * FloatPacket(1.0f / radius_)), zero);
    case FilterType::gaussian:
        return maximum(gaussian(x * x), zero);
    case FilterType::mitchell:
    case FilterType::catmullrom:
        return cubic(absolute(x));
    case FilterType::lanczos:
        return lanczos(absolute(x));
    }
    return select(absolute(x) <= FloatPacket(radius_), one, zero);
}

void ReconstructionFilter::fit_gaussian(double stddev) {
    const double variance = stddev * stddev;
    double scale = 1;
    for (int i = 0; i < 10; ++i) {
        coefficients_[i] = float(GAUSSIAN_FIT[i] * scale);
        scale /= variance;
    }
    coefficients_[0] -= first_lane(gaussian(FloatPacket(radius_ * radius_)));
}

// Estrin's scheme with fused operations, term by term as Dr.Jit evaluates it: the terms
// cancel, so another order would show.
FloatPacket ReconstructionFilter::gaussian(const FloatPacket &x) const {
    const auto c = [&](int i) { return FloatPacket(coefficients_[i]); };
    const FloatPacket x2 = x * x, x4 = x2 * x2, x8 = x4 * x4;
    const FloatPacket c01 = fused(x, c(1), c(0)), c23 = fused(x, c(3), c(2));
    const FloatPacket c45 = fused(x, c(5), c(4)), c67 = fused(x, c(7), c(6));
    const FloatPacket c89 = fused(x, c(9), c(8));
    const FloatPacket c03 = fused(x2, c23, c01), c47 = fused(x2, c67, c45);
    return fused(x8, c89, fused(x4, c47, c03));
}

// Mitchell and Netravali 1988, "Reconstruction filters in computer graphics", equation 8:
// two cubics, lowest power first. B = 0 and C = 1/2 are the spline of Catmull and Rom.
void ReconstructionFilter::fit_cubic(double b, double c) {
    const std::array<double, 8> cubics{6 - 2 * b,
                                       0,
                                       -18 + 12 * b + 6 * c,
                                       12 - 9 * b - 6 * c,
                                       8 * b + 24 * c,
                                       -12 * b - 48 * c,
                                       6 * b + 30 * c,
                                       -b - 6 * c};
    for (size_t i = 0; i < cubics.size(); ++i)
        coefficients_[i] = float(cubics[i] / 6);
}

FloatPacket ReconstructionFilter::cubic(const FloatPacket &x) const {
    const auto at = [&](int first) {
        const auto c = [&](int i) { return FloatPacket(coefficients_[first + i]); };
        return fused(fused(fused(c(3), x, c(2)), x, c(1)), x, c(0));
    };
    return select(x < FloatPacket(1.0f), at(0),
                  select(x < FloatPacket(2.0f), at(4), FloatPacket(0.0f)));
}

// sinc(x) sinc(x / lobes), with as many lobes as the radius has pixels.
FloatPacket ReconstructionFilter::lanczos(const FloatPacket &x) const {
    const FloatPacket scaled = x * FloatPacket(std::numbers::pi_v<float>);
    const FloatPacket slow = scaled / FloatPacket(radius_);
    const FloatPacket product = sine(scaled) * sine(slow) / (scaled * slow);
    const FloatPacket inside =
        select(x < FloatPacket(RAY_EPSILON), FloatPacket(1.0f), product);
    return select(x > FloatPacket(radius_), FloatPacket(0.0f), inside);
}

PixelRect sampled_pixels(const Film &film, const ReconstructionFilter &filter) {
    const int border = film.sample_border ? filter.border() : 0;
    return {int(film.crop_x) - border, int(film.crop_y) - border,
            film.crop_width + 2 * uint32_t(border),
            film.crop_height + 2 * uint32_t(border)};
}

} // namespace mlrt
