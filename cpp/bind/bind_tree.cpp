// The kd-tree and ray queries on NumPy arrays.
#include "bind/arrays.h"
#include "bind/bind.h"
#include "bind/build_options.h"
#include "bind/mesh_arrays.h"
#include "bind/prepare_tree.h"
#include "bind/ray_arrays.h"
#include "bind/result_array.h"
#include "bind/trace_options.h"
#include "bind/tree_handle.h"
#include "bind/watch.h"
#include "kdtree/lazy.h"
#include "mlrta/trace_unordered.h"
#include "traverse/barycentrics.h"

#include <memory>
#include <mutex>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <optional>

namespace nb = nanobind;

namespace mlrt {

namespace {

TreeHandle build(const Points &vertices, const Faces &faces, const nb::kwargs &options) {
    const BuildOptions build_options = build_options_from(options);
    HugeArray<Triangle> triangles = triangles_of(vertices, faces);
    Watch watch;
    std::optional<BuiltTree> built;
    {
        nb::gil_scoped_release release;
        built = build_kd_tree(std::move(triangles), build_options, [&] { return watch(); });
    }
    watch.rethrow();
    return {std::make_shared<const KdTree>(std::move(built->tree)), built->report,
            build_options};
}

nb::tuple closest_hit(const TreeHandle &self, const Points &origins,
                      const Points &directions, const Values &t_min, const Values &t_max,
                      const nb::dict &options, const nb::object &counters_out) {
    const TraceOptions trace_options = trace_options_from(options);
    const RayArrays rays(origins, directions, t_min, t_max);
    prepare_tree(*self.tree, rays, trace_options);
    const size_t count = rays.count();
    auto t = result_array<float>(count), u = result_array<float>(count);
    auto v = result_array<float>(count);
    auto primitive = result_array<int32_t>(count);
    const auto trace = [&](const RayRun &run, Counters &c) {
        // The mark of a miss, 2^32 - 1, is -1 as a signed number.
        RayRun::Answers of_primitive(run, reinterpret_cast<uint32_t *>(primitive.get()));
        RayRun::Answers of_t(run, t.get()), of_u(run, u.get()), of_v(run, v.get());
        trace_closest_unordered(*self.tree, run.group, trace_options,
                                {of_t.data(), of_primitive.data()}, c, run.is_square());
        find_barycentrics(*self.tree, run.group, of_primitive.data(), of_u.data(),
                          of_v.data());
        of_primitive.put_in_place();
        of_t.put_in_place();
        of_u.put_in_place();
        of_v.put_in_place();
    };
    const Counters counters = rays.for_each_run(trace_options, trace);
    if (!counters_out.is_none())
        nb::cast<nb::dict>(counters_out).update(counters_to_dict(counters));
    return nb::make_tuple(to_numpy(std::move(t), {count}),
                          to_numpy(std::move(primitive), {count}),
                          to_numpy(std::move(u), {count}), to_numpy(std::move(v), {count}));
}

nb::object any_hit(const TreeHandle &self, const Points &origins, const Points &directions,
                   const Values &t_min, const Values &t_max, const nb::dict &options,
                   const nb::object &counters_out) {
    const TraceOptions trace_options = trace_options_from(options);
    const RayArrays rays(origins, directions, t_min, t_max);
    prepare_tree(*self.tree, rays, trace_options);
    auto occluded = result_array<bool>(rays.count());
    const auto trace = [&](const RayRun &run, Counters &c) {
        RayRun::Answers answers(run, reinterpret_cast<uint8_t *>(occluded.get()));
        trace_any_unordered(*self.tree, run.group, trace_options, answers.data(), c,
                            run.is_square());
        answers.put_in_place();
    };
    const Counters counters = rays.for_each_run(trace_options, trace);
    if (!counters_out.is_none())
        nb::cast<nb::dict>(counters_out).update(counters_to_dict(counters));
    return to_numpy(std::move(occluded), {rays.count()});
}

} // namespace

void bind_tree(nb::module_ &m) {
    nb::class_<TreeHandle>(m, "KdTree")
        .def(
            "__init__",
            [](TreeHandle *self, const Points &vertices, const Faces &faces,
               const nb::kwargs &options) {
                new (self) TreeHandle(build(vertices, faces, options));
            },
            nb::arg("vertices"), nb::arg("faces"), nb::arg("options"))
        .def_prop_ro("report",
                     [](const TreeHandle &self) {
                         BuildReport report = self.report;
                         if (self.tree->growth)
                             report.add(self.tree->growth->report());
                         return report_to_dict(report);
                     })
        .def_prop_ro("bounds",
                     [](const TreeHandle &self) {
                         const Box3f &b = self.tree->bounds;
                         return nb::make_tuple(nb::make_tuple(b.lo.x, b.lo.y, b.lo.z),
                                               nb::make_tuple(b.hi.x, b.hi.y, b.hi.z));
                     })
        .def(
            "widen",
            [](const TreeHandle &self) {
                Watch watch;
                const WideTree *wide;
                {
                    const nb::gil_scoped_release release;
                    wide = self.tree->widening->make(*self.tree, [&] { return watch(); });
                }
                watch.rethrow();
                return wide->bytes();
            },
            "Makes the tree's form for rays that go alone, unless it is there. Returns its "
            "bytes.")
        .def("closest_hit", &closest_hit, nb::arg("origins"), nb::arg("directions"),
             nb::arg("t_min"), nb::arg("t_max"), nb::arg("options") = nb::dict(),
             nb::arg("counters") = nb::none(),
             "t float32, primitive int32 (-1 for a miss), u and v float32, each (N,). What "
             "was counted takes its place in the dictionary `counters`.")
        .def("any_hit", &any_hit, nb::arg("origins"), nb::arg("directions"),
             nb::arg("t_min"), nb::arg("t_max"), nb::arg("options") = nb::dict(),
             nb::arg("counters") = nb::none(),
             "bool (N,), whether something lies in the interval.");
}

} // namespace mlrt
