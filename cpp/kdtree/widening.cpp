#include "kdtree/widening.h"

#include "kdtree/tree.h"
#include "kdtree/wide_maker.h"

namespace mlrt {

namespace {

// For as many rays a reference of the kd-tree as this, what the wide tree saves is what it
// takes to make it, on office, conference, sponza and dragon. To wait for so many never
// costs more than twice what the best choice does.
constexpr double RAYS_PER_REFERENCE = 2;

} // namespace

const WideTree &Widening::make(const KdTree &tree) {
    const std::lock_guard lock(mutex_);
    if (!owned_) {
        owned_ = std::make_unique<const WideTree>(make_wide_tree(tree));
        tree_.store(owned_.get(), std::memory_order_release);
    }
    return *owned_;
}

void Widening::make_for(const KdTree &tree, uint64_t rays) {
    // A lazy tree is wanted for what is not built.
    if (this->tree() || tree.growth)
        return;
    const uint64_t expected = missed_.load(std::memory_order_relaxed) + rays;
    if (double(expected) >= RAYS_PER_REFERENCE * double(tree.references.size()))
        make(tree);
}

} // namespace mlrt
