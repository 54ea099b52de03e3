// How a node of the kd-tree is laid out: 8 bytes, nothing else.
#pragma once

#include "base/check.h"

#include <algorithm>
#include <atomic>
#include <cstdint>

namespace mlrt {

// An inner node holds its split plane {x[axis] = split} and the index of its lower child;
// the upper child follows it. A leaf holds a range of the tree's list of references.
//
// info, from the low bit: 2 bits axis (3 marks a leaf), then
//   inner node: 30 bits index of the lower child
//   leaf:        6 bits flags, 24 bits count of references
//
// A leaf that is not built yet holds the number of what is to be built in its payload, and
// at least one reference by its count: whoever only asks whether something may lie in it
// needs no more.
class alignas(8) KdNode {
public:
    static constexpr uint32_t LEAF = 3;
    static constexpr uint32_t MAX_NODES = 1u << 30;
    static constexpr uint32_t MAX_LEAF_COUNT = (1u << 24) - 1;

    static KdNode inner(int axis, float split, uint32_t lower_child) {
        MLRT_CHECK(axis >= 0 && axis < 3 && lower_child < MAX_NODES);
        KdNode node;
        node.payload_.split = split;
        node.info_ = (lower_child << 2) | uint32_t(axis);
        return node;
    }

    static KdNode leaf(uint32_t first_reference, uint32_t count) {
        MLRT_CHECK(count <= MAX_LEAF_COUNT);
        KdNode node;
        node.payload_.first_reference = first_reference;
        node.info_ = (count << 8) | LEAF;
        return node;
    }

    static KdNode unbuilt(uint32_t number, uint64_t count) {
        KdNode node = leaf(number, uint32_t(std::min<uint64_t>(count, MAX_LEAF_COUNT)));
        node.info_ |= UNBUILT;
        return node;
    }

    bool is_leaf() const { return (info_ & 3u) == LEAF; }

    // Of an inner node.
    int axis() const { return int(info_ & 3u); }
    float split() const { return payload_.split; }
    uint32_t lower_child() const { return info_ >> 2; }

    // Of a leaf.
    uint32_t first_reference() const { return payload_.first_reference; }
    uint32_t reference_count() const { return info_ >> 8; }

    // Of any node.
    bool is_empty_leaf() const { return (info_ & ~FLAGS) == LEAF; }

    bool is_unbuilt() const { return (info_ & (UNBUILT | 3u)) == (UNBUILT | LEAF); }
    // Of what is to be built in place of an unbuilt leaf.
    uint32_t number() const { return payload_.first_reference; }

private:
    static constexpr uint32_t UNBUILT = 1u << 2, FLAGS = 63u << 2;

    union {
        float split;
        uint32_t first_reference;
    } payload_{};
    uint32_t info_ = LEAF;
};

static_assert(sizeof(KdNode) == 8);

// A node that another thread may be replacing by what it has built: sees either the old
// node or the new one and all that lies below it.
inline KdNode load_node(const KdNode &node) {
    return std::atomic_ref<KdNode>(const_cast<KdNode &>(node))
        .load(std::memory_order_acquire);
}

inline void publish_node(KdNode &place, KdNode node) {
    std::atomic_ref<KdNode>(place).store(node, std::memory_order_release);
}

static_assert(std::atomic_ref<KdNode>::is_always_lock_free);

} // namespace mlrt
