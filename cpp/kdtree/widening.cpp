#include "kdtree/widening.h"

#include "kdtree/tree.h"
#include "kdtree/wide_maker.h"

#include <new>
#include <stdexcept>

namespace mlrt {

namespace {

// Rays for each reference of the kd-tree whose saving is about what the wide tree takes to
// make: estimated from bounces in conference and sponza. If it were exact, to wait for so
// many would never cost more than twice what the best choice does.
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
    if (this->tree() || tree.growth || has_no_room_)
        return;
    const uint64_t expected = missed_.load(std::memory_order_relaxed) + rays;
    const double enough = RAYS_PER_REFERENCE * double(tree.references.size());
    if (double(expected) < enough)
        return;
    // Rays find the same hits without it.
    try {
        make(tree);
    } catch (const std::bad_alloc &) {
        has_no_room_ = true;
    } catch (const std::length_error &) {
        has_no_room_ = true;
    }
}

} // namespace mlrt
