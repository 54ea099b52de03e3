// Where rays met surfaces, and how the surfaces lie there: for one ray, or for sixteen side
// by side with the same operations and hence the same bits.
#pragma once

#include "base/simd.h"
#include "geometry/packet_barycentrics.h"
#include "render/prepared_scene.h"

#include <cstdint>
#include <type_traits>

namespace mlrt {

class FaceCache;

// The faces of a packet.
using FaceNumbers = LaneArray<uint32_t>;

template <typename Real>
using FacesOf = std::conditional_t<std::is_same_v<Real, float>, uint32_t, FaceNumbers>;

// Lanes that are not given take the face of one that is; there must be one.
FaceNumbers faces_in(const UIntPacket &faces, LaneBits lanes);

template <typename Real>
struct SurfacePoint {
    Vec3<Real> p;
    Vec3<Real> face_normal;    // unit; by the order of the vertices, not turned to the ray
    Vec3<Real> shading_normal; // unit
};

// The surface that a ray is known to hit. Faces are those of the scene's tree here and
// below; see object_surface.h for others.
SurfacePoint<float> hit_surface(const PreparedScene &scene, Vec3f origin, Vec3f direction,
                                uint32_t face);

// The same for the given lanes of sixteen rays, which start at `origin`, or, without, at
// that of the cache; the other lanes get any values.
SurfacePoint<FloatPacket> hit_surfaces(FaceCache &cache, const Vec3<FloatPacket> *origin,
                                       const Vec3<FloatPacket> &direction,
                                       const UIntPacket &faces, LaneBits lanes);

// A triangle that a ray is known to hit. `normals` are those of its vertices; without, the
// face normal serves.
SurfacePoint<float> triangle_surface(Vec3f origin, Vec3f direction,
                                     const Corners<float> &corners,
                                     const Corners<float> *normals);

Corners<float> corners_of(const PreparedScene &scene, uint32_t face);
Corners<FloatPacket> corners_of(const PreparedScene &scene, const FaceNumbers &faces);

// The normals of the vertices, of faces whose shape has them; else zeros.
Corners<float> normals_of(const PreparedScene &scene, uint32_t face);
Corners<FloatPacket> normals_of(const PreparedScene &scene, const FaceNumbers &faces);

} // namespace mlrt
