// The camera rays of a group of pixels, and the random numbers of their samples.
#pragma once

#include "base/aligned_vector.h"
#include "base/simd.h"
#include "render/filter.h"
#include "render/pixel_group.h"
#include "render/prepared_scene.h"
#include "render/sampler.h"
#include "render/spread_samples.h"

#include <cstdint>
#include <vector>

namespace mlrt {

class CameraSamples {
public:
    // What is wanted besides the rays: positions on the film, and for how many samples of
    // lights and of materials numbers.
    struct Wanted {
        bool film_positions = false;
        uint32_t light_samples = 0;
        uint32_t bsdf_samples = 0;
    };

    CameraSamples(const PreparedScene &scene, const SampleStreams &streams,
                  const Sampler &sampler, const PixelRect &sampled, Wanted wanted);

    void generate(const PixelGroup &group);

    // Arrays of one entry a ray, in the order of the group, and of whole packets; entries
    // behind the last ray are rays of some pixel of the group.
    size_t count() const { return count_; }
    size_t padded_count() const { return column_.size(); }
    const float *direction(int axis) const { return direction_[axis].data(); }
    // Of a packet.
    Vec3<FloatPacket> directions(size_t first) const {
        return {load<FloatPacket>(direction_[0].data() + first),
                load<FloatPacket>(direction_[1].data() + first),
                load<FloatPacket>(direction_[2].data() + first)};
    }
    // Where rays begin, if they do not all begin at the camera's origin.
    const float *origin(int axis) const { return origin_[axis].data(); }
    // Positions on the film: any value if they are not wanted.
    const float *film_x() const { return film_x_.data(); }
    const float *film_y() const { return film_y_.data(); }
    // Numbers in [0, 1) of a sample of lights that is wanted; zeros if none is. All of y
    // may be zero where all lights are points.
    const float *light_x(uint32_t sample) const { return light_x_[sample].data(); }
    const float *light_y(uint32_t sample) const { return light_y_[sample].data(); }
    // Numbers in [0, 1) of a sample of materials that is wanted: two for the direction, and
    // one that chooses a part of the material.
    const float *bsdf_x(uint32_t sample) const { return bsdf_[sample].x.data(); }
    const float *bsdf_y(uint32_t sample) const { return bsdf_[sample].y.data(); }
    const float *bsdf_part(uint32_t sample) const { return bsdf_[sample].part.data(); }
    // The one of a material that no light sample is taken of. Mitsuba draws none for it, so
    // that with the sampler `independent` its numbers are those that come first.
    const float *delta_part(uint32_t sample) const;

private:
    void lay_out(const PixelGroup &group);
    void choose_streams(const PixelGroup &group);
    void follow_streams(const PixelGroup &group, size_t begin, size_t end);
    void draw(size_t begin, size_t end);
    void make_rays(const PixelGroup &group, size_t begin, size_t end);
    void refract(size_t begin, size_t end);
    // Where positions on the film of the block that begins there lie.
    size_t film_offset(size_t begin) const { return wanted_.film_positions ? begin : 0; }
    void make_room_for_numbers(size_t padded);
    bool leaves_out_last() const;

    const PreparedScene &scene_;
    const SampleStreams &streams_;
    Sampler sampler_;
    PixelRect sampled_;
    Wanted wanted_;
    size_t count_ = 0;

    // Of the group's corner, where the rays lie: kept for the groups to come, which mostly
    // are squares of the same size.
    uint32_t side_ = 0, sample_count_ = 0;
    AlignedVector<float> column_, row_;
    AlignedVector<uint32_t> first_stream_;

    static constexpr size_t BLOCK = 256; // rays that are made at a time; chosen

    // Of a block, if all samples belong to one pass, else of all rays.
    AlignedVector<uint32_t> seed_, stream_;
    // Of a block, if they are not wanted.
    AlignedVector<float> film_x_, film_y_;
    AlignedVector<float> lens_u_, lens_v_;
    std::vector<AlignedVector<float>> light_x_, light_y_;
    struct BsdfNumbers {
        AlignedVector<float> x, y, part;
    };
    std::vector<BsdfNumbers> bsdf_;
    std::vector<NumberPair> pairs_;       // in the order in which they are drawn
    std::vector<NumberPair> block_pairs_; // the same of a block
    AlignedVector<float> origin_[3], direction_[3];
};

} // namespace mlrt
