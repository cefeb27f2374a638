// SPDX-License-Identifier: BSD-3-Clause
// Finding plugins by their sidecars, and loading none before it is chosen.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "delassus/error.hpp"
#include "delassus/registry.hpp"
#include "helpers.hpp"

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
