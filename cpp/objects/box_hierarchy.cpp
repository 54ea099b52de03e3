#include "objects/box_hierarchy.h"

namespace mlrt {

namespace {

constexpr uint32_t LEAF_SIZE = 2; // chosen: objects cost much more than boxes
constexpr int BIN_COUNT = 16;     // chosen

double half_area(const Box3f &box) {
    if (box.empty())
        return 0;
    const Vec3d e(box.extent());
    return e.x * e.y + e.y * e.z + e.z * e.x;
}

void add(Box3f &box, const Box3f &other) {
    if (other.empty())
        return;
    box.add(other.lo);
    box.add(other.hi);
}

} // namespace

// From the root down: splits the objects where the surface area heuristic, on bins of their
// centres, says (Wald, "On fast construction of SAH-based bounding volume hierarchies",
// 2007), and in halves where it does not help, or the hierarchy becomes too deep.
struct BoxHierarchy::Builder {
    BoxHierarchy &hierarchy;
    const std::vector<Box3f> &boxes;

    Vec3d centre(uint32_t object) const {
        return (Vec3d(boxes[object].lo) + Vec3d(boxes[object].hi)) * 0.5;
    }

    struct Range {
        Vec3d lo{INFINITY, INFINITY, INFINITY}, hi{-INFINITY, -INFINITY, -INFINITY};
    };

    void build(uint32_t node_index, uint32_t first, uint32_t last, int depth) {
        std::vector<uint32_t> &objects = hierarchy.objects_;
        Box3f box;
        Range centres;
        for (uint32_t i = first; i < last; ++i) {
            add(box, boxes[objects[i]]);
            const Vec3d c = centre(objects[i]);
            for (int k = 0; k < 3; ++k) {
                centres.lo[k] = std::min(centres.lo[k], c[k]);
                centres.hi[k] = std::max(centres.hi[k], c[k]);
            }
        }
        hierarchy.nodes_[node_index].box = box;
        if (last - first <= LEAF_SIZE) {
            hierarchy.nodes_[node_index].first = first;
            hierarchy.nodes_[node_index].count = last - first;
            return;
        }
        const Vec3d extent = centres.hi - centres.lo;
        const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0
                         : extent.y >= extent.z                       ? 1
                                                                      : 2;
        // Halves need log2(2^32) levels below the depth at which they begin.
        uint32_t middle = depth < MAX_DEPTH / 2 ? split(first, last, axis, centres) : first;
        if (middle == first || middle == last) {
            middle = first + (last - first) / 2;
            std::nth_element(
                objects.begin() + first, objects.begin() + middle, objects.begin() + last,
                [&](uint32_t a, uint32_t b) { return centre(a)[axis] < centre(b)[axis]; });
        }
        const uint32_t children = uint32_t(hierarchy.nodes_.size());
        hierarchy.nodes_.resize(children + 2);
        hierarchy.nodes_[node_index].first = children;
        build(children, first, middle, depth + 1);
        build(children + 1, middle, last, depth + 1);
    }

    // Where the objects of the second child begin, after sorting them into both.
    uint32_t split(uint32_t first, uint32_t last, int axis, const Range &centres) {
        const double low = centres.lo[axis], extent = centres.hi[axis] - low;
        if (!(extent > 0))
            return first;
        const auto bin_of = [&](uint32_t object) {
            const double place = (centre(object)[axis] - low) / extent * BIN_COUNT;
            return std::min(int(place), BIN_COUNT - 1);
        };
        struct Bin {
            Box3f box;
            uint32_t count = 0;
        };
        std::array<Bin, BIN_COUNT> bins;
        std::vector<uint32_t> &objects = hierarchy.objects_;
        for (uint32_t i = first; i < last; ++i) {
            Bin &bin = bins[size_t(bin_of(objects[i]))];
            add(bin.box, boxes[objects[i]]);
            ++bin.count;
        }
        std::array<double, BIN_COUNT> cost_above{};
        Bin above;
        for (size_t i = BIN_COUNT - 1; i > 0; --i) {
            add(above.box, bins[i].box);
            above.count += bins[i].count;
            cost_above[i] = half_area(above.box) * above.count;
        }
        Bin below;
        double best_cost = INFINITY;
        int best = 0;
        for (size_t i = 1; i < BIN_COUNT; ++i) {
            add(below.box, bins[i - 1].box);
            below.count += bins[i - 1].count;
            const double cost = half_area(below.box) * below.count + cost_above[i];
            if (below.count > 0 && below.count < last - first && cost < best_cost) {
                best_cost = cost;
                best = int(i);
            }
        }
        const auto middle =
            std::partition(objects.begin() + first, objects.begin() + last,
                           [&](uint32_t object) { return bin_of(object) < best; });
        return uint32_t(middle - objects.begin());
    }
};

BoxHierarchy::BoxHierarchy(const std::vector<Box3f> &boxes) {
    for (uint32_t i = 0; i < boxes.size(); ++i)
        if (!boxes[i].empty()) {
            objects_.push_back(i);
            add(bounds_, boxes[i]);
        }
    if (objects_.empty())
        return;
    largest_coordinate_ =
        std::max(max_component(abs(bounds_.lo)), max_component(abs(bounds_.hi)));
    nodes_.resize(1);
    Builder{*this, boxes}.build(0, 0, uint32_t(objects_.size()), 0);
    for (const uint32_t object : objects_)
        leaf_boxes_.push_back(boxes[object]);
}

} // namespace mlrt
