// SPDX-License-Identifier: BSD-3-Clause
#include "bench/run_suite.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <set>

#include "bench/cells.hpp"
#include "bench/key.hpp"
#include "bench/reference.hpp"
#include "bench/rows.hpp"
#include "bench/scene_dumps.hpp"
#include "bench/scratch_folder.hpp"
#include "bench/tasks.hpp"
#include "delassus/error.hpp"
#include "delassus/version.hpp"
#include "process/child_process.hpp"
#include "solver/auto_solver.hpp"
#include "solver/python_solvers.hpp"
#include "support/library_location.hpp"
#include "support/text_file.hpp"

namespace delassus::bench {

namespace fs = std::filesystem;

namespace {

/// Whether a solver that ended for this cause is assumed to do so at every tighter tolerance. Crashes, false claims and
/// errors are defects, so those runs are always made.
bool fails_again(const std::string& cause) {
    static const std::set<std::string> causes = {"unsupported", "iteration_limit", "time_limit", "memory",
                                                 "diverged",    "stalled",         "infeasible", "numerical_failure"};
    return causes.contains(cause);
}

Json session_row(const RunPlan& plan, const Tasks& tasks, const std::vector<CellTask>& cells, const std::string& code) {
    const Suite& suite = plan.suite;
    Json keys = Json::array(), solvers = Json::array();
    for (const auto& task : tasks.solves) keys.push_back(task.key);
    for (const auto& task : tasks.simulations) keys.push_back(task.key);
    for (const auto& task : tasks.leaving_out) keys.push_back(task.key);
    for (const auto& task : cells) keys.push_back(task.key);
    for (const auto& solver : suite.solvers) solvers.push_back(label_of(solver));
    return {{"kind", "session"},
            {"format", rows_format},
            {"version", rows_version},
            {"created", now()},
            {"command", plan.command},
            {"folder", plan.folder},
            {"delassus", DELASSUS_VERSION},
            {"code", code},
            {"build", json_of(this_build())},
            {"machine", json_of(this_machine())},
            {"threads", 1},
            {"suite",
             {{"file", fs::absolute(suite.file).lexically_normal().string()},
              {"hash", key_of({suite.text})},
              {"title", suite.title.empty() ? suite.file.stem().string() : suite.title},
              {"description", suite.description}}},
            {"settings",
             {{"tolerances", suite.tolerances},
              {"time_limit", suite.time_limit},
              {"memory_limit", suite.memory_limit > 0.0 ? Json(suite.memory_limit) : Json(nullptr)},
              {"max_iterations", suite.max_iterations},
              {"repeats", suite.repeats},
              {"processes", suite.processes},
              {"skip_after_failure", suite.skip_after_failure}}},
            {"solvers", solvers},
            {"left_out", suite.left_out},
            {"keys", keys}};
}

class SuiteRun {
public:
    SuiteRun(const RunPlan& plan, const RunListener& listener, const Tasks& tasks, const std::vector<CellTask>& cells,
             std::string code, ResultsFile& file)
        : plan_(plan), listener_(listener), tasks_(tasks), cells_(cells), code_(std::move(code)), file_(file) {
        for (const auto& task : tasks.solves) total_ += !done(task);
        for (const auto& task : tasks.simulations) total_ += !file.has(task.key);
        for (const auto& task : tasks.leaving_out) total_ += !file.has(task.key);
        for (const auto& cell : cells) total_ += !file.has(cell.key);
        counts_.skipped =
            tasks.solves.size() + tasks.simulations.size() + tasks.leaving_out.size() + cells.size() - total_;
    }

    RunCounts run() {
        for (const auto& task : tasks_.solves) {
            if (stopped()) break;
            if (!done(task) && !skip(task)) solve(task);
        }
        for (const auto& task : tasks_.simulations)
            if (!stopped() && !file_.has(task.key)) step(task);
        for (const auto& task : tasks_.leaving_out)
            if (!stopped() && !file_.has(task.key)) leave_out(task);
        for (const auto& cell : cells_)
            if (!stopped() && !file_.has(cell.key)) fill(cell);
        counts_.interrupted = stopped();
        return counts_;
    }

private:
    [[nodiscard]] bool stopped() const { return plan_.worker.cancelled && plan_.worker.cancelled(); }

    void begin(const std::string& what) const {
        if (listener_.on_begin) listener_.on_begin(what, counts_.done + 1, total_);
    }

    /// In a suite that leaves no run out, a row that says that its run was left out does not count.
    [[nodiscard]] bool done(const SolveTask& task) const {
        return file_.has(task.key) && (plan_.suite.skip_after_failure || !file_.end_of(task.key).skipped);
    }

    /// Tasks of a problem, a law and a solver follow one another, the loosest tolerance first, so the task before this
    /// one decides. In a chain of tasks that were left out, the row names the looser one that did run.
    bool skip(const SolveTask& task) {
        if (!plan_.suite.skip_after_failure) return false;
        const auto index = static_cast<std::size_t>(&task - tasks_.solves.data());
        const SolverConfig& solver = plan_.suite.solvers[task.solver];
        if (solver.name == auto_name) return false;  // another tolerance may be another solver
        const SolveTask* before = nullptr;
        for (std::size_t k = index; k-- > 0 && !before;) {
            const SolveTask& other = tasks_.solves[k];
            if (other.problem != task.problem || other.law != task.law || other.solver != task.solver ||
                other.processes != task.processes)
                break;
            if (file_.has(other.key) && !file_.end_of(other.key).skipped) before = &other;
        }
        if (!before || !fails_again(file_.end_of(before->key).cause)) return false;
        file_.add(skipped_row(task.key, tasks_.problems[task.problem].facts.hash, task.law, task.tolerance, solver,
                              std::max(1, task.processes), file_.end_of(before->key), before->tolerance));
        ++counts_.done;
        return true;
    }

    void solve(const SolveTask& task) {
        const TaskProblem& problem = tasks_.problems[task.problem];
        // Tasks of a problem and a law follow one another, so the last reference is kept and no other.
        if (!reference_ || reference_of_ != problem.facts.hash + task.law) {
            begin(problem.name + "  reference");
            reference_ = find_reference(plan_.worker, plan_.suite.references, problem.source, problem.facts, task.law,
                                        plan_.cache);
            reference_of_ = problem.facts.hash + task.law;
            if (stopped()) return;
            if (!reference_->row.is_null()) file_.add(reference_->row);
        }
        const SolverConfig& solver = plan_.suite.solvers[task.solver];
        begin(fmt::format("{}  {}  {:g}", problem.name, label_in_parts(label_of(solver), task.processes),
                          task.tolerance));
        MeasureRequest request;
        request.problem = problem.source;
        request.solver = solver;
        request.settings = {task.tolerance, plan_.suite.time_limit, plan_.suite.max_iterations, plan_.suite.repeats,
                            task.law};
        request.reference = reference_->place;
        request.processes = task.processes;
        const Measurement row = measure(plan_.worker, request, listener_.on_sample);
        if (stopped()) return;  // what was interrupted is run again
        if (libraries_.insert(solver.name).second && !row.libraries.empty())
            file_.add(
                {{"kind", "libraries"}, {"solver", solver.name}, {"version", row.version}, {"files", row.libraries}});
        file_.add(solve_row(task.key, problem.facts.hash, task.law, task.tolerance, row));
        ++counts_.done;
    }

    void step(const SimulationTask& task) {
        const TaskScene& scene = tasks_.scenes[task.scene];
        if (!reference_ || reference_of_ != scene.facts.hash) {
            begin(scene.entry.name + "  reference");
            reference_ = find_step_reference(plan_.worker, plan_.suite.references, scene.entry, scene.facts,
                                             scene.smallest_step, code_, plan_.cache);
            reference_of_ = scene.facts.hash;
            if (stopped()) return;
            if (!reference_->row.is_null()) file_.add(reference_->row);
        }
        begin(fmt::format("{}  {}  h = {:g} s", scene.entry.name, task.request.timestepper, task.request.step));
        SimulateRequest request = task.request;
        request.reference = reference_->place;
        const SimulationMeasurement row = simulate(plan_.worker, request);
        if (stopped()) return;
        file_.add(simulation_row(task.key, scene.facts.hash, request, row));
        ++counts_.done;
    }

    void leave_out(const LeavingOutTask& task) {
        const ScratchFolder scratch;
        SimulateRequest request;
        request.scene = task.entry.source;
        request.time_limit = plan_.suite.time_limit;
        request.repeats = plan_.suite.repeats;
        request.state = scratch.path() / "state.json";
        begin(task.entry.name + "  as it is");
        const SimulationMeasurement as_is = simulate(plan_.worker, request);
        if (stopped()) return;
        begin(task.entry.name + "  nothing left out");
        request.scene.forced = true;
        if (std::filesystem::exists(request.state)) request.reference = request.state;
        request.state.clear();
        const SimulationMeasurement forced = simulate(plan_.worker, request);
        if (stopped()) return;
        file_.add(leaving_out_row(task.key, task.entry, task.facts, as_is, forced));
        ++counts_.done;
    }

    void fill(const CellTask& cell) {
        const SuiteAxis& axis = plan_.suite.axes[cell.axis];
        begin(fmt::format("{} = {:g}  {}", axis.title, axis.values[cell.value], cell.method));
        const Json row = run_cell(plan_.worker, plan_.suite, cell, plan_.cache);
        if (stopped()) return;
        file_.add(row);
        ++counts_.done;
    }

    const RunPlan& plan_;
    const RunListener& listener_;
    const Tasks& tasks_;
    const std::vector<CellTask>& cells_;
    std::string code_;
    ResultsFile& file_;
    std::size_t total_ = 0;
    RunCounts counts_;
    std::optional<Reference> reference_;
    std::string reference_of_;
    std::set<std::string> libraries_;
};

}  // namespace

/// By solver, whether it takes problems in parts. One that does not is said to be left out beyond one process.
std::vector<bool> sharing_solvers(const Registry& registry, Suite& suite) {
    if (!suite.in_parts()) return std::vector<bool>(suite.solvers.size(), false);
    std::vector<bool> shares;
    for (const auto& solver : suite.solvers) {
        const std::uint64_t capabilities = is_library_path(solver.name)
                                               ? registry.load(solver.name)->info().capabilities
                                               : solver_info(registry, solver.name).capabilities;
        shares.push_back((capabilities & DELASSUS_CAN_PARTITIONED) != 0);
        if (!shares.back())
            suite.left_out.push_back(
                fmt::format("{} runs in one process only, as it does not take problems in parts", label_of(solver)));
    }
    return shares;
}

std::string code_hash(const Registry& registry, const fs::path& command) {
    std::set<fs::path> files = {command};
    const fs::path library = library_directory();
    for (const auto& folder : {library, library / "delassus"})
        for (const auto& entry : fs::directory_iterator(folder))
            if (entry.is_regular_file() && entry.path().filename().string().find("delassus") != std::string::npos &&
                entry.path().filename().string().find(".so") != std::string::npos)
                files.insert(entry.path());
    for (const auto& plugin : registry.plugins()) {
        files.insert(plugin.library);
        // Of a solver in several files the manifest has a checksum of each.
        if (const auto manifest = import_folder(plugin) / (plugin.name + ".json");
            !plugin.python.empty() && fs::exists(manifest))
            files.insert(manifest);
    }
    for (const auto& folder : registry.folders())
        for (const char* list : {"ranking.json", "references.txt"})
            if (fs::exists(folder / list)) files.insert(folder / list);
    std::vector<std::string> contents;
    for (const auto& file : files) contents.push_back(key_of({read_file(file)}));
    return key_of(contents);
}

RunCounts run_suite(const RunPlan& given, const Registry& registry, const RunListener& listener) {
    RunPlan plan = given;
    std::string code = code_hash(registry, plan.worker.command);
    for (const auto& solver : plan.suite.solvers) {
        if (is_library_path(solver.name)) {
            if (!fs::is_regular_file(solver.name)) throw InputError(fmt::format("there is no plugin {}", solver.name));
        } else if (const PluginInfo info = solver_info(registry, solver.name);
                   info.origin == PluginOrigin::PythonPackage) {
            code = key_of({code, info.installed_from, info.python});
        }
    }
    if (plan.suite.memory_limit > 0.0) plan.worker.resident_limit = bytes_of_mebibytes(plan.suite.memory_limit);

    const std::vector<bool> shares = sharing_solvers(registry, plan.suite);
    if (plan.suite.processes.back() > 1) plan.worker.launcher = find_launcher(plan.worker, plan.suite.processes.back());

    ResultsFile file(*plan.output);
    add_dumped_problems(plan.worker, *plan.output, plan.suite);
    const Tasks tasks = make_tasks(plan.suite, plan.worker, code, shares);
    const std::vector<CellTask> cells = make_cells(plan.suite, code);
    if (tasks.solves.empty() && tasks.simulations.empty() && tasks.leaving_out.empty() && cells.empty())
        throw InputError(fmt::format("{} asks for no run: {}", plan.suite.file.string(),
                                     plan.suite.left_out.empty() ? "it names no solver" : plan.suite.left_out.front()));

    file.add(session_row(plan, tasks, cells, code));
    for (const auto& problem : tasks.problems)
        file.add(problem_row(problem.facts, {problem.source, problem.name, problem.family}));
    for (const auto& scene : tasks.scenes)
        file.add({{"kind", "scene"},
                  {"scene", scene.facts.hash},
                  {"name", scene.entry.name},
                  {"title", scene.facts.title},
                  {"file", fs::absolute(scene.entry.source.file).lexically_normal().string()},
                  {"set", Json(scene.entry.source.settings)},
                  {"end", scene.facts.end},
                  {"plan", scene.facts.plan}});
    for (const auto& axis : plan.suite.axes) file.add(axis_row(axis));
    return SuiteRun(plan, listener, tasks, cells, code, file).run();
}

}  // namespace delassus::bench
