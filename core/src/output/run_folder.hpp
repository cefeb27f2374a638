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
#include "support/output_folder.hpp"

namespace delassus {

/// What shapes the output of a run. What is absent is chosen, or as it was in a run that goes on.
struct RunOutput {
    std::optional<std::int64_t> every{};     ///< steps from frame to frame; 1
    std::optional<std::int64_t> pictures{};  ///< about how many frames, evenly in time, are written for ParaView too; a
                                             ///< picture of 1000 spheres takes 1.5 MB
    std::optional<std::int64_t> dump{};  ///< the problems with rows of every step so many apart, from step one; none
    bool contact_forces = false;         ///< whether frames have them
};

class DELASSUS_API RunFolder {
public:
    /// Without another wish so many pictures are written, or as many as take so many bytes, but at least twenty.
    static constexpr std::int64_t default_pictures = 200, default_picture_bytes = 200'000'000;

    /// Begins a new run in the folder, which must be absent, empty, or hold an earlier run, which is removed.
    /// scene_text: of the file, kept as scene.yaml. The simulations outlive the folder.
    RunFolder(const std::filesystem::path& folder, const Scene& scene, const std::string& scene_text,
              std::vector<Simulation>& simulations, const RunOutput& output = {});
    /// Goes on with the run in the folder: puts the simulations where its checkpoint is. What was written after it is
    /// cut off where the first step is written; until then nothing is changed. Throws InputError if there is no
    /// checkpoint, if it belongs to another scene, if it or the trajectory is not what was written, or if contact
    /// forces are wanted that it does not have.
    RunFolder(const std::filesystem::path& folder, const Scene& scene, std::vector<Simulation>& simulations,
              const RunOutput& output = {});
    /// The checkpoint of a run folder. Throws InputError if there is none or if it belongs to another scene.
    [[nodiscard]] static Checkpoint checkpoint_of(const std::filesystem::path& folder, const Scene& scene);
    ~RunFolder();
    RunFolder(const RunFolder&) = delete;
    RunFolder& operator=(const RunFolder&) = delete;

    /// Takes note of the step that the simulation has just taken.
    void add_step(std::size_t system);
    /// Whether the last checkpoint is some seconds old.
    [[nodiscard]] bool checkpoint_is_due() const;

    /// Everything on disk, up to the last step taken. Where bodies are shared, after Simulation::gather().
    void checkpoint();

    void write_report(const std::string& json);

private:
    void open(const Scene& scene, std::optional<Checkpoint> resumed, const RunOutput& output);
    void dump_problems();
    void add_frame(std::size_t system);
    [[nodiscard]] bool picture_is_due(std::size_t system) const;

    OutputFolder folder_;
    std::string scene_;
    std::vector<Simulation>& simulations_;
    std::int64_t every_ = 1;
    bool contact_forces_ = false;
    std::int64_t most_pictures_ = 0;
    std::optional<std::int64_t> dump_;
    std::vector<std::vector<double>> frame_times_, picture_times_;
    std::vector<VtkSeries> series_;
    std::unique_ptr<TrajectoryWriter> trajectory_;
    std::chrono::steady_clock::time_point last_checkpoint_;
};

}  // namespace delassus
