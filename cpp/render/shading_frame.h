// Frames of surfaces that directions are chosen in, for sixteen hits side by side.
#pragma once

#include "base/simd.h"
#include "render/hit_packet.h"
#include "render/prepared_scene.h"
#include "render/surface.h"

namespace mlrt {

// Orthonormal; n is the shading normal.
struct ShadingFrame {
    Vec3<FloatPacket> s, t, n;

    Vec3<FloatPacket> to_world(const Vec3<FloatPacket> &v) const;
};

// As Mitsuba has it (3.9's interaction.h, initialize_sh_frame): s lies in the plane of n
// and of the way that the first texture coordinate grows. A turn around n would change no
// mean, but the noise.
ShadingFrame shading_frame(const PreparedScene &scene, const HitPacket &hit,
                           const SurfacePoint<FloatPacket> &point);

} // namespace mlrt
