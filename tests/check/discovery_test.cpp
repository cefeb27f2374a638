// SPDX-License-Identifier: BSD-3-Clause
// Finding plugins by their sidecars, and loading none before it is chosen.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "delassus/error.hpp"
#include "delassus/registry.hpp"
#include "helpers.hpp"
#include "support/places.hpp"

namespace delassus::discovery_test {
namespace {

using test::fixture;
using test::run_command;
namespace fs = std::filesystem;

/// Sets DELASSUS_PLUGIN_PATH for as long as it lives.
class PluginPath {
public:
    explicit PluginPath(const std::string& value) { setenv("DELASSUS_PLUGIN_PATH", value.c_str(), 1); }
    ~PluginPath() { unsetenv("DELASSUS_PLUGIN_PATH"); }
    PluginPath(const PluginPath&) = delete;
    PluginPath& operator=(const PluginPath&) = delete;
};

nlohmann::json sidecar_of(const std::string& plugin) {
    return nlohmann::json::parse(sidecar_text(Plugin::load(fixture(plugin))->info()));
}

void write_sidecar(const fs::path& folder, const std::string& name, const nlohmann::json& json) {
    std::ofstream(folder / (name + ".json")) << json.dump(2);
}

/// The plugin with its sidecar in another folder; version marks which one it is.
void install(const std::string& plugin, const fs::path& folder, const std::string& version = "1.0") {
    fs::create_directories(folder);
    fs::copy_file(fixture(plugin), folder / (plugin + ".so"));
    auto json = sidecar_of(plugin);
    json["plugin_version"] = version;
    write_sidecar(folder, plugin, json);
}

std::string reason_of(const Registry& registry, const fs::path& path) {
    for (const auto& row : registry.rejected())
        if (row.path == path) return row.reason;
    return {};
}

bool lists(const Registry& registry, const std::string& name) {
    for (const auto& plugin : registry.plugins())
        if (plugin.name == name) return true;
    return false;
}

TEST(Discovery, FindsFoldersOfTheCallerAndTheEnvironment) {
    const test::TemporaryFolder one, two, three;
    install("sweeps", one.path());
    install("direct", two.path());
    install("minimal", three.path());
    const PluginPath environment(two.path().string() + "::" + three.path().string());
    const Registry registry({one.path()});
    for (const char* name : {"sweeps", "direct", "minimal"}) EXPECT_TRUE(lists(registry, name)) << name;
    EXPECT_EQ(registry.load("direct")->info().library, two.path() / "direct.so");
}

TEST(Discovery, FirstOfANameWins) {
    const test::TemporaryFolder one, two;
    install("sweeps", one.path(), "first");
    install("sweeps", two.path(), "second");
    const PluginPath environment(two.path().string());
    {
        const Registry registry({one.path()});
        EXPECT_EQ(registry.find("sweeps").version, "first");
        EXPECT_NE(reason_of(registry, two.path() / "sweeps.so").find("comes first"), std::string::npos);
    }
    EXPECT_EQ(Registry().find("sweeps").version, "second");
    EXPECT_EQ(Registry({two.path(), one.path()}).find("sweeps").version, "second");
}

TEST(Discovery, SaysWhatIsWrongWithASidecar) {
    const test::TemporaryFolder folder;
    const auto& path = folder.path();
    const auto good = sidecar_of("sweeps");
    fs::copy_file(fixture("sweeps"), path / "no_sidecar.so");
    std::ofstream(path / "malformed.json") << "{\"format\": \"delassus-plugin\",";
    write_sidecar(path, "other_format", {{"format", "something else"}, {"version", 1}});
    auto json = good;
    json["library"] = "../elsewhere/sweeps.so";
    write_sidecar(path, "elsewhere", json);
    json["library"] = "/usr/lib/sweeps.so";
    write_sidecar(path, "absolute", json);
    json["library"] = "gone.so";
    write_sidecar(path, "no_library", json);
    json = good;
    json["abi"] = {99, 0};
    fs::copy_file(fixture("sweeps"), path / "sweeps.so");
    write_sidecar(path, "sweeps", json);
    json = good;
    json["capabilities"] = {"clairvoyance"};
    write_sidecar(path, "clairvoyant", json);
    json = good;
    json["flags"] = "many";
    write_sidecar(path, "wrong_type", json);

    const Registry registry({path});
    EXPECT_FALSE(lists(registry, "sweeps"));
    const std::pair<const char*, const char*> cases[] = {{"no_sidecar.so", "no sidecar"},
                                                         {"malformed.json", "not a valid sidecar"},
                                                         {"other_format.json", "not a plugin sidecar"},
                                                         {"elsewhere.json", "another folder"},
                                                         {"absolute.json", "another folder"},
                                                         {"no_library.json", "gone.so is missing"},
                                                         {"sweeps.so", "version 99.0"},
                                                         {"clairvoyant.json", "clairvoyance"},
                                                         {"wrong_type.json", "not a valid sidecar"}};
    for (const auto& [file, words] : cases)
        EXPECT_NE(reason_of(registry, path / file).find(words), std::string::npos)
            << file << ": " << reason_of(registry, path / file);
}

TEST(Discovery, OneLibraryHasOneSidecar) {
    const test::TemporaryFolder folder;
    install("sweeps", folder.path());
    write_sidecar(folder.path(), "a_copy", sidecar_of("sweeps"));
    write_sidecar(folder.path(), "z_copy", sidecar_of("sweeps"));
    const Registry registry({folder.path()});
    EXPECT_EQ(registry.find("sweeps").version, "1.0") << "its own sidecar counts";
    for (const char* copy : {"a_copy.json", "z_copy.json"}) {
        const auto reason = reason_of(registry, folder.path() / copy);
        EXPECT_NE(reason.find("its library sweeps.so has another sidecar, sweeps.json"), std::string::npos) << reason;
    }
}

// Whoever names a rejected plugin reads why it was rejected, by the name of the plugin or of its file.
TEST(Discovery, SaysWhyAPluginThatIsNamedWasRejected) {
    const test::TemporaryFolder folder;
    const auto& path = folder.path();
    fs::copy_file(fixture("direct"), path / "direct.so");
    auto json = sidecar_of("sweeps");
    json["abi"] = {99, 0};
    json["name"] = "of_tomorrow";
    fs::copy_file(fixture("sweeps"), path / "sweeps.so");
    write_sidecar(path, "sweeps", json);
    json = sidecar_of("minimal");
    write_sidecar(path, "minimal", json);
    std::ofstream(path / "malformed.json") << "{";
    const Registry registry({path});
    const std::pair<const char*, const char*> cases[] = {{"direct", "no sidecar"},
                                                         {"sweeps", "version 99.0"},
                                                         {"of_tomorrow", "version 99.0"},
                                                         {"minimal", "its library minimal.so is missing"},
                                                         {"malformed", "not a valid sidecar"}};
    const auto scene = path / "scene.yaml", config = path / "config.yaml";
    for (const auto& [name, words] : cases) {
        SCOPED_TRACE(name);
        try {
            static_cast<void>(registry.find(name));
            FAIL() << "it was found";
        } catch (const InputError& error) {
            const std::string sentence = error.what();
            EXPECT_NE(sentence.find(fmt::format("the plugin \"{}\" was rejected", name)), std::string::npos)
                << sentence;
            EXPECT_NE(sentence.find(words), std::string::npos) << sentence;
        }
        std::ofstream(config) << "solver: " << name << "\nplugin_path: [" << path.string() << "]\n";
        std::ofstream(scene) << "step: 0.01\nend: 0.1\nsolver: " << name
                             << "\nbodies: [{name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}]\n";
        const std::string problem = std::string(tests::places::source) + "/examples/problems/chain";
        for (const std::vector<std::string>& arguments :
             {std::vector<std::string>{"solve", problem, "--solver", name, "--plugin-path", path},
              {"solve", problem, "--config", config},
              {"compare", problem, "--solvers", name, "--plugin-path", path, "-o", path / "out"},
              {"plugins", "info", name, "--plugin-path", path},
              {"plugins", "check", name, "--plugin-path", path},
              {"plan", scene, "--plugin-path", path},
              {"run", scene, "--plugin-path", path, "-o", path / "run"}}) {
            const auto result = run_command(arguments);
            EXPECT_EQ(result.exit_code, 2) << arguments[0];
            EXPECT_NE(result.err.find(words), std::string::npos) << arguments[0] << ": " << result.err;
        }
    }
    const PluginPath environment("relative/folder");
    const auto result = run_command({"plugins", "info", "elsewhere"});
    EXPECT_NE(result.err.find("the folder relative/folder was not searched"), std::string::npos) << result.err;
}

TEST(Discovery, ShowsWhatWasBuiltWithoutOptimisation) {
    const test::TemporaryFolder folder;
    const auto library = folder.path() / "unoptimized.so";
    fs::copy_file(fixture("unoptimized"), library);
    const std::string words = "built without optimisation";
    const auto described = run_command({"plugins", "describe", library, "--sidecar"});
    EXPECT_EQ(described.exit_code, 0) << described.err;
    EXPECT_NE(described.err.find("warning: unoptimized was " + words), std::string::npos) << described.err;
    EXPECT_EQ(nlohmann::json::parse(test::content_of(folder.path() / "unoptimized.json")).at("optimized"), false);
    const std::string path = folder.path().string();
    EXPECT_NE(run_command({"plugins", "list", "--plugin-path", path}).out.find(words), std::string::npos);
    EXPECT_NE(run_command({"plugins", "info", "unoptimized", "--plugin-path", path}).out.find(words),
              std::string::npos);

    // By name, by path without a sidecar, and as a stage of another solver.
    const std::string problem = std::string(tests::places::source) + "/examples/problems/box_stack";
    for (const std::string& solver : {std::string("unoptimized"), fixture("unoptimized").string(),
                                      std::string("apgd(finish=unoptimized,finish_at=1e-2)")}) {
        const auto out = folder.path() / "out";
        const auto compared = run_command({"compare", problem, "--solvers", solver, "--plugin-path", path, "-o", out,
                                           "--tolerance", "1e-3", "--repeats", "1"});
        EXPECT_EQ(compared.exit_code, 0) << compared.err;
        EXPECT_NE(compared.err.find("warning: unoptimized was " + words), std::string::npos) << compared.err;
        EXPECT_NE(compared.out.find("unoptimized was " + words), std::string::npos) << compared.out;
        EXPECT_NE(test::content_of(out / "results.json").find("unoptimized was " + words), std::string::npos);
    }
    const auto quiet = run_command({"compare", problem, "--solvers", "apgd", "-o", folder.path() / "quiet"});
    EXPECT_EQ(quiet.err.find(words), std::string::npos) << quiet.err;
    std::ofstream(folder.path() / "suite.yaml") << "problems: [" << problem
                                                << "]\nsolvers: [unoptimized]\ntolerances: [1e-3]\nrepeats: 1\n"
                                                   "references: none\n";
    const auto bench = run_command(
        {"bench", "run", folder.path() / "suite.yaml", "--plugin-path", path, "-o", folder.path() / "bench"});
    EXPECT_EQ(bench.exit_code, 0) << bench.err;
    EXPECT_NE(bench.err.find("warning: unoptimized was " + words), std::string::npos) << bench.err;
}

TEST(Discovery, RefusesToLoadByAStaleSidecar) {
    const test::TemporaryFolder folder;
    install("sweeps", folder.path(), "of another build");
    const Registry registry({folder.path()});
    try {
        static_cast<void>(registry.load("sweeps"));
        FAIL() << "it was loaded";
    } catch (const PluginError& error) {
        EXPECT_NE(std::string(error.what()).find("does not match"), std::string::npos) << error.what();
    }
}

TEST(Discovery, RefusesRelativeFoldersAndNeverSearchesTheWorkingDirectory) {
    const test::TemporaryFolder folder;
    install("sweeps", folder.path());
    install("sweeps", folder.path() / "sub");
    const auto list = run_command({"plugins", "list", "--json"}, {{"DELASSUS_PLUGIN_PATH", "sub:."}}, folder.path());
    EXPECT_EQ(list.exit_code, 0) << list.err;
    const auto json = nlohmann::json::parse(list.out);
    for (const auto& plugin : json.at("plugins")) EXPECT_NE(plugin.at("name"), "sweeps");
    int refused = 0;
    for (const auto& row : json.at("rejected"))
        if (row.at("path") == "sub" || row.at("path") == ".") {
            EXPECT_NE(row.at("reason").get<std::string>().find("absolute path"), std::string::npos);
            ++refused;
        }
    EXPECT_EQ(refused, 2);
    const auto unknown = run_command({"plugins", "info", "sweeps"}, {}, folder.path());
    EXPECT_EQ(unknown.exit_code, 2);
    EXPECT_NE(unknown.err.find("there is no solver \"sweeps\""), std::string::npos) << unknown.err;
}

TEST(Discovery, PluginPathOfTheCommandComesBeforeTheEnvironment) {
    const test::TemporaryFolder one, two;
    install("sweeps", one.path(), "first");
    install("sweeps", two.path(), "second");
    const auto info = run_command({"plugins", "info", "sweeps", "--json", "--plugin-path", one.path()},
                                  {{"DELASSUS_PLUGIN_PATH", two.path()}});
    EXPECT_EQ(info.exit_code, 0) << info.err;
    EXPECT_EQ(nlohmann::json::parse(info.out).at("plugin_version"), "first");
    // A path typed on the command line is relative to where it is typed.
    const auto relative = run_command({"plugins", "info", "sweeps", "--json", "--plugin-path", "."}, {}, two.path());
    EXPECT_EQ(relative.exit_code, 0) << relative.err;
    EXPECT_EQ(nlohmann::json::parse(relative.out).at("plugin_version"), "second");
}

TEST(Discovery, ListingLoadsNothing) {
    const test::TemporaryFolder folder;
    fs::copy_file(fixture("touches_file"), folder.path() / "touches_file.so");
    const auto mark = folder.path() / "loaded";
    const std::map<std::string, std::string> environment{{"DELASSUS_TEST_LOADED_FILE", mark}};
    // Without a sidecar it is listed as rejected, and still not loaded.
    EXPECT_EQ(run_command({"plugins", "list", "--plugin-path", folder.path()}, environment).exit_code, 0);
    EXPECT_FALSE(fs::exists(mark));

    // Describing it loads it: the mark works.
    const auto library = (folder.path() / "touches_file.so").string();
    EXPECT_EQ(run_command({"plugins", "describe", library, "--sidecar"}, environment).exit_code, 0);
    EXPECT_TRUE(fs::exists(mark));
    fs::remove(mark);

    const auto list = run_command({"plugins", "list", "--plugin-path", folder.path()}, environment);
    EXPECT_NE(list.out.find("touches_file"), std::string::npos) << list.out;
    const auto info = run_command({"plugins", "info", "touches_file", "--plugin-path", folder.path()}, environment);
    EXPECT_EQ(info.exit_code, 0) << info.err;
    EXPECT_FALSE(fs::exists(mark));
}

TEST(Discovery, AFolderThatIsNotThereIsNamed) {
    const test::TemporaryFolder folder;
    const auto gone = folder.path() / "gone";
    const Registry registry({gone});
    EXPECT_NE(reason_of(registry, gone).find("cannot be read"), std::string::npos);
}

}  // namespace
}  // namespace delassus::discovery_test
