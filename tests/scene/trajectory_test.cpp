// SPDX-License-Identifier: BSD-3-Clause
// trajectory.h5 holds what was simulated, and goes on after a resume.
#ifdef DELASSUS_HAS_HDF5
#include <gtest/gtest.h>
#include <hdf5.h>

#include "scene/run_folder.hpp"
#include "support/run_command.hpp"
#include "support/scenes.hpp"

namespace delassus::tests {
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
        auto output = resume ? std::make_unique<RunFolder>(folder, scene, simulations, 5)
                             : std::make_unique<RunFolder>(folder, scene, "text", simulations, 5);
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

}  // namespace
}  // namespace delassus::tests
#endif
