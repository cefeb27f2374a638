// SPDX-License-Identifier: BSD-3-Clause
// `delassus view`: a page that plays a run, and what it says where it cannot.
// g++ 12 with sanitizers sees uninitialised members inside std::regex.
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/browser.hpp"
#include "support/html_page.hpp"
#include "support/run_command.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::view_test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class View : public ::testing::Test {
protected:
    void SetUp() override {
        if (!fs::exists(page_parts() / "three.min.js") || !fs::exists(page_parts() / "echarts.min.js"))
            GTEST_SKIP() << "built without the libraries of the pages";
    }

    /// Runs a scene into the folder `run`; arguments: more of the command's.
    [[nodiscard]] fs::path run_of(const std::string& scene, const std::string& arguments) const {
        const auto folder = scratch / "run";
        const auto result = run_command("run " + example_scene(scene) + " " + arguments + " -o " + folder.string());
        EXPECT_TRUE(fs::exists(folder / "report.json")) << result.err;
        return folder;
    }

    /// The data in a page.
    static Json data_of(const std::string& page) {
        const std::string opening = "<script type=\"application/json\" id=\"data\">";
        const auto begin = page.find(opening) + opening.size();
        return Json::parse(page.substr(begin, page.find("</script>", begin) - begin));
    }

    const ScratchFolder scratch;
};

/// How many bytes a base64 text stands for.
std::size_t bytes_of(const Json& text) {
    const auto& characters = text.get_ref<const std::string&>();
    const auto padding = characters.size() - characters.find_last_not_of('=') - 1;
    return characters.empty() ? 0 : characters.size() / 4 * 3 - padding;
}

TEST_F(View, WritesAPageOfARun) {
    const auto folder = run_of("slider_crank", "--end 0.05");
    const auto result = run_command("view " + folder.string());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.out.find("scene.html: "), std::string::npos) << result.out;
    EXPECT_NE(result.out.find("main: 51 of 51 frames, to t = 0.05 s\n"), std::string::npos) << result.out;
    const Json data = data_of(text_of(folder / "scene.html"));
    EXPECT_EQ(data["title"], "slider-crank");
    const Json& system = data["systems"][0];
    EXPECT_EQ(system["bodies"], Json({"crank", "rod", "slider"}));
    EXPECT_EQ(bytes_of(system["t"]), 51 * sizeof(double));
    EXPECT_EQ(bytes_of(system["poses"]), 51 * 3 * 7 * sizeof(float));
    EXPECT_EQ(system["links"].size(), 4u);
    EXPECT_EQ(system["links"][1]["kind"], "spherical");
    EXPECT_EQ(system["links"][1]["points"], Json({{0.05, 0.0, 0.0}, {-0.15, 0.0, 0.0}}));  // the crank's pin
    EXPECT_EQ(system["series"][0]["name"], "energy");
    // A new run replaces the folder, the page included.
    EXPECT_FALSE(fs::exists(run_of("pendulum", "--end 0.01") / "scene.html"));
}

TEST_F(View, NeedsNothingFromElsewhere) {
    const auto page = scratch / "page.html";
    ASSERT_EQ(run_command("view " + run_of("pendulum", "--end 0.01").string() + " -o " + page.string()).exit_code, 0);
    const std::string text = text_of(page);
    const auto three = text.find("<script>\nvar THREE"), own = text.find("<script>\n// SPDX-License-Identifier");
    ASSERT_NE(three, std::string::npos);
    ASSERT_NE(own, std::string::npos);
    expect_nothing_from_elsewhere(text.substr(0, three) + text.substr(own));
    EXPECT_NE(text.find("Copyright 2010-"), std::string::npos);  // three.js' notice
}

TEST_F(View, ThinsLongRuns) {
    const auto folder = run_of("pendulum", "--end 1.5");
    const auto result = run_command("view " + folder.string() + " --frames 5");
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.out.find("main: 5 of 1501 frames, to t = 1.5 s; --frames N shows more"), std::string::npos)
        << result.out;
    const Json data = data_of(text_of(folder / "scene.html"));
    const Json& system = data["systems"][0];
    EXPECT_EQ(system["frames"], 1501);
    EXPECT_EQ(system["steps"], 1500);
    EXPECT_EQ(bytes_of(system["poses"]), 5 * 7 * sizeof(float));
    EXPECT_EQ(bytes_of(system["series"][0]["values"]), 1000 * sizeof(double));  // of 1501
}

TEST_F(View, ShowsWhatThereIsOfARunThatFailed) {
    const auto folder = run_of("pendulum", "--integrator 'euler_implicit(max_newton_iterations=1)'");
    const auto failed = run_command("view " + folder.string());
    EXPECT_EQ(failed.exit_code, 0) << failed.err;
    EXPECT_NE(failed.out.find("the run is failed; the page shows what is there"), std::string::npos) << failed.out;
    fs::remove(folder / "report.json");  // as while it goes on
    const auto unfinished = run_command("view " + folder.string());
    EXPECT_EQ(unfinished.exit_code, 0) << unfinished.err;
    EXPECT_NE(unfinished.out.find("the run is unfinished"), std::string::npos) << unfinished.out;
    EXPECT_EQ(data_of(text_of(folder / "scene.html"))["status"], "unfinished");
}

TEST_F(View, BadInputIsExplained) {
    const auto refused = [&](const std::string& arguments, const std::string& sentence) {
        const auto result = run_command("view " + arguments);
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_NE(result.err.find(sentence), std::string::npos) << result.err;
    };
    refused("nowhere", "nowhere is not a folder; give the one that `delassus run SCENE -o DIR` wrote");
    refused(scratch.path().string(), "holds no trajectory.h5");
    const auto folder = run_of("pendulum", "--end 0.01");
    refused(folder.string() + " --frames 1", "--frames must be at least 2");
    ASSERT_EQ(run_command("view " + folder.string()).exit_code, 0);
    const std::string earlier = text_of(folder / "scene.html");
    std::ofstream(folder / "trajectory.h5", std::ios::trunc) << "not HDF5";
    refused(folder.string(), "cannot be opened");
    // The earlier page is whole, and nothing is beside it.
    EXPECT_EQ(text_of(folder / "scene.html"), earlier);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 8);
    std::ofstream(folder / "report.json") << "{}";
    refused(folder.string(), "is not the report of a run");
    EXPECT_EQ(run_command("view").exit_code, 2);
    EXPECT_EQ(run_command("view --help").exit_code, 0);
}

TEST_F(View, DamagedTrajectoriesAreRefused) {
    const auto folder = run_of("bouncing_ball", "--end 0.02");
    const auto file = folder / "trajectory.h5";
    const std::string sound = text_of(file);
    for (const std::size_t at : {std::size_t{8}, sound.size() / 5, sound.size() / 3, sound.size() / 2}) {
        std::string spoiled = sound;
        for (std::size_t i = 0; i < 2000 && at + i < spoiled.size(); ++i) spoiled[at + i] = static_cast<char>(0x5a);
        std::ofstream(file, std::ios::binary | std::ios::trunc) << spoiled;
        const auto result = run_command("view " + folder.string());
        // Some bytes are only numbers, which may stay plausible.
        EXPECT_TRUE(result.exit_code == 2 || result.exit_code == 0) << at << ": " << result.exit_code << result.err;
        EXPECT_EQ(result.exit_code == 2, !result.err.empty());
    }
    std::ofstream(file, std::ios::binary | std::ios::trunc) << sound.substr(0, sound.size() / 2);
    EXPECT_EQ(run_command("view " + folder.string()).exit_code, 2);
}

/// A page that notes its errors, is played, and says how much of its canvas is painted, in attributes of its root.
std::string played(std::string page) {
    const std::string head = "<head>", end = "</body>";
    page.insert(page.find(head) + head.size(),
                "<script>{const root = document.documentElement; root.dataset.errors = '';"
                "const note = (text) => { root.dataset.errors += text + ' | '; };"
                "addEventListener('error', (event) => note(event.message));"
                "addEventListener('securitypolicyviolation', (event) => note(event.violatedDirective));"
                "console.error = console.warn = (...text) => note(text.join(' '));}</script>");
    page.insert(page.rfind(end),
                "<script>{const root = document.documentElement, play = document.getElementById('play');"
                "const canvas = document.querySelector('#stage canvas'), copy = document.createElement('canvas');"
                "const look = () => { const picture = copy.getContext('2d'); picture.drawImage(canvas, 0, 0, 300, 150);"
                "const {data} = picture.getImageData(0, 0, 300, 150); const colours = new Set(); let painted = 0;"
                "for (let i = 0; i < data.length; i += 4) if (data[i + 3] > 200) {"
                "++painted; colours.add(data[i] * 65536 + data[i + 1] * 256 + data[i + 2]); }"
                "root.dataset.painted = painted; root.dataset.colours = colours.size; };"
                "const press = () => { root.dataset.played = root.dataset.time;"
                "dispatchEvent(new KeyboardEvent('keydown', {key: ' '})); setTimeout(drag, 300); };"
                "const drag = () => { root.dataset.paused = root.dataset.time; root.dataset.after = play.textContent;"
                "const slider = document.getElementById('time'); slider.value = 0.5;"
                "slider.dispatchEvent(new Event('input'));"
                "if (canvas) { dispatchEvent(new Event('beforeprint')); look(); } };"
                // The browser's clock runs ahead of its frames; work gives them time.
                "const work = () => { let sum = 0; for (let i = 0; i < 1e7; ++i) sum += Math.sqrt(i); return sum; };"
                "let waits = 0; const wait = () => { ++waits; root.dataset.work = work();"
                "if (root.dataset.time > 0 || waits > 150) press(); else setTimeout(wait, 20); };"
                "play.click(); root.dataset.label = play.textContent; wait();}</script>");
    return page;
}

/// The value of an attribute of the page's root.
std::string noted(const Browsed& browsed, const std::string& name) {
    const std::string opening = "data-" + name + "=\"";
    const auto begin = browsed.dom.find(opening);
    if (begin == std::string::npos) return "nothing";
    return browsed.dom.substr(begin + opening.size(),
                              browsed.dom.find('"', begin + opening.size()) - begin - opening.size());
}

class ViewBrowsed : public View {
protected:
    [[nodiscard]] Browsed browse(const char* scene, const char* arguments,
                                 const std::vector<std::string>& flags) const {
        const auto page = scratch / "page.html";
        const auto folder = run_of(scene, arguments);
        EXPECT_EQ(run_command("view " + folder.string() + " -o " + page.string()).exit_code, 0);
        const std::string text = played(text_of(page));
        std::ofstream(page, std::ios::trunc) << text;
        return open_in_browser(page, scratch / "profile", flags);
    }
};

class ViewPlayed : public ViewBrowsed,
                   public ::testing::WithParamInterface<std::tuple<const char*, const char*, double>> {};

TEST_P(ViewPlayed, MovesAndIsDrawn) {
    if (!has_browser()) GTEST_SKIP() << "chromium is not installed";
    const auto [scene, arguments, end] = GetParam();
    const auto browsed = browse(scene, arguments, {"--enable-unsafe-swiftshader", "--window-size=640,480"});
    ASSERT_FALSE(browsed.timed_out);
    EXPECT_EQ(noted(browsed, "errors"), "");
    EXPECT_EQ(noted(browsed, "label"), "Pause");
    EXPECT_GT(std::stod(noted(browsed, "played")), 0.0);
    EXPECT_EQ(noted(browsed, "paused"), noted(browsed, "played"));  // a space stopped it
    EXPECT_EQ(noted(browsed, "after"), "Play");
    EXPECT_NEAR(std::stod(noted(browsed, "time")), 0.5 * end, 1e-3 * end);  // the slider
    EXPECT_NE(browsed.dom.find("<svg"), std::string::npos);                 // the plots
    ASSERT_EQ(noted(browsed, "webgl"), "yes") << browsed.log;
    EXPECT_GT(std::stoi(noted(browsed, "painted")), 300) << "of 300 x 150 pixels";
    EXPECT_GT(std::stoi(noted(browsed, "colours")), 20);
}

INSTANTIATE_TEST_SUITE_P(Scenes, ViewPlayed,
                         ::testing::Values(std::tuple("pendulum", "--end 2 --every 20", 2.0),
                                           std::tuple("sphere_pile", "--end 0.1 --every 5", 0.1),
                                           std::tuple("elastic_block", "--end 0.05 --every 5", 0.05),
                                           std::tuple("box_on_incline", "--end 0.1 --every 5", 0.1)),
                         [](const auto& chosen) { return std::string(std::get<0>(chosen.param)); });

TEST_F(ViewBrowsed, WithoutWebGLThereAreASentenceAndThePlots) {
    if (!has_browser()) GTEST_SKIP() << "chromium is not installed";
    const auto browsed = browse("pendulum", "--end 2 --every 20", {"--disable-3d-apis"});
    ASSERT_FALSE(browsed.timed_out);
    EXPECT_EQ(noted(browsed, "webgl"), "no");
    EXPECT_NE(browsed.dom.find("This browser cannot draw the motion"), std::string::npos);
    EXPECT_GT(std::stod(noted(browsed, "played")), 0.0);
    EXPECT_NE(browsed.dom.find("<svg"), std::string::npos);
}

}  // namespace
}  // namespace delassus::tests::view_test
