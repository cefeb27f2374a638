// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/shared_steps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <limits>
#include <utility>

#include "delassus/error.hpp"
#include "delassus/timestepper.hpp"
#include "dynamics/step_tolerance.hpp"
#include "solver/auto_solver.hpp"
#include "solver/judgement.hpp"

namespace delassus {

SharedSteps::SharedSteps(std::shared_ptr<const Communicator> communicator, const Registry& registry,
                         SolverConfig config)
    : communicator_(std::move(communicator)), registry_(registry), config_(std::move(config)) {
    solver_ = std::make_unique<PartitionedSolver>(registry_, config_, communicator_);
}
SharedSteps::~SharedSteps() = default;

void SharedSteps::set_shares(StepShares shares) {
    shares_ = std::move(shares);
    body_of_.clear();
    std::vector<std::int64_t> wanted;
    for (std::size_t k = 0; k < shares_.bodies.size(); ++k) {
        const auto& body = shares_.bodies[k];
        for (std::int32_t i = 0; i < body.count; ++i) {
            body_of_.push_back(static_cast<std::int32_t>(k));
            wanted.push_back(body.first_column + i);
        }
    }
    columns_ = Halo(*communicator_, shares_.column_start, std::move(wanted));
}

// ---- Ending together ----
//
// A step is a sequence of solves, between which each process computes alone. Before each solve, wherever a decision
// depends on all, and at the end of the step, the processes meet in one and the same reduction: of what trouble they
// have, and of a flag. A process in trouble goes to the next meeting at once, and does not go on after it; the others
// meet it there, whichever meeting that is for them.

bool SharedSteps::agree(Trouble trouble, const std::string& sentence, bool flag) {
    std::array<std::int64_t, 2> worst = {static_cast<std::int64_t>(trouble), flag ? 1 : 0};
    communicator_->max(worst);
    if (worst[0] == 0) return worst[1] == 0;
    ended_together_ = true;
    const auto troubles = communicator_->all(static_cast<std::int64_t>(trouble));
    int first = 0;
    while (troubles[static_cast<std::size_t>(first)] == 0) ++first;
    const std::string said = communicator_->broadcast(sentence, first);
    switch (static_cast<Trouble>(troubles[static_cast<std::size_t>(first)])) {
        case Trouble::Interrupted:
            throw StepInterrupted(said);
        case Trouble::TooLong:
            throw StepTooLong(said);
        case Trouble::Unsupported:
            throw Unsupported(said);
        case Trouble::Input:
            throw InputError(said);
        default:
            throw StepFailure(said);
    }
}

void SharedSteps::step(const std::function<void()>& body) {
    ended_together_ = false;
    Trouble trouble = Trouble::None;
    std::string sentence;
    const auto note = [&](Trouble one, const char* what) {
        if (ended_together_) throw;
        trouble = one;
        sentence = what;
    };
    try {
        body();
    } catch (const StepInterrupted& error) {
        note(Trouble::Interrupted, error.what());
    } catch (const StepTooLong& error) {
        note(Trouble::TooLong, error.what());
    } catch (const StepFailure& error) {
        note(Trouble::Failure, error.what());
    } catch (const Unsupported& error) {
        note(Trouble::Unsupported, error.what());
    } catch (const InputError& error) {
        note(Trouble::Input, error.what());
    } catch (const std::bad_alloc&) {
        note(Trouble::Failure, "out of memory");
    }
    agree(trouble, sentence, false);
}

bool SharedSteps::on_all(bool own) {
    return agree(Trouble::None, {}, !own);
}

double SharedSteps::largest_on_all(double own) {
    agree(Trouble::None, {}, false);
    communicator_->max(std::span(&own, 1));
    return own;
}

// ---- The own part of a problem ----

void SharedSteps::share_rows(const Problem& local) {
    own_cones_.assign(local.cones.size(), false);
    own_rows_.clear();
    rows_of_bodies_.assign(shares_.bodies.size(), 0);
    std::int32_t row = 0;
    for (std::size_t c = 0; c < local.cones.size(); ++c) {
        const std::int32_t end = row + local.cones[c].rows;
        std::int32_t decides = -1;
        for (auto e = local.D.row_start[static_cast<std::size_t>(row)];
             e < local.D.row_start[static_cast<std::size_t>(end)]; ++e) {
            const std::int32_t body = body_of_[static_cast<std::size_t>(local.D.column[static_cast<std::size_t>(e)])];
            if (decides < 0 || shares_.bodies[static_cast<std::size_t>(body)].decides <
                                   shares_.bodies[static_cast<std::size_t>(decides)].decides)
                decides = body;
        }
        own_cones_[c] = decides >= 0 && is_own(shares_.bodies[static_cast<std::size_t>(decides)]);
        if (own_cones_[c]) {
            rows_of_bodies_[static_cast<std::size_t>(decides)] += local.cones[c].rows;
            for (; row < end; ++row) own_rows_.push_back(row);
        }
        row = end;
    }
}

PartitionedProblem SharedSteps::part_of(const Problem& local) {
    share_rows(local);
    PartitionedProblem part;
    part.name = local.name;
    part.law = local.law;
    part.column_start = shares_.column_start;
    const auto starts_of = [&](std::int64_t own) {
        std::vector<std::int64_t> start = {0};
        for (const std::int64_t count : communicator_->all(own)) start.push_back(start.back() + count);
        return start;
    };
    part.row_start = starts_of(static_cast<std::int64_t>(own_rows_.size()));
    part.cone_start = starts_of(std::count(own_cones_.begin(), own_cones_.end(), true));
    const std::int64_t n_all = part.n_all(), m_all = part.m_all();
    const std::int64_t first_row = part.row_start[static_cast<std::size_t>(communicator_->rank())];

    const auto number_of = [&](std::int32_t column) {
        const auto& body = shares_.bodies[static_cast<std::size_t>(body_of_[static_cast<std::size_t>(column)])];
        return body.first_column + (column - body.column);
    };
    std::vector<std::pair<std::int64_t, double>> entries;
    const auto add_row = [&](const SparseMatrix& matrix, std::int32_t row, const auto& number, LocalMatrix& to) {
        entries.clear();
        for (auto e = static_cast<std::size_t>(matrix.row_start[static_cast<std::size_t>(row)]);
             e < static_cast<std::size_t>(matrix.row_start[static_cast<std::size_t>(row) + 1]); ++e)
            entries.emplace_back(number(matrix.column[e]), matrix.value[e]);
        std::sort(entries.begin(), entries.end());
        for (const auto& [column, value] : entries) {
            to.column.push_back(column);
            to.value.push_back(value);
        }
        to.row_start.push_back(static_cast<std::int64_t>(to.column.size()));
        ++to.rows;
    };
    part.H.columns = part.D.columns = n_all;
    for (const auto& body : shares_.bodies) {
        if (!is_own(body)) continue;
        part.body_start.push_back(body.first_column);
        for (std::int32_t i = body.column; i < body.column + body.count; ++i) {
            add_row(local.H, i, number_of, part.H);
            part.a.push_back(local.a[static_cast<std::size_t>(i)]);
        }
    }
    for (const std::int32_t row : own_rows_) {
        add_row(local.D, row, number_of, part.D);
        part.b.push_back(local.b[static_cast<std::size_t>(row)]);
    }
    for (std::size_t c = 0; c < local.cones.size(); ++c)
        if (own_cones_[c]) part.cones.push_back(local.cones[c]);
    std::int64_t compliant = local.E.entries() > 0 ? 1 : 0;
    communicator_->max(std::span(&compliant, 1));
    if (compliant == 0) return part;
    part.E.columns = m_all;
    const auto number_of_row = [&](std::int32_t row) {
        const auto found = std::lower_bound(own_rows_.begin(), own_rows_.end(), row);
        return first_row + (found - own_rows_.begin());
    };
    const SparseMatrix none = SparseMatrix::zero(local.m(), local.m());
    for (const std::int32_t row : own_rows_) add_row(local.E.rows > 0 ? local.E : none, row, number_of_row, part.E);
    return part;
}

std::vector<double> SharedSteps::own_columns(std::span<const double> local) const {
    std::vector<double> own;
    own.reserve(static_cast<std::size_t>(columns_.own()));
    for (const auto& body : shares_.bodies)
        if (is_own(body)) own.insert(own.end(), local.begin() + body.column, local.begin() + body.column + body.count);
    return own;
}

void SharedSteps::spread(std::vector<double> own, std::vector<double>& local) const {
    columns_.fetch(*communicator_, own);
    local.resize(body_of_.size());
    for (const auto& body : shares_.bodies)
        for (std::int32_t i = 0; i < body.count; ++i)
            local[static_cast<std::size_t>(body.column + i)] = own[columns_.place(body.first_column + i)];
}

void SharedSteps::gather_bilateral(const std::vector<double>& own) {
    bilateral_.assign(static_cast<std::size_t>(shares_.all_rows), 0.0);
    if (bilateral_.empty()) return;
    for (std::size_t k = 0; k < own_rows_.size(); ++k)
        if (const auto row = static_cast<std::size_t>(own_rows_[k]); row < shares_.rows.size())
            bilateral_[static_cast<std::size_t>(shares_.rows[row])] = own[k];
    communicator_->sum(bilateral_);
}

// ---- Solving ----

double SharedSteps::goal_for(const PreparedPart& part, std::span<const double> own_error,
                             const PartTraits& traits) const {
    const LocalMatrix& H = part.problem().H;
    const std::int64_t first = shares_.column_start[static_cast<std::size_t>(communicator_->rank())];
    double square = 0.0;
    for (std::size_t i = 0; i < own_error.size(); ++i)
        for (auto e = static_cast<std::size_t>(H.row_start[i]); e < static_cast<std::size_t>(H.row_start[i + 1]); ++e)
            if (H.column[e] == first + static_cast<std::int64_t>(i)) square += H.value[e] * own_error[i] * own_error[i];
    communicator_->sum(std::span(&square, 1));
    return goal_of({.in_masses = std::sqrt(std::abs(square)),
                    .in_rows = part.norm_in_rows(own_error),
                    .reference = part.reference(),
                    .rows = static_cast<double>(part.problem().m_all()),
                    .gathered = true},
                   traits);
}

bool SharedSteps::solve(const Problem& local, Solution& solution, bool warm_start, const SolveSettings& settings,
                        std::span<const double> method_error, SolverEffort& effort) {
    agree(Trouble::None, {}, false);
    // All that follows is collective: what it throws it throws on all processes.
    ended_together_ = true;
    const PreparedPart part(communicator_, part_of(local));
    Solution own;
    own.lambda.assign(own_rows_.size(), 0.0);
    if (warm_start) {
        own.x = own_columns(solution.x);
        for (std::size_t k = 0; k < own_rows_.size(); ++k)
            own.lambda[k] = solution.lambda[static_cast<std::size_t>(own_rows_[k])];
    }
    bool solved = true;
    if (part.problem().m_all() == 0) {
        part.free_velocities(own.x);
    } else {
        const std::vector<double> own_error = method_error.empty() ? std::vector<double>{} : own_columns(method_error);
        std::int64_t known = method_error.empty() ? 0 : 1;
        communicator_->max(std::span(&known, 1));
        if (!warm_start) own.x.assign(part.problem().a.size(), 0.0);
        SolveSettings of = settings;
        of.team = nullptr;
        PartTraits traits{part.needs(), amplification_of(part.problem().cones, part.problem().law)};
        communicator_->max(std::span(&traits.amplification, 1));
        set_step_tolerance(config_, traits,
                           known != 0 ? std::optional(goal_for(part, own_error, traits)) : std::nullopt, of);
        solved = solve_part(part, own, warm_start, of, traits, effort);
    }
    spread(own.x, solution.x);
    solution.lambda.assign(static_cast<std::size_t>(local.m()), 0.0);
    for (std::size_t k = 0; k < own_rows_.size(); ++k)
        solution.lambda[static_cast<std::size_t>(own_rows_[k])] = own.lambda[k];
    gather_bilateral(own.lambda);
    for (std::size_t k = 0; k < shares_.rows.size(); ++k)
        solution.lambda[k] = bilateral_[static_cast<std::size_t>(shares_.rows[k])];
    ended_together_ = false;
    return solved;
}

bool SharedSteps::solve_part(const PreparedPart& part, Solution& own, bool warm_start, const SolveSettings& settings,
                             const PartTraits& traits, SolverEffort& effort) {
    constexpr double slack_of_rounding = 32.0;
    SolveReport report;
    const auto run = [&](PartitionedSolver& solver, Solution& answer) {
        SolveSettings of = settings;
        of.warm_start = warm_start && (solver.info().capabilities & DELASSUS_CAN_WARM_START) != 0;
        report = solver.solve(part, answer, of);
        if (report.status == Status::Cancelled) throw StepInterrupted("the step was interrupted");
        ++effort.plugin_solves;
        effort.iterations += report.iterations;
        effort.seconds += report.seconds_setup + report.seconds_solve;
        if (report.stages.empty() && report.solver != auto_name) loaded_.insert(report.solver);
        for (const auto& stage : report.stages) loaded_.insert(stage.solver);
    };
    const auto done = [&] {
        return report.status == Status::Solved || report.near_goal ||
               (config_.sweeps && report.status == Status::IterationLimit);
    };
    const auto judge = [&] {
        if (!done()) report.near_goal = last_resort(config_, traits, settings, report);
    };
    const Solution start = own;
    run(*solver_, own);
    // As well as rounding lets the rows hold, and balanced.
    const bool rounding = report.error.natural <= slack_of_rounding * report.error.rounding &&
                          report.error.balance <= rounding_limit_of_steps;
    judge();
    if (!done() && rounding) return true;
    if (!done() && config_.name != auto_name && !config_.sweeps) {
        if (!fallback_) {
            SolverConfig other = config_;
            other.name = auto_name;
            other.options = {{"simulation", "true"}};
            fallback_ = std::make_unique<PartitionedSolver>(registry_, other, communicator_);
        }
        const SolveReport first = report;
        Solution second = start;
        run(*fallback_, second);
        judge();
        ++effort.repeated;
        if (done() || report.error.natural < first.error.natural)
            own = std::move(second);
        else
            report = first;
    }
    effort.worst_natural = std::max(effort.worst_natural, report.error.natural);
    if (report.near_goal) ++effort.near_goal;
    if (done()) return true;
    effort.worst_miss =
        std::max(effort.worst_miss, worst_of(report.error) / std::max(settings.tolerance, rounding_limit_of_steps));
    if (effort.unsolved.empty())
        effort.unsolved =
            fmt::format("{} ended with {} at a natural error of {:.1e}{}{}", report.solver, name_of(report.status),
                        report.error.natural, report.message.empty() ? "" : ": ", report.message);
    return false;
}

}  // namespace delassus
