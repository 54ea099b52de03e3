// Frames by Embree, in each of the ways in which it takes many rays at once.
#pragma once

#include "embree_engine.h"
#include "frame.h"

namespace mlrt::bench {

enum class EmbreeMode : uint32_t {
    packet,      // rtcIntersect16 and rtcOccluded16, coherent
    stream_of_8, // rtcIntersectNM and rtcOccludedNM, coherent, in packets of 8
    stream_of_16,
    single_stream, // rtcIntersect1M and rtcOccluded1M, incoherent
};

// In the mode of packets a tile is only what a thread takes, in Morton order; else it is a
// stream.
Seconds render_frame(const EmbreeScene &scene, EmbreeMode mode, const View &view,
                     const FrameSettings &settings, const FrameOutput &output);

} // namespace mlrt::bench
