// SPDX-License-Identifier: BSD-3-Clause
#include "bench/writers.hpp"
#include "support/html_page.hpp"

namespace delassus::bench {

std::string html_text(const Comparison& comparison) {
    return html_page(page_parts(), "report.html", json_text(comparison));
}

}  // namespace delassus::bench
