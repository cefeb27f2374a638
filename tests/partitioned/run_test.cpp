// SPDX-License-Identifier: BSD-3-Clause
// `mpirun -n P delassus run`: the processes share the bodies of a scene, and the motion is that of one process.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <future>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "delassus/distributed.hpp"
#include "support/places.hpp"
#include "support/run_command.hpp"

#ifdef DELASSUS_HAS_HDF5
#include <hdf5.h>
#endif

#ifdef DELASSUS_HAS_MPI

namespace delassus::tests::shared_run_test {
namespace {

using Json = nlohmann::json;

// Layers of spheres that lean on one another between walls, and settle.
constexpr const char* pile = R"(
step: 0.0023
end: 0.0851
integrator: euler_implicit_linearized
solver: {tolerance: 1.0e-9}
materials: {stone: {friction: 0.4}}
bodies:
  - name: box
    fixed: true
    shapes:
      - {plane: {}, material: stone}
      - {plane: {}, material: stone, position: [-0.46, 0, 0], orientation: {axis: [0, 1, 0], angle: 90}}
      - {plane: {}, material: stone, position: [0.46, 0, 0], orientation: {axis: [0, 1, 0], angle: -90}}
  - name: "s_{i}_{j}_{k}"
    density: 2400
    position: [-0.400123, -0.2, 0.052]
    shapes: [{sphere: {radius: 0.05}, material: stone}]
    repeat: {count: [8, 4, 2], spacing: [0.105, 0.107, 0.19]}
  - name: "t_{i}_{j}_{k}"
    density: 2400
    position: [-0.350456, -0.15, 0.148]
    shapes: [{sphere: {radius: 0.049}, material: stone}]
    repeat: {count: [7, 3, 2], spacing: [0.106, 0.107, 0.19]}
)";

// A plate on legs carries spheres, a belt moves others along, an arm with a motor and a stop, a spring between two
// spheres: one body touches many, and links cross the cuts.
constexpr const char* workshop = R"(
step: 0.003
end: 0.09
integrator: euler_implicit_linearized
coordinates: maximal
solver: {tolerance: 1.0e-8}
materials: {stone: {friction: 0.5}, ice: {friction: 0.0, restitution: 0.4}}
bodies:
  - {name: floor, fixed: true, shapes: [{plane: {}, material: stone}]}
  - {name: belt, motion: {translation: [{linear: {rate: 0.3}}, 0, 0]}, position: [0, 1, 0.05],
     shapes: [{box: {size: [1, 0.4, 0.1]}, material: stone}]}
  - {name: plate, density: 300, position: [0, 0, 0.521234], shapes: [{box: {size: [3, 1.2, 0.06]}, material: stone}]}
  - {name: "leg_{i}_{j}", density: 900, position: [-1.2, -0.4, 0.245],
     shapes: [{box: {size: [0.2, 0.2, 0.49]}, material: stone}], repeat: {count: [3, 2, 1], spacing: [1.2, 0.8, 0]}}
  - {name: "s_{i}_{j}", density: 1500, position: [-1.1, -0.3, 0.6134], shapes: [{sphere: {radius: 0.061234}, material: stone}],
     repeat: {count: [9, 4, 1], spacing: [0.27, 0.21, 0.011]}}
  - {name: "hop_{i}", density: 1500, position: [-0.3, 1.0123, 0.16], shapes: [{sphere: {radius: 0.05}, material: ice}],
     repeat: {count: 4, spacing: [0.2, 0, 0.005]}}
  - {name: arm, density: 1000, position: [2.2, 0, 0.8], shapes: [{box: {size: [0.5, 0.05, 0.05]}, material: stone}]}
  - {name: hand, density: 1000, position: [2.7, 0, 0.8], shapes: [{box: {size: [0.4, 0.05, 0.05]}, material: stone}]}
joints:
  - {name: shoulder, kind: revolute, second: arm, point: [2.0, 0, 0.8], axis: [0, 1, 0]}
  - {name: elbow, kind: revolute, first: arm, second: hand, point: [2.475, 0, 0.8], axis: [0, 1, 0], lower: -0.3, upper: 0.06}
motors:
  - {name: drive, joint: shoulder, motion: 1.5, speed: true, force_limit: 30}
springs:
  - {name: tie, first: s_0_0, second: s_1_0, first_point: [-1.1, -0.3, 0.64], second_point: [-0.83, -0.3, 0.651],
     stiffness: 500, damping: 3}
)";

// One linkage, heavier than any process's share: its joints are cut.
constexpr const char* chain = R"(
step: 0.004
end: 0.2
integrator: euler_implicit_linearized
coordinates: maximal
bodies:
  - {name: "link_{i}", mass: 0.2, inertia: {xx: 1.0e-5, yy: 1.0e-4, zz: 1.0e-4}, position: [0.05, 0, 0],
     repeat: {count: 20, spacing: [0.1, 0, 0]}}
joints:
  - {name: support, kind: revolute, second: link_0, point: [0, 0, 0], axis: [0, 1, 0],
     spring: {stiffness: 0.3, rest: 1.0}}
  - {name: "pin_{i}", kind: spherical, first: "link_{i}", second: "link_{i+1}", point: [0.1, 0, 0],
     repeat: {count: 19, spacing: [0.1, 0, 0]}}
)";

class SharedRun : public testing::Test {
protected:
    void SetUp() override {
        if (process_count() > 1) GTEST_SKIP() << "it starts mpirun itself";
        if (run_command("plugins info pgs_petsc").exit_code != 0) GTEST_SKIP() << "no PETSc in this build";
    }
    [[nodiscard]] std::string scene(const char* text) const {
        std::ofstream(folder / "scene.yaml") << text;
        return (folder / "scene.yaml").string();
    }
    [[nodiscard]] static CommandResult mpirun(int processes, const std::string& arguments) {
        return run_shell(
            "env -i PATH=\"$PATH\" HOME=\"$HOME\" OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 "
            "mpirun -n " +
            std::to_string(processes) + " --oversubscribe " + tests::places::command + " " + arguments);
    }
    [[nodiscard]] Json report(const std::string& run) const {
        std::ifstream file(folder / run / "report.json");
        return Json::parse(file);
    }
    /// The largest difference of a coordinate of a body, m, and of a velocity, m/s.
    static std::array<double, 2> differences(const Json& one, const Json& other) {
        std::array<double, 2> largest = {0.0, 0.0};
        const Json& others = other["systems"][0]["bodies"];
        for (const auto& item : one["systems"][0]["bodies"].items()) {
            const Json &body = item.value(), &same = others[item.key()];
            const auto differ = [&](const char* key, std::size_t k) {
                return std::abs(body[key][k].get<double>() - same[key][k].get<double>());
            };
            for (std::size_t k = 0; k < 3; ++k)
                largest = {std::max(largest[0], differ("position", k)), std::max(largest[1], differ("velocity", k))};
        }
        return largest;
    }
    /// Runs a scene in one process and in several; the reports.
    void compare(const char* text, const std::vector<int>& counts, double positions, double velocities,
                 int divisions = 1, double energies = 1e-6) {
        const std::string file = scene(text);
        ASSERT_EQ(run_command("run " + file + " -o " + (folder / "one").string()).exit_code, 0);
        const Json one = report("one");
        for (const int processes : counts) {
            SCOPED_TRACE(processes);
            const auto result = mpirun(processes, "run " + file + " -o " + (folder / "several").string());
            ASSERT_EQ(result.exit_code, 0) << result.err;
            const Json several = report("several");
            ASSERT_EQ(several["systems"][0]["processes"].size(), static_cast<std::size_t>(processes));
            std::int64_t bodies = 0;
            for (const Json& process : several["systems"][0]["processes"]) bodies += process["bodies"].get<int>();
            EXPECT_GE(several["systems"][0]["divisions"], divisions);
            EXPECT_EQ(6 * bodies, one["systems"][0]["velocities"].get<int>());
            const auto [x, v] = differences(one, several);
            EXPECT_LE(x, positions) << "m";
            EXPECT_LE(v, velocities) << "m/s";
            EXPECT_EQ(several["systems"][0]["most_contacts"], one["systems"][0]["most_contacts"]);
            EXPECT_NEAR(several["systems"][0]["energy"]["end"].get<double>(),
                        one["systems"][0]["energy"]["end"].get<double>(), energies);
        }
    }

    ScratchFolder folder;
};

TEST_F(SharedRun, APileMovesAsInOneProcess) {
    compare(pile, {3}, 1e-8, 1e-6);
}

TEST_F(SharedRun, OneBodyThatTouchesManyAndLinksAcrossTheCuts) {
    compare(workshop, {4}, 1e-8, 1e-6);
}

TEST_F(SharedRun, AChainIsCut) {
    compare(chain, {3}, 1e-9, 1e-7);
}

// Two flocks fly through one another: all bodies change their domains.
TEST_F(SharedRun, BodiesThatFlyFarChangeProcesses) {
    compare(
        "{step: 0.0031, end: 0.5, integrator: euler_implicit_linearized, gravity: [0, 0, -1], solver: {tolerance: "
        "1.0e-9}, materials: {m: {friction: 0.3, "
        "restitution: 0.5}}, bodies: [{name: 'a_{i}_{j}', density: 900, position: [-3, 0, 1], velocity: [9, 0, 0], "
        "angular_velocity: [0, 3, 1], shapes: [{box: {size: [0.1, 0.12, 0.11]}, material: m}], repeat: {count: [6, 5, "
        "1], spacing: [0.3, 0.3, 0]}}, {name: 'b_{i}_{j}', density: 800, position: [1.5, 0.15, 1.06], velocity: [-9, "
        "0.123, 0], shapes: [{sphere: {radius: 0.06}, material: m}], repeat: {count: [6, 5, 1], spacing: [0.3, 0.3, "
        "0]}}]}",
        {2}, 2e-5, 1e-3, 3, 1e-3);  // each impact multiplies differences
}

TEST_F(SharedRun, MoreProcessesThanBodies) {
    compare(
        "{step: 0.01, end: 0.5, integrator: euler_implicit_linearized, bodies: [{name: floor, fixed: true, shapes: "
        "[{plane: {}}]}, {name: a, density: 900, "
        "position: [0.1, 0, 0.4], shapes: [{sphere: {radius: 0.1}}]}, {name: b, density: 800, position: [3, 0, 0.35], "
        "shapes: [{sphere: {radius: 0.12}}]}]}",
        {5}, 1e-9, 1e-7);
}

TEST_F(SharedRun, ResumesOnAnotherNumberOfProcesses) {
    const std::string file = scene(pile), run = (folder / "run").string();
    ASSERT_EQ(run_command("run " + file + " -o " + (folder / "one").string()).exit_code, 0);
    ASSERT_EQ(mpirun(2, "run " + file + " --end 0.0391 -o " + run).exit_code, 0);
    ASSERT_EQ(mpirun(3, "run " + file + " --end 0.0621 --resume " + run).exit_code, 0);
    ASSERT_EQ(run_command("run " + file + " --resume " + run).exit_code, 0);
    const auto [x, v] = differences(report("one"), report("run"));
    EXPECT_LE(x, 1e-8);
    EXPECT_LE(v, 1e-5);
}

#ifdef DELASSUS_HAS_HDF5

/// A dataset of the system of a trajectory.
std::vector<double> numbers_of(const std::filesystem::path& file, const char* dataset) {
    const hid_t handle = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    const hid_t data = H5Dopen2(handle, dataset, H5P_DEFAULT);
    const hid_t space = H5Dget_space(data);
    std::vector<double> numbers(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
    H5Dread(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data());
    H5Sclose(space);
    H5Dclose(data);
    H5Fclose(handle);
    return numbers;
}

TEST_F(SharedRun, FramesHaveTheContactsOfAllProcesses) {
    const std::string line = "run " + scene(pile) + " --every 10 --contact-forces -o ";
    ASSERT_EQ(run_command(line + (folder / "one").string()).exit_code, 0);
    ASSERT_EQ(mpirun(2, line + (folder / "two").string()).exit_code, 0);
    for (const char* dataset :
         {"systems/main/contacts/point", "systems/main/contacts/force", "systems/main/contacts/bodies",
          "systems/main/frames/q", "systems/main/steps/contacts"}) {
        SCOPED_TRACE(dataset);
        const auto one = numbers_of(folder / "one" / "trajectory.h5", dataset);
        const auto two = numbers_of(folder / "two" / "trajectory.h5", dataset);
        ASSERT_EQ(one.size(), two.size());
        ASSERT_GT(one.size(), 30U);
        for (std::size_t k = 0; k < one.size(); ++k) EXPECT_NEAR(one[k], two[k], 1e-3);
    }
}

#endif

/// A process that computes a run in this folder: not a launcher, and not one that watches another.
pid_t process_of(const std::string& folder) {
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
        const std::string number = entry.path().filename();
        if (number.find_first_not_of("0123456789") != std::string::npos) continue;
        std::string name, line;
        std::getline(std::ifstream(entry.path() / "comm") >> std::ws, name);
        std::getline(std::ifstream(entry.path() / "cmdline") >> std::ws, line);
        if (name == "delassus" && line.find(folder) != std::string::npos) return static_cast<pid_t>(std::stol(number));
    }
    return 0;
}

TEST_F(SharedRun, AKilledProcessEndsAllWithinFiveSecondsAndTheCheckpointGoesOn) {
    const std::string file = scene(pile), run = (folder / "run").string();
    auto result = std::async(std::launch::async, [&] { return mpirun(3, "run " + file + " --end 1000 -o " + run); });
    for (int tries = 0; !std::filesystem::exists(folder / "run" / "checkpoint.json") && tries < 300; ++tries)
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
    const pid_t process = process_of(run);
    ASSERT_GT(process, 0) << "nobody runs";
    const auto start = std::chrono::steady_clock::now();
    ASSERT_EQ(kill(process, SIGKILL), 0);
    const CommandResult ended = result.get();
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
    EXPECT_EQ(ended.exit_code, 3);
    EXPECT_NE(ended.err.find("was ended by SIGKILL"), std::string::npos) << ended.err;
    const auto resumed = run_command("run " + file + " --end 0.0046 --resume " + run);
    EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
}

TEST_F(SharedRun, RefusalsSayWhatWouldDo) {
    struct Case {
        const char *change, *sentence;
    };
    for (const auto& [change, sentence] :
         {Case{"--tolerance 1e-4",
               "several processes cannot share a system with steps chosen by a tolerance; give a "
               "fixed \"step\", or start one process"},
          Case{"--integrator moreau_jean",
               "several processes cannot share a system with the integrator moreau_jean; "
               "name euler_implicit_linearized, or start one process"},
          Case{"--solver pgs", "several processes cannot share contacts and stops with pgs; name auto, "}}) {
        const auto result = mpirun(2, "run " + scene(pile) + " " + change);
        EXPECT_EQ(result.exit_code, 4);
        const auto place = result.err.find(sentence);
        EXPECT_NE(place, std::string::npos) << result.err;
        EXPECT_EQ(result.err.find("several processes", place + 1), std::string::npos) << "said twice";
    }
}

}  // namespace
}  // namespace delassus::tests::shared_run_test

#endif
