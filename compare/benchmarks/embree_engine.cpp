#include "embree_engine.h"

#include <stdexcept>

namespace mlrt::bench {

namespace {

void check(RTCDevice device, const char *what) {
    const RTCError error = rtcGetDeviceError(device);
    if (error != RTC_ERROR_NONE)
        throw std::runtime_error(std::string("Embree failed to ") + what + " (error " +
                                 std::to_string(int(error)) + ")");
}

} // namespace

EmbreeDevice::EmbreeDevice(const std::string &configuration)
    : handle_(rtcNewDevice(configuration.c_str())) {
    if (!handle_)
        throw std::runtime_error("Embree cannot be started with '" + configuration + "'");
    rtcSetDeviceMemoryMonitorFunction(handle_, count_bytes, this);
}

EmbreeDevice::~EmbreeDevice() {
    rtcReleaseDevice(handle_);
}

bool EmbreeDevice::has_native_packets() const {
    return rtcGetDeviceProperty(handle_, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
}

std::string EmbreeDevice::version() const {
    const auto part = [&](RTCDeviceProperty property) {
        return std::to_string(rtcGetDeviceProperty(handle_, property));
    };
    return part(RTC_DEVICE_PROPERTY_VERSION_MAJOR) + "." +
           part(RTC_DEVICE_PROPERTY_VERSION_MINOR) + "." +
           part(RTC_DEVICE_PROPERTY_VERSION_PATCH);
}

bool EmbreeDevice::count_bytes(void *self, ssize_t bytes, bool) {
    EmbreeDevice &device = *static_cast<EmbreeDevice *>(self);
    const int64_t now = device.bytes_ += bytes;
    int64_t peak = device.peak_bytes_;
    while (now > peak && !device.peak_bytes_.compare_exchange_weak(peak, now)) {
    }
    return true;
}

EmbreeScene::EmbreeScene(EmbreeDevice &device, const Mesh &mesh, RTCBuildQuality quality,
                         RTCSceneFlags flags) {
    const int64_t before = device.bytes();
    device.forget_peak();
    const FlushDenormals flush;
    const Stopwatch watch;
    handle_ = rtcNewScene(device.handle());
    rtcSetSceneBuildQuality(handle_, quality);
    rtcSetSceneFlags(handle_, flags);
    const RTCGeometry geometry =
        rtcNewGeometry(device.handle(), RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               mesh.vertices.data(), 0, sizeof(Vec3f), mesh.vertex_count());
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               mesh.faces.data(), 0, sizeof(mesh.faces[0]),
                               mesh.faces.size());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(handle_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(handle_);
    seconds_ = watch.elapsed();
    bytes_ = device.bytes() - before;
    peak_bytes_ = device.peak_bytes() - before;
    try {
        check(device.handle(), "build the scene");
    } catch (...) {
        rtcReleaseScene(handle_);
        throw;
    }
}

EmbreeScene::~EmbreeScene() {
    rtcReleaseScene(handle_);
}

} // namespace mlrt::bench
