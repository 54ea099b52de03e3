// Whether packets and beams find exact hits, as they do wherever the core is a part of the
// plugin. The benchmarks compile it a second time without, to tell what exactness costs:
// single precision then decides, and the parameters of split planes are not widened.
#pragma once

namespace mlrt {

#ifdef MLRT_INEXACT
inline constexpr bool EXACT = false;
#else
inline constexpr bool EXACT = true;
#endif

} // namespace mlrt
