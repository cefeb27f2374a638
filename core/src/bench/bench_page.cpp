// SPDX-License-Identifier: BSD-3-Clause
#include "bench/bench_writers.hpp"
#include "support/html_page.hpp"

namespace delassus::bench {

std::string bench_page(const ResultSet& results, const Json& analysis) {
    Json session = results.session;
    session.erase("keys");
    const Json page = {{"session", session},           {"problems", results.problems},
                       {"references", results.references}, {"libraries", results.libraries},
                       {"scenes", results.scenes},     {"solves", results.solves},
                       {"simulations", results.simulations}, {"missing", results.missing},
                       {"analysis", analysis}};
    return html_page(page_parts(), "bench.html", text_of(page));
}

}  // namespace delassus::bench
