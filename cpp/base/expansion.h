// Exact sums and products of doubles.
//
// Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric
// Predicates", Discrete & Computational Geometry 18, 1997: a number is held as an
// unevaluated sum of doubles that do not overlap, ordered by magnitude. Every operation
// below is exact as long as nothing overflows or underflows; for products of up to three
// floats (and differences of floats) doubles leave room for both.
#pragma once

#include "base/check.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace mlrt {

struct SumAndError {
    double sum, error;
};

// a + b = sum + error exactly (Knuth; Shewchuk, theorem 7).
inline SumAndError two_sum(double a, double b) {
    const double sum = a + b;
    const double b_virtual = sum - a;
    const double a_virtual = sum - b_virtual;
    return {sum, (a - a_virtual) + (b - b_virtual)};
}

// a * b = sum + error exactly.
inline SumAndError two_product(double a, double b) {
    const double product = a * b;
    return {product, std::fma(a, b, -product)};
}

class Expansion {
public:
    // Enough for n.a - m (n.d) with n = (difference x difference), a another difference,
    // d a vector and m a double, the largest expression in use: 192 + 192 terms.
    static constexpr int CAPACITY = 384;

    Expansion() = default;
    Expansion(const Expansion &other) : count_(other.count_) {
        std::copy_n(other.terms_.begin(), count_, terms_.begin());
    }
    Expansion &operator=(const Expansion &other) {
        count_ = other.count_;
        std::copy_n(other.terms_.begin(), count_, terms_.begin());
        return *this;
    }
    explicit Expansion(double value) { append(value); }

    // a - b, which need not be a double.
    static Expansion difference(double a, double b) {
        const SumAndError d = two_sum(a, -b);
        Expansion result;
        result.append(d.error);
        result.append(d.sum);
        return result;
    }

    // Adds one double (Shewchuk, GROW-EXPANSION with zero elimination).
    Expansion &operator+=(double value) {
        int kept = 0;
        double q = value;
        for (int i = 0; i < count_; ++i) {
            const SumAndError s = two_sum(q, terms_[i]);
            q = s.sum;
            if (s.error != 0)
                terms_[kept++] = s.error;
        }
        count_ = kept;
        append(q);
        return *this;
    }

    friend Expansion operator+(const Expansion &a, const Expansion &b) {
        Expansion result = a;
        for (int i = 0; i < b.count_; ++i)
            result += b.terms_[i];
        return result;
    }

    friend Expansion operator-(const Expansion &a, const Expansion &b) {
        Expansion result = a;
        for (int i = 0; i < b.count_; ++i)
            result += -b.terms_[i];
        return result;
    }

    friend Expansion operator*(const Expansion &a, const Expansion &b) {
        Expansion result;
        for (int i = 0; i < a.count_; ++i)
            for (int j = 0; j < b.count_; ++j) {
                const SumAndError p = two_product(a.terms_[i], b.terms_[j]);
                result += p.error;
                result += p.sum;
            }
        return result;
    }

    // -1, 0 or 1: the largest term decides, because terms do not overlap.
    int sign() const {
        if (count_ == 0)
            return 0;
        return terms_[count_ - 1] > 0 ? 1 : -1;
    }

    // The value, to a relative error of a few 2^-53.
    double estimate() const {
        double sum = 0;
        for (int i = 0; i < count_; ++i)
            sum += terms_[i];
        return sum;
    }

private:
    void append(double value) {
        if (value != 0) {
            MLRT_CHECK(count_ < CAPACITY);
            terms_[count_++] = value;
        }
    }

    std::array<double, CAPACITY> terms_; // uninitialised past count_
    int count_ = 0;
};

} // namespace mlrt
