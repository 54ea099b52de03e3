// Where the rays of an image go and enter the tree, for those who look at it.
#include "bind/bind.h"
#include "bind/scene_handle.h"
#include "bind/trace_options.h"
#include "bind/tree_handle.h"
#include "mlrta/frontier.h"
#include "render/camera.h"

#include <array>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <optional>
#include <tuple>

namespace nb = nanobind;

namespace mlrt {

namespace {

template <typename T>
std::array<T, 3> array_of(Vec3<T> v) {
    return {v.x, v.y, v.z};
}

nb::dict image_plane_of(const nb::dict &camera, const nb::dict &film) {
    const ImagePlane plane = image_plane(camera_from(camera), film_from(film));
    nb::dict result;
    result["origin"] = array_of(plane.origin);
    result["base"] = array_of(plane.d0);
    result["dx"] = array_of(plane.dx);
    result["dy"] = array_of(plane.dy);
    return result;
}

using FoundEntry = std::tuple<uint32_t, std::array<float, 3>, std::array<float, 3>>;

std::optional<FoundEntry> entry_point_of(const TreeHandle &handle, const nb::dict &camera,
                                         const nb::dict &film,
                                         const std::array<uint32_t, 4> &rectangle,
                                         const nb::dict &options) {
    const ImagePlane plane = image_plane(camera_from(camera), film_from(film));
    const TraceOptions trace_options = trace_options_from(options);
    const auto [x, y, width, height] = rectangle;
    const Beam beam = camera_beam(plane.single, x, double(x) + width, y, double(y) + height,
                                  plane.near_clip, plane.far_clip);
    const KdTree &tree = *handle.tree;
    Counters counters;
    BeamJudge judge(tree, beam, trace_options, counters);
    const Frontier found = search_frontier(tree.nodes, Frontier(root_entry(tree)), 1, judge,
                                           trace_options.search_order);
    if (found.count == 0)
        return std::nullopt;
    const auto &[node, cell] = found.entries[0];
    return FoundEntry{node, array_of(cell.lo), array_of(cell.hi)};
}

} // namespace

void bind_image_plane(nb::module_ &m) {
    m.def("image_plane", &image_plane_of, nb::arg("camera"), nb::arg("film"),
          "origin, base, dx and dy of render/camera.h's map, three numbers each. camera, "
          "film: dicts as those of Scene.");
    m.def("entry_point", &entry_point_of, nb::arg("tree"), nb::arg("camera"),
          nb::arg("film"), nb::arg("rectangle"), nb::arg("options") = nb::dict(),
          "Node, lower and upper corner of the cell of the deepest node that all rays of a "
          "rectangle of the film may start at; None if they hit nothing. rectangle: x, y, "
          "width and height in pixels of the whole film.");
}

} // namespace mlrt
