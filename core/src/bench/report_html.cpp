// SPDX-License-Identifier: BSD-3-Clause
#include "bench/writers.hpp"
#include "support/library_location.hpp"
#include "support/text_file.hpp"

namespace delassus::bench {

namespace {

void replace_all(std::string& text, std::string_view what, std::string_view by) {
    for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
        text.replace(at, what.size(), by);
}

}  // namespace

std::filesystem::path report_parts() {
    return library_directory() / "delassus" / "report";
}

std::string html_text(const Comparison& comparison, const std::filesystem::path& parts) {
    std::string page = read_file(parts / "report.html");
    std::string data = json_text(comparison);
    replace_all(data, "<", "\\u003c");  // nothing in the data can end the element that holds it
    std::string charts = read_file(parts / "echarts.min.js");
    replace_all(charts, "</script", "<\\/script");
    // The data last: what it holds is not looked at for marks any more.
    replace_all(page, "@style@", read_file(parts / "report.css"));
    replace_all(page, "@script@", read_file(parts / "report.js"));
    const auto library = page.find("@library@");
    if (library != std::string::npos) page.replace(library, 9, charts);
    const auto place = page.find("@results@");
    if (place != std::string::npos) page.replace(place, 9, data);
    return page;
}

}  // namespace delassus::bench
