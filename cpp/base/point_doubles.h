// Points and vectors in double precision, each in one register, whose fourth lane does not
// matter.
#pragma once

#include "base/simd.h"
#include "base/vec.h"

namespace mlrt {

using PointDoubles = drjit::Packet<double, 4>;

// From four floats, of which the first three are the point.
inline PointDoubles point_doubles(const float *values) {
    return PointDoubles(load<PointPacket>(values));
}
// From four floats, of which the last three are the point.
inline PointDoubles point_doubles_behind(const float *values) {
    return drjit::shuffle<1, 2, 3, 0>(point_doubles(values));
}

// The two products whose difference is a x b.
struct CrossTerms {
    PointDoubles plus, minus;

    CrossTerms(const PointDoubles &a, const PointDoubles &b) {
        const auto next = [](const PointDoubles &v) {
            return drjit::shuffle<1, 2, 0, 3>(v);
        };
        const auto previous = [](const PointDoubles &v) {
            return drjit::shuffle<2, 0, 1, 3>(v);
        };
        plus = next(a) * previous(b);
        minus = previous(a) * next(b);
    }
};

inline double sum_of_components(const PointDoubles &v) {
    return (v.entry(0) + v.entry(1)) + v.entry(2);
}

} // namespace mlrt
