// Seconds that a piece of work takes: on the clock, and of all threads of the process.
#pragma once

#include <ctime>

namespace mlrt::bench {

struct Seconds {
    double wall = 0, cpu = 0;
};

class Stopwatch {
public:
    Seconds elapsed() const {
        return {now(CLOCK_MONOTONIC) - start_.wall,
                now(CLOCK_PROCESS_CPUTIME_ID) - start_.cpu};
    }

private:
    static double now(clockid_t clock) {
        timespec time{};
        clock_gettime(clock, &time);
        return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
    }

    Seconds start_{now(CLOCK_MONOTONIC), now(CLOCK_PROCESS_CPUTIME_ID)};
};

} // namespace mlrt::bench
