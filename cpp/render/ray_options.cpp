#include "render/ray_options.h"

#include <cstdint>

namespace mlrt {

namespace {

// Pictures of fewer samples, for each reference of the tree to a triangle, are sparse: rays
// are so far apart that beams of them meet too much. Chosen by where packets take as long
// as beams in conference, sponza, dragon and bunny, which is from 0.05 to 0.15.
constexpr double SPARSE = 0.08;

// Rays without a common origin, if every sample hits something.
double rays_alone(const PreparedScene &scene, const RenderSettings &settings,
                  double samples) {
    const double of_emitters =
        scene.all_emitters_are_points ? 0 : settings.sampling.emitter_samples;
    const uint32_t bsdf_samples = settings.sampling.bsdf_samples;
    const double of_bsdfs =
        bsdf_samples > 0 && looks_for_light_first(scene) ? 0 : bsdf_samples;
    return samples * (of_emitters + of_bsdfs);
}

// The same with one.
double rays_together(const PreparedScene &scene, const RenderSettings &settings,
                     double samples) {
    const double of_cameras = scene.plane.has_common_origin() ? 1 : 0;
    const double of_emitters =
        scene.all_emitters_are_points ? settings.sampling.emitter_samples : 0;
    return samples * (of_cameras + of_emitters);
}

} // namespace

std::optional<RayOptions> prepare_rays(const PreparedScene &scene,
                                       const RenderSettings &settings, double samples,
                                       const std::function<bool()> &cancelled) {
    const KdTree &tree = *scene.data.tree;
    RayOptions options{settings.trace, settings.trace};
    if (settings.trace.traversal == Traversal::wide &&
        !tree.widening->make(tree, cancelled))
        return std::nullopt;
    if (settings.trace.traversal != Traversal::adaptive)
        return options;
    // What a lazy tree will refer to is not known.
    const bool is_sparse =
        !tree.growth && samples < SPARSE * double(tree.references.size());
    const double together = is_sparse ? rays_together(scene, settings, samples) : 0;
    const double alone = rays_alone(scene, settings, samples);
    if (!tree.widening->make_for(tree, uint64_t(alone + together), cancelled))
        return std::nullopt;
    // Beams know how to do with the wide tree.
    if (is_sparse && !tree.widening->tree()) {
        options.together.traversal = Traversal::packet;
        tree.widening->miss(uint64_t(together));
    }
    return options;
}

} // namespace mlrt
