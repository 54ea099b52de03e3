// Random numbers that are spread evenly over the samples of a pixel: those of Mitsuba's
// samplers `stratified`, `multijitter`, `orthogonal` and `ldsampler`, as its vectorised
// variants draw them.
#pragma once

#include "render/sampler.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace mlrt {

enum class SamplerType : uint32_t {
    independent,
    stratified,  // a square grid, shuffled anew for each pair of numbers
    multijitter, // Kensler 2013, "Correlated multi-jittered sampling"
    orthogonal,  // Jarosz et al. 2019, "Orthogonal array sampling for Monte Carlo
                 // rendering", of strength 2, by Bose's construction
    ldsampler,   // a (0, 2)-sequence, scrambled and shuffled (Kollig and Keller 2002)
};

struct Sampler {
    SamplerType type = SamplerType::independent;
    uint32_t base_seed = 0; // of the sampler's own; the seed of the streams includes it
    bool jitter = true;     // whether samples lie anywhere in their cells, or in the middle
};

// Whether a sampler can take that many samples a pixel: a square (stratified), the square
// of a prime (orthogonal) or of a power of two (ldsampler), the number of cells of a grid
// that is nearly square (multijitter).
bool takes(SamplerType type, uint32_t samples_per_pixel);

// Numbers for samples of one pass, which has to be the only one: sample s of pixel p has
// the index p * samples_per_pixel + s, and the sampler takes that many samples.
void draw_spread_numbers(const Sampler &sampler, const uint32_t *seeds,
                         const uint32_t *indices, size_t count, uint32_t samples_per_pixel,
                         std::span<const NumberPair> pairs);

} // namespace mlrt
