#include "render/spread_samples.h"

#include "base/vec.h"

#include <bit>
#include <cmath>

namespace mlrt {

namespace {

// The place of `index` in a permutation of `size` numbers (Kensler 2013, listing 4, with
// the rotation at the end).
uint32_t permute(uint32_t index, uint32_t size, uint32_t seed) {
    if (size == 1)
        return 0;
    const uint32_t mask = std::bit_ceil(size) - 1;
    do {
        index ^= seed;
        index *= 0xe170893d;
        index ^= seed >> 16;
        index ^= (index & mask) >> 4;
        index ^= seed >> 8;
        index *= 0x0929eb3f;
        index ^= seed >> 23;
        index ^= (index & mask) >> 1;
        index *= 1 | seed >> 27;
        index *= 0x6935fa69;
        index ^= (index & mask) >> 11;
        index *= 0x74dcb303;
        index ^= (index & mask) >> 2;
        index *= 0x9e501cc3;
        index ^= (index & mask) >> 2;
        index *= 0xc860a3df;
        index &= mask;
        index ^= index >> 5;
    } while (index >= size);
    return (index + seed) % size;
}

// The same for powers of two by a network of exchanges.
uint32_t permute_by_exchanges(uint32_t index, uint32_t size, uint32_t seed) {
    for (uint32_t bit = 1; bit < size; bit *= 2)
        if (sample_tea_32(index | bit, seed, 2).first & bit)
            index ^= bit;
    return index;
}

uint32_t reversed_bits(uint32_t v) {
    v = (v << 16) | (v >> 16);
    v = ((v & 0x00ff00ffu) << 8) | ((v & 0xff00ff00u) >> 8);
    v = ((v & 0x0f0f0f0fu) << 4) | ((v & 0xf0f0f0f0u) >> 4);
    v = ((v & 0x33333333u) << 2) | ((v & 0xccccccccu) >> 2);
    return ((v & 0x55555555u) << 1) | ((v & 0xaaaaaaaau) >> 1);
}

// The first two components of Sobol's sequence.
float van_der_corput(uint32_t index, uint32_t scramble) {
    const uint32_t bits = reversed_bits(index) ^ scramble;
    return std::bit_cast<float>((bits >> 9) | 0x3f800000u) - 1.0f;
}
float sobol_second(uint32_t index, uint32_t scramble) {
    for (uint32_t v = 1u << 31; index != 0; index >>= 1, v ^= v >> 1)
        if (index & 1)
            scramble ^= v;
    return float(scramble) / 4294967296.0f;
}

// One sample of one pixel: what its numbers are made of.
struct Sample {
    uint32_t number, count; // among those of its pixel
    uint32_t pixel_seed;    // the same for all of them
    uint32_t dimension = 0; // how many numbers, or pairs of them, have been drawn
    Pcg32 random;
    bool jitter;

    float within_cell() { return jitter ? random.next_float() : 0.5f; }
};

Vec2f stratified_pair(Sample &sample, uint32_t side) {
    const uint32_t seed = sample.pixel_seed + sample.dimension++;
    const uint32_t cell = permute(sample.number, sample.count, seed);
    const uint32_t y = cell / side, x = cell - y * side;
    const float within_x = sample.within_cell(), within_y = sample.within_cell();
    const float inverse = 1.0f / float(side);
    return {(float(x) + within_x) * inverse, (float(y) + within_y) * inverse};
}

Vec2f multijittered_pair(Sample &sample, uint32_t columns, uint32_t rows) {
    const uint32_t seed = sample.pixel_seed + sample.dimension++;
    const uint32_t cell = permute(sample.number, sample.count, seed * 0x51633e2du);
    const uint32_t y = cell / columns, x = cell - y * columns;
    const uint32_t column = permute(x, columns, seed * 0x68bc21ebu);
    const uint32_t row = permute(y, rows, seed * 0x02e5be93u);
    const float within_x = sample.within_cell(), within_y = sample.within_cell();
    const float inverse_columns = 1.0f / float(columns), inverse_rows = 1.0f / float(rows);
    return {(float(x) + (float(row) + within_x) * inverse_rows) * inverse_columns,
            (float(y) + (float(column) + within_y) * inverse_columns) * inverse_rows};
}

float orthogonal_number(Sample &sample, uint32_t side) {
    const uint32_t seed = sample.pixel_seed, j = sample.dimension++;
    const uint32_t cell = permute(sample.number % sample.count, sample.count, seed);
    const uint32_t first = cell / side, second = cell - first * side;
    // Column j of Bose's array, and its partner, which substrata are taken from.
    const auto entry = [&](uint32_t column) {
        return column == 0   ? first
               : column == 1 ? second
                             : (first + (column - 1) * second) % side;
    };
    const uint32_t partner = j % 2 > 0 ? j - 1 : j + 1;
    const uint32_t shuffle = seed * (j + 1);
    const uint32_t stratum = permute(entry(j), side, shuffle * 0x51633e2du);
    const uint32_t substratum = permute(entry(partner), side, shuffle * 0x68bc21ebu);
    const float inverse = 1.0f / float(side);
    return (float(stratum) + (float(substratum) + sample.within_cell()) * inverse) *
           inverse;
}

uint32_t square_side(uint32_t samples) {
    return uint32_t(std::lround(std::sqrt(double(samples))));
}

// Of the grid of `multijitter`, which has at least as many columns.
uint32_t grid_rows(uint32_t samples) {
    return uint32_t(std::sqrt(float(samples)));
}

bool is_prime(uint32_t number) {
    for (uint32_t i = 2; uint64_t(i) * i <= number; ++i)
        if (number % i == 0)
            return false;
    return number > 1;
}

// A number on its own, from as many cells as there are samples; `factor` makes the seed.
float stratified_number(Sample &sample, uint32_t factor) {
    const uint32_t seed = (sample.pixel_seed + sample.dimension++) * factor;
    const uint32_t cell = permute(sample.number, sample.count, seed);
    const float within = sample.within_cell();
    return (float(cell) + within) * (1.0f / float(sample.count));
}

float low_discrepancy_number(Sample &sample) {
    const uint32_t seed = sample.pixel_seed + sample.dimension++;
    const uint32_t number = permute_by_exchanges(sample.number, sample.count, seed);
    return van_der_corput(number, sample_tea_32(sample.pixel_seed, 0x48bc48ebu).first);
}

template <typename DrawPair, typename DrawNumber>
void for_each_sample(const Sampler &sampler, const uint32_t *seeds, const uint32_t *indices,
                     size_t count, uint32_t samples, std::span<const NumberPair> pairs,
                     DrawPair &&draw_pair, DrawNumber &&draw_number) {
    for (size_t i = 0; i < count; ++i) {
        const uint32_t number = indices[i] % samples, first = indices[i] - number;
        const uint32_t own_seed = seeds[i] - sampler.base_seed;
        Sample sample{.number = number,
                      .count = samples,
                      .pixel_seed =
                          sample_tea_32(sampler.base_seed, first + own_seed).first,
                      .random = SampleStreams::Stream{seeds[i], indices[i]}.open(),
                      .jitter = sampler.jitter};
        for (const NumberPair &pair : pairs) {
            if (!pair.y) {
                const float number_alone = draw_number(sample);
                if (pair.x)
                    pair.x[i] = number_alone;
                continue;
            }
            const Vec2f numbers = draw_pair(sample);
            pair.x[i] = numbers.x;
            pair.y[i] = numbers.y;
        }
    }
}

// Two numbers in a row as a pair.
template <typename Number>
auto pair_of(const Number &number) {
    return [number](Sample &sample) -> Vec2f {
        const float x = number(sample);
        return {x, number(sample)};
    };
}

} // namespace

bool takes(SamplerType type, uint32_t samples) {
    const uint32_t side = square_side(samples);
    const bool is_square = side * side == samples;
    switch (type) {
    case SamplerType::independent:
        return samples > 0;
    case SamplerType::stratified:
        return samples > 0 && is_square;
    case SamplerType::multijitter:
        return samples > 0 && samples % grid_rows(samples) == 0;
    case SamplerType::orthogonal:
        return is_square && is_prime(side);
    case SamplerType::ldsampler:
        return is_square && side > 1 && std::has_single_bit(side);
    }
    return false;
}

void draw_spread_numbers(const Sampler &sampler, const uint32_t *seeds,
                         const uint32_t *indices, size_t count, uint32_t samples,
                         std::span<const NumberPair> pairs) {
    const auto draw = [&](auto &&draw_pair, auto &&draw_number) {
        for_each_sample(sampler, seeds, indices, count, samples, pairs, draw_pair,
                        draw_number);
    };
    switch (sampler.type) {
    case SamplerType::independent: {
        const auto number = [](Sample &sample) { return sample.random.next_float(); };
        draw(pair_of(number), number);
        break;
    }
    case SamplerType::stratified:
        draw([side = square_side(samples)](
                 Sample &sample) { return stratified_pair(sample, side); },
             [](Sample &sample) { return stratified_number(sample, 1); });
        break;
    case SamplerType::multijitter: {
        const uint32_t rows = grid_rows(samples);
        draw([rows, columns = samples / rows](
                 Sample &sample) { return multijittered_pair(sample, columns, rows); },
             [](Sample &sample) { return stratified_number(sample, 0x45fbe943u); });
        break;
    }
    case SamplerType::orthogonal: {
        const auto number = [side = square_side(samples)](Sample &sample) {
            return orthogonal_number(sample, side);
        };
        draw(pair_of(number), number);
        break;
    }
    case SamplerType::ldsampler:
        draw(
            [](Sample &sample) -> Vec2f {
                const uint32_t seed = sample.pixel_seed + sample.dimension++;
                const uint32_t number =
                    permute_by_exchanges(sample.number, sample.count, seed);
                const auto [scramble_x, scramble_y] =
                    sample_tea_32(sample.pixel_seed, 0x98bc51abu);
                return {van_der_corput(number, scramble_x),
                        sobol_second(number, scramble_y)};
            },
            low_discrepancy_number);
        break;
    }
}

} // namespace mlrt
