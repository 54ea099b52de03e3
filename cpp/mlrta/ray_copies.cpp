#include "mlrta/ray_copies.h"

#include "base/simd.h"

#include <algorithm>

namespace mlrt {

namespace {

// Sixteen numbers from `first` on; behind the last one that is repeated.
UIntPacket load_numbers(std::span<const uint32_t> numbers, size_t first) {
    if (first + PACKET_WIDTH <= numbers.size())
        return load<UIntPacket>(&numbers[first]);
    LaneArray<uint32_t> padded;
    padded.fill(numbers.back());
    std::copy(numbers.begin() + std::ptrdiff_t(first), numbers.end(), padded.begin());
    return load<UIntPacket>(padded);
}

} // namespace

RayGroup copy_rays(const RayGroup &rays, std::span<const uint32_t> numbers,
                   const RayColumns &to) {
    RayGroup copies = rays;
    copies.count = uint32_t(numbers.size());
    copies.cost = nullptr;
    const float *const t_min = rays.t_min.each(), *const t_max = rays.t_max.each();
    for (size_t i = 0; i < numbers.size(); i += PACKET_WIDTH) {
        const UIntPacket from = load_numbers(numbers, i);
        for (int k = 0; k < 3; ++k) {
            store(to.direction[k] + i, gather(rays.direction[k], from));
            if (!rays.has_common_origin)
                store(to.origin[k] + i, gather(rays.origin[k], from));
        }
        if (t_min)
            store(to.t_min + i, gather(t_min, from));
        if (t_max)
            store(to.t_max + i, gather(t_max, from));
    }
    for (int k = 0; k < 3; ++k) {
        copies.direction[k] = to.direction[k];
        copies.origin[k] = rays.has_common_origin ? nullptr : to.origin[k];
    }
    if (t_min)
        copies.t_min = IntervalEnds(to.t_min);
    if (t_max)
        copies.t_max = IntervalEnds(to.t_max);
    return copies;
}

} // namespace mlrt
