#include "mlrt_engine.h"

#include "kdtree/report.h"
#include "kdtree/wide_maker.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <mutex>
#include <vector>

namespace mlrt::bench {

namespace {

// The rays of one tile, in the order of the grid; reused from tile to tile. A direction of
// no numbers makes a ray inactive.
struct TileRays {
    std::vector<float> direction[3], t, cosine;
    std::vector<uint32_t> primitive;
    std::vector<uint8_t> occluded;

    void resize(size_t count) {
        for (std::vector<float> *array :
             {&direction[0], &direction[1], &direction[2], &t, &cosine})
            array->resize(count);
        primitive.resize(count);
        occluded.resize(count);
    }

    RayGroup group(Vec3f origin, float t_min, float t_max) const {
        RayGroup group;
        group.count = uint32_t(t.size());
        group.has_common_origin = true;
        group.common_origin = origin;
        for (int k = 0; k < 3; ++k)
            group.direction[k] = direction[k].data();
        group.t_min = IntervalEnds::of_all(t_min);
        group.t_max = IntervalEnds::of_all(t_max);
        return group;
    }
};

// Not inlined: its address is found once a share, not once a packet.
[[gnu::noinline]] TileRays &rays_of_thread() {
    static thread_local TileRays rays;
    return rays;
}

// Normals of the triangles that rays hit, of any length.
class Normals {
public:
    explicit Normals(const KdTree &tree) : tree_(tree) {}

    // In the given lanes, one or more.
    Vec3<FloatPacket> operator()(const uint32_t *primitives, LaneBits lanes) {
        // Mostly one triangle covers a packet, and the next one too.
        const uint32_t first = primitives[std::countr_zero(lanes)];
        const auto hit = load<UIntPacket>(primitives);
        if (to_bits(hit == first) == lanes) {
            if (first != last_) {
                const Triangle &triangle = tree_.triangles[first];
                last_normal_ = cross(triangle.b - triangle.a, triangle.c - triangle.a);
                last_ = first;
            }
            return in_all_lanes(last_normal_);
        }
        constexpr uint32_t FLOATS = sizeof(Triangle) / sizeof(float);
        const UIntPacket place =
            select(from_bits<UIntPacket>(lanes), hit, UIntPacket(first)) * FLOATS;
        const auto vertex = [&](uint32_t number) {
            return by_axis([&](int k) {
                return gather(&tree_.triangles[0].a.x, place + UIntPacket(3 * number + k));
            });
        };
        const Vec3<FloatPacket> a = vertex(0);
        return cross(vertex(1) - a, vertex(2) - a);
    }

private:
    const KdTree &tree_;
    uint32_t last_ = NO_PRIMITIVE;
    Vec3f last_normal_;
};

class TileRenderer {
public:
    TileRenderer(const KdTree &tree, const View &view, const TraceOptions &options,
                 Counters &counters)
        : tree_(tree), view_(view), options_(options), counters_(counters), normals_(tree) {
    }

    void trace_primary(const RayTile &tile) {
        rays_.resize(size_t(tile.side) * tile.side);
        const PrimaryDirections directions(view_);
        for (uint32_t i = 0; i < tile.block_count(); ++i) {
            const Block block = block_of(tile, i, view_);
            const size_t first = size_t(i) * PACKET_WIDTH;
            store_vectors(first, directions(block), block.on_film);
        }
        const uint32_t grid = view_.grid;
        const CameraTile square{view_.camera,          tile.x / grid, tile.y / grid,
                                tile.side / grid,      grid * grid,   0.5f / float(grid),
                                1 - 0.5f / float(grid)};
        const RayGroup group =
            rays_.group(view_.camera.origin, view_.near_clip, view_.far_clip);
        trace_closest(tree_, group, options_, {rays_.t.data(), rays_.primitive.data()},
                      counters_, &square);
    }

    // Shades the hits as if all of them saw the light.
    void write_primary(const RayTile &tile, const FrameOutput &output) {
        for (uint32_t i = 0; i < tile.block_count(); ++i) {
            const size_t first = size_t(i) * PACKET_WIDTH;
            const LaneBits hit = hits(first);
            FloatPacket cosine = 0.0f;
            if (hit != 0)
                cosine = in_lanes(hit, shaded(first, hit).cosine);
            write(tile, i, cosine, hit, output);
        }
    }

    void trace_shadows(const RayTile &tile) {
        for (uint32_t i = 0; i < tile.block_count(); ++i) {
            const size_t first = size_t(i) * PACKET_WIDTH;
            const LaneBits hit = hits(first);
            Shading shading{};
            if (hit != 0)
                shading = shaded(first, hit);
            store_vectors(first, shading.from_light, hit);
            store(&rays_.cosine[first], in_lanes(hit, shading.cosine));
        }
        trace_any(tree_, rays_.group(view_.light, SHADOW_EPSILON, 1 - SHADOW_EPSILON),
                  options_, rays_.occluded.data(), counters_);
    }

    void write_lit(const RayTile &tile, const FrameOutput &output) {
        for (uint32_t i = 0; i < tile.block_count(); ++i) {
            const size_t first = size_t(i) * PACKET_WIDTH;
            const LaneBits occluded = set_bytes(&rays_.occluded[first]);
            const auto cosine = load<FloatPacket>(&rays_.cosine[first]);
            write(tile, i, in_lanes(ALL_LANES & ~occluded, cosine), hits(first) & ~occluded,
                  output);
        }
    }

private:
    LaneBits hits(size_t first) const {
        return to_bits(load<UIntPacket>(&rays_.primitive[first]) != NO_PRIMITIVE);
    }

    Shading shaded(size_t first, LaneBits hit) {
        const FloatPacket t = in_lanes(hit, load<FloatPacket>(&rays_.t[first]));
        return shade(view_, load_vectors(first), t, normals_(&rays_.primitive[first], hit));
    }

    void write(const RayTile &tile, uint32_t block, const FloatPacket &brightness,
               LaneBits lit, const FrameOutput &output) const {
        write_block(view_, block_of(tile, block, view_), brightness,
                    load<UIntPacket>(&rays_.primitive[size_t(block) * PACKET_WIDTH]), lit,
                    output);
    }

    // Directions of the active rays of a block.
    void store_vectors(size_t first, const Vec3<FloatPacket> &vectors, LaneBits active) {
        for (int k = 0; k < 3; ++k)
            store(&rays_.direction[k][first], in_lanes(active, vectors[k], NAN));
    }
    Vec3<FloatPacket> load_vectors(size_t first) const {
        return {load<FloatPacket>(&rays_.direction[0][first]),
                load<FloatPacket>(&rays_.direction[1][first]),
                load<FloatPacket>(&rays_.direction[2][first])};
    }

    // One bit for each of sixteen bytes that are 0 or 1.
    static LaneBits set_bytes(const uint8_t *bytes) {
        LaneBits bits = 0;
        for (uint32_t half = 0; half < 2; ++half) {
            uint64_t eight;
            std::memcpy(&eight, bytes + 8 * half, sizeof(eight));
            // Byte i moves to bit 56 + i, and nothing else gets there or carries into it.
            bits |= LaneBits(eight * 0x0102040810204080u >> 56) << 8 * half;
        }
        return bits;
    }

    const KdTree &tree_;
    const View &view_;
    const TraceOptions &options_;
    Counters &counters_;
    Normals normals_;
    TileRays &rays_ = rays_of_thread();
};

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

WideForm make_wide_form(const KdTree &tree) {
    const Stopwatch watch;
    const WideTree wide = *make_wide_tree(tree); // which nobody cancels
    return {watch.elapsed(), wide.bytes()};
}

Seconds render_frame(const KdTree &tree, const View &view, const TraceOptions &options,
                     const FrameSettings &settings, const FrameOutput &output) {
    const Stopwatch watch;
    for_each_share(view, settings.tile_side, [&](const RayTile &share) {
        Counters counters;
        TileRenderer renderer(tree, view, options, counters);
        for_each_tile(view, share, settings.tile_side, [&](const RayTile &tile) {
            renderer.trace_primary(tile);
            if (settings.shadows) {
                renderer.trace_shadows(tile);
                renderer.write_lit(tile, output);
            } else {
                renderer.write_primary(tile, output);
            }
        });
    });
    return watch.elapsed();
}

double sah_cost(const KdTree &tree) {
    const TreeStatistics statistics = statistics_of(tree);
    const BuildOptions usual;
    return usual.traversal_cost * statistics.expected_traversals +
           usual.intersection_cost * statistics.expected_primitive_visits;
}

Counters count_primary(const KdTree &tree, const View &view, const TraceOptions &options,
                       uint32_t tile_side) {
    Counters total;
    std::mutex mutex;
    for_each_share(view, tile_side, [&](const RayTile &share) {
        Counters counters;
        TileRenderer renderer(tree, view, options, counters);
        for_each_tile(view, share, tile_side,
                      [&](const RayTile &tile) { renderer.trace_primary(tile); });
        const std::lock_guard lock(mutex);
        total += counters;
    });
    return total;
}

} // namespace mlrt::bench
