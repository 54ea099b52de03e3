#include "traverse/wide_entry.h"

#include "base/block_order.h"
#include "traverse/packet_frustum.h"

#include <array>
#include <bit>
#include <limits>

namespace mlrt {

namespace {

// A child of a node of the tree.
struct Part {
    const WideNode *parent;
    uint32_t number;
    bool is_final; // not taken apart

    WideChild child() const { return WideChild::from_bits(parent->children[number]); }
};

// Parts of the tree in the order in which rays reach them.
struct Parts {
    uint32_t count = 0;
    std::array<Part, WideNode::WIDTH> parts;

    void add(const Part &part) { parts[count++] = part; }
};

class EntrySearch {
public:
    EntrySearch(const WideTree &tree, std::span<const WidePacket> packets)
        : tree_(tree),
          frustum_(packets[0].rays.origin.point, packets[0].main_axis, packets[0].side) {
        std::array<float, 2> least, greatest;
        for (size_t n = 0; n < 2; ++n) {
            FloatPacket lo(INFINITE), hi(-INFINITE);
            for (const WidePacket &packet : packets) {
                const auto active = from_bits<FloatPacket>(packet.rays.active);
                const FloatPacket u = frustum_.slopes_of(packet.rays, n);
                lo = minimum(select(active, u, FloatPacket(INFINITE)), lo);
                hi = maximum(select(active, u, FloatPacket(-INFINITE)), hi);
            }
            least[n] = least_lane(lo);
            greatest[n] = greatest_lane(hi);
            slopes_[n] = SlopeRange(least[n], greatest[n]);
        }
        octant_ = frustum_.octant(least, greatest);
    }

    // Takes parts apart, level by level, as long as there is room.
    Parts search() const {
        Parts found;
        add_children(tree_.nodes[tree_.root.index()], WideNode::WIDTH, found);
        for (bool deeper = true; deeper;) {
            deeper = false;
            const Parts above = found;
            found.count = 0;
            for (uint32_t i = 0; i < above.count; ++i) {
                Part part = above.parts[i];
                const uint32_t room = WideNode::WIDTH - found.count - (above.count - i - 1);
                if (!part.is_final &&
                    add_children(tree_.nodes[part.child().index()], room, found)) {
                    deeper = true;
                } else {
                    part.is_final = true;
                    found.add(part);
                }
            }
        }
        return found;
    }

private:
    // Adds those that rays may enter, unless they are too many.
    bool add_children(const WideNode &node, uint32_t most, Parts &found) const {
        SeenBoxes boxes;
        const LaneBits entered = to_bits(frustum_.entered(node, slopes_, boxes));
        if (uint32_t(std::popcount(entered)) > most)
            return false;
        const uint32_t order = node.back_to_front[octant_];
        for (uint32_t place = WideNode::WIDTH; place-- > 0;) {
            const uint32_t number = order >> 4 * place & 7;
            if ((entered >> number & 1) == 0)
                continue;
            const Part part{&node, number, false};
            found.add({&node, number, part.child().is_block()});
            if (!part.child().is_block())
                prefetch(&tree_.nodes[part.child().index()]);
        }
        return true;
    }

    const WideTree &tree_;
    SlopeFrustum frustum_;
    std::array<SlopeRange, 2> slopes_;
    uint32_t octant_;
};

// Those parts as children of one node, the nearest one last.
WideNode node_of(const Parts &found) {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    WideNode node;
    for (uint32_t i = 0; i < WideNode::WIDTH; ++i) {
        const bool is_there = i < found.count;
        const Part *part = is_there ? &found.parts[found.count - i - 1] : nullptr;
        for (size_t face = 0; face < 6; ++face)
            node.faces[face][i] = part       ? part->parent->faces[face][part->number]
                                  : face < 3 ? infinity
                                             : -infinity;
        node.children[i] = part ? part->parent->children[part->number] : 0;
    }
    node.back_to_front.fill(0x76543210u);
    return node;
}

} // namespace

WideEntry::WideEntry(const WideTree &tree, std::span<const WidePacket> packets)
    : end_(packets.data()) {
    if (tree.root.is_block())
        return;
    const WidePacket *end = packets.data();
    while (end < packets.data() + packets.size() &&
           end->main_axis == packets[0].main_axis && end->side == packets[0].side)
        ++end;
    const auto count = size_t(end - packets.data());
    if (count < LEAST)
        return;
    end_ = end;
    node_ = node_of(EntrySearch(tree, packets.first(count)).search());
}

} // namespace mlrt
