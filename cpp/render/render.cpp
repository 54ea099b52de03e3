#include "render/render.h"

#include "base/parallel.h"
#include "render/work_items.h"

#include <atomic>
#include <memory>
#include <mutex>
#include <thread>

namespace mlrt {

namespace {

// Divides one row of sums by their weights (Mitsuba's hdrfilm.cpp, develop).
void develop_row(const FilmBlocks &blocks, const FilmChannels &channels, const Film &film,
                 uint32_t row, RenderResult &result) {
    std::vector<float> sums(channels.count);
    for (uint32_t column = 0; column < film.crop_width; ++column) {
        const float weight = blocks.pixel(column, row, sums.data());
        const float divisor = weight == 0 ? 1.0f : weight;
        const size_t pixel = size_t(row) * film.crop_width + column;
        for (int k = 0; k < 3; ++k)
            result.image[3 * pixel + k] = sums[k] / divisor;
        if (channels.depth >= 0)
            result.depth[pixel] = sums[channels.depth] / divisor;
        for (int k = 0; k < 3 && channels.normal >= 0; ++k)
            result.normal[3 * pixel + k] = sums[channels.normal + k] / divisor;
    }
}

} // namespace

bool render(const PreparedScene &scene, const RenderSettings &settings,
            RenderResult &result, const std::function<bool(float)> &cancelled) {
    const Film &film = scene.data.film;
    const FilmChannels channels(settings.aovs);
    FilmBlocks blocks(film, channels.count);
    const PixelRect &sampled = blocks.sampled();
    const SampleStreams streams(settings.seed, sampled.width * sampled.height,
                                settings.samples_per_pixel);
    const uint32_t side = settings.trace.initial_tile;
    const WorkItems items(sampled, settings.samples_per_pixel, side * side);

    const size_t pixel_count = size_t(film.crop_width) * film.crop_height;
    result = {};
    result.image.resize(3 * pixel_count);
    result.depth.resize(settings.aovs.depth ? pixel_count : 0);
    result.normal.resize(settings.aovs.normal ? 3 * pixel_count : 0);
    result.primitive.resize(settings.aovs.primitive ? pixel_count : 0);
    result.cost.resize(settings.aovs.cost ? pixel_count : 0);
    const TileTarget target{blocks, channels,
                            settings.aovs.primitive ? result.primitive.data() : nullptr,
                            settings.aovs.cost ? result.cost.data() : nullptr};

    const double all_samples =
        double(sampled.width) * sampled.height * settings.samples_per_pixel;
    std::atomic<uint64_t> samples_done{0};
    std::atomic<bool> stop{false};
    const auto ask = [&] {
        const uint64_t done = samples_done.load(std::memory_order_relaxed);
        if (cancelled && cancelled(float(double(done) / all_samples)))
            stop.store(true, std::memory_order_relaxed);
        return stop.load(std::memory_order_relaxed);
    };
    // Its buffers are large: as many as there are threads serve all items.
    std::mutex tiles_mutex;
    std::vector<std::unique_ptr<TileRenderer>> idle_tiles;
    const auto take_tile = [&]() -> std::unique_ptr<TileRenderer> {
        const std::lock_guard lock(tiles_mutex);
        if (idle_tiles.empty())
            return std::make_unique<TileRenderer>(scene, streams, settings.trace,
                                                  settings.shadow_offset, target);
        std::unique_ptr<TileRenderer> tile = std::move(idle_tiles.back());
        idle_tiles.pop_back();
        return tile;
    };
    const std::thread::id caller = std::this_thread::get_id();
    const auto render_item = [&](uint32_t item) {
        std::unique_ptr<TileRenderer> tile = take_tile();
        const bool may_ask = std::this_thread::get_id() == caller;
        items.for_each_group(item, [&](const PixelGroup &group) {
            // An item with many samples takes long: ask before each of its groups.
            if (may_ask ? ask() : stop.load(std::memory_order_relaxed))
                return;
            tile->render(group);
            samples_done.fetch_add(uint64_t(group.pixels.size()) * group.sample_count,
                                   std::memory_order_relaxed);
        });
        const std::lock_guard lock(tiles_mutex);
        idle_tiles.push_back(std::move(tile));
    };
    if (!parallel_for(items.count(), render_item, ask) || stop)
        return false;
    for (const std::unique_ptr<TileRenderer> &tile : idle_tiles) {
        result.counters.primary += tile->counters().primary;
        result.counters.shadow += tile->counters().shadow;
    }
    return parallel_for(film.crop_height, [&](uint32_t row) {
        develop_row(blocks, channels, film, row, result);
    });
}

} // namespace mlrt
