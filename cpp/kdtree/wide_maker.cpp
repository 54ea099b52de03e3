#include "kdtree/wide_maker.h"

#include "base/check.h"
#include "base/denormals.h"
#include "base/parallel.h"
#include "geometry/clip.h"
#include "kdtree/fragment_list.h"
#include "kdtree/interruption.h"
#include "kdtree/lazy.h"
#include "kdtree/reference.h"
#include "kdtree/sah.h"
#include "kdtree/wide_part.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

namespace mlrt {

namespace {

// Subtrees of the kd-tree that are dealt out to threads lie at this depth, or are leaves
// above; chosen.
constexpr int DEALT_DEPTH = 8;
constexpr uint64_t MOST_DEALT = 1 << DEALT_DEPTH;

// Elements that a thread takes from an array at a time; chosen.
constexpr uint64_t SHARE = 32;

// References below a node of the kd-tree that become one list, if all are small: where
// triangles are tiny, cells cut half of them, and each copy takes a place in a block.
// Chosen from 64, 256, 512 and 2048 by frames of dragon: more gain little and take longer.
constexpr size_t MOST_LISTED = 256;

// An array that threads fill side by side.
template <typename T>
class SharedArray {
public:
    explicit SharedArray(uint64_t capacity)
        : elements_(0, capacity + (MOST_DEALT + 1) * SHARE) {}

    // What one thread has taken and not used yet.
    struct Share {
        uint64_t next = 0, end = 0;
    };

    // A place for an element.
    uint64_t take(Share &share) {
        if (share.next == share.end) {
            share.next = taken_.fetch_add(SHARE, std::memory_order_relaxed);
            share.end = share.next + SHARE;
            if (share.end > std::min(elements_.capacity(), WideChild::MAX_INDEX))
                throw std::length_error("the scene is too large for a wide tree");
        }
        return share.next++;
    }
    T &operator[](uint64_t i) { return elements_[i]; }

    HugeArray<T> finished() {
        elements_.set_size(taken_);
        return std::move(elements_);
    }

private:
    HugeArray<T> elements_;
    std::atomic<uint64_t> taken_{0};
};

// Room for all parts. A node has two children at least, and a block holds one reference at
// least that no other block holds in its place.
struct WideArrays {
    SharedArray<WideNode> nodes;
    SharedArray<WideBlock> blocks;

    explicit WideArrays(uint64_t references) : nodes(references + 1), blocks(references) {}
};

// Makes parts of the wide tree, from the leaves up.
class WideMaker {
public:
    WideMaker(const KdTree &tree, WideArrays &arrays, const Interruption &interruption)
        : tree_(tree), arrays_(arrays), interruption_(interruption) {}

    // Throws Cancelled.
    WidePart part_of(uint32_t index, const Box3f &cell) {
        return part_of_subtree(index, cell, true);
    }

    // Of both sides of a plane across the axis, or of about that.
    WidePart joined(WidePart lower, WidePart upper, int axis) {
        if (lower.is_empty())
            return upper;
        if (upper.is_empty() || lower.take_triangles_of(upper))
            return lower;
        make_children(lower);
        make_children(upper);
        // The one of less area costs least as a node, as fewest rays enter it.
        while (lower.child_count + upper.child_count > WideNode::WIDTH) {
            const bool smaller = surface_area(lower.box) < surface_area(upper.box);
            const bool close_lower =
                upper.child_count == 1 || (smaller && lower.child_count > 1);
            close(close_lower ? lower : upper);
        }
        lower.take_children_of(upper, axis);
        return lower;
    }

    // Makes the part one child of what is above. Nothing becomes a node without children.
    WideChild close(WidePart &part) {
        if (part.is_empty()) {
            const uint64_t place = arrays_.nodes.take(nodes_);
            arrays_.nodes[place] = part.node();
            return WideChild::node(place);
        }
        make_children(part);
        if (part.child_count > 1) {
            const uint64_t place = arrays_.nodes.take(nodes_);
            arrays_.nodes[place] = part.node();
            part.become(WideChild::node(place));
            ++part.depth;
            MLRT_CHECK(part.depth <= MAX_WIDE_DEPTH);
        }
        return part.children[0];
    }

private:
    // `try_list`: whether its triangles may make one list, which those of a larger subtree
    // did not for their sizes.
    WidePart part_of_subtree(uint32_t index, const Box3f &cell, bool try_list) {
        const KdNode node = tree_.node(index);
        if (node.is_leaf()) {
            const std::span<const uint32_t> references = tree_.references_of(node);
            numbers_.assign(references.begin(), references.end());
            list_triangles(cell);
            return part_of_list(fragments_.all());
        }
        interruption_.check();
        if (try_list && find_few_references(index)) {
            list_triangles(cell);
            if (fragments_.are_small())
                return part_of_list(fragments_.all());
            try_list = false;
        }
        const int axis = node.axis();
        WidePart lower = part_of_subtree(node.lower_child(),
                                         lower_part(cell, axis, node.split()), try_list);
        WidePart upper = part_of_subtree(node.lower_child() + 1,
                                         upper_part(cell, axis, node.split()), try_list);
        return joined(std::move(lower), std::move(upper), axis);
    }

    // Numbers of the triangles below a node, without repeats. Returns false if there are
    // too many references.
    bool find_few_references(uint32_t index) {
        numbers_.clear();
        std::array<uint32_t, MAX_TREE_DEPTH + 1> waiting;
        uint32_t pending = 0;
        for (waiting[pending++] = index; pending > 0;) {
            const KdNode node = tree_.node(waiting[--pending]);
            if (!node.is_leaf()) {
                waiting[pending++] = node.lower_child();
                waiting[pending++] = node.lower_child() + 1;
                continue;
            }
            const std::span<const uint32_t> references = tree_.references_of(node);
            if (numbers_.size() + references.size() > MOST_LISTED)
                return false;
            numbers_.insert(numbers_.end(), references.begin(), references.end());
        }
        std::ranges::sort(numbers_);
        numbers_.erase(std::ranges::unique(numbers_).begin(), numbers_.end());
        return true;
    }

    void list_triangles(const Box3f &cell) {
        fragments_.clear();
        for (const uint32_t number : numbers_) {
            Box3f box = bounds_of(tree_.triangles[number]);
            for (int k = 0; k < 3; ++k) {
                box.lo[k] = std::max(box.lo[k], cell.lo[k]);
                box.hi[k] = std::min(box.hi[k], cell.hi[k]);
            }
            fragments_.add({box, number});
        }
    }

    // Divides lists by surface area: a block costs the same however many triangles it
    // holds.
    WidePart part_of_list(const FragmentList::Range &range) {
        if (range.count <= WideBlock::WIDTH) {
            WidePart part;
            for (uint32_t i = 0; i < range.count; ++i) {
                const Fragment &fragment = fragments_.at(range, i);
                part.add(fragment.number, fragment.box);
            }
            return part;
        }
        interruption_.check();
        const auto [axis, below, above] = fragments_.divide(range, WideBlock::WIDTH);
        WidePart lower = part_of_list(below);
        return joined(std::move(lower), part_of_list(above), axis);
    }

    void make_children(WidePart &part) {
        if (part.child_count > 0 || part.is_empty())
            return;
        const uint64_t place = arrays_.blocks.take(blocks_);
        arrays_.blocks[place] = part.block(tree_.triangles.data());
        part.become(WideChild::block(place));
    }

    const KdTree &tree_;
    WideArrays &arrays_;
    const Interruption &interruption_;
    SharedArray<WideNode>::Share nodes_;
    SharedArray<WideBlock>::Share blocks_;
    std::vector<uint32_t> numbers_; // of triangles
    FragmentList fragments_;
};

// Deals out the subtrees at a depth of the kd-tree, and joins what is made of them.
class Dealer {
public:
    Dealer(const KdTree &tree, WideArrays &arrays, const Interruption &interruption)
        : tree_(tree), arrays_(arrays), interruption_(interruption) {}

    // Throws Cancelled.
    WideChild make() {
        list_subtrees(0, tree_.bounds, DEALT_DEPTH);
        parallel_for(
            uint32_t(subtrees_.size()),
            [&](uint32_t i) {
                const auto [node, cell] = subtrees_[i];
                WideMaker maker(tree_, arrays_, interruption_);
                parts_[i] = maker.part_of(node, cell);
            },
            [&] { return interruption_(); });
        interruption_.check();
        WideMaker top(tree_, arrays_, interruption_);
        WidePart root = join_subtrees(top, 0, DEALT_DEPTH);
        return top.close(root);
    }

private:
    struct Subtree {
        uint32_t node;
        Box3f cell;
    };

    bool is_dealt(KdNode node, int depth_left) const {
        return node.is_leaf() || depth_left == 0;
    }

    void list_subtrees(uint32_t index, const Box3f &cell, int depth_left) {
        const KdNode node = tree_.node(index);
        if (is_dealt(node, depth_left)) {
            subtrees_.push_back({index, cell});
            parts_.emplace_back();
            return;
        }
        const int axis = node.axis();
        list_subtrees(node.lower_child(), lower_part(cell, axis, node.split()),
                      depth_left - 1);
        list_subtrees(node.lower_child() + 1, upper_part(cell, axis, node.split()),
                      depth_left - 1);
    }

    // In the order in which they were listed.
    WidePart join_subtrees(WideMaker &maker, uint32_t index, int depth_left) {
        const KdNode node = tree_.node(index);
        if (is_dealt(node, depth_left))
            return parts_[joined_++];
        WidePart lower = join_subtrees(maker, node.lower_child(), depth_left - 1);
        WidePart upper = join_subtrees(maker, node.lower_child() + 1, depth_left - 1);
        return maker.joined(std::move(lower), std::move(upper), node.axis());
    }

    const KdTree &tree_;
    WideArrays &arrays_;
    const Interruption &interruption_;
    std::vector<Subtree> subtrees_;
    std::vector<WidePart> parts_;
    size_t joined_ = 0;
};

} // namespace

std::optional<WideTree> make_wide_tree(const KdTree &tree,
                                       const std::function<bool()> &cancelled) try {
    const KeepDenormals keep_denormals;
    const Interruption interruption(cancelled);
    if (!finish_growth(tree, [&] { return interruption(); }))
        return std::nullopt;
    const uint64_t references =
        tree.growth ? tree.growth->state().references : tree.references.size();
    WideArrays arrays(references);
    WideTree wide;
    wide.root = Dealer(tree, arrays, interruption).make();
    wide.nodes = arrays.nodes.finished();
    wide.blocks = arrays.blocks.finished();
    return wide;
} catch (const Cancelled &) {
    return std::nullopt;
}

} // namespace mlrt
