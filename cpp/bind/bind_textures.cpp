// Textures as lists of dicts.
#include "bind/fields.h"
#include "bind/scene_checks.h"
#include "bind/textures.h"

#include <algorithm>
#include <nanobind/ndarray.h>
#include <string>

namespace nb = nanobind;

namespace mlrt {

namespace {

constexpr uint32_t MAX_SIDE = 1u << 16; // of bitmaps

std::string numbered(const char *list, size_t i) {
    return std::string(list) + "[" + std::to_string(i) + "]";
}

template <typename T>
bool read_array(const nb::object &given, std::vector<T> &values) {
    nb::ndarray<const T, nb::c_contig, nb::device::cpu> array;
    if (!nb::try_cast(given, array, false))
        return false;
    values.assign(array.data(), array.data() + array.size());
    return true;
}

bool all_finite(const float *values, size_t count) {
    return std::all_of(values, values + count, [](float v) { return std::isfinite(v); });
}

Texels texels_from(Fields &fields) {
    Texels texels;
    const nb::object given = fields.object("texels"), table = fields.object("decoded");
    if (read_array(given, texels.values)) {
        if (!all_finite(texels.values.data(), texels.values.size()))
            refuse_value(fields.path("texels") + " must be finite.");
        return texels;
    }
    if (!read_array(given, texels.bytes))
        refuse_type(fields.path("texels") + " must be an array of float32 or uint8.");
    std::vector<float> decoded;
    if (!read_array(table, decoded) || decoded.size() != texels.decoded.size() ||
        !all_finite(decoded.data(), decoded.size()))
        refuse_value(fields.path("decoded") +
                     " must be 256 finite numbers in an array of float32.");
    std::copy(decoded.begin(), decoded.end(), texels.decoded.begin());
    return texels;
}

Texture texture_from(nb::handle dict, const std::string &name, uint32_t number) {
    Fields fields(dict, name);
    Texture texture;
    texture.type = fields.choice<TextureType>(
        "type", {{"constant", TextureType::constant},
                 {"checkerboard", TextureType::checkerboard},
                 {"bitmap", TextureType::bitmap},
                 {"vertex_attribute", TextureType::vertex_attribute},
                 {"face_attribute", TextureType::face_attribute}});
    const bool bitmap = texture.type == TextureType::bitmap;
    const bool attribute = texture.type == TextureType::vertex_attribute ||
                           texture.type == TextureType::face_attribute;
    if (texture.type == TextureType::constant)
        texture.colour = fields.vector("colour");
    if (bitmap || texture.type == TextureType::checkerboard)
        texture.to_uv = {fields.vector("to_u", {1, 0, 0}),
                         fields.vector("to_v", {0, 1, 0})};
    if (texture.type == TextureType::checkerboard)
        for (int k = 0; k < 2; ++k)
            texture.squares[k] =
                fields.index(k == 0 ? "square_0" : "square_1", number, NONE);
    if (texture.type == TextureType::checkerboard &&
        (texture.squares[0] == NONE || texture.squares[1] == NONE))
        refuse_value(name + " must name two textures before it.");
    if (bitmap) {
        texture.width = fields.integer("width", MAX_SIDE);
        texture.height = fields.integer("height", MAX_SIDE);
        texture.nearest = fields.boolean("nearest", false);
        texture.wrap = fields.choice<WrapMode>("wrap", {{"repeat", WrapMode::repeat},
                                                        {"mirror", WrapMode::mirror},
                                                        {"clamp", WrapMode::clamp}});
    }
    if (attribute)
        texture.first = fields.integer("first");
    if (bitmap || attribute) {
        texture.channels = fields.integer("channels", 3);
        if (texture.channels != 1 && texture.channels != 3)
            refuse_value(fields.path("channels") + " must be 1 or 3.");
        texture.texels = texels_from(fields);
    }
    fields.finish();
    if (bitmap && (texture.width == 0 || texture.height == 0 ||
                   texture.texels.size() !=
                       size_t(texture.width) * texture.height * texture.channels))
        refuse_value(fields.path("texels") + " must have height x width x channels "
                                             "entries, and at least one.");
    return texture;
}

// Whether an attribute has a value for each face of a shape, or for each vertex of these.
bool has_attribute(const SceneData &scene, const Shape &shape, const Texture &texture) {
    const size_t count = texture.texels.size() / texture.channels;
    const auto has = [&](uint32_t number) {
        return number >= texture.first && number - texture.first < count;
    };
    for (uint32_t i = shape.first_face; i < shape.first_face + shape.face_count; ++i) {
        if (texture.type == TextureType::face_attribute && !has(i))
            return false;
        if (texture.type == TextureType::vertex_attribute &&
            !std::all_of(scene.faces[i].begin(), scene.faces[i].end(), has))
            return false;
    }
    return true;
}

void check_texture(const SceneData &scene, const Shape &shape, const std::string &name,
                   uint32_t number) {
    if (number == NONE)
        return;
    const Texture &texture = scene.textures[number];
    if (texture.type == TextureType::checkerboard)
        for (const uint32_t square : texture.squares)
            check_texture(scene, shape, name, square);
    else if (!has_attribute(scene, shape, texture))
        refuse_value(name + " has faces or vertices that " + numbered("textures", number) +
                     " has no values for.");
}

// Whether a texture, or one of its squares, has values of a mesh.
bool is_attribute(const SceneData &scene, uint32_t number) {
    const Texture &texture = scene.textures[number];
    if (texture.type == TextureType::checkerboard)
        return is_attribute(scene, texture.squares[0]) ||
               is_attribute(scene, texture.squares[1]);
    return texture.type == TextureType::vertex_attribute ||
           texture.type == TextureType::face_attribute;
}

// All that a material may show, NONE among them.
std::vector<uint32_t> textures_of(const SceneData &scene, const Material &material) {
    std::vector<uint32_t> textures{material.front_texture, material.back_texture,
                                   material.opacity};
    for (const uint32_t side : {material.front_specular, material.back_specular})
        if (side != NONE) {
            textures.push_back(scene.speculars[side].reflectance_texture);
            textures.push_back(scene.speculars[side].transmittance_texture);
        }
    return textures;
}

} // namespace

std::vector<Texture> textures_from(const nb::list &dicts) {
    std::vector<Texture> textures;
    for (size_t i = 0; i < dicts.size(); ++i)
        textures.push_back(texture_from(dicts[i], numbered("textures", i), uint32_t(i)));
    return textures;
}

void check_textures(const SceneData &scene) {
    for (size_t i = 0; i < scene.uvs.size(); ++i)
        if (!std::isfinite(scene.uvs[i].x) || !std::isfinite(scene.uvs[i].y))
            refuse_value(numbered("uvs", i) + " must be finite.");
    for (size_t i = 0; i < scene.emitters.size(); ++i) {
        const Emitter &emitter = scene.emitters[i];
        if (emitter.type == EmitterType::projector && emitter.radiance_texture != NONE &&
            is_attribute(scene, emitter.radiance_texture))
            refuse_value(numbered("emitters", i) + " shows an attribute of no mesh.");
    }
    for (size_t i = 0; i < scene.shapes.size(); ++i) {
        const Shape &shape = scene.shapes[i];
        const std::string name = numbered("shapes", i);
        const Material material =
            shape.material == NONE ? Material{} : scene.materials[shape.material];
        const uint32_t light =
            shape.emitter == NONE ? NONE : scene.emitters[shape.emitter].radiance_texture;
        if (is_object(scene, shape)) {
            std::vector<uint32_t> shown = textures_of(scene, material);
            shown.push_back(light);
            for (const uint32_t texture : shown)
                if (texture != NONE && is_attribute(scene, texture))
                    refuse_value(name + " shows an attribute, but its faces are not in the "
                                        "tree.");
            continue;
        }
        const std::vector<uint32_t> shown = textures_of(scene, material);
        const bool textured =
            shape.texture_coordinates || light != NONE ||
            std::any_of(shown.begin(), shown.end(), [](uint32_t t) { return t != NONE; });
        if (light != NONE && !scene.emitters[shape.emitter].rectangle)
            refuse_value(name + " glows in a texture, and is neither a rectangle nor an "
                                "analytic shape.");
        if (light != NONE && is_attribute(scene, light))
            refuse_value(name + " glows in an attribute of its mesh.");
        if (textured && scene.faces.empty())
            refuse_value(name + " has textures, but faces are empty.");
        for (uint32_t k = 0; k < shape.face_count && shape.texture_coordinates; ++k)
            for (const uint32_t vertex : scene.faces[shape.first_face + k])
                if (vertex >= scene.uvs.size())
                    refuse_value(name + " refers to the texture coordinates of vertex " +
                                 std::to_string(vertex) + ", but there are " +
                                 std::to_string(scene.uvs.size()) + ".");
        for (const uint32_t texture : shown)
            check_texture(scene, shape, name, texture);
    }
}

} // namespace mlrt
