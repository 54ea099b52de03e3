// Shading of packets whose rays all meet one face of one colour, as most do in most scenes,
// with Mitsuba's offset of shadow rays. The same light as in emitter_light.cpp, bit for
// bit; what all lanes have in common is found once. Steps are short, as in shade_hits().
#include "render/area_light.h"
#include "render/emitter_sampling.h"
#include "render/point_on_face.h"
#include "render/tile.h"

namespace mlrt {

namespace {

struct PlainLight {
    Vec3<FloatPacket> weight, direction, target; // as of an EmitterSample
};

[[gnu::always_inline]] inline PlainLight from_points(const PointLight<FloatPacket> &light,
                                                     const FloatPacket &choice_weight,
                                                     const Vec3<FloatPacket> &p) {
    const PointLightSample<FloatPacket> sample = sample_point_light(light, p);
    const FloatPacket factor = sample.factor * choice_weight;
    return {by_axis([&](int k) {
                return select(sample.has_light, factor * light.intensity[k],
                              FloatPacket(0.0f));
            }),
            sample.direction, light.position};
}

[[gnu::always_inline]] inline PlainLight from_rectangle(const Emitter &emitter,
                                                        const EmitterTable &table,
                                                        const EmitterChoices &choices,
                                                        const Vec3<FloatPacket> &p,
                                                        const FloatPacket &y) {
    const Vec3<FloatPacket> point = point_on_rectangle(emitter, choices.x, y);
    const AreaLightSample<FloatPacket> sample = sample_area_light(
        point, in_all_lanes(table.normal), FloatPacket(table.inverse_area), p);
    const FloatPacket factor = choices.weight / sample.density;
    return {by_axis([&](int k) {
                return select(sample.has_light, factor * emitter.radiance[k],
                              FloatPacket(0.0f));
            }),
            sample.direction, point};
}

// Of one of the emitters of a scene without objects.
[[gnu::always_inline]] inline PlainLight
from_emitter(const PreparedScene &scene, uint32_t number, const EmitterChoices &choices,
             const Vec3<FloatPacket> &p, const FloatPacket &y) {
    const Emitter &emitter = scene.data.emitters[number];
    const EmitterTable &table = scene.emitter_tables[number];
    if (emitter.rectangle && emitter.radiance_texture == NONE && table.inverse_area > 0)
        return from_rectangle(emitter, table, choices, p, y);
    if (emitter.type == EmitterType::point || emitter.type == EmitterType::spot)
        return from_points(lights_in_all_lanes(table.point), choices.weight, p);
    const EmitterSample<FloatPacket> light = sample_chosen(scene, number, choices, p, y);
    return {light.weight, light.direction, light.target};
}

// Of the emitters that the given lanes chose.
PlainLight from_chosen(const PreparedScene &scene, const EmitterChoices &choices,
                       LaneBits lanes, const Vec3<FloatPacket> &p, const FloatPacket &y) {
    if (scene.all_emitters_are_points) {
        const EmitterSample<FloatPacket> light =
            sample_chosen_points(scene, choices, lanes, p);
        return {light.weight, light.direction, light.target};
    }
    return light_of_chosen(choices.emitter, lanes, [&](uint32_t number) {
        return from_emitter(scene, number, choices, p, y);
    });
}

} // namespace

bool TileRenderer::shades_plainly() const {
    return offset_ == ShadowOffset::mitsuba && bsdf_samples_ == 0 && !scene_.data.objects &&
           scene_.plane.has_common_origin() && target_.channels.depth < 0 &&
           target_.channels.normal < 0 && !shadows_.empty();
}

// Keeps the packet to be shaded if it is plain. False if there are several faces, or sides
// of one, or if the face glows or has a texture.
bool TileRenderer::find_plain_packet(size_t first, const UIntPacket &faces, LaneBits hits) {
    const uint32_t number = primitive_[first + uint32_t(__builtin_ctz(hits))];
    if ((hits & ~to_bits(faces == UIntPacket(number))) != 0)
        return false;
    const uint32_t shape = scene_.shape_of_face[number];
    const Material &material = scene_.shape_materials[shape];
    if (scene_.data.shapes[shape].emitter != NONE || material.is_textured())
        return false;

    const FloatPacket zero(0.0f);
    const Vec3<FloatPacket> direction = samples_.directions(first);
    const HitFace &face = faces_.of(number);
    const SurfacePoint<FloatPacket> point = point_on(direction, face);
    const FloatPacket cos_view = -dot(direction, point.shading_normal);
    const LaneBits lanes = hits & to_bits(cos_view != zero);
    const LaneBits front = lanes & to_bits(cos_view > zero);
    if (front != 0 && front != lanes)
        return false;
    const Vec3f colour = front != 0 ? material.front : material.back;
    if (lanes == 0 || colour == Vec3f{})
        return true;
    PlainPacket &packet = plain_packets_[plain_count_++];
    packet.first = first;
    packet.lanes = lanes;
    packet.front = front != 0;
    packet.colour = colour;
    packet.face_normal = face.parts.normal;
    packet.p = point.p;
    packet.shading_normal = point.shading_normal;
    return true;
}

void TileRenderer::shade_plain_packets() {
    const std::span packets = std::span(plain_packets_).first(plain_count_);
    plain_count_ = 0;
    const FloatPacket zero(0.0f);
    const auto reflect = [&](PlainPacket &packet, const PlainLight &light) {
        const FloatPacket cosine = dot(light.direction, packet.shading_normal);
        const FloatPacket cos_light = packet.front ? cosine : -cosine;
        packet.lit = packet.lanes & not_black(light.weight) & to_bits(cos_light > zero);
        packet.target = light.target;
        packet.start = offset_point(packet.p, in_all_lanes(packet.face_normal),
                                    light.target - packet.p);
        const FloatPacket share = factors_of(packet.emitters, packet.lit) * cos_light;
        packet.number = reflected_.add(packet.first, (in_all_lanes(packet.colour) * share) *
                                                         light.weight);
    };
    for (uint32_t sample = 0; sample < emitter_samples_; ++sample) {
        for (PlainPacket &packet : packets) {
            const auto x = load<FloatPacket>(samples_.light_x(sample) + packet.first);
            if (scene_.few_points) {
                const EmitterChoices choices = choose_few_points(scene_, x);
                packet.emitters = choices.emitter;
                reflect(packet,
                        from_points(lights_of(scene_.few_points->lights, choices.emitter),
                                    choices.weight, packet.p));
                continue;
            }
            const EmitterChoices choices = choose_emitters(scene_, x);
            packet.emitters = choices.emitter;
            reflect(packet, from_chosen(scene_, choices, packet.lanes, packet.p,
                                        load<FloatPacket>(samples_.light_y(sample) +
                                                          packet.first)));
        }
        for (const PlainPacket &packet : packets) {
            const auto append = [&](uint32_t emitter, LaneBits lit) {
                shadows_[emitter].append(lit, packet.number, packet.start, packet.target);
            };
            if (shadows_.size() > 1)
                for_each_value(packet.emitters, packet.lit, append);
            else if (packet.lit != 0)
                append(0, packet.lit);
        }
    }
}

} // namespace mlrt
