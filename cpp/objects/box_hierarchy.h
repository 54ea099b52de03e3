// A hierarchy of boxes over objects of any kind: which of them may a ray meet?
#pragma once

#include "base/vec.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace mlrt {

// A ray as boxes see it, in double precision.
struct BoxRay {
    Vec3d origin, reciprocal;
    double t_min;

    BoxRay(Vec3d ray_origin, Vec3d direction, double ray_t_min)
        : origin(ray_origin), t_min(std::max(ray_t_min, 0.0)) {
        // A reciprocal that is finite leaves no zero times infinity.
        constexpr double LARGEST = 1e300;
        for (int k = 0; k < 3; ++k)
            reciprocal[k] = std::abs(direction[k]) > 1 / LARGEST
                                ? 1 / direction[k]
                                : std::copysign(LARGEST, direction[k]);
    }

    // Where the ray enters a box that is widened by a margin; infinity if it does not, or
    // not before t_max. The same operations on a box that contains another give an entry
    // that is no later, whatever is rounded, so a walk from the root loses no box.
    double entry(const Box3f &box, double margin, double t_max) const {
        double near = t_min, far = t_max;
        for (int k = 0; k < 3; ++k) {
            const double a = (box.lo[k] - margin - origin[k]) * reciprocal[k];
            const double b = (box.hi[k] + margin - origin[k]) * reciprocal[k];
            near = std::max(near, std::min(a, b));
            far = std::min(far, std::max(a, b));
        }
        return near <= far ? near : std::numeric_limits<double>::infinity();
    }
};

class BoxHierarchy {
public:
    BoxHierarchy() = default;
    // Objects are known by the numbers of their boxes. Those with an empty box are never
    // visited.
    explicit BoxHierarchy(const std::vector<Box3f> &boxes);

    // Around all objects.
    const Box3f &bounds() const { return bounds_; }
    bool empty() const { return nodes_.empty(); }

    // Calls visit(object, t_max) for objects whose boxes the ray may enter before t_max,
    // roughly from near to far. It returns the new t_max, or a negative number once nothing
    // more is wanted. Returns how many nodes were visited.
    //
    // Boxes are widened by 2^-20 of the coordinates that are involved, since what visit
    // takes for the ray may differ by the rounding of single precision: another frame's.
    template <typename Visit>
    uint64_t walk(const BoxRay &ray, float t_max, Visit &&visit) const {
        if (nodes_.empty())
            return 0;
        const double margin =
            0x1p-20 * (max_component(abs(ray.origin)) + largest_coordinate_);
        struct Pending {
            uint32_t node;
            double entry;
        };
        std::array<Pending, MAX_DEPTH + 1> stack;
        int pending = 0;
        uint64_t visited = 0;
        uint32_t index = 0;
        if (!std::isfinite(ray.entry(nodes_[0].box, margin, t_max)))
            return 1;
        for (;;) {
            const Node &node = nodes_[index];
            ++visited;
            if (node.count > 0) {
                for (uint32_t i = node.first; i < node.first + node.count; ++i) {
                    if (!std::isfinite(ray.entry(leaf_boxes_[i], margin, t_max)))
                        continue;
                    t_max = visit(objects_[i], t_max);
                    if (t_max < 0)
                        return visited;
                }
            } else {
                Pending near{node.first, ray.entry(nodes_[node.first].box, margin, t_max)};
                Pending far{node.first + 1,
                            ray.entry(nodes_[node.first + 1].box, margin, t_max)};
                if (far.entry < near.entry)
                    std::swap(near, far);
                if (std::isfinite(far.entry))
                    stack[size_t(pending++)] = far;
                if (std::isfinite(near.entry)) {
                    index = near.node;
                    continue;
                }
            }
            do {
                if (pending == 0)
                    return visited;
                --pending;
            } while (stack[size_t(pending)].entry > t_max);
            index = stack[size_t(pending)].node;
        }
    }

private:
    static constexpr int MAX_DEPTH = 64;

    struct Node {
        Box3f box;
        uint32_t first = 0; // of a leaf's objects, or of two neighbouring children
        uint32_t count = 0; // objects of a leaf; 0 if it has children
    };

    struct Builder;

    std::vector<Node> nodes_; // the root first
    std::vector<uint32_t> objects_;
    std::vector<Box3f> leaf_boxes_; // in the order of objects_
    Box3f bounds_;
    double largest_coordinate_ = 0;
};

} // namespace mlrt
