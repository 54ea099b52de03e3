// The classic test of a box against the planes of a frustum, as a control for the inverse
// test: a box is outside if it lies wholly behind one plane (Assarsson and Moeller 2000,
// p-vertex).
#pragma once

#include "base/simd.h"
#include "mlrta/beam.h"

namespace mlrt {

// Whether a box may meet the beam; always true for beams without planes. The box is given
// as for InverseFrustum: by what it looks like from the common origin.
bool may_enter_by_planes(const Beam &beam, const BoxPacket &inside);

} // namespace mlrt
