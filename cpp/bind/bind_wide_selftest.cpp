// What only the tests see of the wide tree.
#include "bind/arrays.h"
#include "bind/bind.h"
#include "bind/build_options.h"
#include "bind/triangle_arrays.h"
#include "geometry/block_volumes.h"
#include "kdtree/builder.h"
#include "kdtree/wide_maker.h"
#include "traverse/load_packet.h"
#include "traverse/packet_frustum.h"
#include "traverse/wide_packets.h"
#include "traverse/wide_rays.h"

#include <algorithm>
#include <cstring>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <vector>

namespace nb = nanobind;

namespace mlrt {

namespace {

using Point = std::array<float, 3>;
using Eight = std::array<float, BLOCK_WIDTH>;

// The words that each of them consists of.
template <typename T>
nb::object words_of(const HugeArray<T> &values) {
    constexpr size_t WORDS = sizeof(T) / sizeof(uint32_t);
    std::vector<uint32_t> words(values.size() * WORDS);
    if (!words.empty())
        std::memcpy(words.data(), values.data(), values.bytes());
    return to_numpy<uint32_t>(std::move(words), {values.size(), WORDS});
}

nb::dict wide_tree(const TriangleArray &array, const nb::kwargs &options) {
    const BuiltTree built =
        *build_kd_tree(triangles_of(array), build_options_from(options));
    const WideTree wide = *make_wide_tree(built.tree);
    nb::dict dict;
    dict["root"] = wide.root.bits();
    dict["nodes"] = words_of(wide.nodes);
    dict["blocks"] = words_of(wide.blocks);
    return dict;
}

// Whether it is made if whoever is asked says at once, or never, that it is cancelled.
bool is_made(const TriangleArray &array, bool cancelled, const nb::kwargs &options) {
    const BuiltTree built =
        *build_kd_tree(triangles_of(array), build_options_from(options));
    return make_wide_tree(built.tree, [&] { return cancelled; }).has_value();
}

using BlockCoordinates = std::array<std::array<float, BLOCK_WIDTH>, 9>;

BlockCoordinates coordinates_of(const TriangleArray &eight) {
    if (eight.shape(0) != BLOCK_WIDTH)
        throw nb::value_error("eight triangles");
    BlockCoordinates coordinates;
    for (size_t i = 0; i < BLOCK_WIDTH; ++i)
        for (size_t k = 0; k < 9; ++k)
            coordinates[k][i] = eight(i, k / 3, k % 3);
    return coordinates;
}

// What volumes tell of the first ray, and the axis that depths are measured along.
template <typename Seen>
nb::tuple tuple_of(const Seen &seen, int axis) {
    constexpr LaneBits OF_ONE_RAY = (1u << BLOCK_WIDTH) - 1;
    std::array<float, PACKET_WIDTH> nearest{}, farthest{};
    if (seen.possible != 0) {
        store(nearest.data(), seen.nearest);
        store(farthest.data(), seen.farthest);
    }
    return nb::make_tuple(seen.possible & OF_ONE_RAY, seen.certain & OF_ONE_RAY, nearest,
                          farthest, axis);
}

// What volumes of one ray tell of it: bits of possible and certain hits, bounds of the
// depths of the former, and the axis that these are measured along.
nb::tuple seen_alone(const Point &origin, const Point &direction,
                     const TriangleArray &eight) {
    const float zero = 0, one = 1;
    RayGroup group;
    group.count = 1;
    for (int k = 0; k < 3; ++k) {
        group.origin[k] = &origin[size_t(k)];
        group.direction[k] = &direction[size_t(k)];
    }
    group.t_min = IntervalEnds(&zero);
    group.t_max = IntervalEnds(&one);
    const auto [packet, extreme] = load_packet<LaneOrigins>(group, 0);
    if (packet.active != 1)
        throw nb::value_error("a moderate direction");
    WideRays rays;
    rays.add(packet, 1, 0);
    const WideRay &ray = rays.beginning[0];
    const auto &[x, y, z] = ray.ordered_origin;
    const RayVolumes volumes(coordinates_of(eight), {ray.axes[0], ray.axes[1], ray.axes[2]},
                             {x, y, z}, ray.side);
    return tuple_of(volumes.seen_by(FloatBlock(ray.slopes[0]), FloatBlock(ray.slopes[1])),
                    ray.axes[2]);
}

// The same by volumes of two rays, both of them this one.
nb::tuple seen_in_packet(const Point &origin, const Point &direction,
                         const TriangleArray &eight) {
    const float zero = 0, one = 1;
    RayGroup group;
    group.count = 1;
    group.has_common_origin = true;
    group.common_origin = {origin[0], origin[1], origin[2]};
    for (int k = 0; k < 3; ++k)
        group.direction[k] = &direction[size_t(k)];
    group.t_min = IntervalEnds(&zero);
    group.t_max = IntervalEnds(&one);
    WidePacket packet{load_packet<CommonOrigin>(group, 0).rays, 0, 0, 1};
    if (packet.rays.active != 1)
        throw nb::value_error("a moderate direction");
    packet.choose_axis(1);
    const PacketFrustum frustum(packet.rays, packet.main_axis, packet.side);
    const BlockVolumes volumes(coordinates_of(eight), frustum.axes, frustum.origin,
                               frustum.side);
    return tuple_of(volumes.seen_by(FloatPacket(frustum.slopes[0][0]),
                                    FloatPacket(frustum.slopes[1][0])),
                    packet.main_axis);
}

// Rays from one point, and eight boxes (lower and upper corner, and one more that does not
// count): the rays that go along with the middle one; the boxes that any of those may
// enter; for each box those of them that may enter it; and for each ray the boxes that it
// may enter alone.
nb::tuple entered_boxes(const Point &origin, const TriangleArray &directions,
                        const TriangleArray &corners) {
    if (directions.shape(0) > PACKET_WIDTH || corners.shape(0) != BLOCK_WIDTH)
        throw nb::value_error("sixteen rays at most, and eight boxes");
    std::array<std::array<float, PACKET_WIDTH>, 3> direction{};
    std::array<float, PACKET_WIDTH> zero{}, one;
    one.fill(1);
    RayGroup group;
    group.count = uint32_t(directions.shape(0));
    group.has_common_origin = true;
    group.common_origin = {origin[0], origin[1], origin[2]};
    for (size_t k = 0; k < 3; ++k) {
        for (size_t i = 0; i < group.count; ++i)
            direction[k][i] = directions(i, 0, k);
        group.direction[k] = direction[k].data();
    }
    group.t_min = IntervalEnds(zero.data());
    group.t_max = IntervalEnds(one.data());
    WideNode node{};
    for (size_t i = 0; i < BLOCK_WIDTH; ++i)
        for (size_t face = 0; face < 6; ++face)
            node.faces[face][i] = corners(i, face / 3, face % 3);

    WidePacket packet{load_packet<CommonOrigin>(group, 0).rays, 0, 0, 1};
    if (packet.rays.active == 0)
        throw nb::value_error("a moderate direction");
    const LaneBits along = packet.choose_axis(packet.rays.active);
    packet.rays.active = along;
    const PacketFrustum frustum(packet.rays, packet.main_axis, packet.side);
    SeenBoxes boxes;
    const uint32_t by_all = to_bits(frustum.entered_by(along, node, boxes));
    std::array<uint32_t, BLOCK_WIDTH> rays;
    for (uint32_t i = 0; i < BLOCK_WIDTH; ++i)
        rays[i] = along & frustum.entering(boxes, i, FloatPacket(INFINITE));
    std::array<uint32_t, PACKET_WIDTH> alone{};
    for_each_lane(along, [&](uint32_t lane) {
        alone[lane] = to_bits(frustum.entered_by(1u << lane, node, boxes));
    });
    return nb::make_tuple(along, by_all, rays, alone);
}

} // namespace

void bind_wide_selftest(nb::module_ &m) {
    nb::module_ s = m.def_submodule("wide_selftest");
    s.def("wide_tree", &wide_tree, nb::arg("triangles"), nb::arg("options"),
          "The bits of the root, and nodes (N, 64) and blocks (N, 80) as 32-bit words as "
          "they lie in memory.");
    s.def("is_made", &is_made, nb::arg("triangles"), nb::arg("cancelled"),
          nb::arg("options"));
    s.def("seen_alone", &seen_alone);
    s.def("seen_in_packet", &seen_in_packet);
    s.def("entered_boxes", &entered_boxes);
    s.attr("max_wide_depth") = MAX_WIDE_DEPTH;
}

} // namespace mlrt
