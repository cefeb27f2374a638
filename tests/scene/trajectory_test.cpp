// SPDX-License-Identifier: BSD-3-Clause
// trajectory.h5 holds what was simulated, and goes on after a resume.
#ifdef DELASSUS_HAS_HDF5
#include <gtest/gtest.h>
#include <hdf5.h>

#include <algorithm>

#include "output/recorded.hpp"
#include "output/run_folder.hpp"
#include "support/run_command.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::trajectory_test {
namespace {

struct Dataset {
    std::vector<hsize_t> shape;
    std::vector<double> values;
    std::string unit;
};

Dataset read_dataset(const std::filesystem::path& path, const std::string& name) {
    Dataset result;
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    EXPECT_GE(file, 0);
    const hid_t set = H5Dopen2(file, name.c_str(), H5P_DEFAULT), space = H5Dget_space(set);
    EXPECT_GE(set, 0) << name;
    result.shape.resize(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space)));
    H5Sget_simple_extent_dims(space, result.shape.data(), nullptr);
    result.values.resize(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
    H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, result.values.data());
    const hid_t attribute = H5Aopen(set, "unit", H5P_DEFAULT), type = H5Aget_type(attribute);
    result.unit.resize(H5Tget_size(type));
    H5Aread(attribute, type, result.unit.data());
    H5Tclose(type);
    H5Aclose(attribute);
    H5Sclose(space);
    H5Dclose(set);
    H5Fclose(file);
    return result;
}

SceneOverrides until(double end) {
    SceneOverrides overrides;
    overrides.end = end;
    return overrides;
}

TEST(Trajectory, HoldsStepsAndFramesAndGoesOn) {
    const ScratchFolder scratch;
    const auto folder = scratch / "run", file = folder / "trajectory.h5";
    std::vector<double> energies, momenta;
    State last;
    const auto run = [&](double end, bool resume, bool forget_the_end) {
        Scene scene = read_scene(example_scene("pendulum"), until(end));
        std::vector<Simulation> simulations;
        simulations.emplace_back(scene.systems[0], registry());
        auto output = resume ? std::make_unique<RunFolder>(folder, scene, simulations, RunOutput{5})
                             : std::make_unique<RunFolder>(folder, scene, "text", simulations, RunOutput{5});
        if (!resume) energies = {simulations[0].record().energy};
        if (!resume) momenta = {simulations[0].record().momentum[2]};
        energies.resize(static_cast<std::size_t>(simulations[0].record().step) + 1);
        momenta.resize(energies.size());
        while (!simulations[0].finished()) {
            energies.push_back(simulations[0].step().energy);
            momenta.push_back(simulations[0].record().momentum[2]);
            output->add_step(0);
            if (!forget_the_end || simulations[0].record().step == 7) output->checkpoint();
        }
        last = simulations[0].state();
    };
    run(0.012, false, true);  // checkpointed at step 7 of 12
    run(0.020, true, false);  // goes on from there

    const auto t = read_dataset(file, "/systems/main/steps/t");
    ASSERT_EQ(t.shape, std::vector<hsize_t>{21});
    EXPECT_EQ(t.unit, "s");
    for (std::size_t i = 0; i < 21; ++i) EXPECT_NEAR(t.values[i], 0.001 * static_cast<double>(i), 1e-15);
    const auto energy = read_dataset(file, "/systems/main/steps/energy");
    EXPECT_EQ(energy.values, energies);
    EXPECT_EQ(energy.unit, "J");
    const auto momentum = read_dataset(file, "/systems/main/steps/momentum");
    ASSERT_EQ(momentum.shape, (std::vector<hsize_t>{21, 3}));
    for (std::size_t i = 0; i < 21; ++i) EXPECT_EQ(momentum.values[3 * i + 2], momenta[i]);
    EXPECT_EQ(read_dataset(file, "/systems/main/steps/newton_iterations").values.back(), 1.0);

    const auto q = read_dataset(file, "/systems/main/frames/q");
    ASSERT_EQ(q.shape, (std::vector<hsize_t>{5, 7}));  // 0, 5, 10, 15, 20
    for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(q.values[4 * 7 + i], last.q[i]);
    const auto poses = read_dataset(file, "/systems/main/frames/poses");
    ASSERT_EQ(poses.shape, (std::vector<hsize_t>{5, 1, 7}));
    EXPECT_EQ(poses.values, q.values);  // the one body
    EXPECT_EQ(read_dataset(file, "/systems/main/frames/v").unit, "m/s, rad/s");
}

/// Runs a scene into the folder, in parts that end at `ends`, and returns the last state.
State run_into(const std::filesystem::path& folder, const std::string& scene, const std::vector<double>& ends) {
    State last;
    for (std::size_t part = 0; part < ends.size(); ++part) {
        Scene read = parse_scene(scene, "test", until(ends[part]));
        std::vector<Simulation> simulations;
        for (auto& system : read.systems) simulations.emplace_back(system, registry());
        auto output = part > 0 ? std::make_unique<RunFolder>(folder, read, simulations, RunOutput{2})
                               : std::make_unique<RunFolder>(folder, read, scene, simulations, RunOutput{2});
        while (!simulations[0].finished()) {
            simulations[0].step();
            output->add_step(0);
        }
        output->checkpoint();
        last = simulations[0].state();
    }
    return last;
}

constexpr const char* net = R"(
integrator: {name: euler_implicit_linearized, options: {linearization_limit: inf}}
step: 0.01
end: 0.1
bodies:
  - {name: ceiling, fixed: true, position: [0, 0, 3]}
  - {name: weight, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, position: [0, 1, 2], orientation: {axis: [0, 0, 1], angle: 90}}
nodes:
  - {name: hook, fixed: true, position: [4, 0, 1]}
  - {name: bead, mass: 1, position: [4, 0, 0.5], velocity: [0, 1, 0]}
elastic_blocks:
  - {name: block, corner: [2, 0, 0], edges: [0.2, 0.2, 0.2], cells: [1, 1, 1], order: 1, fixed_faces: [x_min]}
cables:
  - {name: string, nodes: [hook, bead]}
joints:
  - {name: hinge, kind: revolute, second: weight, point: [0, 0, 2], axis: [1, 0, 0]}
springs:
  - {name: coil, first: ceiling, second: weight, stiffness: 1}
)";

TEST(Trajectory, HoldsWhatAPictureNeeds) {
    const ScratchFolder scratch;
    const State last = run_into(scratch / "run", net, {0.1});
    const auto systems = read_trajectory(scratch / "run" / "trajectory.h5", {});
    ASSERT_EQ(systems.size(), 1u);
    const auto& model = systems[0].model;
    EXPECT_EQ(model.bodies, (std::vector<std::string>{"ceiling", "weight"}));
    EXPECT_EQ(model.fixed, (std::vector<std::int32_t>{1, 0}));
    EXPECT_EQ(model.gravity, (Vector3{0.0, 0.0, -9.81}));
    ASSERT_EQ(model.nodes.size(), 10u);
    EXPECT_EQ(model.loose, (std::vector<std::int32_t>{0, 1}));
    EXPECT_EQ(model.cables, (std::vector<std::array<std::int32_t, 2>>{{0, 1}}));
    EXPECT_EQ(model.surface.size(), 12u);
    EXPECT_EQ(model.nodes[0], (Vector3{4.0, 0.0, 1.0}));
    EXPECT_EQ(model.node_entry[0], -1);
    EXPECT_EQ(model.node_entry[1], 7);  // after the weight
    ASSERT_EQ(model.links.size(), 2u);
    EXPECT_EQ(model.links[0].kind, "revolute");
    // The hinge is 1 m from the weight against y of the world, which is x of its frame, turned by 90 degrees about z.
    EXPECT_EQ(model.links[0].points[0], (Vector3{0.0, 0.0, 2.0}));
    EXPECT_NEAR(model.links[0].points[1][0], -1.0, 1e-12);
    EXPECT_NEAR(model.links[0].points[1][1], 0.0, 1e-12);
    EXPECT_EQ(model.links[1].kind, "spring");
    EXPECT_EQ(model.links[1].points[0], (Vector3{0.0, 0.0, 0.0}));

    ASSERT_EQ(systems[0].t.size(), 6u);  // 0, 2, … 10
    EXPECT_NEAR(systems[0].t.back(), 0.1, 1e-12);
    ASSERT_EQ(systems[0].nodes.size(), 6u * 10u * 3u);
    const auto* bead = systems[0].nodes.data() + (5 * 10 + 1) * 3;
    EXPECT_EQ((Vector3{bead[0], bead[1], bead[2]}), (Vector3{last.q[7], last.q[8], last.q[9]}));
    const auto* hook = systems[0].nodes.data() + 5 * 10 * 3;
    EXPECT_EQ((Vector3{hook[0], hook[1], hook[2]}), model.nodes[0]);
    EXPECT_EQ(systems[0].steps, 10);
    ASSERT_EQ(systems[0].series.size(), 5u);
    EXPECT_EQ(systems[0].series[0].name, "energy");
    EXPECT_EQ(systems[0].series[0].values.size(), 11u);
}

TEST(Trajectory, ContactsGoOnAfterAResume) {
#ifndef DELASSUS_HAS_FCL
    GTEST_SKIP() << "built without FCL";
#endif
    const std::string scene = text_of(example_scene("brick_wall"));
    const ScratchFolder scratch;
    run_into(scratch / "whole", scene, {0.016});
    run_into(scratch / "parts", scene, {0.006, 0.016});
    const auto whole = read_trajectory(scratch / "whole" / "trajectory.h5", {});
    const auto parts = read_trajectory(scratch / "parts" / "trajectory.h5", {});
    EXPECT_EQ(whole[0].t, parts[0].t);
    EXPECT_EQ(whole[0].contact_end, parts[0].contact_end);
    EXPECT_EQ(whole[0].contacts, parts[0].contacts);
    ASSERT_EQ(whole[0].contact_end.size(), 5u);
    EXPECT_EQ(whole[0].contact_end[0], 0);  // none is known before the first step
    // Each of 14 bricks stands on the ground or on others, and stays where it is.
    EXPECT_GE(whole[0].contact_end[1], 14 * 4);
    double lowest = 1.0;
    for (std::size_t i = 2; i < whole[0].contacts.size(); i += 3) lowest = std::min(lowest, whole[0].contacts[i]);
    EXPECT_NEAR(lowest, 0.0, 1e-3);
    const auto gap = read_dataset(scratch / "parts" / "trajectory.h5", "/systems/main/contacts/gap");
    EXPECT_EQ(gap.shape[0], static_cast<hsize_t>(parts[0].contact_end.back()));

    // Every second frame has the contacts of its own.
    const auto thinned = read_trajectory(scratch / "whole" / "trajectory.h5", {.frames = 3});
    ASSERT_EQ(thinned[0].t, (std::vector<double>{whole[0].t[0], whole[0].t[2], whole[0].t[4]}));
    const auto of_frame = [&](const RecordedSystem& system, std::size_t frame) {
        const auto first = frame == 0 ? 0 : system.contact_end[frame - 1];
        return std::vector<double>(system.contacts.begin() + 3 * first,
                                   system.contacts.begin() + 3 * system.contact_end[frame]);
    };
    EXPECT_EQ(of_frame(thinned[0], 1), of_frame(whole[0], 2));
    EXPECT_EQ(of_frame(thinned[0], 2), of_frame(whole[0], 4));
}

TEST(Trajectory, ThinningKeepsTheExtremes) {
    const ScratchFolder scratch;
    run_into(scratch / "run", text_of(example_scene("pendulum")), {0.5});
    const auto file = scratch / "run" / "trajectory.h5";
    const auto all = read_trajectory(file, {}), thin = read_trajectory(file, {.frames = 2, .points = 20});
    const auto& drift = all[0].series[1];
    ASSERT_EQ(drift.values.size(), 501u);
    ASSERT_EQ(thin[0].series[1].values.size(), 20u);
    EXPECT_EQ(std::ranges::max(thin[0].series[1].values), std::ranges::max(drift.values));
    EXPECT_TRUE(std::ranges::is_sorted(thin[0].series[1].t));
    EXPECT_EQ(thin[0].t, (std::vector<double>{all[0].t.front(), all[0].t.back()}));
}

}  // namespace
}  // namespace delassus::tests::trajectory_test
#endif
