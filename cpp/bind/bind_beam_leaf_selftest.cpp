// What the tests ask of the parts of the beam-leaf traversal.
#include "base/denormals.h"
#include "bind/bind.h"
#include "mlrta/ray_grid.h"
#include "mlrta/regroup.h"
#include "mlrta/triangle_forms.h"

#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/vector.h>
#include <vector>

namespace nb = nanobind;

namespace mlrt {

namespace {

using Rows = nb::ndarray<const float, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;

using Point = std::array<float, 3>;

// A beam and the rays that it is made of: from one origin, or parallel in a scene of the
// given bounds.
class BeamUnderTest {
public:
    BeamUnderTest(const Point &origin, const Rows &directions) : BeamUnderTest(directions) {
        group_.has_common_origin = true;
        group_.common_origin = {origin[0], origin[1], origin[2]};
        const KeepDenormals keep;
        beam.load(group_, 0, group_.count, nullptr);
    }

    BeamUnderTest(const Rows &origins, const Rows &directions, const Point &lo,
                  const Point &hi)
        : BeamUnderTest(directions) {
        for (int k = 0; k < 3; ++k) {
            origin_[k] = column(origins, k);
            group_.origin[k] = origin_[k].data();
        }
        group_.has_common_origin = false;
        const KeepDenormals keep;
        beam.load_parallel(group_, 0, group_.count,
                           {{lo[0], lo[1], lo[2]}, {hi[0], hi[1], hi[2]}});
    }

    BeamPackets beam;

private:
    explicit BeamUnderTest(const Rows &directions) {
        group_.count = uint32_t(directions.shape(0));
        t_min_.assign(group_.count, 0.0f);
        t_max_.assign(group_.count, INFINITY);
        for (int k = 0; k < 3; ++k) {
            direction_[k] = column(directions, k);
            group_.direction[k] = direction_[k].data();
        }
        group_.t_min = t_min_.data();
        group_.t_max = t_max_.data();
    }

    static std::vector<float> column(const Rows &rows, int k) {
        std::vector<float> values;
        for (size_t i = 0; i < rows.shape(0); ++i)
            values.push_back(rows(i, size_t(k)));
        return values;
    }

    std::vector<float> origin_[3], direction_[3], t_min_, t_max_;
    RayGroup group_;
};

nb::dict describe(const BeamUnderTest &self) {
    const BeamPackets &beam = self.beam;
    const SlopeRectangle &r = beam.rectangle;
    nb::list packets;
    for (uint32_t n = 0; n < beam.count; ++n) {
        const BeamPacket &packet = beam.packets[n];
        nb::dict one;
        one["active"] = packet.active;
        one["strays"] = packet.strays;
        const BeamPackets::Run &run = beam.runs[n / PACKET_WIDTH];
        const auto lane = [&](const FloatPacket &packets) {
            return to_lanes<float>(packets)[n % PACKET_WIDTH];
        };
        one["box"] = std::array{lane(run.center_p), lane(run.center_q), lane(run.half_p),
                                lane(run.half_q)};
        const LaneArray<float> u = to_lanes<float>(packet.u), v = to_lanes<float>(packet.v);
        one["u"] = std::vector<float>(u.begin(), u.end());
        one["v"] = std::vector<float>(v.begin(), v.end());
        packets.append(one);
    }
    nb::dict dict;
    dict["axes"] = beam.axes;
    dict["side"] = beam.side;
    dict["rectangle"] =
        std::array{r.center_u, r.center_v, r.cosine, r.sine, r.half_p, r.half_q};
    dict["packets"] = packets;
    if (beam.parallel) {
        dict["origin"] = std::array{beam.origin.x, beam.origin.y, beam.origin.z};
        dict["slopes"] = std::array{beam.slope_u, beam.slope_v};
    }
    return dict;
}

std::vector<float> lanes_of(const TriangleForms::Lanes &lanes) {
    return {lanes, lanes + TriangleForms::CAPACITY};
}

// Of up to eight triangles, given by their vertices one after the other.
nb::dict forms_of(const BeamUnderTest &self, const Rows &vertices) {
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
    {
        const KeepDenormals keep;
        forms.set(self.beam, self.beam.parallel ? -INFINITY : 0, triangles.data(),
                  numbers.data(), uint32_t(triangles.size()));
    }
    nb::dict dict;
    dict["possible"] = forms.possible;
    dict["unsafe"] = forms.unsafe;
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

} // namespace

void bind_beam_leaf_selftest(nb::module_ &m) {
    nb::module_ s = m.def_submodule("beam_leaf_selftest");
    nb::class_<BeamUnderTest>(s, "Beam")
        .def(nb::init<const Point &, const Rows &>(), nb::arg("origin"),
             nb::arg("directions"))
        .def(nb::init<const Rows &, const Rows &, const Point &, const Point &>(),
             nb::arg("origins"), nb::arg("directions"), nb::arg("lo"), nb::arg("hi"))
        .def("describe", &describe)
        .def("forms", &forms_of, nb::arg("vertices"))
        .def("grid_may_hit", &grid_may_hit)
        .def("order", &order_of, nb::arg("share"));
}

} // namespace mlrt
