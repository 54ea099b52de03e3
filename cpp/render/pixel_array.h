// Memory for a picture.
#pragma once

#include <cstddef>
#include <memory>
#include <utility>

namespace mlrt {

// A value for each pixel, or several; not written when it is made, which would take as long
// as to render a small part of the picture.
template <typename T>
class PixelArray {
public:
    PixelArray() = default;
    explicit PixelArray(size_t size)
        : values_(size > 0 ? std::make_unique_for_overwrite<T[]>(size) : nullptr),
          size_(size) {}

    T *data() { return values_.get(); }
    size_t size() const { return size_; }
    std::unique_ptr<T[]> release() { return std::move(values_); }

private:
    std::unique_ptr<T[]> values_;
    size_t size_ = 0;
};

} // namespace mlrt
