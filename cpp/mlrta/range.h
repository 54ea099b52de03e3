// Closed ranges of reals in double precision: enough to bound sets of single-precision
// rays.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace mlrt {

// Covers the few roundings of a quotient or product of doubles, many times over.
inline constexpr double WIDEN_RANGE = 0x1p-45;

struct Range {
    double lo = std::numeric_limits<double>::infinity();
    double hi = -std::numeric_limits<double>::infinity();

    void add(double x) {
        lo = std::min(lo, x);
        hi = std::max(hi, x);
    }
    void add(const Range &r) {
        lo = std::min(lo, r.lo);
        hi = std::max(hi, r.hi);
    }

    // The same range with both ends moved outward by a share of their magnitude.
    Range widened(double share) const {
        return {lo - share * std::abs(lo), hi + share * std::abs(hi)};
    }

    friend Range operator*(const Range &a, const Range &b) {
        const double p = a.lo * b.lo, q = a.lo * b.hi, r = a.hi * b.lo, s = a.hi * b.hi;
        return {std::min(std::min(p, q), std::min(r, s)),
                std::max(std::max(p, q), std::max(r, s))};
    }
    friend Range operator+(const Range &a, const Range &b) {
        return {a.lo + b.lo, a.hi + b.hi};
    }

    // Of one sign.
    Range reciprocal() const { return {1 / hi, 1 / lo}; }
    double magnitude() const { return std::max(std::abs(lo), std::abs(hi)); }
};

} // namespace mlrt
