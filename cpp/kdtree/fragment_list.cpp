#include "kdtree/fragment_list.h"

#include "kdtree/reference.h"
#include "kdtree/sah.h"

#include <algorithm>
#include <limits>

namespace mlrt {

namespace {

// Larger ranges are halved in the middle: to try all places takes too long.
constexpr uint32_t MOST_TRIED = 256;

// A small fragment's share of the area of all; chosen from 0, 1/32, 0.1, 0.2 and 1 by what
// rays visit in conference, which large triangles fill, and in dragon.
constexpr double SMALL_SHARE = 0.1;

// The area of the largest one over the mean, in a scan. Without this limit single rays in
// conference, whose triangles differ, take 2 to 4 % longer; with it dragon keeps most
// of what lists gain.
constexpr double MOST_OF_MEAN = 4;

} // namespace

bool FragmentList::are_small() const {
    Box3f all;
    double largest = 0, sum = 0;
    for (const Fragment &fragment : fragments_) {
        add_bounds(all, fragment.box);
        const double area = surface_area(fragment.box);
        largest = std::max(largest, area);
        sum += area;
    }
    return largest <= SMALL_SHARE * surface_area(all) &&
           largest * double(fragments_.size()) <= MOST_OF_MEAN * sum;
}

FragmentList::Division FragmentList::divide(Range range, uint32_t block_size) {
    if (range.count > MOST_TRIED)
        return middle(range);
    if (!range.is_sorted)
        sort(range);
    const auto blocks = [&](uint32_t count) {
        return double((count + block_size - 1) / block_size);
    };
    // The middle, where areas are not finite.
    int axis = 2;
    uint32_t lower = range.count / 2;
    double least = std::numeric_limits<double>::infinity();
    area_above_.resize(range.count);
    for (int k = 0; k < 3; ++k) {
        const uint32_t *order = &orders_[size_t(k)][range.first];
        Box3f box;
        for (uint32_t i = range.count; i-- > 1;) {
            add_bounds(box, fragments_[order[i]].box);
            area_above_[i] = surface_area(box);
        }
        box = {};
        for (uint32_t i = 1; i < range.count; ++i) {
            add_bounds(box, fragments_[order[i - 1]].box);
            const double cost =
                surface_area(box) * blocks(i) + area_above_[i] * blocks(range.count - i);
            if (cost < least) {
                least = cost;
                axis = k;
                lower = i;
            }
        }
    }
    part_orders(range, axis, lower);
    return {
        axis, {range.first, lower, true}, {range.first + lower, range.count - lower, true}};
}

void FragmentList::sort(const Range &range) {
    keys_.resize(range.count);
    for (size_t axis = 0; axis < 3; ++axis) {
        for (uint32_t i = 0; i < range.count; ++i) {
            const Fragment &fragment = fragments_[range.first + i];
            keys_[i] = {fragment.twice_center(int(axis)), fragment.number, range.first + i};
        }
        std::ranges::sort(keys_, [](const Key &a, const Key &b) {
            return a.twice_center < b.twice_center ||
                   (a.twice_center == b.twice_center && a.number < b.number);
        });
        orders_[axis].resize(fragments_.size());
        for (uint32_t i = 0; i < range.count; ++i)
            orders_[axis][range.first + i] = keys_[i].index;
    }
}

FragmentList::Division FragmentList::middle(const Range &range) {
    const auto begin = fragments_.begin() + range.first;
    Box3f box;
    for (uint32_t i = 0; i < range.count; ++i)
        add_bounds(box, begin[i].box);
    const Vec3f size = box.hi - box.lo;
    const int axis =
        size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
    const uint32_t half = range.count / 2;
    std::nth_element(begin, begin + half, begin + range.count,
                     [axis](const Fragment &a, const Fragment &b) {
                         const float at_a = a.twice_center(axis),
                                     at_b = b.twice_center(axis);
                         return at_a < at_b || (at_a == at_b && a.number < b.number);
                     });
    return {axis, {range.first, half}, {range.first + half, range.count - half}};
}

// Brings the first `count` along the axis to the front of all orders.
void FragmentList::part_orders(const Range &range, int axis, uint32_t count) {
    is_upper_.resize(fragments_.size());
    const uint32_t *parted = &orders_[size_t(axis)][range.first];
    for (uint32_t i = 0; i < range.count; ++i)
        is_upper_[parted[i]] = i >= count;
    upper_.resize(range.count + 1);
    for (size_t k = 0; k < 3; ++k) {
        if (k == size_t(axis))
            continue;
        uint32_t *order = &orders_[k][range.first];
        uint32_t lower = 0, upper = 0;
        for (uint32_t i = 0; i < range.count; ++i) {
            const uint32_t fragment = order[i];
            order[lower] = upper_[upper] = fragment;
            lower += !is_upper_[fragment];
            upper += is_upper_[fragment];
        }
        std::copy_n(upper_.begin(), upper, order + lower);
    }
}

} // namespace mlrt
