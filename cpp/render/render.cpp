#include "render/render.h"

#include "base/parallel.h"
#include "render/ray_options.h"
#include "render/work_items.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

namespace mlrt {

namespace {

void make_room(const RenderSettings &settings, size_t pixel_count, RenderResult &result) {
    const AovSet &aovs = settings.aovs;
    result.image = PixelArray<float>(3 * pixel_count);
    result.depth = PixelArray<float>(aovs.depth ? pixel_count : 0);
    result.normal = PixelArray<float>(aovs.normal ? 3 * pixel_count : 0);
    result.moment = PixelArray<float>(aovs.moment ? 6 * pixel_count : 0);
    result.primitive = PixelArray<int32_t>(aovs.primitive ? pixel_count : 0);
    result.cost = PixelArray<float>(aovs.cost ? pixel_count : 0);
    std::fill_n(result.cost.data(), result.cost.size(), 0.0f);
}

// In the order of ChannelNumbers.
FilmTarget film_target(RenderResult &result) {
    FilmTarget target{result.image.data(), {}};
    if (result.depth.size() > 0)
        target.others.push_back({result.depth.data(), 1});
    for (int k = 0; k < 3 && result.normal.size() > 0; ++k)
        target.others.push_back({result.normal.data() + k, 3});
    for (int k = 0; k < 6 && result.moment.size() > 0; ++k)
        target.others.push_back({result.moment.data() + k, 6});
    return target;
}

// A tile, unless there would be too few of them for all threads to have work.
uint32_t rays_per_group(const TraceOptions &options, double samples) {
    constexpr double ENOUGH_GROUPS = 16; // chosen
    constexpr double LARGE_BEAM = 1024;  // smaller groups would cut usual beams short
    const double tile = double(options.initial_tile) * options.initial_tile;
    return uint32_t(std::min(tile, std::max(LARGE_BEAM, samples / ENOUGH_GROUPS)));
}

} // namespace

bool render(const PreparedScene &scene, const RenderSettings &settings,
            RenderResult &result, const std::function<bool(float)> &cancelled) {
    const Film &film = scene.data.film;
    result = {};
    make_room(settings, size_t(film.crop_width) * film.crop_height, result);
    PictureFilm picture(film, settings.samples_per_pixel, film_target(result));
    const PixelRect &sampled = picture.sampled();
    const SampleStreams streams(settings.seed, sampled.width * sampled.height,
                                settings.samples_per_pixel);
    const double all_samples =
        double(sampled.width) * sampled.height * settings.samples_per_pixel;
    const WorkItems items(sampled, settings.samples_per_pixel,
                          rays_per_group(settings.trace, all_samples));
    const TileTarget target{picture, ChannelNumbers(settings.aovs), result.primitive.data(),
                            result.cost.data()};

    const std::optional<RayOptions> options = prepare_rays(
        scene, settings, all_samples, [&] { return cancelled && cancelled(0); });
    if (!options)
        return false;
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
            return std::make_unique<TileRenderer>(scene, streams, settings.sampling,
                                                  *options, settings.shadow_offset, target);
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
            samples_done.fetch_add(group.ray_count(), std::memory_order_relaxed);
        });
        const std::lock_guard lock(tiles_mutex);
        idle_tiles.push_back(std::move(tile));
    };
    if (!parallel_for(items.count(), render_item, ask) || stop)
        return false;
    for (const std::unique_ptr<TileRenderer> &tile : idle_tiles) {
        result.counters.primary += tile->counters().primary;
        result.counters.shadow += tile->counters().shadow;
        result.counters.bsdf += tile->counters().bsdf;
    }
    return parallel_for(picture.rows_to_finish(),
                        [&](uint32_t row) { picture.finish_row(row); });
}

} // namespace mlrt
