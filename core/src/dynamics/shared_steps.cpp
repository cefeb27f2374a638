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
#include "delassus/prepared_part.hpp"
#include "delassus/timestepper.hpp"

namespace delassus {

SharedSteps::SharedSteps(std::shared_ptr<const Communicator> communicator, const Registry& registry,
                         SolverConfig config)
    : communicator_(std::move(communicator)), registry_(registry), config_(std::move(config)) {
    together(*communicator_, [&] { solver_ = std::make_unique<IslandSolver>(registry_, config_); });
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

void SharedSteps::solve(const Problem& local, Solution& solution, const StepRequest& request,
                        const SolveSettings& settings, IslandResult& result) {
    agree(Trouble::None, {}, false);
    // All that follows is collective: what it throws it throws on all processes.
    ended_together_ = true;
    const PreparedPart part(communicator_, part_of(local));
    Solution own;
    own.lambda.assign(own_rows_.size(), 0.0);
    if (request.warm_start) {
        own.x = own_columns(solution.x);
        for (std::size_t k = 0; k < own_rows_.size(); ++k)
            own.lambda[k] = solution.lambda[static_cast<std::size_t>(own_rows_[k])];
    }
    if (part.problem().m_all() == 0) {
        part.free_velocities(own.x);
    } else {
        SolveSettings of = settings;
        of.team = nullptr;
        IslandRequest island{.settings = of, .warm_start = request.warm_start, .gathered = true};
        std::int64_t known = request.method_error.empty() ? 0 : 1;
        communicator_->max(std::span(&known, 1));
        std::vector<double> own_error;
        if (!request.method_error.empty()) own_error = own_columns(request.method_error);
        if (known != 0) island.method_error = own_error;
        for (const double left : request.error_of_solves)
            island.error_of_solves = std::max(island.error_of_solves, left);
        solver_->solve(part, own, island, result);
    }
    spread(own.x, solution.x);
    solution.lambda.assign(static_cast<std::size_t>(local.m()), 0.0);
    for (std::size_t k = 0; k < own_rows_.size(); ++k)
        solution.lambda[static_cast<std::size_t>(own_rows_[k])] = own.lambda[k];
    gather_bilateral(own.lambda);
    for (std::size_t k = 0; k < shares_.rows.size(); ++k)
        solution.lambda[k] = bilateral_[static_cast<std::size_t>(shares_.rows[k])];
    ended_together_ = false;
}

}  // namespace delassus
