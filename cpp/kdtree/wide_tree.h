// The kd-tree for rays that go alone, or in small packets: nodes of eight children with
// boxes of their own, and blocks of eight triangles.
//
// Such a ray waits for memory at each step and has but one plane to compute with there. So
// about three levels of the kd-tree become one node, whose children are tested side by side
// (as in Wald, Benthin and Boulos 2008, "Getting rid of packets"), and what lies in a part
// with few triangles becomes one block. Boxes of children are disjoint as their cells are,
// but where a large leaf was divided, or a subtree of triangles so small that its cells
// would cut many of them.
#pragma once

#include "base/huge_array.h"
#include "base/simd.h"
#include "geometry/triangle.h"

#include <array>
#include <cstdint>
#include <limits>

namespace mlrt {

// What a child is: a node, or a block of triangles.
class WideChild {
public:
    static constexpr uint64_t MAX_INDEX = (1u << 31) - 1;

    static WideChild node(uint64_t index) { return WideChild(uint32_t(index)); }
    static WideChild block(uint64_t index) { return WideChild(uint32_t(index) | BLOCK); }

    WideChild() = default; // of any value

    bool is_block() const { return (bits_ & BLOCK) != 0; }
    uint32_t index() const { return bits_ & ~BLOCK; }

    uint32_t bits() const { return bits_; }
    static WideChild from_bits(uint32_t bits) { return WideChild(bits); }
    static MaskOf<UIntBlock> are_blocks(const UIntBlock &bits) {
        return (bits & UIntBlock(BLOCK)) != UIntBlock(0u);
    }

private:
    static constexpr uint32_t BLOCK = 1u << 31;

    explicit WideChild(uint32_t bits) : bits_(bits) {}

    uint32_t bits_;
};

// A child that there is not has a box that ends before it begins.
struct alignas(CACHE_LINE) WideNode {
    static constexpr uint32_t WIDTH = BLOCK_WIDTH;

    // The boxes' lower faces by axis, then the upper ones, a value a child.
    std::array<std::array<float, WIDTH>, 6> faces;
    std::array<uint32_t, WIDTH> children; // bits of a WideChild
    // Numbers of all children from back to front, by octant of the direction (bit k:
    // towards lower x[k]): four bits each, the last one highest.
    std::array<uint32_t, 8> back_to_front;

    MaskOf<UIntBlock> are_blocks() const {
        return WideChild::are_blocks(load<UIntBlock>(children.data()));
    }
};

static_assert(sizeof(WideNode) == 4 * CACHE_LINE);

// Copies of up to eight triangles.
struct alignas(CACHE_LINE) WideBlock {
    static constexpr uint32_t WIDTH = BLOCK_WIDTH;

    // x, y, z of vertex a, then of b, then of c, a value a triangle.
    std::array<std::array<float, WIDTH>, 9> coordinates;
    std::array<uint32_t, WIDTH> numbers; // NO_PRIMITIVE: there is none in this place

    Triangle triangle(uint32_t i) const {
        const auto vertex = [&](int first) {
            return Vec3f{coordinates[first][i], coordinates[first + 1][i],
                         coordinates[first + 2][i]};
        };
        return {vertex(0), vertex(3), vertex(6)};
    }
};

static_assert(sizeof(WideBlock) == 5 * CACHE_LINE);

struct WideTree {
    HugeArray<WideNode> nodes; // some at the end of a thread's share are not used
    HugeArray<WideBlock> blocks;
    WideChild root;

    uint64_t bytes() const { return nodes.bytes() + blocks.bytes(); }
};

// A path from the root to a block has no more nodes: traversal stacks are sized by it. Two
// parts that are joined add one node at most to what is below: 64 joins on a path of the
// kd-tree, 16 that halve a leaf of 2^24 triangles down to 256, 36 in a list of those, as a
// part of eight triangles or less is cut off at a time and a node takes seven, and the
// root.
inline constexpr uint32_t MAX_WIDE_DEPTH = 128;

} // namespace mlrt
