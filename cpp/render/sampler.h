// The random numbers of Mitsuba's `independent` sampler, as its vectorised variants draw
// them. Equal seeds give equal samples there and here, hence equal noise.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <utility>

namespace mlrt {

// Rounds of the Tiny Encryption Algorithm as a hash of two words (Zafar, Olano and
// Curtis 2010, "GPU random numbers via the Tiny Encryption Algorithm", listing 1).
inline std::pair<uint32_t, uint32_t> sample_tea_32(uint32_t v0, uint32_t v1,
                                                   int rounds = 4) {
    uint32_t sum = 0;
    for (int round = 0; round < rounds; ++round) {
        sum += 0x9e3779b9u;
        v0 += ((v1 << 4) + 0xa341316cu) ^ (v1 + sum) ^ ((v1 >> 5) + 0xc8013ea4u);
        v1 += ((v0 << 4) + 0xad90777du) ^ (v0 + sum) ^ ((v0 >> 5) + 0x7e95761eu);
    }
    return {v0, v1};
}

// PCG32 (O'Neill 2014, "PCG: a family of simple fast space-efficient statistically good
// algorithms for random number generation", XSH-RR variant).
class Pcg32 {
public:
    Pcg32(uint64_t initial_state, uint64_t stream) : increment_((stream << 1) | 1u) {
        next_uint32();
        state_ += initial_state;
        next_uint32();
    }

    uint32_t next_uint32() {
        const uint64_t old = state_;
        state_ = old * 0x5851f42d4c957f2dull + increment_;
        return std::rotr(uint32_t(((old >> 18) ^ old) >> 27), int(old >> 59));
    }

    // Uniform in [0, 1): 23 random bits as the mantissa of a number in [1, 2).
    float next_float() {
        return std::bit_cast<float>((next_uint32() >> 9) | 0x3f800000u) - 1.0f;
    }

private:
    uint64_t state_ = 0;
    uint64_t increment_;
};

// Which stream a sample of a pixel draws from. Mitsuba numbers the samples of one pass
// through pixel * samples + sample in 32 bits, and renders several passes if they do not
// suffice.
//
// The first pass equals Mitsuba's. Mitsuba goes on in the streams of the first pass for the
// next one, which would mean to know how many numbers each path has used; here every pass
// has a seed of its own.
class SampleStreams {
public:
    SampleStreams(uint32_t seed, uint32_t pixel_count, uint32_t samples_per_pixel)
        : seed_(seed), samples_per_pixel_(samples_per_pixel),
          samples_per_pass_(samples_per_pixel) {
        const uint64_t limit = 0xffffffffu;
        const uint64_t total = uint64_t(pixel_count) * samples_per_pixel;
        if (total > limit) {
            const uint64_t passes = (total + limit - 1) / limit;
            samples_per_pass_ = uint32_t(samples_per_pixel / passes);
            if (samples_per_pass_ == 0)
                samples_per_pass_ = 1;
        }
    }

    uint32_t samples_per_pixel() const { return samples_per_pixel_; }
    bool in_one_pass() const { return samples_per_pass_ == samples_per_pixel_; }

    struct Stream {
        uint32_t seed, index;

        Pcg32 open() const {
            const auto [state, sequence] = sample_tea_32(seed, index);
            return Pcg32(state, sequence);
        }
    };

    Stream stream(uint32_t pixel, uint32_t sample) const {
        const uint32_t pass = sample / samples_per_pass_;
        return {seed_ + pass * 0x9e3779b9u,
                pixel * samples_per_pass_ + sample % samples_per_pass_};
    }

    // The streams of consecutive samples of a pixel.
    void streams(uint32_t pixel, uint32_t first_sample, uint32_t count, uint32_t *seeds,
                 uint32_t *indices) const {
        for (uint32_t done = 0; done < count;) {
            const Stream first = stream(pixel, first_sample + done);
            const uint32_t left_in_pass =
                samples_per_pass_ - (first_sample + done) % samples_per_pass_;
            const uint32_t run = std::min(count - done, left_in_pass);
            for (uint32_t i = 0; i < run; ++i) {
                seeds[done + i] = first.seed;
                indices[done + i] = first.index + i;
            }
            done += run;
        }
    }

private:
    uint32_t seed_;
    uint32_t samples_per_pixel_, samples_per_pass_;
};

// Where two numbers in [0, 1) of each sample go. Without y a single number is drawn, and
// dropped if x is null too.
struct NumberPair {
    float *x = nullptr, *y = nullptr;
};

} // namespace mlrt
