#include "render/hit_packet.h"

#include "render/object_surface.h"

namespace mlrt {

SurfacePoint<FloatPacket> surface_of(const PreparedScene &scene, FaceCache &cache,
                                     const HitPacket &hit, bool common_origin) {
    const LaneBits on_objects = lanes_on_objects(scene, hit.faces, hit.lanes);
    const LaneBits on_meshes = hit.lanes & ~on_objects;
    const Vec3<FloatPacket> *origin = common_origin ? nullptr : &hit.origin;
    if (on_objects == 0)
        return hit_surfaces(cache, origin, hit.direction, hit.faces, on_meshes);
    SurfacePoint<FloatPacket> point{in_all_lanes({}), in_all_lanes({}), in_all_lanes({})};
    if (on_meshes != 0)
        point = hit_surfaces(cache, origin, hit.direction, hit.faces, on_meshes);
    place_object_surfaces(scene,
                          {hit.origin, hit.direction, hit.t, hit.faces, hit.instances},
                          on_objects, point);
    return point;
}

SurfacePlane<DoublePacket> plane_of(const PreparedScene &scene, const HitPacket &hit) {
    const LaneBits on_objects = lanes_on_objects(scene, hit.faces, hit.lanes);
    const LaneBits on_meshes = hit.lanes & ~on_objects;
    SurfacePlane<DoublePacket> plane{};
    if (on_meshes != 0) {
        const FaceNumbers faces = faces_in(hit.faces, on_meshes);
        plane = hit_plane<FloatPacket>(scene, {hit.origin, hit.direction, faces});
    }
    if (on_objects != 0)
        place_object_planes(scene,
                            {hit.origin, hit.direction, hit.t, hit.faces, hit.instances},
                            on_objects, plane);
    return plane;
}

} // namespace mlrt
