#include "mlrta/shaft.h"

#include "geometry/triangle_test.h"

#include <algorithm>
#include <array>
#include <limits>

namespace mlrt {

namespace {

// Covers a handful of roundings of terms that are bounded each, many times over.
constexpr double ERROR = 0x1p-46;

// A plane that no lane needs.
constexpr double NOWHERE = std::numeric_limits<double>::infinity();

// Least and greatest value of normal.(x - p) in a box.
struct Extremes {
    double lo = 0, hi = 0;

    Extremes(const Vec3d &normal, const Vec3d &p, const Box3f &box) {
        for (int k = 0; k < 3; ++k) {
            const double a = normal[k] * (double(box.lo[k]) - p[k]);
            const double b = normal[k] * (double(box.hi[k]) - p[k]);
            lo += std::min(a, b);
            hi += std::max(a, b);
        }
    }
};

} // namespace

// Seen along an axis the hull is that of two rectangles. Where an edge of it goes from a
// corner of one to a corner of the other, these are the same corners, those farthest along
// the signs of the edge's outward normal. Few hulls have more than eight such planes, and
// can do without the rest.
Shaft::Shaft(const Box3f &begin, const Box3f &end, float reach)
    : begin_(begin), end_(end), bounds_(begin), reach_(reach) {
    bounds_.add(end.lo);
    bounds_.add(end.hi);
    std::array<std::array<double, BLOCK_WIDTH>, 3> normal{};
    std::array<double, BLOCK_WIDTH> offset;
    offset.fill(NOWHERE);
    uint32_t count = 0;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        for (int corner = 0; corner < 4 && count < BLOCK_WIDTH; ++corner) {
            const bool upper_i = corner & 1, upper_j = corner & 2;
            const Vec2<double> from{(upper_i ? begin.hi : begin.lo)[i],
                                    (upper_j ? begin.hi : begin.lo)[j]};
            const Vec2<double> to{(upper_i ? end.hi : end.lo)[i],
                                  (upper_j ? end.hi : end.lo)[j]};
            const Vec2<double> along{to.x - from.x, to.y - from.y};
            Vec2<double> outward{along.y, -along.x};
            if ((outward.x > 0) != upper_i)
                outward = {-outward.x, -outward.y};
            if (outward.x == 0 || outward.y == 0 || (outward.x > 0) != upper_i ||
                (outward.y > 0) != upper_j)
                continue;
            normal[i][count] = outward.x;
            normal[j][count] = outward.y;
            offset[count] = outward.x * from.x + outward.y * from.y +
                            ERROR * reach_ * (std::abs(outward.x) + std::abs(outward.y));
            ++count;
        }
    }
    for (int k = 0; k < 3; ++k)
        normal_[k] = load<DoubleBlock>(normal[k].data());
    offset_ = load<DoubleBlock>(offset.data());
}

bool Shaft::misses(const Box3f &box) const {
    DoubleBlock innermost(0.0);
    for (int k = 0; k < 3; ++k)
        innermost = innermost + minimum(normal_[k] * DoubleBlock(double(box.lo[k])),
                                        normal_[k] * DoubleBlock(double(box.hi[k])));
    return any_lane(innermost > offset_);
}

bool Shaft::misses(const Triangle &triangle) const {
    for (int k = 0; k < 3; ++k) {
        const float a = triangle.a[k], b = triangle.b[k], c = triangle.c[k];
        if (std::min({a, b, c}) > bounds_.hi[k] || std::max({a, b, c}) < bounds_.lo[k])
            return true;
    }
    const auto along_normals = [&](const Vec3f &p) {
        return normal_.x * DoubleBlock(double(p.x)) + normal_.y * DoubleBlock(double(p.y)) +
               normal_.z * DoubleBlock(double(p.z));
    };
    const DoubleBlock innermost =
        minimum(along_normals(triangle.a),
                minimum(along_normals(triangle.b), along_normals(triangle.c)));
    return any_lane(innermost > offset_) || is_beside_plane(triangle);
}

bool Shaft::is_beside_plane(const Triangle &triangle) const {
    const TrianglePlane plane(triangle);
    const Vec3d a(triangle.a);
    const Extremes begin(plane.normal, a, begin_), end(plane.normal, a, end_);
    const double error =
        ERROR * reach_ * (plane.magnitude.x + plane.magnitude.y + plane.magnitude.z);
    return std::min(begin.lo, end.lo) > error || std::max(begin.hi, end.hi) < -error;
}

} // namespace mlrt
