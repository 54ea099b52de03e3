#include "render/textured_light.h"

#include <cmath>
#include <numbers>

namespace mlrt {

namespace {

// The point of an analytic shape with the given texture coordinates, and how much area a
// unit square of these takes there.
struct CoordinatePoint {
    AnalyticPoint on;
    float area;
};

CoordinatePoint point_at(const AnalyticShape &shape, Vec2f uv) {
    using std::numbers::pi;
    Vec3d p, along_u, along_v; // in the shape's own frame
    switch (shape.type) {
    case AnalyticType::sphere: {
        const double phi = 2 * pi * double(uv.x), theta = pi * double(uv.y);
        const Vec2<double> around{std::cos(phi), std::sin(phi)};
        p = {std::sin(theta) * around.x, std::sin(theta) * around.y, std::cos(theta)};
        along_u = Vec3d{-p.y, p.x, 0} * (2 * pi);
        along_v = Vec3d{p.z * around.x, p.z * around.y, -std::sin(theta)} * pi;
        break;
    }
    case AnalyticType::disk: {
        const double r = double(uv.x), phi = 2 * pi * double(uv.y);
        along_u = {std::cos(phi), std::sin(phi), 0};
        along_v = Vec3d{-along_u.y, along_u.x, 0} * (2 * pi * r);
        p = along_u * r;
        break;
    }
    case AnalyticType::cylinder: {
        const double phi = 2 * pi * double(uv.x);
        p = {std::cos(phi), std::sin(phi), double(uv.y)};
        along_u = Vec3d{-p.y, p.x, 0} * (2 * pi);
        along_v = {0, 0, 1};
        break;
    }
    }
    const Affine &frame = shape.frame;
    return {point_on(shape, frame.point(p)),
            float(length(cross(frame.vector(along_u), frame.vector(along_v))))};
}

// A density over texture coordinates as one over the area of the shape that glows.
float per_area(const PreparedScene &scene, uint32_t emitter, float density, Vec2f uv) {
    const Shape &shape = scene.data.shapes[scene.data.emitters[emitter].shape];
    const AnalyticShape *analytic = scene.analytic(shape);
    return analytic ? density / point_at(*analytic, uv).area
                    : density * scene.emitter_tables[emitter].inverse_area;
}

} // namespace

LightPoint<float> sample_textured_light(const PreparedScene &scene, uint32_t emitter,
                                        float x, float y) {
    const Emitter &light = scene.data.emitters[emitter];
    const EmitterTable &table = scene.emitter_tables[emitter];
    const TextureSampler::Sample sample = table.texture.sample(x, y);
    TexturePoint at;
    at.uv = sample.uv;
    LightPoint<float> point;
    point.radiance = evaluate(scene.data.textures, light.radiance_texture, at);
    point.density = per_area(scene, emitter, sample.density, at.uv);
    const Shape &shape = scene.data.shapes[light.shape];
    if (const AnalyticShape *analytic = scene.analytic(shape)) {
        const AnalyticPoint on = point_at(*analytic, at.uv).on;
        point.p = Vec3f(on.p);
        point.normal = Vec3f(shape.flip_normals ? -on.normal : on.normal);
    } else {
        point.p = light.corner + at.uv.x * light.edge_u + at.uv.y * light.edge_v;
        point.normal = table.normal;
    }
    return point;
}

LightPoint<FloatPacket> sample_textured_light(const PreparedScene &scene, uint32_t emitter,
                                              const FloatPacket &x, const FloatPacket &y) {
    const LaneArray<float> xs = to_lanes<float>(x), ys = to_lanes<float>(y);
    LaneArray<float> p[3], normal[3], radiance[3], density;
    for (uint32_t lane = 0; lane < PACKET_WIDTH; ++lane) {
        const LightPoint<float> one =
            sample_textured_light(scene, emitter, xs[lane], ys[lane]);
        for (int k = 0; k < 3; ++k) {
            p[k][lane] = one.p[k];
            normal[k][lane] = one.normal[k];
            radiance[k][lane] = one.radiance[k];
        }
        density[lane] = one.density;
    }
    LightPoint<FloatPacket> point;
    for (int k = 0; k < 3; ++k) {
        point.p[k] = load<FloatPacket>(p[k]);
        point.normal[k] = load<FloatPacket>(normal[k]);
        point.radiance[k] = load<FloatPacket>(radiance[k]);
    }
    point.density = load<FloatPacket>(density);
    return point;
}

Emission emission_of(const PreparedScene &scene, uint32_t emitter, const ShadedRays &rays,
                     LaneBits lanes) {
    const Emitter &light = scene.data.emitters[emitter];
    const EmitterTable &table = scene.emitter_tables[emitter];
    if (light.radiance_texture == NONE)
        return {in_all_lanes(light.radiance), FloatPacket(table.inverse_area)};
    LaneArray<float> radiance[3] = {}, density = {};
    for_each_texture_point(scene, rays, lanes, [&](uint32_t lane, const TexturePoint &at) {
        const Vec3f value = evaluate(scene.data.textures, light.radiance_texture, at);
        for (int k = 0; k < 3; ++k)
            radiance[k][lane] = value[k];
        density[lane] = per_area(scene, emitter, table.texture.density(at.uv), at.uv);
    });
    return {{load<FloatPacket>(radiance[0]), load<FloatPacket>(radiance[1]),
             load<FloatPacket>(radiance[2])},
            load<FloatPacket>(density)};
}

} // namespace mlrt
