// The class Scene: arrays and dicts of an imported scene, checked once.
#include "bind/bind.h"
#include "bind/fields.h"
#include "bind/objects_handle.h"
#include "bind/scene_checks.h"
#include "bind/scene_handle.h"
#include "bind/textures.h"
#include "bind/tree_handle.h"

#include <cmath>
#include <cstring>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

namespace nb = nanobind;

namespace mlrt {

namespace {

template <typename T>
using Array = nb::ndarray<const T, nb::c_contig, nb::device::cpu>;

std::string numbered(const char *list, size_t i) {
    return std::string(list) + "[" + std::to_string(i) + "]";
}

template <typename Element, typename T>
std::vector<Element> rows(const Array<T> &array, const char *name) {
    constexpr size_t width = sizeof(Element) / sizeof(T);
    static_assert(sizeof(Element) == width * sizeof(T));
    if (array.ndim() != 2 || array.shape(1) != width)
        refuse_value(std::string(name) + " must have shape (N, " + std::to_string(width) +
                     ").");
    std::vector<Element> result(array.shape(0));
    if (!result.empty())
        std::memcpy(static_cast<void *>(result.data()), array.data(),
                    result.size() * sizeof(Element));
    return result;
}

uint32_t texture_number(uint32_t number, size_t material, size_t count) {
    if (number != NONE && number >= count)
        refuse_value(numbered("material_textures", material) + " refers to texture " +
                     std::to_string(number) + ", but there are " + std::to_string(count) +
                     ".");
    return number;
}

void add_textures(std::vector<Material> &materials,
                  const std::optional<Array<uint32_t>> &numbers, size_t texture_count) {
    if (!numbers)
        return;
    if (numbers->ndim() != 2 || numbers->shape(0) != materials.size() ||
        numbers->shape(1) != 3)
        refuse_value("material_textures must have shape (M, 3), as many as materials.");
    for (size_t i = 0; i < materials.size(); ++i) {
        const uint32_t *in = numbers->data() + 3 * i;
        materials[i].front_texture = texture_number(in[0], i, texture_count);
        materials[i].back_texture = texture_number(in[1], i, texture_count);
        materials[i].opacity = texture_number(in[2], i, texture_count);
    }
}

Specular specular_from(nb::handle dict, const std::string &name, size_t texture_count) {
    Fields fields(dict, name);
    Specular specular;
    specular.type = fields.choice<SpecularType>(
        "type", {{"conductor", SpecularType::conductor},
                 {"dielectric", SpecularType::dielectric},
                 {"thindielectric", SpecularType::thindielectric}});
    specular.reflectance = fields.vector("reflectance", specular.reflectance);
    specular.transmittance = fields.vector("transmittance", specular.transmittance);
    specular.reflectance_texture = fields.index("reflectance_texture", texture_count, NONE);
    specular.transmittance_texture =
        fields.index("transmittance_texture", texture_count, NONE);
    specular.eta = fields.vector("eta", specular.eta);
    specular.k = fields.vector("k", specular.k);
    specular.ior = fields.number("ior", specular.ior);
    fields.finish();
    if (!(specular.ior > 0))
        refuse_value(name + "['ior'] must be positive.");
    return specular;
}

using SpecularSides = std::vector<std::tuple<uint32_t, uint32_t, bool>>;

void add_speculars(SceneData &scene, const nb::list &speculars,
                   const SpecularSides &sides) {
    for (size_t i = 0; i < speculars.size(); ++i)
        scene.speculars.push_back(
            specular_from(speculars[i], numbered("speculars", i), scene.textures.size()));
    if (!sides.empty() && sides.size() != scene.materials.size())
        refuse_value(
            "material_speculars must be empty or have as many entries as materials.");
    for (size_t i = 0; i < sides.size(); ++i) {
        const auto [front, back, delta] = sides[i];
        for (const uint32_t side : {front, back})
            if (side != NONE && side >= scene.speculars.size())
                refuse_value(numbered("material_speculars", i) + " refers to specular " +
                             std::to_string(side) + ", but there are " +
                             std::to_string(scene.speculars.size()) + ".");
        scene.materials[i].front_specular = front;
        scene.materials[i].back_specular = back;
        scene.materials[i].delta = delta;
    }
}

std::vector<Material> materials_from(const Array<float> &array) {
    if (array.ndim() != 3 || array.shape(1) != 2 || array.shape(2) != 3)
        refuse_value("materials must have shape (M, 2, 3).");
    std::vector<Material> materials;
    for (size_t i = 0; i < array.shape(0); ++i) {
        const float *in = array.data() + 6 * i;
        Material &material = materials.emplace_back();
        material.front = {in[0], in[1], in[2]};
        material.back = {in[3], in[4], in[5]};
        for (int k = 0; k < 6; ++k)
            if (!(std::isfinite(in[k]) && in[k] >= 0))
                refuse_value(numbered("materials", i) +
                             " must be finite and not negative.");
    }
    return materials;
}

Shape shape_from(nb::handle dict, const std::string &name, const SceneData &scene,
                 size_t emitter_count) {
    Fields fields(dict, name);
    Shape shape;
    shape.first_face = fields.integer("first_face");
    shape.face_count = fields.integer("face_count");
    shape.material = fields.index("material", scene.materials.size(), NONE);
    shape.emitter = fields.index("emitter", emitter_count, NONE);
    shape.vertex_normals = fields.boolean("vertex_normals", false);
    shape.flip_normals = fields.boolean("flip_normals", false);
    shape.texture_coordinates = fields.boolean("texture_coordinates", false);
    fields.finish();
    if (shape.vertex_normals && !is_object(scene, shape) &&
        (scene.faces.empty() || scene.normals.empty()))
        refuse_value(name + " has vertex normals, but faces or normals are empty.");
    return shape;
}

Vec3f unit_vector(Fields &fields, const char *key) {
    const Vec3f v = fields.vector(key);
    if (std::abs(length(v) - 1) > 1e-3f)
        refuse_value(fields.path(key) + " must have unit length.");
    return normalize(v);
}

Emitter emitter_from(nb::handle dict, const std::string &name, size_t shape_count,
                     size_t texture_count) {
    Fields fields(dict, name);
    Emitter emitter;
    emitter.type =
        fields.choice<EmitterType>("type", {{"point", EmitterType::point},
                                            {"spot", EmitterType::spot},
                                            {"projector", EmitterType::projector},
                                            {"directional", EmitterType::directional},
                                            {"area", EmitterType::area},
                                            {"constant", EmitterType::constant},
                                            {"envmap", EmitterType::envmap}});
    const bool spot = emitter.type == EmitterType::spot;
    const bool directional = emitter.type == EmitterType::directional;
    const bool area = emitter.type == EmitterType::area;

    emitter.radiance = fields.vector("radiance");
    emitter.position = is_at_point(emitter.type) ? fields.vector("position")
                                                 : fields.vector("position", {});
    emitter.direction = spot || directional ? unit_vector(fields, "direction")
                                            : fields.vector("direction", {});
    emitter.cutoff_angle =
        spot ? fields.number("cutoff_angle") : fields.number("cutoff_angle", 0);
    emitter.beam_width =
        spot ? fields.number("beam_width") : fields.number("beam_width", 0);
    emitter.shape = fields.index("shape", shape_count, NONE);
    emitter.radiance_texture = fields.index("radiance_texture", texture_count, NONE);
    emitter.rectangle = fields.boolean("rectangle", false);
    const bool rectangle = area && emitter.rectangle;
    emitter.corner = rectangle ? fields.vector("corner") : fields.vector("corner", {});
    emitter.edge_u = rectangle ? fields.vector("edge_u") : fields.vector("edge_u", {});
    emitter.edge_v = rectangle ? fields.vector("edge_v") : fields.vector("edge_v", {});
    if (fields.has("axes"))
        emitter.axes = fields.vectors("axes");
    emitter.half_size = fields.vector2("half_size", {1, 1});
    emitter.mis_compensation = fields.boolean("mis_compensation", false);
    emitter.sampling_weight = fields.number("sampling_weight", 1);
    fields.finish();

    if (!(emitter.sampling_weight >= 0))
        refuse_value(fields.path("sampling_weight") + " must not be negative.");
    if (spot && !(emitter.beam_width <= emitter.cutoff_angle && emitter.beam_width >= 0))
        refuse_value(fields.path("beam_width") + " must be from 0 to the cut-off angle.");
    if (!(emitter.half_size.x > 0 && emitter.half_size.y > 0))
        refuse_value(fields.path("half_size") + " must be positive.");
    if (area && emitter.shape == NONE)
        refuse_value(fields.path("shape") + " must name the shape that glows.");
    const double volume =
        dot(Vec3d(emitter.axes[0]), cross(Vec3d(emitter.axes[1]), Vec3d(emitter.axes[2])));
    if (!(std::abs(volume) > 0))
        refuse_value(fields.path("axes") + " must be linearly independent.");
    return emitter;
}

EnvironmentPicture environment_from(const Array<float> &array) {
    constexpr uint64_t MAX_PIXELS = 1ull << 29; // numbers of their colours have 31 bits
    if (!array.is_valid())
        return {};
    if (array.ndim() != 3 || array.shape(0) < 3 || array.shape(1) < 2 ||
        array.shape(2) != 3)
        refuse_value("environment must have shape (H, W, 3), H at least 3 and W at least "
                     "2.");
    if (uint64_t(array.shape(0)) * (array.shape(1) + 2) > MAX_PIXELS)
        refuse_value("environment must have at most 2^29 pixels.");
    EnvironmentPicture picture{uint32_t(array.shape(1)),
                               uint32_t(array.shape(0)),
                               {array.data(), array.data() + array.size()}};
    for (const float value : picture.rgb)
        if (!std::isfinite(value))
            refuse_value("environment must be finite.");
    return picture;
}

SceneHandle make_scene(const TreeHandle &tree, const Array<uint32_t> &faces,
                       const Array<float> &normals, const nb::list &shapes,
                       const Array<float> &materials, const nb::list &emitters,
                       const nb::dict &camera, const nb::dict &film, bool hide_emitters,
                       const Array<float> &environment,
                       const std::optional<Array<float>> &uvs, const nb::list &textures,
                       const std::optional<Array<uint32_t>> &material_textures,
                       const nb::object &objects, const std::vector<bool> &material_passes,
                       const nb::list &speculars, const SpecularSides &sides) {
    SceneData scene;
    scene.tree = tree.tree;
    if (!objects.is_none()) {
        scene.objects = nb::cast<const ObjectsHandle &>(objects).objects;
        if (scene.objects->first_face != scene.tree->triangles.size())
            refuse_value("objects must begin at the face after the last of the tree.");
    }
    scene.faces = rows<std::array<uint32_t, 3>>(faces, "faces");
    scene.normals = rows<Vec3f>(normals, "normals");
    if (uvs)
        scene.uvs = rows<Vec2f>(*uvs, "uvs");
    scene.textures = textures_from(textures);
    scene.materials = materials_from(materials);
    add_textures(scene.materials, material_textures, scene.textures.size());
    if (!material_passes.empty() && material_passes.size() != scene.materials.size())
        refuse_value("material_passes must be empty or have as many entries as materials.");
    for (size_t i = 0; i < material_passes.size(); ++i)
        scene.materials[i].passes = material_passes[i];
    add_speculars(scene, speculars, sides);
    for (size_t i = 0; i < shapes.size(); ++i)
        scene.shapes.push_back(
            shape_from(shapes[i], numbered("shapes", i), scene, emitters.size()));
    double weights = 0;
    for (size_t i = 0; i < emitters.size(); ++i) {
        scene.emitters.push_back(emitter_from(emitters[i], numbered("emitters", i),
                                              shapes.size(), scene.textures.size()));
        weights += scene.emitters.back().sampling_weight;
    }
    if (!scene.emitters.empty() && !(weights > 0))
        refuse_value("emitters need a positive sum of their sampling weights.");
    scene.camera = camera_from(camera);
    scene.film = film_from(film);
    scene.hide_emitters = hide_emitters;
    scene.environment = environment_from(environment);
    check_environment(scene);
    check_shapes(scene);
    check_vertices(scene);
    check_textures(scene);
    return {std::make_shared<const PreparedScene>(std::move(scene))};
}

} // namespace

void bind_scene(nb::module_ &m) {
    nb::class_<SceneHandle>(
        m, "Scene",
        "A scene as the native renderer knows it: a tree and plain data, "
        "read once and never changed.")
        .def(
            nb::new_(&make_scene), nb::arg("tree"), nb::arg("faces"), nb::arg("normals"),
            nb::arg("shapes"), nb::arg("materials"), nb::arg("emitters"), nb::arg("camera"),
            nb::arg("film"), nb::arg("hide_emitters") = false,
            nb::arg("environment").none() = nb::none(), nb::arg("uvs") = nb::none(),
            nb::arg("textures") = nb::list(), nb::arg("material_textures") = nb::none(),
            nb::arg("objects") = nb::none(),
            nb::arg("material_passes") = std::vector<bool>(),
            nb::arg("speculars") = nb::list(),
            nb::arg("material_speculars") = SpecularSides(),
            "tree: KdTree over the faces. faces: uint32 (F, 3), or (0, 3) if no shape has "
            "vertex normals or textures. normals: float32 (V, 3) or (0, 3). shapes, "
            "emitters: lists of "
            "dicts, camera, film: dicts; keys are the fields of the structs in "
            "render/scene.h. materials: float32 (M, 2, 3), reflectance of front and back. "
            "environment: float32 (H, W, 3), the picture of the emitter that is an envmap. "
            "uvs: float32 (V, 2), texture coordinates of the vertices. textures: list of "
            "dicts, fields of the struct in render/texture.h, with the rows of to_uv as "
            "to_u and to_v, and squares as square_0 and square_1. material_textures: "
            "uint32 (M, 3), the texture of front, of back, and of the opacity; 2^32 - 1: "
            "none. objects: Objects beside the tree, or None; shapes cover their faces "
            "too. material_passes: which materials let all light straight through. "
            "speculars: dicts, fields of the struct; material_speculars: their numbers, of "
            "front and back, or 2^32 - 1, and whether neither side scatters. "
            "Raises ValueError or TypeError for what does not fit together.");
}

} // namespace mlrt
