// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/newton.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace delassus {

// ---- The equations ----
//
// At the end of a step the position is q = q_n ∘ exp(Δ), and velocity and acceleration are affine in Δ,
// v = v₀ + γ′Δ, v̇ = v̇₀ + β′Δ. Sought are Δ and λ with
//
//     r = M(q) v̇ − f(q, v, t) − C_q(q)ᵀ λ = 0,      C(q, t) = 0
//
// Newton's unknown x is an increment of the position itself, q ← q ∘ exp(x). Then C changes by C_q x, and D = C_q is
// the Jacobian that carries λ too. As exp(Δ + T⁻¹(Δ)x) = exp(Δ) ∘ exp(x) to first order, Δ changes by T⁻¹x, v by
// γ′T⁻¹x, v̇ by β′T⁻¹x, and with K = −∂f/∂q, R = −∂f/∂v
//
//     H x − Dᵀ δλ = −r,   D x = −C,      H = K + ∂(M v̇)/∂q − ∂(C_qᵀ λ)/∂q + (γ′ R + β′ M) T⁻¹
//
// (seed eq. 197 ff., whose sign of λ is the opposite one). H grows like β′ ~ 1/h², and the condition of the matrix
// like h⁻⁴. Multiplied by s = 1/β′,
//
//     [s H  −Dᵀ; D  0] {x; s δλ} = {−s r; −C}
//
// tends to [M −Dᵀ; D 0] as h → 0 (Bottasso, Dopico, Trainelli, Multibody System Dynamics 19, 2008: optimal scaling of
// index-3 problems).

namespace {

/// The derivative is dense in joint coordinates, and its LU takes twice the work of a Cholesky factor.
constexpr std::int32_t most_columns_of_derivative = 200;

bool starts_exact(const DynamicalSystem& system, Jacobian jacobian) {
    if (jacobian != Jacobian::Automatic) return jacobian == Jacobian::Exact;
    return system.m() == 0 && system.n() <= most_columns_of_derivative;
}

}  // namespace

Newton::Newton(DynamicalSystem& system, NewtonSettings settings)
    : system_(system),
      settings_(std::move(settings)),
      linearization_(system, settings_.linearization_limit),
      starts_exact_(starts_exact(system, settings_.jacobian)),
      exact_(starts_exact_),
      cones_(free_cones(system)),
      n_(system.n()),
      m_(system.m()) {}

const SparseMatrix& Newton::jacobian(const State& state) {
    D_.begin(m_, n_);
    if (m_ > 0) system_.add_constraint_jacobian(state, 0, D_);
    return D_.finish();
}

bool Newton::evaluate(const State& begin, StepPoint& point, StepResidual& residual) {
    system_.increment(begin.q.data(), point.delta.data(), point.state.q.data());
    residual.inertia.setZero(n_);
    residual.force.setZero(n_);
    residual.reaction.setZero(n_);
    residual.constraint.setZero(m_);
    system_.multiply_mass(point.state, 1.0, point.acceleration.data(), residual.inertia.data());
    system_.add_force(point.state, 1.0, residual.force.data());
    if (load_.size() > 0) residual.force += load_;
    if (m_ > 0) {
        jacobian(point.state).transpose_multiply_add(1.0, point.lambda.data(), residual.reaction.data());
        system_.constraint(point.state, residual.constraint.data());
    }
    residual.balance = residual.inertia - residual.force - residual.reaction;
    return residual.balance.allFinite() && residual.constraint.allFinite();
}

namespace {

/// target += matrix · T⁻¹, T⁻¹ being the identity but for the blocks.
void add_product(const SparseMatrix& matrix, const std::vector<DiagonalBlock3>& blocks, MatrixAssembler& target) {
    std::vector<std::int32_t> block_of(static_cast<std::size_t>(matrix.columns), -1);
    for (std::size_t b = 0; b < blocks.size(); ++b)
        for (std::int32_t k = 0; k < 3; ++k)
            block_of[static_cast<std::size_t>(blocks[b].first + k)] = static_cast<std::int32_t>(b);
    for (std::int32_t row = 0; row < matrix.rows; ++row) {
        const auto end = static_cast<std::size_t>(matrix.row_start[static_cast<std::size_t>(row) + 1]);
        for (auto e = static_cast<std::size_t>(matrix.row_start[static_cast<std::size_t>(row)]); e < end; ++e) {
            const auto column = matrix.column[e];
            const auto b = block_of[static_cast<std::size_t>(column)];
            if (b < 0) {
                target.add(row, column, matrix.value[e]);
                continue;
            }
            const auto& block = blocks[static_cast<std::size_t>(b)];
            const double* factors = block.value + 3 * (column - block.first);
            for (std::int32_t k = 0; k < 3; ++k) target.add(row, block.first + k, matrix.value[e] * factors[k]);
        }
    }
}

bool finite(const SparseMatrix& A) {
    return std::all_of(A.value.begin(), A.value.end(), [](double value) { return std::isfinite(value); });
}

/// result ← ½(A + Aᵀ)
void symmetric_part(const SparseMatrix& A, MatrixAssembler& halves, SparseMatrix& result) {
    halves.begin(A.rows, A.columns);
    for (std::int32_t row = 0; row < A.rows; ++row) {
        const auto end = static_cast<std::size_t>(A.row_start[static_cast<std::size_t>(row) + 1]);
        for (auto e = static_cast<std::size_t>(A.row_start[static_cast<std::size_t>(row)]); e < end; ++e) {
            halves.add(row, A.column[e], 0.5 * A.value[e]);
            halves.add(A.column[e], row, 0.5 * A.value[e]);
        }
    }
    halves.finish_into(result);
}

}  // namespace

const SparseMatrix& Newton::matrix(const StepPoint& point, StepSlopes slopes) {
    const Tangent tangent = exact_ ? Tangent::Exact : Tangent::Symmetric;
    const double s = 1.0 / slopes.beta;
    rates_.begin(n_, n_);
    system_.add_mass(point.state, 1.0, rates_);
    if (system_.has_stiffness()) system_.add_damping(point.state, s * slopes.gamma, tangent, rates_);
    system_.add_gyroscopic_damping(point.state, s * slopes.gamma, tangent, rates_);
    system_.inverse_tangent(point.delta.data(), blocks_);
    H_.begin(n_, n_);
    add_product(rates_.finish(), blocks_, H_);
    if (system_.has_stiffness()) system_.add_stiffness(point.state, s, tangent, H_);
    system_.add_inertial_stiffness(point.state, point.acceleration.data(), s, tangent, H_);
    if (m_ > 0) system_.add_constraint_stiffness(point.state, point.lambda.data(), -s, tangent, H_);
    return H_.finish();
}

void Newton::assemble(const StepPoint& point, StepSlopes slopes) {
    const SparseMatrix& H = matrix(point, slopes);
    if (exact_)
        kept_.H = H;
    else
        symmetric_part(H, halves_, kept_.H);
    kept_.D = jacobian(point.state);
    kept_.slopes = slopes;
    kept_.valid = true;
    scale();
}

// ---- Norms ----
//
// With the rows scaled by 1/√H_ii, the columns by √H_ii, and a constraint's row by 1/√(D diag(H)⁻¹ Dᵀ)_jj, all parts of
// residual and increment are in one unit, √mass · length, whatever units the coordinates have; and where H is nearly
// diagonal, the norm of the residual is that of the increment that removes it. The measure for both is the way σ that
// the step goes: the largest of ‖Δ‖, h‖v_n‖, s‖M v̇‖, s‖f‖, s‖C_qᵀλ‖ in this norm. An iteration that takes the residual
// from ρ₋ to ρ by an increment x contracts by θ = ρ/ρ₋, and leaves an error of about θ/(1 − θ) ‖x‖. Converged is
//
//     ρ ≤ tolerance · σ + 10 ε ‖q‖_∞ ‖√diag H‖    and    min(1, θ/(1 − θ)) ‖x‖ ≤ the same
//
// where the second term is the change of an increment by the last digits of the positions; or if ρ ≤ 4 ε σ, which no
// iteration lowers, however far its increments go (a chain of 1000 links has a matrix of a condition of 1e12).

void Newton::scale() {
    root_.setZero(n_);
    const auto& H = kept_.H;
    for (std::int32_t i = 0; i < n_; ++i) {
        double diagonal = 0.0, largest = 0.0;
        for (auto e = H.row_start[static_cast<std::size_t>(i)]; e < H.row_start[static_cast<std::size_t>(i) + 1]; ++e) {
            const double value = std::abs(H.value[static_cast<std::size_t>(e)]);
            if (H.column[static_cast<std::size_t>(e)] == i) diagonal = value;
            largest = std::max(largest, value);
        }
        // A diagonal that is lost in its row (a saddle in H) says nothing about the size of the row.
        const double size = diagonal > 1e-8 * largest ? diagonal : largest;
        root_[i] = size > 0.0 ? std::sqrt(size) : 1.0;
    }
    row_scale_.setOnes(m_);
    const auto& D = kept_.D;
    for (std::int32_t j = 0; j < m_; ++j) {
        double sum = 0.0;
        for (auto e = D.row_start[static_cast<std::size_t>(j)]; e < D.row_start[static_cast<std::size_t>(j) + 1]; ++e) {
            const double value = D.value[static_cast<std::size_t>(e)] / root_[D.column[static_cast<std::size_t>(e)]];
            sum += value * value;
        }
        if (sum > 0.0) row_scale_[j] = 1.0 / std::sqrt(sum);
    }
}

double Newton::merit(const StepResidual& residual, double s) const {
    return std::hypot(s * residual.balance.cwiseQuotient(root_).norm(),
                      residual.constraint.cwiseProduct(row_scale_).norm());
}

// ---- The iteration ----
//
// The symmetric part of the matrix leads to the same solution, if it leads there: where reactions turn bodies strongly
// (a heavy pull across a light link that is off its balance), the rest of it is not small, and the iteration creeps or
// goes astray. A step in which it does is finished with the whole matrix, if there is a solver that takes one.

namespace {

constexpr int most_symmetric_iterations = 10;
/// Of a body in an increment, rad.
constexpr double furthest_turn = 1.0;
/// Of what is tried first of an increment, where the residual would not fall otherwise.
constexpr double shortest_part = 1.0 / 64.0;

}  // namespace

/// One step's iteration, from a guess of its end.
class Newton::Iteration {
public:
    Iteration(Newton& newton, Reuse reuse, const State& begin, double h, StepSlopes slopes, StepPoint& point,
              StepResidual& residual, StepSolver& solver, StepReport& report)
        : newton_(newton),
          settings_(newton.settings_),
          reuse_(reuse),
          begin_(begin),
          h_(h),
          slopes_(slopes),
          s_(1.0 / slopes.beta),
          point_(point),
          residual_(residual),
          solver_(solver),
          report_(report),
          solved_before_(report.solved),
          message_before_(report.message),
          trial_(point) {}

    void run() {
        const Kept& kept = newton_.kept_;
        renew_ = !(kept.valid && reuse_ == Reuse::Adaptive && kept.slopes.beta == slopes_.beta &&
                   kept.slopes.gamma == slopes_.gamma);
        if (!renew_) newton_.scale();
        newton_.exact_ = newton_.starts_exact_;
        may_become_exact_ = !newton_.exact_ && !settings_.linearized;
        for (int iteration = 0; iteration < settings_.max_iterations; ++iteration) {
            if (may_become_exact_ && iteration >= most_symmetric_iterations) become_exact();
            prepare();
            if (!find_increment()) continue;
            move(settings_.linearized ? 1.0 : longest_part());
            set_threshold();
            if (settings_.linearized) return finish_linearized();
            if (!search()) continue;
            if (advance()) return finish();
        }
        fail(fmt::format(
            "after {} iterations of Newton's method the scaled residual is {:.1e}, where {:.1e} is asked for; "
            "a smaller step{} may help",
            settings_.max_iterations, rho_, threshold_, newton_.exact_ ? "" : " or jacobian: exact"));
    }

private:
    [[noreturn]] void fail(const std::string& why) {
        newton_.kept_.valid = false;
        throw StepFailure(fmt::format("{} cannot take the step from t = {:.9g} with h = {:.9g}: {}", settings_.method,
                                      begin_.t, h_, why));
    }

    void become_exact() {
        newton_.exact_ = true;
        may_become_exact_ = false;
        renew_ = true;
    }

    /// The matrices at the point, anew where asked for, and the size of its residual.
    void prepare() {
        if (renew_) newton_.assemble(point_, slopes_);
        fresh_ = renew_;
        rho_ = newton_.merit(residual_, s_);
        if (!std::isfinite(rho_) || !finite(newton_.kept_.H) || !finite(newton_.kept_.D))
            fail("the residual or its Jacobian is not finite");
    }

    /// Solves for the increment and its direction in Δ. False where no solver takes the whole matrix, if it was not
    /// asked for: the next iteration is back to the symmetric one.
    bool find_increment() {
        Problem problem;
        problem.H = newton_.kept_.H;
        problem.D = newton_.kept_.D;
        problem.a.resize(static_cast<std::size_t>(newton_.n_));
        Eigen::Map<Vector>(problem.a.data(), newton_.n_) = -s_ * residual_.balance;
        problem.b.assign(residual_.constraint.begin(), residual_.constraint.end());
        problem.cones = newton_.cones_;
        try {
            increment_ = solve_linear(std::move(problem), solver_, report_);
        } catch (const Unsupported&) {
            if (newton_.exact_ && settings_.jacobian == Jacobian::Automatic) newton_.starts_exact_ = false;
            if (newton_.exact_ == newton_.starts_exact_) throw;
            newton_.exact_ = newton_.starts_exact_;
            renew_ = true;
            return false;
        }
        if (!increment_.x.allFinite() || !increment_.lambda.allFinite()) fail("the increment is not finite");
        newton_.system_.inverse_tangent(point_.delta.data(), newton_.blocks_);
        multiply_blocks(newton_.blocks_, increment_.x, direction_);
        return true;
    }

    /// All of the increment, unless it turns a body further than any correction of a guess that is worth its name: a
    /// light link between heavy ones, whose matrix is nearly singular, would be thrown to another end of the step.
    [[nodiscard]] double longest_part() const {
        if (std::isinf(settings_.largest_turn)) return 1.0;
        double turn = 0.0;
        for (const auto& block : newton_.blocks_) turn = std::max(turn, direction_.segment<3>(block.first).norm());
        return turn > furthest_turn ? furthest_turn / turn : 1.0;
    }

    /// The trial ← the point and a part of the increment, with its residual.
    void move(double part) {
        part_ = part;
        trial_.delta = point_.delta + part * direction_;
        trial_.acceleration = point_.acceleration + part * slopes_.beta * direction_;
        Eigen::Map<Vector>(trial_.state.v.data(), newton_.n_) =
            Eigen::Map<const Vector>(point_.state.v.data(), newton_.n_) + part * slopes_.gamma * direction_;
        trial_.lambda = point_.lambda + part / s_ * increment_.lambda;
        trial_rho_ = newton_.evaluate(begin_, trial_, trial_residual_) ? newton_.merit(trial_residual_, s_)
                                                                       : std::numeric_limits<double>::infinity();
    }

    [[nodiscard]] double size(const Vector& motion) const { return motion.cwiseProduct(newton_.root_).norm(); }
    [[nodiscard]] double force_size(const Vector& force) const {
        return s_ * force.cwiseQuotient(newton_.root_).norm();
    }

    void set_threshold() {
        const Eigen::Map<const Vector> q(trial_.state.q.data(), static_cast<Eigen::Index>(trial_.state.q.size()));
        const double sigma =
            std::max({size(trial_.delta), h_ * size(Eigen::Map<const Vector>(begin_.v.data(), newton_.n_)),
                      force_size(trial_residual_.inertia), force_size(trial_residual_.force),
                      force_size(trial_residual_.reaction)});
        const double digits = newton_.n_ > 0 ? 10.0 * std::numeric_limits<double>::epsilon() *
                                                   q.lpNorm<Eigen::Infinity>() * newton_.root_.norm()
                                             : 0.0;
        threshold_ = settings_.tolerance * sigma + digits;
        rounding_ = 4.0 * std::numeric_limits<double>::epsilon() * sigma;
    }

    /// One iteration is all: its error is measured instead.
    void finish_linearized() {
        if (!std::isfinite(trial_rho_)) fail("the end of the step is not finite");
        Linearization& linearization = newton_.linearization_;
        if (linearization.wanted()) {
            const Vector force = h_ * trial_residual_.force,
                         linear = h_ * (trial_residual_.inertia - trial_residual_.reaction);
            const auto n = static_cast<std::size_t>(newton_.n_);
            linearization.judge(begin_, trial_.state, h_, {force.data(), n}, {linear.data(), n}, newton_.kept_.H,
                                settings_.method, solver_, report_);
        }
        newton_.judge_turns(begin_, h_, trial_.delta);
        point_ = trial_;
    }

    [[nodiscard]] bool falls() const { return trial_rho_ <= threshold_ || trial_rho_ <= (1.0 - 1e-4 * part_) * rho_; }

    /// The full step as a rule; halved while the residual would not fall. A direction from an old or a symmetric matrix
    /// need not be one of descent: then false, and the next iteration has a new or the whole one. Else all that was
    /// tried first is gone, as Newton's method without a search would.
    bool search() {
        if (watched_) return judge_watched();
        if (settings_.watchdog && may_watch_ && !falls() && std::isfinite(trial_rho_)) {
            watched_.emplace(Watched{point_, residual_, rho_});
            return true;
        }
        may_watch_ = true;
        const double longest = part_;
        while (!falls() && part_ > shortest_part * longest) move(0.5 * part_);
        if (falls()) return true;
        if (!fresh_) {
            renew_ = true;
            return false;
        }
        if (may_become_exact_) {
            become_exact();
            return false;
        }
        move(longest);
        if (!std::isfinite(trial_rho_)) fail("no part of Newton's increment leads to a finite residual");
        return true;
    }

    /// After the whole of an increment that let the residual grow (Chamberlain et al., Math. Programming Study 16,
    /// 1982): an increment that turns a slender part stretches it, which the next one takes back. If that does not lead
    /// below the residual from before, back there, and parts of the increment are tried.
    bool judge_watched() {
        const bool below = trial_rho_ <= threshold_ || trial_rho_ <= (1.0 - 1e-4) * watched_->rho;
        if (!below) {
            point_ = watched_->point;
            residual_ = watched_->residual;
            may_watch_ = false;
            renew_ = true;
        }
        watched_.reset();
        return below;
    }

    /// The point ← the trial. Whether that is the solution; else renew_ says whether the matrices served.
    bool advance() {
        std::swap(point_, trial_);
        std::swap(residual_, trial_residual_);
        const double theta = trial_rho_ / rho_;
        const double rest = (theta < 0.5 ? theta / (1.0 - theta) : 1.0) * part_ * size(increment_.x);
        rho_ = trial_rho_;
        renew_ = reuse_ == Reuse::Full || newton_.exact_ != newton_.starts_exact_ ||
                 theta > (reuse_ == Reuse::Modified ? 0.5 : 0.1);
        return (rho_ <= threshold_ && rest <= threshold_) || rho_ <= rounding_;
    }

    /// What a solver says of an increment is settled by Newton's own convergence. Constraints that repeat each other,
    /// for one, contradict each other in an increment by terms of second order, which a solver calls infeasible.
    void finish() {
        newton_.judge_turns(begin_, h_, point_.delta);
        report_.solved = solved_before_;
        report_.message = message_before_;
    }

    Newton& newton_;
    const NewtonSettings& settings_;
    const Reuse reuse_;
    const State& begin_;
    const double h_;
    const StepSlopes slopes_;
    const double s_;
    StepPoint& point_;
    StepResidual& residual_;
    StepSolver& solver_;
    StepReport& report_;
    const bool solved_before_;
    const std::string message_before_;

    bool renew_ = true;              // the matrices, before the next increment
    bool fresh_ = true;              // they belong to the point
    bool may_become_exact_ = false;  // from the symmetric part
    LinearSolution increment_;       // x and s δλ
    Vector direction_;               // T⁻¹ x
    StepPoint trial_;
    StepResidual trial_residual_;
    struct Watched {
        StepPoint point;
        StepResidual residual;
        double rho;
    };
    std::optional<Watched> watched_;  // the point before the residual grew
    bool may_watch_ = true;
    double part_ = 1.0;  // of the increment in the trial
    double rho_ = 0.0, trial_rho_ = 0.0, threshold_ = 0.0, rounding_ = 0.0;
};

void Newton::solve(const State& begin, double h, StepSlopes slopes, StepPoint& point, StepResidual& residual,
                   StepSolver& solver, StepReport& report) {
    const auto run = [&](Reuse reuse) {
        Iteration(*this, reuse, begin, h, slopes, point, residual, solver, report).run();
    };
    if (settings_.reuse == Reuse::Full || settings_.linearized) return run(Reuse::Full);
    const StepPoint guess = point;
    const StepResidual guessed = residual;
    try {
        run(settings_.reuse);
    } catch (const StepFailure&) {
        // Old matrices may lead astray where new ones do not.
        point = guess;
        residual = guessed;
        run(Reuse::Full);
    }
}

// exp is one to one for turns by less than 2π only, where T is singular: a body that turns further in a step comes to
// the same orientation by a shorter way, with other velocities, and Newton's method finds one of these ends or another.
void Newton::judge_turns(const State& begin, double h, const Vector& delta) {
    if (std::isinf(settings_.largest_turn)) return;
    system_.inverse_tangent(delta.data(), blocks_);
    for (const auto& block : blocks_) {
        const double turn = delta.segment<3>(block.first).norm();
        if (turn <= settings_.largest_turn) continue;
        kept_.valid = false;
        throw StepFailure(fmt::format(
            "{} cannot take the step from t = {:.9g} with h = {:.9g}: a body turns by {:.3g} rad in it, where "
            "largest_turn is {:.3g}; take shorter steps",
            settings_.method, begin.t, h, turn, settings_.largest_turn));
    }
}

// ---- Memory ----

namespace {

void put(std::vector<double>& memory, const SparseMatrix& matrix) {
    memory.insert(memory.end(), {static_cast<double>(matrix.rows), static_cast<double>(matrix.columns),
                                 static_cast<double>(matrix.entries())});
    memory.insert(memory.end(), matrix.row_start.begin(), matrix.row_start.end());
    memory.insert(memory.end(), matrix.column.begin(), matrix.column.end());
    memory.insert(memory.end(), matrix.value.begin(), matrix.value.end());
}

const double* get(const double* next, const double* end, SparseMatrix& matrix) {
    const auto take = [&](std::size_t count) {
        if (static_cast<std::size_t>(end - next) < count) throw InputError("a timestepper's memory is too short");
        next += count;
        return next - count;
    };
    const auto integer = [](double value) { return static_cast<std::int32_t>(value); };
    const double* sizes = take(3);
    matrix.rows = integer(sizes[0]);
    matrix.columns = integer(sizes[1]);
    const auto rows = static_cast<std::size_t>(matrix.rows) + 1, entries = static_cast<std::size_t>(sizes[2]);
    matrix.row_start.resize(rows);
    const double* starts = take(rows);
    std::transform(starts, starts + rows, matrix.row_start.begin(), integer);
    matrix.column.resize(entries);
    const double* columns = take(entries);
    std::transform(columns, columns + entries, matrix.column.begin(), integer);
    const double* values = take(entries);
    matrix.value.assign(values, values + entries);
    return next;
}

}  // namespace

void Newton::save(std::vector<double>& memory) const {
    const bool needed = kept_.valid && settings_.reuse == Reuse::Adaptive;
    memory.push_back(needed ? 1.0 : 0.0);
    if (!needed) return;
    memory.insert(memory.end(), {kept_.slopes.gamma, kept_.slopes.beta});
    put(memory, kept_.H);
    put(memory, kept_.D);
}

const double* Newton::load(const double* next, const double* end) {
    kept_.valid = false;
    if (next == end) throw InputError("a timestepper's memory is too short");
    if (*next++ == 0.0) return next;
    if (end - next < 2) throw InputError("a timestepper's memory is too short");
    kept_.slopes = {next[0], next[1]};
    next = get(next + 2, end, kept_.H);
    next = get(next, end, kept_.D);
    if (kept_.H.rows != n_ || kept_.D.rows != m_ || kept_.D.columns != n_)
        throw InputError("a timestepper's memory does not fit the system");
    kept_.valid = true;
    return next;
}

// ---- Options ----

OptionInfo jacobian_option(std::string default_value, std::vector<std::string> choices) {
    return {.key = "jacobian",
            .type = DELASSUS_OPTION_CHOICE,
            .default_value = std::move(default_value),
            .choices = std::move(choices),
            .doc = "matrix of Newton's method: the derivative, or its symmetric part, which more solvers accept"};
}

std::vector<OptionInfo> newton_options(std::vector<OptionInfo> own) {
    std::vector<OptionInfo> options = {
        jacobian_option("auto", {"auto", "symmetric", "exact"}),
        {.key = "reuse",
         .type = DELASSUS_OPTION_CHOICE,
         .default_value = "modified",
         .choices = {"full", "modified", "adaptive"},
         .doc = "a new matrix in every iteration, once a step, or when the residual falls too slowly"},
        {.key = "newton_tolerance",
         .type = DELASSUS_OPTION_REAL,
         .default_value = "1e-10",
         .minimum = 0.0,
         .maximum = 0.1,
         .doc = "residual and remaining increment, relative to the way that the step goes (docs/integrators.md)"},
        {.key = "max_newton_iterations",
         .type = DELASSUS_OPTION_INTEGER,
         .default_value = "50",
         .minimum = 1.0,
         .maximum = 1e6,
         .doc = "linear problems in a step before it fails"},
        {.key = "largest_turn",
         .type = DELASSUS_OPTION_REAL,
         .default_value = "6.283185307179586",
         .minimum = 0.0,
         .maximum = HUGE_VAL,
         .unit = "rad",
         .doc = "a step fails if a body turns further in it; beyond a whole turn the end of a step is not unique"}};
    options.insert(options.end(), own.begin(), own.end());
    return options;
}

NewtonSettings newton_settings(std::string method, const std::vector<OptionValue>& values) {
    return {.method = std::move(method),
            .jacobian = values[0].text == "exact"       ? Jacobian::Exact
                        : values[0].text == "symmetric" ? Jacobian::Symmetric
                                                        : Jacobian::Automatic,
            .reuse = values[1].text == "full"       ? Reuse::Full
                     : values[1].text == "modified" ? Reuse::Modified
                                                    : Reuse::Adaptive,
            .tolerance = values[2].real,
            .max_iterations = static_cast<int>(values[3].integer),
            .linearized = false,
            .largest_turn = values[4].real};
}

}  // namespace delassus
