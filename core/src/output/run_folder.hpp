// SPDX-License-Identifier: BSD-3-Clause
// The folder that `delassus run -o` fills (docs/running.md): scene.yaml, trajectory.h5, scene.pvd with vtk/,
// checkpoint.json, report.json, problems/.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
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
    /// Without another wish so many pictures are written, or as many as take so many bytes, but at least twenty.
    static constexpr std::int64_t default_pictures = 200, default_picture_bytes = 200'000'000;

    /// Begins a new run in the folder, which must be absent, empty, or hold an earlier run, which is removed.
    /// scene_text: of the file, kept as scene.yaml. The simulations outlive the folder. every: how many steps there are
    /// from frame to frame. contact_forces: whether frames have them. pictures: about how many frames, evenly in time,
    /// are written for ParaView too; a picture of 1000 spheres takes 1.5 MB.
    RunFolder(std::filesystem::path folder, const Scene& scene, const std::string& scene_text,
              std::vector<Simulation>& simulations, std::int64_t every, bool contact_forces = false,
              std::optional<std::int64_t> pictures = {});
    /// Goes on with the run in the folder, with contact forces if it has them: puts the simulations where its
    /// checkpoint is, and cuts off what was written after it. Throws InputError if there is none or if it belongs to
    /// another scene.
    RunFolder(std::filesystem::path folder, const Scene& scene, std::vector<Simulation>& simulations,
              std::int64_t every, std::optional<std::int64_t> pictures = {});
    /// The checkpoint of a run folder. Throws InputError if there is none or if it belongs to another scene.
    [[nodiscard]] static Checkpoint checkpoint_of(const std::filesystem::path& folder, const Scene& scene);
    ~RunFolder();
    RunFolder(const RunFolder&) = delete;
    RunFolder& operator=(const RunFolder&) = delete;

    /// Also writes the problem with rows of every `every`-th step, counted from step one.
    void dump_problems(std::int64_t every);

    /// Takes note of the step that the simulation has just taken.
    void add_step(std::size_t system);
    /// Whether the last checkpoint is some seconds old.
    [[nodiscard]] bool checkpoint_is_due() const;

    /// Everything on disk, up to the last step taken. Where bodies are shared, after Simulation::gather().
    void checkpoint();

    [[nodiscard]] bool contact_forces() const { return contact_forces_; }

    void write_report(const std::string& json) const;

private:
    void open(const Scene& scene, bool resume, std::optional<std::int64_t> pictures);
    void add_frame(std::size_t system);
    [[nodiscard]] bool picture_is_due(std::size_t system) const;

    std::filesystem::path folder_;
    std::string scene_;
    std::vector<Simulation>& simulations_;
    std::int64_t every_;
    bool contact_forces_ = false;
    std::int64_t most_pictures_ = 0;
    std::vector<std::vector<double>> frame_times_, picture_times_;
    std::vector<VtkSeries> series_;
    std::unique_ptr<TrajectoryWriter> trajectory_;
    std::chrono::steady_clock::time_point last_checkpoint_;
};

}  // namespace delassus
