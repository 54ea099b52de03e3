// What the calling thread looks after while the core works: progress and Ctrl-C.
#pragma once

#include <chrono>
#include <nanobind/nanobind.h>
#include <optional>

namespace mlrt {

// Looks for Ctrl-C and reports progress, at most about ten times a second. Runs on the
// thread that called render; remembers an exception until that thread holds the interpreter
// again.
class Watch {
public:
    explicit Watch(nanobind::object progress = nanobind::none())
        : progress_(std::move(progress)) {}

    bool operator()(float done = 0) {
        constexpr double PERIOD = 0.1; // seconds
        if (error_)
            return true;
        if (std::chrono::duration<double>(Clock::now() - last_).count() < PERIOD)
            return false;
        const nanobind::gil_scoped_acquire gil;
        last_ = Clock::now();
        try {
            if (PyErr_CheckSignals() != 0)
                throw nanobind::python_error();
            if (!progress_.is_none())
                progress_(done);
        } catch (nanobind::python_error &error) {
            error_.emplace(std::move(error));
        }
        return error_.has_value();
    }

    void rethrow() {
        if (error_)
            throw std::move(*error_);
    }

private:
    using Clock = std::chrono::steady_clock;

    nanobind::object progress_;
    Clock::time_point last_ = Clock::now();
    std::optional<nanobind::python_error> error_;
};

} // namespace mlrt
