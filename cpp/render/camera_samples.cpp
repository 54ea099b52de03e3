#include "render/camera_samples.h"

#include "base/simd.h"
#include "render/number_packets.h"
#include "render/unit_disk.h"

#include <algorithm>

namespace mlrt {

CameraSamples::CameraSamples(const PreparedScene &scene, const SampleStreams &streams,
                             const Sampler &sampler, const PixelRect &sampled,
                             Wanted wanted)
    : scene_(scene), streams_(streams), sampler_(sampler), sampled_(sampled),
      wanted_(wanted), light_x_(std::max(1u, wanted.light_samples)),
      light_y_(light_x_.size()), bsdf_(wanted.bsdf_samples) {}

// A block passes all steps before the next one begins, so that numbers are still in the
// nearest cache where rays are made of them.
void CameraSamples::generate(const PixelGroup &group) {
    count_ = group.ray_count();
    lay_out(group);
    if (!streams_.in_one_pass())
        choose_streams(group);
    for (size_t begin = 0; begin < padded_count(); begin += BLOCK) {
        const size_t end = std::min(begin + BLOCK, padded_count());
        if (streams_.in_one_pass())
            follow_streams(group, begin, end);
        draw(begin, end);
        make_rays(group, begin, end);
        if (scene_.plane.type == CameraType::thinlens)
            refract(begin, end);
    }
}

// Numbers of the rays from begin to end.
void CameraSamples::draw(size_t begin, size_t end) {
    block_pairs_ = pairs_;
    for (NumberPair &pair : block_pairs_) {
        const size_t offset = pair.x == film_x_.data() ? film_offset(begin) : begin;
        pair.x = pair.x ? pair.x + offset : nullptr;
        pair.y = pair.y ? pair.y + offset : nullptr;
    }
    const size_t offset = streams_.in_one_pass() ? 0 : begin;
    const uint32_t *seeds = &seed_[offset], *streams = &stream_[offset];
    if (sampler_.type == SamplerType::independent)
        draw_numbers(seeds, streams, end - begin, block_pairs_);
    else
        draw_spread_numbers(sampler_, seeds, streams, end - begin,
                            streams_.samples_per_pixel(), block_pairs_);
}

void CameraSamples::make_rays(const PixelGroup &group, size_t begin, size_t end) {
    const ImagePlane &plane = scene_.plane;
    const Vec3<FloatPacket> base = in_all_lanes(plane.single.base);
    const Vec3<FloatPacket> dx = in_all_lanes(plane.single.dx);
    const Vec3<FloatPacket> dy = in_all_lanes(plane.single.dy);
    // Whole numbers of pixels, which floats hold exactly.
    const FloatPacket left(float(sampled_.x + int(group.left)));
    const FloatPacket top(float(sampled_.y + int(group.top)));
    AlignedVector<float> *mapped =
        plane.type == CameraType::orthographic ? origin_ : direction_;
    float *film_x = film_x_.data() + film_offset(begin),
          *film_y = film_y_.data() + film_offset(begin);
    for (size_t i = begin; i < end;
         i += PACKET_WIDTH, film_x += PACKET_WIDTH, film_y += PACKET_WIDTH) {
        const FloatPacket x =
            load<FloatPacket>(film_x) + (left + load<FloatPacket>(&column_[i]));
        const FloatPacket y =
            load<FloatPacket>(film_y) + (top + load<FloatPacket>(&row_[i]));
        if (wanted_.film_positions) {
            store(film_x, x);
            store(film_y, y);
        }
        const Vec3<FloatPacket> d = (base + x * dx) + y * dy;
        for (int k = 0; k < 3; ++k)
            store(&mapped[k][i], d[k]);
    }
}

// Rays through the middle of the lens become rays through points of it.
void CameraSamples::refract(size_t begin, size_t end) {
    const ImagePlane &plane = scene_.plane;
    for (size_t i = begin; i < end; i += PACKET_WIDTH) {
        const auto [u, v] =
            on_disk(load<FloatPacket>(&lens_u_[i]), load<FloatPacket>(&lens_v_[i]));
        for (int k = 0; k < 3; ++k) {
            const FloatPacket offset =
                u * FloatPacket(plane.lens_x[k]) + v * FloatPacket(plane.lens_y[k]);
            store(&origin_[k][i], FloatPacket(plane.origin[k]) + offset);
            store(&direction_[k][i], load<FloatPacket>(&direction_[k][i]) -
                                         offset * FloatPacket(plane.inverse_focus));
        }
    }
}

void CameraSamples::lay_out(const PixelGroup &group) {
    if (group.side != 0 && group.side == side_ && group.sample_count == sample_count_)
        return;
    side_ = group.side;
    sample_count_ = group.sample_count;
    const size_t padded = (count_ + PACKET_WIDTH - 1) / PACKET_WIDTH * PACKET_WIDTH;
    for (AlignedVector<float> *array :
         {&column_, &row_, &direction_[0], &direction_[1], &direction_[2]})
        array->resize(padded);
    for (AlignedVector<float> *array : {&film_x_, &film_y_})
        array->resize(wanted_.film_positions ? padded : BLOCK);
    make_room_for_numbers(padded);
    if (!scene_.plane.has_common_origin())
        for (AlignedVector<float> &array : origin_)
            array.resize(padded);
    if (scene_.plane.type == CameraType::orthographic)
        for (int k = 0; k < 3; ++k)
            std::fill(direction_[k].begin(), direction_[k].end(), scene_.plane.parallel[k]);
    first_stream_.resize(padded);
    for (AlignedVector<uint32_t> *array : {&seed_, &stream_})
        array->resize(streams_.in_one_pass() ? BLOCK : padded);
    size_t ray = 0;
    const auto add_ray = [&](Pixel offset, uint32_t sample) {
        column_[ray] = float(offset.column);
        row_[ray] = float(offset.row);
        first_stream_[ray++] =
            (offset.row * sampled_.width + offset.column) * streams_.samples_per_pixel() +
            sample;
    };
    for (const Pixel offset : group.offsets)
        for (uint32_t sample = 0; sample < sample_count_; ++sample)
            add_ray(offset, sample);
    while (ray < padded)
        add_ray(group.offsets.back(), sample_count_ - 1);
    std::fill(seed_.begin(), seed_.end(), streams_.stream(0, 0).seed);
}

// Mitsuba's integrator.cpp, render_sample: where in the pixel, where on the lens, when, and
// then, in its direct.cpp, what the lights take, and the materials. There the numbers of a
// material are drawn in the arguments of one call, of which its compilers take the last
// first.
void CameraSamples::make_room_for_numbers(size_t padded) {
    pairs_.assign(1, NumberPair{film_x_.data(), film_y_.data()});
    if (scene_.plane.type == CameraType::thinlens) {
        lens_u_.resize(padded);
        lens_v_.resize(padded);
        pairs_.push_back({lens_u_.data(), lens_v_.data()});
    }
    if (scene_.data.camera.samples_time)
        pairs_.push_back({});
    for (size_t sample = 0; sample < light_x_.size(); ++sample) {
        light_x_[sample].resize(padded);
        light_y_[sample].resize(padded);
        if (sample < wanted_.light_samples)
            pairs_.push_back({light_x_[sample].data(), light_y_[sample].data()});
    }
    if (leaves_out_last())
        pairs_.back().y = nullptr;
    for (BsdfNumbers &numbers : bsdf_) {
        for (AlignedVector<float> *array : {&numbers.x, &numbers.y, &numbers.part})
            array->resize(padded);
        pairs_.push_back({numbers.x.data(), numbers.y.data()});
        pairs_.push_back({numbers.part.data(), nullptr});
    }
}

const float *CameraSamples::delta_part(uint32_t sample) const {
    if (sampler_.type != SamplerType::independent)
        return bsdf_part(sample);
    const uint32_t number = 3 * sample + 2, of_lights = 2 * wanted_.light_samples;
    if (number < of_lights)
        return number % 2 == 0 ? light_x(number / 2) : light_y(number / 2);
    const uint32_t rest = number - of_lights;
    const BsdfNumbers &numbers = bsdf_[rest / 3];
    return (rest % 3 == 0 ? numbers.x : rest % 3 == 1 ? numbers.y : numbers.part).data();
}

// Whether the last number that there is of each sample need not be drawn: the second one of
// a light, which only chooses the light. Other samplers do not draw one number as they do
// the first of two.
bool CameraSamples::leaves_out_last() const {
    return sampler_.type == SamplerType::independent && wanted_.light_samples > 0 &&
           wanted_.bsdf_samples == 0 && scene_.all_emitters_are_points;
}

// Where the passes that samples belong to differ.
void CameraSamples::choose_streams(const PixelGroup &group) {
    for (size_t i = 0; i < group.offsets.size(); ++i) {
        const Pixel pixel = group.pixel(i);
        streams_.streams(pixel.row * sampled_.width + pixel.column, group.first_sample,
                         group.sample_count, &seed_[i * group.sample_count],
                         &stream_[i * group.sample_count]);
    }
}

// Where all belong to one.
void CameraSamples::follow_streams(const PixelGroup &group, size_t begin, size_t end) {
    const uint32_t corner =
        (group.top * sampled_.width + group.left) * streams_.samples_per_pixel() +
        group.first_sample;
    for (size_t ray = begin; ray < end; ++ray)
        stream_[ray - begin] = first_stream_[ray] + corner;
}

} // namespace mlrt
