// SPDX-License-Identifier: BSD-3-Clause
// delassus run: a scene, step by step.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>

#include "command.hpp"
#include "delassus/communicator.hpp"
#include "delassus/distributed.hpp"
#include "delassus/error.hpp"
#include "delassus/scene_schema.hpp"
#include "delassus/simulation.hpp"
#include "on_all_processes.hpp"
#include "output/run_folder.hpp"
#include "output/run_report.hpp"
#include "process/stdout_guard.hpp"
#include "process/supervision.hpp"
#include "process/terminal.hpp"
#include "scene_arguments.hpp"
#include "simulation/run_check.hpp"
#include "simulation/run_loop.hpp"
#include "simulation/shared_reactions.hpp"
#include "support/text_file.hpp"

namespace delassus::command {

namespace {

using Clock = std::chrono::steady_clock;

struct RunArguments {
    SceneArguments scene;
    std::filesystem::path output, resume;
    RunOutput files;
    bool json = false, check = false;

    [[nodiscard]] bool has_folder() const { return !output.empty() || !resume.empty(); }
};

double seconds_since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// A line on a terminal that says how far a run is and when it will be done; nothing where there is no terminal.
class Progress {
public:
    Progress(const std::vector<Simulation>& simulations, bool first_process)
        : simulations_(simulations), terminal_(first_process && isatty(STDERR_FILENO) != 0), start_(done()) {}

    void show() {
        if (!terminal_ || seconds_since(shown_) < 0.1) return;
        shown_ = Clock::now();
        const double all = total(), now = done(), part = all > 0.0 ? now / all : 1.0;
        std::int64_t steps = 0;
        for (const auto& simulation : simulations_) steps += simulation.record().step;
        const double rate = (now - start_) / seconds_since(begin_);
        const std::string left = rate > 0.0 ? fmt::format("{:.0f} s left", (all - now) / rate) : std::string();
        const auto& first = simulations_[0];
        const std::string size = first.system().control ? fmt::format(" of {:.1e} s", first.record().h) : std::string();
        show_line(fmt::format("  {:3.0f} %  t = {:.4g} s  {} steps{}  {} contacts  {:12}", 100.0 * part,
                              simulations_[0].state().t, steps, size, simulations_[0].record().contacts, left));
        written_ = true;
    }
    void clear() {
        if (written_) show_line("");
    }

private:
    [[nodiscard]] double total() const {
        double sum = 0.0;
        for (const auto& simulation : simulations_) sum += simulation.system().end;
        return sum;
    }
    [[nodiscard]] double done() const {
        double sum = 0.0;
        for (const auto& simulation : simulations_) sum += simulation.state().t;
        return sum;
    }

    const std::vector<Simulation>& simulations_;
    bool terminal_, written_ = false;
    double start_;
    Clock::time_point begin_ = Clock::now(), shown_ = begin_;
};

int exit_code_of(RunStatus status) {
    if (status == RunStatus::Finished) return exit_solved;
    return status == RunStatus::Unsupported ? exit_unsupported : exit_not_converged;
}

bool on_any(const Communicator& run, bool own) {
    std::int64_t any = own ? 1 : 0;
    run.max(std::span(&any, 1));
    return any != 0;
}

/// Everything on disk; folder: of process 0, null on the others.
void checkpoint(std::vector<Simulation>& simulations, RunFolder* folder) {
    for (auto& simulation : simulations) simulation.gather();
    if (folder != nullptr) folder->checkpoint();
}

/// Steps until the end, an interrupt or a failure.
/// tracks: of each system, or none.
RunResult advance(const Communicator& run, std::vector<Simulation>& simulations, RunFolder* folder,
                  const RunArguments& arguments, std::int64_t every, std::vector<Track>& tracks) {
    Progress progress(simulations, run.rank() == 0);
    const auto stepped = [&](std::size_t system) {
        Simulation& simulation = simulations[system];
        if (arguments.has_folder() && simulation.record().step % every == 0) simulation.gather_contacts();
        if (folder != nullptr) folder->add_step(system);
        if (!tracks.empty()) tracks[system].add(simulation);
        if (on_any(run, folder != nullptr && folder->checkpoint_is_due())) checkpoint(simulations, folder);
        progress.show();
    };
    RunResult result = run_to_end(simulations, {stepped, [&] { return on_any(run, interrupted()); }});
    progress.clear();
    if (result.status == RunStatus::Interrupted)
        result.message = fmt::format("stopped at t = {:.9g} s; --resume goes on from there", reached_time(simulations));
    return result;
}

void print_shares(const std::vector<Simulation::Share>& shares, std::int64_t divisions) {
    constexpr double MiB = 1048576.0;
    if (!shares.empty()) fmt::print("  bodies shared out among {} processes {} times\n", shares.size(), divisions);
    for (std::size_t p = 0; p < shares.size(); ++p)
        fmt::print("  process {}: {} bodies, {} ghosts, {} rows at the end; {:.1f} MiB at most, {:.1f} MiB sent\n", p,
                   shares[p].bodies, shares[p].ghosts, shares[p].rows, static_cast<double>(shares[p].peak_memory) / MiB,
                   static_cast<double>(shares[p].bytes_sent) / MiB);
}

/// What the steps are estimated to err by.
void print_error(const Simulation& simulation) {
    const auto& totals = simulation.totals();
    const double accuracy = simulation.system().accuracy;
    if (totals.refined_steps > 0)
        fmt::print("  {} steps were divided to be right to {:.3g} a second\n", totals.refined_steps, accuracy);
    if (!std::isfinite(totals.error)) return;
    fmt::print("  estimated error of all steps {:.1e} of the size of what moves, or rad", totals.error);
    if (totals.inexact_steps > 0)
        fmt::print("; {} steps err by more than {:.3g} a second", totals.inexact_steps, accuracy);
    fmt::print("\n");
}

void print_summary(std::vector<Simulation>& simulations, const SharesOfSystems& shares, RunStatus status) {
    auto of_system = shares.begin();
    for (auto& simulation : simulations) {
        const auto& system = simulation.system();
        const auto& totals = simulation.totals();
        fmt::print("{}: {} steps of {} to t = {:.6g} s in {:.3g} s\n", system.name, simulation.record().step,
                   simulation.method().integrator, simulation.state().t, totals.seconds);
        if (system.control)
            fmt::print("  steps from {:.2e} to {:.2e} s, {} trials rejected, {} impacts\n", totals.smallest_step,
                       totals.largest_step, totals.rejected, totals.impacts);
        if (std::isfinite(totals.energy))
            fmt::print("  energy {:.6g} J, change {:+.3e} J{}{}\n", totals.energy, totals.energy - totals.start_energy,
                       totals.turnover > 0.0 && std::isfinite(totals.supplied)
                           ? fmt::format("; {:+.3e} J supplied", totals.supplied)
                           : "",
                       std::isfinite(totals.work) && totals.work != 0.0
                           ? fmt::format("; {:+.3e} J by contacts and dry friction", totals.work)
                           : "");
        fmt::print("  worst drift {:.2e}, deepest penetration {:.2e} m, at most {} contacts\n", totals.worst_drift,
                   totals.worst_penetration, totals.most_contacts);
        if (const auto start = simulation.start(); !start.empty()) fmt::print("  start: {}\n", start);
        std::int32_t of_trees = 0;
        if (const auto* joints = simulation.joint_coordinates()) {
            of_trees = joints->rows_saved();
            fmt::print("  joint coordinates: {} velocities in place of {}, {} rows saved\n", joints->n(),
                       joints->body_velocities(), of_trees);
        }
        if (const auto left_out = system.system->constraint_rows() - of_trees - system.system->m(); left_out > 0)
            fmt::print("  {} of {} rows of joints and motors left out, which others imply: {}\n", left_out,
                       system.system->constraint_rows(), shared_reactions(*system.system));
        if (system.sleeping)
            fmt::print("  sleeping: {} bodies and nodes at the end; {} parts of problems left out\n",
                       simulation.record().sleeping, totals.resting_parts);
        if (totals.worst_linearization > 0.0)
            fmt::print("  worst linearisation error {:.1e}\n", totals.worst_linearization);
        if (totals.divided_steps > 0)
            fmt::print(
                "  {} steps taken in up to {} parts: as one they are too long for {}{}\n", totals.divided_steps,
                totals.most_substeps, simulation.method().integrator,
                system.steps_by_accuracy() ? fmt::format(" to be right to {:.3g} a second", system.accuracy) : "");
        print_error(simulation);
        if (totals.plugin_solves == 0) {
            fmt::print("  no solver was needed\n");
        } else {
            // A run that goes on may have nothing left to solve.
            const auto& loaded = simulation.solver().loaded();
            fmt::print("  {}: {} solves, {} iterations, {:.3g} s, worst natural error {:.1e}\n",
                       !loaded.empty()              ? fmt::format("{}", fmt::join(loaded, ", "))
                       : system.solver.name.empty() ? "auto"
                                                    : system.solver.name,
                       totals.plugin_solves, totals.solver_iterations, totals.solver_seconds, totals.worst_natural);
        }
        if (totals.repeated_solves > totals.failed_solves)
            fmt::print("  {} solves missed the tolerance with {} and were repeated with auto\n",
                       totals.repeated_solves - totals.failed_solves, system.solver.name);
        if (totals.near_goal_solves > 0)
            fmt::print("  {} solves ended above the tolerance that their steps are worth, within what is good enough\n",
                       totals.near_goal_solves);
        print_shares(*of_system++, simulation.divisions());
    }
    if (status != RunStatus::Finished) fmt::print("{}\n", status_word(status));
}

/// The run again with half of what may be wrong in each step.
std::vector<RunCheck> run_again(const RunArguments& arguments, const Registry& registry,
                                const std::vector<Simulation>& simulations, const std::vector<Track>& tracks) {
    Scene scene = read(arguments.scene);
    std::vector<Simulation> refined;
    refined.reserve(scene.systems.size());
    for (auto& system : scene.systems) {
        halve_errors(system);
        refined.emplace_back(system, registry).solver().interrupt_by(interrupted);
    }
    return check_runs(simulations, tracks, refined, interrupted);
}

void print_check(const std::string& system, const RunCheck& check) {
    if (!check.failure.empty()) {
        fmt::print("{}: with half the step it fails: {}\n", system, check.failure);
        return;
    }
    if (check.farthest.empty()) {
        fmt::print(
            "{}: with half the step bodies end where they did, to rounding; on the way up to {:.1e} of the extent of "
            "what "
            "moves ({:.3g} m) away\n",
            system, check.on_the_way, check.extent);
        return;
    }
    fmt::print(
        "{}: with half the step bodies end up to {:.2g} m and {:.2g} rad away ({}), on the way {:.1e} of the "
        "extent\n  of what moves ({:.3g} m); error at the end about {:.1e} of it, or rad\n",
        system, check.position, check.rotation, check.farthest, check.on_the_way, check.extent, check.error);
    if (check.apart_from)
        fmt::print("  farther apart than the accuracy of {:.1e} from t = {:.4g} s on\n", check.accuracy,
                   *check.apart_from);
    if (check.error < RunCheck::unknown) {
        fmt::print("  a tenth of the error would take about {:.2g} s, ten times the error {:.2g} s\n",
                   check.seconds_for(10.0), check.seconds_for(0.1));
    } else {
        fmt::print("  the motion is not known at the end: it is chaotic, or the steps are far too long\n");
    }
}

void check(const RunArguments& arguments) {
    const RunOutput& files = arguments.files;
    if (files.every.value_or(1) < 1) throw InputError("--every must be at least 1");
    if (files.pictures.value_or(0) < 0) throw InputError("--pictures must be at least 0");
    if (files.dump.value_or(0) < 0) throw InputError("--dump-problems must be at least 0");
    if (!arguments.resume.empty() && !arguments.output.empty() && arguments.output != arguments.resume)
        throw InputError("--resume goes on in its own folder; leave out -o");
    if (arguments.check && !arguments.resume.empty())
        throw InputError("--check compares a run from its start on; leave out --resume");
    if (files.dump.value_or(0) > 0 && !arguments.has_folder())
        throw InputError("--dump-problems writes into the folder of -o; give one");
    if (files.contact_forces && !arguments.has_folder())
        throw InputError("--contact-forces writes into the folder of -o; give one");
}

[[noreturn]] void refuse_whole_problems() {
    throw InputError("--dump-problems writes whole problems, which no process has here; start one process");
}

/// A run that goes on goes on to a later end.
void refuse_passed_end(const RunArguments& arguments, const Scene& scene) {
    if (!arguments.scene.end) return;
    double reached = 0.0;
    for (const auto& system : RunFolder::checkpoint_of(arguments.resume, scene).systems)
        reached = std::max(reached, system.simulation.state.t);
    if (reached > *arguments.scene.end * (1.0 + 1e-9))
        throw InputError(fmt::format("{} has come to t = {:.9g} s, beyond the --end of {:.9g} s",
                                     arguments.resume.string(), reached, *arguments.scene.end));
}

/// The run's folder, on process 0; on the others what it has to do with the simulations alone. Null without a folder.
/// every: ← how many steps there are from frame to frame.
std::unique_ptr<RunFolder> open_folder(const Communicator& run, const RunArguments& arguments, const Scene& scene,
                                       bool shared, std::vector<Simulation>& simulations, std::int64_t& every) {
    std::unique_ptr<RunFolder> folder;
    const bool first = run.rank() == 0, resume = !arguments.resume.empty();
    every = arguments.files.every.value_or(1);
    together(run, [&] {
        if (first && resume) {
            refuse_passed_end(arguments, scene);
            folder = std::make_unique<RunFolder>(arguments.resume, scene, simulations, arguments.files);
        } else if (first && !arguments.output.empty()) {
            folder = std::make_unique<RunFolder>(arguments.output, scene, read_file(arguments.scene.file), simulations,
                                                 arguments.files);
        }
    });
    // Process 0 keeps others away from the folder now.
    together(run, [&] {
        if (!resume) return;
        Checkpoint checkpoint = RunFolder::checkpoint_of(arguments.resume, scene);
        every = arguments.files.every.value_or(checkpoint.every);
        if (shared && arguments.files.dump.value_or(checkpoint.dump.value_or(0)) > 0) refuse_whole_problems();
        for (std::size_t i = 0; !first && i < simulations.size(); ++i)
            simulations[i].load(std::move(checkpoint.systems[i].simulation));
    });
    return folder;
}

/// Where a file of the run cannot be written, as on a full disk, its report may fit in: it says that the run failed.
void report_failure(RunFolder& folder, const RunArguments& arguments, const Scene& scene,
                    std::vector<Simulation>& simulations, const std::string& reason) {
    RunResult result;
    result.status = RunStatus::Failed;
    result.message = reason;
    try {
        folder.write_report(
            run_report_json(arguments.scene.file.filename().string(), scene, simulations, result, {}, {}));
    } catch (const Error&) {  // the reason is said all the same
    }
}

int run_on(const Communicator& run, const RunArguments& arguments) {
    check(arguments);
    const bool first = run.rank() == 0;
    Scene scene = read(arguments.scene);
    const Registry registry(absolute(arguments.scene.plugin_path));
    std::vector<Simulation> simulations;
    simulations.reserve(scene.systems.size());
    for (auto& system : scene.systems) simulations.emplace_back(system, registry);
    const bool shared = std::any_of(simulations.begin(), simulations.end(),
                                    [](const Simulation& simulation) { return simulation.shared(); });
    if (shared && arguments.files.dump.value_or(0) > 0) refuse_whole_problems();
    if (shared && arguments.check) throw InputError("--check needs all bodies in one process; start one");
    std::int64_t every = 1;
    const auto folder = open_folder(run, arguments, scene, shared, simulations, every);

    install_interrupt_handler();
    for (auto& simulation : simulations) simulation.solver().interrupt_by(interrupted);
    StdoutGuard guard;
    std::vector<Track> tracks;
    if (arguments.check)
        for (const auto& simulation : simulations) tracks.emplace_back(simulation);
    const RunResult result = [&] {
        try {
            return advance(run, simulations, folder.get(), arguments, every, tracks);
        } catch (const InputError& error) {
            if (folder) report_failure(*folder, arguments, scene, simulations, error.what());
            throw;
        }
    }();
    std::vector<RunCheck> checks;
    const bool complete = result.status == RunStatus::Finished || result.status == RunStatus::Unsolved;
    if (arguments.check && complete) checks = run_again(arguments, registry, simulations, tracks);
    if (const auto bytes = guard.release(); bytes > 0 && first)
        fmt::print(stderr, "delassus: a solver wrote {} bytes to standard output; they were dropped\n", bytes);

    SharesOfSystems shares;
    for (const auto& simulation : simulations) shares.push_back(simulation.shares());
    const std::string report =
        run_report_json(arguments.scene.file.filename().string(), scene, simulations, result, shares, checks);
    if (arguments.has_folder()) checkpoint(simulations, folder.get());
    if (folder) folder->write_report(report);
    if (!first) return exit_code_of(result.status);
    if (arguments.json) {
        fmt::print("{}", report);
    } else {
        print_summary(simulations, shares, result.status);
        for (std::size_t i = 0; i < checks.size(); ++i) print_check(simulations[i].system().name, checks[i]);
    }
    for (const auto& simulation : simulations)
        for (const auto& warning : simulation.warnings()) fmt::print(stderr, "delassus: {}\n", warning);
    if (!result.message.empty()) fmt::print(stderr, "delassus: {}\n", result.message);
    return exit_code_of(result.status);
}

int run(const RunArguments& arguments) {
    if (process_count() == 1) return run_on(*single_process(), arguments);
    return on_all_processes([&](const std::shared_ptr<const Communicator>& run) { return run_on(*run, arguments); });
}

}  // namespace

void add_run(CLI::App& program, Action& action) {
    auto arguments = std::make_shared<RunArguments>();
    auto* command = program.add_subcommand("run", "Simulate a scene");
    add_scene_arguments(*command, arguments->scene);
    command
        ->add_option("-o,--output", arguments->output,
                     "Folder for trajectory.h5, VTK files, checkpoint, report; an earlier run in it is replaced")
        ->type_name("DIR");
    command->add_option("--every", arguments->files.every, "Write the state of every N-th step [1]")->type_name("N");
    command
        ->add_option(
            "--pictures", arguments->files.pictures,
            fmt::format(
                "Of these states, write about N, evenly in time, for ParaView too [{}, or {} MB of them]; 0: none",
                RunFolder::default_pictures, RunFolder::default_picture_bytes / 1'000'000))
        ->type_name("N");
    command->add_flag("--contact-forces", arguments->files.contact_forces,
                      "Write the bodies and the force of each contact with the state");
    command
        ->add_option("--dump-problems", arguments->files.dump,
                     "Write the problem of every N-th step as a problem folder; 0: none")
        ->type_name("N");
    command
        ->add_option("--resume", arguments->resume,
                     "Go on with the run in this folder, with its --every, --pictures and --dump-problems unless given")
        ->type_name("DIR");
    command->add_flag("--check", arguments->check,
                      "Run again with half the step, or half the tolerance, and say how far apart the bodies end");
    command->add_flag("--json", arguments->json, "Print the report as JSON");
    command
        ->add_flag_callback(
            "--schema",
            [] {
                fmt::print("{}", scene_schema());
                throw CLI::Success();
            },
            "Print the JSON Schema of scene files")
        ->trigger_on_parse();
    command->callback([arguments, &action] { action.run = [arguments] { return run(*arguments); }; });
}

}  // namespace delassus::command
