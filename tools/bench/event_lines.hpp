// SPDX-License-Identifier: BSD-3-Clause
// The other end of a worker's pipe (bench/channel.hpp).
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "bench/json_text.hpp"

namespace delassus::bench {

/// Cuts the output of a worker into lines of JSON.
class EventLines {
public:
    explicit EventLines(std::function<void(const Json&)> on_line) : on_line_(std::move(on_line)) {}

    void add(std::string_view piece) {
        rest_ += piece;
        std::size_t begin = 0;
        for (std::size_t end; (end = rest_.find('\n', begin)) != std::string::npos; begin = end + 1) {
            const Json line = try_parse_ordered_json(std::string_view(rest_).substr(begin, end - begin));
            // Anything else comes from a plugin that found our channel: the row must not depend on it.
            if (line.is_object() && line.contains("event")) on_line_(line);
        }
        rest_.erase(0, begin);
    }

private:
    std::function<void(const Json&)> on_line_;
    std::string rest_;
};

}  // namespace delassus::bench
