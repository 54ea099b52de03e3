// Where rays met surfaces, and how the surfaces lie there: for one ray, or for sixteen side
// by side with the same operations and hence the same bits.
#pragma once

#include "base/simd.h"
#include "geometry/packet_barycentrics.h"
#include "render/prepared_scene.h"

#include <cstdint>
#include <type_traits>

namespace mlrt {

// The faces of a packet; lanes that hit nothing hold any face.
using FaceNumbers = LaneArray<uint32_t>;

template <typename Real>
using FacesOf = std::conditional_t<std::is_same_v<Real, float>, uint32_t, FaceNumbers>;

template <typename Real>
struct SurfacePoint {
    Vec3<Real> p;
    Vec3<Real> face_normal;    // unit; by the order of the vertices, not turned to the ray
    Vec3<Real> shading_normal; // unit
};

// The surface that a ray is known to hit.
template <typename Real>
SurfacePoint<Real> hit_surface(const PreparedScene &scene, const Vec3<Real> &origin,
                               const Vec3<Real> &direction, const FacesOf<Real> &faces);

Corners<float> corners_of(const PreparedScene &scene, uint32_t face);
Corners<FloatPacket> corners_of(const PreparedScene &scene, const FaceNumbers &faces);

// The normals of the vertices, of faces whose shape has them; else zeros.
Corners<float> normals_of(const PreparedScene &scene, uint32_t face);
Corners<FloatPacket> normals_of(const PreparedScene &scene, const FaceNumbers &faces);

} // namespace mlrt
