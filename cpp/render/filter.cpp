#include "render/filter.h"

#include "render/shadow_offset.h"

#include <algorithm>
#include <cmath>

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
    : box_(film.filter == FilterType::box), radius_(box_ ? 0.5f : film.filter_radius) {
    if (box_)
        return;
    reach_ = int(std::ceil(radius_ - 0.5f));
    border_ = std::max(0, int(std::ceil(radius_ - 0.5f - 2 * RAY_EPSILON)));
    const double variance = double(film.filter_stddev) * film.filter_stddev;
    double scale = 1;
    for (int i = 0; i < 10; ++i) {
        coefficients_[i] = float(GAUSSIAN_FIT[i] * scale);
        scale /= variance;
    }
    coefficients_[0] -= polynomial(radius_ * radius_);
}

PixelRect sampled_pixels(const Film &film, const ReconstructionFilter &filter) {
    const int border = film.sample_border ? filter.border() : 0;
    return {int(film.crop_x) - border, int(film.crop_y) - border,
            film.crop_width + 2 * uint32_t(border),
            film.crop_height + 2 * uint32_t(border)};
}

} // namespace mlrt
