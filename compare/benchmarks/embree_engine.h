// Embree's side of a benchmark: the library that Mitsuba uses.
#pragma once

#include "mesh.h"
#include "stopwatch.h"

#include <atomic>
#include <embree3/rtcore.h>
#include <immintrin.h>
#include <string>

namespace mlrt::bench {

RTC_NAMESPACE_USE

// Embree asks to be run with denormal numbers flushed to zero.
class FlushDenormals {
public:
    FlushDenormals() { _mm_setcsr(before_ | 0x8040); }
    ~FlushDenormals() { _mm_setcsr(before_); }
    FlushDenormals(const FlushDenormals &) = delete;
    FlushDenormals &operator=(const FlushDenormals &) = delete;

private:
    unsigned before_ = _mm_getcsr();
};

// All devices of a process share Embree's threads, as many as the one with the most asks
// for: there should be one at a time.
class EmbreeDevice {
public:
    // Raises std::runtime_error if Embree refuses.
    explicit EmbreeDevice(const std::string &configuration);
    ~EmbreeDevice();
    EmbreeDevice(const EmbreeDevice &) = delete;
    EmbreeDevice &operator=(const EmbreeDevice &) = delete;

    RTCDevice handle() const { return handle_; }
    bool has_native_packets() const; // of sixteen rays
    std::string version() const;

    // Bytes that Embree says it holds now, and the most since `forget_peak`.
    int64_t bytes() const { return bytes_; }
    int64_t peak_bytes() const { return peak_bytes_; }
    void forget_peak() { peak_bytes_ = bytes_.load(); }

private:
    static bool count_bytes(void *self, ssize_t bytes, bool post);

    RTCDevice handle_;
    std::atomic<int64_t> bytes_{0}, peak_bytes_{0};
};

// A committed scene over a mesh, which must outlive it.
class EmbreeScene {
public:
    EmbreeScene(EmbreeDevice &device, const Mesh &mesh, RTCBuildQuality quality,
                RTCSceneFlags flags = RTC_SCENE_FLAG_NONE);
    ~EmbreeScene();
    EmbreeScene(const EmbreeScene &) = delete;
    EmbreeScene &operator=(const EmbreeScene &) = delete;

    RTCScene handle() const { return handle_; }
    Seconds seconds() const { return seconds_; } // from vertices and faces to the hierarchy
    int64_t bytes() const { return bytes_; }
    int64_t peak_bytes() const { return peak_bytes_; } // while it was built

private:
    RTCScene handle_;
    Seconds seconds_;
    int64_t bytes_, peak_bytes_;
};

} // namespace mlrt::bench
