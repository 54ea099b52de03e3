// The front door of the native renderer: a scene in, a picture out.
#pragma once

#include "mlrta/trace.h"
#include "render/pixel_array.h"
#include "render/prepared_scene.h"
#include "render/tile.h"

#include <cstdint>
#include <functional>

namespace mlrt {

struct RenderSettings {
    uint32_t samples_per_pixel = 1;
    uint32_t seed = 0;
    Sampling sampling;
    TraceOptions trace;
    ShadowOffset shadow_offset = ShadowOffset::mitsuba;
    AovSet aovs;
};

// Row by row over the crop. An auxiliary picture that was not asked for is empty.
struct RenderResult {
    PixelArray<float> image;  // red, green, blue
    PixelArray<float> depth;  // distance from the near plane along the ray; 0 for a miss
    PixelArray<float> normal; // shading normal, three a pixel; 0 for a miss
    PixelArray<float> moment; // of samples in CIE XYZ, three a pixel, then their squares
    PixelArray<int32_t> primitive; // face that each pixel's first sample hit; -1 for a miss
    PixelArray<float> cost; // of a sample, see RayGroup: primary and shadow rays, mean
    RenderCounters counters;
};

// Depth and normal are filtered as the colours are, as in Mitsuba's `aov` integrator.
//
// The result, but for the cost, depends, bit for bit, on the scene, the samples, the seed
// and the offset of shadow rays only.
//
// `cancelled`, if given, is asked now and then by the calling thread, with the share of the
// work that is done; once it returns true the function returns false and the result is of
// no use.
bool render(const PreparedScene &scene, const RenderSettings &settings,
            RenderResult &result, const std::function<bool(float done)> &cancelled = {});

} // namespace mlrt
