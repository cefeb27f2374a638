// SPDX-License-Identifier: BSD-3-Clause
// Models in MJCF, URDF and SDF beside libmujoco: what is carried over, and what is listed as lost.
#include "import/imported.hpp"

#include <sstream>

#ifdef DELASSUS_HAS_MUJOCO

namespace delassus::tests {
namespace beside_mujoco {

struct Case {
    std::string file;
    std::vector<std::string> lost;
    /// Whether MuJoCo's accelerations are those of the scene without its rows: no limited actuators, no losses that
    /// act.
    bool accelerations = true;
    std::string twin = {};  ///< what MuJoCo reads; empty: the same
    std::string keyframe = {};
    bool floating = false;
    std::map<std::string, double> reference = {};
    double tolerance = 1e-9;
};

std::ostream& operator<<(std::ostream& out, const Case& one) {
    return out << one.file << one.keyframe;
}

class ModelBesideMujoco : public testing::TestWithParam<Case> {};

TEST_P(ModelBesideMujoco, HasItsMassMatrixPosesAccelerationsAndLosses) {
    const Case& one = GetParam();
    ImportSettings settings;
    settings.keyframe = one.keyframe;
    settings.floating = one.floating;
    Imported imported(model_file(one.file), settings);
    EXPECT_EQ(items(imported.text.lost), one.lost) << imported.text.yaml;
    for (const auto& item : grouped(imported.text.lost)) {
        EXPECT_FALSE(item.why.empty());
        EXPECT_NE(imported.text.yaml.find("#   " + item.what + ": " + item.why + "\n"), std::string::npos) << item.what;
    }
    const MjModel m = mujoco_model(model_file(one.twin.empty() ? one.file : one.twin));
    ASSERT_TRUE(m);
    Beside both(imported.system(), *m, one.reference, one.keyframe.empty() ? -1 : 0, one.tolerance);
    std::mt19937 random(7);
    for (int k = 0; k < 20; ++k) {
        const State state = both.draw(random);
        both.compare(state);
        if (one.accelerations) both.compare_accelerations(state);
        if (HasFatalFailure()) return;
    }
    std::ostringstream text;
    text << both.worst_mass << " " << both.worst_pose << " " << both.worst_acceleration;
    RecordProperty("mass_pose_acceleration", text.str());
}

/// `delassus run` takes each scene as it is written.
TEST_P(ModelBesideMujoco, RunsAsWritten) {
    const Case& one = GetParam();
    const ScratchFolder folder;
    const auto scene = (folder / "scene.yaml").string();
    std::string options = one.keyframe.empty() ? "" : " --keyframe " + one.keyframe;
    if (one.floating) options += " --floating";
    const auto made = run_command("import " + model_file(one.file).string() + " -o " + scene + " --end 0.05" + options);
    ASSERT_EQ(made.exit_code, 0) << made.err;
    for (const auto& item : one.lost) EXPECT_NE(made.out.find(item), std::string::npos) << made.out;
    const auto ran = run_command("run " + scene);
    EXPECT_EQ(ran.exit_code, 0) << ran.out << ran.err;
    const auto strict = run_command("import " + model_file(one.file).string() + " --strict -o " +
                                    (folder / "strict.yaml").string() + options);
    EXPECT_EQ(strict.exit_code, one.lost.empty() ? 0 : 2) << strict.err;
    EXPECT_EQ(std::filesystem::exists(folder / "strict.yaml"), one.lost.empty());
}

const Case mjcf[] = {
    {"pendulum.xml", {}},
    {"double_pendulum.xml", {}},
    {"cart_pole.xml", {"actuator \"push\""}},
    {"arm.xml", {}},
    {"arm.xml", {}, true, "", "bent"},
    {"humanoid.xml",
     {"joint \"right_knee\"", "joint \"left_knee\"", "actuator \"right_knee\"", "actuator \"left_knee\""}},
    {"four_bar.xml", {}},
    {"welded_loop.xml", {}},
    {"slider_crank.xml", {}, true, "", "turning"},
    {"gripper.xml", {"equality \"curve\"", "actuator \"grip\""}, false},
    {"free_bodies.xml", {"geom \"drum\"", "geom \"egg\"", "geom \"egg\"", "geom \"egg\""}},
    {"quadruped.xml", {}, false},
    {"quadruped.xml", {}, false, "", "stand"},
    {"meshes.xml", {}, true, "", "", false, {}, 1e-6},
    {"everything.xml", {}, true, "", "", false, {}, 1e-7},
    {"ball_chain.xml", {}},
    {"losses.xml",
     {"option density, viscosity", "body \"hand\"", "joint \"many_turns\"", "joint \"ball\"", "joint \"ball\"",
      "joint \"ball\"", "joint \"drone\"", "geom \"arm\"", "equality \"winch\"", "equality \"tied\"",
      "actuator \"torque\"", "actuator \"on_rope\"", "actuator \"on_site\"", "actuator \"on_ball\"",
      "actuator \"muscle\"", "actuator \"filtered\"", "tendon \"rope\""},
     false}};
INSTANTIATE_TEST_SUITE_P(Mjcf, ModelBesideMujoco, testing::ValuesIn(mjcf));

#ifdef DELASSUS_HAS_URDF
const Case urdf[] = {
    {"arm.urdf", {}},
    {"rover.urdf", {}},
    {"gripper.urdf", {"body \"cap\""}, true, "gripper_twin.urdf", "", false, {{"fingertip", 0.2}}},
};
INSTANTIATE_TEST_SUITE_P(Urdf, ModelBesideMujoco, testing::ValuesIn(urdf));
#endif

#ifdef DELASSUS_HAS_SDF
const Case sdf[] = {
    {"double_pendulum.sdf", {}, true, "double_pendulum_twin.xml"},
    {"four_bar.sdf", {}, true, "four_bar_twin.xml"},
    {"trailer.sdf", {"joint \"trailer::thread\"", "plugin \"drive\" of model \"trailer\""}, true, "trailer_twin.xml"}};
INSTANTIATE_TEST_SUITE_P(Sdf, ModelBesideMujoco, testing::ValuesIn(sdf));
#endif

}  // namespace beside_mujoco
}  // namespace delassus::tests

#endif
