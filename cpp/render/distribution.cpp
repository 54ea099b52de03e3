#include "render/distribution.h"

#include <algorithm>

namespace mlrt {

Distribution::Distribution(std::span<const float> weights)
    : weights_(weights.begin(), weights.end()), cumulative_(weights.size()) {
    double sum = 0;
    bool any = false;
    for (uint32_t i = 0; i < weights_.size(); ++i) {
        sum += weights_[i];
        cumulative_[i] = float(sum);
        if (weights_[i] > 0) {
            first_ = any ? first_ : i;
            last_ = i;
            any = true;
        }
    }
    sum_ = float(sum);
    normalization_ = any ? 1.0f / sum_ : 0.0f;
}

Distribution::Choice Distribution::choose(float random) const {
    const float target = random * sum_;
    const auto begin = cumulative_.begin();
    const auto found = std::lower_bound(begin + first_, begin + last_, target);
    const uint32_t index = uint32_t(found - begin);
    const float probability = weights_[index] * normalization_;
    const float before = index > 0 ? cumulative_[index - 1] * normalization_ : 0.0f;
    return {index, (random - before) / probability, probability};
}

Distribution::Choices Distribution::choose(const FloatPacket &random) const {
    constexpr uint32_t FEW = 16; // chosen
    return last_ - first_ < FEW ? choose_by_comparing_all(random)
                                : choose_by_bisection(random);
}

// The first entry that is not less than the target is as many behind the first as are less:
// where one is, the next takes its place.
Distribution::Choices
Distribution::choose_by_comparing_all(const FloatPacket &random) const {
    const FloatPacket target = random * sum_;
    const auto before = [&](uint32_t i) {
        return FloatPacket(i > 0 ? cumulative_[i - 1] * normalization_ : 0.0f);
    };
    UIntPacket index(first_);
    FloatPacket probability(weights_[first_] * normalization_), start = before(first_);
    for (uint32_t i = first_; i < last_; ++i) {
        const LaneBits less = to_bits(FloatPacket(cumulative_[i]) < target);
        const auto beyond = from_bits<FloatPacket>(less);
        index = select(from_bits<UIntPacket>(less), UIntPacket(i + 1), index);
        probability =
            select(beyond, FloatPacket(weights_[i + 1] * normalization_), probability);
        start = select(beyond, before(i + 1), start);
    }
    return {index, start, probability};
}

// All lanes halve their ranges of entries in step, without branches.
Distribution::Choices Distribution::choose_by_bisection(const FloatPacket &random) const {
    const float *cumulative = cumulative_.data();
    const FloatPacket target = random * sum_;
    UIntPacket index(first_);
    const auto skip_if_less = [&](uint32_t count) {
        const UIntPacket last_skipped = index + UIntPacket(count - 1);
        const LaneBits less = to_bits(gather(cumulative, last_skipped) < target);
        index = select(from_bits<UIntPacket>(less), index + UIntPacket(count), index);
    };
    uint32_t length = last_ - first_;
    for (; length > 1; length -= length / 2)
        skip_if_less(length / 2);
    if (length == 1)
        skip_if_less(1);
    const FloatPacket probability = gather(weights_.data(), index) * normalization_;
    const LaneBits is_first = to_bits(index == UIntPacket(0u));
    const UIntPacket previous =
        select(from_bits<UIntPacket>(is_first), index, index - UIntPacket(1u));
    const FloatPacket start = select(from_bits<FloatPacket>(is_first), FloatPacket(0.0f),
                                     gather(cumulative, previous) * normalization_);
    return {index, start, probability};
}

} // namespace mlrt
