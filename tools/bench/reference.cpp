// SPDX-License-Identifier: BSD-3-Clause
#include "bench/reference.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "bench/key.hpp"
#include "bench/scratch_folder.hpp"
#include "delassus/error.hpp"
#include "delassus/problem_files.hpp"
#include "support/atomic_file.hpp"
#include "support/text_file.hpp"

namespace delassus::bench {

namespace fs = std::filesystem;

namespace {

/// Two solutions confirm each other if their velocities differ by no more than this.
constexpr double confirmed_difference = 1e-6;

struct Candidate {
    std::string label;
    Measurement result;
    fs::path solution;
    double tolerance = 0.0;  ///< that it reached
};

class ReferenceSearch {
public:
    ReferenceSearch(const WorkerSettings& worker, const SuiteReferences& references, const ProblemSource& problem,
                    const std::string& law)
        : worker_(worker), references_(references), problem_(problem), law_(law) {}

    /// With ever tighter tolerances until one is not reached.
    std::optional<Candidate> best_of(const std::string& text, const fs::path& against) {
        std::optional<Candidate> best;
        for (const double tolerance : {1e-10, 1e-12, 1e-14}) {
            MeasureRequest request;
            request.problem = problem_;
            request.solver = parse_solver(text);
            request.settings.tolerance = tolerance;
            request.settings.time_limit = references_.time_limit;
            request.settings.repeats = 0;
            request.settings.law = law_;
            request.solution = scratch_.path() / std::to_string(number_++);
            request.reference = against;
            Measurement row = measure(worker_, request);
            if (row.status != "solved") break;
            if (best && !(row.error->natural < best->result.error->natural)) break;
            best = Candidate{label_of(request.solver), std::move(row), request.solution, tolerance};
            if (!against.empty()) break;  // a confirmation need not be as accurate as possible
        }
        return best;
    }

    std::optional<Candidate> first() {
        for (const auto& text : references_.solvers)
            if (auto found = best_of(text, {})) return found;
        return std::nullopt;
    }

    std::optional<Candidate> second(const Candidate& first) {
        const auto& stages = first.result.stages;
        for (const auto& text : references_.confirm) {
            const std::string name = parse_solver(text).name;
            if (name == first.result.solver || std::find(stages.begin(), stages.end(), name) != stages.end()) continue;
            if (auto found = best_of(text, first.solution)) return found;
        }
        return std::nullopt;
    }

private:
    const WorkerSettings& worker_;
    const SuiteReferences& references_;
    const ProblemSource& problem_;
    const std::string& law_;
    ScratchFolder scratch_;
    int number_ = 0;
};

/// The row and the place of a reference that is in the cache, or nothing. A damaged one counts as absent.
std::optional<Json> cached_row(const fs::path& file) {
    if (!fs::exists(file)) return std::nullopt;
    Json row = try_parse_ordered_json(read_file(file));
    if (!row.is_object() || !row.contains("of")) return std::nullopt;
    row["cached"] = true;
    return row;
}

void make_folder(const fs::path& folder) {
    std::error_code failure;
    fs::create_directories(folder, failure);
    if (failure) throw InputError(fmt::format("the folder {} cannot be made: {}", folder.string(), failure.message()));
}

}  // namespace

fs::path cache_folder(const fs::path& otherwise) {
    const auto variable = [](const char* name) -> fs::path {
        const char* value = std::getenv(name);
        return value && *value == '/' ? value : "";
    };
    if (const auto cache = variable("XDG_CACHE_HOME"); !cache.empty()) return cache / "delassus" / "references";
    if (const auto home = variable("HOME"); !home.empty()) return home / ".cache" / "delassus" / "references";
    return otherwise;
}

Reference find_reference(const WorkerSettings& worker, const SuiteReferences& references, const ProblemSource& problem,
                         const ProblemFacts& facts, const std::string& law, const fs::path& cache) {
    if (facts.n == 0 || references.solvers.empty()) return {};
    std::vector<std::string> parts = {"reference 1", facts.hash, law, digits(references.time_limit)};
    parts.insert(parts.end(), references.solvers.begin(), references.solvers.end());
    parts.insert(parts.end(), references.confirm.begin(), references.confirm.end());
    const fs::path folder = cache / key_of(parts);
    if (auto row = cached_row(folder / "report.json")) return {row->at("found") == true ? folder : fs::path(), *row};

    ReferenceSearch search(worker, references, problem, law);
    const auto first = search.first();
    Json row = {{"kind", "reference"}, {"of", facts.hash}, {"law", law}, {"found", false}, {"cached", false}};
    if (worker.cancelled && worker.cancelled()) return {};
    if (!first || first->result.error->natural > reference_accuracy) {
        row["message"] = fmt::format("no solver reached a natural error of {:g}", reference_accuracy);
        return {{}, row};
    }
    row["found"] = true;
    row["solver"] = first->label;
    row["stages"] = first->result.stages;
    for (const ErrorMeasure& measure : error_measures)
        if (measure.brief) row[std::string(measure.name)] = json_number((*first->result.error).*measure.value);
    const auto second = search.second(*first);
    if (worker.cancelled && worker.cancelled()) return {};
    if (second) {
        const double difference = second->result.velocity;
        row["second"] = {{"solver", second->label},
                         {"stages", second->result.stages},
                         {"natural", json_number(second->result.error->natural)},
                         {"difference", json_number(difference)}};
        row["confirmed"] = difference <= confirmed_difference;
        row["message"] = difference <= confirmed_difference
                             ? ""
                             : fmt::format("{} finds velocities that differ by {:.1e}", second->label, difference);
    } else {
        row["second"] = nullptr;
        row["confirmed"] = false;
        row["message"] = "no second solver reached 1e-10, so nothing confirms it";
    }
    make_folder(cache);
    const Solution solution =
        read_solution(first->solution, static_cast<std::int32_t>(facts.n), static_cast<std::int32_t>(facts.m));
    write_solution(solution, json_text(row, 1) + "\n", folder);
    return {folder, row};
}

Reference find_step_reference(const WorkerSettings& worker, const SuiteReferences& references, const SuiteScene& scene,
                              const SceneFacts& facts, double smallest_step, const std::string& code,
                              const fs::path& cache) {
    if (references.solvers.empty()) return {};
    SimulateRequest request;
    request.scene = scene.source;
    request.timestepper = scene.reference_timestepper.empty() ? references.timestepper : scene.reference_timestepper;
    request.step = scene.reference_step > 0.0 ? scene.reference_step : references.step_fraction * smallest_step;
    request.time_limit = references.time_limit;
    request.repeats = 0;
    const std::string key = key_of({"end 1", facts.hash, digits(facts.end), request.timestepper, digits(request.step),
                                    digits(request.time_limit), code});
    const fs::path file = cache / (key + ".state.json"), report = cache / (key + ".json");
    if (auto row = cached_row(report); row && fs::exists(file)) return {file, *row};

    const ScratchFolder scratch;
    Json row = {{"kind", "reference"}, {"of", facts.hash},
                {"law", ""},           {"found", false},
                {"cached", false},     {"solver", request.timestepper.empty() ? facts.integrator : request.timestepper},
                {"step", request.step}};
    request.state = scratch.path() / "state.json";
    const auto fine = simulate(worker, request);
    if (worker.cancelled && worker.cancelled()) return {};
    if (fine.status != "finished") {
        row["message"] = fmt::format("the reference with a step of {:g} s ended with {}: {}", request.step, fine.status,
                                     fine.message);
        return {{}, row};
    }
    request.reference = request.state;
    request.state.clear();
    request.step *= 2.0;
    const auto coarse = simulate(worker, request);
    if (worker.cancelled && worker.cancelled()) return {};
    row["found"] = true;
    row["second"] = {
        {"step", request.step}, {"position", json_number(coarse.position)}, {"velocity", json_number(coarse.velocity)}};
    row["confirmed"] = std::isfinite(coarse.position);
    row["message"] = "";
    make_folder(cache);
    write_file_atomically(file, read_file(scratch.path() / "state.json"));
    write_file_atomically(report, json_text(row, 1) + "\n");
    return {file, row};
}

}  // namespace delassus::bench
