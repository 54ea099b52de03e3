// The function render: a picture as NumPy arrays, with progress and Ctrl-C.
#include "bind/bind.h"
#include "bind/scene_handle.h"
#include "bind/trace_options.h"
#include "render/render.h"

#include <chrono>
#include <memory>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>
#include <optional>
#include <string>

namespace nb = nanobind;

namespace mlrt {

namespace {

constexpr const char *RENDER_DOCSTRING =
    R"(Renders direct light with one emitter sample a camera sample.

options: fields of TraceOptions (mlrta/trace.h), names of enumerators as str; they never
change the picture.
aovs: names among 'depth' (float32 (H, W), distance from the near plane, 0 for a miss) and
'normal' (float32 (H, W, 3), shading normal), which are filtered as the colours are, and
'prim' (int32 (H, W), face that each pixel's first sample hit, -1 for a miss).
progress: called as progress(done), done from 0 to 1, on the calling thread and at most
about ten times a second.

Returns a dict: image float32 (H, W, 3) over the film's crop, aovs, counters (fields of
Counters, base/counters.h, after 'primary_' and 'shadow_'), seconds. Raises ValueError or
TypeError for bad arguments, KeyboardInterrupt on Ctrl-C, and whatever progress raises.)";

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

// Looks for Ctrl-C and reports progress, at most about ten times a second. Runs on the
// thread that called render; remembers an exception until that thread holds the interpreter
// again.
class Watch {
public:
    explicit Watch(nb::object progress) : progress_(std::move(progress)) {}

    bool operator()(float done) {
        constexpr double PERIOD = 0.1; // seconds
        if (error_)
            return true;
        if (seconds_since(last_) < PERIOD)
            return false;
        const nb::gil_scoped_acquire gil;
        last_ = Clock::now();
        try {
            if (PyErr_CheckSignals() != 0)
                throw nb::python_error();
            if (!progress_.is_none())
                progress_(done);
        } catch (nb::python_error &error) {
            error_.emplace(std::move(error));
        }
        return error_.has_value();
    }

    void rethrow() {
        if (error_)
            throw std::move(*error_);
    }

private:
    nb::object progress_;
    Clock::time_point last_ = Clock::now();
    std::optional<nb::python_error> error_;
};

template <typename T>
nb::object to_numpy(std::vector<T> &&values, std::initializer_list<size_t> shape) {
    auto owned = std::make_unique<std::vector<T>>(std::move(values));
    T *data = owned->data();
    const nb::capsule owner(owned.get(), [](void *p) noexcept {
        const std::unique_ptr<std::vector<T>> freed(static_cast<std::vector<T> *>(p));
    });
    owned.release();
    return nb::ndarray<nb::numpy, T>(data, shape, owner).cast();
}

AovSet aovs_from(const std::vector<std::string> &names) {
    AovSet aovs;
    for (const std::string &name : names) {
        if (name == "depth")
            aovs.depth = true;
        else if (name == "normal")
            aovs.normal = true;
        else if (name == "prim")
            aovs.primitive = true;
        else
            refuse_value("aovs must be among: depth, normal, prim; not '" + name + "'.");
    }
    return aovs;
}

nb::dict render_scene(const SceneHandle &handle, uint32_t spp, uint32_t seed,
                      const nb::dict &options, const std::vector<std::string> &aovs,
                      nb::object progress) {
    if (spp == 0)
        refuse_value("spp must be at least 1.");
    if (!progress.is_none() && !PyCallable_Check(progress.ptr()))
        refuse_type("progress must be callable or None.");
    RenderSettings settings;
    settings.samples_per_pixel = spp;
    settings.seed = seed;
    settings.trace = trace_options_from(options);
    settings.aovs = aovs_from(aovs);

    // Keeps the scene alive: another thread may drop the handle meanwhile.
    const std::shared_ptr<const PreparedScene> scene = handle.scene;
    RenderResult result;
    Watch watch(std::move(progress));
    const Clock::time_point begin = Clock::now();
    {
        const nb::gil_scoped_release release;
        render(*scene, settings, result, std::ref(watch));
    }
    const double seconds = seconds_since(begin);
    watch.rethrow();

    const size_t height = scene->data.film.crop_height, width = scene->data.film.crop_width;
    nb::dict pictures;
    if (settings.aovs.depth)
        pictures["depth"] = to_numpy(std::move(result.depth), {height, width});
    if (settings.aovs.normal)
        pictures["normal"] = to_numpy(std::move(result.normal), {height, width, 3});
    if (settings.aovs.primitive)
        pictures["prim"] = to_numpy(std::move(result.primitive), {height, width});
    nb::dict counters;
    counters.update(counters_to_dict(result.counters.primary, "primary_"));
    counters.update(counters_to_dict(result.counters.shadow, "shadow_"));
    nb::dict answer;
    answer["image"] = to_numpy(std::move(result.image), {height, width, 3});
    answer["aovs"] = pictures;
    answer["counters"] = counters;
    answer["seconds"] = seconds;
    return answer;
}

} // namespace

void bind_render(nb::module_ &m) {
    m.def("render", &render_scene, nb::arg("scene"), nb::arg("spp"), nb::arg("seed") = 0,
          nb::arg("options") = nb::dict(), nb::arg("aovs") = std::vector<std::string>(),
          nb::arg("progress") = nb::none(), RENDER_DOCSTRING);
}

} // namespace mlrt
