// What rays can hit beside the triangles of the scene's tree: analytic shapes, and
// instances of groups, which are held once however often they are seen.
//
// Faces are numbered throughout a scene: first the triangles of the scene's tree, then
// those of the groups, one group after the other, then the analytic shapes, which count as
// one face each: those of the scene first, then those of the groups.
//
// A ray goes into an instance by the inverse of its map, which takes the direction as it is
// and does not make its length one: distances are then the same inside and outside. The
// inverse is computed in double precision and the ray rounded to single precision once, in
// the frame of the group. What is exact about hits on triangles, no gaps between them and
// the distance rounded once, holds for that ray. It differs from the ray of the world by
// the rounding of its origin and direction.
//
// Of hits at the same distance, that on the scene's tree counts, then that on the object
// that comes first, analytic shapes before instances; in a group triangles come before
// analytic shapes.
#pragma once

#include "geometry/analytic_shape.h"
#include "kdtree/tree.h"
#include "objects/box_hierarchy.h"

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace mlrt {

// Marks hits outside of instances.
inline constexpr uint32_t NO_INSTANCE = 0xffffffffu;

struct ObjectGroup {
    std::shared_ptr<const KdTree> tree;         // of its triangles, maybe none
    std::vector<std::array<uint32_t, 3>> faces; // numbers of vertices; empty if not needed
    std::vector<Vec3f> normals;                 // of the vertices, unit; empty likewise
    std::vector<Vec2f> uvs;                     // texture coordinates of them; likewise
    uint32_t first_face = 0;                    // number of its first triangle
    uint32_t first_analytic = 0, analytic_count = 0;

    BoxHierarchy hierarchy; // over its analytic shapes, numbered from 0
    Box3f bounds;           // of all it holds
};

struct Instance {
    uint32_t group = 0;
    Affine to_world, to_group;
    std::array<Vec3f, 3> normal_axes; // columns of the map of normals to the world
};

struct ObjectSet {
    std::vector<AnalyticShape> analytic; // those of the scene, then those of the groups
    uint32_t scene_analytic_count = 0;
    std::vector<ObjectGroup> groups;
    std::vector<Instance> instances;
    uint32_t first_face = 0;          // faces of the scene's tree, which come before
    uint32_t first_analytic_face = 0; // number of the first analytic shape as a face
    // Over the scene's analytic shapes, then the instances.
    BoxHierarchy hierarchy;

    uint32_t face_end() const { return first_analytic_face + uint32_t(analytic.size()); }
    bool is_analytic(uint32_t face) const { return face >= first_analytic_face; }

    // Builds what follows from the rest: the hierarchies and bounds.
    void finish();
};

} // namespace mlrt
