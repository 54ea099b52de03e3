// Vectors of the core as NumPy arrays.
#pragma once

#include <initializer_list>
#include <memory>
#include <nanobind/ndarray.h>
#include <utility>
#include <vector>

namespace mlrt {

// An array of the data, which lives as long as the owner, and that as long as the array.
template <typename T, typename Owner>
nanobind::object owned_array(T *data, Owner &&values, std::initializer_list<size_t> shape) {
    auto owned = std::make_unique<Owner>(std::move(values));
    const nanobind::capsule owner(owned.get(), [](void *p) noexcept {
        const std::unique_ptr<Owner> freed(static_cast<Owner *>(p));
    });
    owned.release();
    return nanobind::ndarray<nanobind::numpy, T>(data, shape, owner).cast();
}

// Hands the values over, without a copy, as an array of T, which they have the
// representation of.
template <typename T, typename Stored>
nanobind::object to_numpy(std::vector<Stored> &&values,
                          std::initializer_list<size_t> shape) {
    static_assert(sizeof(T) == sizeof(Stored));
    auto *data = reinterpret_cast<T *>(values.data());
    return owned_array(data, std::move(values), shape);
}

template <typename T, typename Delete>
nanobind::object to_numpy(std::unique_ptr<T[], Delete> values,
                          std::initializer_list<size_t> shape) {
    return owned_array(values.get(), std::move(values), shape);
}

} // namespace mlrt
