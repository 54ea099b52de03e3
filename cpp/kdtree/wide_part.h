// A part of the wide tree while it is made: a few triangles, or children that are not yet
// those of a node.
#pragma once

#include "kdtree/reference.h"
#include "kdtree/wide_tree.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

namespace mlrt {

struct WidePart {
    Box3f box;          // of all
    uint32_t depth = 0; // nodes on the longest path below

    // Triangles, without repeats, as long as there are no children.
    uint32_t triangle_count = 0;
    std::array<uint32_t, WideBlock::WIDTH> triangles;

    uint32_t child_count = 0;
    std::array<Box3f, WideNode::WIDTH> boxes;
    std::array<WideChild, WideNode::WIDTH> children;
    std::array<uint32_t, 8> back_to_front{}; // as in WideNode, without what is not there

    bool is_empty() const { return triangle_count == 0 && child_count == 0; }

    void add(uint32_t triangle, const Box3f &triangle_box) {
        triangles[triangle_count++] = triangle;
        add_bounds(box, triangle_box);
    }

    // Becomes both, if that is a block. Returns whether it is.
    bool take_triangles_of(const WidePart &other) {
        if (child_count > 0 || other.child_count > 0)
            return false;
        const std::span own(triangles.data(), triangle_count);
        std::array<uint32_t, WideBlock::WIDTH> more;
        uint32_t count = 0;
        for (uint32_t i = 0; i < other.triangle_count; ++i)
            if (std::ranges::find(own, other.triangles[i]) == own.end())
                more[count++] = other.triangles[i];
        if (triangle_count + count > WideBlock::WIDTH)
            return false;
        std::copy_n(more.begin(), count, triangles.begin() + triangle_count);
        triangle_count += count;
        add_bounds(box, other.box);
        return true;
    }

    // Takes the children of what lies above it along the axis: there must be room.
    void take_children_of(const WidePart &upper, int axis) {
        const uint32_t numbers = 0x11111111u * child_count & four_bits(upper.child_count);
        for (uint32_t octant = 0; octant < 8; ++octant) {
            const uint32_t own = back_to_front[octant];
            const uint32_t others = upper.back_to_front[octant] + numbers;
            back_to_front[octant] = (octant >> axis & 1)
                                        ? own | others << 4 * child_count
                                        : others | own << 4 * upper.child_count;
        }
        std::copy_n(upper.boxes.begin(), upper.child_count, boxes.begin() + child_count);
        std::copy_n(upper.children.begin(), upper.child_count,
                    children.begin() + child_count);
        child_count += upper.child_count;
        depth = std::max(depth, upper.depth);
        add_bounds(box, upper.box);
    }

    // Becomes one child, which holds all.
    void become(WideChild child) {
        triangle_count = 0;
        child_count = 1;
        boxes[0] = box;
        children[0] = child;
        back_to_front = {};
    }

    // Of the children.
    WideNode node() const {
        constexpr float infinity = std::numeric_limits<float>::infinity();
        WideNode node;
        for (uint32_t i = 0; i < WideNode::WIDTH; ++i) {
            const bool is_there = i < child_count;
            for (int k = 0; k < 3; ++k) {
                node.faces[size_t(k)][i] = is_there ? boxes[i].lo[k] : infinity;
                node.faces[size_t(k) + 3][i] = is_there ? boxes[i].hi[k] : -infinity;
            }
            node.children[i] = is_there ? children[i].bits() : 0;
        }
        for (uint32_t octant = 0; octant < 8; ++octant)
            node.back_to_front[octant] =
                back_to_front[octant] | (0x76543210u & ~four_bits(child_count));
        return node;
    }

    // Of the triangles, given all of the scene. What is not there is the last one again.
    WideBlock block(const Triangle *all) const {
        WideBlock block;
        for (uint32_t i = 0; i < WideBlock::WIDTH; ++i) {
            const bool is_there = i < triangle_count;
            const uint32_t number = triangles[is_there ? i : triangle_count - 1];
            const Triangle &triangle = all[number];
            for (int k = 0; k < 9; ++k)
                block.coordinates[size_t(k)][i] = triangle[k / 3][k % 3];
            block.numbers[i] = is_there ? number : NO_PRIMITIVE;
        }
        return block;
    }

private:
    // Ones in four bits for each of `count` numbers.
    static uint32_t four_bits(uint32_t count) {
        return uint32_t((uint64_t(1) << 4 * count) - 1);
    }
};

} // namespace mlrt
