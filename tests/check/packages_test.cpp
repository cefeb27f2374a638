// SPDX-License-Identifier: BSD-3-Clause
// Plugins as packages: installed by one command, listed, used and removed; and what is refused, in one sentence each.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "delassus/plugin_info.hpp"
#include "helpers.hpp"
#include "support/library_location.hpp"
#include "support/places.hpp"

namespace delassus::packages_test {
namespace {

using test::content_of;
using test::fixture;
namespace fs = std::filesystem;
using Json = nlohmann::json;

/// A user with a home, and an installation of Delassus whose folder of plugins is empty.
class Packages : public ::testing::Test {
protected:
    Packages() {
        fs::create_directories(system());
        for (const auto& entry : fs::directory_iterator(library_directory()))
            if (entry.path().filename().string().starts_with("libdelassus.so"))
                fs::copy(entry.path(), prefix() / entry.path().filename(), fs::copy_options::copy_symlinks);
    }

    [[nodiscard]] fs::path prefix() const { return scratch_.path() / "lib"; }
    [[nodiscard]] fs::path system() const { return prefix() / "delassus" / "plugins"; }
    [[nodiscard]] fs::path user() const { return scratch_.path() / "data" / "delassus" / "plugins"; }
    [[nodiscard]] fs::path stranger() const { return scratch_.path() / "from a stranger"; }

    [[nodiscard]] test::CommandResult run(const std::vector<std::string>& arguments) const {
        auto environment = environment_;
        environment.insert({{"XDG_DATA_HOME", scratch_.path() / "data"}, {"LD_LIBRARY_PATH", prefix()}});
        return test::run_command(arguments, environment, scratch_.path());
    }

    /// What a stranger hands on: the library of a fixture, with a manifest if it can be loaded. Its folder.
    fs::path hand_on(const std::string& plugin, bool with_manifest = true) {
        fs::create_directories(stranger());
        fs::copy_file(fixture(plugin), stranger() / (plugin + ".so"), fs::copy_options::overwrite_existing);
        if (with_manifest) {
            const auto described =
                run({"plugins", "describe", stranger() / (plugin + ".so"), "--sidecar", "--checksum"});
            EXPECT_EQ(described.exit_code, 0) << described.err;
        }
        return stranger();
    }

    void change_manifest(const std::string& plugin, const std::string& key, const Json& value) const {
        const auto file = stranger() / (plugin + ".json");
        Json json = Json::parse(content_of(file));
        json[key] = value;
        std::ofstream(file) << json.dump(2);
    }

    /// The command refuses, by one sentence with these words, and leaves nothing.
    void expect_refusal(const std::vector<std::string>& arguments, const std::string& words) const {
        SCOPED_TRACE(words);
        const auto refused = run(arguments);
        EXPECT_EQ(refused.exit_code, 2) << refused.out;
        EXPECT_NE(refused.err.find(words), std::string::npos) << refused.err;
        EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
        EXPECT_TRUE(!fs::exists(user()) || fs::is_empty(user()));
    }

    test::TemporaryFolder scratch_;
    std::map<std::string, std::string> environment_;
    const std::string problem_ = std::string(tests::places::source) + "/examples/problems/box_stack";
};

TEST_F(Packages, AreInstalledListedUsedAndRemoved) {
    for (const bool for_all : {false, true}) {
        SCOPED_TRACE(for_all);
        const auto place = (for_all ? system() : user()) / "sweeps";
        std::vector<std::string> install = {"plugins", "install", hand_on("sweeps")};
        if (for_all) install.emplace_back("--system");
        const auto installed = run(install);
        ASSERT_EQ(installed.exit_code, 0) << installed.err;
        const std::string whom = for_all ? "for all" : "for this user";
        EXPECT_NE(installed.out.find("installed sweeps 1.0 " + whom + ": " + place.string()), std::string::npos)
            << installed.out;
        fs::remove_all(stranger());

        const auto list = run({"plugins", "list"});
        EXPECT_NE(list.out.find("sweeps     1.0"), std::string::npos) << list.out;
        EXPECT_NE(list.out.find("[installed " + whom + "]"), std::string::npos) << list.out;
        EXPECT_EQ(list.out.find("Rejected"), std::string::npos) << list.out;
        const Json json = Json::parse(run({"plugins", "list", "--json"}).out).at("plugins").at(0);
        EXPECT_EQ(json.at("origin"), for_all ? "system" : "user");
        EXPECT_EQ(json.at("path"), (place / "sweeps.so").string());
        EXPECT_EQ(json.at("installed_from"), stranger().string());
        EXPECT_TRUE(json.at("platform").get<std::string>().starts_with("linux_"));
        EXPECT_TRUE(json.at("checksums").at("sweeps.so").get<std::string>().starts_with("crc32:"));
        for (const char* key : {"abi", "licence", "plugin_version"}) EXPECT_TRUE(json.contains(key)) << key;

        const auto solved = run({"solve", problem_, "--solver", "sweeps", "--tolerance", "1e-3"});
        EXPECT_EQ(solved.exit_code, 0) << solved.err;

        const auto removed = run({"plugins", "remove", "sweeps"});
        EXPECT_EQ(removed.exit_code, 0) << removed.err;
        EXPECT_NE(removed.out.find("removed sweeps " + whom), std::string::npos) << removed.out;
        EXPECT_TRUE(fs::is_empty(place.parent_path()));
        EXPECT_EQ(run({"plugins", "list"}).out.find("sweeps"), std::string::npos);
    }
    expect_refusal({"plugins", "remove", "sweeps"}, "no plugin \"sweeps\" is installed for this user or for all");
}

TEST_F(Packages, AFileAloneIsEnough) {
    for (const char* file : {"minimal.so", "minimal.json"}) {
        hand_on("minimal", std::string(file) == "minimal.json");
        const auto installed = run({"plugins", "install", "--user", stranger() / file});
        EXPECT_EQ(installed.exit_code, 0) << installed.err;
        EXPECT_TRUE(fs::exists(user() / "minimal" / "minimal.json"));
    }
    EXPECT_NE(run({"plugins", "install", stranger()}).out.find("replaced minimal"), std::string::npos);
}

TEST_F(Packages, WhatIsWrongWithThemIsSaidInOneSentence) {
    const auto install = [&](const std::string& what) { return std::vector<std::string>{"plugins", "install", what}; };
    const std::string folder = hand_on("sweeps"), manifest = stranger() / "sweeps.json";
    const std::string good = content_of(manifest);
    change_manifest("sweeps", "platform", "linux_vax");
    expect_refusal(install(folder), "sweeps.so was built for linux_vax; this is linux_");
    std::ofstream(manifest) << good;
    change_manifest("sweeps", "abi", Json{99, 0});
    expect_refusal(install(folder), "was built for version 99.0 of the plugin interface");
    std::ofstream(manifest) << good;
    change_manifest("sweeps", "checksums", {{"sweeps.so", "crc32:00000000"}});
    expect_refusal(install(folder), "sweeps.so is damaged: its checksum is crc32:");
    std::ofstream(manifest) << good;
    change_manifest("sweeps", "plugin_version", "2.0");
    expect_refusal(install(folder), "sweeps.json does not match");
    std::ofstream(manifest) << good.substr(0, good.size() / 2);
    expect_refusal(install(folder), "sweeps.json is not a valid sidecar");

    // Of a library alone, its own head says what it was built for.
    fs::remove(manifest);
    {
        std::fstream library(stranger() / "sweeps.so", std::ios::in | std::ios::out | std::ios::binary);
        library.seekp(18);
        library.write("\xb7\0", 2);  // e_machine: EM_AARCH64
    }
    if (content_of(fixture("sweeps"))[18] == 62)
        expect_refusal(install(folder), "sweeps.so was built for linux_aarch64; this is linux_x86_64");
    std::ofstream(stranger() / "sweeps.so") << "no library";
    expect_refusal(install(folder), "sweeps.so is no shared library");

    fs::remove_all(stranger());
    expect_refusal(install(folder), "there is no " + folder);
    fs::create_directories(stranger());
    expect_refusal(install(folder), "holds no plugin");
    std::ofstream(stranger() / "notes.txt") << "…";
    expect_refusal(install(stranger() / "notes.txt"), "neither a shared library");
    for (const char* two : {"sweeps", "direct"}) hand_on(two, false);
    expect_refusal(install(folder), "holds several plugins, direct.so and sweeps.so");
    const std::pair<const char*, const char*> cases[] = {{"crashes_at_load", "the loader fails on it"},
                                                         {"wrong_abi", "of the plugin interface"},
                                                         {"missing_symbol", "does not export"},
                                                         {"bad_name", "is not a word"}};
    for (const auto& [plugin, words] : cases) {
        hand_on(plugin, false);
        expect_refusal(install(stranger() / (std::string(plugin) + ".so")), words);
    }
    EXPECT_EQ(run({"plugins", "install", folder, "--user", "--system"}).exit_code, 2);
}

// What is damaged later is noticed before it is loaded.
TEST_F(Packages, AreCheckedBeforeTheyAreLoaded) {
    const auto mark = scratch_.path() / "loaded";
    ASSERT_EQ(run({"plugins", "install", hand_on("touches_file")}).exit_code, 0);
    environment_["DELASSUS_TEST_LOADED_FILE"] = mark;
    const auto place = user() / "touches_file";
    const auto library = place / "touches_file.so";
    EXPECT_NE(run({"solve", problem_, "--solver", "touches_file", "--max-iterations", "1"}).exit_code, 2);
    EXPECT_TRUE(fs::exists(mark));
    fs::remove(mark);
    std::ofstream(library, std::ios::app) << "one more byte";
    const std::string words = library.string() + " is damaged: its checksum is crc32:";
    const auto used = run({"solve", problem_, "--solver", "touches_file"});
    EXPECT_EQ(used.exit_code, 2);
    EXPECT_NE(used.err.find(words), std::string::npos) << used.err;
    const std::string listed = run({"plugins", "list"}).out;
    EXPECT_NE(listed.find("\n" + words), std::string::npos) << "its path is there once: " << listed;
    const auto shown = run({"plugins", "info", "touches_file"});
    EXPECT_EQ(shown.exit_code, 2);
    EXPECT_NE(shown.err.find(words), std::string::npos) << shown.err;

    Json manifest = Json::parse(content_of(place / "touches_file.json"));
    manifest["platform"] = "linux_vax";
    std::ofstream(place / "touches_file.json") << manifest;
    EXPECT_NE(run({"plugins", "list"}).out.find("touches_file.so: built for linux_vax; this is"), std::string::npos);
    std::ofstream(place / "touches_file.json") << "{";
    EXPECT_NE(run({"plugins", "list"}).out.find("touches_file.json is not a valid sidecar"), std::string::npos);
    EXPECT_FALSE(fs::exists(mark));

    EXPECT_EQ(run({"plugins", "install", stranger()}).exit_code, 0) << "it is mended by installing it again";
    EXPECT_EQ(run({"plugins", "list"}).out.find("Rejected"), std::string::npos);
}

TEST_F(Packages, OthersFilesAreLeftAlone) {
    ASSERT_EQ(run({"plugins", "install", hand_on("sweeps")}).exit_code, 0);
    const auto note = user() / "sweeps" / "note.txt";
    std::ofstream(note) << "mine";
    for (const auto& arguments : {std::vector<std::string>{"plugins", "install", stranger()},
                                  std::vector<std::string>{"plugins", "remove", "sweeps"}}) {
        const auto refused = run(arguments);
        EXPECT_EQ(refused.exit_code, 2);
        EXPECT_NE(refused.err.find("holds note.txt, which delassus did not write"), std::string::npos) << refused.err;
        EXPECT_EQ(content_of(note), "mine");
    }
    fs::remove(note);
    // Plugins that were put there by hand.
    fs::copy_file(stranger() / "sweeps.so", system() / "sweeps.so");
    fs::copy_file(stranger() / "sweeps.json", system() / "sweeps.json");
    EXPECT_EQ(run({"plugins", "remove", "sweeps"}).exit_code, 0);
    expect_refusal({"plugins", "remove", "sweeps"}, "was not installed by `delassus plugins install`");
    expect_refusal({"plugins", "install", stranger()}, "there is a solver \"sweeps\" already");
    EXPECT_TRUE(fs::exists(system() / "sweeps.so"));
    // A folder that somebody made.
    fs::remove(system() / "sweeps.so");
    fs::remove(system() / "sweeps.json");
    fs::create_directories(system() / "sweeps");
    std::ofstream(system() / "sweeps" / "thesis.tex") << "years";
    const auto refused = run({"plugins", "install", stranger(), "--system"});
    EXPECT_NE(refused.err.find("thesis.tex"), std::string::npos) << refused.err;
    EXPECT_NE(run({"plugins", "remove", "sweeps"}).exit_code, 0);
    EXPECT_EQ(content_of(system() / "sweeps" / "thesis.tex"), "years");
}

TEST_F(Packages, AUsersOwnComesBeforeThatOfAll) {
    ASSERT_EQ(run({"plugins", "install", hand_on("sweeps"), "--system"}).exit_code, 0);
    const auto installed = run({"plugins", "install", stranger()});
    EXPECT_EQ(installed.exit_code, 0) << installed.err;
    EXPECT_NE(installed.err.find("is searched after it"), std::string::npos) << installed.err;
    const Json json = Json::parse(run({"plugins", "list", "--json"}).out);
    EXPECT_EQ(json.at("plugins").at(0).at("origin"), "user");
    EXPECT_EQ(json.at("rejected").at(0).at("path"), (system() / "sweeps" / "sweeps.so").string());
    EXPECT_EQ(run({"plugins", "remove", "sweeps", "--system"}).exit_code, 0);
    EXPECT_TRUE(fs::exists(user() / "sweeps"));
    EXPECT_FALSE(fs::exists(system() / "sweeps"));
}

}  // namespace
}  // namespace delassus::packages_test
