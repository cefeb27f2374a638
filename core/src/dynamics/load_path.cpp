// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/load_path.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/bordered_factor.hpp"
#include "dynamics/negative_eigenvalues.hpp"
#include "support/pivoted_qr.hpp"

namespace delassus {

// ---- The path ----
//
// The forces are f(q; μ) = f₀(q) + μ p(q). Equilibria
//
//     r = f(q; μ) + C_qᵀ λ = 0,      C(q) = 0
//
// are curves in the space of (q, λ, μ). With K = −∂f/∂q − ∂(C_qᵀ λ)/∂q along increments, a tangent (t, t_λ, t_μ) obeys
//
//     K t − C_qᵀ t_λ = p t_μ,   C_q t = 0
//
// At a limit point the matrix of (t, t_λ) is singular, t_μ = 0, and the equilibrium is no function of μ; it still is
// one of the arc length s (Riks, J. Appl. Mech. 39, 1972; Wempner, Int. J. Solids Struct. 7, 1971).
//
// ---- The metric ----
//
// A length of the curve needs one number for translations, turns and the load. That of an increment is that of the
// kinetic energy, ‖δ‖²_M = δᵀ M δ (kg m²): the only inner product that the system itself has, and no choice of units
// or of coordinates changes it. It is measured by D = ‖t⁰‖_M, t⁰ being the linear answer to the whole loads at the
// start, K t⁰ − C_qᵀ λ⁰ = p:
//
//     ds² = ‖dq‖²_M/D² + dμ²
//
// Lengths are pure numbers: at the start both parts are equal, and s = √2 where a linear system would have its whole
// loads. (D is at least a motion of all coordinates by 1e-3 of the largest position: what moves less is no way.)
//
// ---- A step ----
//
// From (q₀, λ₀, μ₀), with the unit tangent there, along ℓ to the plane that is normal to the tangent (Wempner's and
// Riks' condition: linear, so it has one solution, where Crisfield's sphere has two):
//
//     ⟨t, Δ⟩_M/D² + t_μ (μ − μ₀) = ℓ,      q = q₀ ∘ exp(Δ)
//
// Newton's unknowns are (x, δλ, δμ), q ← q ∘ exp(x), Δ ← Δ + T⁻¹(Δ) x (dynamics/newton.cpp):
//
//     K x − C_qᵀ δλ − p δμ                 = r
//     C_q x                                = −C
//     (M t)ᵀ T⁻¹ x/D² + t_μ δμ             = ℓ − ⟨t, Δ⟩_M/D² − t_μ (μ − μ₀)
//
// It begins at Δ = ℓ t, μ = μ₀ + ℓ t_μ. An increment is halved as long as the residual would not fall; if no part of it
// lets it fall, the whole of it is taken, as Newton's method without a search would. Norms and the test of convergence
// are those of dynamics/newton.cpp, rows scaled by 1/√K_ii.
//
// The start is found likewise, at its own μ: with t = 0, t_μ = 1 and ℓ = 0.
//
// The new tangent is the solution for the right-hand side (0, 0, 1): then ⟨t_old, t_new⟩ > 0, and the path does not
// turn back. The matrix is regular at limit points (Keller, 1977) and singular at bifurcations alone.
//
// K has σ M added, σ = 1e-12 of the largest K_ii/M_ii at the start: what nothing holds and no load turns (a link that
// spins about its own axis) stays where it is. r has nothing of it, so the solution is the same.

struct LoadPath::Implementation {
    Implementation(DynamicalSystem& of, std::function<void(double)> setter, LoadPathSettings chosen)
        : system(of), set_load(std::move(setter)), settings(chosen) {}

    DynamicalSystem& system;
    std::function<void(double)> set_load;
    LoadPathSettings settings;
    const std::int32_t n = system.n(), m = system.m();
    double unit = 1.0;   // D
    double shift = 0.0;  // σ
    MatrixAssembler M_assembler, K_assembler, D_assembler;
    SparseMatrix mass, stiffness, jacobian;
    BorderedFactor factor;
    std::vector<DiagonalBlock3> blocks;
    Vector root, row_scale;  // √K_ii, and 1/√(D K_ii⁻¹ Dᵀ)_jj

    struct Trial {
        State state;
        Vector delta, lambda;
        double load = 0.0;
        Vector force, reaction, balance, constraint;
    };

    void evaluate(const State& begin, Trial& at) {
        system.increment(begin.q.data(), at.delta.data(), at.state.q.data());
        set_load(at.load);
        at.force.setZero(n);
        at.reaction.setZero(n);
        at.constraint.setZero(m);
        system.add_force(at.state, 1.0, at.force.data());
        if (m > 0) {
            D_assembler.begin(m, n);
            system.add_constraint_jacobian(at.state, 0, D_assembler);
            D_assembler.finish().transpose_multiply_add(1.0, at.lambda.data(), at.reaction.data());
            system.constraint(at.state, at.constraint.data());
        }
        at.balance = at.force + at.reaction;
    }

    /// p = ∂f/∂μ; leaves μ = load.
    Vector load_of(const State& state, double load) {
        Vector p = Vector::Zero(n);
        set_load(1.0);
        system.add_force(state, 1.0, p.data());
        set_load(0.0);
        system.add_force(state, -1.0, p.data());
        set_load(load);
        return p;
    }

    /// M, K and C_q there, and the scales of their rows. False if a number in them is not finite.
    bool assemble(const State& state, const Vector& lambda, double load) {
        set_load(load);
        M_assembler.begin(n, n);
        system.add_mass(state, 1.0, M_assembler);
        M_assembler.finish_into(mass);
        K_assembler.begin(n, n);
        if (system.has_stiffness()) system.add_stiffness(state, 1.0, Tangent::Exact, K_assembler);
        if (m > 0) system.add_constraint_stiffness(state, lambda.data(), -1.0, Tangent::Exact, K_assembler);
        K_assembler.finish_into(stiffness);
        D_assembler.begin(m, n);
        if (m > 0) system.add_constraint_jacobian(state, 0, D_assembler);
        D_assembler.finish_into(jacobian);
        const auto finite = [](const SparseMatrix& A) {
            return std::all_of(A.value.begin(), A.value.end(), [](double value) { return std::isfinite(value); });
        };
        if (!finite(stiffness) || !finite(jacobian)) return false;
        const Vector masses = diagonal_of(mass), stiffnesses = diagonal_of(stiffness);
        if (shift == 0.0) {
            constexpr double share = 1e-12;
            for (std::int32_t i = 0; i < n; ++i) shift = std::max(shift, share * std::abs(stiffnesses[i]) / masses[i]);
            if (shift == 0.0) shift = share;
        }
        scale(masses, stiffnesses);
        return true;
    }

    static Vector diagonal_of(const SparseMatrix& A) {
        Vector diagonal = Vector::Zero(A.rows);
        for (std::int32_t row = 0; row < A.rows; ++row)
            for (auto e = A.row_start[static_cast<std::size_t>(row)];
                 e < A.row_start[static_cast<std::size_t>(row) + 1]; ++e)
                if (A.column[static_cast<std::size_t>(e)] == row) diagonal[row] = A.value[static_cast<std::size_t>(e)];
        return diagonal;
    }

    void scale(const Vector& masses, const Vector& stiffnesses) {
        // Rows that no stiffness holds, by 1e-6 of the largest.
        constexpr double soft = 1e6;
        root.resize(n);
        for (std::int32_t i = 0; i < n; ++i) {
            double largest = 0.0;
            for (auto e = stiffness.row_start[static_cast<std::size_t>(i)];
                 e < stiffness.row_start[static_cast<std::size_t>(i) + 1]; ++e)
                largest = std::max(largest, std::abs(stiffness.value[static_cast<std::size_t>(e)]));
            const double diagonal = std::abs(stiffnesses[i]);
            root[i] = std::sqrt(std::max(diagonal > 1e-8 * largest ? diagonal : largest, soft * shift * masses[i]));
        }
        row_scale.setOnes(m);
        for (std::int32_t j = 0; j < m; ++j) {
            double sum = 0.0;
            for (auto e = jacobian.row_start[static_cast<std::size_t>(j)];
                 e < jacobian.row_start[static_cast<std::size_t>(j) + 1]; ++e) {
                const double value =
                    jacobian.value[static_cast<std::size_t>(e)] / root[jacobian.column[static_cast<std::size_t>(e)]];
                sum += value * value;
            }
            if (sum > 0.0) row_scale[j] = 1.0 / std::sqrt(sum);
        }
    }

    [[nodiscard]] double merit(const Trial& at) const {
        const double value =
            std::hypot(at.balance.cwiseQuotient(root).norm(), at.constraint.cwiseProduct(row_scale).norm());
        return std::isfinite(value) ? value : std::numeric_limits<double>::infinity();
    }

    /// M t; of the masses where the matrices were assembled last.
    [[nodiscard]] Vector weighed(const Vector& t) const {
        Vector Mt = Vector::Zero(n);
        mass.multiply_add(1.0, t.data(), Mt.data());
        return Mt;
    }

    /// T⁻¹ᵀ w.
    Vector pulled_back(const Vector& delta, const Vector& w) {
        system.inverse_tangent(delta.data(), blocks);
        Vector result = w;
        for (const auto& block : blocks)
            result.segment<3>(block.first) =
                Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(block.value).transpose() *
                w.segment<3>(block.first);
        return result;
    }

    /// The tangent where the matrices are, of length one and with a positive product with the row; false if there is
    /// none.
    bool find_tangent(const Vector& row, double row_load, LoadPathPoint& point) {
        if (!factor.factorise(stiffness, mass, shift, jacobian, root, row_scale, load_of(point.state, point.load), row,
                              row_load))
            return false;
        const auto solution = factor.solve(Vector::Zero(n), Vector::Zero(m), 1.0);
        point.direction = solution.x;
        point.lambda_rate = solution.lambda;
        point.load_rate = solution.load;
        const double length =
            std::hypot(std::sqrt(std::max(0.0, solution.x.dot(weighed(solution.x)))) / unit, solution.load);
        if (!std::isfinite(length) || !(length > 0.0)) return false;
        point.direction /= length;
        point.lambda_rate /= length;
        point.load_rate /= length;
        return true;
    }

    void judge(LoadPathPoint& point, const Trial& at) {
        point.residual = largest_entry(at.balance);
        point.reaction = largest_entry(at.reaction);
        point.negative = negative_eigenvalues(stiffness, mass, shift, jacobian);
    }
};

LoadPath::LoadPath(DynamicalSystem& system, std::function<void(double)> set_load, LoadPathSettings settings)
    : implementation_(std::make_unique<Implementation>(system, std::move(set_load), settings)) {}
LoadPath::~LoadPath() = default;

bool LoadPath::begin(LoadPathPoint& start) {
    auto& self = *implementation_;
    self.shift = 0.0;
    self.unit = 1.0;
    LoadPathPoint given = start;
    given.direction.setZero(self.n);
    given.lambda_rate.setZero(self.m);
    given.load_rate = 1.0;
    if (!find(given, 0.0, start)) return false;
    if (!(start.load_rate > 0.0)) return false;
    const Vector answer = start.direction / start.load_rate;
    const Vector M_answer = self.weighed(answer);
    const double square = answer.dot(M_answer);
    Vector K_answer = Vector::Zero(self.n);
    self.stiffness.multiply_add(1.0, answer.data(), K_answer.data());
    double largest = 0.0;
    for (const double value : start.state.q) largest = std::max(largest, std::abs(value));
    const Vector ones = Vector::Ones(self.n);
    const double size = largest * std::sqrt(ones.dot(self.weighed(ones)));
    // Far away, and σ alone holds it.
    constexpr double held = 10.0, far = 1e3, least = 1e-3;
    if (std::sqrt(square) > far * size && std::abs(answer.dot(K_answer)) < held * self.shift * square) return false;
    self.unit = std::max(std::sqrt(square), least * size);
    if (!(self.unit > 0.0)) self.unit = 1.0;
    const double length = std::hypot(std::sqrt(square) / self.unit, 1.0);
    start.direction = answer / length;
    start.lambda_rate /= start.load_rate * length;
    start.load_rate = 1.0 / length;
    start.step = 0.0;
    start.turn = 0.0;
    return true;
}

bool LoadPath::find(const LoadPathPoint& from, double length, LoadPathPoint& to) {
    auto& self = *implementation_;
    constexpr double shortest_part = 1.0 / 16.0, farthest = 1.05;
    const double unit2 = self.unit * self.unit;
    Vector weight = Vector::Zero(self.n);  // M t/D²
    self.system.multiply_mass(from.state, 1.0 / unit2, from.direction.data(), weight.data());
    Implementation::Trial now, trial;
    now.state = trial.state = from.state;
    now.delta = length * from.direction;
    now.lambda = from.lambda + length * from.lambda_rate;
    now.load = from.load + length * from.load_rate;
    self.evaluate(from.state, now);
    bool converged = false;
    to.newton_iterations = 0;
    while (!converged && to.newton_iterations < self.settings.most_iterations) {
        if (!self.assemble(now.state, now.lambda, now.load)) return false;
        const double rho = self.merit(now);
        if (!std::isfinite(rho)) return false;
        const Vector p = self.load_of(now.state, now.load);
        if (!self.factor.factorise(self.stiffness, self.mass, self.shift, self.jacobian, self.root, self.row_scale, p,
                                   self.pulled_back(now.delta, weight), from.load_rate))
            return false;
        const double ahead = length - weight.dot(now.delta) - from.load_rate * (now.load - from.load);
        const auto increment = self.factor.solve(now.balance, -now.constraint, ahead);
        if (!increment.x.allFinite() || !increment.lambda.allFinite() || !std::isfinite(increment.load)) return false;
        ++to.newton_iterations;
        self.system.inverse_tangent(now.delta.data(), self.blocks);
        Vector direction;
        multiply_blocks(self.blocks, increment.x, direction);
        double part = 1.0, trial_rho = 0.0;
        const auto move = [&](double wanted) {
            part = wanted;
            trial.delta = now.delta + part * direction;
            trial.lambda = now.lambda + part * increment.lambda;
            trial.load = now.load + part * increment.load;
            self.evaluate(from.state, trial);
            trial_rho = self.merit(trial);
        };
        move(1.0);
        const auto size = [&](const Vector& motion) { return motion.cwiseProduct(self.root).norm(); };
        const auto force_size = [&](const Vector& force) { return force.cwiseQuotient(self.root).norm(); };
        const double load_size = force_size(p);
        const double sigma =
            std::max({size(trial.delta), std::abs(trial.load) * load_size, force_size(trial.reaction)});
        double largest = 0.0;
        for (const double value : trial.state.q) largest = std::max(largest, std::abs(value));
        const double threshold = self.settings.tolerance * sigma +
                                 10.0 * std::numeric_limits<double>::epsilon() * largest * self.root.norm();
        const auto falls = [&] { return trial_rho <= threshold || trial_rho <= (1.0 - 1e-4 * part) * rho; };
        while (!falls() && part > shortest_part) move(0.5 * part);
        if (!falls()) move(1.0);
        if (!std::isfinite(trial_rho)) return false;
        const double theta = rho > 0.0 ? trial_rho / rho : 0.0;
        const double moved = std::hypot(size(increment.x), increment.load * load_size);
        converged = trial_rho <= threshold && (theta < 0.5 ? theta / (1.0 - theta) : 1.0) * part * moved <= threshold;
        std::swap(now, trial);
    }
    if (!converged) return false;
    to.state = now.state;
    to.lambda = now.lambda;
    to.load = now.load;
    if (!self.assemble(to.state, to.lambda, to.load)) return false;
    Vector M_delta = Vector::Zero(self.n);
    self.system.multiply_mass(from.state, 1.0 / unit2, now.delta.data(), M_delta.data());
    to.step = std::hypot(std::sqrt(std::max(0.0, now.delta.dot(M_delta))), to.load - from.load);
    if (length != 0.0 && to.step > farthest * std::abs(length)) return false;
    if (!self.find_tangent(self.pulled_back(now.delta, weight), from.load_rate, to)) return false;
    const double cosine = self.pulled_back(now.delta, weight).dot(to.direction) + from.load_rate * to.load_rate;
    to.turn = std::acos(std::clamp(cosine, -1.0, 1.0));
    self.judge(to, now);
    return true;
}

// Inverse iteration with K + σ M on the null space of C_q.
Vector LoadPath::critical_motion() const {
    const auto& self = *implementation_;
    constexpr int iterations = 12;
    Vector motion(self.n);
    for (std::int32_t i = 0; i < self.n; ++i) motion[i] = (1.0 + 0.5 * std::sin(1.0 + 2.0 * i)) / self.root[i];
    for (int i = 0; i < iterations; ++i) {
        motion = self.factor.solve_inside(self.weighed(motion), Vector::Zero(self.m));
        const double size = std::sqrt(std::max(0.0, motion.dot(self.weighed(motion))));
        if (!std::isfinite(size) || !(size > 0.0)) return Vector::Zero(self.n);
        motion /= size;
    }
    return motion;
}

double LoadPath::square_of(const Vector& motion) const {
    const auto& self = *implementation_;
    Vector K_motion = Vector::Zero(self.n);
    self.stiffness.multiply_add(1.0, motion.data(), K_motion.data());
    return motion.dot(K_motion) / motion.dot(self.weighed(motion));
}

}  // namespace delassus
