#include "render/reflected_light.h"

namespace mlrt {

void ReflectedLight::add_to(std::span<float *const, 3> colours) const {
    for (const Packet &packet : std::span(packets_).first(count_)) {
        if (packet.first) {
            const auto mask = from_bits<FloatPacket>(packet.shown);
            for (int k = 0; k < 3; ++k) {
                float *colour = colours[size_t(k)] + *packet.first;
                const FloatPacket before = load<FloatPacket>(colour);
                store(colour, select(mask, before + packet.light[k], before));
            }
            continue;
        }
        const LaneArray<uint32_t> rays = to_lanes<uint32_t>(packet.rays);
        for_each_lane(packet.shown, [&](uint32_t lane) {
            for (int k = 0; k < 3; ++k)
                colours[size_t(k)][rays[lane]] += packet.light[k].entry(lane);
        });
    }
}

} // namespace mlrt
