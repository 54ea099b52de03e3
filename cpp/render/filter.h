// Reconstruction filters and the pixels that are sampled for them.
#pragma once

#include "base/simd.h"
#include "render/scene.h"

#include <array>
#include <cstdint>

namespace mlrt {

// A separable filter, not normalised: the film divides by the sum of the weights.
class ReconstructionFilter {
public:
    explicit ReconstructionFilter(const Film &film);

    bool is_box() const { return type_ == FilterType::box; }
    float radius() const { return radius_; }

    // Pixels beyond the one a sample lies in that it may reach, on each side.
    int reach() const { return reach_; }

    // Pixels beside the crop whose samples reach into it (Mitsuba's border_size).
    int border() const { return border_; }

    // Weight at a distance of x pixels, of any filter but the box: of one, or of sixteen
    // with the same bits.
    FloatPacket weight(const FloatPacket &x) const;
    float weight(float x) const { return first_lane(weight(FloatPacket(x))); }

private:
    void fit_gaussian(double stddev);
    void fit_cubic(double b, double c);
    FloatPacket gaussian(const FloatPacket &x_squared) const;
    FloatPacket cubic(const FloatPacket &x) const;
    FloatPacket lanczos(const FloatPacket &x) const;

    FilterType type_;
    float radius_;
    int reach_ = 0;
    int border_ = 0;
    std::array<float, 10> coefficients_{};
};

struct PixelRect {
    int x = 0, y = 0; // on the whole film
    uint32_t width = 0, height = 0;
};

// The crop, with the filter's border if the film asks for it.
PixelRect sampled_pixels(const Film &film, const ReconstructionFilter &filter);

} // namespace mlrt
