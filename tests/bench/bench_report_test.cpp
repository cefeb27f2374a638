// SPDX-License-Identifier: BSD-3-Clause
// The report of a suite in a browser: its charts, its switches, its red rows.
// g++ 12 with sanitizers sees uninitialised members inside std::regex.
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"

#include "bench_fixture.hpp"
#include "support/browser.hpp"
#include "support/html_page.hpp"
#include "support/places.hpp"

namespace delassus::bench_test::bench_report_test {
namespace {

class BenchReport : public BenchTest {
protected:
    void SetUp() override {
        BenchTest::SetUp();
        if (!fs::exists(page_parts() / "echarts.min.js"))
            GTEST_SKIP() << "built without the chart library, so no page is written";
        std::ofstream(folder / "pendulum.yaml")
            << content_of(fs::path(tests::places::source) / "examples/scenes/pendulum.yaml");
        const auto run = run_suite(suite(
            "title: <img src=x onerror=alert(1)>\n"
            "problems: [stops, {generate: sphere_pile, set: {contacts: [10, 30, 90]}}]\n"
            "solvers: [misbehaving, misbehaving(behaviour=lie), misbehaving(behaviour=crash), apgd, pgs]\n"
            "tolerances: [1e-3, 1e-6]\n"
            "scenes: [{path: pendulum.yaml, end: 0.1, steps: [0.02, 0.01]}]\n"
            "timesteppers: [hht]\n"
            "leaving_out: [{path: pendulum.yaml, end: 0.1}]\n"
            "repeats: 1\n"
            "axes:\n"
            "  - {name: boxes, title: boxes of <b>stone</b>, generate: box_stack, set: {boxes: $(value)}, values: [1, "
            "3],\n"
            "     bounds: {speed: 1e-6}, reason: they rest, solvers: [apgd, minres]}\n"
            "  - {name: tight, scene: pendulum.yaml, set: {step: $(value)}, values: [0.01], bounds: {speed: 0}}\n"));
        ASSERT_EQ(run.exit_code, 0) << run.errors;
        page = content_of(folder / "out" / "report.html");
    }

    /// Opens the page with a script at its end.
    [[nodiscard]] tests::Browsed open(const std::string& script, const std::vector<std::string>& flags = {}) const {
        std::string text = page;
        text.insert(text.rfind("</body>"), "<script>{" + script + "}</script>");
        std::ofstream(folder / "open.html", std::ios::binary) << text;
        auto all = flags;
        all.emplace_back("--disable-gpu");
        return tests::open_in_browser(folder / "open.html", folder / "profile", all);
    }

    std::string page;
};

TEST_F(BenchReport, IsWholeInOneFile) {
    const auto data = page.find("<script type=\"application/json\"");
    const auto library = page.find("<script>", data);
    const auto own = page.find("<script>\n// SPDX", library);
    ASSERT_NE(own, std::string::npos);
    tests::expect_nothing_from_elsewhere(page.substr(0, data) + page.substr(own));
    for (const char* mark : {"@bench.css@", "@bench.js@", "@bench_scenes.js@", "@bench_axes.js@", "@data@"})
        EXPECT_EQ(page.find(mark), std::string::npos) << mark;
}

TEST_F(BenchReport, IsDrawnAndFollowsItsSwitches) {
    if (!tests::has_browser()) GTEST_SKIP() << "chromium is not installed";
    // Before and after a click on the switch of apgd: how many series the first problem's chart has. Then the velocity.
    const auto run = open(
        "charts.forEach((entry) => { if (!entry.chart) entry.draw(); });"
        "const chart = () => document.querySelector('#problem-2 .chart').chart.chart.getOption().series.filter((s) => "
        "s.name === 'apgd').length;"
        "const root = document.documentElement; root.dataset.before = chart();"
        "const button = [...document.querySelectorAll('#legend button')].find((one) => one.dataset.name === 'apgd');"
        "button.scrollIntoView(); const {left, top} = button.getBoundingClientRect();"
        "document.elementFromPoint(left + 6, top + 6).dispatchEvent(new MouseEvent('click', {bubbles: true}));"
        "root.dataset.after = chart(); root.dataset.pressed = button.getAttribute('aria-pressed');"
        "button.click(); root.dataset.again = chart();"
        "const box = document.querySelector('#problem-2 .tools select'); const axis = (begin) => {"
        "box.selectedIndex = [...box.options].findIndex((one) => one.textContent.startsWith(begin));"
        "box.dispatchEvent(new Event('change'));"
        "return document.querySelector('#problem-2 .chart').chart.chart.getOption().yAxis[0].name; };"
        "root.dataset.axis = axis('velocity'); root.dataset.dual = axis('dual');");
    ASSERT_FALSE(run.timed_out);
    const std::string head = run.dom.substr(0, 600);
    for (const char* fact : {"data-before=\"1\"", "data-after=\"0\"", "data-pressed=\"false\"", "data-again=\"1\"",
                             "data-axis=\"velocity error\"", "data-dual=\"dual error\""})
        EXPECT_NE(head.find(fact), std::string::npos) << fact << head << run.log;
    EXPECT_NE(run.dom.find("<tr class=\"lie\">"), std::string::npos);  // a false claim is a red row
    EXPECT_NE(run.dom.find("<span class=\"status false_claim\">false claim</span>"), std::string::npos);
    EXPECT_NE(run.dom.find("<span class=\"status crashed\">crashed</span>"), std::string::npos);
    EXPECT_NE(run.dom.find("id=\"growth\""), std::string::npos);
    EXPECT_NE(run.dom.find("collision detection"), std::string::npos);  // the plan of the scene
    EXPECT_EQ(run.dom.find("<img src=\"x\""), std::string::npos);       // names are text, never markup
    EXPECT_NE(run.dom.find("<svg"), std::string::npos);
}

TEST_F(BenchReport, TwoSolversAreChosen) {
    if (!tests::has_browser()) GTEST_SKIP() << "chromium is not installed";
    // By hand: two against each other on three problems, of which one has 2 s and 1 s, one 1 s and none, one none and
    // none.
    const auto run = open(
        "const root = document.documentElement, made = document.querySelector('#class-associated .pair');"
        "const row = (problem, label, time) => ({problem, law: '', label, cause: time ? '' : 'stalled', seconds: "
        "{setup: 0, solve: time}});"
        "const pairs = pairTimes([row('a', 'x', 2), row('a', 'y', 1), row('b', 'x', 1), row('b', 'y', null), row('c', "
        "'x', null),"
        "row('c', 'y', null)], 'x', 'y');"
        "root.dataset.pairs = pairs.length; root.dataset.x = ratiosOf(pairs, 'x', 'y').join(' ');"
        "root.dataset.y = ratiosOf(pairs, 'y', 'x').join(' '); root.dataset.says = pairText(pairs, 'x', 'y');"
        "const place = made.querySelector('.chart'); place.chart.draw();"
        "const names = () => place.chart.chart.getOption().series.map((one) => one.name).sort().join(' ');"
        "const [one, other] = made.querySelectorAll('select'); root.dataset.first = names();"
        "const choose = (box, name) => { box.selectedIndex = [...box.options].findIndex((option) => option.textContent "
        "=== name);"
        "box.dispatchEvent(new Event('change')); }; choose(one, 'pgs'); choose(other, 'apgd');"
        "root.dataset.chosen = names(); root.dataset.caption = made.querySelector('h4').textContent;");
    ASSERT_FALSE(run.timed_out);
    const std::string head = run.dom.substr(0, 1200);
    for (const char* fact : {"data-pairs=\"2\"", "data-x=\"1 2\"", "data-y=\"1\"", "x is faster on 0, y on 1",
                             "ratio of their times is 2.00. Only x solves 1, only y 0.", "data-chosen=\"apgd pgs\"",
                             "data-first=\"", "data-caption=\"pgs against apgd, to 1e-6\""})
        EXPECT_NE(head.find(fact), std::string::npos) << fact << head << run.log;
}

TEST_F(BenchReport, ShowsWhatLeavingOutSaves) {
    if (!tests::has_browser()) GTEST_SKIP() << "chromium is not installed";
    const auto run = open(
        "const root = document.documentElement, made = document.querySelector('#leaving-out');"
        "made.querySelectorAll('.chart').forEach((place) => place.chart.draw());"
        "root.dataset.bars = [...made.querySelectorAll('.chart')].map((place) => "
        "place.chart.chart.getOption().series.flatMap((one) => "
        "one.data.map(({value}) => value > 0)).join(' ')).join('; ');"
        "root.dataset.cells = made.querySelectorAll('tbody td').length;"
        "root.dataset.more = made.textContent.includes('delassus_collision');");
    ASSERT_FALSE(run.timed_out);
    const std::string head = run.dom.substr(0, 800);
    for (const char* fact :
         {"data-bars=\"true true; true true; true true; true true\"", "data-cells=\"10\"", "data-more=\"true\""})
        EXPECT_NE(head.find(fact), std::string::npos) << fact << head << run.log;
}

TEST_F(BenchReport, AxesAreHeatMaps) {
    if (!tests::has_browser()) GTEST_SKIP() << "chromium is not installed";
    const auto run = open(
        "const root = document.documentElement, cells = [...document.querySelectorAll('#axis-1 table.heat tbody td')];"
        "root.dataset.cells = cells.map((cell) => cell.className.split(' ')[1]).join(' ');"
        "root.dataset.signs = cells.every((cell) => cell.firstChild.textContent.length === 1);"
        "root.dataset.columns = [...document.querySelectorAll('#axis-1 table.heat thead th')].slice(1).map((one) => "
        "one.textContent).join(' ');"
        "root.dataset.says = cells[2].title.includes('minres at 1: refused');"
        "root.dataset.beyond = document.querySelector('#axis-2 td.inaccurate').title.includes('bound 0');"
        "root.dataset.stone = document.querySelectorAll('#axis-1 h2 b').length;"
        "root.dataset.colours = new Set(cells.map((cell) => getComputedStyle(cell).backgroundColor)).size;");
    ASSERT_FALSE(run.timed_out);
    const std::string head = run.dom.substr(0, 800);
    for (const char* fact :
         {"data-cells=\"correct correct refused refused\"", "data-signs=\"true\"", "data-columns=\"1 3\"",
          "data-says=\"true\"", "data-beyond=\"true\"", "data-stone=\"0\"", "data-colours=\"2\""})
        EXPECT_NE(head.find(fact), std::string::npos) << fact << head << run.log;
}

TEST_F(BenchReport, LinesAreThoseOfOtherPages) {
    if (!tests::has_browser()) GTEST_SKIP() << "chromium is not installed";
    const auto run = open(
        "const root = document.documentElement, look = (name) => { const path = [...document.querySelectorAll('#legend "
        "button')].find((one) => one.dataset.name === name).querySelector('.swatch path');"
        "return path.getAttribute('stroke') + path.getAttribute('stroke-dasharray'); };"
        "root.dataset.solvers = solverLabels.length; root.dataset.looks = new Set(solverLabels.map(look)).size;"
        "const alone = (name) => { const {colour, dash} = lineStyles([name]).get(name);"
        "return colour + (dash.join(' ') || 'none'); };"
        "root.dataset.same = ['apgd', 'pgs', 'hht'].every((name) => look(name) === alone(name));");
    ASSERT_FALSE(run.timed_out);
    const std::string head = run.dom.substr(0, 600);
    for (const char* fact : {"data-solvers=\"5\"", "data-looks=\"5\"", "data-same=\"true\""})
        EXPECT_NE(head.find(fact), std::string::npos) << fact << head << run.log;
}

TEST_F(BenchReport, AScreenshotShowsIt) {
    if (!tests::has_browser()) GTEST_SKIP() << "chromium is not installed";
    const auto shot = folder / "report.png", blank = folder / "blank.png";
    const auto drawn = open("", {"--window-size=1200,3000", "--screenshot=" + shot.string()});
    const auto empty =
        open("document.body.replaceChildren();", {"--window-size=1200,3000", "--screenshot=" + blank.string()});
    ASSERT_FALSE(drawn.timed_out || empty.timed_out);
    ASSERT_TRUE(fs::exists(shot) && fs::exists(blank)) << drawn.log;
    EXPECT_GT(fs::file_size(shot), 5 * fs::file_size(blank));
}

}  // namespace
}  // namespace delassus::bench_test::bench_report_test
