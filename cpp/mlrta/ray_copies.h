// Copies of rays of a group, in an order of their own.
#pragma once

#include "traverse/ray_group.h"

#include <cstdint>
#include <span>

namespace mlrt {

// Where the copies go: each array has room for all of them, in whole packets. Of origins
// and ends of intervals only those are needed that differ between the rays.
struct RayColumns {
    float *origin[3]{}, *direction[3]{}, *t_min = nullptr, *t_max = nullptr;
};

// Copies the rays with the given numbers and returns them as a group, whose costs nobody
// asks for.
RayGroup copy_rays(const RayGroup &rays, std::span<const uint32_t> numbers,
                   const RayColumns &to);

} // namespace mlrt
