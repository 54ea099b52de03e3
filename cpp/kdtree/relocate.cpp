#include "kdtree/relocate.h"

#include <limits>

namespace mlrt {

void check_tree_size(uint64_t node_count, uint64_t reference_count) {
    if (node_count > KdNode::MAX_NODES)
        throw std::length_error("the kd-tree needs more than 2^30 nodes; build it with a "
                                "larger area floor or a smaller depth");
    if (reference_count > std::numeric_limits<uint32_t>::max())
        throw std::length_error("the kd-tree needs more than 2^32 references; build it "
                                "with a larger area floor or a smaller depth");
}

KdNode relocate(const SubtreeArrays &subtree, uint64_t first_node, uint64_t first_reference,
                KdNode *nodes, uint32_t *references) {
    const auto moved = [&](KdNode node) {
        if (node.is_leaf())
            return KdNode::leaf(uint32_t(node.first_reference() + first_reference),
                                node.reference_count());
        return KdNode::inner(node.axis(), node.split(),
                             uint32_t(node.lower_child() - 1 + first_node));
    };
    for (size_t i = 1; i < subtree.nodes.size(); ++i)
        nodes[first_node + i - 1] = moved(subtree.nodes[i]);
    std::copy(subtree.references.begin(), subtree.references.end(),
              references + first_reference);
    return moved(subtree.nodes[0]);
}

} // namespace mlrt
