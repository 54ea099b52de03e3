// One work item of the renderer: the samples of a few neighbouring pixels, from camera rays
// to colours. Everything it makes stays in buffers of its own, small enough for a core's
// cache.
#pragma once

#include "base/counters.h"
#include "mlrta/trace.h"
#include "render/film_blocks.h"
#include "render/prepared_scene.h"
#include "render/sampler.h"
#include "render/shadow.h"
#include "render/shadow_offset.h"
#include "render/surface.h"

#include <cstdint>
#include <vector>

namespace mlrt {

struct AovSet {
    bool depth = false;
    bool normal = false;
    bool primitive = false;
    bool cost = false;
};

// Where each channel of the film lies; -1 if there is none.
struct FilmChannels {
    int depth = -1, normal = -1;
    uint32_t count = 3; // red, green and blue come first

    explicit FilmChannels(const AovSet &aovs) {
        if (aovs.depth)
            depth = int(count++);
        if (aovs.normal) {
            normal = int(count);
            count += 3;
        }
    }
};

// What the tiles of a picture share and write to.
struct TileTarget {
    FilmBlocks &blocks;
    FilmChannels channels;
    int32_t *primitive =
        nullptr;           // of each pixel's first sample, if wanted: crop, row by row
    float *cost = nullptr; // of a sample of each pixel, if wanted: the same
};

struct RenderCounters {
    Counters primary, shadow;
};

struct Pixel {
    uint32_t column = 0, row = 0; // of the sampled rectangle
};

// What is traced together: samples [first_sample, first_sample + sample_count) of each
// pixel.
struct PixelGroup {
    std::vector<Pixel> pixels;
    uint32_t side = 0; // of the square that they fill in Morton order; 0 if they do not
    uint32_t first_sample = 0, sample_count = 0;
};

class TileRenderer {
public:
    TileRenderer(const PreparedScene &scene, const SampleStreams &streams,
                 const TraceOptions &options, ShadowOffset offset, TileTarget target)
        : scene_(scene), streams_(streams), options_(options), offset_(offset),
          target_(target), shadow_tracer_(scene, options_, offset, counters_.shadow) {}
    TileRenderer(const TileRenderer &) = delete;
    TileRenderer &operator=(const TileRenderer &) = delete;

    // Rays, and whatever is added up, come in the order of the pixels and then of samples.
    void render(const PixelGroup &group);

    const RenderCounters &counters() const { return counters_; }

private:
    // Arrays of one entry a ray, in the order of pixels and, within each, of samples, and
    // of whole packets: what lies behind the last ray hits nothing.
    struct Rays {
        size_t count = 0;
        std::vector<uint32_t> stream_seed, stream_index;
        std::vector<float> film_x, film_y, light_x, light_y;
        std::vector<float> direction[3], t_min, t_max;
        std::vector<float> t;
        std::vector<uint32_t> primitive;
        std::vector<float> cost;                // if it is wanted
        std::vector<std::vector<float>> values; // by channel of the film

        void resize(size_t new_count, size_t channels);
    };

    // Up to sixteen rays that meet a surface.
    struct HitPacket {
        LaneBits lanes = 0;
        LaneArray<uint32_t> ray;
        Vec3<FloatPacket> origin, direction;
        FaceNumbers faces;
        FloatPacket light_x, light_y;
    };

    // Camera rays that go on behind an emitter that is to be hidden.
    struct PassingRays {
        std::vector<uint32_t> ray;
        std::vector<float> origin[3];
    };

    void generate(const PixelGroup &group);
    void trace_camera_rays(const PixelGroup &group);
    void shade_hits();
    void write_depth_and_normal(const HitPacket &hit,
                                const SurfacePoint<FloatPacket> &point, size_t first);
    void shade(const HitPacket &hit, const SurfacePoint<FloatPacket> &point);
    LaneBits add_emission(const HitPacket &hit, const SurfacePoint<FloatPacket> &point,
                          LaneBits seen_from_front);
    void pass_hidden_emitters();
    void shade_passed(const PassingRays &passing, const std::vector<uint32_t> &primitive,
                      size_t first);
    void write(const PixelGroup &group);

    const PreparedScene &scene_;
    const SampleStreams &streams_;
    TraceOptions options_;
    ShadowOffset offset_;
    TileTarget target_;
    RenderCounters counters_;
    ShadowTracer shadow_tracer_;
    Rays rays_;
    ShadowCandidates candidates_;
    PassingRays passing_;
};

} // namespace mlrt
