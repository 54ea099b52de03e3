#include "embree_frame.h"

#include "embree_rays.h"

#include <vector>

namespace mlrt::bench {

namespace {

// What a thread reuses from tile to tile and from frame to frame.
template <typename Mode>
struct Buffers {
    typename Mode::Primary primary;
    typename Mode::Shadow shadow;
    std::vector<FloatPacket> cosine;

    // Not inlined: their address is found once a share, not once a packet.
    [[gnu::noinline]] static Buffers &of_thread() {
        static thread_local Buffers buffers;
        return buffers;
    }
};

// Renders tile by tile in one of Embree's modes.
template <typename Mode>
class TileRenderer {
public:
    TileRenderer(const EmbreeScene &scene, const View &view, bool shadows,
                 uint32_t block_count, Buffers<Mode> &buffers)
        : scene_(scene.handle()), view_(view), directions_(view), shadows_(shadows),
          primary_(buffers.primary), shadow_(buffers.shadow), cosine_(buffers.cosine) {
        primary_.prepare({block_count, view.camera.origin, view.near_clip});
        if (shadows) {
            shadow_.prepare({block_count, view.light, SHADOW_EPSILON});
            cosine_.resize(block_count);
        }
        rtcInitIntersectContext(&context_);
        context_.flags = Mode::FLAGS;
    }

    void render(const RayTile &tile, const FrameOutput &output) {
        const uint32_t count = tile.block_count();
        for (uint32_t i = 0; i < count; ++i) {
            const Block block = block_of(tile, i, view_);
            primary_.set(i, directions_(block), block.on_film, view_.far_clip);
        }
        Mode::intersect(scene_, context_, primary_, count);
        for (uint32_t i = 0; i < count; ++i)
            finish_primary(tile, i, output);
        if (!shadows_)
            return;
        Mode::occlude(scene_, context_, shadow_, count);
        for (uint32_t i = 0; i < count; ++i) {
            // What is not active is not occluded, and dark.
            const LaneBits clear = shadow_.unoccluded(i);
            write(tile, i, in_lanes(clear, cosine_[i]), clear, output);
        }
    }

private:
    // Shades the hits of a block and makes their shadow rays, or writes them.
    void finish_primary(const RayTile &tile, uint32_t i, const FrameOutput &output) {
        const LaneBits hit = primary_.hit(i);
        FloatPacket cosine = 0.0f;
        if (hit != 0) {
            const FloatPacket t = in_lanes(hit, primary_.t(i));
            const Shading shading =
                shade(view_, primary_.directions(i), t, primary_.normals(i));
            cosine = in_lanes(hit, shading.cosine);
            if (shadows_)
                shadow_.set(i, shading.from_light, hit, 1 - SHADOW_EPSILON);
        } else if (shadows_) {
            shadow_.disable(i);
        }
        if (shadows_)
            cosine_[i] = cosine;
        else
            write(tile, i, cosine, hit, output);
    }

    void write(const RayTile &tile, uint32_t i, const FloatPacket &brightness, LaneBits lit,
               const FrameOutput &output) const {
        write_block(view_, block_of(tile, i, view_), brightness, primary_.primitives(i),
                    lit, output);
    }

    RTCScene scene_;
    const View &view_;
    const PrimaryDirections directions_;
    bool shadows_;
    RTCIntersectContext context_;
    typename Mode::Primary &primary_;
    typename Mode::Shadow &shadow_;
    std::vector<FloatPacket> &cosine_;
};

template <typename Mode>
void render_share(const EmbreeScene &scene, const View &view, const FrameSettings &settings,
                  const RayTile &share, const FrameOutput &output) {
    // A packet is traced as soon as it is made.
    const uint32_t side = Mode::IS_STREAM ? settings.tile_side : BLOCK_SIDE;
    TileRenderer<Mode> renderer(scene, view, settings.shadows, side * side / PACKET_WIDTH,
                                Buffers<Mode>::of_thread());
    for_each_tile(view, share, side,
                  [&](const RayTile &tile) { renderer.render(tile, output); });
}

} // namespace

Seconds render_frame(const EmbreeScene &scene, EmbreeMode mode, const View &view,
                     const FrameSettings &settings, const FrameOutput &output) {
    const Stopwatch watch;
    for_each_share(view, settings.tile_side, [&](const RayTile &share) {
        const FlushDenormals flush;
        switch (mode) {
        case EmbreeMode::packet:
            return render_share<PacketMode>(scene, view, settings, share, output);
        case EmbreeMode::stream_of_8:
            return render_share<PacketStreamMode<8>>(scene, view, settings, share, output);
        case EmbreeMode::stream_of_16:
            return render_share<PacketStreamMode<16>>(scene, view, settings, share, output);
        case EmbreeMode::single_stream:
            return render_share<SingleStreamMode>(scene, view, settings, share, output);
        }
    });
    return watch.elapsed();
}

} // namespace mlrt::bench
