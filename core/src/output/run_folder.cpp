// SPDX-License-Identifier: BSD-3-Clause
#include "output/run_folder.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "delassus/error.hpp"
#include "delassus/problem_files.hpp"
#include "output/system_model.hpp"
#include "support/text_file.hpp"

namespace delassus {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::seconds between_checkpoints{5};

constexpr const char* kind_of_folder = "run";

/// The folder, if there is a run to go on with; none is made otherwise.
const fs::path& with_checkpoint(const fs::path& folder) {
    const fs::path file = folder / "checkpoint.json";
    require_regular_file(file);
    return folder;
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

RunFolder::RunFolder(const fs::path& folder, const Scene& scene, const std::string& scene_text,
                     std::vector<Simulation>& simulations, const RunOutput& output)
    : folder_(folder, kind_of_folder), scene_(scene.canonical), simulations_(simulations) {
    folder_.clear();
    folder_.add_folder("vtk");
    folder_.write("scene.yaml", scene_text);
    frame_times_.resize(simulations.size());
    picture_times_.resize(simulations.size());
    open(scene, {}, output);
    for (std::size_t i = 0; i < simulations_.size(); ++i) {
        trajectory_->add_step(i, simulations_[i].record());
        add_frame(i);
    }
    checkpoint();
    folder_.keep();
}

RunFolder::RunFolder(const fs::path& folder, const Scene& scene, std::vector<Simulation>& simulations,
                     const RunOutput& output)
    : folder_(with_checkpoint(folder), kind_of_folder), scene_(scene.canonical), simulations_(simulations) {
    Checkpoint checkpoint = checkpoint_of(folder, scene);
    if (output.contact_forces && !checkpoint.contact_forces)
        throw InputError(
            fmt::format("the run in {} has no contact forces so far; leave out --contact-forces", folder.string()));
    for (std::size_t i = 0; i < simulations.size(); ++i) {
        frame_times_.push_back(std::move(checkpoint.systems[i].frame_times));
        picture_times_.push_back(std::move(checkpoint.systems[i].picture_times));
        simulations[i].load(std::move(checkpoint.systems[i].simulation));
    }
    folder_.add_folder("vtk");
    open(scene, std::move(checkpoint), output);
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

void RunFolder::open(const Scene& scene, std::optional<Checkpoint> resumed, const RunOutput& output) {
    every_ = output.every.value_or(resumed ? resumed->every : 1);
    contact_forces_ = resumed ? resumed->contact_forces : output.contact_forces;
    dump_ = output.dump || !resumed ? output.dump : resumed->dump;
    if (dump_.value_or(0) > 0) dump_problems();
    std::vector<TrajectorySystem> systems;
    for (std::size_t i = 0; i < simulations_.size(); ++i) {
        const SceneSystem& system = scene.systems[i];
        systems.push_back({system.name, simulations_[i].method().integrator, system.solver.name,
                           system.system->position_size(), system.system->n(), system.step, trajectory_model(system),
                           contact_forces_, simulations_[i].record().step + 1,
                           static_cast<std::int64_t>(frame_times_[i].size()),
                           resumed ? std::move(resumed->systems[i].written) : std::vector<std::uint64_t>{}});
        series_.emplace_back(folder_.path() / "vtk", system.name, *system.system);
    }
    most_pictures_ = output.pictures.value_or(resumed ? resumed->pictures : worth_writing(series_));
    trajectory_ = open_trajectory(folder_.add("trajectory.h5"), systems, resumed.has_value());
    last_checkpoint_ = std::chrono::steady_clock::now();
}

void RunFolder::dump_problems() {
    folder_.add_folder("problems");
    for (auto& simulation : simulations_) {
        simulation.solver().watch(
            [this, &simulation, step = std::int64_t{-1}, solve = 0](const Problem& problem) mutable {
                const std::int64_t now = simulation.record().step + 1;
                if (now % *dump_ != 0 || problem.m() == 0) return;
                solve = now == step ? solve + 1 : 1;
                step = now;
                const auto name = solve == 1 ? fmt::format("{}_{:06}", simulation.system().name, now)
                                             : fmt::format("{}_{:06}_{}", simulation.system().name, now, solve);
                Problem copy = problem;
                copy.name = name;
                copy.source = fmt::format("step {} of system {} from t = {:.17g} s, solve {}", now,
                                          simulation.system().name, simulation.state().t, solve);
                write_problem(copy, folder_.add("problems/" + name));
            });
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
    const VtkSeries& series = series_[system];
    folder_.add("vtk/" + series.file_name(number));
    series.write(number, simulation.state());
    if (contact_forces_) {
        folder_.add("vtk/" + series.contacts_file_name(number));
        series.write_contacts(number, simulation.state().t, contacts);
    }
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
    Checkpoint checkpoint{scene_, {}, contact_forces_, every_, most_pictures_, dump_};
    for (std::size_t i = 0; i < simulations_.size(); ++i) {
        parts.push_back({&series_[i], &picture_times_[i], contact_forces_});
        checkpoint.systems.push_back({simulations_[i].system().name, simulations_[i].save(), frame_times_[i],
                                      picture_times_[i], trajectory_->written(i)});
    }
    write_vtk_collection(folder_.add("scene.pvd"), "vtk", parts);
    write_checkpoint(checkpoint, folder_.add("checkpoint.json"));
    last_checkpoint_ = std::chrono::steady_clock::now();
}

void RunFolder::write_report(const std::string& json) {
    folder_.write("report.json", json);
}

}  // namespace delassus
