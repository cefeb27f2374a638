// SPDX-License-Identifier: BSD-3-Clause
// The folder that `delassus run -o` fills (docs/running.md): scene.yaml, trajectory.h5, scene.pvd with vtk/,
// checkpoint.json, report.json, problems/.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/simulation.hpp"
#include "output/trajectory.hpp"
#include "output/vtk_series.hpp"
#include "simulation/checkpoint.hpp"

namespace delassus {

class DELASSUS_API RunFolder {
public:
    /// Begins a new run in the folder, which must be absent, empty, or hold an earlier run, which is removed.
    /// scene_text: of the file, kept as scene.yaml. The simulations outlive the folder. contact_forces: whether frames
    /// have them.
    RunFolder(std::filesystem::path folder, const Scene& scene, const std::string& scene_text,
              std::vector<Simulation>& simulations, std::int64_t every, bool contact_forces = false);
    /// Goes on with the run in the folder, with contact forces if it has them: puts the simulations where its
    /// checkpoint is, and cuts off what was written after it. Throws InputError if there is none or if it belongs to
    /// another scene.
    RunFolder(std::filesystem::path folder, const Scene& scene, std::vector<Simulation>& simulations,
              std::int64_t every);
    ~RunFolder();
    RunFolder(const RunFolder&) = delete;
    RunFolder& operator=(const RunFolder&) = delete;

    /// Also writes the problem with rows of every `every`-th step, counted from step one.
    void dump_problems(std::int64_t every);

    /// Takes note of the step that the simulation has just taken. Checkpoints every few seconds.
    void add_step(std::size_t system);

    /// Everything on disk, up to the last step taken.
    void checkpoint();

    [[nodiscard]] bool contact_forces() const { return contact_forces_; }

    void write_report(const std::string& json) const;

private:
    void open(const Scene& scene, bool resume);
    void add_frame(std::size_t system);

    std::filesystem::path folder_;
    std::string scene_;
    std::vector<Simulation>& simulations_;
    std::int64_t every_;
    bool contact_forces_ = false;
    std::vector<std::vector<double>> frame_times_;
    std::vector<VtkSeries> series_;
    std::unique_ptr<TrajectoryWriter> trajectory_;
    std::chrono::steady_clock::time_point last_checkpoint_;
};

}  // namespace delassus
