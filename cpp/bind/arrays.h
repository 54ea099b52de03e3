// Vectors of the core as NumPy arrays.
#pragma once

#include <initializer_list>
#include <memory>
#include <nanobind/ndarray.h>
#include <vector>

namespace mlrt {

// Hands the values over, without a copy, as an array of T, which they have the
// representation of.
template <typename T, typename Stored>
nanobind::object to_numpy(std::vector<Stored> &&values,
                          std::initializer_list<size_t> shape) {
    static_assert(sizeof(T) == sizeof(Stored));
    auto owned = std::make_unique<std::vector<Stored>>(std::move(values));
    Stored *data = owned->data();
    const nanobind::capsule owner(owned.get(), [](void *p) noexcept {
        const std::unique_ptr<std::vector<Stored>> freed(
            static_cast<std::vector<Stored> *>(p));
    });
    owned.release();
    return nanobind::ndarray<nanobind::numpy, T>(data, shape, owner).cast();
}

template <typename T, typename Delete>
nanobind::object to_numpy(std::unique_ptr<T[], Delete> values,
                          std::initializer_list<size_t> shape) {
    T *data = values.get();
    const nanobind::capsule owner(data, [](void *p) noexcept {
        const std::unique_ptr<T[], Delete> freed(static_cast<T *>(p));
    });
    values.release();
    return nanobind::ndarray<nanobind::numpy, T>(data, shape, owner).cast();
}

} // namespace mlrt
