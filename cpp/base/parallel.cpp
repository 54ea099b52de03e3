#include "base/parallel.h"

#include "base/simd.h"

#include <atomic>
#include <exception>
#include <mutex>
#include <nanothread/nanothread.h>

namespace mlrt {

namespace {

struct Job {
    const std::function<void(uint32_t)> *body;
    std::atomic<bool> stop{false};
};

void run_one(uint32_t index, void *payload) {
    Job &job = **static_cast<Job **>(payload);
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
    Job *payload = &job;
    // Always through the queue: a job of one block would otherwise run inside the call, and
    // nobody could be asked whether to go on.
    Task *task = task_submit_dep(nullptr, nullptr, 0, count, run_one, &payload,
                                 sizeof(payload), nullptr, 1);
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
    task_wait_and_release(task);
    return !job.stop.load(std::memory_order_relaxed);
}

} // namespace mlrt
