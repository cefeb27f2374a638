// SPDX-License-Identifier: BSD-3-Clause
#include "shifted_factor.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "delassus/sdk/h_inverse.hpp"
#include "delassus/sdk/saddle_point.hpp"

namespace delassus_cholmod {

using delassus::sdk::NumericalFailure;
using delassus::sdk::ProblemView;

namespace {

// Small against the scaled diagonal, 1, and large against rounding in the factor. The quasi-definite form divides by
// the shift where it eliminates a reaction first, and loses about ε/shift (Gill, Saunders, Shinnerl 1996).
constexpr double kSchurShift = 1e-12;
constexpr double kQuasiDefiniteShift = 1e-9;
constexpr double kLargestShift = 1e-4;

constexpr double kLargestCount = std::numeric_limits<std::int32_t>::max();

// Entries of the factor beyond which a denser Schur complement is not worth its better accuracy.
constexpr double kSmallFactor = 2e4;

// Times the work of the quasi-definite form, beyond which the Schur complement's better accuracy is not worth its own:
// refinement makes up for it.
constexpr double kDearFactor = 8.0;

}  // namespace

void ShiftedFactor::factorize(const ProblemView& problem) {
    definite_ = !problem.needs_any(DELASSUS_CAN_H_SEMIDEFINITE);
    if (pattern_is_new_) {
        form_ = definite_ ? settings_.form : Form::QuasiDefinite;
        mass_.reset();
        saddle_.reset();
        dual_shift_ = settings_.shift;
    }
    scale_mass(problem);
    factorize_mass(problem);
    scale_constraints(problem);
    if (pattern_is_new_) {
        choose_form();
        ++analyses_;
        pattern_is_new_ = false;
    }
    factorize_saddle_point();
}

void ShiftedFactor::scale_mass(const ProblemView& problem) {
    const Vector diagonal = delassus::sdk::magnitude_of_diagonal(problem);
    system_.R.resize(problem.n);
    stand_in_.resize(problem.n);
    for (Eigen::Index i = 0; i < problem.n; ++i) {
        stand_in_[i] = 1.0 / diagonal[i];
        system_.R[i] = inverse_root_power_of_two(diagonal[i]);
    }
    system_.H = SparseRows(problem.H);
    for (Eigen::Index j = 0; j < problem.n; ++j)
        for (SparseColumns::InnerIterator entry(system_.H, j); entry; ++entry)
            entry.valueRef() *= system_.R[entry.row()] * system_.R[j];
    system_.D = problem.D;
    for (Eigen::Index i = 0; i < problem.m; ++i)
        for (SparseRows::InnerIterator entry(system_.D, i); entry; ++entry) entry.valueRef() *= system_.R[entry.col()];
}

void ShiftedFactor::factorize_mass(const ProblemView& problem) {
    diagonal_.setZero(problem.m);
    if (!definite_ || problem.n == 0) {
        for (Eigen::Index i = 0; i < problem.m; ++i)
            for (SparseRowsView::InnerIterator entry(problem.D, i); entry; ++entry)
                diagonal_[i] += entry.value() * entry.value() * stand_in_[entry.col()];
        Z_.resize(problem.n, problem.m);
        keep_Z_ = form_ != Form::QuasiDefinite;
        squared_counts_ = 0.0;
        return;
    }
    if (!mass_) {
        mass_ = std::make_unique<Cholesky>(Cholesky::Kind::Definite, settings_.ordering, settings_.method);
        mass_->analyze(system_.H);
    }
    if (!mass_->factorize(system_.H))
        throw NumericalFailure("the Cholesky factorisation of H failed: H is not positive definite");

    // Z is kept where the Schur complement will be formed or may be; a Z much larger than the problem decides against
    // it.
    const double budget = form_ == Form::Schur
                              ? kLargestCount
                              : 20.0 * (mass_->entries() + static_cast<double>(system_.D.nonZeros())) + kSmallFactor;
    keep_Z_ = form_ != Form::QuasiDefinite;
    std::vector<std::int32_t> start{0}, index;
    std::vector<double> value;
    std::vector<double> count(static_cast<std::size_t>(problem.n), 0.0);
    mass_->half_solve(system_.D, [&](Eigen::Index row, const std::vector<std::int32_t>& reach, const Vector& column) {
        for (const auto i : reach) diagonal_[row] += column[i] * column[i];
        if (!keep_Z_) return;
        if (static_cast<double>(index.size() + reach.size()) > budget) {
            if (form_ == Form::Schur)
                throw NumericalFailure(
                    "L⁻¹Dᵀ has more entries than 32-bit indices can count; use "
                    "form = quasi_definite");
            keep_Z_ = false;
            index = {};
            value = {};
            return;
        }
        for (const auto i : reach) {
            index.push_back(i);
            value.push_back(column[i]);
            count[static_cast<std::size_t>(i)] += 1.0;
        }
        start.push_back(static_cast<std::int32_t>(index.size()));
    });
    squared_counts_ = 0.0;
    for (const double c : count) squared_counts_ += c * c;
    if (keep_Z_)
        Z_ = Eigen::Map<const SparseColumns>(problem.n, problem.m, static_cast<Eigen::Index>(index.size()),
                                             start.data(), index.data(), value.data());
    else
        Z_.resize(0, 0);
}

void ShiftedFactor::scale_constraints(const ProblemView& problem) {
    for (Eigen::Index i = 0; i < problem.m; ++i)
        for (SparseRowsView::InnerIterator entry(problem.E, i); entry; ++entry)
            if (entry.col() == i) diagonal_[i] += entry.value();
    const auto positive = (diagonal_.array() > 0.0).count();
    const double mean = positive > 0 ? diagonal_.sum() / static_cast<double>(positive) : 1.0;
    system_.S.resize(problem.m);
    for (Eigen::Index i = 0; i < problem.m; ++i)
        system_.S[i] = inverse_root_power_of_two(diagonal_[i] > 0.0 ? diagonal_[i] : mean);
    for (Eigen::Index i = 0; i < problem.m; ++i)
        for (SparseRows::InnerIterator entry(system_.D, i); entry; ++entry) entry.valueRef() *= system_.S[i];
    system_.E = SparseRows(problem.E);
    for (Eigen::Index j = 0; j < problem.m; ++j)
        for (SparseColumns::InnerIterator entry(system_.E, j); entry; ++entry)
            entry.valueRef() *= system_.S[entry.row()] * system_.S[j];
    if (keep_Z_)
        for (Eigen::Index j = 0; j < problem.m; ++j)
            for (SparseColumns::InnerIterator entry(Z_, j); entry; ++entry) entry.valueRef() *= system_.S[j];
}

void ShiftedFactor::choose_form() {
    const auto m = static_cast<double>(system_.D.rows());
    const double schur_entries = std::min(squared_counts_, m * m);
    if (form_ == Form::Schur && schur_entries > kLargestCount)
        throw NumericalFailure(
            "the Schur complement has more entries than 32-bit indices can count; use "
            "form = quasi_definite");
    const auto make = [this](Form form) {
        const bool schur = form == Form::Schur;
        auto factor = std::make_unique<Cholesky>(schur ? Cholesky::Kind::Definite : Cholesky::Kind::QuasiDefinite,
                                                 settings_.ordering, settings_.method);
        factor->analyze(schur ? schur_complement() : quasi_definite());
        return factor;
    };
    if (form_ == Form::Automatic) {
        const bool plainly_sparse = squared_counts_ <= 30.0 * (static_cast<double>(system_.D.nonZeros()) + m);
        std::unique_ptr<Cholesky> schur, quasi;
        if (!keep_Z_ || !plainly_sparse) quasi = make(Form::QuasiDefinite);
        if (keep_Z_ && (plainly_sparse || schur_entries <= std::max(kSmallFactor, 10.0 * quasi->entries())))
            schur = make(Form::Schur);
        const auto is_dear = [&] { return squared_counts_ + schur->flops() > kDearFactor * quasi->flops(); };
        const bool take_schur =
            schur && (!quasi ||
                      (!is_dear() && (schur->entries() <= kSmallFactor || schur->entries() <= 3.0 * quasi->entries())));
        form_ = take_schur ? Form::Schur : Form::QuasiDefinite;
        saddle_ = std::move(take_schur ? schur : quasi);
    } else {
        saddle_ = make(form_);
    }
    if (form_ == Form::QuasiDefinite) Z_.resize(0, 0);
}

SparseColumns ShiftedFactor::schur_complement() const {
    SparseColumns identity(system_.D.rows(), system_.D.rows());
    identity.setIdentity();
    SparseColumns N = 0.0 * identity;  // the whole diagonal belongs to the pattern
    if (Z_.rows() > 0) N += SparseColumns(Z_.transpose() * Z_);
    if (system_.E.nonZeros() > 0) N += system_.E;
    N.makeCompressed();
    return N;
}

SparseColumns ShiftedFactor::quasi_definite() const {
    const Eigen::Index n = system_.D.cols(), m = system_.D.rows();
    std::vector<Eigen::Triplet<double, std::int32_t>> lower;
    lower.reserve(static_cast<std::size_t>(system_.H.nonZeros() + system_.D.nonZeros() + system_.E.nonZeros() + n + m));
    const auto add = [&](Eigen::Index i, Eigen::Index j, double value) {
        if (i >= j) lower.emplace_back(static_cast<std::int32_t>(i), static_cast<std::int32_t>(j), value);
    };
    for (Eigen::Index j = 0; j < n; ++j) {
        add(j, j, primal_shift_);
        for (SparseColumns::InnerIterator entry(system_.H, j); entry; ++entry) add(entry.row(), j, entry.value());
    }
    for (Eigen::Index i = 0; i < m; ++i) {
        for (SparseRows::InnerIterator entry(system_.D, i); entry; ++entry) add(n + i, entry.col(), entry.value());
        add(n + i, n + i, -dual_shift_);
        for (SparseColumns::InnerIterator entry(system_.E, i); entry; ++entry)
            add(n + entry.row(), n + i, -entry.value());
    }
    SparseColumns K(n + m, n + m);
    K.setFromTriplets(lower.begin(), lower.end());
    return K;
}

void ShiftedFactor::factorize_saddle_point() {
    const bool schur = form_ == Form::Schur;
    const SparseColumns N = schur ? schur_complement() : SparseColumns();
    if (dual_shift_ == 0.0) dual_shift_ = schur ? kSchurShift : kQuasiDefiniteShift;
    while (true) {
        ++factorizations_;
        primal_shift_ = definite_ ? 0.0 : dual_shift_;
        if (schur ? saddle_->factorize(N, dual_shift_) : saddle_->factorize(quasi_definite())) return;
        // Rounding has made a pivot vanish or turn: take a larger shift, and keep it for later values.
        dual_shift_ *= 10.0;
        if (!(dual_shift_ <= kLargestShift))
            throw NumericalFailure(
                "the factorisation broke down for every shift up to 1e-4: E is not positive "
                "semidefinite, or H is not");
    }
}

Pair ShiftedFactor::solve(const Pair& right) const {
    Pair result;
    if (form_ == Form::Schur) {
        // (N + δ1) λ̃ = g − D̃ H̃⁻¹ f, then x̃ = H̃⁻¹ (f + D̃ᵀ λ̃).
        Vector moved = right.x;
        if (mass_) mass_->solve(moved);
        result.lambda = right.lambda;
        result.lambda.noalias() -= system_.D * moved;
        saddle_->solve(result.lambda);
        result.x = right.x;
        result.x.noalias() += system_.D.transpose() * result.lambda;
        if (mass_) mass_->solve(result.x);
        return result;
    }
    // [H̃ + ρ1, D̃ᵀ; D̃, −(Ẽ + δ1)] {x̃; −λ̃} = {f; g}.
    const Eigen::Index n = right.x.size(), m = right.lambda.size();
    Vector stacked(n + m);
    stacked << right.x, right.lambda;
    saddle_->solve(stacked);
    result.x = stacked.head(n);
    result.lambda = -stacked.tail(m);
    return result;
}

Vector ShiftedFactor::free_velocity(const ProblemView& problem) const {
    Vector r = problem.b;
    if (problem.n == 0) return r;
    Vector x = problem.a;
    if (mass_) {
        x.array() *= system_.R.array();
        mass_->solve(x);
        x.array() *= system_.R.array();
    } else {
        x.array() *= stand_in_.array();
    }
    r.noalias() += problem.D * x;
    return r;
}

std::string ShiftedFactor::description() const {
    // The ratio of the extreme pivots bounds the condition of a definite matrix from below, of an indefinite one not.
    const bool schur = form_ == Form::Schur;
    const double reciprocal = saddle_->reciprocal_condition();
    char text[160];
    std::snprintf(text, sizeof text, "%s, %s, shift %.0e, %s %.0e", schur ? "Schur complement" : "quasi-definite form",
                  saddle_->supernodal() ? "supernodal" : "simplicial", dual_shift_,
                  schur ? "condition number with the shift at least" : "ratio of pivots",
                  reciprocal > 0.0 ? 1.0 / reciprocal : std::numeric_limits<double>::infinity());
    return text;
}

}  // namespace delassus_cholmod
