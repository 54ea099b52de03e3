// Walks through the wide tree that take turns, as a step mostly waits for memory.
#pragma once

#include "base/counters.h"
#include "kdtree/wide_tree.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>

namespace mlrt {

// Takes `count` walks to their ends, AT_ONCE of them at a time: start(walk) begins the next
// one, finish(walk) takes what it has found. A walk has
//
//     bool next(const WideTree &)       what it visits next, whose memory it asks for
//     bool is_at_block() const          whether that is a block
//     void visit_node(const WideTree &)
//
// and visit_block(walk) visits a block.
template <typename Walk, size_t AT_ONCE, typename Start, typename VisitBlock,
          typename Finish>
void take_turns(const WideTree &tree, size_t count, Counters &counters, Start &&start,
                VisitBlock &&visit_block, Finish &&finish) {
    // Too much for the stacks of some threads.
    thread_local const auto memory = std::make_unique<std::array<Walk, AT_ONCE>>();
    std::array<Walk, AT_ONCE> &walks = *memory;
    std::array<Walk *, AT_ONCE> running;
    size_t started = 0;
    for (; started < std::min(AT_ONCE, count); ++started) {
        running[started] = &walks[started];
        start(walks[started]);
    }
    // Whether a walk goes on, and where to, was known a round ago: to wait for that where
    // it is computed would keep the others waiting.
    for (size_t left = started; left > 0;) {
        std::array<Walk *, AT_ONCE> at_node, at_block;
        size_t nodes = 0, blocks = 0;
        for (size_t i = 0; i < left;) {
            Walk &walk = *running[i];
            if (walk.next(tree)) {
                (walk.is_at_block() ? at_block[blocks++] : at_node[nodes++]) = &walk;
                ++i;
                continue;
            }
            finish(walk);
            if (started < count) {
                start(walk);
                ++started;
            } else {
                running[i] = running[--left];
            }
        }
        for (size_t i = 0; i < nodes; ++i)
            at_node[i]->visit_node(tree);
        for (size_t i = 0; i < blocks; ++i)
            visit_block(*at_block[i]);
        counters.traversal_steps += nodes + blocks;
        counters.leaf_visits += blocks;
    }
}

} // namespace mlrt
