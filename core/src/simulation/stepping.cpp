// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/stepping.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "delassus/error.hpp"
#include "dynamics/substeps.hpp"
#include "simulation/shared_run.hpp"

namespace delassus {
namespace {

// Work is counted in velocities and rows of problems that were solved, and a tenth of them for each iteration of their
// solver. A box that lands takes some 2000, a hundredth of a second. Each fixed step adds what may be spent on those
// that err, up to what some landings take. While all of that is there, steps are divided until they err by the
// accuracy; with the share s of it, by 1/s² times as much: as an error of e costs √e, what a step costs is in
// proportion to what there is. So errors are much alike, and what is left is enough for the largest, however many small
// ones there are.
constexpr double work_of_a_step = 300.0, most_saved_work = 3e4, iterations_of_a_solve = 10.0;
// Nothing is begun that cannot be ended: as a rule a step that errs by e times too much takes √e substeps of three
// solves, twice as many with the trials that are thrown away, and to locate an impact takes so many solves.
constexpr double solves_of_a_substep = 6.0, solves_of_an_impact = 120.0;

/// StepEnergy, as a checkpoint keeps it.
using EnergyNumbers = std::array<double, sizeof(StepEnergy) / sizeof(double)>;

/// A method whose steps follow from a tolerance until its end: AdaptiveStepping says from which.
class ChosenSteps {
public:
    explicit ChosenSteps(Timestepper& stepper) : stepper_(stepper) {}
    ~ChosenSteps() { stepper_.choose_steps(HUGE_VAL); }
    ChosenSteps(const ChosenSteps&) = delete;
    ChosenSteps& operator=(const ChosenSteps&) = delete;

private:
    Timestepper& stepper_;
};

}  // namespace

Stepping::Stepping(DynamicalSystem& system, std::unique_ptr<Timestepper> timestepper, SteppingSettings settings,
                   SharedRun* shared)
    : system_(system), settings_(std::move(settings)), shared_(shared), timestepper_(std::move(timestepper)) {
    if (settings_.restitutes) cuts_ = std::make_unique<ImpactCuts>(system);
    if (shared) return;
    if (settings_.chosen) {
        control_ = std::make_unique<AdaptiveStepping>(system, *timestepper_, *settings_.chosen);
        return;
    }
    if (const double limit = timestepper_->error_limit(); std::isfinite(limit))
        settings_.divided = StepControl::within(limit, settings_.step);
    if (settings_.divided)
        control_ = std::make_unique<AdaptiveStepping>(system, *timestepper_, *settings_.divided, settings_.advice);
    if (control_ || !timestepper_->estimates_error()) settings_.judged.reset();
    settings_.refines = settings_.refines && settings_.judged;
    work_ = most_saved_work;
}
Stepping::~Stepping() = default;

bool Stepping::ends(double t) const {
    // The last of steps that are chosen ends at `end` itself.
    return settings_.chosen ? t >= settings_.end : has_ended(t, settings_.end, settings_.step);
}

void Stepping::advance(State& state, StepSolver& solver, AdaptiveStepReport& report, StepWatch* watch) {
    oldest_ = std::exchange(older_, std::exchange(last_, {.state = state, .method = {}}));
    reads_ = ahead_ && ahead_->reaches(next(state.t).end);
    ahead_before_.reset();
    if (!reads_) {
        last_.method = timestepper_->save();
        if (control_) control_before_ = control_->save();
        work_before_ = work_;
        if (ahead_) {
            ahead_before_ = ahead_->memory();
            ahead_->count_advance();
        }
    }
    if (settings_.chosen) {
        pass_jump(state);
        report = control_->step(state, cut(state.t, settings_.end), solver);
        return;
    }
    const FixedStep step = next(state.t);
    report.h = step.h;
    report.error = 0.0;
    report.rejected = 0;
    report.impact = report.refined = report.again = false;
    const bool repeats = unchanged_.repeat(step.h, report);
    if (repeats) {
        if (solver.interrupted()) throw StepInterrupted("the step was interrupted");
    } else if (ahead_) {
        step_ahead(state, step.end, solver, report);
    } else if (control_) {
        step_within_error(*control_, state, step.end, solver, report);
    } else {
        step_fixed(state, solver, report, watch);
    }
    if (!ahead_ && !control_) {
        last_.whole = report.substeps == 1 && !report.refined;
        last_.energy = report.step.energy;
    }
    if (!repeats && changed_nothing(state, report.step, solver)) unchanged_.note(report, solver.effort());
    state.t = step.end;
}

bool Stepping::changed_nothing(const State& end, const StepReport& report, const StepSolver& solver) const {
    const auto same = [](const std::vector<double>& a, const std::vector<double>& b) {
        return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0);
    };
    if (!same(last_.state.v, end.v) || !same(last_.state.q, end.q) || !report.solved || ahead_) return false;
    return solver.may_skip_solves() && !system_.depends_on_time() && work_ == work_before_ &&
           same(last_.method, timestepper_->save()) && (!control_ || same(control_before_, control_->save()));
}

void Stepping::undo() {
    unchanged_.forget();
    if (!reads_) timestepper_->load(last_.method);
    last_ = std::exchange(older_, std::exchange(oldest_, {}));
    if (reads_) return;
    if (control_) control_->load(control_before_);
    work_ = work_before_;
    if (ahead_before_) ahead_->put_back(std::move(*ahead_before_));
}

void Stepping::go_back(State& state) {
    state = last_.state;
    timestepper_->load(last_.method);
}

// ---- Steps of a fixed size ----

void Stepping::take(State& state, double h, StepSolver& solver, StepReport& report) {
    solver.forget_misses();
    if (shared_) {
        shared_->step(state, h, *timestepper_, solver, report);
    } else if (cuts_) {
        cuts_->step(*timestepper_, state, h, solver, report);
    } else {
        timestepper_->step(state, h, solver, report);
    }
    solver.require_usable();
}

// ---- What time prescribes ----
//
// A method knows forces and motions at some points of a step, and takes them for smooth in between. So steps end at
// jumps and are short against what oscillates. Jumps that follow one another closely are those of a table that samples
// a curve.
double Stepping::cut(double t, double end) const {
    constexpr int most_jumps = 8;
    const double near = 1e-9 * settings_.step;
    double jump = system_.next_jump(t + near);
    double last = jump;
    for (int i = 1; i < most_jumps && last < t + settings_.step; ++i) last = system_.next_jump(last);
    if (last < t + settings_.step) jump = HUGE_VAL;
    const double until = std::min(jump, t + system_.longest_step(t));
    return until < end - near ? until : end;
}

void Stepping::pass_jump(const State& state) {
    const double near = 1e-9 * settings_.step;
    if (system_.next_jump(state.t - near) <= state.t + near) timestepper_->forces_jumped();
}

void Stepping::try_substeps(std::int64_t substeps, State& state, StepSolver& solver, AdaptiveStepReport& report,
                            StepWatch* watch) {
    // Where rounding makes more of the linear model's error than this, nobody knows whether substeps are short enough.
    constexpr double most_rounding = 0.1;
    const double begin = state.t, part = report.h / static_cast<double>(substeps);
    if (watch) watch->begin_trial(substeps, false);
    report.step.clear();
    report.error = 0.0;
    bool whole = true;  // parts that are not cut are of one size to the last digit, as methods compare sizes
    for (std::int64_t i = 1; i <= substeps;) {
        const double end = begin + static_cast<double>(i) * part, until = cut(state.t, end);
        whole = whole && until == end;
        const double h = whole ? part : until - state.t;
        pass_jump(state);
        take(state, h, solver, substep_);
        if (!whole) state.t = until;
        if (until == end) {
            ++i;
            whole = true;
        }
        if (const double error = error_of(substep_, h); !(error <= report.error)) report.error = error;
        if (watch) watch->judge(state, h, substep_, i > substeps);
        if (substeps > 1 && substep_.linearization_rounding > most_rounding)
            throw StepTooLong("the last digits of positions are as large as what a step errs by");
        substep_.follow(report.step);
        std::swap(report.step, substep_);
    }
    report.substeps = substeps;
}

void Stepping::step_whole(State& state, StepSolver& solver, AdaptiveStepReport& report, StepWatch* watch) {
    while (true) {
        try {
            return try_substeps(1, state, solver, report, watch);
        } catch (const StepTooLong& failure) {
            if (!watch || !watch->mend(failure, substep_, state)) throw;
        }
        go_back(state);
    }
}

void Stepping::step_in_substeps(State& state, StepSolver& solver, AdaptiveStepReport& report, StepWatch* watch,
                                const StepTooLong& failure) {
    if (watch) watch->begin_substeps(failure);
    for (std::int64_t substeps = 2;; substeps *= 2) {
        go_back(state);
        try {
            return try_substeps(substeps, state, solver, report, watch);
        } catch (const StepTooLong&) {
            if (substeps >= most_substeps) throw;
        }
    }
}

void Stepping::step_fixed(State& state, StepSolver& solver, AdaptiveStepReport& report, StepWatch* watch) {
    if (watch) watch->begin(state, report.h);
    for (bool taken = false; !taken;) {
        try {
            step_whole(state, solver, report, watch);
            taken = true;
            if (settings_.refines) refine(state, solver, report, watch);
        } catch (const StepTooLong& failure) {
            try {
                step_in_substeps(state, solver, report, watch, failure);
                taken = true;
            } catch (const StepFailure& last) {
                if (!watch || !watch->give_up(failure, last)) {
                    if (!dynamic_cast<const StepTooLong*>(&last)) throw;
                    throw StepFailure(
                        fmt::format("{}; {} substeps of it are too long as well", failure.what(), most_substeps));
                }
                go_back(state);
            }
        }
    }
    if (watch) watch->end();
}

// ---- Steps by their error ----

void Stepping::step_within_error(AdaptiveStepping& control, State& state, double end, StepSolver& solver,
                                 AdaptiveStepReport& report, double most_work) {
    report.step.clear();
    report.substeps = 0;
    const double begin = state.t;
    double error = 0.0;
    const std::int64_t before = solver.effort().iterations;
    const auto work = [&] { return work_of(report.step, solver.effort().iterations - before); };
    for (; state.t < end && work() <= most_work; ++report.substeps) {
        pass_jump(state);
        const double left = (most_work - work()) / (system_.n() + 3.0 * report.step.unilateral_blocks);
        AdaptiveStepReport part = control.step(state, cut(state.t, end), solver, left);
        part.step.follow(report.step);
        std::swap(report.step, part.step);
        report.rejected += part.rejected;
        error += part.h * part.error;
    }
    report.error = error / (state.t - begin);
}

// ---- Fixed steps that err ----
//
// A fixed step is of order 2 where motion is smooth, and of order 1 where something meets, lets go, goes over an edge
// or turns round: it knows the speeds and not the time. Such steps are few as a rule, and their estimate tells them
// all. They are taken again by their error.
//
// Methods know what acts in the middle of a step. What happens after it shows in the next one, whose estimate may mean
// either. So a step that errs is taken again together with the one before, where that was taken as a whole: the state
// between them, which was shown already, is off by O(h²), and nothing of that remains. Where that does not come to its
// end with the work that there is, or errs by more, as where bodies chatter, the step stays as it was.

double Stepping::work_of(const StepReport& report, std::int64_t iterations) const {
    const double solves = report.newton_iterations + static_cast<double>(iterations) / iterations_of_a_solve;
    return solves * (system_.n() + 3.0 * report.unilateral_blocks);
}

double Stepping::error_of(const StepReport& report, double h) const {
    if (!settings_.judged || report.error.empty()) return std::numeric_limits<double>::quiet_NaN();
    const std::vector<double>& sizes = settings_.judged->sizes;
    double largest = 0.0;
    for (std::size_t i = 0; i < report.error.size(); ++i)
        largest = std::max(largest, report.error[i] / (sizes.empty() ? 1.0 : sizes[i]));
    return largest / (h * allowed());
}

// To cut between impacts costs a step a cut. That may be all that the step errs by.
bool Stepping::cut_between_impacts(double looser, State& state, StepSolver& solver, AdaptiveStepReport& report,
                                   StepWatch* watch) {
    constexpr double steps_of_a_cut = 2.0;  // one that is thrown away, as it has to be cut again
    const double end = last_.state.t + report.h;
    if (!cuts_ || report.step.second_impact_cut == 0.0 || report.substeps > 1 || cut(last_.state.t, end) != end)
        return false;
    const double cost = work_of(report.step, solver.effort().iterations);
    const auto most = static_cast<std::int64_t>(work_ / (steps_of_a_cut * cost)) - 1;
    if (most < 1) return false;
    const State whole = state;
    AdaptiveStepReport of_whole = report;
    const std::vector<double> after = timestepper_->save();
    const std::int64_t before = solver.effort().iterations;
    solver.forget_misses();
    if (!cuts_->cut(*timestepper_, last_.state, last_.method, report.h, most, state, solver, report.step)) {
        work_ -= steps_of_a_cut * cost;
        return false;
    }
    work_ -= work_of(report.step, solver.effort().iterations - before);
    report.error = error_of(report.step, report.h);
    report.refined = true;
    bool better = report.step.solved && report.error < of_whole.error;
    try {
        solver.require_usable();
        if (better && watch) judge(state, report, *watch);
    } catch (const StepFailure&) {
        better = false;
    }
    if (better) return report.error <= looser;
    take_back(whole, std::move(of_whole), after, state, report, watch);
    return false;
}

void Stepping::take_back(const State& whole, AdaptiveStepReport of_whole, const std::vector<double>& after,
                         State& state, AdaptiveStepReport& report, StepWatch* watch) {
    state = whole;
    report = std::move(of_whole);
    timestepper_->load(after);
    if (watch) judge(state, report, *watch);
}

void Stepping::refine(State& state, StepSolver& solver, AdaptiveStepReport& report, StepWatch* watch) {
    work_ = std::clamp(work_ + work_of_a_step, work_of_a_step, most_saved_work);
    const double looser = std::pow(most_saved_work / work_, 2);
    if (!(report.error > looser) || cut_between_impacts(looser, state, solver, report, watch)) return;
    const double solves = std::min(solves_of_a_substep * std::sqrt(report.error / looser), solves_of_an_impact);
    const double usual = work_of(report.step, solver.effort().iterations) * solves;
    if (usual > work_) return;
    const State whole = state;
    AdaptiveStepReport of_whole = report;
    const std::vector<double> after = timestepper_->save();
    bool better = false;
    const ChosenSteps chosen(*timestepper_);
    const double end = last_.state.t + report.h;
    StepEnergy counted;
    if (older_.whole) {
        counted = older_.energy;
        state = older_.state;
        timestepper_->load(older_.method);
    } else {
        go_back(state);
    }
    try {
        take_refined(looser, state, end, counted, solver, report, watch);
        better = report.error < of_whole.error;
    } catch (const StepFailure&) {
        work_ -= usual;
    }
    if (!better) take_back(whole, std::move(of_whole), after, state, report, watch);
}

void Stepping::take_refined(double looser, State& state, double end, const StepEnergy& counted, StepSolver& solver,
                            AdaptiveStepReport& report, StepWatch* watch) {
    StepControl control = *settings_.judged;
    control.absolute *= looser;
    control.slow *= looser;
    AdaptiveStepping refined(system_, *timestepper_, control);
    const std::int64_t before = solver.effort().iterations;
    step_within_error(refined, state, end, solver, report, work_);
    report.error *= looser;
    report.step.energy.add(counted, -1.0);
    if (!report.step.solved) throw StepFailure("solves of the substeps missed their tolerance");
    report.refined = true;
    report.again = older_.whole;
    work_ -= work_of(report.step, solver.effort().iterations - before);
    if (state.t < end) throw StepFailure("the substeps take more work than there is");
    if (watch) judge(state, report, *watch);
}

void Stepping::judge(const State& state, const AdaptiveStepReport& report, StepWatch& watch) {
    watch.begin_trial(1, report.again);
    watch.judge(state, report.h, report.step, true);
}

void Stepping::step_ahead(State& state, double end, StepSolver& solver, AdaptiveStepReport& report) {
    report.step.clear();
    report.substeps = 0;
    while (!ahead_->reaches(end)) {
        AdaptiveStepReport part = ahead_->advance(end, *timestepper_, *control_, solver);
        if (!ahead_->cut_by_corner()) ++report.substeps;
        part.step.follow(report.step);
        std::swap(report.step, part.step);
    }
    report.substeps = std::max<std::int64_t>(report.substeps, 1);
    show_ahead(state, end, solver, report);
    report.step.multipliers.clear();
}

// Where constraints lose rank, a state on the way of a step cannot be returned to them, nor can a step that ends there
// tell which of several branches it is on: velocities along them fit the constraints alike. The way that leapt over it
// does, and is shown as it is where it is off the constraints by no more than the method may err.
void Stepping::show_ahead(State& state, double end, StepSolver& solver, AdaptiveStepReport& report) {
    try {
        StepReport shown;
        solver.forget_misses();
        ahead_->show(end, state, solver, shown);
        solver.require_usable();
        shown.follow(report.step);
        std::swap(report.step, shown);
        return;
    } catch (const StepFailure&) {
        ahead_->read(end, state);
        std::vector<double> off(static_cast<std::size_t>(system_.m()));
        system_.constraint(state, off.data());
        const double limit = std::min(timestepper_->error_limit(), settings_.accuracy);
        if (std::all_of(off.begin(), off.end(), [limit](double C) { return std::abs(C) <= limit; })) return;
    }
    state = last_.state;
    timestepper_->restart();
    control_->set_largest(settings_.step);
    AdaptiveStepReport shown;
    step_within_error(*control_, state, end, solver, shown);
    report.step = std::move(shown.step);
    report.substeps = shown.substeps;
    ahead_->begin(state);
}

// ---- What is kept ----

void Stepping::begin_anew(const State& state) {
    if (ahead_) ahead_->begin(state);
    timestepper_->forces_jumped();
    unchanged_.forget();
    last_.whole = false;
}

std::vector<double> Stepping::multipliers(const State& state, StepSolver& solver, const StepReport& report) {
    return ahead_ ? ahead_->multipliers(state, solver) : report.multipliers;
}

SteppingMemory Stepping::save() const {
    SteppingMemory memory{.method = timestepper_->save(), .control = {}, .ahead = {}};
    if (control_) memory.control = control_->save();
    if (settings_.refines) {
        memory.control = {work_};
        if (last_.whole) {
            memory.control.push_back(last_.state.t);
            const auto energy = std::bit_cast<EnergyNumbers>(last_.energy);
            memory.control.insert(memory.control.end(), energy.begin(), energy.end());
            for (const auto* values : {&last_.state.q, &last_.state.v, &last_.method})
                memory.control.insert(memory.control.end(), values->begin(), values->end());
        }
    }
    if (ahead_) memory.ahead = ahead_->save();
    return memory;
}

void Stepping::load(const SteppingMemory& memory, const State& state) {
    timestepper_->load(memory.method);
    unchanged_.forget();
    if (control_) control_->load(memory.control);
    if (settings_.refines) {
        const auto& control = memory.control;
        const std::size_t of_state = 2 + EnergyNumbers().size() + state.q.size() + state.v.size();
        if (control.size() != 1 && control.size() < of_state)
            throw InputError("the memory of divided steps has not the size of the system");
        work_ = control.front();
        last_ = {};
        if (control.size() > 1) {
            auto next = control.begin() + 2;
            EnergyNumbers energy{};
            for (double& number : energy) number = *next++;
            const auto take = [&](std::vector<double>& values, std::size_t count) {
                values.assign(next, next + static_cast<std::ptrdiff_t>(count));
                next += static_cast<std::ptrdiff_t>(count);
            };
            last_ = {.state = {control[1], {}, {}},
                     .method = {},
                     .whole = true,
                     .energy = std::bit_cast<StepEnergy>(energy)};
            take(last_.state.q, state.q.size());
            take(last_.state.v, state.v.size());
            take(last_.method, control.size() - of_state);
        }
    }
    if (!ahead_) return;
    if (memory.ahead.empty()) return ahead_->begin(state);
    ahead_->load(memory.ahead);
}

double Stepping::allowed() const {
    const auto& control = settings_.judged ? settings_.judged : settings_.divided;
    const bool by_accuracy = control && !control->sizes.empty();
    return by_accuracy ? control->absolute / control->unit : std::numeric_limits<double>::quiet_NaN();
}

void Stepping::describe(const AdaptiveStepReport& taken, const SolverEffort& spent, StepRecord& record) const {
    const SolverEffort& effort = unchanged_.repeated() ? *unchanged_.repeated() : spent;
    record.h = taken.h;
    record.substeps = taken.substeps;
    record.rejected = taken.rejected;
    record.impact = taken.impact;
    record.error = allowed() * taken.h * (std::isnan(taken.error) ? 0.0 : taken.error);
    record.contacts = taken.step.unilateral_blocks;
    record.newton_iterations = taken.step.newton_iterations;
    record.solver_iterations = effort.iterations;
    record.natural = effort.worst_natural;
    record.solved = taken.step.solved;
    record.linearization = taken.step.linearization;
}

void Stepping::keep_control_of(const Stepping& other) {
    if (control_ && other.control_) control_->load(other.control_->save());
    if (settings_.refines && other.settings_.refines) work_ = other.work_;
}

}  // namespace delassus
