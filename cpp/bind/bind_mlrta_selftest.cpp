// What the tests ask of single components of the tracer: decisions, beams, culling, entry
// points.
#include "base/denormals.h"
#include "bind/bind.h"
#include "bind/trace_options.h"
#include "bind/tree_handle.h"
#include "geometry/triangle_test.h"
#include "mlrta/frontier.h"
#include "mlrta/ray_lines.h"
#include "mlrta/tile.h"

#include <map>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/set.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>
#include <numeric>
#include <optional>
#include <set>
#include <tuple>
#include <vector>

namespace nb = nanobind;

namespace mlrt {

namespace {

using Point = std::array<float, 3>;
using Points = nb::ndarray<const float, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Values = nb::ndarray<const float, nb::shape<-1>, nb::c_contig, nb::device::cpu>;

Vec3f vec(const Point &p) {
    return {p[0], p[1], p[2]};
}
Triangle triangle_of(const std::array<Point, 3> &t) {
    return {vec(t[0]), vec(t[1]), vec(t[2])};
}
Box3f box(const Point &lo, const Point &hi) {
    return {vec(lo), vec(hi)};
}
std::pair<double, double> pair(const Range &r) {
    return {r.lo, r.hi};
}

Beam beam_of_rays(const Points &origins, const Points &directions, const Values &t_min,
                  const Values &t_max, bool common_origin) {
    const uint32_t count = uint32_t(origins.shape(0));
    std::array<std::vector<float>, 3> o, d;
    RayGroup group;
    group.count = count;
    group.has_common_origin = common_origin;
    for (int k = 0; k < 3; ++k) {
        for (uint32_t i = 0; i < count; ++i) {
            o[k].push_back(origins(i, size_t(k)));
            d[k].push_back(directions(i, size_t(k)));
        }
        group.origin[k] = o[k].data();
        group.direction[k] = d[k].data();
        group.common_origin[k] = count > 0 ? o[k][0] : 0;
    }
    group.t_min = IntervalEnds(t_min.data());
    group.t_max = IntervalEnds(t_max.data());
    KeepDenormals keep;
    return ray_beam(group, 0, count);
}

// The search with every decision of the beam looked up in tables: the tests replay the
// figures of the literature with it.
struct TableJudge {
    struct Cell {};

    const std::set<uint32_t> &culled;
    const std::set<uint32_t> &impossible;
    std::vector<uint32_t> visited;

    bool knows(const Box3f &) const { return true; }
    Cell start(const Box3f &) const { return {}; }
    Cell child(Cell, KdNode, bool) const { return {}; }
    void visit(uint32_t node) { visited.push_back(node); }
    Sides sides(uint32_t, KdNode node, Cell) const {
        return {!culled.contains(node.lower_child()),
                !culled.contains(node.lower_child() + 1), false};
    }
    bool possible(uint32_t leaf, KdNode, Cell) const { return !impossible.contains(leaf); }
    void found(uint32_t, KdNode) const {}
    bool found_blocker() const { return false; }
    bool reaches(Cell) const { return true; }
};

// Children: inner nodes and their lower child; other nodes are leaves, empty or of one
// reference.
std::pair<std::optional<uint32_t>, std::vector<uint32_t>>
search_table(uint32_t node_count, const std::map<uint32_t, uint32_t> &children,
             const std::set<uint32_t> &empty_leaves, const std::set<uint32_t> &culled,
             const std::set<uint32_t> &impossible, bool shallow_first) {
    std::vector<KdNode> nodes;
    for (uint32_t i = 0; i < node_count; ++i)
        nodes.push_back(children.contains(i) ? KdNode::inner(0, 0.5f, children.at(i))
                                             : KdNode::leaf(0, !empty_leaves.contains(i)));
    TableJudge judge{culled, impossible, {}};
    const auto entry =
        search_entry_point(nodes, Entry{0, {{0, 0, 0}, {1, 1, 1}}}, judge,
                           shallow_first ? SearchOrder::shallow_first : SearchOrder::paper);
    return {entry ? std::optional(entry->node) : std::nullopt, judge.visited};
}

std::optional<uint32_t> entry_point(const TreeHandle &handle, const Beam &beam,
                                    const nb::dict &options) {
    const TraceOptions trace_options = trace_options_from(options);
    Counters counters;
    BeamJudge judge(*handle.tree, beam, trace_options, counters);
    const auto entry = search_entry_point(handle.tree->nodes, root_entry(*handle.tree),
                                          judge, trace_options.search_order);
    return entry ? std::optional(entry->node) : std::nullopt;
}

// (node, lower corner, upper corner, earliest hit) of the entries.
std::vector<std::tuple<uint32_t, Point, Point, float>>
frontier_of(const TreeHandle &handle, const Beam &beam, uint32_t capacity,
            const nb::dict &options) {
    const TraceOptions trace_options = trace_options_from(options);
    Counters counters;
    BeamJudge judge(*handle.tree, beam, trace_options, counters);
    const Frontier frontier =
        search_frontier(handle.tree->nodes, Frontier(root_entry(*handle.tree)), capacity,
                        judge, trace_options.search_order);
    std::vector<std::tuple<uint32_t, Point, Point, float>> entries;
    for (uint32_t i = 0; i < frontier.count; ++i) {
        const auto &[node, cell] = frontier.entries[i];
        entries.emplace_back(node, Point{cell.lo.x, cell.lo.y, cell.lo.z},
                             Point{cell.hi.x, cell.hi.y, cell.hi.z},
                             frontier.earliest_hit[i]);
    }
    return entries;
}

// Searches an entry point for each beam, `rounds` times over.
Counters search_all(const TreeHandle &handle, const std::vector<Beam> &beams,
                    const nb::dict &options, uint32_t rounds) {
    const TraceOptions trace_options = trace_options_from(options);
    const Entry root = root_entry(*handle.tree);
    Counters counters;
    for (uint32_t round = 0; round < rounds; ++round)
        for (const Beam &beam : beams) {
            BeamJudge judge(*handle.tree, beam, trace_options, counters);
            counters.tiles += 1;
            counters.missed_tiles += !search_entry_point(handle.tree->nodes, root, judge,
                                                         trace_options.search_order)
                                          .has_value();
        }
    return counters;
}

// (axis, split, lower child) of inner nodes and (3, number of references, 0) of leaves.
std::vector<std::tuple<int, float, uint32_t>> nodes_of(const TreeHandle &handle) {
    std::vector<std::tuple<int, float, uint32_t>> result;
    for (const KdNode &node : handle.tree->nodes)
        if (node.is_leaf())
            result.emplace_back(3, float(node.reference_count()), 0u);
        else
            result.emplace_back(node.axis(), node.split(), node.lower_child());
    return result;
}

const char *name_of(const Sides &sides) {
    return sides.near ? (sides.far ? "both" : "near_only")
                      : (sides.far ? "far_only" : "neither");
}

void bind_beam(nb::module_ &s) {
    nb::class_<Beam>(s, "Beam")
        .def_prop_ro("origin",
                     [](const Beam &b) {
                         return std::array{pair(b.origin[0]), pair(b.origin[1]),
                                           pair(b.origin[2])};
                     })
        .def_prop_ro("heading",
                     [](const Beam &b) {
                         return std::array{int(b.heading[0]), int(b.heading[1]),
                                           int(b.heading[2])};
                     })
        .def("slope", [](const Beam &b, size_t k, size_t j) { return pair(b.slope[k][j]); })
        .def("reciprocal", [](const Beam &b, size_t k) { return pair(b.reciprocal[k]); })
        .def_ro("t_min", &Beam::t_min)
        .def_ro("t_max", &Beam::t_max)
        .def_ro("has_planes", &Beam::has_planes)
        .def_ro("plane_slack", &Beam::plane_slack)
        .def_prop_ro("plane_normals", [](const Beam &b) {
            std::vector<std::array<double, 3>> normals;
            for (const Vec3d &n : b.plane_normals)
                normals.push_back({n.x, n.y, n.z});
            return normals;
        });
    s.def("ray_beam", &beam_of_rays, nb::arg("origins"), nb::arg("directions"),
          nb::arg("t_min"), nb::arg("t_max"), nb::arg("common_origin"));
    s.def(
        "camera_beam",
        [](const Point &origin, const Point &base, const Point &dx, const Point &dy,
           double x0, double x1, double y0, double y1, double t_max, double t_min) {
            return camera_beam({vec(origin), vec(base), vec(dx), vec(dy)}, x0, x1, y0, y1,
                               t_min, t_max);
        },
        nb::arg("origin"), nb::arg("base"), nb::arg("dx"), nb::arg("dy"), nb::arg("x0"),
        nb::arg("x1"), nb::arg("y0"), nb::arg("y1"), nb::arg("t_max"),
        nb::arg("t_min") = 0.0);
    s.def(
        "tile_beam",
        [](const Point &origin, const Point &base, const Point &dx, const Point &dy,
           const std::array<uint32_t, 4> &tile, uint32_t first, uint32_t count,
           double t_max) -> std::optional<Beam> {
            const auto [x, y, size, samples] = tile;
            Beam beam;
            if (!tile_beam(
                    {{vec(origin), vec(base), vec(dx), vec(dy)}, x, y, size, samples},
                    first, count, 0, t_max, beam))
                return std::nullopt;
            return beam;
        },
        nb::arg("origin"), nb::arg("base"), nb::arg("dx"), nb::arg("dy"), nb::arg("tile"),
        nb::arg("first"), nb::arg("count"), nb::arg("t_max"),
        "Beam of a run of rays of the tile (x, y, size, samples), None if it is no "
        "rectangle.");
    s.def(
        "covered_until",
        [](const Beam &beam, const std::array<Point, 3> &triangle) {
            return covered_until(beam, triangle_of(triangle));
        },
        "Bound of t if the triangle is certain to stop all rays of the beam, else None.");
    s.def("cull_children",
          [](const Beam &beam, const Point &lo, const Point &hi, int axis, float position) {
              const InverseFrustum frustum(beam);
              return name_of(frustum.sides(frustum.inside(box(lo, hi)), {axis, position}));
          });
    s.def("upper_is_near", [](const Beam &beam, int axis, float position) {
        return InverseFrustum(beam).upper_is_near({axis, position});
    });
    s.def("may_enter_by_parameters",
          [](const Beam &beam, const Point &lo, const Point &hi) {
              const InverseFrustum frustum(beam);
              return frustum.may_enter_by_parameters(frustum.inside(box(lo, hi)));
          });
    s.def("may_enter_by_slopes", [](const Beam &beam, const Point &lo, const Point &hi) {
        const InverseFrustum frustum(beam);
        return frustum.may_enter_by_slopes(frustum.inside(box(lo, hi)));
    });
    s.def("may_enter_by_planes", [](const Beam &beam, const Point &lo, const Point &hi) {
        return may_enter_by_planes(beam, InverseFrustum(beam).inside(box(lo, hi)));
    });
}

void bind_triangle_test(nb::module_ &s) {
    s.def(
        "decide_hit",
        [](const Point &origin, const Point &direction,
           const std::array<Point, 3> &triangle) {
            const HitDecision decision =
                decide_hit(vec(origin), vec(direction), triangle_of(triangle));
            return std::pair(decision.hit, decision.precision == Precision::exact);
        },
        "Whether the ray's line hits the triangle, and whether exact arithmetic was "
        "needed.");
    s.def("hit_distance", [](const Point &origin, const Point &direction,
                             const std::array<Point, 3> &triangle) {
        Counters counters;
        return hit_distance(vec(origin), vec(direction), triangle_of(triangle), counters);
    });
    s.def("exact_distance", [](const Point &origin, const Point &direction,
                               const std::array<Point, 3> &triangle) {
        return exact_distance(vec(origin), vec(direction), triangle_of(triangle));
    });
    s.def("barycentrics", [](const Point &origin, const Point &direction,
                             const std::array<Point, 3> &triangle) {
        const Vec2f uv = barycentrics(vec(origin), vec(direction), triangle_of(triangle));
        return std::pair(uv.x, uv.y);
    });
}

// The numbers of the rays of each tile, if lines are recognised.
std::optional<std::vector<std::vector<uint32_t>>> image_tiles(const Points &directions) {
    const auto lines = RayLines::find(directions.data(), directions.shape(0));
    if (!lines)
        return std::nullopt;
    std::vector<uint32_t> all(directions.shape(0));
    std::iota(all.begin(), all.end(), 0u);
    std::vector<std::vector<uint32_t>> tiles;
    for (uint32_t n = 0; n < lines->tile_count(); ++n) {
        const ImageTile tile = lines->tile(n);
        tile.copy_from(all.data(), tiles.emplace_back(tile.count()).data());
    }
    return tiles;
}

} // namespace

void bind_mlrta_selftest(nb::module_ &m) {
    nb::module_ s = m.def_submodule("mlrta_selftest");
    bind_triangle_test(s);
    bind_beam(s);
    s.def("search_table", &search_table, nb::arg("node_count"), nb::arg("children"),
          nb::arg("empty_leaves"), nb::arg("culled"), nb::arg("impossible"),
          nb::arg("shallow_first"),
          "Entry node (or None) and the nodes visited, in order, for a tree and decisions "
          "given "
          "as tables; the lower child is the near one.");
    s.def(
        "split_tile",
        [](uint32_t first, uint32_t count, uint32_t split_factor) {
            std::vector<std::pair<uint32_t, uint32_t>> children;
            for_each_child(Tile{first, count}, split_factor, [&](Tile child) {
                children.emplace_back(child.first, child.count);
            });
            return children;
        },
        "(first, count) of the parts of a tile, in order.");
    s.def(
        "image_tiles", &image_tiles, nb::arg("directions"),
        "The numbers of the rays of each tile, in order; None if they do not come line by "
        "line.");
    s.def("entry_point", &entry_point, nb::arg("tree"), nb::arg("beam"),
          nb::arg("options") = nb::dict());
    s.def("frontier", &frontier_of, nb::arg("tree"), nb::arg("beam"), nb::arg("capacity"),
          nb::arg("options") = nb::dict(),
          "(node, lower corner, upper corner, earliest hit) of each entry.");
    s.def(
        "search_all",
        [](const TreeHandle &tree, const std::vector<Beam> &beams, const nb::dict &options,
           uint32_t rounds) {
            return counters_to_dict(search_all(tree, beams, options, rounds));
        },
        nb::arg("tree"), nb::arg("beams"), nb::arg("options"), nb::arg("rounds") = 1,
        "Counters of searches of an entry point for each beam, some rounds over.");
    s.def("nodes_of", &nodes_of);
}

} // namespace mlrt
