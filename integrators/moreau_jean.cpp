// SPDX-License-Identifier: BSD-3-Clause
// Moreau and Jean's θ-method: contacts, impacts and constraints on the level of velocities. Order 2 for θ = ½.
#include <algorithm>
#include <cmath>
#include <utility>

#include "delassus/timestepper.hpp"
#include "dynamics/linear_problem.hpp"
#include "dynamics/linearization.hpp"
#include "dynamics/untouched_spins.hpp"
#include "dynamics/velocity_contacts.hpp"

namespace delassus {
namespace {

// With v_θ = (1 − θ) v + θ v⁺, forces at the point q_θ = q ∘ exp(θ h v_θ), v_θ, t + θ h, and impulses P of the step,
//
//     M(q_θ) (v⁺ − v) = h f(q_θ, v_θ, t_θ) + C_qᵀ P_C + D_Aᵀ P_A,      q⁺ = q ∘ exp(h v_θ)
//
// (Moreau 1988; Jean, CMAME 177, 1999; Acary and Brogliato 2008, ch. 10; for forces linear in q and v this is their
// θ f⁺ + (1 − θ) f). θ = ½ is the implicit midpoint rule, which keeps the energy of linear systems; θ = 1 damps like
// implicit Euler. Newton's method from a guess ṽ⁺ with the matrix of the first guess,
//
//     H v⁺ − Dᵀ P = H ṽ⁺ + M(q̃_θ) (v − ṽ⁺) + h f̃_θ,      H = M + θ h R + θ² h² K
//
// is one problem [H −Dᵀ; D 0] with the cones of contacts in each iteration. The first guess, ṽ⁺ = v, is off by O(h),
// its result by O(h²), since H is symmetric and lacks the gyroscopic part, and that of the second iteration by O(h³):
// two iterations have order 2 whatever the forces. The second is left out where it would change nothing.
//
// Constraints hold on the level of velocities, C_q(q⁺) v⁺ + C_t = 0, contacts likewise (dynamics/velocity_contacts.cpp,
// which says where D is taken). Afterwards positions are projected onto C = 0 and g ≥ 0, so that nothing drifts. λ is
// P/h, the mean over the step: as a value at its end it is of order 1.
//
// Gyroscopic torques: a body that spins by itself turns by a rule that keeps its energy and momentum
// (DynamicalSystem::free_spins), and what the other motions of the step add to its torque is taken beside its impulse.
class MoreauJean : public Timestepper {
public:
    MoreauJean(DynamicalSystem& system, const std::vector<OptionValue>& values)
        : system_(system),
          theta_(values[0].real),
          iterations_(static_cast<int>(values[1].integer)),
          tolerance_(values[2].real),
          contacts_(system, velocity_contact_settings(system, values[3], values[4])),
          linearization_(system, values[5].real),
          projection_(system),
          cones_(free_cones(system)),
          n_(system.n()),
          m_(system.m()) {}

    [[nodiscard]] int order() const override { return theta_ == 0.5 ? 2 : 1; }
    void restart() override {
        multipliers_.clear();
        contacts_.restart();
        last_h_ = 0.0;
    }

    // h, whether there are multipliers, these, and the impulses of unilateral blocks.
    std::vector<double> save() const override {
        std::vector<double> memory = {last_h_, multipliers_.empty() ? 0.0 : 1.0};
        memory.insert(memory.end(), multipliers_.begin(), multipliers_.end());
        contacts_.append_to(memory);
        return memory;
    }
    void load(const std::vector<double>& memory) override {
        restart();
        if (memory.size() < 2 || (memory[1] != 0.0 && memory.size() < 2 + static_cast<std::size_t>(m_)))
            throw InputError("the memory of moreau_jean is too short");
        last_h_ = memory[0];
        auto rest = std::span<const double>(memory).subspan(2);
        if (memory[1] != 0.0) {
            multipliers_.assign(rest.begin(), rest.begin() + m_);
            rest = rest.subspan(static_cast<std::size_t>(m_));
        }
        contacts_.load(rest);
    }

private:
    void take_step(State& state, double h, StepSolver& solver, StepReport& report) override {
        require_step(system_, state, h, "moreau_jean");
        solver.method_error = {};
        const Eigen::Map<const Vector> v(state.v.data(), n_);
        guess_ = v;
        find_spins(state, h);
        assemble(state, h, solver.law() == Law::Coulomb);
        solution_.x = state.v;
        solve(state, h, solver, report);
        contacts_.drop_negligible(problem_, solution_);

        const Vector result = Eigen::Map<const Vector>(solution_.x.data(), n_);
        move(state, h, result, 1.0, end_);
        end_.v = solution_.x;
        require_finite(state, end_, h, "moreau_jean");
        if (linearization_.wanted()) judge_linearization(state, h, result, report);
        projection_.project(state, end_, h, problem_.H, contacts_, solver, report, "moreau_jean");
        last_h_ = h;
        multipliers_.assign(solution_.lambda.begin(), solution_.lambda.begin() + m_);
        for (double& lambda : multipliers_) lambda /= h;
        contacts_.finish(solution_.lambda, report);
        state = end_;
        report.multipliers = multipliers_;
    }

    /// to.q ← q ∘ exp(part h v_θ) for the velocities v⁺ = `last` at the end; to.v and to.t are those of θ.
    void move(const State& begin, double h, const Vector& last, double part, State& to) {
        const Eigen::Map<const Vector> v(begin.v.data(), n_);
        const Vector mean = (1.0 - theta_) * v + theta_ * last;
        Vector delta = part * h * mean;
        if (part == 1.0)
            for (const FreeSpin* spin : untouched_)
                for (std::int32_t i = 0; i < 3; ++i) delta[spin->column + i] = spin->turn[static_cast<std::size_t>(i)];
        to.q.resize(begin.q.size());
        system_.increment(begin.q.data(), delta.data(), to.q.data());
        to.v.assign(mean.begin(), mean.end());
        to.t = begin.t + part * h;
    }

    /// The spins of the step, their torques at θ, and the guess that the spinning bodies go on alone.
    void find_spins(const State& begin, double h) {
        end_ = begin;
        end_.t = begin.t + h;
        system_.free_spins(end_, h, spins_);
        if (spins_.empty()) return;
        at_theta_ = begin;
        for (const FreeSpin& spin : spins_)
            for (std::int32_t i = 0; i < 3; ++i) {
                const auto k = static_cast<std::size_t>(i), column = static_cast<std::size_t>(spin.column + i);
                guess_[spin.column + i] = spin.speed[k];
                at_theta_.v[column] = (1.0 - theta_) * begin.v[column] + theta_ * spin.speed[k];
            }
        system_.free_spins(at_theta_, 0.0, theta_spins_);  // for the torques alone
    }

    /// H, D and the cones, which stay for the step.
    void assemble(const State& begin, double h, bool coulomb) {
        problem_.name = "step";
        problem_.law = Law::Associated;
        untouched_.clear();
        move(begin, h, Eigen::Map<const Vector>(begin.v.data(), n_), theta_, at_theta_);
        H_.begin(n_, n_);
        system_.add_mass(at_theta_, 1.0, H_);
        if (system_.has_stiffness()) {
            system_.add_damping(at_theta_, theta_ * h, Tangent::Symmetric, H_);
            system_.add_stiffness(at_theta_, theta_ * theta_ * h * h, Tangent::Symmetric, H_);
        }
        H_.finish_into(problem_.H);
        D_.begin(m_, n_);
        if (m_ > 0) system_.add_constraint_jacobian(at_theta_, 0, D_);
        D_.finish_into(problem_.D);
        problem_.b.assign(static_cast<std::size_t>(m_), 0.0);
        problem_.cones = cones_;
        solution_.lambda.assign(static_cast<std::size_t>(m_), 0.0);
        if (!multipliers_.empty())
            for (std::size_t i = 0; i < multipliers_.size(); ++i) solution_.lambda[i] = last_h_ * multipliers_[i];
        contacts_.collect(begin, h, theta_);
        contacts_.append_to(problem_, solution_.lambda, coulomb);
        untouched_.find(spins_, problem_.D, n_);
    }

    /// a and b for the guess; the impulse of its forces stays in force_.
    void linearize(const State& begin, double h, int iteration, double natural_error) {
        const Eigen::Map<const Vector> v(begin.v.data(), n_);
        move(begin, h, guess_, theta_, at_theta_);
        impulse_of_forces(h);
        const Vector back = v - guess_;
        problem_.a.assign(force_.begin(), force_.end());
        system_.multiply_mass(at_theta_, 1.0, back.data(), problem_.a.data());
        problem_.H.multiply_add(1.0, guess_.data(), problem_.a.data());
        if (m_ > 0) {
            move(begin, h, guess_, 1.0, end_);
            end_.v.assign(guess_.begin(), guess_.end());
            rate_.resize(m_);
            system_.constraint_rate(end_, rate_.data());
            D_.begin(m_, n_);
            system_.add_constraint_jacobian(end_, 0, D_);
            D_.finish().multiply_add(1.0, guess_.data(), rate_.data());
            for (std::int32_t row = 0; row < m_; ++row)
                problem_.b[static_cast<std::size_t>(row)] = rate_[row] - times(row, guess_);
        }
        contacts_.set_b(problem_, {guess_.data(), static_cast<std::size_t>(n_)}, iteration, natural_error);
    }

    /// force_ ← h f at at_theta_, where spinning bodies have their own impulse instead of what they feel alone.
    void impulse_of_forces(double h) {
        force_.setZero(n_);
        system_.add_force(at_theta_, h, force_.data());
        for (std::size_t k = 0; k < spins_.size(); ++k)
            for (std::size_t i = 0; i < 3; ++i)
                force_[spins_[k].column + static_cast<std::int32_t>(i)] +=
                    spins_[k].impulse[i] - h * theta_spins_[k].torque[i];
    }

    /// D x in a row of the problem.
    [[nodiscard]] double times(std::int32_t row, const Vector& x) const {
        const auto& D = problem_.D;
        double sum = 0.0;
        for (auto e = D.row_start[static_cast<std::size_t>(row)]; e < D.row_start[static_cast<std::size_t>(row) + 1];
             ++e)
            sum += D.value[static_cast<std::size_t>(e)] * x[D.column[static_cast<std::size_t>(e)]];
        return sum;
    }

    // Right-hand sides in √mass · speed: a by the diagonal of H, b by that of D diag(H)⁻¹ Dᵀ.
    void scale() {
        const std::vector<double> diagonal = diagonal_of(problem_.H);
        diagonal_ = Eigen::Map<const Vector>(diagonal.data(), n_);
        row_scale_.setZero(problem_.m());
        const auto& D = problem_.D;
        for (std::int32_t j = 0; j < problem_.m(); ++j)
            for (auto e = D.row_start[static_cast<std::size_t>(j)]; e < D.row_start[static_cast<std::size_t>(j) + 1];
                 ++e) {
                const double value = D.value[static_cast<std::size_t>(e)];
                row_scale_[j] += value * value / diagonal_[D.column[static_cast<std::size_t>(e)]];
            }
    }

    /// Whether the right-hand sides differ from those of the last solve by a negligible share.
    [[nodiscard]] bool unchanged() const {
        double change = 0.0, size = 0.0;
        for (std::int32_t i = 0; i < n_; ++i) {
            const double a = problem_.a[static_cast<std::size_t>(i)],
                         difference = a - last_a_[static_cast<std::size_t>(i)];
            change += difference * difference / diagonal_[i];
            size += a * a / diagonal_[i];
        }
        for (std::int32_t j = 0; j < problem_.m(); ++j) {
            const double difference = problem_.b[static_cast<std::size_t>(j)] - last_b_[static_cast<std::size_t>(j)];
            if (row_scale_[j] > 0.0) change += difference * difference / row_scale_[j];
        }
        return change <= tolerance_ * tolerance_ * size;
    }

    void solve(const State& begin, double h, StepSolver& solver, StepReport& report) {
        scale();
        const bool before = report.solved;
        for (int iteration = 0;; ++iteration) {
            linearize(begin, h, iteration, solver.effort().worst_natural);
            if (iteration > 0 && (unchanged() || (iteration >= iterations_ && contacts_.settled()))) return;
            if (iteration == most_iterations) {
                report.solved = false;
                report.message = "the speeds of sliding contacts did not settle";
                return;
            }
            last_a_ = problem_.a;
            last_b_ = problem_.b;
            ++report.newton_iterations;
            report.solved = before;
            if (!solver.solve(problem_, solution_, true)) {
                report.solved = false;
                report.message = solver.effort().unsolved;
            }
            solved_from_ = guess_;
            solved_force_ = force_;
            guess_ = Eigen::Map<const Vector>(solution_.x.data(), n_);
            if (!guess_.allFinite() || !report.solved) return;
        }
    }

    // The linear model of the last problem had h f = h f̃ − (H − M) (v⁺ − ṽ⁺).
    void judge_linearization(const State& begin, double h, const Vector& result, StepReport& report) {
        move(begin, h, result, theta_, at_theta_);
        const Vector change = result - solved_from_;
        Vector linear = solved_force_;
        problem_.H.multiply_add(-1.0, change.data(), linear.data());
        system_.multiply_mass(at_theta_, 1.0, change.data(), linear.data());
        impulse_of_forces(h);
        const auto n = static_cast<std::size_t>(n_);
        report.linearization = linearization_.error(begin, end_, h, {force_.data(), n}, {linear.data(), n}, problem_.H);
        linearization_.judge(report.linearization, begin, h, "moreau_jean");
    }

    static constexpr int most_iterations = 50;

    DynamicalSystem& system_;
    double theta_;
    int iterations_;
    double tolerance_;
    VelocityContacts contacts_;
    Linearization linearization_;
    PositionProjection projection_;
    std::vector<Cone> cones_;
    std::int32_t n_, m_;
    double last_h_ = 0.0;
    MatrixAssembler H_, D_;
    Problem problem_;
    Solution solution_;
    State at_theta_, end_;
    std::vector<FreeSpin> spins_, theta_spins_;
    UntouchedSpins untouched_;
    Vector guess_, force_, rate_;        // ṽ⁺, h f̃ there, C_q ṽ⁺ + C_t at the end
    Vector solved_from_, solved_force_;  // ṽ⁺ and h f̃ of the last problem
    std::vector<double> last_a_, last_b_;
    Vector diagonal_, row_scale_;
};

std::vector<OptionInfo> options() {
    return {
        {.key = "theta",
         .type = DELASSUS_OPTION_REAL,
         .default_value = "0.5",
         .minimum = 0.5,
         .maximum = 1.0,
         .doc = "where in the step forces are taken; 1/2: order 2, no damping; above: order 1, damping"},
        {.key = "iterations",
         .type = DELASSUS_OPTION_INTEGER,
         .default_value = "2",
         .minimum = 1.0,
         .maximum = 50.0,
         .doc =
             "of Newton's method, each a problem: 2 give order 2 for all forces, 1 where none turns with the bodies"},
        {.key = "newton_tolerance",
         .type = DELASSUS_OPTION_REAL,
         .default_value = "1e-10",
         .minimum = 0.0,
         .maximum = 0.1,
         .doc = "no further iteration where it would change the right-hand sides by less than this share"},
        recovery_speed_option(),
        restitution_speed_option(),
        linearization_option()};
}

const RegisterTimestepper moreau_jean_row{
    {.name = "moreau_jean",
     .description = "Moreau and Jean's theta-method: order 2 between impacts, contacts on velocity level",
     .options = options(),
     .constraints = true,
     .unilateral = true,
     .order = 2,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>& values) -> std::unique_ptr<Timestepper> {
         return std::make_unique<MoreauJean>(system, values);
     }}};

}  // namespace
}  // namespace delassus
