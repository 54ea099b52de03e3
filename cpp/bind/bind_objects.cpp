// The class Objects: analytic shapes and instances of groups, and rays against them.
#include "bind/arrays.h"
#include "bind/bind.h"
#include "bind/fields.h"
#include "bind/mesh_arrays.h"
#include "bind/objects_handle.h"
#include "bind/prepare_tree.h"
#include "bind/ray_arrays.h"
#include "bind/trace_options.h"
#include "bind/tree_handle.h"
#include "geometry/triangle_test.h"
#include "mlrta/trace_unordered.h"
#include "objects/trace_objects.h"
#include "traverse/single.h"

#include <cmath>
#include <memory>
#include <nanobind/ndarray.h>
#include <string>
#include <vector>

namespace nb = nanobind;

namespace mlrt {

namespace {

using Numbers = nb::ndarray<const uint32_t, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
using Maps = nb::ndarray<const double, nb::shape<-1, 3, 4>, nb::c_contig, nb::device::cpu>;
using NormalMaps =
    nb::ndarray<const double, nb::shape<-1, 3, 3>, nb::c_contig, nb::device::cpu>;

using Coordinates =
    nb::ndarray<const float, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;

std::string numbered(const char *list, size_t i) {
    return std::string(list) + "[" + std::to_string(i) + "]";
}

// Refuses a map that is not finite or cannot be inverted.
Affine affine_at(const Maps &maps, size_t i, const char *name) {
    Affine map;
    for (int row = 0; row < 3; ++row) {
        for (size_t column = 0; column < 3; ++column)
            map.axes[column][row] = maps(i, size_t(row), column);
        map.origin[row] = maps(i, size_t(row), 3);
    }
    const Affine inverse = map.inverse();
    const bool invertible = is_finite(map.origin) && is_finite(inverse.origin) &&
                            is_finite(inverse.axes[0]) && is_finite(inverse.axes[1]) &&
                            is_finite(inverse.axes[2]);
    if (!invertible)
        refuse_value(numbered(name, i) + " must be finite and not singular.");
    return map;
}

void add_analytic(ObjectSet &objects, const Numbers &types, const Maps &frames) {
    if (types.shape(0) != frames.shape(0))
        refuse_value("analytic_types and analytic_frames must have the same length.");
    objects.analytic.reserve(types.shape(0));
    for (size_t i = 0; i < types.shape(0); ++i) {
        if (types(i) > uint32_t(AnalyticType::cylinder))
            refuse_value(numbered("analytic_types", i) + " must be 0, 1 or 2.");
        objects.analytic.emplace_back(AnalyticType(types(i)),
                                      affine_at(frames, i, "analytic_frames"));
        const Box3f &box = objects.analytic.back().box;
        if (!is_finite(box.lo) || !is_finite(box.hi))
            refuse_value(numbered("analytic_frames", i) +
                         " must have an extent that is finite in single precision.");
    }
}

ObjectGroup group_from(nb::handle given, const std::string &name, ObjectSet &objects) {
    if (!nb::isinstance<nb::dict>(given))
        refuse_type(name + " must be a dict.");
    const nb::dict dict = nb::borrow<nb::dict>(given);
    ObjectGroup group;
    group.first_face = objects.first_analytic_face;
    if (!dict["tree"].is_none()) {
        group.tree = nb::cast<const TreeHandle &>(dict["tree"]).tree;
        const auto faces = nb::cast<Faces>(dict["faces"]);
        const auto normals = nb::cast<Points>(dict["normals"]);
        const size_t count = group.tree->triangles.size();
        if (faces.shape(0) != 0 && faces.shape(0) != count)
            refuse_value(name + " must have as many faces as its tree, or none.");
        for (size_t i = 0; i < normals.shape(0); ++i)
            group.normals.push_back({normals(i, 0), normals(i, 1), normals(i, 2)});
        if (dict.contains("uvs")) {
            const auto uvs = nb::cast<Coordinates>(dict["uvs"]);
            for (size_t i = 0; i < uvs.shape(0); ++i)
                group.uvs.push_back({uvs(i, 0), uvs(i, 1)});
        }
        for (size_t i = 0; i < faces.shape(0); ++i) {
            group.faces.push_back({faces(i, 0), faces(i, 1), faces(i, 2)});
            for (const uint32_t vertex : group.faces.back())
                for (const size_t vertices : {group.normals.size(), group.uvs.size()})
                    if (vertices > 0 && vertex >= vertices)
                        refuse_value(name + " has a face that refers to a vertex that does "
                                            "not exist.");
        }
        if (count > 0xfffffff0u - objects.first_analytic_face)
            refuse_value("the scene must have fewer than 2^32 faces.");
        objects.first_analytic_face += uint32_t(count);
    }
    return group;
}

ObjectsHandle make_objects(const Numbers &types, const Maps &frames,
                           uint32_t scene_analytic_count, const nb::list &groups,
                           const Numbers &instance_groups, const Maps &instance_maps,
                           const NormalMaps &instance_normals, uint32_t first_face) {
    auto objects = std::make_shared<ObjectSet>();
    objects->first_face = objects->first_analytic_face = first_face;
    objects->scene_analytic_count = scene_analytic_count;
    add_analytic(*objects, types, frames);
    size_t next = scene_analytic_count;
    for (size_t i = 0; i < groups.size(); ++i) {
        objects->groups.push_back(group_from(groups[i], numbered("groups", i), *objects));
        ObjectGroup &group = objects->groups.back();
        group.first_analytic = uint32_t(next);
        group.analytic_count = nb::cast<uint32_t>(nb::object(groups[i]["analytic_count"]));
        next += group.analytic_count;
    }
    if (next != objects->analytic.size())
        refuse_value("analytic shapes must belong to the scene or to a group.");
    if (objects->analytic.size() > 0xfffffff0u - objects->first_analytic_face)
        refuse_value("the scene must have fewer than 2^32 faces.");
    const size_t count = instance_groups.shape(0);
    if (instance_maps.shape(0) != count || instance_normals.shape(0) != count)
        refuse_value("instances must have a group, a map and a map of normals each.");
    objects->instances.resize(count);
    for (size_t i = 0; i < count; ++i) {
        Instance &instance = objects->instances[i];
        instance.group = instance_groups(i);
        if (instance.group >= objects->groups.size())
            refuse_value(numbered("instance_groups", i) + " must be a group.");
        instance.to_world = affine_at(instance_maps, i, "instance_maps");
        instance.to_group = instance.to_world.inverse();
        for (size_t column = 0; column < 3; ++column)
            for (int row = 0; row < 3; ++row)
                instance.normal_axes[column][row] =
                    float(instance_normals(i, size_t(row), column));
    }
    const nb::gil_scoped_release release;
    objects->finish();
    return {objects};
}

// Weights of the second and third vertex; the place in its frame for a disk; else zeros.
Vec2f surface_numbers(const KdTree &tree, const ObjectSet &objects, Vec3f origin,
                      Vec3f direction, float t, uint32_t face, uint32_t number) {
    if (face < objects.first_face)
        return barycentrics(origin, direction, tree.triangles[face]);
    if (number != NO_INSTANCE) {
        const Instance &instance = objects.instances[number];
        const GroupRay ray = to_group(instance, origin, direction);
        if (!objects.is_analytic(face)) {
            const ObjectGroup &group = objects.groups[instance.group];
            return barycentrics(ray.origin, ray.direction,
                                group.tree->triangles[face - group.first_face]);
        }
        origin = ray.origin;
        direction = ray.direction;
    }
    const AnalyticShape &shape = objects.analytic[face - objects.first_analytic_face];
    if (shape.type != AnalyticType::disk)
        return {};
    const Vec3d local =
        shape.inverse.point(analytic_point(shape, Vec3d(origin), Vec3d(direction), t).p);
    return {float(local.x), float(local.y)};
}

nb::tuple closest_hit(const ObjectsHandle &self, const TreeHandle &tree,
                      const Points &origins, const Points &directions, const Values &t_min,
                      const Values &t_max, const nb::dict &options) {
    const TraceOptions trace_options = trace_options_from(options);
    const ObjectSet &objects = *self.objects;
    const RayArrays rays(origins, directions, t_min, t_max);
    prepare_tree(*tree.tree, rays, trace_options);
    std::vector<float> t(rays.count()), u(rays.count()), v(rays.count());
    std::vector<uint32_t> face(rays.count()), instance(rays.count());
    rays.for_each_run(trace_options, [&](const RayRun &run, Counters &counters) {
        RayRun::Answers of_t(run, t.data()), of_u(run, u.data()), of_v(run, v.data());
        RayRun::Answers of_face(run, face.data()), of_instance(run, instance.data());
        trace_closest_unordered(*tree.tree, run.group, trace_options,
                                {of_t.data(), of_face.data()}, counters, run.is_square());
        trace_closest_objects(objects, run.group,
                              {of_t.data(), of_face.data(), of_instance.data()}, counters);
        for (uint32_t i = 0; i < run.group.count; ++i) {
            Vec2f uv;
            if (of_face.data()[i] != NO_PRIMITIVE) {
                const Ray ray = ray_of(run.group, i);
                uv = surface_numbers(*tree.tree, objects, ray.origin, ray.direction,
                                     of_t.data()[i], of_face.data()[i],
                                     of_instance.data()[i]);
            }
            of_u.data()[i] = uv.x;
            of_v.data()[i] = uv.y;
        }
        of_t.put_in_place();
        of_u.put_in_place();
        of_v.put_in_place();
        of_face.put_in_place();
        of_instance.put_in_place();
    });
    return nb::make_tuple(to_numpy<float>(std::move(t), {rays.count()}),
                          to_numpy<int32_t>(std::move(face), {rays.count()}),
                          to_numpy<int32_t>(std::move(instance), {rays.count()}),
                          to_numpy<float>(std::move(u), {rays.count()}),
                          to_numpy<float>(std::move(v), {rays.count()}));
}

nb::object any_hit(const ObjectsHandle &self, const TreeHandle &tree, const Points &origins,
                   const Points &directions, const Values &t_min, const Values &t_max,
                   const nb::dict &options) {
    const TraceOptions trace_options = trace_options_from(options);
    const RayArrays rays(origins, directions, t_min, t_max);
    prepare_tree(*tree.tree, rays, trace_options);
    std::vector<uint8_t> occluded(rays.count());
    rays.for_each_run(trace_options, [&](const RayRun &run, Counters &counters) {
        RayRun::Answers answers(run, occluded.data());
        trace_any_unordered(*tree.tree, run.group, trace_options, answers.data(), counters,
                            run.is_square());
        trace_any_objects(*self.objects, run.group, answers.data(), counters);
        answers.put_in_place();
    });
    return to_numpy<bool>(std::move(occluded), {rays.count()});
}

nb::tuple bounds_of(const ObjectsHandle &self) {
    const Box3f &box = self.objects->hierarchy.bounds();
    return nb::make_tuple(nb::make_tuple(box.lo.x, box.lo.y, box.lo.z),
                          nb::make_tuple(box.hi.x, box.hi.y, box.hi.z));
}

} // namespace

void bind_objects(nb::module_ &m) {
    nb::class_<ObjectsHandle>(
        m, "Objects",
        "Analytic shapes and instances of groups, which rays are traced against beside a "
        "tree; see objects/object_set.h for how faces are numbered and ties decided.")
        .def(
            nb::new_(&make_objects), nb::arg("analytic_types"), nb::arg("analytic_frames"),
            nb::arg("scene_analytic_count"), nb::arg("groups"), nb::arg("instance_groups"),
            nb::arg("instance_maps"), nb::arg("instance_normals"), nb::arg("first_face"),
            "analytic_types: uint32 (A,), 0 sphere, 1 disk, 2 cylinder; analytic_frames: "
            "float64 (A, 3, 4), from the shape's frame to the scene, or to its group: the "
            "first scene_analytic_count are of the scene, the others of the groups in "
            "turn. groups: dicts of tree (KdTree or None), faces (uint32 (F, 3), or no "
            "rows where no shape has either of the following), normals (float32 (V, 3) or "
            "(0, 3)), uvs (float32 (V, 2) or (0, 2); may be left out), and analytic_count. "
            "instance_groups: uint32 (I,); instance_maps: float64 (I, 3, 4), from the "
            "group to the world; instance_normals: float64 (I, 3, 3), the same for "
            "normals. first_face: how many faces the tree beside has. Raises "
            "ValueError or TypeError for what does not fit together.")
        .def("closest_hit", &closest_hit, nb::arg("tree"), nb::arg("origins"),
             nb::arg("directions"), nb::arg("t_min"), nb::arg("t_max"), nb::arg("options"),
             "The nearest hits of rays in the tree and among the objects: t, number of the "
             "face, of the instance (-1 for none), and u and v: weights of the second and "
             "third vertex of a triangle, the place in its own frame of a disk.")
        .def("any_hit", &any_hit, nb::arg("tree"), nb::arg("origins"),
             nb::arg("directions"), nb::arg("t_min"), nb::arg("t_max"), nb::arg("options"),
             "Whether anything lies on each ray.")
        .def_prop_ro("bounds", &bounds_of,
                     "Corners of a box around all objects; empty if the first exceeds the "
                     "second.");
}

} // namespace mlrt
