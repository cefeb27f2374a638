// SPDX-License-Identifier: BSD-3-Clause
// A solver that a plugin has made, and what both ways of solving with it share: the clock and the names of statuses.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <exception>
#include <memory>
#include <string>

#include "delassus/registry.hpp"
#include "delassus/solver.hpp"
#include "support/process_record.hpp"
#include "support/sentence.hpp"

namespace delassus {

/// Curve samples are spaced by this factor in time.
constexpr double sample_spacing = 1.02;

/// A stopwatch that can be stopped while the host does work of its own.
class Stopwatch {
public:
    using Clock = std::chrono::steady_clock;

    void start() {
        begin_ = Clock::now();
        running_ = true;
    }
    void stop() {
        if (running_) seconds_ += std::chrono::duration<double>(Clock::now() - begin_).count();
        running_ = false;
    }
    [[nodiscard]] double seconds() const { return seconds_; }

private:
    Clock::time_point begin_;
    double seconds_ = 0.0;
    bool running_ = false;
};

/// Seconds after which a solver that has a time limit, and shows no sign of life, counts as hung.
[[nodiscard]] inline double limit_of_calls(const SolveSettings& settings) {
    return settings.time_limit + std::max(2.0, settings.time_limit);
}

[[nodiscard]] Status status_of(std::int32_t raw);

/// Makes a solver with its options, and destroys it.
class PluginInstance {
public:
    /// Throws InputError on a bad option, or if the plugin cannot make a solver.
    PluginInstance(std::shared_ptr<const Plugin> plugin, const OptionTexts& chosen);
    ~PluginInstance();
    PluginInstance(const PluginInstance&) = delete;
    PluginInstance& operator=(const PluginInstance&) = delete;

    [[nodiscard]] const PluginInfo& info() const { return plugin_->info(); }
    [[nodiscard]] const delassus_plugin_descriptor& border() const { return plugin_->descriptor(); }
    /// "the solver pgs"
    [[nodiscard]] const std::string& who() const { return who_; }
    [[nodiscard]] void* get() const { return solver_; }

    /// Runs an operation of the plugin. Exceptions are not allowed through the border, but a plugin that throws all the
    /// same must not take the host down. limit: as of ForeignCall.
    template <class Operation>
    std::int32_t guarded(const char* name, Operation&& operation, double limit = ForeignCall::patience) {
        const ForeignCall call(who_, std::string("in ") + name, limit);
        return guarded(operation);
    }
    /// The same for what notes its call itself.
    template <class Operation>
    std::int32_t guarded(Operation&& operation) {
        thrown_.clear();
        try {
            return operation();
        } catch (const std::exception& error) {
            thrown_ = fmt::format("it threw an exception through the plugin border: {}", sentence_of(error));
        } catch (...) {
            thrown_ = "it threw an exception through the plugin border";
        }
        return DELASSUS_ERROR;
    }
    /// What the last guarded operation threw; empty if nothing.
    [[nodiscard]] const std::string& thrown() const { return thrown_; }
    /// One sentence on the last failure.
    [[nodiscard]] std::string last_error() const;

private:
    std::shared_ptr<const Plugin> plugin_;
    std::string who_;
    void* solver_ = nullptr;
    std::string thrown_;
};

}  // namespace delassus
