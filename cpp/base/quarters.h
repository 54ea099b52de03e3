// Packets whose lanes come from four places, such as the rows of a square of 4 x 4.
#pragma once

#include "base/simd.h"

#include <array>
#include <cstddef>

namespace mlrt {

// Lanes 0 to 3, 4 to 7, 8 to 11 and 12 to 15 have a place each.
inline constexpr size_t QUARTERS = 4, QUARTER_WIDTH = PACKET_WIDTH / QUARTERS;

namespace quarters_detail {

#if defined(__AVX512F__)
using Register = __m512;
#elif defined(__AVX__)
using Register = __m256;
#endif

#if defined(__AVX__)
// Of each quarter the values I and J of a, then the values K and L of b.
template <int I, int J, int K, int L>
Register shuffled(Register a, Register b) {
    constexpr int ORDER = _MM_SHUFFLE(L, K, J, I);
#if defined(__AVX512F__)
    return _mm512_shuffle_ps(a, b, ORDER);
#else
    return _mm256_shuffle_ps(a, b, ORDER);
#endif
}

// The columns of rows x0 y0 z0, x1 y1 z1 and so on, given as x0 y0 z0 x1, y1 z1 x2 y2 and
// z2 x3 y3 z3 of each quarter.
struct Columns {
    Register x, y, z;

    Columns(Register a, Register b, Register c)
        : x(shuffled<0, 3, 0, 2>(a, shuffled<2, 2, 1, 1>(b, c))),
          y(shuffled<0, 2, 0, 2>(shuffled<1, 1, 0, 0>(a, b), shuffled<3, 3, 2, 2>(b, c))),
          z(shuffled<0, 2, 0, 3>(shuffled<2, 2, 1, 1>(a, b), c)) {}
};
#endif

} // namespace quarters_detail

// Three values of each of sixteen rows, of which four follow one another in each place, as
// columns: result[i] holds value i of each row.
inline std::array<FloatPacket, 3>
load_three_columns(const std::array<const float *, QUARTERS> &places) {
#if defined(__AVX__)
    const auto four = [&](size_t i, size_t first) {
        return _mm_loadu_ps(places[i] + first);
    };
#endif
#if defined(__AVX512F__)
    const auto all = [&](size_t first) {
        __m512 values = _mm512_castps128_ps512(four(0, first));
        values = _mm512_insertf32x4(values, four(1, first), 1);
        values = _mm512_insertf32x4(values, four(2, first), 2);
        return _mm512_insertf32x4(values, four(3, first), 3);
    };
    const quarters_detail::Columns columns(all(0), all(4), all(8));
    return {FloatPacket(columns.x), FloatPacket(columns.y), FloatPacket(columns.z)};
#elif defined(__AVX__)
    const auto half = [&](size_t i) {
        const auto values = [&](size_t first) {
            return _mm256_insertf128_ps(_mm256_castps128_ps256(four(i, first)),
                                        four(i + 1, first), 1);
        };
        return quarters_detail::Columns(values(0), values(4), values(8));
    };
    const quarters_detail::Columns low = half(0), high = half(2);
    return {FloatPacket(FloatBlock(low.x), FloatBlock(high.x)),
            FloatPacket(FloatBlock(low.y), FloatBlock(high.y)),
            FloatPacket(FloatBlock(low.z), FloatBlock(high.z))};
#else
    std::array<LaneArray<float>, 3> columns;
    for (size_t lane = 0; lane < PACKET_WIDTH; ++lane)
        for (size_t i = 0; i < 3; ++i)
            columns[i][lane] = places[lane / QUARTER_WIDTH][lane % QUARTER_WIDTH * 3 + i];
    return {load<FloatPacket>(columns[0]), load<FloatPacket>(columns[1]),
            load<FloatPacket>(columns[2])};
#endif
}

} // namespace mlrt
