// Memory of pictures that nobody has any more, kept for the next ones: to get pages from
// the system, which clears them, takes as long as to render a part of a picture.
#pragma once

#include <cstdint>

namespace mlrt {

// All that is kept at most: what was given back longest ago is freed first. Chosen: five
// pictures of a million pixels.
inline constexpr uint64_t MOST_KEPT_PICTURE_BYTES = uint64_t(64) << 20;

// Memory of any content, such as an earlier picture, aligned as that of allocate_aligned().
// Throws std::bad_alloc. Any thread may call this and the other function.
void *take_picture_memory(uint64_t bytes);

// Keeps it for a picture of the same size. `bytes` are those that were asked for.
void give_back_picture_memory(void *memory, uint64_t bytes) noexcept;

// What is kept now.
uint64_t kept_picture_bytes();

} // namespace mlrt
