// SPDX-License-Identifier: BSD-3-Clause
// What keeps Python responsive and objects whole while the library works without Python's global lock (the GIL).
#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <optional>
#include <thread>

#include "delassus/error.hpp"

namespace delassus::python {

namespace py = pybind11;

/// Lets one thread at a time use an object of the library; others wait. A thread that has it and comes again (by the
/// handler of a signal) gets an Error. Lock it without the GIL: whoever has it may be waiting for that.
class Turn {
public:
    void lock() {
        refuse_again();
        mutex_.lock();
        holder_ = std::this_thread::get_id();
    }
    bool try_lock() {
        refuse_again();
        if (!mutex_.try_lock()) return false;
        holder_ = std::this_thread::get_id();
        return true;
    }
    void unlock() {
        holder_ = std::thread::id();
        mutex_.unlock();
    }

private:
    void refuse_again() const {
        if (holder_ == std::this_thread::get_id())
            throw Error("this object is at work in the same thread; wait until its call has returned");
    }
    std::mutex mutex_;
    std::atomic<std::thread::id> holder_;
};

/// What work returns, done without the GIL, one thread at a time.
template <typename Work>
auto in_turn(Turn& turn, const Work& work) {
    const py::gil_scoped_release without_gil;
    const std::scoped_lock lock(turn);
    return work();
}

/// Whether a signal whose handler raises, as Ctrl-C does, has come. Python's handlers run in its main thread only.
class Interrupts {
public:
    /// Asked without the GIL, as often as one likes; looks at most fifty times a second.
    bool came() {
        using namespace std::chrono_literals;
        if (raised_) return true;
        const auto now = std::chrono::steady_clock::now();
        if (now - looked_ < 20ms) return false;
        looked_ = now;
        const py::gil_scoped_acquire with_gil;
        if (PyErr_CheckSignals() == 0) return false;
        raised_.emplace();
        return true;
    }
    /// Throws what the handler raised, if it did. With the GIL.
    void rethrow() const {
        if (raised_) throw py::error_already_set(*raised_);
    }

private:
    std::chrono::steady_clock::time_point looked_ = std::chrono::steady_clock::now();
    std::optional<py::error_already_set> raised_;
};

}  // namespace delassus::python
