// The renderer's parts one by one, for tests that compare each with Mitsuba's.
#include "bind/bind.h"
#include "bind/fields.h"
#include "bind/scene_handle.h"
#include "render/camera.h"
#include "render/emitter_sampling.h"
#include "render/face_cache.h"
#include "render/film_blocks.h"
#include "render/number_packets.h"
#include "render/picture_film.h"
#include "render/picture_memory.h"
#include "render/sampler.h"
#include "render/shadow_offset.h"
#include "render/shadow_segment.h"
#include "render/spread_samples.h"
#include "render/surface.h"
#include "render/work_items.h"

#include <array>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>
#include <vector>

namespace nb = nanobind;

namespace mlrt {

namespace {

using Floats3 = std::array<float, 3>;
using Doubles3 = std::array<double, 3>;

Vec3f vector(const Floats3 &v) {
    return {v[0], v[1], v[2]};
}

template <typename T>
std::array<T, 3> array(Vec3<T> v) {
    return {v.x, v.y, v.z};
}

std::vector<float> sampler_stream(uint32_t seed, uint32_t pixel_count, uint32_t samples,
                                  uint32_t pixel, uint32_t sample, uint32_t dimensions) {
    Pcg32 random = SampleStreams(seed, pixel_count, samples).stream(pixel, sample).open();
    std::vector<float> numbers(dimensions);
    for (float &number : numbers)
        number = random.next_float();
    return numbers;
}

// Of whole packets of streams, what each draws: 2 numbers, 1 number, or one that is dropped
// for 0.
std::vector<std::vector<float>> packet_streams(const std::vector<uint32_t> &seeds,
                                               const std::vector<uint32_t> &indices,
                                               const std::vector<int> &drawn) {
    const size_t count = seeds.size();
    std::vector<std::vector<float>> x(drawn.size(), std::vector<float>(count)), y = x;
    std::vector<NumberPair> pairs;
    for (size_t i = 0; i < drawn.size(); ++i)
        pairs.push_back(
            {drawn[i] > 0 ? x[i].data() : nullptr, drawn[i] > 1 ? y[i].data() : nullptr});
    draw_numbers(seeds.data(), indices.data(), count, pairs);
    std::vector<std::vector<float>> numbers(count);
    for (size_t stream = 0; stream < count; ++stream)
        for (size_t i = 0; i < drawn.size(); ++i) {
            if (drawn[i] > 0)
                numbers[stream].push_back(x[i][stream]);
            if (drawn[i] > 1)
                numbers[stream].push_back(y[i][stream]);
        }
    return numbers;
}

// Pairs of numbers, one after the other; 1: a single number that is dropped, else 2.
std::vector<float> spread_sample(const nb::dict &dict, uint32_t seed, uint32_t samples,
                                 uint32_t index, const std::vector<int> &drawn) {
    const Sampler sampler = sampler_from(dict);
    std::vector<float> x(drawn.size()), y(drawn.size()), numbers;
    std::vector<NumberPair> pairs;
    for (size_t i = 0; i < drawn.size(); ++i)
        pairs.push_back(drawn[i] == 2 ? NumberPair{&x[i], &y[i]} : NumberPair{});
    draw_spread_numbers(sampler, &seed, &index, 1, samples, pairs);
    for (size_t i = 0; i < drawn.size(); ++i)
        if (drawn[i] == 2)
            numbers.insert(numbers.end(), {x[i], y[i]});
    return numbers;
}

Floats3 camera_direction(const nb::dict &camera, const nb::dict &film, float x, float y) {
    return array(image_plane(camera_from(camera), film_from(film)).direction(x, y));
}

std::vector<float> filter_weights(const nb::dict &film,
                                  const std::vector<float> &distances) {
    const ReconstructionFilter filter(film_from(film));
    std::vector<float> weights;
    for (const float x : distances)
        weights.push_back(filter.weight(x));
    return weights;
}

// Samples of one channel, each of the pixel that its position lies in; what comes back is
// the value and the weight of every pixel of the crop, row by row.
std::pair<std::vector<float>, std::vector<float>>
accumulate(const nb::dict &film_dict, const std::vector<std::array<float, 3>> &samples) {
    const Film film = film_from(film_dict);
    FilmBlocks blocks(film, 1, uint32_t(samples.size()));
    const PixelRect &sampled = blocks.sampled();
    for (const auto &[x, y, value] : samples) {
        const float *values = &value;
        blocks.add(uint32_t(int(std::floor(x)) - sampled.x),
                   uint32_t(int(std::floor(y)) - sampled.y), 0, 1, &x, &y, &values);
    }
    std::vector<float> sums, weights;
    for (uint32_t row = 0; row < film.crop_height; ++row)
        for (uint32_t column = 0; column < film.crop_width; ++column) {
            float sum = 0;
            weights.push_back(blocks.pixel(column, row, &sum));
            sums.push_back(sum);
        }
    return {sums, weights};
}

// What a film makes of the samples of one channel, which the three colours share: those of
// each pixel of the crop row by row, added in groups of up to rays_per_group.
std::vector<float> picture(const nb::dict &film_dict, uint32_t samples_per_pixel,
                           uint32_t rays_per_group, const std::vector<float> &samples) {
    const Film film = film_from(film_dict);
    const size_t pixels = size_t(film.crop_width) * film.crop_height;
    if (!ReconstructionFilter(film).is_box() ||
        samples.size() != pixels * samples_per_pixel)
        refuse_value("The filter must be a box, with samples for each pixel.");
    std::vector<float> image(3 * pixels);
    PictureFilm picture_film(film, samples_per_pixel, {image.data(), {}});
    const WorkItems items(picture_film.sampled(), samples_per_pixel, rays_per_group);
    for (uint32_t item = 0; item < items.count(); ++item)
        items.for_each_group(item, [&](const PixelGroup &group) {
            std::vector<float> values;
            for (size_t i = 0; i < group.offsets.size(); ++i) {
                const Pixel pixel = group.pixel(i);
                const size_t number = size_t(pixel.row) * film.crop_width + pixel.column;
                for (uint32_t k = 0; k < group.sample_count; ++k)
                    values.push_back(
                        samples[number * samples_per_pixel + group.first_sample + k]);
            }
            const float *colours[3] = {values.data(), values.data(), values.data()};
            picture_film.add(group, nullptr, nullptr, colours);
        });
    return image;
}

nb::dict emitter_sample(const SceneHandle &handle, const Floats3 &p, float x, float y) {
    const OneEmitterSample sample = sample_emitter(*handle.scene, vector(p), x, y);
    nb::dict result;
    result["emitter"] = sample.emitter == NONE ? -1 : int64_t(sample.emitter);
    result["weight"] = array(sample.weight);
    result["direction"] = array(sample.direction);
    result["target"] = array(sample.target);
    return result;
}

nb::dict hit_surface_of(const SceneHandle &handle, const Floats3 &origin,
                        const Floats3 &direction, uint32_t primitive) {
    const SurfacePoint<float> point =
        hit_surface(*handle.scene, vector(origin), vector(direction), primitive);
    nb::dict result;
    result["p"] = array(point.p);
    result["face_normal"] = array(point.face_normal);
    result["shading_normal"] = array(point.shading_normal);
    result["shape"] = handle.scene->shape_of_face[primitive];
    return result;
}

using Vectors = std::vector<Floats3>;

Vec3<FloatPacket> packet_of(const Vectors &vectors) {
    LaneArray<float> lanes[3];
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane)
        for (int k = 0; k < 3; ++k)
            lanes[k][lane] = vectors.at(lane)[k];
    return {load<FloatPacket>(lanes[0]), load<FloatPacket>(lanes[1]),
            load<FloatPacket>(lanes[2])};
}

Vectors vectors_of(const Vec3<FloatPacket> &packet) {
    Vectors vectors(PACKET_WIDTH);
    for (int k = 0; k < 3; ++k) {
        const LaneArray<float> lanes = to_lanes<float>(packet[k]);
        for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane)
            vectors[lane][k] = lanes[lane];
    }
    return vectors;
}

nb::dict hit_packet(const SceneHandle &handle, const Vectors &origins,
                    const Vectors &directions, const std::vector<uint32_t> &primitives) {
    FaceNumbers faces;
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane)
        faces[lane] = primitives.at(lane);
    const Vec3<FloatPacket> o = packet_of(origins), d = packet_of(directions);
    const Vec2<FloatPacket> at = barycentrics_of(o, d, corners_of(*handle.scene, faces));
    FaceCache cache(*handle.scene, {});
    const SurfacePoint<FloatPacket> point =
        hit_surfaces(cache, &o, d, load<UIntPacket>(faces), ALL_LANES);
    nb::dict result;
    result["weights"] = vectors_of({at.x, at.y, FloatPacket(0.0f)});
    result["p"] = vectors_of(point.p);
    result["face_normal"] = vectors_of(point.face_normal);
    result["shading_normal"] = vectors_of(point.shading_normal);
    return result;
}

nb::dict emitter_packet(const SceneHandle &handle, const Vectors &points,
                        const Vectors &numbers) {
    const Vec3<FloatPacket> p = packet_of(points), random = packet_of(numbers);
    const EmitterChoices choices = choose_emitters(*handle.scene, random.x);
    Vectors weight(PACKET_WIDTH), direction(PACKET_WIDTH), target(PACKET_WIDTH);
    const PreparedScene &scene = *handle.scene;
    for_each_value(choices.emitter, ALL_LANES, [&](uint32_t emitter, LaneBits lanes) {
        const EmitterSample<FloatPacket> sample =
            scene.all_emitters_are_points
                ? sample_chosen_points(scene, choices, lanes, p)
                : sample_chosen(scene, emitter, choices, p, random.y);
        const Vectors weights = vectors_of(sample.weight);
        const Vectors directions = vectors_of(sample.direction);
        const Vectors targets = vectors_of(sample.target);
        for_each_lane(lanes, [&](uint32_t lane) {
            weight[lane] = weights[lane];
            direction[lane] = directions[lane];
            target[lane] = targets[lane];
        });
    });
    const LaneArray<uint32_t> emitters = to_lanes<uint32_t>(choices.emitter);
    nb::dict result;
    result["weight"] = weight;
    result["direction"] = direction;
    result["target"] = target;
    result["emitter"] = std::vector<uint32_t>(emitters.begin(), emitters.end());
    return result;
}

Floats3 offset_point_of(const Floats3 &p, const Floats3 &normal, const Floats3 &towards) {
    return array(offset_point(vector(p), vector(normal), vector(towards)));
}

nb::dict robust_segment_of(const SceneHandle &handle, const Floats3 &origin,
                           const Floats3 &direction, uint32_t primitive, float x, float y) {
    const PreparedScene &scene = *handle.scene;
    const Vec3f o = vector(origin), d = vector(direction);
    const Vec3f p = hit_surface(scene, o, d, primitive).p;
    const OneEmitterSample light = sample_emitter(scene, p, x, y);
    if (light.emitter == NONE)
        refuse_value("The scene must have an emitter.");
    const auto [start, target] = robust_segment<float>(
        scene, hit_plane<float>(scene, {o, d, primitive}), light.emitter, light);
    nb::dict result;
    result["start"] = array(start);
    result["target"] = array(target);
    result["light"] = array(light.target);
    result["face"] = light.target_face == NONE ? -1 : int64_t(light.target_face);
    result["from_light"] = scene.emitter_tables[light.emitter].shadow_rays_from_light;
    return result;
}

} // namespace

void bind_render_selftest(nb::module_ &m) {
    nb::module_ s = m.def_submodule("render_selftest", "Parts of the renderer, for tests.");
    s.def(
        "packet_streams", &packet_streams, nb::arg("seeds"), nb::arg("indices"),
        nb::arg("drawn"),
        "Numbers of sixteen streams; drawn: 2 or 1 at a time, 0 for one that is dropped.");
    s.def("sampler_stream", &sampler_stream, nb::arg("seed"), nb::arg("pixel_count"),
          nb::arg("samples"), nb::arg("pixel"), nb::arg("sample"), nb::arg("dimensions"));
    s.def("spread_sample", &spread_sample, nb::arg("sampler"), nb::arg("seed"),
          nb::arg("samples"), nb::arg("index"), nb::arg("drawn"),
          "Numbers of one sample; drawn: 2 for each pair, 1 for a number that is dropped.");
    s.def("camera_direction", &camera_direction, nb::arg("camera"), nb::arg("film"),
          nb::arg("x"), nb::arg("y"));
    s.def("kept_picture_bytes", &kept_picture_bytes);
    s.def("filter_weights", &filter_weights, nb::arg("film"), nb::arg("distances"));
    s.def("accumulate", &accumulate, nb::arg("film"), nb::arg("samples"));
    s.def("picture", &picture, nb::arg("film"), nb::arg("samples_per_pixel"),
          nb::arg("rays_per_group"), nb::arg("samples"));
    s.def("sample_emitter", &emitter_sample, nb::arg("scene"), nb::arg("p"), nb::arg("x"),
          nb::arg("y"));
    s.def("hit_surface", &hit_surface_of, nb::arg("scene"), nb::arg("origin"),
          nb::arg("direction"), nb::arg("primitive"));
    s.def("hit_packet", &hit_packet, nb::arg("scene"), nb::arg("origins"),
          nb::arg("directions"), nb::arg("primitives"),
          "hit_surface of sixteen rays, and the weights of the vertices b and c.");
    s.def("emitter_packet", &emitter_packet, nb::arg("scene"), nb::arg("points"),
          nb::arg("numbers"),
          "sample_emitter of sixteen points; numbers are x, y, unused.");
    s.def("offset_point", &offset_point_of, nb::arg("p"), nb::arg("normal"),
          nb::arg("towards"));
    s.def("robust_segment", &robust_segment_of, nb::arg("scene"), nb::arg("origin"),
          nb::arg("direction"), nb::arg("primitive"), nb::arg("x"), nb::arg("y"),
          "The ends of the shadow ray from a hit to the sample that x and y give; light is "
          "the sample itself, face where it lies on.");
    s.attr("SHADOW_EPSILON") = SHADOW_EPSILON;
}

} // namespace mlrt
