#include "kdtree/wide_maker.h"

#include "base/check.h"
#include "base/denormals.h"
#include "base/parallel.h"
#include "geometry/clip.h"
#include "kdtree/interruption.h"
#include "kdtree/lazy.h"
#include "kdtree/reference.h"
#include "kdtree/sah.h"
#include "kdtree/wide_part.h"

#include <algorithm>
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

// Lists of more triangles are halved in the middle: to try all places takes too long.
constexpr size_t MOST_TRIED = 256;

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

// A triangle of a leaf, and bounds of what of it lies there.
struct Fragment {
    Box3f box;
    uint32_t number;

    float twice_center(int axis) const { return box.lo[axis] + box.hi[axis]; }
};

// An order along an axis, without ties, so that the same tree is made each time.
auto before_on(int axis) {
    return [axis](const Fragment &a, const Fragment &b) {
        const float at_a = a.twice_center(axis), at_b = b.twice_center(axis);
        return at_a < at_b || (at_a == at_b && a.number < b.number);
    };
}

// Makes parts of the wide tree, from the leaves up.
class WideMaker {
public:
    WideMaker(const KdTree &tree, WideArrays &arrays, const Interruption &interruption)
        : tree_(tree), arrays_(arrays), interruption_(interruption) {}

    // Throws Cancelled.
    WidePart part_of(uint32_t index, const Box3f &cell) {
        const KdNode node = tree_.node(index);
        if (node.is_leaf())
            return part_of_leaf(node, cell);
        interruption_.check();
        const int axis = node.axis();
        WidePart lower = part_of(node.lower_child(), lower_part(cell, axis, node.split()));
        WidePart upper =
            part_of(node.lower_child() + 1, upper_part(cell, axis, node.split()));
        return joined(std::move(lower), std::move(upper), axis);
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
    WidePart part_of_leaf(KdNode leaf, const Box3f &cell) {
        fragments_.clear();
        for (const uint32_t number : tree_.references_of(leaf)) {
            Box3f box = bounds_of(tree_.triangles[number]);
            for (int k = 0; k < 3; ++k) {
                box.lo[k] = std::max(box.lo[k], cell.lo[k]);
                box.hi[k] = std::min(box.hi[k], cell.hi[k]);
            }
            fragments_.push_back({box, number});
        }
        return part_of_list(fragments_);
    }

    // Large leaves, which the rules of the kd-tree leave where triangles are tiny, are
    // divided by surface area: a block costs the same however many triangles it holds.
    WidePart part_of_list(std::span<Fragment> list) {
        if (list.size() <= WideBlock::WIDTH) {
            WidePart part;
            for (const Fragment &fragment : list)
                part.add(fragment.number, fragment.box);
            return part;
        }
        interruption_.check();
        const auto [axis, count] =
            list.size() <= MOST_TRIED ? best_division(list) : middle(list);
        WidePart first = part_of_list(list.first(count));
        return joined(std::move(first), part_of_list(list.subspan(count)), axis);
    }

    struct Division {
        int axis;
        size_t count; // of fragments in the lower part, which come first
    };

    Division best_division(std::span<Fragment> list) {
        const auto blocks = [](size_t count) {
            return double((count + WideBlock::WIDTH - 1) / WideBlock::WIDTH);
        };
        Division best{};
        double least = std::numeric_limits<double>::infinity();
        area_above_.resize(list.size());
        for (int axis = 0; axis < 3; ++axis) {
            sort(list, axis);
            Box3f box;
            for (size_t i = list.size(); i-- > 1;) {
                add_bounds(box, list[i].box);
                area_above_[i] = surface_area(box);
            }
            box = {};
            for (size_t i = 1; i < list.size(); ++i) {
                add_bounds(box, list[i - 1].box);
                const double cost = surface_area(box) * blocks(i) +
                                    area_above_[i] * blocks(list.size() - i);
                if (cost < least) {
                    least = cost;
                    best = {axis, i};
                }
            }
        }
        if (best.count == 0) // areas that are not finite
            best = {2, list.size() / 2};
        if (best.axis != 2)
            sort(list, best.axis);
        return best;
    }

    static Division middle(std::span<Fragment> list) {
        Box3f box;
        for (const Fragment &fragment : list)
            add_bounds(box, fragment.box);
        const Vec3f size = box.hi - box.lo;
        const int axis =
            size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
        std::ranges::nth_element(list, list.begin() + ptrdiff_t(list.size() / 2),
                                 before_on(axis));
        return {axis, list.size() / 2};
    }

    static void sort(std::span<Fragment> list, int axis) {
        std::ranges::sort(list, before_on(axis));
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
    std::vector<Fragment> fragments_;
    std::vector<double> area_above_;
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
