// SPDX-License-Identifier: BSD-3-Clause
// Suites: what they expand to, and what they refuse.
#include "bench/suite.hpp"

#include <gtest/gtest.h>

#include <map>

#include "bench_fixture.hpp"
#include "delassus/error.hpp"
#include "support/places.hpp"

namespace delassus::bench_test::suite_test {
namespace {

class SuiteTest : public BenchTest {
protected:
    [[nodiscard]] bench::Suite read(const std::string& text) const {
        return bench::read_suite(suite(text), Registry({fs::path(tests::places::plugins)}));
    }
};

TEST_F(SuiteTest, SweepsExpand) {
    const auto suite = read(
        "problems:\n"
        "  - {generate: sphere_pile, set: {contacts: [10, 20], mu: 0.3}}\n"
        "  - stops\n"
        "solvers:\n"
        "  - {name: pgs, omega: [0.8, 1.0, 1.2], variant: [forward, symmetric]}\n"
        "  - misbehaving(behaviour=lie)\n");
    ASSERT_EQ(suite.problems.size(), 3U);
    EXPECT_EQ(suite.problems[0].name, "sphere_pile(contacts=10,mu=0.3)");
    EXPECT_EQ(suite.problems[1].source.parameters, (std::map<std::string, double>{{"contacts", 20.0}, {"mu", 0.3}}));
    EXPECT_EQ(suite.problems[1].family, "sphere_pile(mu=0.3)");
    EXPECT_EQ(suite.problems[2].source.path, folder / "stops");
    ASSERT_EQ(suite.solvers.size(), 7U);
    EXPECT_EQ(bench::label_of(suite.solvers[0]), "pgs(omega=0.8,variant=forward)");
    EXPECT_EQ(bench::label_of(suite.solvers[1]), "pgs(omega=0.8,variant=symmetric)");
    EXPECT_EQ(bench::label_of(suite.solvers[5]), "pgs(omega=1.2,variant=symmetric)");
    EXPECT_EQ(suite.tolerances, (std::vector<double>{1e-3, 1e-6, 1e-9}));
}

TEST_F(SuiteTest, FoldersAreListedAndOptionalOnesMayBeAbsent) {
    const auto suite =
        read("problems: [{folder: .}, {path: absent, optional: true}, {folder: $NO_SUCH_PLACE, optional: true}]\n");
    ASSERT_EQ(suite.problems.size(), 2U);
    EXPECT_EQ(suite.problems[0].source.path.filename(), "friction");
    EXPECT_EQ(suite.left_out.size(), 2U);
    EXPECT_FALSE(suite.solvers.empty());  // none were named: all plugins
}

TEST_F(SuiteTest, TimesteppersHaveStepsAndOptions) {
    std::ofstream(folder / "scene.yaml") << "step: 0.1\nend: 1\n";
    const auto suite = read(
        "scenes: [{path: scene.yaml, name: empty, end: 0.5, steps: [0.1, 0.05]}]\n"
        "timesteppers: [{name: generalized_alpha, rho_infinity: [0.2, 0.8], steps: [0.1]}, hht]\n");
    ASSERT_EQ(suite.timesteppers.size(), 3U);
    EXPECT_EQ(suite.timesteppers[1].text, "generalized_alpha(rho_infinity=0.8)");
    EXPECT_EQ(suite.scenes[0].name, "empty");
    EXPECT_EQ(suite.scenes[0].steps.size(), 2U);
}

TEST_F(SuiteTest, MistakesAreNamedWithTheirPlace) {
    const std::string file = (folder / "suite.yaml").string();
    const std::map<std::string, std::string> cases = {
        {"problems: [stops]\ntolerence: [1e-3]\n",
         "line 2: a suite has no key \"tolerence\"; did you mean \"tolerances\"?"},
        {"problems:\n  - {genrate: chain}\n",
         "line 2: a problem of the suite has no key \"genrate\"; did you mean \"generate\"?"},
        {"problems:\n  - {generate: chian}\n", "line 2: there is no generator \"chian\"; did you mean \"chain\"?"},
        {"problems:\n  - {generate: chain, set: {bodys: 3}}\n",
         "line 2: chain has no parameter \"bodys\"; did you mean \"bodies\"?"},
        {"problems:\n  - {generate: chain, set: {bodies: 0}}\n", "line 2: chain: bodies = 0 lies outside its range"},
        {"problems:\n  - absent\n", "line 2: there is no "},
        {"problems:\n  - {path: stops, folder: .}\n", "line 2: a problem of the suite has one of"},
        {"problems: [stops]\nsolvers:\n  - pgss\n", "line 3: there is no solver \"pgss\"; did you mean \"pgs\"?"},
        {"problems: [stops]\nsolvers:\n  - {name: pgs, omgea: 1}\n",
         "line 3: pgs has no option \"omgea\"; did you mean \"omega\"?"},
        {"problems: [stops]\nsolvers: [pgs, pgs]\n", "line 2: the solver pgs is listed twice"},
        {"problems: [stops]\ntolerances: [0]\n", "line 2: \"tolerances\" is 0; it must be positive"},
        {"problems: [stops]\ntime_limit: .inf\n", "line 2: \"time_limit\" is .inf; it must be positive and finite"},
        {"problems: [stops]\nrepeats: 0\n", "line 2: \"repeats\" must be at least 1"},
        {"problems: [stops]\nlaws: [sticky]\n", "line 2:"},
        {"scenes: [absent.yaml]\n", "line 1: there is no scene "},
        {"problems: [stops]\ntimesteppers: [newmarck]\n",
         "line 2: there is no timestepper \"newmarck\"; did you mean \"newmark\"?"},
        {"problems: [stops]\ntimesteppers: [newmark(x=1)]\n", "line 2: newmark has no option \"x\""},
        {"title: nothing\n", "has neither problems nor scenes nor axes"},
        {"problems: [stops\n", "not valid YAML"}};
    for (const auto& [text, sentence] : cases) {
        try {
            static_cast<void>(read(text));
            ADD_FAILURE() << text;
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find(sentence), std::string::npos) << text << error.what();
            EXPECT_EQ(std::string(error.what()).rfind(file, 0), 0U) << error.what();
        }
    }
}

TEST_F(SuiteTest, ShippedSuitesCanBeRead) {
    const Registry registry;
    std::vector<std::string> names;
    for (const auto& one : bench::shipped_suites(registry)) {
        names.push_back(one.name);
        EXPECT_NO_THROW(static_cast<void>(bench::read_suite(bench::find_suite(one.name), registry))) << one.name;
        EXPECT_FALSE(one.title.empty()) << one.description;
    }
    for (const char* name : {"full", "quick", "scaling", "stability"})
        EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
    EXPECT_THROW(static_cast<void>(bench::find_suite("quikc")), InputError);
}

}  // namespace
}  // namespace delassus::bench_test::suite_test
