// SPDX-License-Identifier: BSD-3-Clause
// Motions of imported scenes beside those of libmujoco.
#include "import/imported.hpp"
#include "support/scenes.hpp"

#ifdef DELASSUS_HAS_MUJOCO

namespace delassus::tests {
namespace beside_mujoco_in_time {

/// The largest distance of a mass centre from MuJoCo's after a second, with steps of this many parts of it.
double distance(const std::string& file, const std::string& method, int steps) {
    static std::map<std::string, std::map<std::string, Vector3d>> known;
    auto& places = known[file];
    if (places.empty()) {
        const MjModel m = mujoco_model(model_file(file));
        const MjData d(mj_makeData(m.get()), mj_deleteData);
        m->opt.integrator = mjINT_RK4;
        m->opt.timestep = 1e-4;
        for (int k = 0; k < 10000; ++k) mj_step(m.get(), d.get());
        mj_kinematics(m.get(), d.get());
        for (int body = 1; body < m->nbody; ++body)
            places[mj_id2name(m.get(), mjOBJ_BODY, body)] = Vector3d(d->xipos + 3 * body);
    }
    const ScratchFolder folder;
    const ImportedScene text = import_model(model_file(file), folder / "scene.yaml");
    SceneOverrides overrides;
    overrides.integrator = method;
    overrides.step = 1.0 / steps;
    overrides.end = 1.0;
    Running run(parse_scene(text.yaml, "scene", overrides));
    run.finish();
    double most = 0.0;
    for (BodyIndex body = 0; body < run.system().body_count(); ++body) {
        const auto there = places.find(run.system().body(body).name);
        if (there == places.end()) continue;
        const Pose pose = run.system().pose(run.simulation.state(), body);
        most = std::max(most, (Vector3d(pose.position.data()) - there->second).norm());
    }
    return most;
}

TEST(ImportedMotion, ConvergesToThatOfMujocoWithTheOrderOfTheMethod) {
    struct Row {
        const char* file;
        const char* method;
        int steps;
        double order, error;
    };
    for (const Row& row :
         {Row{"pendulum.xml", "rk4", 50, 4.0, 1e-7}, Row{"pendulum.xml", "trapezoidal", 200, 2.0, 2e-4},
          Row{"double_pendulum.xml", "rk4", 100, 4.0, 1e-7}, Row{"double_pendulum.xml", "trapezoidal", 400, 2.0, 1e-4},
          Row{"ball_chain.xml", "rk4", 50, 4.0, 1e-5}}) {
        const double coarse = distance(row.file, row.method, row.steps),
                     fine = distance(row.file, row.method, 2 * row.steps);
        const double order = std::log2(coarse / fine);
        EXPECT_GT(order, row.order - 0.2) << row.file << " " << row.method << " " << coarse;
        EXPECT_LT(order, row.order + 0.5) << row.file << " " << row.method << " " << coarse;
        EXPECT_LE(fine, row.error) << row.file << " " << row.method;
    }
}

// The servo of a slider-crank closes a loop: that of MuJoCo is soft, and its crank turns as this one within the
// softness.
TEST(ImportedMotion, OfALoopIsThatOfMujocoWithinItsSoftness) {
    const MjModel m = mujoco_model(model_file("slider_crank.xml"));
    const MjData d(mj_makeData(m.get()), mj_deleteData);
    mj_resetDataKeyframe(m.get(), d.get(), 0);
    for (int k = 0; k < 500; ++k) mj_step(m.get(), d.get());
    mj_kinematics(m.get(), d.get());
    const ScratchFolder folder;
    ImportSettings settings;
    settings.keyframe = "turning";
    settings.end = 0.5;
    Running run(
        parse_scene(import_model(model_file("slider_crank.xml"), folder / "scene.yaml", settings).yaml, "scene"));
    run.finish();
    const int slider = mj_name2id(m.get(), mjOBJ_BODY, "slider");
    EXPECT_GT(std::abs(d->xipos[3 * slider] - 0.4), 0.02);  // it moved
    EXPECT_NEAR(run.pose("slider").position[0], d->xipos[3 * slider], 2e-3);
}

// Everything falls on the ground and stays there.
TEST(ImportedMotion, OfFreeBodiesEndsOnTheGround) {
    const ScratchFolder folder;
    ImportSettings settings;
    settings.end = 1.5;
    Running run(
        parse_scene(import_model(model_file("free_bodies.xml"), folder / "scene.yaml", settings).yaml, "scene"));
    run.finish();
    for (const char* name : {"box", "ball", "rod", "drum", "egg"}) {
        EXPECT_GT(run.pose(name).position[2], 0.04) << name;
        EXPECT_LT(run.pose(name).position[2], 0.25) << name;
    }
}

}  // namespace beside_mujoco_in_time
}  // namespace delassus::tests

#endif
