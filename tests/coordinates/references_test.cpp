// SPDX-License-Identifier: BSD-3-Clause
// The ends of mechanisms in docs/references, by tolerance and by what a scene gets that names nothing.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "delassus/scene.hpp"
#include "delassus/simulation.hpp"
#include "support/places.hpp"

namespace delassus::tests::references_test {
namespace {

const std::filesystem::path root = tests::places::source;

/// A file of docs/references.
struct Reference {
    std::string name, scene;
    double end = 0.0;
    std::vector<std::pair<std::string, std::string>> values;
    struct Body {
        std::string name;
        Eigen::Vector3d position;
        Eigen::Vector4d orientation;
    };
    std::vector<Body> bodies;
};

void PrintTo(const Reference& one, std::ostream* out) {
    *out << one.name;
}

Reference read(const std::filesystem::path& path) {
    Reference result;
    result.name = path.stem().string();
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
        std::istringstream words(line);
        std::string first, second, skipped;
        words >> first >> second;
        if (first == "#" && second.starts_with("examples/")) {
            result.scene = second;
            words >> skipped >> skipped >> skipped >> result.end;  // "at t ="
        } else if (first == "#" && second == "with") {
            words >> second;
            const auto equals = second.find('=');
            result.values.emplace_back(second.substr(0, equals), second.substr(equals + 1));
        } else if (first != "#") {
            std::istringstream numbers(line.substr(first.size()));
            Reference::Body body{first, {}, {}};
            for (double& value : body.position) numbers >> value;
            for (double& value : body.orientation) numbers >> value;
            EXPECT_TRUE(numbers) << line;
            result.bodies.push_back(body);
        }
    }
    return result;
}

std::vector<Reference> references() {
    std::vector<Reference> all;
    for (const auto& entry : std::filesystem::directory_iterator(root / "docs/references"))
        all.push_back(read(entry.path()));
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
    return all;
}

/// The largest difference of positions and orientations (m, rad) at the end.
double off(const Reference& reference, const std::vector<std::pair<std::string, std::string>>& values) {
    SceneOverrides overrides;
    overrides.values = reference.values;
    overrides.values.insert(overrides.values.end(), values.begin(), values.end());
    overrides.end = reference.end;
    Registry registry;
    Scene scene = read_scene(root / reference.scene, overrides);
    Simulation simulation(scene.systems[0], registry);
    while (!simulation.finished()) simulation.step();
    const MultibodySystem& system = *scene.systems[0].system;
    double worst = 0.0;
    for (const auto& body : reference.bodies) {
        const Pose pose = system.pose(simulation.state(), system.find_body(body.name));
        const Eigen::Map<const Eigen::Vector3d> position(pose.position.data());
        const Eigen::Map<const Eigen::Vector4d> orientation(pose.orientation.data());
        const double sign = orientation.dot(body.orientation) < 0.0 ? -1.0 : 1.0;
        worst = std::max({worst, (position - body.position).cwiseAbs().maxCoeff(),
                          2.0 * (sign * orientation - body.orientation).cwiseAbs().maxCoeff()});
    }
    return worst;
}

class References : public testing::TestWithParam<Reference> {};

TEST_P(References, AreMetByTolerance) {
    ASSERT_GE(GetParam().bodies.size(), 1U);
    // The spatial slider-crank magnifies errors by 2000 (docs/references.md).
    const double factor = GetParam().name == "spatial_slider_crank" ? 40.0 : 10.0;
    for (const double tolerance : {1e-4, 1e-7}) {
        const double error = off(GetParam(), {{"integrator", "dormand_prince"},
                                              {"coordinates", "joint"},
                                              {"step", "{initial: 1.0e-5, smallest: 1.0e-10, largest: 0.05}"},
                                              {"tolerance", fmt::format("{{absolute: {}}}", tolerance)}});
        EXPECT_LE(error, factor * tolerance + 1e-9);
    }
}

TEST_P(References, AreMetByRadauIIA) {
    if (GetParam().name == "forty_four_bars") GTEST_SKIP() << "takes ten seconds";
    const double tolerance = 1e-5, factor = GetParam().name == "spatial_slider_crank" ? 40.0 : 10.0;
    const double error = off(GetParam(), {{"integrator", "radau_iia"},
                                          {"coordinates", "joint"},
                                          {"step", "{initial: 1.0e-5, smallest: 1.0e-10, largest: 0.05}"},
                                          {"tolerance", fmt::format("{{absolute: {}}}", tolerance)}});
    EXPECT_LE(error, factor * tolerance);
}

// Sizes of the mechanisms are 1 m or less, or their errors are small.
TEST_P(References, AreMetByAccuracy) {
    if (GetParam().name == "forty_four_bars") GTEST_SKIP() << "takes ten seconds";
    const double factor = GetParam().name == "spatial_slider_crank" ? 40.0 : 10.0;
    const double step = std::min(0.01, 0.01 * GetParam().end);
    for (const double accuracy : {1e-1, 1e-3, 1e-5}) {
        const double error = off(GetParam(), {{"integrator", "auto"},
                                              {"coordinates", "auto"},
                                              {"step", std::to_string(step)},
                                              {"accuracy", std::to_string(accuracy)}});
        EXPECT_LE(error, factor * accuracy * std::max(GetParam().end, 1.0)) << accuracy;
    }
}

TEST_P(References, AreMetByScenesThatNameNothing) {
    const double step = std::min(0.01, 0.01 * GetParam().end);
    const double error =
        off(GetParam(), {{"integrator", "auto"}, {"coordinates", "auto"}, {"step", std::to_string(step)}});
    EXPECT_LE(error, 4e-3);
}

INSTANTIATE_TEST_SUITE_P(Mechanisms, References, testing::ValuesIn(references()),
                         [](const auto& one) { return one.param.name; });

TEST(ReferenceFiles, AreAllThere) {
    EXPECT_EQ(references().size(), 13U);
}

}  // namespace
}  // namespace delassus::tests::references_test
