#include "render/tile.h"

#include "render/emitter_sampling.h"
#include "render/shadow_offset.h"
#include "render/shadow_segment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace mlrt {

namespace {

LaneBits not_black(const Vec3<FloatPacket> &colour) {
    const FloatPacket zero(0.0f);
    return to_bits((colour.x != zero) | (colour.y != zero) | (colour.z != zero));
}

// What the sides that the rays see reflect.
Vec3<FloatPacket> albedo_of(const PreparedScene &scene, const FaceNumbers &faces,
                            LaneBits seen_from_front) {
    const auto of_lane = [&](uint32_t lane) -> Vec3f {
        const Shape &shape = scene.data.shapes[scene.shape_of_face[faces[lane]]];
        if (shape.material == NONE)
            return {};
        const Material &material = scene.data.materials[shape.material];
        return (seen_from_front >> lane & 1) ? material.front : material.back;
    };
    LaneArray<float> colour[3];
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
        const Vec3f albedo = of_lane(lane);
        for (int k = 0; k < 3; ++k)
            colour[k][lane] = albedo[k];
    }
    return {load<FloatPacket>(colour[0]), load<FloatPacket>(colour[1]),
            load<FloatPacket>(colour[2])};
}

Vec3<FloatPacket> load_vectors(const std::vector<float> (&components)[3], size_t first) {
    return {load<FloatPacket>(components[0].data() + first),
            load<FloatPacket>(components[1].data() + first),
            load<FloatPacket>(components[2].data() + first)};
}

} // namespace

void TileRenderer::Rays::resize(size_t new_count, size_t channels) {
    count = new_count;
    const size_t whole = (count + PACKET_WIDTH - 1) / PACKET_WIDTH * PACKET_WIDTH;
    for (std::vector<float> *array : {&film_x, &film_y, &light_x, &light_y, &t_min, &t_max,
                                      &t, &direction[0], &direction[1], &direction[2]})
        array->resize(whole);
    for (std::vector<uint32_t> *array : {&stream_seed, &stream_index, &primitive})
        array->resize(whole);
    std::fill(primitive.begin() + ptrdiff_t(count), primitive.end(), NO_PRIMITIVE);
    values.resize(channels);
    for (std::vector<float> &channel : values)
        channel.assign(whole, 0.0f);
}

void TileRenderer::render(const PixelGroup &group) {
    rays_.resize(group.pixels.size() * group.sample_count, target_.channels.count);
    candidates_.reset(rays_.count);
    if (target_.cost)
        rays_.cost.assign(rays_.count, 0.0f);
    generate(group);
    trace_camera_rays(group);
    shade_hits();
    pass_hidden_emitters();
    shadow_tracer_.keep_costs(target_.cost != nullptr);
    shadow_tracer_.trace(candidates_, [&](uint32_t i) {
        const uint32_t ray = candidates_.ray[i];
        for (int k = 0; k < 3; ++k)
            rays_.values[k][ray] += candidates_.contribution[k][i];
    });
    if (target_.cost)
        shadow_tracer_.add_costs_to(candidates_, rays_.cost.data());
    write(group);
}

void TileRenderer::generate(const PixelGroup &group) {
    const PixelRect &sampled = target_.blocks.sampled();
    size_t ray = 0;
    for (const Pixel &pixel : group.pixels) {
        streams_.streams(pixel.row * sampled.width + pixel.column, group.first_sample,
                         group.sample_count, &rays_.stream_seed[ray],
                         &rays_.stream_index[ray]);
        ray += group.sample_count;
    }
    // Numbers for a light are drawn for rays that hit nothing too: a stream serves one ray.
    draw_numbers(rays_.stream_seed.data(), rays_.stream_index.data(), rays_.count,
                 {rays_.film_x.data(), rays_.film_y.data(), rays_.light_x.data(),
                  rays_.light_y.data()});
    float *film_x = rays_.film_x.data(), *film_y = rays_.film_y.data();
    for (const Pixel &pixel : group.pixels) {
        const float x = float(sampled.x + int(pixel.column));
        const float y = float(sampled.y + int(pixel.row));
        for (uint32_t i = 0; i < group.sample_count; ++i) {
            film_x[i] += x;
            film_y[i] += y;
        }
        film_x += group.sample_count;
        film_y += group.sample_count;
    }
    const CameraMap &camera = scene_.plane.single;
    for (size_t i = 0; i < rays_.t.size(); i += PACKET_WIDTH) {
        const FloatPacket x = load<FloatPacket>(&rays_.film_x[i]);
        const FloatPacket y = load<FloatPacket>(&rays_.film_y[i]);
        const Vec3<FloatPacket> d =
            (in_all_lanes(camera.base) + x * in_all_lanes(camera.dx)) +
            y * in_all_lanes(camera.dy);
        for (int k = 0; k < 3; ++k)
            store(&rays_.direction[k][i], d[k]);
    }
    std::fill(rays_.t_min.begin(), rays_.t_min.end(), scene_.plane.near_clip);
    std::fill(rays_.t_max.begin(), rays_.t_max.end(), scene_.plane.far_clip);
}

void TileRenderer::trace_camera_rays(const PixelGroup &group) {
    RayGroup rays;
    rays.count = uint32_t(rays_.count);
    rays.has_common_origin = true;
    rays.common_origin = scene_.plane.origin;
    for (int k = 0; k < 3; ++k)
        rays.direction[k] = rays_.direction[k].data();
    rays.t_min = rays_.t_min.data();
    rays.t_max = rays_.t_max.data();
    rays.cost = target_.cost ? rays_.cost.data() : nullptr;

    const PixelRect &sampled = target_.blocks.sampled();
    const int x = sampled.x + int(group.pixels[0].column);
    const int y = sampled.y + int(group.pixels[0].row);
    CameraTile tile;
    tile.camera = scene_.plane.single;
    tile.x = uint32_t(x);
    tile.y = uint32_t(y);
    tile.size = group.side;
    tile.samples = group.sample_count;
    const bool is_square = group.side > 0 && x >= 0 && y >= 0;
    trace_closest(*scene_.data.tree, rays, options_,
                  HitGroup{rays_.t.data(), rays_.primitive.data()}, counters_.primary,
                  is_square ? &tile : nullptr);
}

void TileRenderer::shade_hits() {
    HitPacket hit;
    hit.origin = in_all_lanes(scene_.plane.origin);
    for (size_t first = 0; first < rays_.count; first += PACKET_WIDTH) {
        hit.lanes = 0;
        uint32_t any_face = NO_PRIMITIVE;
        for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
            hit.ray[lane] = uint32_t(first) + lane;
            hit.faces[lane] = rays_.primitive[first + lane];
            hit.lanes |= LaneBits(hit.faces[lane] != NO_PRIMITIVE) << lane;
            any_face = std::min(any_face, hit.faces[lane]);
        }
        if (hit.lanes == 0)
            continue;
        for_each_lane(ALL_LANES & ~hit.lanes,
                      [&](uint32_t lane) { hit.faces[lane] = any_face; });
        hit.direction = load_vectors(rays_.direction, first);
        hit.light_x = load<FloatPacket>(&rays_.light_x[first]);
        hit.light_y = load<FloatPacket>(&rays_.light_y[first]);
        const SurfacePoint<FloatPacket> point =
            hit_surface<FloatPacket>(scene_, hit.origin, hit.direction, hit.faces);
        write_depth_and_normal(hit, point, first);
        shade(hit, point);
    }
}

void TileRenderer::write_depth_and_normal(const HitPacket &hit,
                                          const SurfacePoint<FloatPacket> &point,
                                          size_t first) {
    const FilmChannels &channels = target_.channels;
    const auto hits = from_bits<FloatPacket>(hit.lanes);
    const auto set = [&](int channel, const FloatPacket &value) {
        store(&rays_.values[channel][first], select(hits, value, FloatPacket(0.0f)));
    };
    // Mitsuba's distance: from the near plane, along the normalised direction.
    if (channels.depth >= 0)
        set(channels.depth,
            (load<FloatPacket>(&rays_.t[first]) - FloatPacket(scene_.plane.near_clip)) *
                length(hit.direction));
    for (int k = 0; k < 3 && channels.normal >= 0; ++k)
        set(channels.normal + k, point.shading_normal[k]);
}

// Mitsuba's direct.cpp with one emitter sample and no BSDF sample: light that the surface
// emits, and candidates for light that it reflects. A ray that contributes nothing, however
// its shadow ray fares, is left out as soon as that is known.
void TileRenderer::shade(const HitPacket &hit, const SurfacePoint<FloatPacket> &point) {
    const FloatPacket zero(0.0f);
    // Only its sign matters, so the direction need not have unit length.
    const FloatPacket cos_view = -dot(hit.direction, point.shading_normal);
    const LaneBits seen_from_front = to_bits(cos_view > zero);

    LaneBits lanes = add_emission(hit, point, seen_from_front) & to_bits(cos_view != zero);
    const Vec3<FloatPacket> albedo = albedo_of(scene_, hit.faces, seen_from_front);
    lanes &= not_black(albedo);
    if (lanes == 0 || scene_.data.emitters.empty())
        return;
    const EmitterSamples light =
        sample_emitter(scene_, point.p, hit.light_x, hit.light_y, lanes);
    const FloatPacket cosine = dot(light.direction, point.shading_normal);
    const FloatPacket cos_light = select(cos_view > zero, cosine, -cosine);
    lanes &= not_black(light.weight) & to_bits(cos_light > zero);
    if (lanes == 0)
        return;
    const ShadowSegment<FloatPacket> segment =
        offset_ == ShadowOffset::robust
            ? robust_segment<FloatPacket>(scene_, {hit.origin, hit.direction, hit.faces},
                                          light)
            : ShadowSegment<FloatPacket>{
                  offset_point(point.p, point.face_normal, light.target - point.p),
                  light.target};
    const FloatPacket share = FloatPacket(std::numbers::inv_pi_v<float>) * cos_light;
    candidates_.append(lanes, hit.ray, light.emitter, segment.start, segment.target,
                       (albedo * share) * light.weight);
}

// Adds what surfaces emit towards the camera. Returns the lanes to be shaded; those that
// met an emitter which is to be hidden go on behind it instead.
LaneBits TileRenderer::add_emission(const HitPacket &hit,
                                    const SurfacePoint<FloatPacket> &point,
                                    LaneBits seen_from_front) {
    const SceneData &data = scene_.data;
    if (!scene_.any_shape_glows)
        return hit.lanes;
    LaneBits hidden = 0;
    for_each_lane(hit.lanes, [&](uint32_t lane) {
        const uint32_t number = data.shapes[scene_.shape_of_face[hit.faces[lane]]].emitter;
        if (number == NONE)
            return;
        if (data.hide_emitters)
            hidden |= 1u << lane;
        else if (seen_from_front >> lane & 1)
            for (int k = 0; k < 3; ++k)
                rays_.values[k][hit.ray[lane]] += data.emitters[number].radiance[k];
    });
    if (hidden != 0) {
        const Vec3<FloatPacket> start =
            offset_ == ShadowOffset::robust
                ? robust_passage<FloatPacket>(scene_,
                                              {hit.origin, hit.direction, hit.faces})
                : offset_point(point.p, point.face_normal, hit.direction);
        for_each_lane(hidden, [&](uint32_t lane) {
            passing_.ray.push_back(hit.ray[lane]);
            for (int k = 0; k < 3; ++k)
                passing_.origin[k].push_back(start[k].entry(lane));
        });
    }
    return hit.lanes & ~hidden;
}

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
                d[k].push_back(rays_.direction[k][ray]);
        const std::vector<float> t_min(count, 0.0f);
        const std::vector<float> t_max(count, std::numeric_limits<float>::max());
        std::vector<float> t(count);
        std::vector<uint32_t> primitive(count);

        RayGroup group;
        group.count = uint32_t(count);
        for (int k = 0; k < 3; ++k) {
            group.origin[k] = passing.origin[k].data();
            group.direction[k] = d[k].data();
        }
        group.t_min = t_min.data();
        group.t_max = t_max.data();
        trace_closest(*scene_.data.tree, group, options_,
                      HitGroup{t.data(), primitive.data()}, counters_.primary);
        for (size_t first = 0; first < count; first += PACKET_WIDTH)
            shade_passed(passing, primitive, first);
    }
}

void TileRenderer::shade_passed(const PassingRays &passing,
                                const std::vector<uint32_t> &primitive, size_t first) {
    HitPacket hit;
    hit.lanes = 0;
    LaneArray<float> origin[3], d[3], light_x, light_y;
    // Lanes behind the last ray repeat it; lanes that hit nothing take any face.
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
        const size_t i = std::min(first + lane, passing.ray.size() - 1);
        const uint32_t ray = passing.ray[i];
        const bool hits = primitive[i] != NO_PRIMITIVE;
        hit.lanes |= LaneBits(hits && i == first + lane) << lane;
        hit.ray[lane] = ray;
        hit.faces[lane] = hits ? primitive[i] : 0;
        for (int k = 0; k < 3; ++k) {
            origin[k][lane] = passing.origin[k][i];
            d[k][lane] = rays_.direction[k][ray];
        }
        light_x[lane] = rays_.light_x[ray];
        light_y[lane] = rays_.light_y[ray];
    }
    if (hit.lanes == 0)
        return;
    for (int k = 0; k < 3; ++k) {
        hit.origin[k] = load<FloatPacket>(origin[k]);
        hit.direction[k] = load<FloatPacket>(d[k]);
    }
    hit.light_x = load<FloatPacket>(light_x);
    hit.light_y = load<FloatPacket>(light_y);
    shade(hit, hit_surface<FloatPacket>(scene_, hit.origin, hit.direction, hit.faces));
}

void TileRenderer::write(const PixelGroup &group) {
    const Film &film = scene_.data.film;
    const PixelRect &sampled = target_.blocks.sampled();
    std::vector<const float *> values(target_.channels.count);
    size_t ray = 0;
    for (const Pixel &pixel : group.pixels) {
        const uint32_t column = pixel.column + uint32_t(sampled.x) - film.crop_x;
        const uint32_t row = pixel.row + uint32_t(sampled.y) - film.crop_y;
        if (target_.primitive && group.first_sample == 0 && column < film.crop_width &&
            row < film.crop_height)
            target_.primitive[size_t(row) * film.crop_width + column] =
                int32_t(rays_.primitive[ray]);
        if (target_.cost && column < film.crop_width && row < film.crop_height) {
            float &cost = target_.cost[size_t(row) * film.crop_width + column];
            for (uint32_t i = 0; i < group.sample_count; ++i)
                cost += rays_.cost[ray + i] / float(streams_.samples_per_pixel());
        }
        for (uint32_t k = 0; k < target_.channels.count; ++k)
            values[k] = &rays_.values[k][ray];
        target_.blocks.add(pixel.column, pixel.row, group.sample_count, &rays_.film_x[ray],
                           &rays_.film_y[ray], values.data());
        ray += group.sample_count;
    }
}

} // namespace mlrt
