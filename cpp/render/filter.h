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

    bool is_box() const { return box_; }
    float radius() const { return radius_; }

    // Pixels beyond the one a sample lies in that it may reach, on each side.
    int reach() const { return reach_; }

    // Pixels beside the crop whose samples reach into it (Mitsuba's border_size).
    int border() const { return border_; }

    // Weight at a distance of x pixels, of any filter but the box: of one, or of sixteen
    // with the same bits.
    template <typename Real>
    Real weight(const Real &x) const {
        return maximum(polynomial(x * x), Real(0.0f));
    }

private:
    template <typename Real>
    Real polynomial(const Real &x_squared) const;

    bool box_;
    float radius_;
    int reach_ = 0;
    int border_ = 0;
    std::array<float, 10> coefficients_{};
};

// Estrin's scheme with fused operations, term by term as Dr.Jit evaluates it: the terms
// cancel, so another order would show.
template <typename Real>
Real ReconstructionFilter::polynomial(const Real &x) const {
    const auto c = [&](int i) { return Real(coefficients_[i]); };
    const Real x2 = x * x, x4 = x2 * x2, x8 = x4 * x4;
    const Real c01 = fused(x, c(1), c(0)), c23 = fused(x, c(3), c(2));
    const Real c45 = fused(x, c(5), c(4)), c67 = fused(x, c(7), c(6));
    const Real c89 = fused(x, c(9), c(8));
    const Real c03 = fused(x2, c23, c01), c47 = fused(x2, c67, c45);
    return fused(x8, c89, fused(x4, c47, c03));
}

struct PixelRect {
    int x = 0, y = 0; // on the whole film
    uint32_t width = 0, height = 0;
};

// The crop, with the filter's border if the film asks for it.
PixelRect sampled_pixels(const Film &film, const ReconstructionFilter &filter);

} // namespace mlrt
