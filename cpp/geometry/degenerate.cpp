#include "geometry/degenerate.h"

#include "base/expansion.h"

namespace mlrt {

namespace {

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
    Expansion exact;
    for (double term : terms)
        exact += term;
    return exact.sign() == 0;
}

} // namespace

bool is_degenerate(const Triangle &t) {
    if (!is_finite(t))
        return true;
    return has_zero_area(t, 0, 1) && has_zero_area(t, 1, 2) && has_zero_area(t, 2, 0);
}

} // namespace mlrt
