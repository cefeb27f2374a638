// SPDX-License-Identifier: BSD-3-Clause
// The nonsmooth generalised-α method: impacts on velocity level, constraints and gaps on both levels. Order 2 between
// impacts, damping by ρ_∞.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "dynamics/contact_gain.hpp"
#include "dynamics/implicit_method.hpp"
#include "dynamics/position_projection.hpp"
#include "dynamics/velocity_contacts.hpp"

namespace delassus {
namespace {

// The motion of a step is split into a smooth part and what impulses add (Brüls, Acary and Cardona, CMAME 281, 2014),
// in three problems one after another (decoupled as by Cosimo, Galvez, Cavalieri, Cardona and Brüls, Multibody System
// Dynamics 48, 2020):
//
//     smooth     M ṽ' = f + C_qᵀ λ̃ + D_Aᵀ λ_A,   C(q̃) = 0    by the generalised-α method from (q, v): q̃, ṽ
//     velocity   H (v⁺ − ṽ) = C_qᵀ P_C + D_Aᵀ (P_A − h λ_A),  C_q v⁺ + C_t = 0,  D_A v⁺ + b ∈ Υ* ⊥ P_A ∈ Υ
//     position   q⁺ = q̃ ∘ exp(½ h (v⁺ − ṽ) + s) ∘ exp(x),     C = 0,  g ≥ 0
//
// The smooth part is integrators/generalized_alpha.cpp; its accelerations are remembered, impacts do not enter them.
// λ_A are the reactions of the last step that pushed steadily: so the smooth part knows, to O(h), what holds a resting
// or a sliding body, the velocity v⁺ − ṽ of a smooth motion is O(h²), and forces that depend on v are of order 2 too.
// (The papers take the reactions of active contacts as unknowns of the smooth part; Capobianco, Harsch, Eugster and
// Leine, IJNME 122, 2021, those of all.) P_A is the whole impulse of contacts, in the cone; what λ_A was too much is
// taken back.
//
// The law of contacts on the level of velocities, and where D_A is taken, is that of dynamics/velocity_contacts.cpp
// with θ = ½, x that of its PositionProjection. H = M + ½ h R + ¼ h² K has what forces change by ½ h (v⁺ − ṽ) and v⁺ −
// ṽ at the end of the step.
class NonsmoothGeneralizedAlpha : public Timestepper {
public:
    NonsmoothGeneralizedAlpha(DynamicalSystem& system, const ImplicitCoefficients& coefficients,
                              NewtonSettings settings, VelocityContactSettings contacts)
        : system_(system),
          c_(coefficients),
          smooth_(system, coefficients, std::move(settings)),
          contacts_(system, contacts),
          energy_(system),
          projection_(system),
          cones_(free_cones(system)),
          bodies_(system.bodies_of_columns()),
          n_(system.n()),
          m_(system.m()) {
        for (Vector& load : loads_) load.setZero(n_);
    }

    [[nodiscard]] int order() const override { return smooth_.order(); }
    [[nodiscard]] double reaction_growth() const override { return smooth_.reaction_growth(); }
    void restart() override {
        smooth_.restart();
        contacts_.restart();
        for (Vector& load : loads_) load.setZero(n_);
    }
    void forces_jumped() override { smooth_.restart(); }

    // How long the memory of the smooth part is, this memory, the loads, and the impulses of unilateral blocks.
    std::vector<double> save() const override {
        const std::vector<double> smooth = smooth_.save();
        std::vector<double> memory = {static_cast<double>(smooth.size())};
        memory.insert(memory.end(), smooth.begin(), smooth.end());
        for (const Vector& load : loads_) memory.insert(memory.end(), load.begin(), load.end());
        contacts_.kept().append_to(memory);
        return memory;
    }
    void load(const std::vector<double>& memory) override {
        restart();
        const auto short_of = [](std::size_t has, double needs) {
            if (static_cast<double>(has) < needs)
                throw InputError("the memory of nonsmooth_generalized_alpha is too short");
        };
        short_of(memory.size(), 1.0);
        auto rest = std::span<const double>(memory).subspan(1);
        short_of(rest.size(), memory[0]);
        const auto length = static_cast<std::size_t>(memory[0]);
        smooth_.load({rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(length)});
        rest = rest.subspan(length);
        for (Vector& load : loads_) {
            short_of(rest.size(), n_);
            load = Eigen::Map<const Vector>(rest.data(), n_);
            rest = rest.subspan(static_cast<std::size_t>(n_));
        }
        KeptImpulses impulses;
        impulses.load(rest);
        contacts_.keep(std::move(impulses));
    }

private:
    static constexpr const char* name = "nonsmooth_generalized_alpha";
    static constexpr int most_iterations = 50;

    void take_step(State& state, double h, StepSolver& solver, StepReport& report) override {
        require_step(system_, state, h, name);
        end_ = state;
        auto& [load, last, mean] = loads_;
        smooth_.set_load(load);
        smooth_.step(end_, h, solver, report);
        const Vector next = ((1.0 - c_.alpha_f) * load + c_.alpha_f * last - c_.alpha_m * mean) / (1.0 - c_.alpha_m);
        impulse_ = h * (c_.velocity_old * mean + c_.velocity_new * next);
        shift_ = 0.5 * h * impulse_ - h * h * (c_.position_old * mean + c_.position_new * next);
        last = load;
        mean = next;
        contacts_.collect(state, h, 0.5, 1.0);
        if (contacts_.any() || !impulse_.isZero(0.0)) {
            solve(state, h, solver, report);
            move(h, solver, report);
            require_finite(state, end_, h, name);
            projection_.project(state, end_, h, problem_, {}, contacts_, solver, report, name);
        }
        keep(h, report);
        state = end_;
    }

    /// The problem on the level of velocities; end_ is the end of the smooth part.
    void assemble(double h, bool coulomb) {
        problem_.name = "velocity";
        problem_.law = Law::Associated;
        H_.begin(n_, n_);
        system_.add_mass(end_, 1.0, H_);
        if (system_.has_stiffness()) {
            system_.add_damping(end_, 0.5 * h, Tangent::Symmetric, H_);
            system_.add_stiffness(end_, 0.25 * h * h, Tangent::Symmetric, H_);
        }
        H_.finish_into(problem_.H);
        problem_.a.assign(static_cast<std::size_t>(n_), 0.0);
        problem_.H.multiply_add(1.0, end_.v.data(), problem_.a.data());
        for (std::int32_t i = 0; i < n_; ++i) problem_.a[static_cast<std::size_t>(i)] -= impulse_[i];
        D_.begin(m_, n_);
        problem_.b.assign(static_cast<std::size_t>(m_), 0.0);
        if (m_ > 0) {
            system_.add_constraint_jacobian(end_, 0, D_);
            system_.constraint_rate(end_, problem_.b.data());
        }
        D_.finish_into(problem_.D);
        problem_.cones = cones_;
        solution_.x = end_.v;
        solution_.lambda.assign(static_cast<std::size_t>(m_), 0.0);
        contacts_.append_to(problem_, solution_.lambda, coulomb);
    }

    /// With as much restitution as gains no energy; contacts_ begins with all of it.
    void solve(const State& begin, double h, StepSolver& solver, StepReport& report) {
        const bool coulomb = solver.law() == Law::Coulomb, before = report.solved;
        const auto solve_with = [&](double restitution) {
            report.solved = before;
            if (restitution < 1.0) contacts_.collect(begin, h, 0.5, restitution);
            assemble(h, coulomb);
            settle(solver, report);
            mean_.resize(begin.v.size());
            for (std::size_t i = 0; i < mean_.size(); ++i) mean_[i] = 0.5 * (begin.v[i] + solution_.x[i]);
            return energy_.with(contacts_.work(problem_, solution_, mean_), end_, begin.v, solution_.x, problem_);
        };
        solve_without_gain(solve_with);
        contacts_.drop_negligible(problem_, solution_);
    }

    /// Until De Saxcé's terms have settled, and once more for the turns of the rows.
    void settle(StepSolver& solver, StepReport& report) {
        const bool before = report.solved;
        const int least = contacts_.any() ? 2 : 1;
        for (int iteration = 0;; ++iteration) {
            contacts_.set_b(problem_, solution_, solution_.x, iteration, report.natural);
            if (iteration >= least && contacts_.settled()) break;
            if (iteration == most_iterations) {
                report.solved = false;
                report.message = "the speeds of sliding contacts did not settle";
                break;
            }
            ++report.newton_iterations;
            report.solved = before;
            if (!report.take(solver.solve(problem_, solution_, {.warm_start = true, .bodies = bodies_}))) break;
        }
    }

    /// end_ ← with what impulses add.
    void move(double h, StepSolver& solver, StepReport& report) {
        delta_.assign(static_cast<std::size_t>(n_), 0.0);
        if (!shift_.isZero(0.0)) {
            shift_problem_.name = "shift";
            shift_problem_.H = problem_.H;
            shift_problem_.D = SparseMatrix::zero(0, n_);
            shift_problem_.a.assign(shift_.begin(), shift_.end());
            shift_solution_.x.assign(static_cast<std::size_t>(n_), 0.0);
            shift_solution_.lambda.clear();
            report.take(solver.solve(shift_problem_, shift_solution_));
            delta_ = shift_solution_.x;
        }
        for (std::size_t i = 0; i < delta_.size(); ++i) delta_[i] += 0.5 * h * (solution_.x[i] - end_.v[i]);
        system_.increment(end_.q.data(), delta_.data(), end_.q.data());
        end_.v = solution_.x;
    }

    // The reactions of joints are those of the smooth part at the end of the step, and while contacts push also what
    // the impulses of the step need, as a mean.
    void keep(double h, StepReport& report) {
        Vector& load = loads_[0];
        load.setZero(n_);
        if (!contacts_.any()) {
            contacts_.restart();
            return;
        }
        contacts_.add_steady_impulse(problem_, solution_.lambda, load.data());
        load /= h;
        contacts_.finish(problem_, solution_, report);
        if (report.active_blocks > 0)
            for (std::size_t i = 0; i < report.multipliers.size(); ++i)
                report.multipliers[i] += solution_.lambda[i] / h;
    }

    DynamicalSystem& system_;
    ImplicitCoefficients c_;
    ImplicitMethod smooth_;
    VelocityContacts contacts_;
    EnergyOfStep energy_;
    PositionProjection projection_;
    std::vector<Cone> cones_;
    std::vector<std::int32_t> bodies_;  // by column
    std::int32_t n_, m_;
    // D_Aᵀ λ_A of the step to come and of the last one, and A as a force; n.
    std::array<Vector, 3> loads_;
    Vector impulse_, shift_;  // I and H s of the step
    Problem shift_problem_;
    Solution shift_solution_;
    MatrixAssembler H_, D_;
    Problem problem_;
    Solution solution_;
    State end_;
    std::vector<double> delta_, mean_;
};

std::vector<OptionInfo> nonsmooth_options() {
    return newton_options({recovery_speed_option(),
                           restitution_speed_option(),
                           {.key = "rho_infinity",
                            .type = DELASSUS_OPTION_REAL,
                            .default_value = "0.8",
                            .minimum = 0.0,
                            .maximum = 1.0,
                            .doc = "factor of the highest frequencies in a step; 0: gone at once, 1: no damping"}});
}

const RegisterTimestepper nonsmooth_generalized_alpha_row{
    {.name = "nonsmooth_generalized_alpha",
     .description = "generalised-alpha with impacts on velocity level; gaps and constraints on both levels",
     .options = nonsmooth_options(),
     .constraints = true,
     .unilateral = true,
     .order = 2,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>& values) -> std::unique_ptr<Timestepper> {
         return std::make_unique<NonsmoothGeneralizedAlpha>(
             system, ImplicitCoefficients::generalized_alpha(values[newton_option_count + 2].real),
             newton_settings("nonsmooth_generalized_alpha", values),
             velocity_contact_settings(system, values[newton_option_count], values[newton_option_count + 1]));
     }}};

}  // namespace
}  // namespace delassus
