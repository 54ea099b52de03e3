// The run of faces that have something which most lack: whether any of a packet does is
// known from their numbers.
#pragma once

#include "base/simd.h"
#include "render/scene.h"

#include <algorithm>

namespace mlrt {

struct FaceRange {
    uint32_t first = NONE, end = 0; // that is not included

    void add(const Shape &shape) {
        first = std::min(first, shape.first_face);
        end = std::max(end, shape.first_face + shape.face_count);
    }

    // Lanes whose face may be one: others are none.
    LaneBits lanes_of(const UIntPacket &faces) const {
        return to_bits((faces >= UIntPacket(first)) & (faces < UIntPacket(end)));
    }
};

} // namespace mlrt
