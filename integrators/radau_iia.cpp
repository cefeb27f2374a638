// SPDX-License-Identifier: BSD-3-Clause
// Radau IIA with three stages, of order 5, for stiff systems and constraints (Hairer and Wanner, Solving Ordinary
// Differential Equations II, sec. IV.8 and VII.6).
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "dynamics/error_limit.hpp"
#include "dynamics/linear_problem.hpp"
#include "dynamics/newton.hpp"
#include "dynamics/return_to_constraints.hpp"
#include "dynamics/way_of_step.hpp"

namespace delassus {
namespace {

// ---- The method ----
//
// In a step the position is q_n ∘ exp(Δ(t)), and with constraints on the level of velocities
//
//     Δ˙ = T⁻¹(Δ) v =: w,     M v̇ = f + C_qᵀ λ,     C_q v + C_t = 0                                              (1)
//
// (dynamics/explicit_method.hpp says why Δ lives in a vector space). This is of index 2, where the method keeps its
// order: 5 in q and v, 3 in λ. On the level of positions (index 3) the velocities would have order 3 only. The stages
// (Δ_i, V_i, λ_i) at t + c_i h are, with B = A⁻¹,
//
//     ρ_i = Σ_j b_ij Δ_j − h w_i = 0,     p_i = M_i Σ_j b_ij (V_j − v_n) − h (f_i + C_qᵀ λ_i) = 0,
//     g_i = C_q V_i + C_t = 0                                                                                     (2)
//
// and the third stage is the end of the step. What (1) lets drift, C itself, is returned to 0 at the end of each step.
//
// Why this method: measured against steps of BDF by SUNDIALS' IDA, see docs/measurements.md.

struct Coefficients {
    Eigen::Vector3d c, error;
    Eigen::Matrix3d A, B, L, L_inverse, U;

    Coefficients() {
        const double root = std::sqrt(6.0);
        c << (4.0 - root) / 10.0, (4.0 + root) / 10.0, 1.0;
        A << (88.0 - 7.0 * root) / 360.0, (296.0 - 169.0 * root) / 1800.0, (-2.0 + 3.0 * root) / 225.0,
            (296.0 + 169.0 * root) / 1800.0, (88.0 + 7.0 * root) / 360.0, (-2.0 - 3.0 * root) / 225.0,
            (16.0 - root) / 36.0, (16.0 + root) / 36.0, 1.0 / 9.0;
        B = A.inverse();
        L.setZero();
        U.setIdentity();
        for (int j = 0; j < 3; ++j) {
            for (int i = j; i < 3; ++i) L(i, j) = A(i, j) - L.row(i).head(j).dot(U.col(j).head(j));
            for (int i = j + 1; i < 3; ++i) U(j, i) = (A(j, i) - L.row(j).head(j).dot(U.col(i).head(j))) / L(j, j);
        }
        L_inverse = L.inverse();
        error << -13.0 - 7.0 * root, -13.0 + 7.0 * root, -1.0;
        error *= L(2, 2) / 3.0;
    }
};

const Coefficients& radau() {
    static const Coefficients table;
    return table;
}

// ---- The iteration ----
//
// Newton's method couples the stages by A: (I − h A ⊗ J) δ = −residual. With Crout's A = L U, U with a unit diagonal,
// and L in place of A in the matrix, the stages follow one another, each with a matrix of its own (van der Houwen and
// de Swart, SIAM J. Sci. Comput. 18, 1997). They are real, symmetric where K is, and of the form that every implicit
// method here hands to the solvers, so that every one of them serves. Multiplied by L⁻¹, where L⁻¹ A = U,
//
//     c_i = −Σ_{j≥i} u_ij ρ_j − Σ_{j<i} (L⁻¹)_ij δΔ_j,     d_i = −Σ_{j≥i} u_ij p_j − M Σ_{j<i} (L⁻¹)_ij δV_j
//     (M + τ R + τ² K) δV_i − τ C_qᵀ δλ_i = l_ii (d_i − τ K c_i),   C_q δV_i = −g_i,   τ = h l_ii               (3)
//     δΔ_i = l_ii (h δV_i + c_i)
//
// For y˙ = λ y each iteration multiplies the error by z (1 − z L)⁻¹ (A − L), z = h λ: its spectral radius is at most
// 0.37 on the imaginary axis and 0.15 on the negative one, falls like |z| for small steps, and is 0 at infinity
// (computed). Matrices are those of the guess; T and how C_q turns with Δ are left out of them, which adds h ω of the
// turning to the factor.

constexpr double epsilon = std::numeric_limits<double>::epsilon();
/// rad; T⁻¹ is singular at 2π.
constexpr double largest_turn = 2.0;
constexpr std::array<const char*, 3> stage_names = {"stage 1", "stage 2", "stage 3"};

/// A stage's guess, and (2) there.
struct StageValues {
    StepPoint point;
    std::vector<DiagonalBlock3> blocks;  // of T⁻¹(Δ)
    Vector velocity_change;              // Σ_j b_ij (V_j − v_n)
    Vector slope, force, reaction;       // w, f, C_qᵀ λ
    Vector rho, momentum;                // ρ, p
    std::vector<double> constraint;      // g
};

// A solver takes the arrays of a problem and leaves those of the one before in it (StepSolver::solve()). So of two
// problems with the same matrices the first is given away and the second goes to and fro: it comes back with what went
// before, which has the same values. Matrices are copied once where they are assembled, not in each of the ten to
// fifteen solves that they serve.
struct StageMatrices {
    SparseMatrix M, K;      // of the guess
    Problem first, others;  // H = M + τ R + τ² K, D = C_q
    bool given = false;     // `first` has been
};

struct Stage : StageValues, StageMatrices {
    Vector delta_delta, delta_v;  // δΔ, δV
};

Eigen::Map<const Vector> as_vector(const std::vector<double>& values) {
    return {values.data(), static_cast<Eigen::Index>(values.size())};
}
Eigen::Map<Vector> as_vector(std::vector<double>& values) {
    return {values.data(), static_cast<Eigen::Index>(values.size())};
}

Vector product(const SparseMatrix& A, const Vector& x) {
    Vector result = Vector::Zero(A.rows);
    A.multiply_add(1.0, x.data(), result.data());
    return result;
}

class RadauIIA : public Timestepper {
public:
    struct Settings {
        Tangent tangent = Tangent::Symmetric;
        double newton_tolerance = 1e-9;
        int most_iterations = 40;
        double error_limit = std::numeric_limits<double>::infinity();
    };

    RadauIIA(DynamicalSystem& system, const Settings& settings)
        : system_(system),
          settings_(settings),
          accelerations_(system),
          n_(system.n()),
          m_(system.m()),
          cones_(free_cones(system)) {}

    void restart() override {
        known_ = false;
        multipliers_.clear();
    }
    [[nodiscard]] int order() const override { return 5; }
    [[nodiscard]] bool damps_at_once() const override { return true; }
    [[nodiscard]] bool has_embedded_error() const override { return true; }
    [[nodiscard]] int embedded_order() const override { return 3; }
    [[nodiscard]] EmbeddedError embedded_error() const override {
        return {{error_q_.data(), static_cast<std::size_t>(error_q_.size())},
                {error_v_.data(), static_cast<std::size_t>(error_v_.size())}};
    }
    [[nodiscard]] double error_limit() const override { return settings_.error_limit; }
    [[nodiscard]] bool has_extension() const override { return true; }
    void extend(ContinuousExtension& way) const override;
    // A ten-thousandth of what the estimate may be: see dynamics/adaptive_stepping.cpp.
    void choose_steps(double tolerance) override { least_correction_ = 1e-6 * std::pow(tolerance, 0.8); }
    [[nodiscard]] std::vector<double> save() const override;
    void load(const std::vector<double>& memory) override;

private:
    /// The largest change of a stage.
    struct Correction {
        double scaled = 0.0;   // in √mass · length
        double longest = 0.0;  // of an entry of Δ or h V, in its own unit
    };
    void take_step(State& state, double h, StepSolver& solver, StepReport& report) override;
    void begin(const State& state, StepSolver& solver, StepReport& report);
    void start_from(const State& state, double h, const Vector& acceleration);
    void extrapolate(const State& state, double h);
    [[nodiscard]] bool start(const State& state, double h);
    [[nodiscard]] bool evaluate(const State& state, double h);
    void assemble(double h);
    [[nodiscard]] bool iterate(const State& state, double h, StepSolver& solver, StepReport& report);
    [[nodiscard]] Correction correct(double h, StepSolver& solver, StepReport& report);
    [[nodiscard]] double threshold(const State& state, double h) const;
    void estimate(const State& state, double h, StepSolver& solver, StepReport& report);
    void finish(State& state, double h, StepSolver& solver, StepReport& report);
    LinearSolution solve(std::size_t stage, const Vector& a, const std::vector<double>& b, StepSolver& solver,
                         StepReport& report);
    [[nodiscard]] double residual_norm() const;

    /// What is known of the last step, whose end is the beginning of the next.
    struct Last {
        double h = 0.0;
        State end;
        Vector begin_v;                   // v_n
        std::array<Vector, 3> v, lambda;  // of the stages
        Vector acceleration;              // at the end
    };

    DynamicalSystem& system_;
    Settings settings_;
    Accelerations accelerations_;
    std::int32_t n_, m_;
    std::vector<Cone> cones_;
    bool known_ = false, stepped_ = false;
    Last last_;
    State begin_;  // of the last step, since stepped_
    Vector v_begin_, a_begin_, lambda_begin_;
    std::array<Stage, 3> stages_;
    std::array<StageValues, 3> other_guess_;
    Solution solution_;
    Vector root_;  // √H_ii of the third stage
    Vector error_q_, error_v_;
    double least_correction_ = 0.0;
    std::array<MatrixAssembler, 3> M_, K_, H_, D_;
    MatrixAssembler now_;
};

// ---- Guesses ----

/// The better of two guesses without a step before: the accelerations of the beginning stay, or, as h v̇ may be a long
/// way in a stiff system, the velocities. False if (2) has values at neither.
bool RadauIIA::start(const State& state, double h) {
    const auto swap = [&] {
        for (std::size_t i = 0; i < 3; ++i) std::swap(static_cast<StageValues&>(stages_[i]), other_guess_[i]);
    };
    constexpr double none = std::numeric_limits<double>::infinity();
    start_from(state, h, a_begin_);
    const double moving = evaluate(state, h) ? residual_norm() : none;
    swap();
    start_from(state, h, Vector::Zero(n_));
    const double steady = evaluate(state, h) ? residual_norm() : none;
    if (!(steady <= moving)) swap();
    return std::min(steady, moving) < none;
}

void RadauIIA::start_from(const State& state, double h, const Vector& acceleration) {
    for (std::size_t i = 0; i < 3; ++i) {
        const double t = radau().c[static_cast<Eigen::Index>(i)] * h;
        auto& point = stages_[i].point;
        point.state = state;
        point.state.t = state.t + t;
        as_vector(point.state.v) = v_begin_ + t * acceleration;
        point.delta = t * v_begin_ + 0.5 * t * t * acceleration;
        point.lambda = lambda_begin_;
    }
}

/// The polynomials of the last step go on: of degree 3 in the velocities, of degree 2 in λ.
void RadauIIA::extrapolate(const State& state, double h) {
    const auto& c = radau().c;
    const double places[] = {0.0, c[0], c[1], c[2]};
    const auto lagrange = [&](int first, int k, double at) {
        double value = 1.0;
        for (int j = first; j < 4; ++j)
            if (j != k) value *= (at - places[j]) / (places[k] - places[j]);
        return value;
    };
    for (std::size_t i = 0; i < 3; ++i) {
        const double at = 1.0 + c[static_cast<Eigen::Index>(i)] * h / last_.h;
        auto& point = stages_[i].point;
        point.state = state;
        point.state.t = state.t + c[static_cast<Eigen::Index>(i)] * h;
        auto v = as_vector(point.state.v);
        v += lagrange(0, 0, at) * last_.begin_v - last_.v[2];
        point.lambda.setZero(m_);
        for (int k = 1; k < 4; ++k) {
            v += lagrange(0, k, at) * last_.v[static_cast<std::size_t>(k - 1)];
            point.lambda += lagrange(1, k, at) * last_.lambda[static_cast<std::size_t>(k - 1)];
        }
    }
    for (std::size_t i = 0; i < 3; ++i) {
        auto& delta = stages_[i].point.delta;
        delta.setZero(n_);
        for (std::size_t j = 0; j < 3; ++j)
            delta += h * radau().A(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) *
                     as_vector(stages_[j].point.state.v);
    }
}

// ---- Residuals and matrices ----

/// (2) at the points. False if a number in it is not finite, or a body turns too far.
bool RadauIIA::evaluate(const State& state, double h) {
    const auto& B = radau().B;
    for (std::size_t i = 0; i < 3; ++i) {
        Stage& stage = stages_[i];
        auto& point = stage.point;
        if (!point.delta.allFinite() || !as_vector(point.state.v).allFinite()) return false;
        system_.increment(state.q.data(), point.delta.data(), point.state.q.data());
        system_.inverse_tangent(point.delta.data(), stage.blocks);
        for (const auto& block : stage.blocks)
            if (point.delta.segment<3>(block.first).norm() > largest_turn) return false;
        multiply_blocks(stage.blocks, as_vector(point.state.v), stage.slope);
        stage.force.setZero(n_);
        system_.add_force(point.state, 1.0, stage.force.data());
        stage.reaction.setZero(n_);
        stage.constraint.assign(static_cast<std::size_t>(m_), 0.0);
        if (m_ > 0) {
            now_.begin(m_, n_);
            system_.add_constraint_jacobian(point.state, 0, now_);
            const SparseMatrix& D = now_.finish();
            D.transpose_multiply_add(1.0, point.lambda.data(), stage.reaction.data());
            system_.constraint_rate(point.state, stage.constraint.data());
            D.multiply_add(1.0, point.state.v.data(), stage.constraint.data());
        }
    }
    for (std::size_t i = 0; i < 3; ++i) {
        Stage& stage = stages_[i];
        stage.rho = -h * stage.slope;
        stage.velocity_change.setZero(n_);
        for (std::size_t j = 0; j < 3; ++j) {
            const double b = B(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
            stage.rho += b * stages_[j].point.delta;
            stage.velocity_change += b * (as_vector(stages_[j].point.state.v) - v_begin_);
        }
        stage.point.acceleration = stage.velocity_change / h;
        stage.momentum = -h * (stage.force + stage.reaction);
        system_.multiply_mass(stage.point.state, 1.0, stage.velocity_change.data(), stage.momentum.data());
        if (!stage.momentum.allFinite() || !as_vector(stage.constraint).allFinite()) return false;
    }
    return true;
}

/// ‖p‖ over the stages.
double RadauIIA::residual_norm() const {
    double sum = 0.0;
    for (const Stage& stage : stages_) sum += stage.momentum.squaredNorm();
    return std::sqrt(sum);
}

void RadauIIA::assemble(double h) {
    const Tangent tangent = settings_.tangent;
    for (std::size_t i = 0; i < 3; ++i) {
        Stage& stage = stages_[i];
        const auto& point = stage.point;
        const double tau = h * radau().L(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i));
        M_[i].begin(n_, n_);
        system_.add_mass(point.state, 1.0, M_[i]);
        M_[i].finish_into(stage.M);
        K_[i].begin(n_, n_);
        if (system_.has_stiffness()) system_.add_stiffness(point.state, 1.0, tangent, K_[i]);
        system_.add_inertial_stiffness(point.state, point.acceleration.data(), 1.0, tangent, K_[i]);
        if (m_ > 0) system_.add_constraint_stiffness(point.state, point.lambda.data(), -1.0, tangent, K_[i]);
        K_[i].finish_into(stage.K);
        H_[i].begin(n_, n_);
        H_[i].add_matrix(stage.M);
        if (system_.has_stiffness()) system_.add_damping(point.state, tau, tangent, H_[i]);
        system_.add_gyroscopic_damping(point.state, tau, tangent, H_[i]);
        H_[i].add_matrix(stage.K, tau * tau);
        H_[i].finish_into(stage.first.H);
        D_[i].begin(m_, n_);
        if (m_ > 0) system_.add_constraint_jacobian(point.state, 0, D_[i]);
        D_[i].finish_into(stage.first.D);
        stage.others.H = stage.first.H;
        stage.others.D = stage.first.D;
        stage.given = false;
    }
    const SparseMatrix& H = stages_[2].first.H;
    root_.setOnes(n_);
    for (std::int32_t row = 0; row < n_; ++row) {
        double most = 0.0;
        for (auto e = H.row_start[static_cast<std::size_t>(row)]; e < H.row_start[static_cast<std::size_t>(row) + 1];
             ++e)
            if (H.column[static_cast<std::size_t>(e)] == row) most = std::abs(H.value[static_cast<std::size_t>(e)]);
        if (most > 0.0) root_[row] = std::sqrt(most);
    }
}

LinearSolution RadauIIA::solve(std::size_t stage, const Vector& a, const std::vector<double>& b, StepSolver& solver,
                               StepReport& report) {
    Stage& of = stages_[stage];
    Problem& problem = of.given ? of.others : of.first;
    of.given = true;
    problem.name = stage_names[stage];
    problem.a.assign(a.begin(), a.end());
    problem.b = b;
    problem.cones = cones_;
    report.take(solver.solve(std::move(problem), solution_));
    ++report.newton_iterations;
    return {as_vector(solution_.x), as_vector(solution_.lambda)};
}

// ---- Steps ----

/// Lengths that count as nothing: newton_tolerance of the way of the step, and what rounding makes of the positions.
/// All in √mass · length, as in dynamics/newton.cpp.
double RadauIIA::threshold(const State& state, double h) const {
    double way = h * v_begin_.cwiseProduct(root_).norm();
    for (const Stage& stage : stages_) {
        way = std::max({way, h * as_vector(stage.point.state.v).cwiseProduct(root_).norm(),
                        stage.point.delta.cwiseProduct(root_).norm(), h * h * stage.force.cwiseQuotient(root_).norm(),
                        h * h * stage.reaction.cwiseQuotient(root_).norm()});
    }
    const double size = state.q.empty() ? 0.0 : as_vector(state.q).lpNorm<Eigen::Infinity>();
    return settings_.newton_tolerance * way + 10.0 * epsilon * size * root_.norm();
}

/// One iteration (3).
RadauIIA::Correction RadauIIA::correct(double h, StepSolver& solver, StepReport& report) {
    const auto& [c, error, A, B, L, L_inverse, U] = radau();
    Correction largest;
    for (Eigen::Index i = 0; i < 3; ++i) {
        Stage& stage = stages_[static_cast<std::size_t>(i)];
        const double l = L(i, i), tau = h * l;
        Vector position = Vector::Zero(n_), momentum = Vector::Zero(n_), before = Vector::Zero(n_);
        for (Eigen::Index j = i; j < 3; ++j) {
            position -= U(i, j) * stages_[static_cast<std::size_t>(j)].rho;
            momentum -= U(i, j) * stages_[static_cast<std::size_t>(j)].momentum;
        }
        for (Eigen::Index j = 0; j < i; ++j) {
            position -= L_inverse(i, j) * stages_[static_cast<std::size_t>(j)].delta_delta;
            before -= L_inverse(i, j) * stages_[static_cast<std::size_t>(j)].delta_v;
        }
        momentum += product(stage.M, before) - tau * product(stage.K, position);
        auto solution = solve(static_cast<std::size_t>(i), l * momentum, stage.constraint, solver, report);
        stage.delta_v = std::move(solution.x);
        stage.delta_delta = l * (h * stage.delta_v + position);
        auto& point = stage.point;
        as_vector(point.state.v) += stage.delta_v;
        point.delta += stage.delta_delta;
        point.lambda += solution.lambda / tau;
        largest.scaled = std::max({largest.scaled, h * stage.delta_v.cwiseProduct(root_).norm(),
                                   stage.delta_delta.cwiseProduct(root_).norm()});
        if (n_ > 0)
            largest.longest = std::max({largest.longest, h * stage.delta_v.lpNorm<Eigen::Infinity>(),
                                        stage.delta_delta.lpNorm<Eigen::Infinity>()});
    }
    return largest;
}

/// From the guess, where (2) is known, to the solution; false if it does not lead there.
bool RadauIIA::iterate(const State& state, double h, StepSolver& solver, StepReport& report) {
    constexpr double slow = 0.5;
    constexpr int patience = 3, most_renewals = 3;
    assemble(h);
    int renewals = 0, since = 0;
    double last = 0.0, last_factor = 1.0;
    for (int iteration = 0; iteration < settings_.most_iterations; ++iteration) {
        const Correction step = correct(h, solver, report);
        if (!std::isfinite(step.scaled) || !evaluate(state, h)) return false;
        // The factor of two iterations: single ones vary. Of the first nothing is known.
        const double now = since == 0 ? 1.0 : step.scaled / last;
        const double factor = std::sqrt(now * std::min(last_factor, 1.0));
        const double rest = factor < 0.5 ? factor / (1.0 - factor) : 1.0;
        if (rest * step.longest <= least_correction_ || rest * step.scaled <= threshold(state, h)) return true;
        last = step.scaled;
        last_factor = now;
        if (++since < patience || factor < slow) continue;
        if (renewals++ == most_renewals) return false;
        assemble(h);
        since = 0;
        last_factor = 1.0;
    }
    return false;
}

void RadauIIA::begin(const State& state, StepSolver& solver, StepReport& report) {
    v_begin_ = as_vector(state.v);
    known_ = known_ && last_.end.t == state.t && last_.end.q == state.q && last_.end.v == state.v;
    if (known_) {
        a_begin_ = last_.acceleration;
        lambda_begin_ = last_.lambda[2];
        return;
    }
    auto consistent = accelerations_.at(state, solver, report);
    a_begin_ = std::move(consistent.x);
    lambda_begin_ = std::move(consistent.lambda);
}

void RadauIIA::take_step(State& state, double h, StepSolver& solver, StepReport& report) {
    require_step(system_, state, h, "radau_iia");
    begin(state, solver, report);
    const bool solved_before = report.solved;
    const std::string message_before = report.message;
    bool found = false;
    if (known_) {
        extrapolate(state, h);
        found = evaluate(state, h) && iterate(state, h, solver, report);
    }
    if (!found) found = start(state, h) && iterate(state, h, solver, report);
    if (!found) {
        known_ = false;
        throw StepTooLong(
            fmt::format("radau_iia cannot take the step from t = {:.9g} with h = {:.9g}: Newton's method does not "
                        "converge; take shorter steps",
                        state.t, h));
    }
    estimate(state, h, solver, report);
    finish(state, h, solver, report);
    // What a solver says of an increment is settled by Newton's own convergence.
    report.solved = solved_before;
    report.message = message_before;
}

// ---- The estimate ----
//
// With γ = l_33 the embedded method of order 3 (Hairer and Wanner, eq. IV.8.19, for any γ) is off from the result by
//
//     e = γ h y˙_n + Σ e_i (Y_i − y_n),     e_i = γ/3 (−13 − 7√6, −13 + 7√6, −1)
//
// In stiff directions that is too large without bound, so that (I − γ h J)⁻¹ e stands for it: one more solve with the
// matrices of the third stage.

void RadauIIA::estimate(const State& state, double h, StepSolver& solver, StepReport& report) {
    const Stage& end = stages_[2];
    const double gamma = radau().L(2, 2), tau = gamma * h;
    Vector position = tau * v_begin_, velocity = tau * a_begin_;
    for (std::size_t i = 0; i < 3; ++i) {
        const double factor = radau().error[static_cast<Eigen::Index>(i)];
        position += factor * stages_[i].point.delta;
        velocity += factor * (as_vector(stages_[i].point.state.v) - as_vector(state.v));
    }
    const Vector a = product(end.M, velocity) - tau * product(end.K, position);
    error_v_ = solve(2, a, std::vector<double>(static_cast<std::size_t>(m_), 0.0), solver, report).x;
    error_q_ = position + tau * error_v_;
}

void RadauIIA::finish(State& state, double h, StepSolver& solver, StepReport& report) {
    last_.h = h;
    last_.begin_v = v_begin_;
    for (std::size_t i = 0; i < 3; ++i) {
        last_.v[i] = as_vector(stages_[i].point.state.v);
        last_.lambda[i] = stages_[i].point.lambda;
    }
    last_.acceleration = stages_[2].point.acceleration;
    State& end = last_.end;
    end = stages_[2].point.state;
    if (m_ > 0) {
        Vector least;
        const auto nearest = [&](const std::vector<double>& off) -> const Vector& {
            least = solve(2, Vector::Zero(n_), off, solver, report).x;
            return least;
        };
        return_positions(system_, "radau_iia", state, end, h, nearest);
        now_.begin(m_, n_);
        system_.add_constraint_jacobian(end, 0, now_);
        return_velocities(system_, "radau_iia", state, end, h, now_.finish(), nearest);
    }
    require_finite(state, end, h, "radau_iia");
    begin_ = state;
    stepped_ = true;
    multipliers_.assign(last_.lambda[2].begin(), last_.lambda[2].end());
    report.multipliers = multipliers_;
    known_ = true;
    state = end;
}

// ---- The way of the step ----
//
// That of the collocation: through 0 and the stages, of degree 3 in Δ and v, through the stages in λ. Its errors are of
// order 4 in h, as the estimate's. The last stage stands for the end that was returned to the constraints.

void RadauIIA::extend(ContinuousExtension& way) const {
    way.degree = 0;
    if (!known_ || !stepped_) return;
    way.degree = 3;
    way.begin = begin_;
    way.end = last_.end;
    way.multipliers.assign(last_.lambda[2].begin(), last_.lambda[2].end());
    Eigen::Matrix3d powers;  // of θ, from 1 on, at the stages
    for (Eigen::Index i = 0; i < 3; ++i)
        for (Eigen::Index k = 0; k < 3; ++k) powers(i, k) = std::pow(radau().c[i], static_cast<double>(k + 1));
    const auto fit = [](const Eigen::Matrix3d& at, const std::array<Vector, 3>& values, std::vector<double>& result) {
        const Eigen::Matrix3d inverse = at.inverse();
        result.clear();
        for (Eigen::Index k = 0; k < 3; ++k)
            append(result, inverse(k, 0) * values[0] + inverse(k, 1) * values[1] + inverse(k, 2) * values[2]);
    };
    std::array<Vector, 3> delta, v;
    for (std::size_t i = 0; i < 3; ++i) {
        delta[i] = stages_[i].point.delta;
        v[i] = last_.v[i] - last_.begin_v;
    }
    if (m_ > 0) meet_end(system_, way.begin, way.end, delta[2]);
    v[2] = as_vector(way.end.v) - last_.begin_v;
    fit(powers, delta, way.positions);
    fit(powers, v, way.velocities);
    if (m_ > 0) fit(radau().c.cwiseInverse().asDiagonal() * powers, last_.lambda, way.multiplier_powers);
}

// ---- Memory ----

std::vector<double> RadauIIA::save() const {
    if (!known_) return {};
    std::vector<double> memory = {last_.h, last_.end.t};
    const auto put = [&](const auto& values) { memory.insert(memory.end(), values.begin(), values.end()); };
    put(last_.end.q);
    put(last_.end.v);
    put(last_.begin_v);
    put(last_.acceleration);
    for (const auto& v : last_.v) put(v);
    for (const auto& lambda : last_.lambda) put(lambda);
    return memory;
}

void RadauIIA::load(const std::vector<double>& memory) {
    restart();
    if (memory.empty()) return;
    const auto positions = static_cast<std::size_t>(system_.position_size()), n = static_cast<std::size_t>(n_),
               m = static_cast<std::size_t>(m_);
    if (memory.size() != 2 + positions + 6 * n + 3 * m)
        throw InputError("the memory of radau_iia is of another system");
    last_.h = memory[0];
    last_.end.t = memory[1];
    const double* at = memory.data() + 2;
    const auto take = [&](std::size_t count) {
        at += count;
        return std::span<const double>(at - count, count);
    };
    const auto vector = [&](std::size_t count) {
        const auto values = take(count);
        return Vector(Eigen::Map<const Vector>(values.data(), static_cast<Eigen::Index>(count)));
    };
    const auto q = take(positions), v = take(n);
    last_.end.q.assign(q.begin(), q.end());
    last_.end.v.assign(v.begin(), v.end());
    last_.begin_v = vector(n);
    last_.acceleration = vector(n);
    for (auto& stage : last_.v) stage = vector(n);
    for (auto& stage : last_.lambda) stage = vector(m);
    multipliers_.assign(last_.lambda[2].begin(), last_.lambda[2].end());
    known_ = true;
}

const RegisterTimestepper radau_row{
    {.name = "radau_iia",
     .description = "Radau IIA of order 5, implicit: stiff systems and constraints; steps by tolerance; no contacts",
     .options = {jacobian_option("symmetric"),
                 {.key = "newton_tolerance",
                  .type = DELASSUS_OPTION_REAL,
                  .default_value = "1e-9",
                  .minimum = 0.0,
                  .maximum = 0.1,
                  .doc = "what is left of the stages, relative to the way that the step goes"},
                 {.key = "max_newton_iterations",
                  .type = DELASSUS_OPTION_INTEGER,
                  .default_value = "40",
                  .minimum = 1.0,
                  .maximum = 1e6,
                  .doc = "iterations over the three stages before the step counts as too long"},
                 error_limit_option()},
     .constraints = true,
     .unilateral = false,
     .order = 5,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>& values) -> std::unique_ptr<Timestepper> {
         return std::make_unique<RadauIIA>(
             system, RadauIIA::Settings{.tangent = values[0].text == "exact" ? Tangent::Exact : Tangent::Symmetric,
                                        .newton_tolerance = values[1].real,
                                        .most_iterations = static_cast<int>(values[2].integer),
                                        .error_limit = values[3].real});
     }}};

}  // namespace
}  // namespace delassus
