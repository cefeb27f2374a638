// SPDX-License-Identifier: BSD-3-Clause
#include "support/html_page.hpp"

#include "support/library_location.hpp"
#include "support/text_file.hpp"

namespace delassus {
namespace {

/// Replaces each `what` in text by `by`.
std::string replaced(std::string_view text, std::string_view what, std::string_view by) {
    std::string result;
    for (;;) {
        const auto at = text.find(what);
        result += text.substr(0, at);
        if (at == std::string_view::npos) return result;
        result += by;
        text.remove_prefix(at + what.size());
    }
}

}  // namespace

std::filesystem::path page_parts() {
    return library_directory() / "delassus" / "pages";
}

std::string html_page(const std::filesystem::path& parts, const std::string& name, std::string_view json) {
    const std::string page = read_file(parts / name);
    std::string result;
    for (std::string_view rest = page;;) {
        const auto begin = rest.find('@');
        const auto end = begin == std::string_view::npos ? begin : rest.find('@', begin + 1);
        result += rest.substr(0, begin);
        if (end == std::string_view::npos) return result;
        const std::string mark(rest.substr(begin + 1, end - begin - 1));
        result += mark == "data" ? replaced(json, "<", "\\u003c")
                                 : replaced(read_file(parts / mark), "</script", "<\\/script");
        rest.remove_prefix(end + 1);
    }
}

}  // namespace delassus
