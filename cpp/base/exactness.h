// How exact hits of packets and beams are: wholly, wherever the core is a part of the
// plugin. The benchmarks compile it two times more with less, to tell what exactness costs.
#pragma once

namespace mlrt {

// Whether it is decided exactly which triangles a ray hits, and parameters of split planes
// are widened, so that no ray passes between neighbours. Else single precision decides.
#ifdef MLRT_INEXACT
inline constexpr bool EXACT = false;
#else
inline constexpr bool EXACT = true;
#endif

// Whether distances are rounded correctly, and compared so. Else single precision computes
// and compares them, and what it decides exactly is only whether a triangle is hit.
#ifdef MLRT_WATERTIGHT
inline constexpr bool EXACT_DISTANCES = false;
#else
inline constexpr bool EXACT_DISTANCES = EXACT;
#endif

} // namespace mlrt
