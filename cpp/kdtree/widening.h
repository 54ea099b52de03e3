// When a kd-tree gets its wide form: once rays that go alone make it worth the time.
#pragma once

#include "kdtree/wide_tree.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>

namespace mlrt {

struct KdTree;

class Widening {
public:
    // The wide tree, or nothing if it has not been made. From any thread.
    const WideTree *tree() const { return tree_.load(std::memory_order_acquire); }

    // Tells of rays that would have taken it. From any thread.
    void miss(uint64_t rays) { missed_.fetch_add(rays, std::memory_order_relaxed); }

    // Makes it by all threads, if it has not been made, for the kd-tree that this belongs
    // to. From any thread but those of a parallel loop. Gives nothing if it was cancelled,
    // which is asked on the calling thread only, also while another thread makes it. Throws
    // as make_wide_tree().
    const WideTree *make(const KdTree &tree, const std::function<bool()> &cancelled = {});

    // The same if `rays` that are about to be traced, and those that have missed it, are
    // worth it, and there is room. Lazy trees are left as they are. Returns whether it was
    // not cancelled.
    bool make_for(const KdTree &tree, uint64_t rays,
                  const std::function<bool()> &cancelled = {});

private:
    std::atomic<const WideTree *> tree_{nullptr};
    std::atomic<uint64_t> missed_{0};
    std::atomic<bool> has_no_room_{false};
    std::unique_ptr<const WideTree> owned_;
    std::mutex mutex_;
};

} // namespace mlrt
