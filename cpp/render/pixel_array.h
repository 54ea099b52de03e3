// Memory for a picture.
#pragma once

#include "render/picture_memory.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <utility>

namespace mlrt {

struct PixelDelete {
    uint64_t bytes = 0;

    template <typename T>
    void operator()(T *values) const {
        give_back_picture_memory(values, bytes);
    }
};

template <typename T>
using Pixels = std::unique_ptr<T[], PixelDelete>;

// A value for each pixel, or several; not written when it is made, which would take as long
// as to render a small part of the picture. Begins with a cache line, so that rows of tiles
// are whole lines, which can be written past the caches.
template <typename T>
class PixelArray {
    static_assert(std::is_trivially_default_constructible_v<T>);

public:
    PixelArray() = default;
    explicit PixelArray(size_t size)
        : values_(size > 0 ? static_cast<T *>(take_picture_memory(size * sizeof(T)))
                           : nullptr,
                  PixelDelete{size * sizeof(T)}),
          size_(size) {}

    T *data() { return values_.get(); }
    size_t size() const { return size_; }
    Pixels<T> release() { return std::move(values_); }

private:
    Pixels<T> values_;
    size_t size_ = 0;
};

} // namespace mlrt
