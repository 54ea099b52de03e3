#include "embree_engine.h"

#include <immintrin.h>
#include <stdexcept>

namespace mlrt::bench {

namespace {

// Side of the squares of pixels that threads take; chosen, as MLRT's usual tile.
constexpr uint32_t TILE_SIDE = 128;

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

void check(RTCDevice device, const char *what) {
    const RTCError error = rtcGetDeviceError(device);
    if (error != RTC_ERROR_NONE)
        throw std::runtime_error(std::string("Embree failed to ") + what + " (error " +
                                 std::to_string(int(error)) + ")");
}

LaneArray<int> valid_lanes(LaneBits lanes) {
    LaneArray<int> valid;
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane)
        valid[lane] = (lanes >> lane & 1) ? -1 : 0;
    return valid;
}

void fill(RTCRay16 &rays, Vec3f origin, const Vec3<FloatPacket> &direction, float t_min,
          float t_max) {
    store(rays.org_x, FloatPacket(origin.x));
    store(rays.org_y, FloatPacket(origin.y));
    store(rays.org_z, FloatPacket(origin.z));
    store(rays.dir_x, direction.x);
    store(rays.dir_y, direction.y);
    store(rays.dir_z, direction.z);
    store(rays.tnear, FloatPacket(t_min));
    store(rays.tfar, FloatPacket(t_max));
    store(rays.time, FloatPacket(0.0f));
    store(rays.mask, UIntPacket(0xffffffffu));
    store(rays.flags, UIntPacket(0u));
}

void render_block(const EmbreeScene &scene, const View &view, const Block &block,
                  RTCIntersectContext &context, const FrameOutput &output) {
    RTCRayHit16 primary;
    const Vec3<FloatPacket> direction = primary_directions(view, block);
    fill(primary.ray, view.camera.origin, direction, view.near_clip, view.far_clip);
    store(primary.hit.geomID, UIntPacket(RTC_INVALID_GEOMETRY_ID));
    store(primary.hit.primID, UIntPacket(NO_PRIMITIVE));
    rtcIntersect16(valid_lanes(block.on_film).data(), scene.handle(), &context, &primary);

    const LaneBits hit =
        to_bits(load<UIntPacket>(primary.hit.geomID) != RTC_INVALID_GEOMETRY_ID) &
        block.on_film;
    const auto hit_mask = from_bits<FloatPacket>(hit);
    FloatPacket image = 0.0f;
    if (hit != 0) {
        const Vec3<FloatPacket> normal{load<FloatPacket>(primary.hit.Ng_x),
                                       load<FloatPacket>(primary.hit.Ng_y),
                                       load<FloatPacket>(primary.hit.Ng_z)};
        const FloatPacket t =
            select(hit_mask, load<FloatPacket>(primary.ray.tfar), FloatPacket(0.0f));
        const Shading shading = shade(view, direction, t, normal);
        RTCRay16 shadow;
        fill(shadow, view.light, shading.from_light, SHADOW_EPSILON, 1 - SHADOW_EPSILON);
        rtcOccluded16(valid_lanes(hit).data(), scene.handle(), &context, &shadow);
        // Embree marks an occluded ray by an end at minus infinity.
        const auto visible = hit_mask & (load<FloatPacket>(shadow.tfar) >= 0.0f);
        image = select(MaskOf<FloatPacket>(visible), shading.cosine, FloatPacket(0.0f));
    }
    write_block(view, block, image, output.image);
    if (output.primitive)
        write_block(view, block, load<UIntPacket>(primary.hit.primID), output.primitive);
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

EmbreeScene::EmbreeScene(EmbreeDevice &device, const Mesh &mesh, RTCBuildQuality quality) {
    const int64_t before = device.bytes();
    device.forget_peak();
    const FlushDenormals flush;
    const Stopwatch watch;
    handle_ = rtcNewScene(device.handle());
    rtcSetSceneBuildQuality(handle_, quality);
    rtcSetSceneFlags(handle_, RTC_SCENE_FLAG_NONE);
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

Seconds render_frame(const EmbreeScene &scene, const View &view,
                     const FrameOutput &output) {
    const Stopwatch watch;
    for_each_tile(view, TILE_SIDE, [&](const PixelTile &tile) {
        const FlushDenormals flush;
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
        for (uint32_t i = 0; i < tile.block_count(); ++i) {
            const Block block = block_of(tile, i, view);
            if (block.on_film != 0)
                render_block(scene, view, block, context, output);
        }
    });
    return watch.elapsed();
}

} // namespace mlrt::bench
