// Bits of AVX-512's mask registers.
#pragma once

#include <cstdint>

namespace mlrt {

template <typename Register>
uint32_t bits_of_register(Register mask) {
#if defined(__AVX512DQ__)
    // GCC 12 reads back four bytes of a mask of one byte that it has put aside on the
    // stack.
    if constexpr (sizeof(Register) == 1) {
        uint32_t bits;
        asm("kmovb %1, %0" : "=r"(bits) : "k"(mask));
        return bits;
    }
#endif
    return mask;
}

} // namespace mlrt
