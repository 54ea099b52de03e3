// How a build ends before its time.
#pragma once

#include <atomic>
#include <functional>
#include <thread>

namespace mlrt {

// Unwinds a build that was cancelled.
struct Cancelled {};

// Asks whoever waits for the tree whether to go on; on the thread that waits, for only
// there may be asked.
class Interruption {
public:
    explicit Interruption(const std::function<bool()> &cancelled)
        : cancelled_(cancelled), asker_(std::this_thread::get_id()) {}

    bool operator()() const {
        if (!stop_.load(std::memory_order_relaxed) && cancelled_ &&
            std::this_thread::get_id() == asker_ && cancelled_())
            stop_.store(true, std::memory_order_relaxed);
        return stop_.load(std::memory_order_relaxed);
    }

    // Throws Cancelled.
    void check() const {
        if ((*this)())
            throw Cancelled();
    }

private:
    const std::function<bool()> &cancelled_;
    std::thread::id asker_;
    mutable std::atomic<bool> stop_{false};
};

} // namespace mlrt
