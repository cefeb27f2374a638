// SPDX-License-Identifier: BSD-3-Clause
// The page: whole in one file, and drawn by a browser.
// g++ 12 with sanitizers sees uninitialised members inside std::regex.
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"

#include <cmath>
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

    [[nodiscard]] static bench::Comparison comparison_here() {
        bench::Comparison comparison;
        comparison.created = "2024-01-02T03:04:05Z";
        comparison.machine = bench::this_machine();
        comparison.build = bench::this_build();
        return comparison;
    }

    /// Solvers of these labels that all solve one problem, each with a curve of its own.
    [[nodiscard]] static std::string page_of(const std::vector<std::string>& labels) {
        bench::Comparison comparison = comparison_here();
        bench::ProblemResults problem;
        problem.facts = {"pile", "coulomb", "blocks", 6, 3, {{"friction", 1}}};
        for (const auto& label : labels) {
            bench::Measurement row;
            row.label = label;
            row.status = "solved";
            row.error = Errors{};
            const double slow = 1.0 + static_cast<double>(problem.results.size());
            for (int k = 0; k <= 20; ++k)
                row.curve.push_back({k, 1e-4 * slow * k, std::pow(10.0, -0.2 * k - 0.1 * slow)});
            problem.results.push_back(row);
        }
        comparison.problems = {problem};
        return bench::html_text(comparison);
    }

    /// Opens the page with a script at its end.
    [[nodiscard]] tests::Browsed open(std::string text, const std::string& script,
                                      std::vector<std::string> flags = {}) const {
        text.insert(text.rfind("</body>"), "<script>{" + script + "}</script>");
        std::ofstream(folder / "report.html", std::ios::binary) << text;
        flags.emplace_back("--disable-gpu");
        return tests::open_in_browser(folder / "report.html", folder / "profile", flags);
    }

    /// A comparison with every kind of row, and names that would break a page that trusts them.
    [[nodiscard]] std::string page() const {
        bench::Comparison comparison = comparison_here();
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
    // A mouse over the middle of the first curve, as a reader would have it.
    const auto run = open(page(),
                          "const chart = echarts.getInstanceByDom(document.querySelector('.chart'));"
                          "const [x, y] = chart.convertToPixel({seriesIndex: 0}, [1e-4, 1e-3]);"
                          "chart.getZr().handler.dispatch('mousemove', {zrX: x + 2, zrY: y});");
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

const std::vector<std::string> thirteen = {"auto",  "admm", "apgd", "cholmod", "ipm",     "minres",        "mumps",
                                           "petsc", "pgs",  "spg",  "ssn",     "siconos", "pgs(omega=1.2)"};

TEST_F(ReportTest, ThirteenSolversHaveThirteenLines) {
    if (!tests::has_browser()) GTEST_SKIP() << "chromium is not installed";
    // In the options of the chart, in its picture, in the picture's legend and in the table; then those without options
    // alone, as on another page; then very many.
    const auto run = open(page_of(thirteen),
                          "const root = document.documentElement, look = (path) => path.getAttribute('stroke') + ' ' + "
                          "(path.getAttribute('stroke-dasharray') || 'none').replaceAll(',', ' ');"
                          "const all = (selector) => [...document.querySelectorAll(selector)];"
                          "const chart = echarts.getInstanceByDom(document.querySelector('.chart'));"
                          "const lines = chart.getOption().series.filter((one) => one.name !== 'tolerance');"
                          "root.dataset.pairs = new Set(lines.map((one) => one.color + ' ' + one.lineStyle.type)).size;"
                          "chart.getZr().flush();"
                          "root.dataset.drawn = new Set(all('.chart path[stroke-width=\"1.8\"]').map(look)).size;"
                          "root.dataset.legend = new Set(all('.chart path[stroke-width=\"2\"]').map(look)).size;"
                          "root.dataset.swatches = new Set(all('td .swatch path').map(look)).size;"
                          "const text = (name, names) => JSON.stringify(lineStyles(names).get(name));"
                          "const names = lines.map((one) => one.name);"
                          "root.dataset.alone = names.filter((name) => !name.includes('(') && text(name, [name]) === "
                          "text(name, names)).length;"
                          "const many = Array.from({length: 100}, (_, k) => `pgs(omega=${k})`);"
                          "root.dataset.many = new Set(many.map((name) => text(name, many))).size;");
    ASSERT_FALSE(run.timed_out);
    const std::string head = run.dom.substr(0, 600);
    for (const char* fact : {"data-pairs=\"13\"", "data-drawn=\"13\"", "data-legend=\"13\"", "data-swatches=\"13\"",
                             "data-alone=\"12\"", "data-many=\"100\""})
        EXPECT_NE(head.find(fact), std::string::npos) << fact << head << run.log;
}

TEST_F(ReportTest, LinesDifferForColourBlindReaders) {
    if (!tests::has_browser()) GTEST_SKIP() << "chromium is not installed";
    // Homes with the same dash, as they are and as Machado, Oliveira and Fernandes (2009) simulate the three kinds of
    // blindness: the least CIE76 distance of their colours.
    const auto run = open(
        page_of({"pgs"}),
        "const sights = [[1,0,0, 0,1,0, 0,0,1],"
        "[0.152286,1.052583,-0.204868, 0.114503,0.786281,0.099216, -0.003882,-0.048116,1.051998],"
        "[0.367322,0.860646,-0.227968, 0.280085,0.672501,0.047413, -0.011820,0.042940,0.968881],"
        "[1.255528,-0.076749,-0.178779, -0.078411,0.930809,0.147602, 0.004733,0.691367,0.303900]];"
        "const linear = (c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);"
        "const rgb = (hex) => [1, 3, 5].map((k) => linear(parseInt(hex.slice(k, k + 2), 16) / 255));"
        "const times = (m, v) => [0, 1, 2].map((i) => m[3 * i] * v[0] + m[3 * i + 1] * v[1] + m[3 * i + 2] * v[2]);"
        "const root3 = (t) => (t > 0.008856 ? Math.cbrt(t) : 7.787 * t + 16 / 116);"
        "const lab = (v) => { const [x, y, z] = times([0.4124,0.3576,0.1805, 0.2126,0.7152,0.0722, "
        "0.0193,0.1192,0.9505], v.map((c) => Math.min(1, Math.max(0, c))));"
        "const [a, b, c] = [x / 0.95047, y, z / 1.08883].map(root3); return [116 * b, 500 * (a - b), 200 * (b - c)]; };"
        "const apart = (one, other, sight) => { const [a, b] = [one, other].map((home) => lab(times(sight, "
        "rgb(home.colour)))); return Math.hypot(...a.map((v, k) => v - b[k])); };"
        "let least = Infinity, pairs = 0; for (const one of homes) for (const other of homes)"
        "if (one !== other && one.dash === other.dash) { ++pairs;"
        "for (const sight of sights) least = Math.min(least, apart(one, other, sight)); }"
        "const root = document.documentElement; root.dataset.least = least.toFixed(1); root.dataset.far = least > 20;"
        "root.dataset.compared = pairs > 0; root.dataset.red = apart({colour: '#ff0000'}, {colour: '#00ff00'}, "
        "sights[0]).toFixed(0);");
    ASSERT_FALSE(run.timed_out);
    const std::string head = run.dom.substr(0, 600);
    for (const char* fact : {"data-far=\"true\"", "data-compared=\"true\"", "data-red=\"171\""})
        EXPECT_NE(head.find(fact), std::string::npos) << fact << head << run.log;
}

}  // namespace
}  // namespace delassus::bench_test::report_test
