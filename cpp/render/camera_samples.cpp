#include "render/camera_samples.h"

#include "base/simd.h"

#include <algorithm>

namespace mlrt {

CameraSamples::CameraSamples(const PreparedScene &scene, const SampleStreams &streams,
                             const PixelRect &sampled, Wanted wanted)
    : scene_(scene), streams_(streams), sampled_(sampled), wanted_(wanted) {}

void CameraSamples::generate(const PixelGroup &group) {
    count_ = group.ray_count();
    lay_out(group);
    choose_streams(group);
    const bool lit = wanted_.light_numbers;
    draw_numbers(seed_.data(), stream_.data(), padded_count(),
                 {film_x_.data(), film_y_.data(), lit ? light_x_.data() : nullptr,
                  lit ? light_y_.data() : nullptr});

    const CameraMap &camera = scene_.plane.single;
    const Vec3<FloatPacket> base = in_all_lanes(camera.base);
    const Vec3<FloatPacket> dx = in_all_lanes(camera.dx), dy = in_all_lanes(camera.dy);
    // Whole numbers of pixels, which floats hold exactly.
    const FloatPacket left(float(sampled_.x + int(group.left)));
    const FloatPacket top(float(sampled_.y + int(group.top)));
    for (size_t i = 0; i < padded_count(); i += PACKET_WIDTH) {
        const FloatPacket x =
            load<FloatPacket>(&film_x_[i]) + (left + load<FloatPacket>(&column_[i]));
        const FloatPacket y =
            load<FloatPacket>(&film_y_[i]) + (top + load<FloatPacket>(&row_[i]));
        if (wanted_.film_positions) {
            store(&film_x_[i], x);
            store(&film_y_[i], y);
        }
        const Vec3<FloatPacket> d = (base + x * dx) + y * dy;
        for (int k = 0; k < 3; ++k)
            store(&direction_[k][i], d[k]);
    }
}

void CameraSamples::lay_out(const PixelGroup &group) {
    if (group.side != 0 && group.side == side_ && group.sample_count == sample_count_)
        return;
    side_ = group.side;
    sample_count_ = group.sample_count;
    const size_t padded = (count_ + PACKET_WIDTH - 1) / PACKET_WIDTH * PACKET_WIDTH;
    for (std::vector<float> *array :
         {&column_, &row_, &film_x_, &film_y_, &light_x_, &light_y_, &direction_[0],
          &direction_[1], &direction_[2]})
        array->resize(padded);
    for (std::vector<uint32_t> *array : {&first_stream_, &seed_, &stream_})
        array->resize(padded);
    t_min_.assign(padded, scene_.plane.near_clip);
    t_max_.assign(padded, scene_.plane.far_clip);
    for (size_t ray = 0; ray < padded; ++ray) {
        const size_t last = std::min(ray, count_ - 1);
        const Pixel offset = group.offsets[last / sample_count_];
        column_[ray] = float(offset.column);
        row_[ray] = float(offset.row);
        first_stream_[ray] =
            (offset.row * sampled_.width + offset.column) * streams_.samples_per_pixel() +
            uint32_t(last % sample_count_);
    }
    std::fill(seed_.begin(), seed_.end(), streams_.stream(0, 0).seed);
}

void CameraSamples::choose_streams(const PixelGroup &group) {
    if (streams_.in_one_pass()) {
        const uint32_t corner =
            (group.top * sampled_.width + group.left) * streams_.samples_per_pixel() +
            group.first_sample;
        for (size_t ray = 0; ray < padded_count(); ++ray)
            stream_[ray] = first_stream_[ray] + corner;
        return;
    }
    for (size_t i = 0; i < group.offsets.size(); ++i) {
        const Pixel pixel = group.pixel(i);
        streams_.streams(pixel.row * sampled_.width + pixel.column, group.first_sample,
                         group.sample_count, &seed_[i * group.sample_count],
                         &stream_[i * group.sample_count]);
    }
}

} // namespace mlrt
