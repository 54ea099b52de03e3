// Reconstruction filters and the pixels that are sampled for them.
#pragma once

#include "render/scene.h"

#include <array>
#include <cstdint>

namespace mlrt {

// A separable filter, not normalised: the film divides by the sum of the weights.
class ReconstructionFilter {
public:
    explicit ReconstructionFilter(const Film &film);

    bool is_box() const { return box_; }
    float radius() const { return radius_; }

    // Pixels beyond the one a sample lies in that it may reach, on each side.
    int reach() const { return reach_; }

    // Pixels beside the crop whose samples reach into it (Mitsuba's border_size).
    int border() const { return border_; }

    // Weight at a distance of x pixels, of any filter but the box.
    float weight(float x) const;

private:
    float polynomial(float x_squared) const;

    bool box_;
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
