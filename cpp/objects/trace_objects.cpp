#include "objects/trace_objects.h"

#include "mlrta/ray_cost.h"
#include "traverse/single.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mlrt {

namespace {

constexpr float INFINITE = std::numeric_limits<float>::infinity();

struct ObjectHit {
    float t = INFINITE;
    uint32_t face = NO_PRIMITIVE;
    uint32_t instance = NO_INSTANCE;

    bool found() const { return face != NO_PRIMITIVE; }
};

// Traces one ray at a time. Any-hit queries stop at the first hit that is found.
class ObjectTracer {
public:
    ObjectTracer(const ObjectSet &objects, Query query, Counters &counters)
        : objects_(objects), query_(query), counters_(counters) {}

    // The hit with t_min < t <= t_max that counts.
    ObjectHit trace(const Ray &ray) {
        ObjectHit best;
        best.t = ray.t_max;
        uint32_t best_object = 0xffffffffu;
        const auto visit = [&](uint32_t object, float t_max) {
            Ray shorter = ray;
            shorter.t_max = t_max;
            const ObjectHit hit =
                object < objects_.scene_analytic_count
                    ? trace_analytic(object, shorter)
                    : trace_instance(object - objects_.scene_analytic_count, shorter);
            if (hit.found() &&
                (hit.t < best.t || (hit.t == best.t && object < best_object))) {
                best = hit;
                best_object = object;
                if (query_ == Query::any)
                    return -1.0f;
            }
            return best.t;
        };
        counters_.traversal_steps += objects_.hierarchy.walk(
            BoxRay(Vec3d(ray.origin), Vec3d(ray.direction), ray.t_min), ray.t_max, visit);
        return best;
    }

private:
    ObjectHit trace_analytic(uint32_t number, const Ray &ray) {
        ++counters_.triangle_tests;
        const float t = nearest_crossing(objects_.analytic[number], Vec3d(ray.origin),
                                         Vec3d(ray.direction), ray.t_min, ray.t_max);
        return t < INFINITE ? ObjectHit{t, objects_.first_analytic_face + number}
                            : ObjectHit{};
    }

    ObjectHit trace_instance(uint32_t number, const Ray &world_ray) {
        const Instance &instance = objects_.instances[number];
        const ObjectGroup &group = objects_.groups[instance.group];
        const auto [origin, direction] =
            to_group(instance, world_ray.origin, world_ray.direction);
        Ray ray{origin, direction, world_ray.t_min, world_ray.t_max};
        // Beyond the range of single precision, or squeezed to nothing.
        if (!is_finite(ray.origin) || !is_finite(ray.direction) ||
            max_component(abs(ray.direction)) == 0)
            return {};
        ObjectHit best;
        if (group.tree) {
            const Hit hit =
                trace_single(*group.tree, ray, query_, root_entry(*group.tree), counters_);
            if (hit.primitive != NO_PRIMITIVE) {
                best = {hit.t, group.first_face + hit.primitive, number};
                if (query_ == Query::any)
                    return best;
                ray.t_max = hit.t;
            }
        }
        const auto visit = [&](uint32_t shape, float t_max) {
            Ray shorter = ray;
            shorter.t_max = t_max;
            const ObjectHit hit = trace_analytic(group.first_analytic + shape, shorter);
            if (hit.found() && (!best.found() || hit.t < best.t ||
                                (hit.t == best.t && objects_.is_analytic(best.face) &&
                                 hit.face < best.face))) {
                best = {hit.t, hit.face, number};
                if (query_ == Query::any)
                    return -1.0f;
            }
            return best.found() ? best.t : t_max;
        };
        counters_.traversal_steps += group.hierarchy.walk(
            BoxRay(Vec3d(ray.origin), Vec3d(ray.direction), ray.t_min), ray.t_max, visit);
        return best;
    }

    const ObjectSet &objects_;
    Query query_;
    Counters &counters_;
};

// The ray, with an empty interval if it is inactive.
Ray ray_at(const RayGroup &rays, uint32_t i) {
    Ray ray = ray_of(rays, i);
    if (!is_finite(ray.origin) || !is_finite(ray.direction) ||
        max_component(abs(ray.direction)) == 0)
        ray.t_max = 0;
    return ray;
}

// Calls trace(i, ray) for each active ray.
template <typename Trace>
void for_each_ray(const RayGroup &rays, Counters &counters, Trace &&trace) {
    RayCost cost(rays, counters);
    for (uint32_t i = 0; i < rays.count; ++i) {
        const Ray ray = ray_at(rays, i);
        if (!(ray.t_max > ray.t_min))
            continue;
        trace(i, ray);
        cost.add_to_run(i, 1);
    }
}

} // namespace

GroupRay to_group(const Instance &instance, Vec3f origin, Vec3f direction) {
    return {Vec3f(instance.to_group.point(Vec3d(origin))),
            Vec3f(instance.to_group.vector(Vec3d(direction)))};
}

void trace_closest_objects(const ObjectSet &objects, const RayGroup &rays,
                           const ObjectHitGroup &hits, Counters &counters) {
    std::fill_n(hits.instance, rays.count, NO_INSTANCE);
    ObjectTracer tracer(objects, Query::closest, counters);
    for_each_ray(rays, counters, [&](uint32_t i, Ray ray) {
        // At the distance of a triangle, the triangle counts.
        if (hits.face[i] != NO_PRIMITIVE)
            ray.t_max = std::nextafter(hits.t[i], -INFINITE);
        const ObjectHit hit = tracer.trace(ray);
        if (hit.found()) {
            hits.t[i] = hit.t;
            hits.face[i] = hit.face;
            hits.instance[i] = hit.instance;
        }
    });
}

void trace_any_objects(const ObjectSet &objects, const RayGroup &rays, uint8_t *occluded,
                       Counters &counters) {
    ObjectTracer tracer(objects, Query::any, counters);
    for_each_ray(rays, counters, [&](uint32_t i, const Ray &ray) {
        if (!occluded[i])
            occluded[i] = tracer.trace(ray).found();
    });
}

} // namespace mlrt
