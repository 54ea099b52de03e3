// Small fixed-size vectors and boxes: plain data, laid out as they are stored.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace mlrt {

template <typename T>
struct Vec2 {
    T x{}, y{};
};

template <typename T>
struct Vec3 {
    T x{}, y{}, z{};

    constexpr T &operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
    constexpr const T &operator[](int axis) const {
        return axis == 0 ? x : axis == 1 ? y : z;
    }

    template <typename U>
    constexpr explicit operator Vec3<U>() const {
        return {U(x), U(y), U(z)};
    }

    friend constexpr Vec3 operator+(Vec3 a, Vec3 b) {
        return {a.x + b.x, a.y + b.y, a.z + b.z};
    }
    friend constexpr Vec3 operator-(Vec3 a, Vec3 b) {
        return {a.x - b.x, a.y - b.y, a.z - b.z};
    }
    friend constexpr Vec3 operator*(Vec3 a, Vec3 b) {
        return {a.x * b.x, a.y * b.y, a.z * b.z};
    }
    friend constexpr Vec3 operator*(Vec3 a, T s) { return {a.x * s, a.y * s, a.z * s}; }
    friend constexpr Vec3 operator*(T s, Vec3 a) { return a * s; }
    friend constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
    friend constexpr bool operator==(Vec3 a, Vec3 b)
        requires std::is_arithmetic_v<T>
    {
        return a.x == b.x && a.y == b.y && a.z == b.z;
    }
};

// What value_of(axis) gives for each axis.
template <typename ValueOf>
constexpr auto by_axis(ValueOf &&value_of) -> Vec3<std::decay_t<decltype(value_of(0))>> {
    return {value_of(0), value_of(1), value_of(2)};
}

using Vec2f = Vec2<float>;
using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;

template <typename T>
constexpr T dot(Vec3<T> a, Vec3<T> b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <typename T>
constexpr Vec3<T> cross(Vec3<T> a, Vec3<T> b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <typename T>
constexpr Vec3<T> abs(Vec3<T> a) {
    return {a.x < 0 ? -a.x : a.x, a.y < 0 ? -a.y : a.y, a.z < 0 ? -a.z : a.z};
}

template <typename T>
constexpr T max_component(Vec3<T> a) {
    return std::max(a.x, std::max(a.y, a.z));
}

// The number of the component that is the largest in magnitude, the first of equals.
template <typename T>
constexpr int largest_axis(Vec3<T> a) {
    const Vec3<T> size = abs(a);
    return size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
}

template <typename T>
T length(Vec3<T> a) {
    using std::sqrt; // packets bring their own
    return sqrt(dot(a, a));
}

template <typename T>
Vec3<T> normalize(Vec3<T> a) {
    return a * (T(1) / length(a));
}

template <typename T>
bool is_finite(Vec3<T> a) {
    return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

// A closed axis-aligned box; empty (lo > hi) until something is added to it.
struct Box3f {
    Vec3f lo{std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(),
             std::numeric_limits<float>::infinity()};
    Vec3f hi{-std::numeric_limits<float>::infinity(),
             -std::numeric_limits<float>::infinity(),
             -std::numeric_limits<float>::infinity()};

    constexpr bool empty() const { return !(lo.x <= hi.x && lo.y <= hi.y && lo.z <= hi.z); }
    constexpr Vec3f extent() const { return hi - lo; }
    constexpr void add(Vec3f p) {
        for (int k = 0; k < 3; ++k) {
            lo[k] = std::min(lo[k], p[k]);
            hi[k] = std::max(hi[k], p[k]);
        }
    }
    friend constexpr bool operator==(const Box3f &, const Box3f &) = default;
};

} // namespace mlrt
