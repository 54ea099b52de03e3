// Parallel loops over the thread pool that Mitsuba uses too, so that the two never
// oversubscribe. The only place that knows nanothread.
#pragma once

#include <cstdint>
#include <functional>

namespace mlrt {

// Calls body(i) once for each i in [0, count), from any thread and in any order. Denormal
// numbers are kept in body, whatever mode the pool's threads are in.
//
// `cancelled`, if given, is asked now and then by the calling thread only; once it returns
// true the calls that have not begun are left out and the function returns false. Throws
// what a call threw, once all that have begun are done.
bool parallel_for(uint32_t count, const std::function<void(uint32_t)> &body,
                  const std::function<bool()> &cancelled = {});

} // namespace mlrt
