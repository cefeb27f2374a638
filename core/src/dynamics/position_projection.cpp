// SPDX-License-Identifier: BSD-3-Clause
// On the level of velocities constraints drift by O(h³) a step, and a contact that closed penetrates by up to
// (1 − θ) h |u⁻|. The least motion x in the norm of H that undoes it solves
//
//     H x − Dᵀ ν = 0,      C + C_q x = 0,      g + D_n x ≥ g_least  ⊥  ν ≥ 0
//
// at the end of the step, without friction: the part on positions of Brüls, Acary and Cardona (CMAME 281, 2014), of
// which Gear, Gupta and Leimkuhler's is the one without contacts. H contains the stiffness, so that elastic bodies move
// as a whole. What is solved for is the speed x/h. g_least bounds how fast a penetration is undone that the step began
// with. The energy that it gives is −f·x.
//
// What x moves may come into shapes that nothing was near to before, as in a pile where a ball pushed another one
// aside: pairs that were not looked at. Then the same is asked for again from there, with their rows, until no such
// pair lacks anything.
//
// A mechanism may start with bodies that overlap and that its joints do not let apart: then no x is there. And where
// they let them apart by a long way only, that way is no answer either. So where a step begins with a penetration its
// gaps are compliant, g + D_n x + E ν ≥ g_least with E = 10⁻³ D_n diag(H)⁻¹ D_nᵀ by rows: what can be undone is, but
// for a thousandth of a part, and what cannot stays.
#include "dynamics/position_projection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "dynamics/linear_problem.hpp"
#include "dynamics/velocity_contacts.hpp"

namespace delassus {

PositionProjection::PositionProjection(DynamicalSystem& system)
    : system_(system),
      blocks_(system.constraint_blocks()),
      n_(system.n()),
      m_(system.m()),
      resolution_(system.gap_resolution()),
      constraint_(static_cast<std::size_t>(m_)),
      ways_(system) {}

/// Measures constraints and gaps, whose rows it collects.
PositionProjection::Lack PositionProjection::measure(const State& end, double h, const VelocityContacts& contacts) {
    Lack lack;
    if (m_ > 0) system_.constraint(end, constraint_.data());
    for (const double C : constraint_) lack.constraints = std::max(lack.constraints, std::abs(C));
    rows_.clear();
    if (contacts.any()) {
        rows_.measure_speeds_at(nullptr);
        system_.collect_unilateral(end, h, rows_);
        std::size_t row = 0;
        for (const auto& block : rows_.blocks()) {
            const double gap = rows_.rows()[row].gap;
            if (block.along_normal() && gap < 0.0 && !std::ranges::binary_search(keys_, block.key))
                lack.gaps = std::max(lack.gaps, contacts.least_gap(block.key) - gap);
            row += static_cast<std::size_t>(block.cone.rows);
        }
    }
    return lack;
}

/// The problem, of what was measured.
void PositionProjection::assemble(const State& end, double h, const Lack& lack, const VelocityContacts& contacts) {
    std::int32_t count = 0;
    problem_.b.assign(constraint_.begin(), constraint_.end());
    problem_.cones.clear();
    for (const std::int32_t rows : blocks_) problem_.cones.push_back(Cone::free(rows));
    // Gaps wider than this are out of reach of what moves by about what lacks.
    const double reach = 10.0 * std::max(lack.constraints, lack.gaps) + resolution_;
    const auto for_each_near = [&](const auto& visit) {
        std::size_t row = 0;
        for (const auto& block : rows_.blocks()) {
            if (block.along_normal() && rows_.rows()[row].gap < reach) visit(block, row);
            row += static_cast<std::size_t>(block.cone.rows);
        }
    };
    for_each_near([&](const auto&, std::size_t) { ++count; });
    D_.begin(m_ + count, n_);
    if (m_ > 0) system_.add_constraint_jacobian(end, 0, D_);
    for_each_near([&](const auto& block, std::size_t row) {
        const auto target = static_cast<std::int32_t>(problem_.b.size());
        for (auto e = rows_.row_start()[row]; e < rows_.row_start()[row + 1]; ++e)
            D_.add(target, rows_.column()[static_cast<std::size_t>(e)], rows_.value()[static_cast<std::size_t>(e)]);
        problem_.b.push_back(rows_.rows()[row].gap - contacts.least_gap(block.key));
        problem_.cones.push_back(Cone::nonnegative(1));
        keys_.push_back(block.key);
    });
    std::ranges::sort(keys_);
    // What is off by rounding is left: rows that hold one body and imply one another would contradict each other by it.
    for (double& entry : problem_.b) entry = std::abs(entry) <= resolution_ ? 0.0 : entry / h;
    D_.finish_into(problem_.D);
}

/// E of the gaps, behind rows without one.
void PositionProjection::make_compliant() {
    constexpr double share = 1e-3, least = 1e-6;
    SparseMatrix& E = problem_.E;
    const SparseMatrix& D = problem_.D;
    E.rows = E.columns = D.rows;
    E.row_start.assign(static_cast<std::size_t>(m_) + 1, 0);
    E.column.clear();
    E.value.clear();
    diagonal_of(problem_.H, diagonal_);
    const double floor = least / *std::max_element(diagonal_.begin(), diagonal_.end());
    for (std::int32_t row = m_; row < D.rows; ++row) {
        double mobility = 0.0;
        for (auto e = D.row_start[static_cast<std::size_t>(row)]; e < D.row_start[static_cast<std::size_t>(row) + 1];
             ++e) {
            const auto entry = static_cast<std::size_t>(e);
            mobility += D.value[entry] * D.value[entry] / diagonal_[static_cast<std::size_t>(D.column[entry])];
        }
        E.column.push_back(row);
        E.value.push_back(std::max(share * mobility, floor));
        E.row_start.push_back(static_cast<std::int32_t>(E.value.size()));
    }
}

/// From nothing.
void PositionProjection::solve(StepSolver& solver, StepReport& report) {
    solution_.x.assign(static_cast<std::size_t>(n_), 0.0);
    solution_.lambda.assign(problem_.b.size(), 0.0);
    report.take(solver.solve(problem_, solution_, {.warm_start = true, .corrects = true}));
    ++report.newton_iterations;
}

void PositionProjection::project(const State& begin, State& end, double h, const Problem& problem,
                                 std::span<const double> left, const VelocityContacts& contacts, StepSolver& solver,
                                 StepReport& report, std::string_view method) {
    constexpr int most_rounds = 8;
    moved_ = false;
    keys_.clear();
    if (n_ == 0) return;
    Lack lack = measure(end, h, contacts);
    if (std::max(lack.constraints, lack.gaps) <= resolution_) return;
    const double off = lack.constraints;
    problem_.name = "position";
    problem_.law = Law::Associated;
    problem_.H = problem.H;
    problem_.a.assign(static_cast<std::size_t>(n_), 0.0);
    delta_.assign(static_cast<std::size_t>(n_), 0.0);
    moved_ = !contacts.begins_deep();
    for (int round = 1;; ++round) {
        assemble(end, h, lack, contacts);
        if (contacts.begins_deep()) {
            make_compliant();
        } else if (problem_.E.rows > 0) {
            problem_.E = {};
        }
        move(begin, end, h, solver, report, method);
        if (round == most_rounds || keys_.empty()) break;
        lack = measure(end, h, contacts);
        if (lack.gaps <= resolution_) break;
    }
    if (m_ == 0) return;
    ways_.find(problem, begin, end, left);
    require_nearer(begin, end, h, off, method);
}

/// By the answer to the problem.
void PositionProjection::move(const State& begin, State& end, double h, StepSolver& solver, StepReport& report,
                              std::string_view method) {
    solve(solver, report);
    for (double& entry : solution_.x) entry *= h;
    for (std::size_t i = 0; i < delta_.size(); ++i) delta_[i] += solution_.x[i];
    const auto pushed = [](double impulse) { return impulse > 0.0; };
    if (std::any_of(solution_.lambda.begin() + m_, solution_.lambda.end(), pushed)) {
        force_.assign(static_cast<std::size_t>(n_), 0.0);
        system_.add_force(end, 1.0, force_.data());
        double work = 0.0;
        for (std::size_t i = 0; i < force_.size(); ++i) work -= force_[i] * solution_.x[i];
        report.energy.recovered += std::max(work, 0.0);
    }
    system_.increment(end.q.data(), solution_.x.data(), end.q.data());
    require_finite(begin, end, h, method);
}

void PositionProjection::project_velocities(State& end, const SparseMatrix& H, StepSolver& solver, StepReport& report) {
    problem_.name = "velocity";
    problem_.law = Law::Associated;
    problem_.H = H;
    problem_.E = {};
    D_.begin(m_, n_);
    system_.add_constraint_jacobian(end, 0, D_);
    D_.finish_into(problem_.D);
    system_.constraint_rate(end, constraint_.data());
    problem_.b.assign(constraint_.begin(), constraint_.end());
    for (std::int32_t row = 0; row < m_; ++row)
        problem_.b[static_cast<std::size_t>(row)] += problem_.D.row_times(row, end.v.data());
    problem_.cones.clear();
    for (const std::int32_t rows : blocks_) problem_.cones.push_back(Cone::free(rows));
    problem_.a.assign(static_cast<std::size_t>(n_), 0.0);
    solve(solver, report);
    for (std::size_t i = 0; i < end.v.size(); ++i) end.v[i] += solution_.x[i];
}

// A linear step towards C = 0 takes most of C away, or the positions were too far off for it. What is below a
// thousandth of a row's way, or 10⁴ times the resolution, may be the tolerance of the solver.
void PositionProjection::require_nearer(const State& begin, const State& end, double h, double off,
                                        std::string_view method) {
    constexpr double share_of_way = 1e-3;
    double left = 0.0;
    system_.constraint(end, constraint_.data());
    for (std::size_t row = 0; row < constraint_.size(); ++row) {
        const double C = std::abs(constraint_[row]);
        if (C > ways_.digits() + share_of_way * ways_.of(problem_.D, row)) left = std::max(left, C);
    }
    if (left <= 0.5 * off || left <= 1e4 * resolution_) return;
    throw StepTooLong(fmt::format(
        "{} cannot take the step from t = {:.9g} with h = {:.9g}: it leaves constraints off by {:.2g}, and projecting "
        "the positions by {:.2g}; take shorter steps, or a method that iterates on positions (euler_implicit, hht)",
        method, begin.t, h, off, left));
}

}  // namespace delassus
