#include "render/tile.h"

#include "render/emitter_sampling.h"
#include "render/shadow_offset.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace mlrt {

namespace {

bool is_black(Vec3f colour) {
    return colour == Vec3f{};
}

} // namespace

void TileRenderer::Rays::resize(size_t count, size_t channels) {
    for (std::vector<float> *array : {&film_x, &film_y, &light_x, &light_y, &t_min, &t_max,
                                      &t, &direction[0], &direction[1], &direction[2]})
        array->resize(count);
    for (std::vector<uint32_t> *array : {&stream_seed, &stream_index, &primitive})
        array->resize(count);
    values.assign(count * channels, 0.0f);
}

void TileRenderer::render(const PixelGroup &group) {
    rays_.resize(group.pixels.size() * group.sample_count, target_.channels.count);
    candidates_.clear();
    passing_.clear();
    generate(group);
    trace_camera_rays(group);
    shade_hits();
    pass_hidden_emitters();
    shadow_tracer_.trace(candidates_, [&](const ShadowCandidate &candidate) {
        float *values = &rays_.values[size_t(candidate.ray) * target_.channels.count];
        for (int k = 0; k < 3; ++k)
            values[k] += candidate.contribution[k];
    });
    write(group);
}

void TileRenderer::generate(const PixelGroup &group) {
    const PixelRect &sampled = target_.blocks.sampled();
    const size_t count = rays_.t.size();
    size_t ray = 0;
    for (const Pixel &pixel : group.pixels) {
        const uint32_t number = pixel.row * sampled.width + pixel.column;
        for (uint32_t i = 0; i < group.sample_count; ++i, ++ray) {
            const SampleStreams::Stream stream =
                streams_.stream(number, group.first_sample + i);
            rays_.stream_seed[ray] = stream.seed;
            rays_.stream_index[ray] = stream.index;
        }
    }
    // Numbers for a light are drawn for rays that hit nothing too: a stream serves one ray.
    draw_numbers(rays_.stream_seed.data(), rays_.stream_index.data(), count,
                 {rays_.film_x.data(), rays_.film_y.data(), rays_.light_x.data(),
                  rays_.light_y.data()});
    ray = 0;
    for (const Pixel &pixel : group.pixels) {
        const float x = float(sampled.x + int(pixel.column));
        const float y = float(sampled.y + int(pixel.row));
        for (uint32_t i = 0; i < group.sample_count; ++i, ++ray) {
            rays_.film_x[ray] += x;
            rays_.film_y[ray] += y;
        }
    }
    for (ray = 0; ray < count; ++ray) {
        const Vec3f d = scene_.plane.direction(rays_.film_x[ray], rays_.film_y[ray]);
        for (int k = 0; k < 3; ++k)
            rays_.direction[k][ray] = d[k];
    }
    std::fill(rays_.t_min.begin(), rays_.t_min.end(), scene_.plane.near_clip);
    std::fill(rays_.t_max.begin(), rays_.t_max.end(), scene_.plane.far_clip);
}

void TileRenderer::trace_camera_rays(const PixelGroup &group) {
    RayGroup rays;
    rays.count = uint32_t(rays_.t.size());
    rays.has_common_origin = true;
    rays.common_origin = scene_.plane.origin;
    for (int k = 0; k < 3; ++k)
        rays.direction[k] = rays_.direction[k].data();
    rays.t_min = rays_.t_min.data();
    rays.t_max = rays_.t_max.data();

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
    const FilmChannels &channels = target_.channels;
    for (uint32_t ray = 0; ray < rays_.t.size(); ++ray) {
        const uint32_t primitive = rays_.primitive[ray];
        if (primitive == NO_PRIMITIVE)
            continue;
        const Vec3f d = direction(ray);
        const SurfacePoint point = hit_surface(scene_, scene_.plane.origin, d, primitive);
        float *values = &rays_.values[size_t(ray) * channels.count];
        // Mitsuba's distance: from the near plane, along the normalised direction.
        if (channels.depth >= 0)
            values[channels.depth] = (rays_.t[ray] - scene_.plane.near_clip) * length(d);
        if (channels.normal >= 0)
            for (int k = 0; k < 3; ++k)
                values[channels.normal + k] = point.shading_normal[k];
        shade(ray, point);
    }
}

// Mitsuba's direct.cpp with one emitter sample and no BSDF sample: light that the surface
// emits, and a candidate for light that it reflects.
void TileRenderer::shade(uint32_t ray, const SurfacePoint &point) {
    const SceneData &data = scene_.data;
    const Shape &shape = data.shapes[point.shape];
    const Vec3f d = direction(ray);
    // Only its sign matters, so the direction need not have unit length.
    const float cos_view = -dot(d, point.shading_normal);

    if (shape.emitter != NONE) {
        if (data.hide_emitters) {
            passing_.push_back({ray, offset_point(point.p, point.face_normal, d)});
            return;
        }
        float *values = &rays_.values[size_t(ray) * target_.channels.count];
        for (int k = 0; k < 3 && cos_view > 0; ++k)
            values[k] += data.emitters[shape.emitter].radiance[k];
    }

    if (shape.material == NONE || cos_view == 0)
        return;
    const Material &material = data.materials[shape.material];
    const Vec3f albedo = cos_view > 0 ? material.front : material.back;
    if (is_black(albedo))
        return;
    const EmitterSample light =
        sample_emitter(scene_, point.p, rays_.light_x[ray], rays_.light_y[ray]);
    if (is_black(light.weight))
        return;
    const float cosine = dot(light.direction, point.shading_normal);
    const float cos_light = cos_view > 0 ? cosine : -cosine;
    if (!(cos_light > 0))
        return;

    ShadowCandidate candidate;
    candidate.ray = ray;
    candidate.emitter = light.emitter;
    candidate.origin = offset_point(point.p, point.face_normal, light.target - point.p);
    candidate.target = light.target;
    candidate.contribution =
        (albedo * (std::numbers::inv_pi_v<float> * cos_light)) * light.weight;
    candidates_.push_back(candidate);
}

// Each round sends the rays that met a hidden emitter on from behind it. It ends: a ray
// leaves the plane of a face for good, because the offset exceeds the rounding error of its
// origin.
void TileRenderer::pass_hidden_emitters() {
    while (!passing_.empty()) {
        const std::vector<PassingRay> passing = std::exchange(passing_, {});
        const size_t count = passing.size();
        std::vector<float> origin[3], d[3];
        for (int k = 0; k < 3; ++k)
            for (const PassingRay &ray : passing) {
                origin[k].push_back(ray.origin[k]);
                d[k].push_back(rays_.direction[k][ray.ray]);
            }
        const std::vector<float> t_min(count, 0.0f);
        const std::vector<float> t_max(count, std::numeric_limits<float>::max());
        std::vector<float> t(count);
        std::vector<uint32_t> primitive(count);

        RayGroup group;
        group.count = uint32_t(count);
        for (int k = 0; k < 3; ++k) {
            group.origin[k] = origin[k].data();
            group.direction[k] = d[k].data();
        }
        group.t_min = t_min.data();
        group.t_max = t_max.data();
        trace_closest(*scene_.data.tree, group, options_,
                      HitGroup{t.data(), primitive.data()}, counters_.primary);
        for (size_t i = 0; i < count; ++i)
            if (primitive[i] != NO_PRIMITIVE)
                shade(passing[i].ray, hit_surface(scene_, passing[i].origin,
                                                  direction(passing[i].ray), primitive[i]));
    }
}

void TileRenderer::write(const PixelGroup &group) {
    const Film &film = scene_.data.film;
    const PixelRect &sampled = target_.blocks.sampled();
    size_t ray = 0;
    for (const Pixel &pixel : group.pixels) {
        const uint32_t column = pixel.column + uint32_t(sampled.x) - film.crop_x;
        const uint32_t row = pixel.row + uint32_t(sampled.y) - film.crop_y;
        if (target_.primitive && group.first_sample == 0 && column < film.crop_width &&
            row < film.crop_height)
            target_.primitive[size_t(row) * film.crop_width + column] =
                int32_t(rays_.primitive[ray]);
        for (uint32_t i = 0; i < group.sample_count; ++i, ++ray)
            target_.blocks.add(pixel.column, pixel.row, rays_.film_x[ray],
                               rays_.film_y[ray],
                               &rays_.values[ray * target_.channels.count]);
    }
}

} // namespace mlrt
