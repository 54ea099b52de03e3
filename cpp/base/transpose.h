// Rows and columns: from values side by side to values one above the other, and back.
#pragma once

#include "base/simd.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace mlrt {

// Rows of eight values as columns: result[i] holds value i of each row.
inline std::array<FloatBlock, 8>
load_columns(const std::array<const float *, BLOCK_WIDTH> &rows) {
#if defined(__AVX__)
    const auto row = [&](int i) { return _mm256_loadu_ps(rows[i]); };
    __m256 pair[8], quad[8];
    for (int i = 0; i < 8; i += 2) {
        pair[i] = _mm256_unpacklo_ps(row(i), row(i + 1));
        pair[i + 1] = _mm256_unpackhi_ps(row(i), row(i + 1));
    }
    for (int i = 0; i < 8; i += 4)
        for (int j = 0; j < 2; ++j) {
            const __m256 a = pair[i + j], b = pair[i + 2 + j];
            quad[i + 2 * j] = _mm256_shuffle_ps(a, b, _MM_SHUFFLE(1, 0, 1, 0));
            quad[i + 2 * j + 1] = _mm256_shuffle_ps(a, b, _MM_SHUFFLE(3, 2, 3, 2));
        }
    std::array<FloatBlock, 8> columns;
    for (int i = 0; i < 4; ++i) {
        columns[i] = FloatBlock(_mm256_permute2f128_ps(quad[i], quad[i + 4], 0x20));
        columns[i + 4] = FloatBlock(_mm256_permute2f128_ps(quad[i], quad[i + 4], 0x31));
    }
    return columns;
#else
    std::array<FloatBlock, 8> columns;
    for (uint32_t i = 0; i < BLOCK_WIDTH; ++i) {
        std::array<float, BLOCK_WIDTH> column;
        for (uint32_t j = 0; j < BLOCK_WIDTH; ++j)
            column[j] = rows[j][i];
        columns[i] = drjit::load<FloatBlock>(column.data());
    }
    return columns;
#endif
}

inline std::array<FloatPacket, 8>
load_columns(const std::array<const float *, PACKET_WIDTH> &rows) {
    std::array<const float *, BLOCK_WIDTH> low, high;
    std::copy_n(rows.begin(), BLOCK_WIDTH, low.begin());
    std::copy_n(rows.begin() + BLOCK_WIDTH, BLOCK_WIDTH, high.begin());
    const std::array<FloatBlock, 8> a = load_columns(low), b = load_columns(high);
    std::array<FloatPacket, 8> columns;
    for (size_t i = 0; i < 8; ++i)
        columns[i] = FloatPacket(a[i], b[i]);
    return columns;
}

// Four values of each of sixteen rows, which begin `stride` apart, as columns: result[i]
// holds value i of each row.
inline std::array<FloatPacket, 4> load_four_columns(const float *rows, size_t stride) {
#if defined(__AVX512F__)
    // Rows i, i + 4, i + 8 and i + 12.
    const auto four_rows = [&](size_t i) {
        const auto row = [&](size_t j) { return _mm_loadu_ps(rows + (i + j) * stride); };
        __m512 four = _mm512_castps128_ps512(row(0));
        four = _mm512_insertf32x4(four, row(4), 1);
        four = _mm512_insertf32x4(four, row(8), 2);
        return _mm512_insertf32x4(four, row(12), 3);
    };
    const __m512 a = four_rows(0), b = four_rows(1), c = four_rows(2), d = four_rows(3);
    const __m512 ab = _mm512_unpacklo_ps(a, b), cd = _mm512_unpacklo_ps(c, d);
    const __m512 ab_high = _mm512_unpackhi_ps(a, b), cd_high = _mm512_unpackhi_ps(c, d);
    constexpr int LOWER = _MM_SHUFFLE(1, 0, 1, 0), UPPER = _MM_SHUFFLE(3, 2, 3, 2);
    return {FloatPacket(_mm512_shuffle_ps(ab, cd, LOWER)),
            FloatPacket(_mm512_shuffle_ps(ab, cd, UPPER)),
            FloatPacket(_mm512_shuffle_ps(ab_high, cd_high, LOWER)),
            FloatPacket(_mm512_shuffle_ps(ab_high, cd_high, UPPER))};
#elif defined(__AVX__)
    // Rows i and i + 4.
    const auto two_rows = [&](size_t i) {
        const auto row = [&](size_t j) { return _mm_loadu_ps(rows + (i + j) * stride); };
        return _mm256_insertf128_ps(_mm256_castps128_ps256(row(0)), row(4), 1);
    };
    const auto eight_rows = [&](size_t first) -> std::array<FloatBlock, 4> {
        const __m256 a = two_rows(first), b = two_rows(first + 1);
        const __m256 c = two_rows(first + 2), d = two_rows(first + 3);
        const __m256 ab = _mm256_unpacklo_ps(a, b), cd = _mm256_unpacklo_ps(c, d);
        const __m256 ab_high = _mm256_unpackhi_ps(a, b), cd_high = _mm256_unpackhi_ps(c, d);
        constexpr int LOWER = _MM_SHUFFLE(1, 0, 1, 0), UPPER = _MM_SHUFFLE(3, 2, 3, 2);
        return {FloatBlock(_mm256_shuffle_ps(ab, cd, LOWER)),
                FloatBlock(_mm256_shuffle_ps(ab, cd, UPPER)),
                FloatBlock(_mm256_shuffle_ps(ab_high, cd_high, LOWER)),
                FloatBlock(_mm256_shuffle_ps(ab_high, cd_high, UPPER))};
    };
    const std::array<FloatBlock, 4> low = eight_rows(0), high = eight_rows(8);
    return {FloatPacket(low[0], high[0]), FloatPacket(low[1], high[1]),
            FloatPacket(low[2], high[2]), FloatPacket(low[3], high[3])};
#else
    std::array<LaneArray<float>, 4> columns;
    for (size_t row = 0; row < PACKET_WIDTH; ++row)
        for (size_t i = 0; i < 4; ++i)
            columns[i][row] = rows[row * stride + i];
    return {load<FloatPacket>(columns[0]), load<FloatPacket>(columns[1]),
            load<FloatPacket>(columns[2]), load<FloatPacket>(columns[3])};
#endif
}

// A register of each of sixteen packets.
using PacketRows = std::array<FloatWide, PACKET_WIDTH>;

namespace simd_detail {

// `better` keeps one of two values a lane. Halves the number of registers and of the values
// that are left of each, until there is a value of each.
#if defined(__AVX512F__)
template <typename Better>
FloatPacket best_lanes(const PacketRows &rows, Better &&better) {
    FloatPacket two[8], four[4];
    for (int i = 0; i < 8; ++i) {
        const __m512 a = rows[size_t(2 * i)].m, b = rows[size_t(2 * i + 1)].m;
        two[i] = better(FloatPacket(_mm512_unpacklo_ps(a, b)),
                        FloatPacket(_mm512_unpackhi_ps(a, b)));
    }
    for (int i = 0; i < 4; ++i) {
        const __m512d a = _mm512_castps_pd(two[2 * i].m);
        const __m512d b = _mm512_castps_pd(two[2 * i + 1].m);
        four[i] = better(FloatPacket(_mm512_castpd_ps(_mm512_unpacklo_pd(a, b))),
                         FloatPacket(_mm512_castpd_ps(_mm512_unpackhi_pd(a, b))));
    }
    const auto halved = [&](const FloatPacket &a, const FloatPacket &b) {
        return better(FloatPacket(_mm512_shuffle_f32x4(a.m, b.m, 0x88)),
                      FloatPacket(_mm512_shuffle_f32x4(a.m, b.m, 0xdd)));
    };
    return halved(halved(four[0], four[1]), halved(four[2], four[3]));
}
#elif defined(__AVX__)
template <typename Better>
FloatBlock best_lanes_of_eight(const FloatWide *rows, Better &&better) {
    FloatBlock two[4], four[2];
    for (int i = 0; i < 4; ++i) {
        const __m256 a = rows[2 * i].m, b = rows[2 * i + 1].m;
        two[i] = better(FloatBlock(_mm256_unpacklo_ps(a, b)),
                        FloatBlock(_mm256_unpackhi_ps(a, b)));
    }
    for (int i = 0; i < 2; ++i) {
        const __m256d a = _mm256_castps_pd(two[2 * i].m);
        const __m256d b = _mm256_castps_pd(two[2 * i + 1].m);
        four[i] = better(FloatBlock(_mm256_castpd_ps(_mm256_unpacklo_pd(a, b))),
                         FloatBlock(_mm256_castpd_ps(_mm256_unpackhi_pd(a, b))));
    }
    return better(FloatBlock(_mm256_permute2f128_ps(four[0].m, four[1].m, 0x20)),
                  FloatBlock(_mm256_permute2f128_ps(four[0].m, four[1].m, 0x31)));
}
template <typename Better>
FloatPacket best_lanes(const PacketRows &rows, Better &&better) {
    return FloatPacket(best_lanes_of_eight(rows.data(), better),
                       best_lanes_of_eight(rows.data() + BLOCK_WIDTH, better));
}
#else
template <typename Better>
FloatPacket best_lanes(const PacketRows &rows, Better &&better) {
    LaneArray<float> best;
    for (uint32_t i = 0; i < PACKET_WIDTH; ++i) {
        best[i] = rows[i].entry(0);
        for (uint32_t lane = 1; lane < WIDE_WIDTH; ++lane)
            best[i] = better(best[i], float(rows[i].entry(lane)));
    }
    return load<FloatPacket>(best);
}
#endif

} // namespace simd_detail

// Lane i of the result is the least lane of row i. Lanes must be ordered (no NaN).
inline FloatPacket least_lanes(const PacketRows &rows) {
    return simd_detail::best_lanes(
        rows, [](const auto &a, const auto &b) { return minimum(a, b); });
}

// The same of the greatest lanes.
inline FloatPacket greatest_lanes(const PacketRows &rows) {
    return simd_detail::best_lanes(
        rows, [](const auto &a, const auto &b) { return maximum(a, b); });
}

} // namespace mlrt
