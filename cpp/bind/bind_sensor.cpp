// Camera and film of a scene, from their dicts.
#include "bind/fields.h"
#include "bind/scene_handle.h"
#include "render/filter.h"

#include <cmath>
#include <cstdint>

namespace nb = nanobind;

namespace mlrt {

Camera camera_from(nb::handle dict) {
    Fields fields(dict, "camera");
    Camera camera;
    camera.origin = fields.vector("origin");
    camera.axes = fields.vectors("axes");
    camera.type = fields.choice<CameraType>("type",
                                            {{"perspective", CameraType::perspective},
                                             {"thinlens", CameraType::thinlens},
                                             {"orthographic", CameraType::orthographic}},
                                            CameraType::perspective);
    const bool lens = camera.type == CameraType::thinlens;
    camera.tan_half_fov_x = camera.type == CameraType::orthographic
                                ? fields.number("tan_half_fov_x", 1)
                                : fields.number("tan_half_fov_x");
    camera.half_extent = fields.vector2("half_extent", {1, 1});
    camera.aperture_radius =
        lens ? fields.number("aperture_radius") : fields.number("aperture_radius", 0);
    camera.focus_distance =
        lens ? fields.number("focus_distance") : fields.number("focus_distance", 1);
    camera.samples_time = fields.boolean("samples_time", false);
    camera.near_clip = fields.number("near_clip");
    camera.far_clip = fields.number("far_clip");
    camera.principal_point_offset = fields.vector2("principal_point_offset", {});
    fields.finish();
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            if (std::abs(dot(camera.axes[i], camera.axes[j]) - float(i == j)) > 1e-3f)
                refuse_value("camera['axes'] must be orthogonal unit vectors.");
    if (!(camera.tan_half_fov_x > 0))
        refuse_value("camera['tan_half_fov_x'] must be positive.");
    if (!(camera.half_extent.x > 0 && camera.half_extent.y > 0))
        refuse_value("camera['half_extent'] must be positive.");
    if (!(camera.aperture_radius >= 0))
        refuse_value("camera['aperture_radius'] must not be negative.");
    if (!(camera.focus_distance > 0))
        refuse_value("camera['focus_distance'] must be positive.");
    if (!(camera.near_clip >= 0 && camera.far_clip > camera.near_clip))
        refuse_value(
            "camera['far_clip'] must exceed camera['near_clip'], which must not be "
            "negative.");
    return camera;
}

Film film_from(nb::handle dict) {
    constexpr uint32_t MAX_SIDE = 1u << 16;
    constexpr uint64_t MAX_PIXELS = 1ull << 31; // they are numbered in 32 bits
    constexpr float MAX_RADIUS = 16; // chosen: the footprint of a sample is 33 x 33
    Fields fields(dict, "film");
    Film film;
    film.width = fields.integer("width", MAX_SIDE);
    film.height = fields.integer("height", MAX_SIDE);
    film.crop_x = fields.integer_or("crop_x", 0, MAX_SIDE);
    film.crop_y = fields.integer_or("crop_y", 0, MAX_SIDE);
    film.crop_width = fields.integer_or("crop_width", film.width, MAX_SIDE);
    film.crop_height = fields.integer_or("crop_height", film.height, MAX_SIDE);
    film.filter =
        fields.choice<FilterType>("filter", {{"box", FilterType::box},
                                             {"tent", FilterType::tent},
                                             {"gaussian", FilterType::gaussian},
                                             {"mitchell", FilterType::mitchell},
                                             {"catmullrom", FilterType::catmullrom},
                                             {"lanczos", FilterType::lanczos}});
    film.filter_radius = film.filter == FilterType::box
                             ? fields.number("filter_radius", 0.5f)
                             : fields.number("filter_radius");
    film.filter_stddev = film.filter == FilterType::gaussian
                             ? fields.number("filter_stddev")
                             : fields.number("filter_stddev", 0.5f);
    film.filter_b = fields.number("filter_b", film.filter_b);
    film.filter_c = fields.number("filter_c", film.filter_c);
    film.sample_border = fields.boolean("sample_border", false);
    fields.finish();
    if (film.crop_width == 0 || film.crop_height == 0 ||
        film.crop_x + film.crop_width > film.width ||
        film.crop_y + film.crop_height > film.height)
        refuse_value("film has an empty crop or one that exceeds its width and height.");
    if (!(film.filter_radius > 0 && film.filter_radius <= MAX_RADIUS))
        refuse_value("film['filter_radius'] must be positive and at most 16 pixels.");
    if (!(film.filter_stddev > 0))
        refuse_value("film['filter_stddev'] must be positive.");
    const PixelRect sampled = sampled_pixels(film, ReconstructionFilter(film));
    if (uint64_t(sampled.width) * sampled.height > MAX_PIXELS)
        refuse_value("film has more than 2^31 pixels to sample; render it crop by crop.");
    return film;
}

} // namespace mlrt
