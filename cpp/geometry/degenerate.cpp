#include "geometry/degenerate.h"

namespace mlrt {

namespace {

// Adds `x` to the expansion of `count` non-overlapping doubles whose exact sum it stands
// for (Shewchuk 1997, GROW-EXPANSION). The sum is zero if and only if every component is.
void grow(double *expansion, int &count, double x) {
    for (int i = 0; i < count; ++i) {
        // TWO-SUM (Knuth): sum + rest = x + expansion[i] exactly.
        const double sum = x + expansion[i];
        const double virtual_part = sum - x;
        const double rest = (x - (sum - virtual_part)) + (expansion[i] - virtual_part);
        expansion[i] = rest;
        x = sum;
    }
    expansion[count++] = x;
}

// Twice the signed area of a triangle in the plane of two coordinates, compared with zero.
bool has_zero_area(const Triangle &t, int i, int j) {
    const double ai = t.a[i], aj = t.a[j], bi = t.b[i], bj = t.b[j], ci = t.c[i],
                 cj = t.c[j];
    // Products of two floats are exact in double: 48 bits, exponents from -298 to 256.
    const double terms[6] = {ai * bj, -(aj * bi), bi * cj, -(bj * ci), ci * aj, -(cj * ai)};
    double sum = 0, magnitude = 0;
    for (double term : terms) {
        sum += term;
        magnitude += std::abs(term);
    }
    // Five additions, each within a relative 2^-53 of at most `magnitude`.
    if (std::abs(sum) > 0x1p-50 * magnitude)
        return false;
    double expansion[6];
    int count = 0;
    for (double term : terms)
        grow(expansion, count, term);
    for (int k = 0; k < count; ++k)
        if (expansion[k] != 0)
            return false;
    return true;
}

} // namespace

bool is_degenerate(const Triangle &t) {
    if (!is_finite(t.a) || !is_finite(t.b) || !is_finite(t.c))
        return true;
    return has_zero_area(t, 0, 1) && has_zero_area(t, 1, 2) && has_zero_area(t, 2, 0);
}

} // namespace mlrt
