#include "kdtree/widening.h"

#include "kdtree/tree.h"
#include "kdtree/wide_maker.h"

#include <chrono>
#include <new>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

namespace mlrt {

namespace {

// Rays for each reference of the kd-tree whose saving is about what the wide tree takes to
// make: estimated from bounces in conference and sponza. If it were exact, to wait for so
// many would never cost more than twice what the best choice does.
constexpr double RAYS_PER_REFERENCE = 2;

} // namespace

const WideTree *Widening::make(const KdTree &tree, const std::function<bool()> &cancelled) {
    std::unique_lock lock(mutex_, std::try_to_lock);
    while (!lock.owns_lock()) {
        if (cancelled && cancelled())
            return nullptr;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        lock.try_lock();
    }
    if (!owned_) {
        std::optional<WideTree> made = make_wide_tree(tree, cancelled);
        if (!made)
            return nullptr;
        owned_ = std::make_unique<const WideTree>(std::move(*made));
        tree_.store(owned_.get(), std::memory_order_release);
    }
    return owned_.get();
}

bool Widening::make_for(const KdTree &tree, uint64_t rays,
                        const std::function<bool()> &cancelled) {
    // A lazy tree is wanted for what is not built.
    if (this->tree() || tree.growth || has_no_room_)
        return true;
    const uint64_t expected = missed_.load(std::memory_order_relaxed) + rays;
    const double enough = RAYS_PER_REFERENCE * double(tree.references.size());
    if (double(expected) < enough)
        return true;
    // Rays find the same hits without it.
    try {
        return make(tree, cancelled) != nullptr;
    } catch (const std::bad_alloc &) {
        has_no_room_ = true;
    } catch (const std::length_error &) {
        has_no_room_ = true;
    }
    return true;
}

} // namespace mlrt
