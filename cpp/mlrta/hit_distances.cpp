#include "mlrta/hit_distances.h"

#include "traverse/load_packet.h"

#include <bit>

namespace mlrt {

const HitDistances::Plane &HitDistances::plane_of(uint32_t primitive) {
    std::optional<Plane> &known = planes_[primitive % SIZE];
    if (!known || known->primitive != primitive) {
        const Triangle &triangle = tree_.triangles[primitive];
        const TrianglePlane plane(triangle);
        known = {primitive, plane, {plane, Vec3d(triangle.a) - Vec3d(origin_)}};
    }
    return *known;
}

FloatPacket HitDistances::of(const RayGroup &rays, uint32_t first_ray, LaneBits lanes,
                             const UIntPacket &primitives, Counters &counters) {
    const auto direction = by_axis([&](int k) {
        return to_double(load_padded(rays.direction[k], first_ray, rays.count));
    });
    const DoublePacket max_direction = maximum(
        absolute(direction.x), maximum(absolute(direction.y), absolute(direction.z)));
    // Lanes without a triangle divide by one.
    DoublePacket numerator(0.0), numerator_error(0.0);
    DoublePacket denominator(1.0), denominator_error(0.0);
    for_each_value(primitives, lanes, [&](uint32_t primitive, LaneBits holders) {
        const Plane &known = plane_of(primitive);
        const auto mask = from_bits<DoublePacket>(holders);
        const auto set = [&](DoublePacket &packet, const DoublePacket &value) {
            packet = select(mask, value, packet);
        };
        set(numerator, known.numerator.value);
        set(numerator_error, known.numerator.error);
        set(denominator, known.plane.denominator(direction));
        set(denominator_error, known.plane.denominator_error());
    });
    const PlaneDistance<DoublePacket> distance(numerator, numerator_error, denominator,
                                               denominator_error * max_direction);
    const FloatPacket t = distance.rounded<FloatPacket>();
    const LaneBits open = lanes & ~to_bits(distance.certain<FloatPacket>());
    if (open == 0)
        return t;
    counters.exact_distances += uint64_t(std::popcount(open));
    const LaneArray<uint32_t> numbers = to_lanes<uint32_t>(primitives);
    LaneArray<float> distances = to_lanes<float>(t);
    for_each_lane(open, [&](uint32_t lane) {
        const uint32_t ray = first_ray + lane;
        distances[lane] = exact_distance(
            origin_,
            {rays.direction[0][ray], rays.direction[1][ray], rays.direction[2][ray]},
            tree_.triangles[numbers[lane]]);
    });
    return load<FloatPacket>(distances);
}

} // namespace mlrt
