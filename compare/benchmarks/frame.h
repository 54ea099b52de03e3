// The frame that both engines render: primary rays at fixed positions of each pixel, a
// shadow ray for each hit if wanted, and the cosine at the surface where the light is seen,
// averaged over the pixel.
//
// Rays and shading are written once, for sixteen rays, so that the engines differ in
// nothing but tracing.
#pragma once

#include "base/fused_dot.h"
#include "base/morton.h"
#include "base/parallel.h"
#include "base/reciprocal_estimate.h"
#include "base/simd.h"
#include "mlrta/beam.h"

#include <algorithm>
#include <cstdint>

namespace mlrt::bench {

// Rays form a grid: row by row, those of each pixel a square of it.
struct View {
    CameraMap camera;
    float near_clip = 0, far_clip = 0; // in units of the directions, for which t is a depth
    uint32_t width = 0, height = 0;    // in pixels
    Vec3f light;
    uint32_t grid = 1; // primary rays along the side of a pixel, 1 or 4

    uint32_t columns() const { return width * grid; }
    uint32_t rows() const { return height * grid; }
};

struct FrameOutput {
    float *image = nullptr; // width * height, row by row
    // What became of each primary ray, columns * rows, if wanted: the triangle that it
    // hits, and 1 if the light is seen from there. Without shadow rays every hit sees the
    // light.
    uint32_t *primitive = nullptr;
    uint8_t *lit = nullptr;
};

// How a frame is rendered, whatever the engine.
struct FrameSettings {
    uint32_t tile_side = 128; // of the squares that are traced at once, in rays
    bool shadows = true;
};

// Shadow rays run from the light to the hit, for t from 0 to 1. This share is left out at
// both ends, so that no surface shadows itself; as in Mitsuba.
inline constexpr float SHADOW_EPSILON = 1e-4f;

// Sixteen rays in Morton order: lane bits 0 and 2 are those of x, 1 and 3 those of y.
inline constexpr uint32_t BLOCK_SIDE = 4;

// A square of the grid of rays, a power of two along its side, of which some may lie off
// the film. Blocks of sixteen follow one another in Morton order, so that the rays do as
// well.
struct RayTile {
    uint32_t x, y, side;

    uint32_t block_count() const { return side * side / PACKET_WIDTH; }
};

struct Block {
    uint32_t x, y;    // of the lower corner
    LaneBits on_film; // rays that there are
};

constexpr uint32_t lane_x(uint32_t lane) {
    return even_bits(lane);
}
constexpr uint32_t lane_y(uint32_t lane) {
    return even_bits(lane >> 1);
}

// Centres of a block's rays, from its corner.
struct LaneCentres {
    LaneArray<float> x, y;

    constexpr LaneCentres() : x{}, y{} {
        for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
            x[lane] = float(lane_x(lane)) + 0.5f;
            y[lane] = float(lane_y(lane)) + 0.5f;
        }
    }
};
inline constexpr LaneCentres LANE_CENTRES;

inline Block block_of(const RayTile &tile, uint32_t index, const View &view) {
    const MortonPoint place = of_morton_code(index);
    Block block{tile.x + BLOCK_SIDE * place.column, tile.y + BLOCK_SIDE * place.row,
                ALL_LANES};
    if (block.x + BLOCK_SIDE > view.columns() || block.y + BLOCK_SIDE > view.rows()) {
        block.on_film = 0;
        for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane)
            if (block.x + lane_x(lane) < view.columns() &&
                block.y + lane_y(lane) < view.rows())
                block.on_film |= 1u << lane;
    }
    return block;
}

// Directions of blocks of primary rays.
class PrimaryDirections {
public:
    explicit PrimaryDirections(const View &view)
        : base_(in_all_lanes(view.camera.base)), dx_(in_all_lanes(view.camera.dx)),
          dy_(in_all_lanes(view.camera.dy)), scale_(1.0f / float(view.grid)) {}

    // Positions are exact: they have few digits.
    Vec3<FloatPacket> operator()(const Block &block) const {
        const FloatPacket x = (float(block.x) + load<FloatPacket>(LANE_CENTRES.x)) * scale_;
        const FloatPacket y = (float(block.y) + load<FloatPacket>(LANE_CENTRES.y)) * scale_;
        return (base_ + x * dx_) + y * dy_;
    }

private:
    Vec3<FloatPacket> base_, dx_, dy_;
    FloatPacket scale_;
};

// The value in the given lanes, another one elsewhere.
inline FloatPacket in_lanes(LaneBits lanes, const FloatPacket &value, float other = 0) {
    return lanes == ALL_LANES
               ? value
               : select(from_bits<FloatPacket>(lanes), value, FloatPacket(other));
}

struct Shading {
    Vec3<FloatPacket> from_light; // to the hit: the direction of the shadow ray
    FloatPacket cosine;           // between the normal, to either side, and the light
};

// `normal` need not have unit length; `t` is finite in all lanes.
inline Shading shade(const View &view, const Vec3<FloatPacket> &direction,
                     const FloatPacket &t, const Vec3<FloatPacket> &normal) {
    const Vec3f offset = view.camera.origin - view.light;
    Shading result;
    result.from_light =
        by_axis([&](int k) { return fused(t, direction[k], FloatPacket(offset[k])); });
    result.cosine =
        absolute(fused_dot(normal, result.from_light)) *
        reciprocal_root_estimate(fused_dot(normal, normal) *
                                 fused_dot(result.from_light, result.from_light));
    return result;
}

// Writes a value a ray to a grid of rays.
template <typename Value, typename Packet>
void write_rays(const View &view, const Block &block, const Packet &packet, Value *values) {
    Value *corner = values + size_t(block.y) * view.columns() + block.x;
    if (block.on_film == ALL_LANES) {
        // From Morton order to row by row.
        const auto rows =
            drjit::shuffle<0, 1, 4, 5, 2, 3, 6, 7, 8, 9, 12, 13, 10, 11, 14, 15>(packet);
        const size_t columns = view.columns();
        const auto first = drjit::low(rows), last = drjit::high(rows);
        store(corner, drjit::low(first));
        store(corner + columns, drjit::high(first));
        store(corner + 2 * columns, drjit::low(last));
        store(corner + 3 * columns, drjit::high(last));
        return;
    }
    const LaneArray<Value> lanes = to_lanes<Value>(packet);
    for_each_lane(block.on_film, [&](uint32_t lane) {
        corner[size_t(lane_y(lane)) * view.columns() + lane_x(lane)] = lanes[lane];
    });
}

// Writes the brightness of a block's rays, or its mean: with a grid of 4 a block is a
// pixel, on the film or off it as a whole.
inline void write_image(const View &view, const Block &block, const FloatPacket &brightness,
                        float *image) {
    if (view.grid == 1)
        write_rays(view, block, brightness, image);
    else
        image[size_t(block.y / BLOCK_SIDE) * view.width + block.x / BLOCK_SIDE] =
            sum_of_lanes(brightness) / float(PACKET_WIDTH);
}

// Everything about a block's rays, once it is known: which of them see the light, and the
// cosine there, else 0.
inline void write_block(const View &view, const Block &block, const FloatPacket &brightness,
                        const UIntPacket &primitive, LaneBits lit,
                        const FrameOutput &output) {
    if (block.on_film == 0)
        return;
    write_image(view, block, brightness, output.image);
    if (output.primitive)
        write_rays(view, block, primitive, output.primitive);
    if (output.lit)
        for_each_lane(block.on_film, [&](uint32_t lane) {
            output.lit[size_t(block.y + lane_y(lane)) * view.columns() + block.x +
                       lane_x(lane)] = lit >> lane & 1;
        });
}

// Side of the squares of rays that threads take; chosen.
inline constexpr uint32_t SHARE_SIDE = 128;

// Calls render(share) for squares that cover the film, on all threads of the pool. Their
// sides are that of a tile, or more.
template <typename Render>
void for_each_share(const View &view, uint32_t tile_side, Render &&render) {
    const uint32_t side = std::max(tile_side, SHARE_SIDE);
    const uint32_t columns = (view.columns() + side - 1) / side;
    const uint32_t rows = (view.rows() + side - 1) / side;
    parallel_for(columns * rows, [&](uint32_t i) {
        render(RayTile{i % columns * side, i / columns * side, side});
    });
}

// Calls visit(tile) for the tiles of a share that are not off the film, in Morton order.
template <typename Visit>
void for_each_tile(const View &view, const RayTile &share, uint32_t side, Visit &&visit) {
    const uint32_t count = (share.side / side) * (share.side / side);
    for (uint32_t i = 0; i < count; ++i) {
        const MortonPoint place = of_morton_code(i);
        const RayTile tile{share.x + side * place.column, share.y + side * place.row, side};
        if (tile.x < view.columns() && tile.y < view.rows())
            visit(tile);
    }
}

} // namespace mlrt::bench
