// The frame that both engines render: a primary ray through the centre of each pixel, a
// shadow ray for each hit, and the cosine at the surface where the light is seen.
//
// Rays and shading are written once, for sixteen rays, so that the engines differ in
// nothing but tracing.
#pragma once

#include "base/parallel.h"
#include "base/simd.h"
#include "mlrta/beam.h"

#include <cstdint>

namespace mlrt::bench {

struct View {
    CameraMap camera;
    float near_clip = 0, far_clip = 0; // in units of the directions, for which t is a depth
    uint32_t width = 0, height = 0;
    Vec3f light;
};

struct FrameOutput {
    float *image = nullptr;        // width * height, row by row
    uint32_t *primitive = nullptr; // the triangle that each primary ray hits, if wanted
};

// Shadow rays run from the light to the hit, for t from 0 to 1. This share is left out at
// both ends, so that no surface shadows itself; as in Mitsuba.
inline constexpr float SHADOW_EPSILON = 1e-4f;

// Sixteen pixels in Morton order: lane bits 0 and 2 are those of x, 1 and 3 those of y.
inline constexpr uint32_t BLOCK_SIDE = 4;

// A square of pixels, a power of two along its side, of which some may lie off the film.
// Blocks of sixteen follow one another in Morton order, so that the pixels do as well.
struct PixelTile {
    uint32_t x, y, side;

    uint32_t block_count() const { return side * side / PACKET_WIDTH; }
};

struct Block {
    uint32_t x, y;    // of the lower corner
    LaneBits on_film; // pixels that there are
};

// Every second bit of a number, from the lowest, side by side.
constexpr uint32_t even_bits(uint32_t bits) {
    bits &= 0x55555555u;
    bits = (bits | bits >> 1) & 0x33333333u;
    bits = (bits | bits >> 2) & 0x0f0f0f0fu;
    bits = (bits | bits >> 4) & 0x00ff00ffu;
    return (bits | bits >> 8) & 0x0000ffffu;
}

constexpr uint32_t lane_x(uint32_t lane) {
    return even_bits(lane);
}
constexpr uint32_t lane_y(uint32_t lane) {
    return even_bits(lane >> 1);
}

inline Block block_of(const PixelTile &tile, uint32_t index, const View &view) {
    Block block{tile.x + BLOCK_SIDE * even_bits(index),
                tile.y + BLOCK_SIDE * even_bits(index >> 1), ALL_LANES};
    if (block.x + BLOCK_SIDE > view.width || block.y + BLOCK_SIDE > view.height) {
        block.on_film = 0;
        for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane)
            if (block.x + lane_x(lane) < view.width && block.y + lane_y(lane) < view.height)
                block.on_film |= 1u << lane;
    }
    return block;
}

// Directions of the rays through the centres of a block's pixels.
inline Vec3<FloatPacket> primary_directions(const View &view, const Block &block) {
    LaneArray<float> x, y;
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
        x[lane] = float(block.x + lane_x(lane)) + 0.5f;
        y[lane] = float(block.y + lane_y(lane)) + 0.5f;
    }
    const CameraMap &camera = view.camera;
    return (in_all_lanes(camera.base) + load<FloatPacket>(x) * in_all_lanes(camera.dx)) +
           load<FloatPacket>(y) * in_all_lanes(camera.dy);
}

struct Shading {
    Vec3<FloatPacket> from_light; // to the hit: the direction of the shadow ray
    FloatPacket cosine;           // between the normal, to either side, and the light
};

// `normal` need not have unit length; `t` is finite in all lanes.
inline Shading shade(const View &view, const Vec3<FloatPacket> &direction,
                     const FloatPacket &t, const Vec3<FloatPacket> &normal) {
    Shading result;
    result.from_light =
        (in_all_lanes(view.camera.origin) + t * direction) - in_all_lanes(view.light);
    result.cosine = absolute(dot(normal, result.from_light)) /
                    (length(normal) * length(result.from_light));
    return result;
}

template <typename Value, typename Packet>
void write_block(const View &view, const Block &block, const Packet &packet, Value *image) {
    const LaneArray<Value> values = to_lanes<Value>(packet);
    for_each_lane(block.on_film, [&](uint32_t lane) {
        image[size_t(block.y + lane_y(lane)) * view.width + block.x + lane_x(lane)] =
            values[lane];
    });
}

// Calls render(tile) for tiles that cover the film, on all threads of the pool.
template <typename Render>
void for_each_tile(const View &view, uint32_t side, Render &&render) {
    const uint32_t columns = (view.width + side - 1) / side;
    const uint32_t rows = (view.height + side - 1) / side;
    parallel_for(columns * rows, [&](uint32_t i) {
        render(PixelTile{i % columns * side, i / columns * side, side});
    });
}

} // namespace mlrt::bench
