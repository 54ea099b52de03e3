// Arrays of plain data in pages of their own: large ones in huge pages, growing ones in
// place.
#pragma once

#include "base/check.h"

#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>

namespace mlrt {

// Address space that becomes memory where it is written to. Asks for huge pages, so that a
// traversal of a large tree does not spend its time on address translation. Throws
// std::bad_alloc.
void *reserve_pages(uint64_t bytes);
void release_pages(void *pages, uint64_t bytes);

// Memory of any content that begins with a cache line, or with a huge page if it fills one:
// the first write to a page takes as long for a huge one as for a few small ones. Throws
// std::bad_alloc. std::free() frees it.
void *allocate_aligned(uint64_t bytes);

// The first size() of capacity() elements, which never move. Elements that nobody has
// written are zero.
template <typename T>
class HugeArray {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

public:
    HugeArray() = default;
    explicit HugeArray(uint64_t size) : HugeArray(size, size) {}
    HugeArray(uint64_t size, uint64_t capacity)
        : data_(capacity > 0 ? static_cast<T *>(reserve_pages(capacity * sizeof(T)))
                             : nullptr),
          size_(size), capacity_(capacity) {
        MLRT_CHECK(size <= capacity);
    }
    explicit HugeArray(std::span<const T> values) : HugeArray(values.size()) {
        for (uint64_t i = 0; i < size_; ++i)
            data_[i] = values[i];
    }
    HugeArray(HugeArray &&other) noexcept { swap(other); }
    HugeArray &operator=(HugeArray &&other) noexcept {
        HugeArray(std::move(other)).swap(*this);
        return *this;
    }
    ~HugeArray() {
        if (data_)
            release_pages(data_, capacity_ * sizeof(T));
    }

    T *data() { return data_; }
    const T *data() const { return data_; }
    uint64_t size() const { return size_; }
    uint64_t capacity() const { return capacity_; }
    bool empty() const { return size_ == 0; }
    T &operator[](uint64_t i) { return data_[i]; }
    const T &operator[](uint64_t i) const { return data_[i]; }
    T *begin() { return data_; }
    T *end() { return data_ + size_; }
    const T *begin() const { return data_; }
    const T *end() const { return data_ + size_; }

    void set_size(uint64_t size) {
        MLRT_CHECK(size <= capacity_);
        size_ = size;
    }
    uint64_t bytes() const { return size_ * sizeof(T); }

private:
    void swap(HugeArray &other) noexcept {
        std::swap(data_, other.data_);
        std::swap(size_, other.size_);
        std::swap(capacity_, other.capacity_);
    }

    T *data_ = nullptr;
    uint64_t size_ = 0, capacity_ = 0;
};

} // namespace mlrt
