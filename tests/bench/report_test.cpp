// SPDX-License-Identifier: BSD-3-Clause
// The page: whole in one file, and drawn by a browser.
// g++ 12 with sanitizers sees uninitialised members inside std::regex.
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"

#include <regex>

#include "bench/compare.hpp"
#include "bench/writers.hpp"
#include "bench_fixture.hpp"
#include "support/browser.hpp"
#include "support/html_page.hpp"

namespace delassus::bench_test::report_test {
namespace {

using Json = nlohmann::json;

class ReportTest : public BenchTest {
protected:
    void SetUp() override {
        BenchTest::SetUp();
        if (!fs::exists(page_parts() / "echarts.min.js"))
            GTEST_SKIP() << "built without the chart library, so no page is written";
    }

    /// A comparison with every kind of row, and names that would break a page that trusts them.
    [[nodiscard]] std::string page() const {
        bench::Comparison comparison;
        comparison.created = "2024-01-02T03:04:05Z";
        comparison.machine = bench::this_machine();
        comparison.build = bench::this_build();
        comparison.command = "delassus compare '</script><b>'";
        bench::ProblemResults problem;
        problem.facts = {"<img src=x onerror=alert(1)>", "coulomb", "blocks", 6, 3, {{"friction", 1}}};
        for (const char* status : {"solved", "crashed", "hung", "time_limit", "unsupported"}) {
            bench::Measurement row;
            row.label = std::string("solver-") + status;
            row.status = status;
            row.message = status == std::string("unsupported") ? "it cannot </script> solve" : "";
            if (row.status != "unsupported")
                row.curve = {{0, 0.0, 1.0}, {10, 1e-4, 1e-3}, {20, 2e-3, row.status == "solved" ? 0.0 : 1e-4}};
            if (row.status == "solved") row.error = Errors{};
            problem.results.push_back(row);
        }
        comparison.problems = {problem, problem};
        return bench::html_text(comparison);
    }
};

TEST_F(ReportTest, NeedsNothingFromElsewhere) {
    const std::string text = page();
    const auto begin = text.find("<script type=\"application/json\"");
    const auto library = text.find("<script>", begin);
    ASSERT_NE(library, std::string::npos);
    const auto own = text.find("<script>\n// SPDX", library);
    // All but the chart library, whose text holds names of namespaces and licences.
    const std::string ours = text.substr(0, library) + text.substr(own);
    tests::expect_nothing_from_elsewhere(ours);
    EXPECT_NE(text.find("Licensed to the Apache Software Foundation"), std::string::npos);
    for (const char* mark : {"@report.css@", "@common.js@", "@report.js@", "@echarts.min.js@", "@data@"})
        EXPECT_EQ(text.find(mark), std::string::npos) << mark;
}

TEST_F(ReportTest, HoldsTheData) {
    const std::string text = page();
    const std::string opening = "<script type=\"application/json\" id=\"results\">";
    const auto begin = text.find(opening) + opening.size();
    const Json json = Json::parse(text.substr(begin, text.find("</script>", begin) - begin));
    EXPECT_EQ(json["command"], "delassus compare '</script><b>'");
    EXPECT_EQ(json["problems"][0]["results"].size(), 5U);
    EXPECT_EQ(json["problems"][0]["results"][0]["curve"]["samples"][1][1], 1e-4);
}

TEST_F(ReportTest, IsDrawnByABrowser) {
    if (!tests::has_browser()) GTEST_SKIP() << "chromium is not installed";
    {
        std::ofstream stream(folder / "report.html", std::ios::binary);
        // A mouse over the middle of the first curve, as a reader would have it.
        std::string text = page();
        text.insert(text.rfind("</body>"),
                    "<script>{const chart = echarts.getInstanceByDom(document.querySelector('.chart'));"
                    "const [x, y] = chart.convertToPixel({seriesIndex: 0}, [1e-4, 1e-3]);"
                    "chart.getZr().handler.dispatch('mousemove', {zrX: x + 2, zrY: y});}</script>");
        stream << text;
    }
    const auto run = tests::open_in_browser(folder / "report.html", folder / "profile", {"--disable-gpu"});
    ASSERT_FALSE(run.timed_out);
    const std::string head = run.dom.substr(0, 400);
    EXPECT_NE(head.find("data-charts-drawn=\"2\""), std::string::npos) << head << run.log;
    EXPECT_NE(head.find("data-series-drawn=\"8\""), std::string::npos) << head;
    EXPECT_NE(run.dom.find("iteration 10<br>0.000100 s<br>natural 1.00e-3"), std::string::npos);  // the hover
    EXPECT_NE(run.dom.find("<svg"), std::string::npos);
    EXPECT_NE(run.dom.find("solver-hung: hung"), std::string::npos);  // the marker at a curve's end
    EXPECT_EQ(run.dom.find("<img src=\"x\""), std::string::npos);     // names are text, never markup
    EXPECT_NE(run.dom.find("<li>it cannot &lt;/script&gt; solve</li>"), std::string::npos);
}

}  // namespace
}  // namespace delassus::bench_test::report_test
