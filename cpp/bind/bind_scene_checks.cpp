// Whether the parts of a scene fit together.
#include "bind/fields.h"
#include "bind/scene_checks.h"

#include <cstdint>
#include <string>

namespace mlrt {

namespace {

std::string numbered(const char *list, size_t i) {
    return std::string(list) + "[" + std::to_string(i) + "]";
}

// An analytic shape, or some faces of one group.
void check_object(const SceneData &scene, const Shape &shape, const std::string &name) {
    const ObjectSet &objects = *scene.objects;
    if (objects.is_analytic(shape.first_face)) {
        if (shape.face_count != 1 || shape.vertex_normals || shape.texture_coordinates)
            refuse_value(name + " is analytic and must have one face, without normals and "
                                "texture coordinates.");
        if (shape.emitter != NONE &&
            shape.first_face - objects.first_analytic_face >= objects.scene_analytic_count)
            refuse_value(name + " glows, but belongs to a group.");
        return;
    }
    if (shape.emitter != NONE)
        refuse_value(name + " glows, but belongs to a group.");
    for (const ObjectGroup &group : objects.groups)
        if (group.tree && shape.first_face >= group.first_face &&
            shape.first_face - group.first_face < group.tree->triangles.size()) {
            if (shape.face_count >
                group.tree->triangles.size() - (shape.first_face - group.first_face))
                refuse_value(name + " must not have faces of several groups.");
            if (shape.vertex_normals && (group.faces.empty() || group.normals.empty()))
                refuse_value(name + " has vertex normals, but its group has none.");
            if (shape.texture_coordinates && (group.faces.empty() || group.uvs.empty()))
                refuse_value(name + " has texture coordinates, but its group has none.");
        }
}

} // namespace

bool is_object(const SceneData &scene, const Shape &shape) {
    return scene.objects && shape.first_face >= scene.objects->first_face;
}

void check_environment(const SceneData &scene) {
    size_t environments = 0, pictures = 0;
    for (const Emitter &emitter : scene.emitters) {
        environments += is_environment(emitter.type);
        pictures += emitter.type == EmitterType::envmap;
    }
    if (environments > 1)
        refuse_value("emitters must have at most one of the types constant and envmap.");
    if ((pictures > 0) != (scene.environment.width > 0))
        refuse_value("environment must be given if and only if an emitter is an envmap.");
}

void check_shapes(const SceneData &scene) {
    const uint64_t face_count =
        scene.objects ? scene.objects->face_end() : scene.tree->triangles.size();
    uint64_t next_face = 0;
    for (size_t i = 0; i < scene.shapes.size(); ++i) {
        const Shape &shape = scene.shapes[i];
        const std::string name = numbered("shapes", i);
        if (shape.first_face != next_face)
            refuse_value(name + " must begin at face " + std::to_string(next_face) +
                         ", where the one before it ends.");
        next_face += shape.face_count;
        if (is_object(scene, shape))
            check_object(scene, shape, name);
        else if (scene.objects && next_face > scene.objects->first_face)
            refuse_value(name + " must not have faces of the tree and of objects.");
        if (next_face > face_count)
            break;
        if (shape.emitter != NONE &&
            (scene.emitters[shape.emitter].type != EmitterType::area ||
             scene.emitters[shape.emitter].shape != i))
            refuse_value(name +
                         " glows, but its emitter is not an area light of this shape.");
    }
    if (next_face != face_count)
        refuse_value("shapes cover " + std::to_string(next_face) +
                     " faces, but the tree and the objects have " +
                     std::to_string(face_count) + ".");
    for (size_t i = 0; i < scene.emitters.size(); ++i) {
        const Emitter &emitter = scene.emitters[i];
        if (emitter.type != EmitterType::area)
            continue;
        if (scene.shapes[emitter.shape].emitter != i)
            refuse_value(numbered("emitters", i) + " is not the emitter of its shape.");
        if (scene.shapes[emitter.shape].face_count == 0)
            refuse_value(numbered("emitters", i) + " glows on a shape without faces.");
    }
}

void check_vertices(const SceneData &scene) {
    if (!scene.faces.empty() && scene.faces.size() != scene.tree->triangles.size())
        refuse_value("faces has " + std::to_string(scene.faces.size()) +
                     " rows, but the tree has " +
                     std::to_string(scene.tree->triangles.size()) + " triangles.");
    for (const Shape &shape : scene.shapes) {
        if (!shape.vertex_normals || is_object(scene, shape))
            continue;
        for (uint32_t i = shape.first_face; i < shape.first_face + shape.face_count; ++i)
            for (const uint32_t vertex : scene.faces[i])
                if (vertex >= scene.normals.size())
                    refuse_value(numbered("faces", i) + " refers to normal " +
                                 std::to_string(vertex) + ", but there are " +
                                 std::to_string(scene.normals.size()) + ".");
    }
    for (size_t i = 0; i < scene.normals.size(); ++i)
        if (!is_finite(scene.normals[i]))
            refuse_value(numbered("normals", i) + " must be finite.");
}

} // namespace mlrt
