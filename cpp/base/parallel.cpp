#include "base/parallel.h"

#include "base/denormals.h"

#include <atomic>
#include <exception>
#include <mutex>
#include <nanothread/nanothread.h>

#ifdef __SANITIZE_THREAD__
#include <sanitizer/tsan_interface.h>
#endif

namespace mlrt {

namespace {

// The pool hands work over in an order that ThreadSanitizer cannot see, because the pool's
// library is not compiled with it.
void tell_of_release([[maybe_unused]] void *object) {
#ifdef __SANITIZE_THREAD__
    __tsan_release(object);
#endif
}
void tell_of_acquisition([[maybe_unused]] void *object) {
#ifdef __SANITIZE_THREAD__
    __tsan_acquire(object);
#endif
}

struct Job {
    const std::function<void(uint32_t)> *body;
    std::atomic<bool> stop{false};
    char begun = 0, done = 0; // only their addresses matter, to ThreadSanitizer
};

// What a thread does becomes visible to whoever waits for the job, also if it throws.
struct Part {
    Job &job;

    explicit Part(Job &of_job) : job(of_job) { tell_of_acquisition(&job.begun); }
    ~Part() { tell_of_release(&job.done); }
    Part(const Part &) = delete;
    Part &operator=(const Part &) = delete;
};

struct Completion {
    Job &job;

    explicit Completion(Job &of_job) : job(of_job) {}
    ~Completion() { tell_of_acquisition(&job.done); }
    Completion(const Completion &) = delete;
    Completion &operator=(const Completion &) = delete;
};

void run_one(uint32_t index, void *payload) {
    Job &job = *static_cast<Job *>(payload);
    const Part part(job);
    if (job.stop.load(std::memory_order_relaxed))
        return;
    KeepDenormals keep;
    (*job.body)(index);
}

} // namespace

bool parallel_for(uint32_t count, const std::function<void(uint32_t)> &body,
                  const std::function<bool()> &cancelled) {
    if (count == 0)
        return true;
    Job job{&body};
    tell_of_release(&job.begun);
    // Always through the queue: a job of one block would otherwise run inside the call, and
    // nobody could be asked whether to go on.
    Task *task = task_submit_dep(nullptr, nullptr, 0, count, run_one, &job, 0, nullptr, 1);
    if (cancelled) {
        struct Watch {
            Task *task;
            Job *job;
            const std::function<bool()> *cancelled;
        } watch{task, &job, &cancelled};
        // The pool asks between two pieces of work of the calling thread.
        pool_work_until(
            nullptr,
            [](void *payload) {
                Watch &w = *static_cast<Watch *>(payload);
                if (!w.job->stop.load(std::memory_order_relaxed) && (*w.cancelled)())
                    w.job->stop.store(true, std::memory_order_relaxed);
                return task_query(w.task);
            },
            &watch);
    }
    const Completion completion(job);
    task_wait_and_release(task);
    return !job.stop.load(std::memory_order_relaxed);
}

} // namespace mlrt
