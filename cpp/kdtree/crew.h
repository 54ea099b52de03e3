// Who takes part in a loop: one thread, all threads of the pool, or those that wait for its
// result anyway.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>

namespace mlrt {

class Crew {
public:
    virtual ~Crew() = default;

    // Calls body(i) once for each i in [0, count), in any order.
    virtual void run(uint32_t count, const std::function<void(uint32_t)> &body) = 0;
};

// The calling thread alone.
Crew &one_thread();
// The threads of the pool. Not for use from within its tasks: a thread that waits for
// others takes up other tasks, which may need what it is about to finish.
Crew &all_threads();

// One thread that builds something, and those that cannot go on before it is there.
class WaitingCrew : public Crew {
public:
    void run(uint32_t count, const std::function<void(uint32_t)> &body) override;

    // Takes part in the loops of the thread that builds, until it calls finish().
    void help();
    void finish();

private:
    // Calls the body as long as there is something to do.
    void work(std::unique_lock<std::mutex> &lock);

    std::mutex mutex_;
    std::condition_variable changed_;
    const std::function<void(uint32_t)> *body_ = nullptr;
    uint32_t next_ = 0, count_ = 0, running_ = 0;
    std::exception_ptr error_;
    bool finished_ = false;
};

} // namespace mlrt
