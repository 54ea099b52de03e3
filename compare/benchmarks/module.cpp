// The Python module of mlrt-bench.
#include "base/exactness.h"
#include "bind/build_options.h"
#include "bind/mesh_arrays.h"
#include "bind/trace_options.h"
#include "bind/watch.h"
#include "embree_frame.h"
#include "embree_hits.h"
#include "kernels.h"
#include "mlrt_engine.h"
#include "render/camera.h"

#include <bit>
#include <limits>
#include <malloc.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <optional>
#include <vector>

namespace nb = nanobind;

namespace mlrt::bench {

namespace {

using Image = nb::ndarray<float, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;
using Primitives = nb::ndarray<uint32_t, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;
using Distances = nb::ndarray<float, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
using Numbers = nb::ndarray<uint32_t, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
using Bytes = nb::ndarray<uint8_t, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;

const EnumNames<EmbreeMode> EMBREE_MODES{{"r16", EmbreeMode::packet},
                                         {"NM8", EmbreeMode::stream_of_8},
                                         {"NM16", EmbreeMode::stream_of_16},
                                         {"1M", EmbreeMode::single_stream}};

const EnumNames<ArrayMode> ARRAY_MODES{{"r16 coherent", ArrayMode::coherent_packets},
                                       {"r16 incoherent", ArrayMode::incoherent_packets},
                                       {"1M incoherent", ArrayMode::single_rays}};

const EnumNames<Kernel> KERNELS{{"single", Kernel::single_precision},
                                {"double", Kernel::double_precision},
                                {"pluecker", Kernel::pluecker},
                                {"sheared", Kernel::sheared},
                                {"exact", Kernel::exact}};

Mesh mesh_from(const Points &vertices, const Faces &faces) {
    Mesh mesh;
    mesh.vertices.resize(vertices.shape(0) + 1);
    for (size_t i = 0; i < vertices.shape(0); ++i)
        mesh.vertices[i] = {vertices(i, 0), vertices(i, 1), vertices(i, 2)};
    mesh.faces.resize(faces.shape(0));
    for (size_t i = 0; i < faces.shape(0); ++i)
        for (size_t j = 0; j < 3; ++j) {
            if (faces(i, j) >= vertices.shape(0))
                refuse_value("faces refer to vertices that do not exist.");
            mesh.faces[i][j] = faces(i, j);
        }
    return mesh;
}

View view_from(nb::handle dict, uint32_t width, uint32_t height, uint32_t grid) {
    Fields fields(dict, "view");
    Camera camera;
    camera.origin = fields.vector("origin");
    camera.axes = {fields.vector("axis_x"), fields.vector("axis_y"),
                   fields.vector("axis_z")};
    camera.tan_half_fov_x = fields.number("tan_half_fov_x");
    camera.near_clip = fields.number("near_clip");
    camera.far_clip = fields.number("far_clip");
    camera.principal_point_offset = {fields.number("principal_point_x"),
                                     fields.number("principal_point_y")};
    const Vec3f light = fields.vector("light");
    fields.finish();
    if (width == 0 || height == 0)
        refuse_value("width and height must be positive.");
    if (grid != 1 && grid != BLOCK_SIDE)
        refuse_value("grid must be 1 or 4.");
    Film film;
    film.width = width;
    film.height = height;
    const ImagePlane plane = image_plane(camera, film);
    return {plane.single, plane.near_clip, plane.far_clip, width, height, light, grid};
}

template <typename Array>
void check_shape(const Array &array, uint32_t rows, uint32_t columns, const char *name) {
    if (array.shape(0) != rows || array.shape(1) != columns)
        refuse_value(std::string(name) + " must have the shape (" + std::to_string(rows) +
                     ", " + std::to_string(columns) + ") of the view.");
}

FrameOutput output_from(const View &view, const Image &image,
                        const std::optional<Primitives> &primitives,
                        const std::optional<Bytes> &lit) {
    check_shape(image, view.height, view.width, "image");
    if (primitives)
        check_shape(*primitives, view.rows(), view.columns(), "primitives");
    if (lit)
        check_shape(*lit, view.rows(), view.columns(), "lit");
    return {image.data(), primitives ? primitives->data() : nullptr,
            lit ? lit->data() : nullptr};
}

FrameSettings settings_from(uint32_t tile_side, bool shadows) {
    if (!std::has_single_bit(tile_side) || tile_side < BLOCK_SIDE || tile_side > 4096)
        refuse_value("tile must be a power of two from 4 to 4096.");
    return {tile_side, shadows};
}

TimedTree built_tree(const Mesh &mesh, const nb::dict &options_dict) {
    const BuildOptions options = build_options_from(options_dict);
    Watch watch;
    std::optional<TimedTree> tree;
    {
        nb::gil_scoped_release release;
        tree = build_tree(mesh, options, [&] { return watch(); });
    }
    watch.rethrow();
    return std::move(*tree);
}

void bind_input(nb::module_ &m) {
    nb::class_<Mesh>(m, "Mesh").def(
        "__init__",
        [](Mesh *self, const Points &vertices, const Faces &faces) {
            new (self) Mesh(mesh_from(vertices, faces));
        },
        nb::arg("vertices"), nb::arg("faces"));
    nb::class_<View>(m, "View").def(
        "__init__",
        [](View *self, const nb::dict &view, uint32_t width, uint32_t height,
           uint32_t grid) { new (self) View(view_from(view, width, height, grid)); },
        nb::arg("view"), nb::arg("width"), nb::arg("height"), nb::arg("grid") = 1);
    nb::class_<Seconds>(m, "Seconds")
        .def_ro("wall", &Seconds::wall)
        .def_ro("cpu", &Seconds::cpu);
    nb::class_<WideForm>(m, "WideForm")
        .def_ro("seconds", &WideForm::seconds)
        .def_ro("bytes", &WideForm::bytes);
}

size_t ray_count(const Points &origins, const Points &directions, const Distances &t,
                 const Numbers &primitives) {
    const size_t count = origins.shape(0);
    if (directions.shape(0) != count || t.shape(0) != count || primitives.shape(0) != count)
        refuse_value("origins, directions, t and primitives must have the same length.");
    return count;
}

Seconds trace_with_kernel(const TimedTree &tree, const std::string &name,
                          const Points &origins, const Points &directions,
                          const Distances &t, const Numbers &primitives) {
    const size_t count = ray_count(origins, directions, t, primitives);
    const Kernel kernel = enumerator_of(KERNELS, name, "kernel");
    nb::gil_scoped_release release;
    std::vector<float> columns[6];
    for (size_t k = 0; k < 6; ++k) {
        const float *first = (k < 3 ? origins : directions).data() + k % 3;
        columns[k].resize(count);
        for (size_t i = 0; i < count; ++i)
            columns[k][i] = first[3 * i];
    }
    const std::vector<float> t_min(count, 0.0f);
    const std::vector<float> t_max(count, std::numeric_limits<float>::max());
    RayGroup rays;
    rays.count = uint32_t(count);
    for (size_t k = 0; k < 3; ++k) {
        rays.origin[k] = columns[k].data();
        rays.direction[k] = columns[k + 3].data();
    }
    rays.t_min = IntervalEnds(t_min.data());
    rays.t_max = IntervalEnds(t_max.data());
    return trace_with(tree.built.tree, kernel, rays, {t.data(), primitives.data()});
}

void bind_mlrt(nb::module_ &m) {
    nb::class_<TimedTree>(m, "KdTree")
        .def(
            "__init__",
            [](TimedTree *self, const Mesh &mesh, const nb::dict &options) {
                new (self) TimedTree(built_tree(mesh, options));
            },
            nb::arg("mesh"), nb::arg("options"))
        .def_prop_ro("seconds", [](const TimedTree &self) { return self.seconds; })
        .def_prop_ro("bytes", &TimedTree::bytes)
        .def(
            "widen",
            [](const TimedTree &self) {
                const nb::gil_scoped_release release;
                const KdTree &tree = self.built.tree;
                tree.widening->make(tree);
            },
            "Makes the form of the tree for rays that go alone.")
        .def(
            "make_wide_form",
            [](const TimedTree &self) { return make_wide_form(self.built.tree); },
            nb::call_guard<nb::gil_scoped_release>(),
            "The same, only to tell what it takes: nothing of it is kept.")
        .def_prop_ro("state",
                     [](const TimedTree &self) {
                         const GrowthState state = self.state();
                         nb::dict dict;
                         dict["nodes"] = state.nodes;
                         dict["references"] = state.references;
                         dict["unbuilt_cells"] = state.unbuilt_cells;
                         dict["unbuilt_references"] = state.unbuilt_references;
                         dict["waiting_bytes"] = state.waiting_bytes;
                         return dict;
                     })
        .def(
            "finish", [](const TimedTree &self) { finish_growth(self.built.tree); },
            nb::call_guard<nb::gil_scoped_release>(), "Builds what is not built yet.")
        .def(
            "sah_cost", [](const TimedTree &self) { return sah_cost(self.built.tree); },
            "Found by walking the tree, in units of a traversal step.")
        .def_prop_ro(
            "report",
            [](const TimedTree &self) { return report_to_dict(self.built.report); })
        .def(
            "render",
            [](const TimedTree &self, const View &view, const nb::dict &options,
               const Image &image, const std::optional<Primitives> &primitives,
               const std::optional<Bytes> &lit, uint32_t tile, bool shadows) {
                const TraceOptions trace_options = trace_options_from(options);
                const FrameSettings settings = settings_from(tile, shadows);
                const FrameOutput output = output_from(view, image, primitives, lit);
                nb::gil_scoped_release release;
                return render_frame(self.built.tree, view, trace_options, settings, output);
            },
            nb::arg("view"), nb::arg("options"), nb::arg("image"),
            nb::arg("primitives").none() = nb::none(), nb::arg("lit").none() = nb::none(),
            nb::arg("tile") = FrameSettings().tile_side,
            nb::arg("shadows") = FrameSettings().shadows)
        .def(
            "count_primary",
            [](const TimedTree &self, const View &view, const nb::dict &options,
               uint32_t tile) {
                const TraceOptions trace_options = trace_options_from(options);
                const uint32_t side = settings_from(tile, false).tile_side;
                Counters counters;
                {
                    nb::gil_scoped_release release;
                    counters = count_primary(self.built.tree, view, trace_options, side);
                }
                return counters_to_dict(counters);
            },
            nb::arg("view"), nb::arg("options"),
            nb::arg("tile") = FrameSettings().tile_side)
        .def("trace_with", &trace_with_kernel, nb::arg("kernel"), nb::arg("origins"),
             nb::arg("directions"), nb::arg("t"), nb::arg("primitives"),
             "Writes the nearest hits of rays by the kernel single, double, pluecker, "
             "sheared or exact of kernels.h.");
}

void bind_embree(nb::module_ &m) {
    nb::class_<EmbreeDevice>(m, "EmbreeDevice")
        .def(nb::init<const std::string &>(), nb::arg("configuration"))
        .def_prop_ro("version", &EmbreeDevice::version)
        .def_prop_ro("has_native_packets", &EmbreeDevice::has_native_packets)
        .def_prop_ro("bytes", &EmbreeDevice::bytes);
    nb::class_<EmbreeScene>(m, "EmbreeScene")
        .def(
            "__init__",
            [](EmbreeScene *self, EmbreeDevice &device, const Mesh &mesh, bool high,
               bool robust) {
                nb::gil_scoped_release release;
                new (self) EmbreeScene(
                    device, mesh, high ? RTC_BUILD_QUALITY_HIGH : RTC_BUILD_QUALITY_MEDIUM,
                    robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
            },
            nb::arg("device"), nb::arg("mesh"), nb::arg("high"), nb::arg("robust") = false,
            nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>())
        .def(
            "closest_hit",
            [](const EmbreeScene &self, const Points &origins, const Points &directions,
               const Distances &t, const Numbers &primitives, const std::string &mode) {
                const size_t count = ray_count(origins, directions, t, primitives);
                const ArrayMode chosen = enumerator_of(ARRAY_MODES, mode, "mode");
                nb::gil_scoped_release release;
                closest_hits(self, origins.data(), directions.data(), count, chosen,
                             t.data(), primitives.data());
            },
            nb::arg("origins"), nb::arg("directions"), nb::arg("t"), nb::arg("primitives"),
            nb::arg("mode") = "r16 incoherent",
            "Writes the nearest hits of rays, in one of the modes r16 coherent, r16 "
            "incoherent and 1M incoherent.")
        .def_prop_ro("seconds", [](const EmbreeScene &self) { return self.seconds(); })
        .def_prop_ro("bytes", &EmbreeScene::bytes)
        .def_prop_ro("peak_bytes", &EmbreeScene::peak_bytes)
        .def(
            "render",
            [](const EmbreeScene &self, const View &view, const Image &image,
               const std::optional<Primitives> &primitives, const std::optional<Bytes> &lit,
               const std::string &mode_name, uint32_t tile, bool shadows) {
                const EmbreeMode mode = enumerator_of(EMBREE_MODES, mode_name, "mode");
                const FrameSettings settings = settings_from(tile, shadows);
                const FrameOutput output = output_from(view, image, primitives, lit);
                nb::gil_scoped_release release;
                return render_frame(self, mode, view, settings, output);
            },
            nb::arg("view"), nb::arg("image"), nb::arg("primitives").none() = nb::none(),
            nb::arg("lit").none() = nb::none(), nb::arg("mode") = "r16",
            nb::arg("tile") = FrameSettings().tile_side,
            nb::arg("shadows") = FrameSettings().shadows);
}

} // namespace

} // namespace mlrt::bench

NB_MODULE(MLRT_MODULE, m) {
    using namespace mlrt::bench;
    m.attr("isa") = MLRT_ISA_NAME;
    m.attr("exact") = mlrt::EXACT;
    m.attr("exact_distances") = mlrt::EXACT_DISTANCES;
    m.def(
        "release_memory", [] { malloc_trim(0); },
        "Returns freed memory to the system, so that the next piece of work starts as in "
        "a fresh process.");
    m.def(
        "check_trace_options",
        [](const nb::dict &options) { mlrt::trace_options_from(options); },
        nb::arg("options"), "Raises ValueError or TypeError for what the tracer refuses.");
    bind_input(m);
    bind_mlrt(m);
    bind_embree(m);
}
