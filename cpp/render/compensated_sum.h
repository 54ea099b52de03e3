// Sums of many samples in single precision.
//
// Adding n numbers one by one may be off by n 2^-24 of the sum of their sizes; where the
// samples of a pixel are alike, rounding goes the same way for long, so that this is not
// only a bound: of 10^7 equal samples a seventh is lost. Kahan's summation (Pracniques:
// Further remarks on reducing truncation errors, CACM 8(1), 1965) keeps what rounding took
// from the sum, and is off by a unit or two in the last place.
#pragma once

#include <cstdint>

namespace mlrt {

// Chosen: so many summands lose 6e-5 at most, and pictures of as many samples a pixel have
// few pixels, so that room for errors costs little.
inline constexpr uint32_t MOST_PLAIN_SUMMANDS = 1024;

// Adds to a sum whose error so far is known. Needs arithmetic as it is written: no
// -ffast-math.
inline void add_compensated(float value, float &sum, float &error) {
    const float corrected = value - error;
    const float next = sum + corrected;
    error = (next - sum) - corrected;
    sum = next;
}

} // namespace mlrt
