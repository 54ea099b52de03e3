#include "mlrt_engine.h"

#include "kdtree/report.h"

#include <bit>
#include <mutex>
#include <vector>

namespace mlrt::bench {

namespace {

// The rays of one tile, in the order of its pixels; reused from tile to tile.
struct TileRays {
    std::vector<float> direction[3], t_min, t_max, t, cosine;
    std::vector<uint32_t> primitive;
    std::vector<uint8_t> occluded;

    void resize(size_t count) {
        for (std::vector<float> *array :
             {&direction[0], &direction[1], &direction[2], &t_min, &t_max, &t, &cosine})
            array->resize(count);
        primitive.resize(count);
        occluded.resize(count);
    }

    RayGroup group(Vec3f origin) const {
        RayGroup group;
        group.count = uint32_t(t.size());
        group.has_common_origin = true;
        group.common_origin = origin;
        for (int k = 0; k < 3; ++k)
            group.direction[k] = direction[k].data();
        group.t_min = t_min.data();
        group.t_max = t_max.data();
        return group;
    }
};

Vec3<FloatPacket> normals(const KdTree &tree, const uint32_t *primitives, LaneBits lanes) {
    LaneArray<float> along[2][3]{};
    for_each_lane(lanes, [&](uint32_t lane) {
        const Triangle &triangle = tree.triangles[primitives[lane]];
        const Vec3f to_b = triangle.b - triangle.a, to_c = triangle.c - triangle.a;
        for (int k = 0; k < 3; ++k) {
            along[0][k][lane] = to_b[k];
            along[1][k][lane] = to_c[k];
        }
    });
    Vec3<FloatPacket> to_b, to_c;
    for (int k = 0; k < 3; ++k) {
        to_b[k] = load<FloatPacket>(along[0][k]);
        to_c[k] = load<FloatPacket>(along[1][k]);
    }
    return cross(to_b, to_c);
}

class TileRenderer {
public:
    TileRenderer(const KdTree &tree, const View &view, const TraceOptions &options,
                 Counters &counters)
        : tree_(tree), view_(view), options_(options), counters_(counters) {}

    void trace_primary(const PixelTile &tile) {
        rays_.resize(size_t(tile.side) * tile.side);
        for (uint32_t i = 0; i < tile.block_count(); ++i) {
            const Block block = block_of(tile, i, view_);
            const size_t first = size_t(i) * PACKET_WIDTH;
            store_vectors(first, primary_directions(view_, block));
            store(&rays_.t_min[first], FloatPacket(view_.near_clip));
            store(&rays_.t_max[first],
                  select(from_bits<FloatPacket>(block.on_film), FloatPacket(view_.far_clip),
                         FloatPacket(0.0f)));
        }
        const CameraTile square{view_.camera, tile.x, tile.y, tile.side, 1};
        trace_closest(tree_, rays_.group(view_.camera.origin), options_,
                      {rays_.t.data(), rays_.primitive.data()}, counters_, &square);
    }

    void trace_shadows(const PixelTile &tile) {
        for (uint32_t i = 0; i < tile.block_count(); ++i) {
            const size_t first = size_t(i) * PACKET_WIDTH;
            const LaneBits hit =
                to_bits(load<UIntPacket>(&rays_.primitive[first]) != NO_PRIMITIVE);
            const auto hit_mask = from_bits<FloatPacket>(hit);
            const FloatPacket t =
                select(hit_mask, load<FloatPacket>(&rays_.t[first]), FloatPacket(0.0f));
            const Shading shading = shade(view_, load_vectors(first), t,
                                          normals(tree_, &rays_.primitive[first], hit));
            store_vectors(first, shading.from_light);
            store(&rays_.cosine[first],
                  select(hit_mask, shading.cosine, FloatPacket(0.0f)));
            store(&rays_.t_min[first], FloatPacket(SHADOW_EPSILON));
            store(&rays_.t_max[first],
                  select(hit_mask, FloatPacket(1 - SHADOW_EPSILON), FloatPacket(0.0f)));
        }
        trace_any(tree_, rays_.group(view_.light), options_, rays_.occluded.data(),
                  counters_);
    }

    void write(const PixelTile &tile, const FrameOutput &output) {
        for (uint32_t i = 0; i < tile.block_count(); ++i) {
            const Block block = block_of(tile, i, view_);
            const size_t first = size_t(i) * PACKET_WIDTH;
            LaneBits occluded = 0;
            for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane)
                occluded |= uint32_t(rays_.occluded[first + lane]) << lane;
            write_block(view_, block,
                        select(from_bits<FloatPacket>(occluded), FloatPacket(0.0f),
                               load<FloatPacket>(&rays_.cosine[first])),
                        output.image);
            if (output.primitive)
                write_block(view_, block, load<UIntPacket>(&rays_.primitive[first]),
                            output.primitive);
        }
    }

private:
    void store_vectors(size_t first, const Vec3<FloatPacket> &vectors) {
        for (int k = 0; k < 3; ++k)
            store(&rays_.direction[k][first], vectors[k]);
    }
    Vec3<FloatPacket> load_vectors(size_t first) const {
        return {load<FloatPacket>(&rays_.direction[0][first]),
                load<FloatPacket>(&rays_.direction[1][first]),
                load<FloatPacket>(&rays_.direction[2][first])};
    }

    const KdTree &tree_;
    const View &view_;
    const TraceOptions &options_;
    Counters &counters_;
    static thread_local TileRays rays_;
};

thread_local TileRays TileRenderer::rays_;

uint32_t tile_side(const TraceOptions &options) {
    return std::bit_floor(std::max(options.initial_tile, BLOCK_SIDE));
}

} // namespace

GrowthState TimedTree::state() const {
    if (built.tree.growth)
        return built.tree.growth->state();
    GrowthState state;
    state.nodes = built.tree.nodes.size();
    state.references = built.tree.references.size();
    return state;
}

uint64_t TimedTree::bytes() const {
    const GrowthState now = state();
    return now.nodes * sizeof(KdNode) + now.references * sizeof(uint32_t) +
           built.tree.triangles.bytes() + now.waiting_bytes;
}

std::optional<TimedTree> build_tree(const Mesh &mesh, const BuildOptions &options,
                                    const std::function<bool()> &cancelled) {
    const Stopwatch watch;
    std::optional<BuiltTree> built = build_kd_tree(mesh.triangles(), options, cancelled);
    if (!built)
        return std::nullopt;
    return TimedTree{std::move(*built), watch.elapsed()};
}

Seconds render_frame(const KdTree &tree, const View &view, const TraceOptions &options,
                     const FrameOutput &output) {
    const Stopwatch watch;
    for_each_tile(view, tile_side(options), [&](const PixelTile &tile) {
        Counters counters;
        TileRenderer renderer(tree, view, options, counters);
        renderer.trace_primary(tile);
        renderer.trace_shadows(tile);
        renderer.write(tile, output);
    });
    return watch.elapsed();
}

double sah_cost(const KdTree &tree) {
    const TreeStatistics statistics = statistics_of(tree);
    const BuildOptions usual;
    return usual.traversal_cost * statistics.expected_traversals +
           usual.intersection_cost * statistics.expected_primitive_visits;
}

Counters count_primary(const KdTree &tree, const View &view, const TraceOptions &options) {
    Counters total;
    std::mutex mutex;
    for_each_tile(view, tile_side(options), [&](const PixelTile &tile) {
        Counters counters;
        TileRenderer(tree, view, options, counters).trace_primary(tile);
        const std::lock_guard lock(mutex);
        total += counters;
    });
    return total;
}

} // namespace mlrt::bench
