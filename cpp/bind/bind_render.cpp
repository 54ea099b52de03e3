// The function render: a picture as NumPy arrays, with progress and Ctrl-C.
#include "bind/arrays.h"
#include "bind/bind.h"
#include "bind/fields.h"
#include "bind/scene_handle.h"
#include "bind/trace_options.h"
#include "bind/watch.h"
#include "render/filter.h"
#include "render/render.h"

#include <chrono>
#include <memory>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>
#include <string>

namespace nb = nanobind;

namespace mlrt {

namespace {

constexpr const char *RENDER_DOCSTRING =
    R"(Renders direct light from samples of emitters and of materials.

options: fields of TraceOptions (mlrta/trace.h), names of enumerators as str; they never
change the picture.
sampler: fields of Sampler (render/spread_samples.h), the type by its name.
emitter_samples, bsdf_samples: of each camera sample, weighed by the power heuristic if both
are taken; light from one direction counts for each emitter sample, as in Mitsuba's `direct`.
shadow_offset: where shadow rays begin and end, 'mitsuba' or 'robust' (render/shadow_offset.h).
aovs: names among 'depth' (float32 (H, W), distance from the near plane, 0 for a miss) and
'normal' (float32 (H, W, 3), shading normal) and 'moment' (float32 (H, W, 6), the samples in
CIE XYZ and their squares), which are filtered as the colours are, and
'prim' (int32 (H, W), face that each pixel's first sample hit, -1 for a miss); 'cost' (float32
(H, W), nodes visited and triangles tested for all rays of a sample, the mean of the pixel's
samples, where rays that are traced together share alike) tells of the options.
progress: called as progress(done), done from 0 to 1, on the calling thread and at most
about ten times a second.

Returns a dict: image float32 (H, W, 3) over the film's crop, aovs, counters (fields of
Counters, base/counters.h, after 'primary_', 'shadow_' and 'bsdf_'), seconds. Raises ValueError or
TypeError for bad arguments, KeyboardInterrupt on Ctrl-C, and whatever progress raises.)";

AovSet aovs_from(const std::vector<std::string> &names) {
    AovSet aovs;
    for (const std::string &name : names) {
        if (name == "depth")
            aovs.depth = true;
        else if (name == "normal")
            aovs.normal = true;
        else if (name == "moment")
            aovs.moment = true;
        else if (name == "prim")
            aovs.primitive = true;
        else if (name == "cost")
            aovs.cost = true;
        else
            refuse_value("aovs must be among: depth, normal, moment, prim, cost; not '" +
                         name + "'.");
    }
    return aovs;
}

ShadowOffset shadow_offset_from(const std::string &name) {
    if (name == "mitsuba")
        return ShadowOffset::mitsuba;
    if (name == "robust")
        return ShadowOffset::robust;
    refuse_value("shadow_offset must be 'mitsuba' or 'robust', not '" + name + "'.");
}

void check_sampling(const Film &film, uint32_t spp, const Sampling &sampling) {
    constexpr uint32_t MOST = 256; // chosen: memory grows with them
    if (sampling.emitter_samples > MOST || sampling.bsdf_samples > MOST)
        refuse_value("emitter_samples and bsdf_samples must be at most 256.");
    if (!takes(sampling.sampler.type, spp))
        refuse_value("spp = " + std::to_string(spp) +
                     " is no number of samples that the sampler can take.");
    const PixelRect sampled = sampled_pixels(film, ReconstructionFilter(film));
    const uint64_t samples = uint64_t(sampled.width) * sampled.height * spp;
    if (sampling.sampler.type != SamplerType::independent && samples > 0xffffffffu)
        refuse_value("The sampler numbers samples in 32 bits, and the picture has more.");
}

nb::dict render_scene(const SceneHandle &handle, uint32_t spp, uint32_t seed,
                      const nb::dict &options, const std::vector<std::string> &aovs,
                      nb::object progress, const std::string &shadow_offset,
                      const nb::dict &sampler, uint32_t emitter_samples,
                      uint32_t bsdf_samples) {
    if (spp == 0)
        refuse_value("spp must be at least 1.");
    if (!progress.is_none() && !PyCallable_Check(progress.ptr()))
        refuse_type("progress must be callable or None.");
    RenderSettings settings;
    settings.samples_per_pixel = spp;
    settings.seed = seed;
    settings.trace = trace_options_from(options);
    settings.aovs = aovs_from(aovs);
    settings.shadow_offset = shadow_offset_from(shadow_offset);
    settings.sampling = {sampler_from(sampler), emitter_samples, bsdf_samples};
    check_sampling(handle.scene->data.film, spp, settings.sampling);

    // Keeps the scene alive: another thread may drop the handle meanwhile.
    const std::shared_ptr<const PreparedScene> scene = handle.scene;
    RenderResult result;
    Watch watch(std::move(progress));
    const auto begin = std::chrono::steady_clock::now();
    {
        const nb::gil_scoped_release release;
        render(*scene, settings, result, std::ref(watch));
    }
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    watch.rethrow();

    const size_t height = scene->data.film.crop_height, width = scene->data.film.crop_width;
    nb::dict pictures;
    if (settings.aovs.depth)
        pictures["depth"] = to_numpy(result.depth.release(), {height, width});
    if (settings.aovs.normal)
        pictures["normal"] = to_numpy(result.normal.release(), {height, width, 3});
    if (settings.aovs.moment)
        pictures["moment"] = to_numpy(result.moment.release(), {height, width, 6});
    if (settings.aovs.primitive)
        pictures["prim"] = to_numpy(result.primitive.release(), {height, width});
    if (settings.aovs.cost)
        pictures["cost"] = to_numpy(result.cost.release(), {height, width});
    nb::dict counters;
    counters.update(counters_to_dict(result.counters.primary, "primary_"));
    counters.update(counters_to_dict(result.counters.shadow, "shadow_"));
    counters.update(counters_to_dict(result.counters.bsdf, "bsdf_"));
    nb::dict answer;
    answer["image"] = to_numpy(result.image.release(), {height, width, 3});
    answer["aovs"] = pictures;
    answer["counters"] = counters;
    answer["seconds"] = seconds;
    return answer;
}

} // namespace

Sampler sampler_from(nb::handle dict) {
    Fields fields(dict, "sampler");
    Sampler sampler;
    sampler.type = fields.choice<SamplerType>("type",
                                              {{"independent", SamplerType::independent},
                                               {"stratified", SamplerType::stratified},
                                               {"multijitter", SamplerType::multijitter},
                                               {"orthogonal", SamplerType::orthogonal},
                                               {"ldsampler", SamplerType::ldsampler}},
                                              SamplerType::independent);
    sampler.base_seed = fields.integer_or("base_seed", 0);
    sampler.jitter = fields.boolean("jitter", true);
    fields.finish();
    return sampler;
}

void bind_render(nb::module_ &m) {
    m.def("render", &render_scene, nb::arg("scene"), nb::arg("spp"), nb::arg("seed") = 0,
          nb::arg("options") = nb::dict(), nb::arg("aovs") = std::vector<std::string>(),
          nb::arg("progress") = nb::none(), nb::arg("shadow_offset") = "mitsuba",
          nb::arg("sampler") = nb::dict(), nb::arg("emitter_samples") = 1,
          nb::arg("bsdf_samples") = 0, RENDER_DOCSTRING);
}

} // namespace mlrt
