#include "kdtree/crew.h"

#include "base/parallel.h"

#include <utility>

namespace mlrt {

namespace {

class OneThread : public Crew {
public:
    void run(uint32_t count, const std::function<void(uint32_t)> &body) override {
        for (uint32_t i = 0; i < count; ++i)
            body(i);
    }
};

class AllThreads : public Crew {
public:
    void run(uint32_t count, const std::function<void(uint32_t)> &body) override {
        parallel_for(count, body);
    }
};

} // namespace

Crew &one_thread() {
    static OneThread crew;
    return crew;
}

Crew &all_threads() {
    static AllThreads crew;
    return crew;
}

void WaitingCrew::run(uint32_t count, const std::function<void(uint32_t)> &body) {
    std::unique_lock lock(mutex_);
    body_ = &body;
    next_ = 0;
    count_ = count;
    changed_.notify_all();
    work(lock);
    changed_.wait(lock, [&] { return running_ == 0; });
    body_ = nullptr;
    if (error_)
        std::rethrow_exception(std::exchange(error_, nullptr));
}

void WaitingCrew::help() {
    std::unique_lock lock(mutex_);
    while (!finished_) {
        work(lock);
        changed_.wait(lock, [&] { return finished_ || (body_ && next_ < count_); });
    }
}

void WaitingCrew::finish() {
    const std::lock_guard lock(mutex_);
    finished_ = true;
    changed_.notify_all();
}

void WaitingCrew::work(std::unique_lock<std::mutex> &lock) {
    while (body_ && next_ < count_) {
        const uint32_t i = next_++;
        const auto &body = *body_;
        ++running_;
        lock.unlock();
        std::exception_ptr error;
        try {
            body(i);
        } catch (...) {
            error = std::current_exception();
        }
        lock.lock();
        if (error) {
            error_ = error;
            next_ = count_;
        }
        if (--running_ == 0 && next_ >= count_)
            changed_.notify_all();
    }
}

} // namespace mlrt
