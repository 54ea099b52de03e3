#include "render/prepared_scene.h"

#include "render/shadow_offset.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace mlrt {

namespace {

// Areas below that have squares that single precision may lose digits of.
constexpr float SMALL_AREA = 0x1p-50f;

float parallelogram_area(Vec3f u, Vec3f v) {
    const float usual = length(cross(u, v));
    return usual > SMALL_AREA ? usual : float(length(cross(Vec3d(u), Vec3d(v))));
}

float face_area(const Triangle &triangle) {
    return 0.5f * parallelogram_area(triangle.b - triangle.a, triangle.c - triangle.a);
}

// Makes the edges of faces with such areas about 1 long.
float scale_of_edges(float inverse_area) {
    if (!(inverse_area > 1 / SMALL_AREA))
        return 1;
    return std::ldexp(1.0f, std::ilogb(std::sqrt(inverse_area)));
}

// How far, at most, faces of a rectangle lie off the plane of the first of them.
float unevenness(const SceneData &scene, const Shape &shape) {
    const auto triangle = [&](uint32_t i) -> const Triangle & {
        return scene.tree->triangles[shape.first_face + i];
    };
    const Vec3d a(triangle(0).a);
    const Vec3d normal =
        normalize(cross(Vec3d(triangle(0).b) - a, Vec3d(triangle(0).c) - a));
    double largest = 0;
    for (uint32_t i = 1; i < shape.face_count; ++i)
        for (const Vec3f &vertex : {triangle(i).a, triangle(i).b, triangle(i).c})
            largest = std::max(largest, std::abs(dot(normal, Vec3d(vertex) - a)));
    return std::nextafter(float(largest), std::numeric_limits<float>::infinity());
}

// Rays from a light end at surfaces, off by half a unit in the last place of their length:
// from a light that is much farther away than the scene is large they would end too far
// off, and begin at the surface instead.
bool is_near(const Box3f &bounds, Vec3f light) {
    constexpr float FAR = 16; // chosen: the offset of a hit grows up to that much
    return max_component(abs(light)) <=
           FAR * std::max(max_component(abs(bounds.lo)), max_component(abs(bounds.hi)));
}

// As Mitsuba has it: of a sphere or cylinder, that of the radius along the x axis of its
// frame; of a disk, that of the ellipse.
double analytic_area(const AnalyticShape &shape) {
    using std::numbers::pi;
    const auto &[x, y, z] = shape.frame.axes;
    switch (shape.type) {
    case AnalyticType::sphere:
        return 4 * pi * dot(x, x);
    case AnalyticType::disk:
        return pi * length(cross(x, y));
    case AnalyticType::cylinder:
        return 2 * pi * length(x) * length(z);
    }
    return 0;
}

Vec3f disk_normal(const AnalyticShape &disk) {
    const Vec3d normal = normalize(cross(disk.frame.axes[0], disk.frame.axes[1]));
    return Vec3f(disk.frame.determinant() < 0 ? -normal : normal);
}

Box3f bounds_of(const SceneData &scene) {
    Box3f bounds = scene.tree->bounds;
    if (scene.objects && !scene.objects->hierarchy.empty()) {
        bounds.add(scene.objects->hierarchy.bounds().lo);
        bounds.add(scene.objects->hierarchy.bounds().hi);
    }
    return bounds;
}

PointLight<float> point_light(const Emitter &emitter) {
    constexpr float EVERYWHERE = -std::numeric_limits<float>::infinity();
    if (emitter.type == EmitterType::point)
        return {emitter.position, emitter.radiance, {}, EVERYWHERE, EVERYWHERE, 0, 0};
    return {emitter.position,
            emitter.radiance,
            emitter.direction,
            float(std::cos(double(emitter.cutoff_angle))),
            float(std::cos(double(emitter.beam_width))),
            emitter.cutoff_angle,
            1.0f / (emitter.cutoff_angle - emitter.beam_width)};
}

EmitterTable prepare_emitter(const PreparedScene &prepared, const Emitter &emitter) {
    const SceneData &scene = prepared.data;
    EmitterTable table;
    if (emitter.type == EmitterType::projector)
        table.projector = Projector(emitter);
    if (emitter.type == EmitterType::spot || emitter.type == EmitterType::point)
        table.point = point_light(emitter);
    if (is_at_point(emitter.type)) {
        // Rays from a light would also be rounded in the frames of instances, at both ends.
        table.shadow_rays_from_light = !prepared.bounds.empty() &&
                                       is_near(prepared.bounds, emitter.position) &&
                                       (!scene.objects || scene.objects->instances.empty());
    }
    if (emitter.type != EmitterType::area)
        return table;

    const Shape &shape = scene.shapes[emitter.shape];
    if (const AnalyticShape *analytic = prepared.analytic(shape)) {
        table.inverse_area = float(1 / analytic_area(*analytic));
        if (emitter.radiance_texture != NONE)
            table.texture = TextureSampler(scene.textures[emitter.radiance_texture]);
        if (analytic->type == AnalyticType::disk)
            table.normal =
                shape.flip_normals ? -disk_normal(*analytic) : disk_normal(*analytic);
    } else if (emitter.rectangle) {
        const Vec3f normal = cross(emitter.edge_u, emitter.edge_v);
        table.unevenness = unevenness(scene, shape);
        const float area = parallelogram_area(emitter.edge_u, emitter.edge_v);
        table.inverse_area = area > 0 ? 1.0f / area : 0.0f;
        if (emitter.radiance_texture != NONE)
            table.texture = TextureSampler(scene.textures[emitter.radiance_texture]);
        // A mirrored rectangle glows on the side of its vertex normals, which is not that
        // of its edges' product.
        table.normal = shape.vertex_normals
                           ? scene.normals[scene.faces[shape.first_face][0]]
                           : normal * table.inverse_area;
        if (shape.flip_normals)
            table.normal = -table.normal;
    } else {
        std::vector<float> areas(shape.face_count);
        for (uint32_t i = 0; i < shape.face_count; ++i)
            areas[i] = face_area(scene.tree->triangles[shape.first_face + i]);
        table.face_areas = Distribution(areas);
        table.inverse_area = table.face_areas.normalization();
        table.edge_scale = scale_of_edges(table.inverse_area);
    }
    return table;
}

FewPoints find_few_points(const PreparedScene &scene) {
    const uint32_t count = uint32_t(scene.emitter_tables.size());
    FewPoints points{};
    for (uint32_t i = 0; i < count; ++i) {
        set_light(points.lights, i, scene.emitter_tables[i].point);
        points.choice_weights[i] = scene.emitter_choice.empty() || count == 1
                                       ? float(count)
                                       : 1.0f / scene.emitter_choice.probability(i);
    }
    return points;
}

} // namespace

PreparedScene::PreparedScene(SceneData scene_data)
    : data(std::move(scene_data)), plane(image_plane(data.camera, data.film)),
      environment(data), bounds(bounds_of(data)) {
    shape_of_face.resize(data.objects ? data.objects->face_end()
                                      : data.tree->triangles.size());
    for (uint32_t i = 0; i < data.shapes.size(); ++i) {
        const Shape &shape = data.shapes[i];
        if (shape.emitter != NONE) {
            any_shape_glows = true;
            glowing_faces.add(shape);
        }
        shape_materials.push_back(shape.material == NONE ? Material{}
                                                         : data.materials[shape.material]);
        if (shape_materials.back().is_textured())
            textured_faces.add(shape);
        std::fill_n(shape_of_face.begin() + shape.first_face, shape.face_count, i);
    }

    std::vector<float> weights;
    for (const Emitter &emitter : data.emitters) {
        emitter_tables.push_back(prepare_emitter(*this, emitter));
        weights.push_back(emitter.sampling_weight);
        all_emitters_are_points &= emitter.type == EmitterType::point ||
                                   emitter.type == EmitterType::spot ||
                                   emitter.sampling_weight == 0;
    }
    if (std::any_of(weights.begin(), weights.end(), [](float w) { return w != 1.0f; }))
        emitter_choice = Distribution(weights);
    if (all_emitters_are_points && emitter_tables.size() <= PACKET_WIDTH)
        few_points = find_few_points(*this);

    if (!bounds.empty()) {
        center = (bounds.lo + bounds.hi) * 0.5f;
        radius = std::max(RAY_EPSILON, length(bounds.hi - center) * (1 + RAY_EPSILON));
    }
}

} // namespace mlrt
