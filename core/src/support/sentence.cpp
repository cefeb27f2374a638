// SPDX-License-Identifier: BSD-3-Clause
#include "support/sentence.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <new>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>

#include "delassus/error.hpp"

namespace delassus {

namespace {

/// "[json.exception.parse_error.101] parse error at line 1, column 2: …" without what stands in brackets.
std::string of_json(std::string_view text) {
    if (const auto end = text.find("] "); text.starts_with('[') && end != std::string_view::npos)
        text.remove_prefix(end + 2);
    return fmt::format("not the JSON that belongs there: {}", text);
}

std::string of_files(const std::filesystem::filesystem_error& error) {
    std::string where = error.path1().string();
    if (!error.path2().empty()) where += fmt::format(" and {}", error.path2().string());
    return where.empty() ? error.code().message() : fmt::format("{}: {}", where, error.code().message());
}

}  // namespace

std::string sentence_of(const std::exception& error) {
    if (dynamic_cast<const Error*>(&error)) return error.what();
    if (dynamic_cast<const std::bad_alloc*>(&error)) return "out of memory";
    if (const auto* json = dynamic_cast<const nlohmann::json::exception*>(&error)) return of_json(json->what());
    if (const auto* files = dynamic_cast<const std::filesystem::filesystem_error*>(&error)) return of_files(*files);
    if (dynamic_cast<const std::length_error*>(&error))
        return fmt::format("a number of entries is beyond all memory ({})", error.what());
    if (dynamic_cast<const std::logic_error*>(&error))
        return fmt::format("an error of this program, which should be reported: {}", error.what());
    return error.what();
}

}  // namespace delassus
