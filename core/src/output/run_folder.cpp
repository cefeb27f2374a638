// SPDX-License-Identifier: BSD-3-Clause
#include "output/run_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "delassus/error.hpp"
#include "delassus/problem_files.hpp"
#include "output/system_model.hpp"
#include "support/atomic_file.hpp"

namespace delassus {
namespace {

namespace fs = std::filesystem;

/// The names in a run folder. `delassus view` makes scene.html from the others.
constexpr std::array<std::string_view, 8> own_files = {"checkpoint.json", "scene.yaml", "trajectory.h5", "scene.pvd",
                                                       "report.json",     "vtk",        "problems",      "scene.html"};
constexpr std::chrono::seconds between_checkpoints{5};

/// Makes the folder, or empties that of an earlier run.
void prepare(const fs::path& folder) {
    std::error_code error;
    if (fs::exists(folder, error)) {
        if (!fs::is_directory(folder, error))
            throw InputError(fmt::format("{} is a file; -o needs a folder", folder.string()));
        for (const auto& entry : fs::directory_iterator(folder))
            if (std::find(own_files.begin(), own_files.end(), entry.path().filename().string()) == own_files.end())
                throw InputError(fmt::format("{} holds {}, which no run wrote; choose another folder", folder.string(),
                                             entry.path().filename().string()));
        for (const auto name : own_files) fs::remove_all(folder / name, error);
    }
    fs::create_directories(folder / "vtk", error);
    if (error) throw InputError(fmt::format("{} cannot be made: {}", folder.string(), error.message()));
}

/// The default number of pictures of all systems.
std::int64_t worth_writing(const std::vector<VtkSeries>& series) {
    constexpr std::int64_t fewest = 20;
    std::int64_t bytes = 0;
    for (const VtkSeries& one : series) bytes += one.picture_bytes();
    return std::clamp(RunFolder::default_picture_bytes / std::max<std::int64_t>(bytes, 1), fewest,
                      RunFolder::default_pictures);
}

}  // namespace

RunFolder::RunFolder(fs::path folder, const Scene& scene, const std::string& scene_text,
                     std::vector<Simulation>& simulations, std::int64_t every, bool contact_forces,
                     std::optional<std::int64_t> pictures)
    : folder_(std::move(folder)),
      scene_(scene.canonical),
      simulations_(simulations),
      every_(every),
      contact_forces_(contact_forces) {
    prepare(folder_);
    write_file_atomically(folder_ / "scene.yaml", scene_text);
    frame_times_.resize(simulations.size());
    picture_times_.resize(simulations.size());
    open(scene, false, pictures);
    for (std::size_t i = 0; i < simulations_.size(); ++i) {
        trajectory_->add_step(i, simulations_[i].record());
        add_frame(i);
    }
    checkpoint();
}

RunFolder::RunFolder(fs::path folder, const Scene& scene, std::vector<Simulation>& simulations, std::int64_t every,
                     std::optional<std::int64_t> pictures)
    : folder_(std::move(folder)), scene_(scene.canonical), simulations_(simulations), every_(every) {
    Checkpoint checkpoint = checkpoint_of(folder_, scene);
    contact_forces_ = checkpoint.contact_forces;
    for (std::size_t i = 0; i < simulations.size(); ++i) {
        frame_times_.push_back(std::move(checkpoint.systems[i].frame_times));
        picture_times_.push_back(std::move(checkpoint.systems[i].picture_times));
        simulations[i].load(std::move(checkpoint.systems[i].simulation));
    }
    open(scene, true, pictures);
}

Checkpoint RunFolder::checkpoint_of(const fs::path& folder, const Scene& scene) {
    Checkpoint checkpoint = read_checkpoint(folder / "checkpoint.json");
    if (checkpoint.scene != scene.canonical || checkpoint.systems.size() != scene.systems.size())
        throw InputError(
            fmt::format("the run in {} was of another scene, or with other settings; give the same "
                        "scene, --set, --solver, --integrator and --step (--end may differ)",
                        folder.string()));
    return checkpoint;
}

RunFolder::~RunFolder() = default;

void RunFolder::open(const Scene& scene, bool resume, std::optional<std::int64_t> pictures) {
    std::vector<TrajectorySystem> systems;
    for (std::size_t i = 0; i < simulations_.size(); ++i) {
        const SceneSystem& system = scene.systems[i];
        systems.push_back({system.name, system.integrator, system.solver.name, system.system->position_size(),
                           system.system->n(), system.step, trajectory_model(system), contact_forces_,
                           simulations_[i].record().step + 1, static_cast<std::int64_t>(frame_times_[i].size())});
        series_.emplace_back(folder_ / "vtk", system.name, *system.system);
    }
    most_pictures_ = pictures.value_or(worth_writing(series_));
    trajectory_ = open_trajectory(folder_ / "trajectory.h5", systems, resume);
    last_checkpoint_ = std::chrono::steady_clock::now();
}

void RunFolder::dump_problems(std::int64_t every) {
    std::error_code error;
    fs::create_directories(folder_ / "problems", error);
    if (error) throw InputError(fmt::format("{}/problems cannot be made: {}", folder_.string(), error.message()));
    for (auto& simulation : simulations_) {
        simulation.solver().on_problem = [this, every, &simulation, step = std::int64_t{-1},
                                          solve = 0](const Problem& problem) mutable {
            const std::int64_t now = simulation.record().step + 1;
            if (now % every != 0 || problem.m() == 0) return;
            solve = now == step ? solve + 1 : 1;
            step = now;
            const auto name = solve == 1 ? fmt::format("{}_{:06}", simulation.system().name, now)
                                         : fmt::format("{}_{:06}_{}", simulation.system().name, now, solve);
            Problem copy = problem;
            copy.name = name;
            copy.source = fmt::format("step {} of system {} from t = {:.17g} s, solve {}", now,
                                      simulation.system().name, simulation.state().t, solve);
            write_problem(copy, folder_ / "problems" / name);
        };
    }
}

void RunFolder::add_step(std::size_t system) {
    const Simulation& simulation = simulations_[system];
    trajectory_->add_step(system, simulation.record());
    if (simulation.record().step % every_ == 0) add_frame(system);
}

bool RunFolder::checkpoint_is_due() const {
    return std::chrono::steady_clock::now() - last_checkpoint_ > between_checkpoints;
}

void RunFolder::add_frame(std::size_t system) {
    const Simulation& simulation = simulations_[system];
    const MultibodySystem& mechanics = *simulation.system().system;
    std::vector<Pose> poses;
    for (BodyIndex body = 0; body < mechanics.body_count(); ++body)
        poses.push_back(mechanics.pose(simulation.state(), body));
    const auto contacts = simulation.contacts();
    trajectory_->add_frame(system, simulation.state(), poses, contacts);
    frame_times_[system].push_back(simulation.state().t);
    if (!picture_is_due(system)) return;
    const auto number = static_cast<std::int64_t>(picture_times_[system].size());
    series_[system].write(number, simulation.state());
    if (contact_forces_) series_[system].write_contacts(number, simulation.state().t, contacts);
    picture_times_[system].push_back(simulation.state().t);
}

bool RunFolder::picture_is_due(std::size_t system) const {
    if (most_pictures_ == 0) return false;
    if (picture_times_[system].empty()) return true;
    const double end = simulations_[system].system().end, t = simulations_[system].state().t;
    const double between = end / static_cast<double>(most_pictures_);
    return t - picture_times_[system].back() >= (1.0 - 1e-9) * between;
}

void RunFolder::checkpoint() {
    trajectory_->flush();
    std::vector<VtkCollectionPart> parts;
    Checkpoint checkpoint{scene_, {}, contact_forces_};
    for (std::size_t i = 0; i < simulations_.size(); ++i) {
        parts.push_back({&series_[i], &picture_times_[i], contact_forces_});
        checkpoint.systems.push_back(
            {simulations_[i].system().name, simulations_[i].save(), frame_times_[i], picture_times_[i]});
    }
    write_vtk_collection(folder_ / "scene.pvd", "vtk", parts);
    write_checkpoint(checkpoint, folder_ / "checkpoint.json");
    last_checkpoint_ = std::chrono::steady_clock::now();
}

void RunFolder::write_report(const std::string& json) const {
    write_file_atomically(folder_ / "report.json", json);
}

}  // namespace delassus
