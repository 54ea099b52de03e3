// Where packets that are next to each other enter the wide tree: at parts deep in it, to
// which all of their rays are taken together.
#pragma once

#include "kdtree/wide_tree.h"
#include "traverse/wide_packets.h"

#include <cstddef>
#include <span>

namespace mlrt {

// For those of the packets, from the first one on, that go along the same axis to the same
// side: all have a common origin.
class WideEntry {
public:
    WideEntry(const WideTree &tree, std::span<const WidePacket> packets);

    // For one of the packets: a node whose children are all those parts of the tree that
    // its rays may enter, the nearest one last whatever the octant; or none.
    const WideNode *of(const WidePacket &packet) const {
        return &packet < end_ ? &node_ : nullptr;
    }

private:
    // For fewer packets it is not worth it; chosen.
    static constexpr size_t LEAST = 4;

    const WidePacket *end_; // of those that enter there
    WideNode node_;
};

} // namespace mlrt
