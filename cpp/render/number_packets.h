// The generator of sampler.h for sixteen streams side by side: the same numbers.
#pragma once

#include "base/word_pairs.h"
#include "render/sampler.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace mlrt {

// sample_tea_32 of four rounds.
[[gnu::always_inline]] inline void mix_words(UIntPacket &v0, UIntPacket &v1) {
    const auto mixed = [](const UIntPacket &v, uint32_t left, uint32_t sum,
                          uint32_t right) {
        return (shifted_left<4>(v) + left) ^ (v + sum) ^ (shifted_right<5>(v) + right);
    };
    uint32_t sum = 0;
    for (int round = 0; round < 4; ++round) {
        sum += 0x9e3779b9u;
        v0 += mixed(v1, 0xa341316cu, sum, 0xc8013ea4u);
        v1 += mixed(v0, 0xad90777du, sum, 0x7e95761eu);
    }
}

class Pcg32Packet {
public:
    Pcg32Packet(UIntPacket seeds, UIntPacket indices) {
        mix_words(seeds, indices);
        const LongPacket stream = LongPacket(indices);
        increment_ = stream + (stream + LongPacket(1u));
        state_ = LongPacket(seeds) + increment_;
    }

    FloatPacket next_float() {
        state_ = state_ * LongPacket(0x5851f42d4c957f2dull) + increment_;
        const UIntPacket high = high_words(state_), low = low_words(state_);
        // The lower half of ((state >> 18) ^ state) >> 27.
        const UIntPacket bits =
            (shifted_left<5>(high) | shifted_right<27>(low)) ^ shifted_right<13>(high);
        return unit_floats(rotate_right(bits, shifted_right<27>(high)));
    }

private:
    LongPacket state_, increment_; // the state before the one that makes the next number
};

// The numbers of samples, of whole packets, pair by pair.
inline void draw_numbers(const uint32_t *seeds, const uint32_t *indices, size_t count,
                         std::span<const NumberPair> pairs) {
    size_t i = 0;
    // So many packets at a time: one is a chain of operations that wait for each other.
    const auto draw = [&]<size_t... Packets>(std::index_sequence<Packets...>) {
        constexpr size_t COUNT = sizeof...(Packets);
        std::array<Pcg32Packet, COUNT> random{
            Pcg32Packet(load<UIntPacket>(seeds + i + Packets * PACKET_WIDTH),
                        load<UIntPacket>(indices + i + Packets * PACKET_WIDTH))...};
        const auto write = [&](float *numbers) {
            const std::array<FloatPacket, COUNT> next{random[Packets].next_float()...};
            if (numbers)
                (store(numbers + i + Packets * PACKET_WIDTH, next[Packets]), ...);
        };
        for (const NumberPair &pair : pairs) {
            write(pair.x);
            if (pair.y)
                write(pair.y);
        }
        i += COUNT * PACKET_WIDTH;
    };
    while (i + PACKET_WIDTH < count)
        draw(std::make_index_sequence<2>());
    if (i < count)
        draw(std::make_index_sequence<1>());
}

} // namespace mlrt
