// Triangles of a part of the kd-tree, and how to divide them by surface area.
#pragma once

#include "base/vec.h"

#include <array>
#include <cstdint>
#include <vector>

namespace mlrt {

// A triangle, and bounds of what of it lies in a cell.
struct Fragment {
    Box3f box;
    uint32_t number;

    float twice_center(int axis) const { return box.lo[axis] + box.hi[axis]; }
};

// The same fragments are divided in the same way whatever their order.
class FragmentList {
public:
    // Some of them, which lie next to each other in the order of places.
    struct Range {
        uint32_t first, count;
        bool is_sorted = false;
    };
    struct Division {
        int axis;
        Range lower, upper;
    };

    void clear() { fragments_.clear(); }
    void add(const Fragment &fragment) { fragments_.push_back(fragment); }
    Range all() const { return {0, uint32_t(fragments_.size())}; }

    // Whether each one is small beside the box around all of them, and none much larger
    // than the others, as in dense scans.
    bool are_small() const;

    // Into two parts, neither of them empty: by the surface area heuristic, where blocks of
    // `block_size` cost the same however many they hold. Places in the range change. There
    // must be two fragments at least.
    Division divide(Range range, uint32_t block_size);

    const Fragment &at(const Range &range, uint32_t i) const {
        return fragments_[range.is_sorted ? orders_[0][range.first + i] : range.first + i];
    }

private:
    void sort(const Range &range);
    Division middle(const Range &range);
    void part_orders(const Range &range, int axis, uint32_t count);

    std::vector<Fragment> fragments_;
    // Fragments of sorted ranges by their centres along each axis.
    std::array<std::vector<uint32_t>, 3> orders_;

    // Kept for their memory.
    struct Key {
        float twice_center;
        uint32_t number, index;
    };
    std::vector<Key> keys_;
    std::vector<double> area_above_;
    std::vector<uint32_t> upper_;
    std::vector<uint8_t> is_upper_; // by fragment
};

} // namespace mlrt
