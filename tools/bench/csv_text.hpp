// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace delassus::bench {

/// A field by RFC 4180.
inline std::string csv_field(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string field = "\"";
    for (const char c : text) field += c == '"' ? std::string("\"\"") : std::string(1, c);
    return field + '"';
}

/// The shortest digits that read back as the same number; empty where it is not known.
inline std::string csv_number(double value) {
    return std::isfinite(value) ? fmt::format("{}", value) : "";
}

}  // namespace delassus::bench
