// SPDX-License-Identifier: BSD-3-Clause
// The factorisation that every solve rests on: the scaled saddle-point system with a proximal shift.
#pragma once

#include <memory>
#include <string>

#include "saddle_point.hpp"

namespace delassus_cholmod {

enum class Form { Automatic, Schur, QuasiDefinite };

struct FactorSettings {
    Ordering ordering = Ordering::Automatic;
    Method method = Method::Automatic;
    Form form = Form::Automatic;
    double shift = 0.0;  ///< in scaled units; 0 = the form's own
};

/// Solves, in the scaled variables of ScaledSystem,
///
///     [ H̃ + ρ1   −D̃ᵀ     ] {x̃}   {f}
///     [ D̃        Ẽ + δ1  ] {λ̃} = {g}.
///
/// One step of the method of multipliers (Rockafellar 1976) solves this with f = a + ρ x_k, g = −b + δ λ_k: the
/// proximal terms ρ/2‖x − x_k‖² and δ/2‖λ − λ_k‖² make repeated rows and a semidefinite H solvable, and vanish at the
/// fixed point. Written for the corrections x − x_k, λ − λ_k that is iterative refinement with this matrix.
///
/// Two forms, equal in exact arithmetic:
/// - Schur: H̃ = L Lᵀ, Z = L⁻¹ P D̃ᵀ, then N + δ1 = Zᵀ Z + Ẽ + δ1 by Cholesky; ρ = 0, H definite. Sparse where each
///   row of D couples few others through H.
/// - quasi-definite: L Δ Lᵀ of [H̃ + ρ1, D̃ᵀ; D̃, −(Ẽ + δ1)], which exists for every symmetric order of the rows
///   (Vanderbei 1995). Sparse where H⁻¹ is not, and for a semidefinite H.
class ShiftedFactor {
public:
    explicit ShiftedFactor(const FactorSettings& settings) : settings_(settings) {}

    /// Announces a new pattern. The next factorize() repeats the analysis: it has the values that the choice of the
    /// form needs.
    void analyze() { pattern_is_new_ = true; }

    /// Throws delassus::sdk::NumericalFailure.
    void factorize(const delassus::sdk::ProblemView& problem);

    /// Solves the above. right: (f, g).
    [[nodiscard]] Pair solve(const Pair& right) const;

    [[nodiscard]] const ScaledSystem& system() const { return system_; }
    [[nodiscard]] double primal_shift() const { return primal_shift_; }  ///< ρ
    [[nodiscard]] double dual_shift() const { return dual_shift_; }      ///< δ
    [[nodiscard]] bool definite() const { return definite_; }

    /// The diagonal of N in the problem's units, for the natural error; m. Where H is not definite, |diag H|⁻¹ stands
    /// in for H⁻¹, with the mean of the others for a zero entry, as in the core's own measure.
    [[nodiscard]] const Vector& diagonal() const { return diagonal_; }
    /// r = D H⁻¹ a + b, with the same stand-in; m.
    [[nodiscard]] Vector free_velocity(const delassus::sdk::ProblemView& problem) const;

    [[nodiscard]] std::int64_t analyses() const { return analyses_; }
    [[nodiscard]] std::int64_t factorizations() const { return factorizations_; }
    /// Form, method and condition, for a message.
    [[nodiscard]] std::string description() const;

private:
    void scale_mass(const delassus::sdk::ProblemView& problem);
    void factorize_mass(const delassus::sdk::ProblemView& problem);
    void scale_constraints(const delassus::sdk::ProblemView& problem);
    void choose_form();
    [[nodiscard]] SparseColumns schur_complement() const;
    [[nodiscard]] SparseColumns quasi_definite() const;
    void factorize_saddle_point();

    FactorSettings settings_;
    bool pattern_is_new_ = true;
    bool definite_ = true;
    Form form_ = Form::Automatic;  // the form in use; automatic until it is chosen
    bool keep_Z_ = true;
    double squared_counts_ = 0.0;  // Σ (entries in a row of Z)²: a bound of the products in Zᵀ Z
    double primal_shift_ = 0.0, dual_shift_ = 0.0;
    ScaledSystem system_;
    SparseColumns Z_;
    Vector diagonal_, stand_in_;
    std::unique_ptr<Cholesky> mass_, saddle_;
    std::int64_t analyses_ = 0, factorizations_ = 0;
};

}  // namespace delassus_cholmod
