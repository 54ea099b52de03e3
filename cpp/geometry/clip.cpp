#include "geometry/clip.h"

#include "base/check.h"

namespace mlrt {

namespace {

// Sutherland and Hodgman 1974, in double precision, with an error box carried by every
// vertex.
//
// Invariant. There is an exact planar convex polygon E, given by its corners e_1 .. e_n in
// order, with |e_i - q_i| <= error_i in each coordinate for the stored q_i, and E contains
// the exact intersection P of the triangle with the half-spaces handled so far. At first E
// = P is the triangle and all errors are zero.
//
// Step for the half-space {x_k >= s} (the other side by mirroring). A corner is outside if
// q_k + error_k < s, which proves e_k < s. Each edge from a corner a that is not outside to
// a corner b that is gets a new corner e = e_a + t (e_b - e_a), t in [0, 1], with e_k <= s:
// with the upper limits A = q_a + error_a >= s > B = q_b + error_b of the two coordinates,
//     e_k <= (1 - t) A + t B <= s   if   t >= (A - s) / (A - B).
// What is cut off is, for every run of outside corners, the hull of the run and of the two
// new corners beside it. Its coordinates k are below s but for the chord between the new
// corners, which stays in E. So nothing of P and the half-space is lost, no corner of it
// either, whatever the q_i were decided to be. If all corners are outside, the intersection
// is proven empty.
//
// Rounding, u = 2^-53:
// * t: two differences and a quotient, each within a relative u of positive numbers, and
//   one product; the factor 1 + 8u makes the result an upper bound. The least normal
//   number, added for the sake of quotients that underflow, changes no other.
// * new q_j = q_a + t (q_b - q_a): with M = max(|q_a|, |q_b|) the difference is at most
//   2M, and difference and product err by (2u + u^2) t |q_b - q_a| <= 4.1 u M, the sum by
//   u (1 + 8u) M: 5.2 u M in all, on top of the convex combination of the errors of a and
//   b, which is at most the larger one. 8 u M leaves 2.8 u M for the rounding of q + error
//   where it is used (u M). Where q_a = q_b the new coordinate is exact: triangles
//   parallel to a face of the cell stay so to the bit.
constexpr double UNIT = 0x1p-53;
constexpr double UNDERFLOW = std::numeric_limits<double>::min();

struct Corner {
    Vec3d q;
    Vec3d error;

    Corner() {} // left as it is: most corners of a polygon are never used
    Corner(Vec3d q, Vec3d error) : q(q), error(error) {}
};

// A plane adds one corner for each run of outside corners. Runs are separated by corners
// that stay, so n corners become at most n + n / 2. In exact arithmetic it is one run.
constexpr int CAPACITY = 42;
static_assert([] {
    int count = 3;
    for (int plane = 0; plane < 7; ++plane) // those of a cell and one that splits it
        count += count / 2;
    return count;
}() <= CAPACITY);

struct Polygon {
    Corner corners[CAPACITY];
    int count = 0;
};

// Upper limit of the coordinate of `corner` along `axis`, mirrored if Sign is -1.
template <int Sign>
double limit(const Corner &corner, int axis) {
    return Sign * corner.q[axis] + corner.error[axis];
}

Corner interpolate(const Corner &a, const Corner &b, double t) {
    Corner corner;
    for (int j = 0; j < 3; ++j) {
        const double difference = b.q[j] - a.q[j];
        corner.q[j] = a.q[j] + t * difference;
        corner.error[j] = std::max(a.error[j], b.error[j]);
        if (difference != 0) {
            const double magnitude = std::max(std::abs(a.q[j]), std::abs(b.q[j]));
            corner.error[j] += 8 * UNIT * magnitude + UNDERFLOW;
        }
    }
    return corner;
}

// Cuts `in` at {Sign * x[axis] >= Sign * plane} into `out`.
template <int Sign>
void cut(const Polygon &in, Polygon &out, int axis, double plane) {
    const double s = Sign * plane;
    const auto crossing = [&](const Corner &inside, const Corner &outside) {
        const double a = limit<Sign>(inside, axis), b = limit<Sign>(outside, axis);
        const double t = (a - s) / (a - b) * (1 + 8 * UNIT) + UNDERFLOW;
        out.corners[out.count++] = interpolate(inside, outside, std::min(t, 1.0));
    };
    out.count = 0;
    const Corner *previous = &in.corners[in.count - 1];
    double previous_limit = limit<Sign>(*previous, axis);
    for (int i = 0; i < in.count; ++i) {
        const Corner *current = &in.corners[i];
        const double current_limit = limit<Sign>(*current, axis);
        // A corner in the plane is where its edges cross it: no second copy of it.
        if (previous_limit > s && current_limit < s)
            crossing(*previous, *current);
        else if (previous_limit < s && current_limit > s)
            crossing(*current, *previous);
        if (current_limit >= s)
            out.corners[out.count++] = *current;
        previous = current;
        previous_limit = current_limit;
    }
    MLRT_CHECK(out.count <= CAPACITY);
}

template <int Sign>
bool any_outside(const Polygon &polygon, int axis, double plane) {
    for (int i = 0; i < polygon.count; ++i)
        if (limit<Sign>(polygon.corners[i], axis) < Sign * plane)
            return true;
    return false;
}

float round_down(double x) {
    const float rounded = float(x);
    return double(rounded) > x
               ? std::nextafter(rounded, -std::numeric_limits<float>::infinity())
               : rounded;
}

float round_up(double x) {
    return -round_down(-x);
}

bool misses(const Box3f &bounds, const Box3f &cell) {
    for (int k = 0; k < 3; ++k)
        if (bounds.hi[k] < cell.lo[k] || bounds.lo[k] > cell.hi[k])
            return true;
    return false;
}

bool lies_in(const Box3f &bounds, const Box3f &cell) {
    for (int k = 0; k < 3; ++k)
        if (bounds.lo[k] < cell.lo[k] || bounds.hi[k] > cell.hi[k])
            return false;
    return true;
}

// The part of the triangle in the cell, in one of the buffers; null if there is none.
const Polygon *clip_polygon(const Triangle &triangle, const Box3f &cell,
                            Polygon (&buffers)[2]) {
    Polygon *polygon = &buffers[0], *scratch = &buffers[1];
    polygon->count = 3;
    for (int i = 0; i < 3; ++i)
        polygon->corners[i] = {Vec3d(triangle[i]), {}};
    for (int k = 0; k < 3; ++k) {
        if (any_outside<1>(*polygon, k, cell.lo[k])) {
            cut<1>(*polygon, *scratch, k, cell.lo[k]);
            std::swap(polygon, scratch);
        }
        if (any_outside<-1>(*polygon, k, cell.hi[k])) {
            cut<-1>(*polygon, *scratch, k, cell.hi[k]);
            std::swap(polygon, scratch);
        }
        if (polygon->count == 0)
            return nullptr;
    }
    return polygon;
}

// Bounds of the polygon that was cut at the cell's planes, outwards to single precision.
Box3f rounded_bounds(const Polygon &polygon, const Box3f &cell, const Box3f &whole) {
    Box3f bounds;
    for (int k = 0; k < 3; ++k) {
        double lo = std::numeric_limits<double>::infinity(), hi = -lo;
        for (int i = 0; i < polygon.count; ++i) {
            const Corner &corner = polygon.corners[i];
            lo = std::min(lo, corner.q[k] - corner.error[k]);
            hi = std::max(hi, corner.q[k] + corner.error[k]);
        }
        // The exact intersection lies in all three: the computed bounds, the cell, the
        // triangle.
        bounds.lo[k] = std::max({round_down(lo), cell.lo[k], whole.lo[k]});
        bounds.hi[k] = std::min({round_up(hi), cell.hi[k], whole.hi[k]});
        if (bounds.lo[k] > bounds.hi[k])
            return {};
    }
    return bounds;
}

} // namespace

Box3f bounds_of(const Triangle &triangle) {
    Box3f bounds;
    for (int i = 0; i < 3; ++i)
        bounds.add(triangle[i]);
    return bounds;
}

Box3f clip_triangle(const Triangle &triangle, const Box3f &cell) {
    const Box3f whole = bounds_of(triangle);
    if (misses(whole, cell))
        return {};
    if (lies_in(whole, cell))
        return whole;
    Polygon buffers[2];
    const Polygon *polygon = clip_polygon(triangle, cell, buffers);
    return polygon ? rounded_bounds(*polygon, cell, whole) : Box3f{};
}

ClippedHalves clip_to_halves(const Triangle &triangle, const Box3f &cell, int axis,
                             float position) {
    const Box3f whole = bounds_of(triangle);
    if (misses(whole, cell))
        return {};
    Polygon buffers[2], half;
    const Polygon *polygon = clip_polygon(triangle, cell, buffers);
    if (!polygon)
        return {};
    Box3f lower_cell = cell, upper_cell = cell;
    lower_cell.hi[axis] = upper_cell.lo[axis] = position;
    ClippedHalves halves;
    cut<-1>(*polygon, half, axis, position);
    if (half.count > 0)
        halves.lower = rounded_bounds(half, lower_cell, whole);
    cut<1>(*polygon, half, axis, position);
    if (half.count > 0)
        halves.upper = rounded_bounds(half, upper_cell, whole);
    return halves;
}

} // namespace mlrt
