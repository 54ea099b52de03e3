#include "geometry/cover.h"

#include <bit>

namespace mlrt {

namespace {

using Polygon = std::vector<Vec2d>;

double signed_area(std::span<const Vec2d> p) {
    double sum = 0;
    for (size_t i = 2; i < p.size(); ++i)
        sum += (p[i - 1].x - p[0].x) * (p[i].y - p[0].y) -
               (p[i - 1].y - p[0].y) * (p[i].x - p[0].x);
    return sum / 2;
}

// A triangle cut four times; as in clipping to a cell, a cut leaves at most n + n / 2
// corners.
struct SmallPolygon {
    std::array<Vec2d, 13> corners;
    size_t count = 0;

    size_t size() const { return count; }
    void clear() { count = 0; }
    void push_back(Vec2d p) { corners[count++] = p; }
    const Vec2d &operator[](size_t i) const { return corners[i]; }
    operator std::span<const Vec2d>() const { return {corners.data(), count}; }
};

// The part of a convex polygon where `distance`, an affine function of the point, is >= 0.
template <typename AnyPolygon, typename Distance>
void cut(const AnyPolygon &in, AnyPolygon &out, const Distance &distance) {
    out.clear();
    for (size_t i = 0; i < in.size(); ++i) {
        const Vec2d a = in[i], b = in[i + 1 < in.size() ? i + 1 : 0];
        const double da = distance(a), db = distance(b);
        if (da >= 0)
            out.push_back(a);
        if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
            const double t = da / (da - db);
            out.push_back({a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)});
        }
    }
}

Triangle2 counter_clockwise(Triangle2 t) {
    if (signed_area(t) < 0)
        std::swap(t[1], t[2]);
    return t;
}

// Twice the area of (a, b, p): positive to the left of the edge from a to b.
double left_of(Vec2d a, Vec2d b, Vec2d p) {
    return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
}

bool contains(const Triangle2 &t, const Rectangle &r) {
    for (int k = 0; k < 3; ++k)
        for (Vec2d corner : {r.lo, Vec2d{r.hi.x, r.lo.y}, r.hi, Vec2d{r.lo.x, r.hi.y}})
            if (left_of(t[k], t[(k + 1) % 3], corner) < 0)
                return false;
    return true;
}

bool bounds_overlap(const Triangle2 &t, const Rectangle &r) {
    return std::max({t[0].x, t[1].x, t[2].x}) > r.lo.x &&
           std::min({t[0].x, t[1].x, t[2].x}) < r.hi.x &&
           std::max({t[0].y, t[1].y, t[2].y}) > r.lo.y &&
           std::min({t[0].y, t[1].y, t[2].y}) < r.hi.y;
}

// Takes the triangle out of a convex piece; the convex remains are added to `remains`.
void subtract(const Polygon &piece, const Triangle2 &triangle,
              std::vector<Polygon> &remains) {
    Polygon inside = piece, next, outside;
    const size_t first = remains.size();
    for (int k = 0; k < 3 && !inside.empty(); ++k) {
        const Vec2d a = triangle[k], b = triangle[(k + 1) % 3];
        cut(inside, outside, [&](Vec2d p) { return -left_of(a, b, p); });
        cut(inside, next, [&](Vec2d p) { return left_of(a, b, p); });
        std::swap(inside, next);
        if (signed_area(outside) > 0)
            remains.push_back(outside);
    }
    if (!(signed_area(inside) > 0)) {
        // The two do not overlap: keep the piece whole.
        remains.resize(first);
        remains.push_back(piece);
    }
}

// Halving the rectangle until lists are short keeps the whole near N log N. There are at
// most about 4 N parts, so that triangles that lie on top of each other, whose lists never
// get short, cannot make it go on; the limit of pieces bounds the work on such a part.
// Chosen.
constexpr size_t SUBTRACT_BELOW = 16;
constexpr size_t MAX_PIECES = 512;

double by_subtraction(const Rectangle &r, std::span<const Triangle2> triangles) {
    std::vector<Polygon> pieces{{r.lo, {r.hi.x, r.lo.y}, r.hi, {r.lo.x, r.hi.y}}}, remains;
    for (const Triangle2 &triangle : triangles) {
        remains.clear();
        for (const Polygon &piece : pieces)
            subtract(piece, triangle, remains);
        std::swap(pieces, remains);
        if (pieces.empty())
            return 0;
        if (pieces.size() > MAX_PIECES)
            return area(r);
    }
    double sum = 0;
    for (const Polygon &piece : pieces)
        sum += signed_area(piece);
    return sum;
}

// `triangles` are counter-clockwise.
double uncovered(const Rectangle &r, std::span<const Triangle2> triangles, double enough,
                 int halvings) {
    std::vector<Triangle2> near;
    for (const Triangle2 &triangle : triangles) {
        if (!bounds_overlap(triangle, r))
            continue;
        if (contains(triangle, r))
            return 0;
        near.push_back(triangle);
    }
    if (near.empty())
        return area(r);
    const bool along_x = r.hi.x - r.lo.x >= r.hi.y - r.lo.y;
    const double middle = along_x ? (r.lo.x + r.hi.x) / 2 : (r.lo.y + r.hi.y) / 2;
    const bool splits =
        along_x ? r.lo.x < middle && middle < r.hi.x : r.lo.y < middle && middle < r.hi.y;
    if (near.size() <= SUBTRACT_BELOW || halvings == 0 || !splits)
        return by_subtraction(r, near);
    Rectangle lower = r, upper = r;
    (along_x ? lower.hi.x : lower.hi.y) = middle;
    (along_x ? upper.lo.x : upper.lo.y) = middle;
    const double below = uncovered(lower, near, enough, halvings - 1);
    return below > enough ? below
                          : below + uncovered(upper, near, enough - below, halvings - 1);
}

} // namespace

double area_within(const Triangle2 &triangle, const Rectangle &r) {
    SmallPolygon polygon, next;
    for (Vec2d corner : triangle)
        polygon.push_back(corner);
    cut(polygon, next, [&](Vec2d p) { return p.x - r.lo.x; });
    cut(next, polygon, [&](Vec2d p) { return r.hi.x - p.x; });
    cut(polygon, next, [&](Vec2d p) { return p.y - r.lo.y; });
    cut(next, polygon, [&](Vec2d p) { return r.hi.y - p.y; });
    return std::abs(signed_area(polygon));
}

double uncovered_area(const Rectangle &rectangle, std::span<const Triangle2> triangles,
                      double enough) {
    std::vector<Triangle2> oriented;
    oriented.reserve(triangles.size());
    for (const Triangle2 &triangle : triangles)
        oriented.push_back(counter_clockwise(triangle));
    return uncovered(rectangle, oriented, enough, std::bit_width(triangles.size()) + 1);
}

} // namespace mlrt
