// What the tests ask of the parts of the beam-leaf traversal.
#include "base/denormals.h"
#include "bind/arrays.h"
#include "bind/bind.h"
#include "bind/trace_options.h"
#include "bind/tree_handle.h"
#include "mlrta/beam_budget.h"
#include "mlrta/ray_grid.h"
#include "mlrta/regroup.h"
#include "mlrta/trace.h"
#include "mlrta/triangle_forms.h"

#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>
#include <tuple>
#include <vector>

namespace nb = nanobind;

namespace mlrt {

namespace {

using Rows = nb::ndarray<const float, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;

using Point = std::array<float, 3>;
using FilmTile = std::tuple<uint32_t, uint32_t, uint32_t, uint32_t, float, float>;

Vec3f vec(const Point &v) {
    return {v[0], v[1], v[2]};
}

// A camera by its base, dx and dy, and a tile of it: x, y, size, samples, begin, end.
CameraTile camera_tile(const Point &origin, const std::array<Point, 3> &map,
                       const FilmTile &tile) {
    const auto [x, y, size, samples, begin, end] = tile;
    return {{vec(origin), vec(map[0]), vec(map[1]), vec(map[2])},
            x,
            y,
            size,
            samples,
            begin,
            end};
}

// Rays of a common origin, or each with its own.
class RaysUnderTest {
public:
    RaysUnderTest(const Point &origin, const Rows &directions, float t_min, float t_max)
        : RaysUnderTest(directions, t_min, t_max) {
        group_.has_common_origin = true;
        group_.common_origin = vec(origin);
    }
    RaysUnderTest(const Rows &origins, const Rows &directions)
        : RaysUnderTest(directions, 0, INFINITY) {
        group_.has_common_origin = false;
        for (int k = 0; k < 3; ++k) {
            origin_[k] = column(origins, k);
            group_.origin[k] = origin_[k].data();
        }
    }
    RaysUnderTest(const RaysUnderTest &) = delete;

    const RayGroup &group() const { return group_; }

private:
    RaysUnderTest(const Rows &directions, float t_min, float t_max) {
        group_.count = uint32_t(directions.shape(0));
        for (int k = 0; k < 3; ++k) {
            direction_[k] = column(directions, k);
            group_.direction[k] = direction_[k].data();
        }
        group_.t_min = IntervalEnds::of_all(t_min);
        group_.t_max = IntervalEnds::of_all(t_max);
    }

    static std::vector<float> column(const Rows &rows, int k) {
        std::vector<float> values;
        for (size_t i = 0; i < rows.shape(0); ++i)
            values.push_back(rows(i, size_t(k)));
        return values;
    }

    std::vector<float> origin_[3], direction_[3];
    RayGroup group_;
};

// A beam and the rays that it is made of.
class BeamUnderTest {
public:
    BeamUnderTest(const Point &origin, const Rows &directions)
        : rays(origin, directions, 0, INFINITY) {
        const KeepDenormals keep;
        beam.load(rays.group(), 0, rays.group().count, nullptr);
    }

    // The rays of a whole tile of a camera, of which those of the run make a beam, bounded
    // by the film where that is possible.
    BeamUnderTest(const Point &origin, const Rows &directions,
                  const std::array<Point, 3> &map, const FilmTile &tile, uint32_t first,
                  uint32_t count, float t_min, float t_max)
        : rays(origin, directions, t_min, t_max) {
        const KeepDenormals keep;
        const CameraTile square = camera_tile(origin, map, tile);
        is_by_film =
            beam.load_camera(rays.group(), first, count, camera_rays(rays.group(), square));
        if (!is_by_film)
            beam.load(rays.group(), first, count, &square.camera);
    }

    // Parallel rays in a scene of the given bounds.
    BeamUnderTest(const Rows &origins, const Rows &directions, const Point &lo,
                  const Point &hi)
        : rays(origins, directions) {
        const KeepDenormals keep;
        beam.load_parallel(rays.group(), 0, rays.group().count, {vec(lo), vec(hi)});
    }

    RaysUnderTest rays;
    BeamPackets beam;
    bool is_by_film = false;
};

nb::dict describe(const BeamUnderTest &self) {
    const BeamPackets &beam = self.beam;
    const SlopeRectangle &r = beam.rectangle;
    nb::list packets;
    for (uint32_t n = 0; n < beam.count; ++n) {
        const BeamPacket &packet = beam.packets[n];
        nb::dict one;
        one["active"] = beam.lanes[n].active;
        one["strays"] = beam.lanes[n].strays;
        const BeamPackets::Run &run = beam.runs[n / PACKET_WIDTH];
        const auto lane = [&](const FloatPacket &packets) {
            return to_lanes<float>(packets)[n % PACKET_WIDTH];
        };
        one["box"] = std::array{lane(run.center_p), lane(run.center_q), lane(run.half_p),
                                lane(run.half_q)};
        one["first_ray"] = beam.lanes[n].first_ray;
        one["reciprocal_depths"] =
            std::array{run.least[n % PACKET_WIDTH], run.greatest[n % PACKET_WIDTH]};
        const PacketBounds &all = run.all;
        one["box_of_run"] = std::array{all.center_p, all.center_q, all.half_p, all.half_q};
        if (beam.parallel) {
            const LaneArray<float> u = to_lanes<float>(packet.u),
                                   v = to_lanes<float>(packet.v);
            one["u"] = std::vector<float>(u.begin(), u.end());
            one["v"] = std::vector<float>(v.begin(), v.end());
        }
        packets.append(one);
    }
    nb::dict dict;
    dict["is_by_film"] = self.is_by_film;
    dict["slopes"] =
        std::array{beam.slope_lo[0], beam.slope_hi[0], beam.slope_lo[1], beam.slope_hi[1]};
    dict["nearest"] = beam.nearest;
    dict["axes"] = beam.axes;
    dict["side"] = beam.side;
    dict["rectangle"] =
        std::array{r.center_u, r.center_v, r.cosine, r.sine, r.half_p, r.half_q};
    dict["spread"] = beam.spread;
    dict["common_slopes"] = std::array{beam.slope_u, beam.slope_v};
    dict["packets"] = packets;
    if (beam.parallel) {
        dict["origin"] = std::array{beam.origin.x, beam.origin.y, beam.origin.z};
    }
    return dict;
}

std::vector<float> lanes_of(const TriangleForms::Lanes &lanes) {
    return {lanes, lanes + TriangleForms::CAPACITY};
}

// Of up to eight triangles, given by their vertices one after the other.
TriangleForms triangle_forms_of(const BeamPackets &beam, const Rows &vertices) {
    std::vector<Triangle> triangles;
    for (size_t i = 0; i + 2 < vertices.shape(0); i += 3) {
        Triangle triangle;
        for (size_t k = 0; k < 3; ++k) {
            triangle.a[int(k)] = vertices(i, k);
            triangle.b[int(k)] = vertices(i + 1, k);
            triangle.c[int(k)] = vertices(i + 2, k);
        }
        triangles.push_back(triangle);
    }
    std::array<uint32_t, TriangleForms::CAPACITY> numbers{};
    for (uint32_t n = 0; n < triangles.size(); ++n)
        numbers[n] = n;
    TriangleForms forms;
    const KeepDenormals keep;
    forms.set(beam, beam.parallel ? -INFINITY : 0, triangles.data(), numbers.data(),
              uint32_t(triangles.size()));
    return forms;
}

// The numbers of triangle and packet where one covers the other, bounds of reciprocal
// depths there, and whether the triangle counts as large enough for that.
nb::list covered_packets(const BeamUnderTest &self, const Rows &vertices) {
    const BeamPackets &beam = self.beam;
    const TriangleForms forms = triangle_forms_of(beam, vertices);
    const LaneBits large = forms.possible_covers(beam);
    nb::list list;
    for_each_lane(forms.possible, [&](uint32_t triangle) {
        for (uint32_t n = 0; n < beam.run_count(); ++n) {
            const auto coverage = forms.coverage_of(triangle, beam, beam.runs[n]);
            for_each_lane(coverage.covered, [&](uint32_t lane) {
                list.append(nb::make_tuple(triangle, n * PACKET_WIDTH + lane,
                                           to_lanes<float>(coverage.least)[lane],
                                           to_lanes<float>(coverage.greatest)[lane],
                                           (large >> triangle & 1) != 0));
            });
        }
    });
    return list;
}

nb::dict forms_of(const BeamUnderTest &self, const Rows &vertices) {
    const TriangleForms forms = triangle_forms_of(self.beam, vertices);
    nb::dict dict;
    dict["possible"] = forms.possible;
    dict["unsafe"] = forms.unsafe;
    dict["possible_covers"] = forms.possible_covers(self.beam);
    nb::list within;
    for (uint32_t n = 0; n < self.beam.run_count(); ++n)
        within.append(forms.possible_for(self.beam.runs[n]));
    dict["possible_for_runs"] = within;
    nb::list values;
    for (int form = 0; form < 4; ++form)
        values.append(nb::make_tuple(lanes_of(forms.constant[form]),
                                     lanes_of(forms.of_u[form]),
                                     lanes_of(forms.of_v[form])));
    dict["forms"] = values;
    dict["edge_error"] = lanes_of(forms.edge_error);
    dict["ray_error"] = lanes_of(forms.ray_error);
    dict["depth_error"] = lanes_of(forms.depth_error);
    dict["depth_shrink"] = lanes_of(forms.depth_shrink);
    dict["depth_grow"] = lanes_of(forms.depth_grow);
    return dict;
}

bool grid_may_hit(const BeamUnderTest &self, float p, float q, float half_p, float half_q) {
    RayGrid grid;
    grid.fill(self.beam);
    TriangleForms forms{};
    forms.box_p[0] = p;
    forms.box_q[0] = q;
    forms.box_half_p[0] = half_p;
    forms.box_half_q[0] = half_q;
    return grid.may_hit(forms, 1) != 0;
}

// Whether the budget is spent after each of some steps: triangles, and how many rays have
// found something by then.
std::vector<bool> spent_after(uint32_t most_triangles, uint32_t first_look,
                              float least_yield,
                              const std::vector<std::tuple<uint32_t, uint32_t>> &steps) {
    BeamBudget budget(most_triangles, first_look, least_yield);
    std::vector<bool> spent;
    for (const auto &[triangles, found] : steps) {
        budget.spend(triangles, [found = found] { return found; });
        spent.push_back(budget.spent());
    }
    return spent;
}

std::vector<uint32_t> list_of(const RayNumbers &numbers) {
    return {numbers.number.begin(), numbers.number.begin() + numbers.count};
}

// Rays in the order of their cells; and those before and beyond the best cut, if any.
nb::tuple order_of(const BeamUnderTest &self, float share) {
    const Occupancy occupancy(self.beam);
    RayNumbers before, beyond;
    if (const auto cut = occupancy.best_cut(share))
        occupancy.divide(self.beam, *cut, before, beyond);
    return nb::make_tuple(list_of(occupancy.sorted(self.beam)), list_of(before),
                          list_of(beyond));
}

// Nearest hits of all rays of a camera's tile.
nb::tuple trace_tile(const TreeHandle &tree, const Point &origin, const Rows &directions,
                     const std::array<Point, 3> &map, const FilmTile &tile, float t_min,
                     float t_max, const nb::dict &options) {
    const RaysUnderTest rays(origin, directions, t_min, t_max);
    const size_t count = rays.group().count;
    std::vector<float> t(count);
    std::vector<uint32_t> primitive(count);
    const CameraTile square = camera_tile(origin, map, tile);
    Counters counters;
    {
        const KeepDenormals keep;
        trace_closest(*tree.tree, rays.group(), trace_options_from(options),
                      {t.data(), primitive.data()}, counters, &square);
    }
    return nb::make_tuple(to_numpy<float>(std::move(t), {count}),
                          to_numpy<int32_t>(std::move(primitive), {count}),
                          counters_to_dict(counters));
}

} // namespace

void bind_beam_leaf_selftest(nb::module_ &m) {
    nb::module_ s = m.def_submodule("beam_leaf_selftest");
    nb::class_<BeamUnderTest>(s, "Beam")
        .def(nb::init<const Point &, const Rows &>(), nb::arg("origin"),
             nb::arg("directions"))
        .def(nb::init<const Point &, const Rows &, const std::array<Point, 3> &,
                      const FilmTile &, uint32_t, uint32_t, float, float>(),
             nb::arg("origin"), nb::arg("directions"), nb::arg("map"), nb::arg("tile"),
             nb::arg("first"), nb::arg("count"), nb::arg("t_min"), nb::arg("t_max"))
        .def(nb::init<const Rows &, const Rows &, const Point &, const Point &>(),
             nb::arg("origins"), nb::arg("directions"), nb::arg("lo"), nb::arg("hi"))
        .def("describe", &describe)
        .def("covered_packets", &covered_packets, nb::arg("vertices"))
        .def("forms", &forms_of, nb::arg("vertices"))
        .def("grid_may_hit", &grid_may_hit)
        .def("order", &order_of, nb::arg("share"));
    s.def("spent_after", &spent_after, nb::arg("most_triangles"), nb::arg("first_look"),
          nb::arg("least_yield"), nb::arg("steps"));
    s.def(
        "trace_tile", &trace_tile, nb::arg("tree"), nb::arg("origin"),
        nb::arg("directions"), nb::arg("map"), nb::arg("tile"), nb::arg("t_min"),
        nb::arg("t_max"), nb::arg("options"),
        "t, primitive and counters. map: base, dx and dy of the camera. tile: x, y, size, "
        "samples, and where in a pixel they begin and end to lie.");
}

} // namespace mlrt
