// Camera rays that go on behind emitters that are to be hidden: the part of a tile that
// other scenes never enter.
#include "render/tile.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace mlrt {

// Each round sends the rays that met a hidden emitter on from behind it. It ends: a ray
// leaves the plane of a face for good, because the offset exceeds the rounding error of its
// origin.
void TileRenderer::pass_hidden_emitters() {
    while (!passing_.ray.empty()) {
        const PassingRays passing = std::exchange(passing_, {});
        const size_t count = passing.ray.size();
        std::vector<float> d[3];
        for (int k = 0; k < 3; ++k)
            for (const uint32_t ray : passing.ray)
                d[k].push_back(samples_.direction(k)[ray]);
        Hits hits;
        hits.primitive.resize(count);
        if (scene_.data.objects) {
            hits.t.resize(count);
            hits.instance.resize(count);
        }

        RayGroup group;
        group.count = uint32_t(count);
        for (int k = 0; k < 3; ++k) {
            group.origin[k] = passing.origin[k].data();
            group.direction[k] = d[k].data();
        }
        group.t_max = IntervalEnds::of_all(std::numeric_limits<float>::max());
        trace(group, nullptr, scene_.data.objects ? hits.t.data() : nullptr,
              hits.primitive.data(), hits.instance.data());
        for (size_t first = 0; first < count; first += PACKET_WIDTH)
            shade_passed(passing, hits, first);
    }
}

void TileRenderer::shade_passed(const PassingRays &passing, const Hits &hits,
                                size_t first) {
    ShadedPacket packet;
    HitPacket &hit = packet.hit;
    LaneArray<uint32_t> rays, faces, instances;
    LaneArray<float> origin[3], d[3], t;
    // Lanes behind the last ray repeat it.
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
        const size_t i = std::min(first + lane, passing.ray.size() - 1);
        const uint32_t ray = passing.ray[i];
        const bool is_hit = i == first + lane && hits.primitive[i] != NO_PRIMITIVE;
        hit.lanes |= LaneBits(is_hit) << lane;
        rays[lane] = ray;
        faces[lane] = hits.primitive[i];
        t[lane] = scene_.data.objects ? hits.t[i] : 0;
        instances[lane] = scene_.data.objects ? hits.instance[i] : NO_INSTANCE;
        for (int k = 0; k < 3; ++k) {
            origin[k][lane] = passing.origin[k][i];
            d[k][lane] = samples_.direction(k)[ray];
        }
    }
    if (hit.lanes == 0)
        return;
    for (int k = 0; k < 3; ++k) {
        hit.origin[k] = load<FloatPacket>(origin[k]);
        hit.direction[k] = load<FloatPacket>(d[k]);
    }
    hit.ray = load<UIntPacket>(rays);
    hit.faces = load<UIntPacket>(faces);
    hit.t = load<FloatPacket>(t);
    hit.instances = load<UIntPacket>(instances);
    packet.point = surface_of(scene_, faces_, hit, false);
    shade({&packet, 1});
}

} // namespace mlrt
