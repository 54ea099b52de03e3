// What only the tests see of clipping and of the kd-tree's builder.
#include "bind/arrays.h"
#include "bind/bind.h"
#include "bind/build_options.h"
#include "bind/triangle_arrays.h"
#include "geometry/clip.h"
#include "geometry/cover.h"
#include "geometry/degenerate.h"
#include "kdtree/builder.h"
#include "kdtree/lazy.h"
#include "kdtree/sah.h"
#include "kdtree/subtree.h"

#include <memory>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace nb = nanobind;

namespace mlrt {

namespace {

using Point = std::array<float, 3>;

Vec3f vec(const Point &p) {
    return {p[0], p[1], p[2]};
}
Point point(Vec3f v) {
    return {v.x, v.y, v.z};
}

Triangle triangle_of(const std::array<Point, 3> &t) {
    return {vec(t[0]), vec(t[1]), vec(t[2])};
}

template <typename T>
nb::object array_of(std::vector<T> values) {
    const size_t count = values.size();
    return to_numpy<T>(std::move(values), {count});
}

nb::dict build(const TriangleArray &array, const nb::kwargs &kwargs) {
    HugeArray<Triangle> triangles = triangles_of(array);
    const BuildOptions options = build_options_from(kwargs);
    BuiltTree built;
    {
        nb::gil_scoped_release release;
        built = *build_kd_tree(std::move(triangles), options);
        finish_growth(built.tree);
    }
    const KdTree &tree = built.tree;
    // Of a lazy tree, with what has grown behind the part that is built at once.
    size_t n = tree.nodes.size(), reference_count = tree.references.size();
    if (tree.growth) {
        n = tree.growth->state().nodes;
        reference_count = tree.growth->state().references;
    }
    const std::span<const KdNode> nodes(tree.nodes.data(), n);
    std::vector<uint32_t> axis(n), child(n), first(n), count(n);
    std::vector<float> split(n);
    for (size_t i = 0; i < n; ++i) {
        const KdNode node = nodes[i];
        if (node.is_leaf()) {
            axis[i] = KdNode::LEAF;
            first[i] = node.first_reference();
            count[i] = node.reference_count();
        } else {
            axis[i] = uint32_t(node.axis());
            split[i] = node.split();
            child[i] = node.lower_child();
        }
    }
    nb::dict d;
    d["axis"] = array_of(std::move(axis));
    d["split"] = array_of(std::move(split));
    d["child"] = array_of(std::move(child));
    d["first_reference"] = array_of(std::move(first));
    d["count"] = array_of(std::move(count));
    d["references"] = array_of(std::vector<uint32_t>(
        tree.references.data(), tree.references.data() + reference_count));
    d["lo"] = point(tree.bounds.lo);
    d["hi"] = point(tree.bounds.hi);
    d["depth"] = tree.depth;
    d["report"] = report_to_dict(built.report);
    return d;
}

std::optional<std::pair<Point, Point>> clip(const std::array<Point, 3> &triangle,
                                            const Point &lo, const Point &hi) {
    const Box3f bounds = clip_triangle(triangle_of(triangle), {vec(lo), vec(hi)});
    if (bounds.empty())
        return std::nullopt;
    return std::pair{point(bounds.lo), point(bounds.hi)};
}

double split_cost(const Point &lo, const Point &hi, int axis, float position,
                  uint64_t lower_count, uint64_t upper_count, const nb::kwargs &kwargs) {
    return SplitCost(build_options_from(kwargs), {vec(lo), vec(hi)},
                     axis)(position, lower_count, upper_count);
}

double uncovered(const std::array<double, 4> &rectangle,
                 const std::vector<std::array<std::array<double, 2>, 3>> &triangles) {
    std::vector<Triangle2> flat;
    for (const auto &t : triangles)
        flat.push_back({{{t[0][0], t[0][1]}, {t[1][0], t[1][1]}, {t[2][0], t[2][1]}}});
    return uncovered_area({{rectangle[0], rectangle[1]}, {rectangle[2], rectangle[3]}},
                          flat, std::numeric_limits<double>::infinity());
}

} // namespace

void bind_kdtree_selftest(nb::module_ &m) {
    nb::module_ s = m.def_submodule("kdtree_selftest");
    s.def("build", &build, nb::arg("triangles"), nb::arg("options"));
    s.def("clip_triangle", &clip);
    s.def("is_degenerate",
          [](const std::array<Point, 3> &t) { return is_degenerate(triangle_of(t)); });
    s.def("split_cost", &split_cost, nb::arg("lo"), nb::arg("hi"), nb::arg("axis"),
          nb::arg("position"), nb::arg("lower_count"), nb::arg("upper_count"),
          nb::arg("options"));
    s.def("uncovered_area", &uncovered);
    s.def("check_tree_size", &check_tree_size, nb::arg("node_count"),
          nb::arg("reference_count"));
    s.attr("max_tree_depth") = MAX_TREE_DEPTH;
}

} // namespace mlrt
