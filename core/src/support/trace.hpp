// SPDX-License-Identifier: BSD-3-Clause
// DELASSUS_TRACE=FILE: what the time goes to, span by span, in the format of Chrome's and Perfetto's viewers.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "delassus/export.hpp"

namespace delassus {

/// Whether a trace is written.
DELASSUS_API bool is_traced();

/// A span of time of this thread, from its making to its end, on the clock of phases (sdk/cost.hpp). Spans within it
/// are drawn below it. Costs one look at a flag where nothing is traced.
class TraceSpan {
public:
    /// kind: "step", "solve", "plugin".
    TraceSpan(std::string_view kind, std::string_view name) {
        if (is_traced()) begin(kind, name);
    }
    ~TraceSpan() {
        if (on_) end();
    }
    TraceSpan(const TraceSpan&) = delete;
    TraceSpan& operator=(const TraceSpan&) = delete;

    /// What a viewer shows of the span; not finite: left out.
    void say(std::string_view key, double value) {
        if (on_) add(key, value);
    }
    void say(std::string_view key, std::string_view value) {
        if (on_) add(key, value);
    }

private:
    DELASSUS_API void begin(std::string_view kind, std::string_view name);
    DELASSUS_API void add(std::string_view key, double value);
    DELASSUS_API void add(std::string_view key, std::string_view value);
    DELASSUS_API void end() noexcept;

    bool on_ = false;
    std::chrono::steady_clock::time_point begin_;
    std::string kind_, name_, said_;
};

}  // namespace delassus
