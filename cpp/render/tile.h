// One work item of the renderer: the samples of a few neighbouring pixels, from camera rays
// to colours. Everything it makes stays in buffers of its own, small enough for a core's
// cache.
#pragma once

#include "base/aligned_vector.h"
#include "base/counters.h"
#include "mlrta/trace.h"
#include "render/bsdf_rays.h"
#include "render/camera_samples.h"
#include "render/emitter_sampling.h"
#include "render/face_cache.h"
#include "render/hit_packet.h"
#include "render/picture_film.h"
#include "render/pixel_group.h"
#include "render/prepared_scene.h"
#include "render/reflected_light.h"
#include "render/sampler.h"
#include "render/shadow.h"
#include "render/shadow_offset.h"
#include "render/spread_samples.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace mlrt {

struct AovSet {
    bool depth = false;
    bool normal = false;
    bool moment = false;
    bool primitive = false;
    bool cost = false;
};

// Where each channel of the film lies; -1 if there is none.
struct ChannelNumbers {
    int depth = -1, normal = -1, moment = -1;
    uint32_t count = PictureFilm::COLOURS; // which come first

    explicit ChannelNumbers(const AovSet &aovs) {
        if (aovs.depth)
            depth = int(count++);
        if (aovs.normal) {
            normal = int(count);
            count += 3;
        }
        if (aovs.moment) {
            moment = int(count);
            count += 6;
        }
    }
};

// What the tiles of a picture share and write to.
struct TileTarget {
    PictureFilm &film;
    ChannelNumbers channels;
    int32_t *primitive =
        nullptr;           // of each pixel's first sample, if wanted: crop, row by row
    float *cost = nullptr; // of a sample of each pixel, if wanted: the same
};

struct RenderCounters {
    Counters primary, shadow, bsdf;
};

// How samples are taken.
struct Sampling {
    Sampler sampler;
    // Of each camera sample.
    uint32_t emitter_samples = 1;
    uint32_t bsdf_samples = 0;
};

// How rays with a common origin go through the scene, and how others do.
struct RayOptions {
    TraceOptions together, alone;
};

// A packet on its way from surfaces to shadow rays.
struct ShadedPacket {
    HitPacket hit;
    SurfacePoint<FloatPacket> point;
    LaneBits lanes = 0; // that reflect light
    FloatPacket cos_view;
    Vec3<FloatPacket> albedo;
    EmitterChoices choices;
    // If all lanes are sampled at once: faces any, unless all choose the same emitter.
    EmitterSample<FloatPacket> light;
};

// The same of rays that all meet one side of one face, which is of one colour.
struct PlainPacket {
    size_t first;   // ray in lane 0
    LaneBits lanes; // that reflect light
    bool front;     // whether they see the front
    Vec3f colour, face_normal;
    Vec3<FloatPacket> p, shading_normal;
    UIntPacket emitters;             // that are chosen
    Vec3<FloatPacket> start, target; // of shadow rays
    LaneBits lit;
    uint32_t number; // of reflected light
};

class TileRenderer {
public:
    TileRenderer(const PreparedScene &scene, const SampleStreams &streams,
                 const Sampling &sampling, const RayOptions &options, ShadowOffset offset,
                 TileTarget target);
    TileRenderer(const TileRenderer &) = delete;
    TileRenderer &operator=(const TileRenderer &) = delete;

    // Whatever is added up comes in the order of the group's rays.
    void render(const PixelGroup &group);

    const RenderCounters &counters() const { return counters_; }

private:
    // Camera rays that go on behind an emitter that is to be hidden.
    struct PassingRays {
        AlignedVector<uint32_t> ray;
        AlignedVector<float> origin[3];
    };

    void make_room();
    void trace_camera_rays(const PixelGroup &group);
    void add_background();
    void shade_hits();
    void write_depth_and_normal(const HitPacket &hit,
                                const SurfacePoint<FloatPacket> &point, size_t first);
    // In emitter_light.cpp: packets of which hits and points are known.
    void shade(std::span<ShadedPacket> packets);
    void find_reflectance(ShadedPacket &packet);
    // Whether all lanes of a packet are, whichever emitters they choose. Robust offsets ask
    // what each sample lies on.
    bool samples_at_once() const {
        return offset_ == ShadowOffset::mitsuba || scene_.all_emitters_are_points ||
               scene_.data.emitters.size() == 1;
    }
    void choose_light(ShadedPacket &packet, uint32_t sample);
    void sample_lights(ShadedPacket &packet, const FloatPacket &y);
    void add_emitter_sample(const ShadedPacket &packet, uint32_t sample);
    FloatPacket factors_of(const UIntPacket &emitters, LaneBits lanes) const;
    void add_light(const ShadedPacket &packet, LaneBits lanes,
                   const EmitterSample<FloatPacket> &light, const UIntPacket &emitters);
    // In plain_light.cpp.
    bool shades_plainly() const;
    bool find_plain_packet(size_t first, const UIntPacket &faces, LaneBits hits);
    void shade_plain_packets();
    // In bsdf_light.cpp.
    void shade_in_both_ways(const HitPacket &hit, const SurfacePoint<FloatPacket> &point,
                            const UIntPacket &shapes, LaneBits lanes,
                            const FloatPacket &cos_view, const Vec3<FloatPacket> &albedo);
    void add_weighted_sample(const HitPacket &hit, const SurfacePoint<FloatPacket> &point,
                             LaneBits lanes, const FloatPacket &cos_view,
                             const Scattering &scattering, uint32_t sample);
    LaneBits add_emission(const HitPacket &hit, const SurfacePoint<FloatPacket> &point,
                          const UIntPacket &shapes, LaneBits seen_from_front);
    void pass_hidden_emitters(); // in hidden_emitters.cpp
    // What rays hit, by ray; distances and instances only if they are wanted.
    struct Hits {
        AlignedVector<float> t;
        AlignedVector<uint32_t> primitive, instance;
    };
    void trace(const RayGroup &rays, const CameraTile *tile, float *t, uint32_t *primitive,
               uint32_t *instance);
    void shade_passed(const PassingRays &passing, const Hits &hits,
                      size_t first); // as well
    void add_reflected_light();
    void add_moments();
    void write(const PixelGroup &group);

    const PreparedScene &scene_;
    const SampleStreams &streams_;
    uint32_t emitter_samples_;
    std::vector<float> factors_; // of the cosine, one an emitter
    bool factors_differ_ = false;
    RayOptions options_;
    ShadowOffset offset_;
    TileTarget target_;
    RenderCounters counters_;
    FaceCache faces_;
    CameraSamples samples_;

    // One entry a ray, as in samples_; what lies behind the last ray hits nothing.
    AlignedVector<float> t_; // if the depth is wanted, or the scene has objects
    AlignedVector<uint32_t> primitive_;
    AlignedVector<uint32_t> instance_;         // if the scene has objects
    AlignedVector<float> cost_;                // if it is wanted
    std::vector<AlignedVector<float>> values_; // by channel of the film

    ReflectedLight reflected_;
    std::vector<ShadowRays> shadows_; // one an emitter
    SampleShares shares_;
    uint32_t bsdf_samples_;
    std::optional<BsdfRays> bsdf_rays_; // if there are BSDF samples
    PassingRays passing_;
    static constexpr size_t AT_ONCE = 4; // packets that are shaded at once; chosen
    std::array<ShadedPacket, AT_ONCE> packets_;
    bool plain_ = false; // whether packets may be shaded plainly
    std::array<PlainPacket, AT_ONCE> plain_packets_;
    size_t plain_count_ = 0;
};

} // namespace mlrt
