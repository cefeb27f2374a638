// SPDX-License-Identifier: BSD-3-Clause
// The equations of the interior point method in one process: the scaled system and the linear system of a step.
#pragma once

#include "kkt_system.hpp"
#include "refinement.hpp"

namespace delassus::ipm {

class Equations : public Scaling {
public:
    using View = sdk::ProblemView;
    using Cones = Complementarity;
    using Linear = KktSystem;
    using Start = Refinement<KktSystem>::Start;

    // Relative residuals of linear solves. The predictor is only a forecast. Errors that the corrector leaves show in
    // the residuals of the next iteration.
    static constexpr double predictor_residual = 1e-3, tightest_residual = 1e-9, start_residual = tightest_residual;
    /// τ: the mean product; degree: their number; equations: what is left of the equations.
    [[nodiscard]] static double corrector_residual(double, double, double) { return tightest_residual; }
    /// The largest number of Gondzio's correctors.
    [[nodiscard]] static std::int64_t correctors() { return 0; }

    explicit Equations(const KktSettings& settings) : kkt_(settings) {}

    void analyze(const sdk::ProblemView& problem) {
        Scaling::analyze(problem);
        kkt_.analyze(problem);
    }
    using Scaling::factorize;
    /// a, b, μ or the bounds are new. problem must last as long as the solve.
    void load(const sdk::ProblemView& problem, Complementarity& cones) {
        problem_ = &problem;
        Scaling::load(problem);
        cones.load(problem, z_scale());
        kkt_.load(system(), definite());
    }

    [[nodiscard]] const sdk::Vector& a() const { return system().a; }              ///< â; n
    [[nodiscard]] const sdk::Vector& b() const { return system().b; }              ///< b̂; m
    [[nodiscard]] const sdk::Vector& x_scale() const { return system().x_scale; }  ///< x = x_scale ∘ x̂
    [[nodiscard]] const sdk::Vector& z_scale() const { return system().z_scale; }  ///< λ = z_scale ∘ ẑ
    [[nodiscard]] double rows() const { return static_cast<double>(b().size()); }  ///< of all processes

    /// The error by which the host judges λ (m). Where H is definite x ← H⁻¹(a + Dᵀλ), otherwise x (n) is read.
    [[nodiscard]] double measure(sdk::Vector& x, const sdk::Vector& lambda) const {
        return Scaling::measure(*problem_, x, lambda);
    }
    /// What is left of the equations: f ← â − Ĥ x̂ + D̂ᵀ ẑ, g ← û − b̂ − D̂ x̂ − Ê ẑ.
    void find_residuals(const sdk::Vector& x, const Complementarity& cones, sdk::Vector& f, sdk::Vector& g) const {
        f = a();
        g = cones.u() - b();
        if (f.size() > 0) {
            f.noalias() -= system().H * x;
            f.noalias() += system().D.transpose() * cones.z();
            g.noalias() -= system().D * x;
        }
        if (system().E.nonZeros() > 0) g.noalias() -= system().E * cones.z();
    }
    [[nodiscard]] sdk::Vector times_H(const sdk::Vector& x) const { return system().H * x; }
    [[nodiscard]] sdk::Vector times_D(const sdk::Vector& x) const { return system().D * x; }
    [[nodiscard]] sdk::Vector times_transposed_D(const sdk::Vector& z) const { return system().D.transpose() * z; }
    [[nodiscard]] sdk::Vector times_E(const sdk::Vector& z) const { return system().E * z; }
    [[nodiscard]] static double dot(const sdk::Vector& a, const sdk::Vector& b) { return a.dot(b); }
    [[nodiscard]] static double norm(const sdk::Vector& v) { return v.norm(); }
    [[nodiscard]] static double norm(const sdk::Vector& f, const sdk::Vector& g) {
        return std::hypot(f.norm(), g.norm());
    }

    /// The linear system of a step (kkt_system.hpp), and its solution to a relative residual of `enough`.
    void factorize(const Complementarity& cones, const sdk::Vector& theta) { kkt_.factorize(cones, theta); }
    void solve(const Complementarity& cones, const sdk::Vector& f, const sdk::Vector& g, double enough, Start,
               sdk::Vector& dx, sdk::Vector& dz) {
        refinement_.solve(kkt_, cones, f, g, enough, Start::Zero, dx, dz);
    }

    // What a problem in parts has to do more for.
    [[nodiscard]] static bool everywhere(bool holds) { return holds; }  ///< in all processes
    static void next_iteration() {}                                     ///< of a solve, for its cost
    static void end_iterations() {}
    /// Until the result's life ends, the time is that of work on the cones.
    [[nodiscard]] static int on_cones() { return 0; }

    [[nodiscard]] std::string description() const { return kkt_.description(); }
    [[nodiscard]] std::int64_t analyses() const { return kkt_.analyses(); }
    [[nodiscard]] std::int64_t factorizations() const { return Scaling::factorizations() + kkt_.factorizations(); }

private:
    const sdk::ProblemView* problem_ = nullptr;
    KktSystem kkt_;
    Refinement<KktSystem> refinement_;
};

}  // namespace delassus::ipm
