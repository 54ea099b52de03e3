// Which triangles have no area, decided exactly.
#pragma once

#include "geometry/triangle.h"

namespace mlrt {

// True if a coordinate is not finite or the three vertices lie on one line, without
// rounding: a sliver, however thin, is not degenerate.
bool is_degenerate(const Triangle &triangle);

} // namespace mlrt
