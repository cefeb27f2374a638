// SPDX-License-Identifier: BSD-3-Clause
// The linearised implicit Euler method for differential variational inequalities (seed eq. 123, 148): one linear or
// cone problem a step, contacts and impacts included. Order 1.
#include <algorithm>
#include <cmath>
#include <utility>

#include "delassus/timestepper.hpp"
#include "dynamics/contact_gain.hpp"
#include "dynamics/gap_resolution.hpp"
#include "dynamics/kept_impulses.hpp"
#include "dynamics/linear_problem.hpp"
#include "dynamics/linearization.hpp"
#include "dynamics/step_memory.hpp"
#include "dynamics/turning_spins.hpp"
#include "dynamics/velocity_contacts.hpp"
#include "dynamics/velocity_error.hpp"
#include "problem/copy_cone.hpp"

namespace delassus {
namespace {

// With f taken at the end of the step to first order, f(q⁺, v⁺, t⁺) ≈ f(q, v, t⁺) − K h v⁺ − R (v⁺ − v), the balance
// M (v⁺ − v) = h f + C_qᵀ λ over a step of size h, λ being impulses, becomes
//
//     (M + h R + h² K) v⁺ − Dᵀ λ = (M + h R) v + h f(q, v, t⁺)
//
// The method is consistent for any R and K, so their symmetric parts suffice. The reactions turn with the bodies as
// well. With the reactions of the last step, λ₀ as forces, C_q(q⁺)ᵀ λ ≈ C_qᵀ λ − G h v⁺ with G = −∂(C_qᵀ λ₀)/∂q, and so
// H also has h² G. G holds a light body across a heavy pull: a link of a chain with the moment of inertia J, under the
// pull P at the arm l, swings at √(P l/J), and without G this would be an explicit step, unstable from h √(P l/J) ≈ 1
// on. H takes only that part of G that an explicit step could not bear and that keeps H definite for every solver. The
// rest is of the order of the method's own error.
//
// The gyroscopic torque is not taken from f: a body that spins by itself is turned by the midpoint rule, which keeps
// its energy and its momentum (DynamicalSystem::free_spins), and its impulse J (ω⁺ − ω) stands on the right-hand side.
// A body that no row of the step acts on also turns by the rule's angle, θ + h (v⁺ − ω⁺) in place of h v⁺.
//
// Constraints at the end of the step, again to first order, C(q⁺, t⁺) ≈ C(q, t⁺) + h C_q v⁺ = 0, divided by h, are rows
// with b = C(q, t⁺)/h. A gap Φ ≥ 0 likewise:
//
//     u = D v⁺ + Φ/h + Φ_t ≥ 0,      recovering a penetration (Φ < 0) with at most the speed η_s (seed footnote 5)
//
// and |Φ| taken less by the resolution of gaps (dynamics/gap_resolution.hpp).
//
// Rows with a compliance c (of a servo with limits) have u = D v⁺ + Φ_t + c λ/h, λ/h being the force: E = c/h.
//
// A joint's C/h needs no such bound: it pulls both ways, and gains nothing.
//
// Newton's law of impact: where a contact would close in this step, u_n⁺ ≥ −e u_n⁻, that is b = e u_n⁻. The associated
// law asks for u_n + b ≥ μ |u_t| where Coulomb's has u_n + b ≥ 0: a contact would act, and slow the approach, before it
// closes; it would push apart what leaves; and a body that slides after the impact would leave faster than e u_n⁻. So
// contacts with e > 0 take De Saxcé's term s = μ |u_t| into b, by which both laws agree: with the speed before the
// step, or where they close with the speed after it, by the iteration s ← μ |u_t⁺(s)|, until s moves by less than 10⁻⁴
// of the speed of the approach. Contacts with e = 0 keep the associated law, under which a sliding one floats at the
// height h μ |u_t|. Where steps are chosen by their error that height would jump with h: all contacts that pushed then
// take s of the speed after the step, to 10⁻⁶ of the speed that they slide with. Where bounces with friction gain
// energy, the step is solved again with less restitution (dynamics/contact_gain.hpp).
//
// How far f(q⁺, v⁺, t⁺) is from the linear model is measured after the step (dynamics/linearization.hpp).
class EulerImplicitLinearized : public Timestepper {
public:
    EulerImplicitLinearized(DynamicalSystem& system, const std::vector<OptionValue>& values)
        : system_(system),
          recovery_speed_(values[0].real < 0.0 ? system.recovery_speed() : values[0].real),
          restitution_speed_(values[1].real),
          resolution_(system),
          energy_(system),
          exact_(values[2].text == "exact" && !system.has_unilateral()),
          constraint_stiffness_(values[3].text == "definite"),
          linearization_(system, values[4].real),
          blocks_(system.constraint_blocks()),
          bodies_(system.bodies_of_columns()),
          n_(system.n()),
          m_(system.m()) {
        delta_.resize(static_cast<std::size_t>(n_));
    }

    [[nodiscard]] int order() const override { return 1; }
    [[nodiscard]] bool damps_at_once() const override { return true; }
    [[nodiscard]] bool estimates_error() const override { return true; }
    void choose_steps(double /*tolerance*/) override { follows_sliding_ = true; }
    void restart() override {
        multipliers_.clear();
        kept_.clear();
        last_h_ = 0.0;
        velocity_error_.forget();
        resolution_.forget();
        left_.clear();
    }
    void forces_jumped() override { velocity_error_.forget(); }

    // h; the errors of the last steps' velocities and the errors that solves left; the multipliers.
    StepMemory memory() const override {
        StepMemory memory;
        memory.numbers = {last_h_};
        memory.numbers.insert(memory.numbers.end(), velocity_error_.sizes().begin(), velocity_error_.sizes().end());
        for (auto& values : velocity_error_.save()) memory.of_columns.push_back(std::move(values));
        memory.of_columns.push_back(resolution_.left());
        memory.of_columns.push_back(left_);
        memory.of_rows = {multipliers_};
        memory.impulses = kept_;
        return memory;
    }
    void set_memory(StepMemory&& memory) override {
        restart();
        last_h_ = memory.numbers.at(0);
        velocity_error_.load(std::span(memory.of_columns).first(velocity_error_.kept()),
                             std::span(memory.numbers).subspan(1));
        resolution_.load(std::move(memory.of_columns.at(velocity_error_.kept())));
        left_ = std::move(memory.of_columns.at(velocity_error_.kept() + 1));
        multipliers_ = std::move(memory.of_rows.at(0));
        kept_ = std::move(memory.impulses);
    }
    std::vector<double> save() const override { return flat(memory()); }
    void load(const std::vector<double>& memory) override {
        set_memory(unflattened(memory, this->memory(), static_cast<std::size_t>(n_), static_cast<std::size_t>(m_),
                               "euler_implicit_linearized"));
    }

private:
    void take_step(State& state, double h, StepSolver& solver, StepReport& report) override {
        require_step(system_, state, h, "euler_implicit_linearized");
        problem_.name = "step";
        problem_.law = Law::Associated;
        end_ = state;  // the old q and v at the new time
        end_.t = state.t + h;
        rows_.clear();
        rows_.measure_speeds_at(state.v.data());
        rows_.team = solver.team();
        if (system_.has_unilateral()) system_.collect_unilateral(state, h, rows_);
        assemble_balance(state, h);
        assemble_constraints(h);
        coulomb_ = solver.law() == Law::Coulomb;
        assemble_unilateral(state, h);

        const StepRequest request{.warm_start = true,
                                  .method_error = note_velocity_error(state, h),
                                  .error_of_solves = velocity_error_.of_solver(),
                                  .bodies = bodies_};
        turning_spins_.find(spins_, problem_.D, problem_.D.rows);
        report.unilateral_blocks = static_cast<std::int32_t>(rows_.blocks().size());
        solution_.x = state.v;
        double scale = 0.0;
        for (const double momentum : problem_.a) scale = std::max(scale, std::abs(momentum));
        scale = solver.largest_on_all(scale);
        note_left(solve(state, h, solver, request, report));
        drop_negligible(scale);
        for (std::int32_t i = 0; i < n_; ++i) delta_[i] = h * solution_.x[i];
        for (const FreeSpin* spin : turning_spins_)
            for (std::int32_t i = 0; i < 3; ++i) delta_[spin->column + i] += spin->turn[i] - h * spin->speed[i];
        system_.increment(state.q.data(), delta_.data(), end_.q.data());
        end_.v = solution_.x;
        require_finite(state, end_, h, "euler_implicit_linearized");
        report_position_error(state, h, report);
        if (linearization_.wanted()) judge_linearization(state, h, solver, report);
        report_reactions(solution_.lambda, h, report);
        keep(solution_.lambda, h);
        report.contacts.swap(rows_.contacts());
        state = end_;
        report.multipliers = multipliers_;
    }

    // A step errs in positions by ½ h² q̈ (Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, sec.
    // II.1).
    void report_position_error(const State& begin, double h, StepReport& report) const {
        report.error.resize(static_cast<std::size_t>(n_));
        for (std::size_t i = 0; i < report.error.size(); ++i)
            report.error[i] = 0.5 * h * std::abs(end_.v[i] - begin.v[i]);
    }

    // Of steps of chosen sizes nothing is said: there the solver must not disturb the estimate of their error.
    std::span<const double> note_velocity_error(const State& state, double h) {
        velocity_error_.note(state.v, left_, last_h_, h);
        return follows_sliding_ ? std::span<const double>() : velocity_error_.known();
    }

    void note_left(const StepAnswer& answer) {
        left_.assign(answer.left_in_masses.begin(), answer.left_in_masses.end());
        resolution_.note(answer.left);
    }

    StepAnswer solve(const State& begin, double h, StepSolver& solver, const StepRequest& request, StepReport& report) {
        const bool before = report.solved;
        StepAnswer answer;
        const auto solve_with = [&](double restitution) {
            if (restitution < 1.0) take_restitution(restitution, h);
            report.solved = before;
            answer = settle(solver, request, report);
            const double work = solver.largest_on_all(work_of_bounces(begin));
            ContactWork of_all = energy_.with(work, begin, begin.v, solution_.x, problem_);
            of_all.kinetic = solver.largest_on_all(of_all.kinetic);  // all processes decide alike
            return of_all;
        };
        solve_without_gain(solve_with);
        return answer;
    }

    /// Gives what bounces that share of its restitution.
    void take_restitution(double share, double h) {
        for (const Bounce& bounce : bounces_) {
            const auto& row = rows_.rows()[bounce.row - static_cast<std::size_t>(m_)];
            double& b = problem_.b[bounce.row];
            b = row.rate + (share > 0.0 ? share * bounce.speed : std::max(row.gap, 0.0) / h);
            for (Sliding& contact : sliding_)
                if (contact.row == bounce.row) {
                    contact.offset = b;
                    contact.term = 0.0;
                }
        }
    }

    /// What they do in the step as it is solved.
    [[nodiscard]] double work_of_bounces(const State& begin) {
        if (bounces_.empty()) return 0.0;
        for (std::int32_t i = 0; i < n_; ++i) delta_[i] = 0.5 * (begin.v[i] + solution_.x[i]);
        double work = 0.0;
        for (const Bounce& bounce : bounces_)
            for (std::size_t row = bounce.row; row < bounce.row + bounce.rows; ++row)
                work += solution_.lambda[row] * (problem_.D.row_times(static_cast<std::int32_t>(row), delta_.data()) +
                                                 rows_.rows()[row - static_cast<std::size_t>(m_)].rate);
        return work;
    }

    // H and a are looked at once more where the linearisation is judged, contacts slide or bounce; else the problem
    // changes hands.
    StepAnswer settle(StepSolver& solver, const StepRequest& request, StepReport& report) {
        const bool again = !solver.on_all(!linearization_.wanted() && sliding_.empty() && bounces_.empty());
        StepAnswer answer;
        const auto once = [&] {
            ++report.newton_iterations;
            answer = again ? solver.solve(problem_, solution_, request)
                           : solver.solve(std::move(problem_), solution_, request);
            return report.take(answer);
        };
        if (!once()) return answer;
        for (int i = 0; !solver.on_all(settled(i)); ++i) {
            if (i == most_iterations) {
                report.solved = false;
                report.message = "the speeds of sliding contacts did not settle";
                return answer;
            }
            if (!once()) return answer;
        }
        return answer;
    }

    /// The sliding speed in the rows of a contact, at the velocities v.
    [[nodiscard]] double sliding_speed(std::size_t first_row, const std::vector<double>& v) const {
        double squares = 0.0;
        for (std::size_t row = first_row + 1; row < first_row + 3; ++row) {
            double speed = rows_.rows()[row - static_cast<std::size_t>(m_)].rate;
            for (auto e = problem_.D.row_start[row]; e < problem_.D.row_start[row + 1]; ++e)
                speed += problem_.D.value[e] * v[problem_.D.column[e]];
            squares += speed * speed;
        }
        return std::sqrt(squares);
    }

    /// Brings De Saxcé's terms to the speeds of the solution; whether they stood there already.
    bool settled(int iteration) {
        bool all = true;
        double rounding = 0.0;
        for (const double speed : solution_.x) rounding = std::max(rounding, 1e-7 * std::abs(speed));
        for (Sliding& contact : sliding_) {
            const double wanted = contact.friction * sliding_speed(contact.row, solution_.x);
            const double change = wanted - contact.term;
            if (std::abs(change) <= std::max(contact.enough, rounding)) continue;
            all = false;
            contact.term += iteration < 5 ? change : 0.5 * change;
            problem_.b[contact.row] = contact.offset + contact.term;
        }
        return all;
    }

    /// A contact whose De Saxcé's term is that of the speed after the step.
    struct Sliding {
        std::size_t row;  ///< its normal row in the problem
        double friction;
        double enough;  ///< change of the term that is small enough
        double offset;  ///< b without the term
        double term;
    };
    static constexpr int most_iterations = 50;

    /// A contact with friction that closes with restitution.
    struct Bounce {
        std::size_t row, rows;  ///< its first row in the problem, and how many
        double speed;           ///< e u_n⁻ < 0
    };

    // An interior point leaves impulses above 0 where nothing pushes. Below what the solver resolves beside the momenta
    // of the step they are none: whether a contact pushed decides what counts as an impact.
    void drop_negligible(double scale) {
        constexpr double share = 1e-9;
        for (std::size_t k = 0; k < first_row_.size(); ++k) {
            if (!approaches_[k].along_normal) continue;
            double* impulse = solution_.lambda.data() + m_ + first_row_[k];
            if (impulse[0] <= share * scale) std::fill_n(impulse, rows_.blocks()[k].cone.rows, 0.0);
        }
    }

    /// What decides whether a unilateral block had an impact in this step.
    struct Approach {
        double gap, speed;  ///< gap ≥ 0; the speed of closing
        bool along_normal, pushed_before;
    };

    /// The normal row of a unilateral block that penetrates.
    struct Penetrating {
        std::size_t block;  ///< its number
        double rate;        ///< of the row
        double recovery;    ///< the speed with which it is pushed apart
        std::size_t end;    ///< of its entries, which begin where those of the one before end
    };

    void assemble_balance(const State& state, double h) {
        const Tangent tangent = exact_ ? Tangent::Exact : Tangent::Symmetric;
        H_.begin(n_, n_);
        system_.add_mass(state, 1.0, H_);
        problem_.a.assign(static_cast<std::size_t>(n_), 0.0);
        system_.multiply_mass(state, 1.0, state.v.data(), problem_.a.data());
        system_.add_force(end_, h, problem_.a.data());
        system_.free_spins(end_, h, spins_);
        for (const FreeSpin& spin : spins_)
            for (std::int32_t i = 0; i < 3; ++i) problem_.a[spin.column + i] += spin.impulse[i] - h * spin.torque[i];
        if (system_.has_stiffness()) {
            R_.begin(n_, n_);
            system_.add_damping(end_, h, tangent, R_);
            const SparseMatrix& R = R_.finish();
            R.multiply_add(1.0, state.v.data(), problem_.a.data());
            H_.add_matrix(R);
            system_.add_stiffness(end_, h * h, tangent, H_);
        }
        G_.begin(n_, n_);
        if (constraint_stiffness_ && !multipliers_.empty())
            system_.add_definite_constraint_stiffness(end_, multipliers_.data(), h * h, G_);
        H_.add_matrix(G_.finish());
        H_.finish_into(problem_.H);
    }

    // The impulse of the forces as the linear model has them, h f − h² K v⁺ − h R (v⁺ − v), is a + M (v⁺ − v) − M v⁺
    // less what else stands in H v⁺: a − H v⁺ + h² G v⁺ + M (v⁺ − v), with a and H as they were assembled.
    void judge_linearization(const State& begin, double h, StepSolver& solver, StepReport& report) {
        for (std::int32_t i = 0; i < n_; ++i) delta_[i] = end_.v[i] - begin.v[i];
        force_.assign(static_cast<std::size_t>(n_), 0.0);
        problem_.H.multiply_add(1.0, end_.v.data(), force_.data());
        G_.finish().multiply_add(-1.0, end_.v.data(), force_.data());
        impulse_.resize(static_cast<std::size_t>(n_));
        for (std::int32_t i = 0; i < n_; ++i) impulse_[i] = problem_.a[i] - force_[i];
        system_.multiply_mass(begin, 1.0, delta_.data(), impulse_.data());
        report.energy.damped = damped(begin);
        force_.assign(static_cast<std::size_t>(n_), 0.0);
        system_.add_force(end_, h, force_.data());
        if (!spins_.empty()) {  // their torques count for nothing here: they are not part of the linear model
            system_.free_spins(end_, 0.0, end_spins_);  // for the torques at the end alone
            for (std::size_t k = 0; k < spins_.size(); ++k)
                for (std::int32_t i = 0; i < 3; ++i)
                    force_[spins_[k].column + i] += spins_[k].impulse[i] - h * end_spins_[k].torque[i];
        }
        linearization_.judge(begin, end_, h, force_, impulse_, problem_.H, "euler_implicit_linearized", solver, report);
    }

    // Along the way h v⁺ the forces f at its end do the work h f · v⁺, and their potential changes by −h f · v⁺ −
    // ½ h² v⁺ · K v⁺. Kinetic energy changes by the work of the impulses at the mean speed, ½ (v + v⁺). So the method
    // takes
    //
    //     ½ (v⁺ − v) · h f + ½ h² v⁺ · K v⁺
    //
    // of the energy, beside what contacts, joints and dampers do. A fall from rest loses by the first what the landing
    // gives back. force_: (M + h R + h² K) v⁺; impulse_: of f; delta_: v⁺ − v.
    double damped(const State& begin) {
        const std::vector<double>& v = end_.v;
        system_.multiply_mass(begin, -1.0, v.data(), force_.data());
        if (system_.has_stiffness()) R_.finish().multiply_add(-1.0, v.data(), force_.data());
        double twice = 0.0;
        for (std::int32_t i = 0; i < n_; ++i) twice += delta_[i] * impulse_[i] + v[i] * force_[i];
        return 0.5 * twice;
    }

    // D takes its arrays from the unilateral rows where there are no others.
    void assemble_constraints(double h) {
        problem_.D.rows = 0;
        problem_.D.columns = n_;
        problem_.b.resize(static_cast<std::size_t>(m_) + rows_.rows().size());
        if (m_ == 0) return;
        D_.begin(m_, n_);
        system_.add_constraint_jacobian(end_, 0, D_);
        system_.constraint(end_, problem_.b.data());
        for (std::int32_t i = 0; i < m_; ++i) problem_.b[i] /= h;
        D_.finish_into(problem_.D);
    }

    /// Of the gap of a contact whose row of the problem this is.
    [[nodiscard]] double gap_resolution(std::int32_t row, double h) const {
        const auto first = problem_.D.row_start[row], last = problem_.D.row_start[row + 1];
        return resolution_.of(std::span(problem_.D.column)
                                  .subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(last - first)),
                              h);
    }

    // One walk over the blocks collects their cones, b, their impulses of the last step as a start, and what is needed
    // of them after the solve.
    void assemble_unilateral(const State& state, double h) {
        rows_.move_into(problem_.D);
        problem_.cones.resize(blocks_.size() + rows_.blocks().size());
        for (std::size_t k = 0; k < blocks_.size(); ++k) copy_cone(Cone::free(blocks_[k]), problem_.cones[k]);
        auto& lambda = solution_.lambda;
        lambda.resize(problem_.b.size());
        for (std::int32_t i = 0; i < m_; ++i) lambda[i] = multipliers_.empty() ? 0.0 : last_h_ * multipliers_[i];
        first_row_.clear();
        approaches_.clear();
        compliances_.clear();
        penetrating_.clear();
        penetrating_column_.clear();
        penetrating_value_.clear();
        sliding_.clear();
        bounces_.clear();
        std::int32_t row = 0;
        Cone* cone = problem_.cones.data() + blocks_.size();
        kept_.begin_walk();
        const std::size_t first_contact = rows_.blocks().size() - rows_.contacts().size();
        for (std::size_t k = 0; k < rows_.blocks().size(); ++k) {
            const auto& block = rows_.blocks()[k];
            const auto rows = static_cast<std::size_t>(block.cone.rows);
            copy_cone(block.cone, *cone);
            for (auto* bounds : {&cone->lo, &cone->hi})
                for (double& bound : *bounds) bound *= h;
            ++cone;
            const ContactPoint* contact = k < first_contact ? nullptr : &rows_.contacts()[k - first_contact];
            const bool pushed = kept_.start(block, contact, {lambda.data() + m_ + row, rows}).pushed;
            for (std::int32_t i = 0; i < block.cone.rows; ++i) {
                const double gap = rows_.rows()[row + i].gap, rate = rows_.rows()[row + i].rate;
                const double resolution = contact && i == 0 ? gap_resolution(m_ + row, h) : resolution_.least();
                const double resolved = gap - std::clamp(gap, -resolution, resolution);
                problem_.b[m_ + row + i] = rate + std::max(resolved / h, -recovery_speed_);
            }
            if (block.along_normal()) {
                if (block.restitution > 0.0 || follows_sliding_) bounce(block, row, pushed, state, h);
                if (const double gap = rows_.rows()[row].gap; gap < 0.0)
                    keep_penetrating(k, row, std::min(-gap / h, recovery_speed_));
            }
            compliances_.push_back(block.compliance / h);
            first_row_.push_back(row);
            approaches_.push_back({std::max(rows_.rows()[row].gap, 0.0), -block.speed, block.along_normal(), pushed});
            row += block.cone.rows;
        }
        set_compliance(problem_, rows_.blocks(), compliances_);
    }

    /// Restitution and De Saxcé's term in the first b of a contact, whose first row of D_A is `row`.
    void bounce(const UnilateralRows::Block& block, std::int32_t row, bool pushed, const State& state, double h) {
        const double gap = rows_.rows()[row].gap, rate = rows_.rows()[row].rate;
        double& b = problem_.b[m_ + row];
        const bool closes =
            block.restitution > 0.0 && block.speed < -restitution_speed_ && gap + h * block.speed <= 0.0;
        const double bounce = block.restitution * block.speed, friction = block.cone.parameters[0];
        const auto normal_row = static_cast<std::size_t>(m_) + static_cast<std::size_t>(row);
        if (closes && friction > 0.0)
            bounces_.push_back({normal_row, static_cast<std::size_t>(block.cone.rows), bounce});
        if (closes) b = rate + bounce;
        if (coulomb_ || friction == 0.0 || block.cone.rows != 3) return;
        if (closes) {
            sliding_.push_back({normal_row, friction, 1e-4 * -block.speed, b, 0.0});
        } else if (pushed && follows_sliding_) {
            const double speed = sliding_speed(normal_row, state.v);
            sliding_.push_back({normal_row, friction, 1e-6 * speed, b, friction * speed});
            b += sliding_.back().term;
        } else {
            b += friction * sliding_speed(normal_row, state.v);
        }
    }

    // Impacts: a contact with the gap Φ > 0 that pushes would otherwise have closed within the step, with a mean speed
    // of at least Φ/h even if its first speed was less. A contact that opened and comes back within the step (a ball
    // that bounces low) closes about as fast. A penetrating contact that pushes apart with the speed u supplies the
    // energy λ_n u at most, and the recovery explains no speed beyond its own.
    void report_reactions(const std::vector<double>& lambda, double h, StepReport& report) const {
        for (std::size_t k = 0; k < first_row_.size(); ++k) {
            const std::int32_t first = first_row_[k], rows = rows_.blocks()[k].cone.rows;
            const double reaction = lambda[m_ + first];
            const auto& [gap, approach, along_normal, pushed_before] = approaches_[k];
            BlockReaction& acted = report.reactions.emplace_back();
            acted.key = rows_.blocks()[k].key;
            for (std::int32_t i = 0; i < std::min(rows, 3); ++i) acted.force[i] = lambda[m_ + first + i] / h;
            if (reaction != 0.0) ++report.active_blocks;
            if (!along_normal || !(reaction > 0.0)) continue;
            note_impact(rows_.blocks()[k], gap, approach, pushed_before, h, restitution_speed_, report);
        }
        std::size_t entry = 0;
        for (const auto& [block, rate, recovery, end] : penetrating_) {
            double speed = rate;
            for (; entry < end; ++entry) speed += penetrating_value_[entry] * end_.v[penetrating_column_[entry]];
            const double reaction = lambda[m_ + first_row_[block]];
            const double before = -approaches_[block].speed;
            report.energy.recovered += reaction * std::clamp(std::max(speed, 0.5 * (speed + before)), 0.0, recovery);
        }
    }

    /// Keeps the normal row of a penetrating block. Called before the solve, which takes D away.
    void keep_penetrating(std::size_t block, std::size_t row, double recovery) {
        const auto& [rows, columns, row_start, column, value] = problem_.D;
        const auto first = row_start[m_ + row], last = row_start[m_ + row + 1];
        penetrating_column_.insert(penetrating_column_.end(), column.begin() + first, column.begin() + last);
        penetrating_value_.insert(penetrating_value_.end(), value.begin() + first, value.begin() + last);
        penetrating_.push_back({block, rows_.rows()[row].rate, recovery, penetrating_value_.size()});
    }

    void keep(const std::vector<double>& lambda, double h) {
        last_h_ = h;
        multipliers_.resize(static_cast<std::size_t>(m_));
        for (std::int32_t i = 0; i < m_; ++i) multipliers_[i] = lambda[i] / h;
        kept_.keep(rows_.blocks(), rows_.contacts(), std::span(lambda).subspan(static_cast<std::size_t>(m_)));
    }

    DynamicalSystem& system_;
    double recovery_speed_, restitution_speed_;
    GapResolution resolution_;
    EnergyOfStep energy_;
    bool exact_;
    bool constraint_stiffness_;
    Linearization linearization_;
    std::vector<std::int32_t> blocks_;
    std::vector<std::int32_t> bodies_;  ///< by column
    std::int32_t n_, m_;
    MatrixAssembler H_, R_, D_, G_;
    UnilateralRows rows_;
    std::vector<double> delta_, impulse_, force_;
    VelocityError velocity_error_{1};
    std::vector<double> left_;  ///< what the last solve left, in the norm of the masses, n, or empty
    double last_h_ = 0.0;
    KeptImpulses kept_;
    bool coulomb_ = false;                 // the law that the solver was told
    bool follows_sliding_ = false;         // De Saxcé's term in all contacts
    std::vector<std::int32_t> first_row_;  // of the blocks of rows_, in their order
    std::vector<Approach> approaches_;     // likewise
    std::vector<double> compliances_;      // likewise, entries of E
    std::vector<Sliding> sliding_;
    std::vector<Bounce> bounces_;
    std::vector<FreeSpin> spins_, end_spins_;
    TurningSpins turning_spins_;
    std::vector<Penetrating> penetrating_;
    std::vector<std::int32_t> penetrating_column_;
    std::vector<double> penetrating_value_;
    // Kept so that a step like the last allocates nothing.
    Problem problem_;
    Solution solution_;
    State end_;
};

const RegisterTimestepper euler_implicit_linearized_row{
    {.name = "euler_implicit_linearized",
     .description = "linearised implicit Euler for contacts, impacts and constraints; one problem a step",
     .options = {recovery_speed_option(),
                 restitution_speed_option(),
                 {.key = "jacobian",
                  .type = DELASSUS_OPTION_CHOICE,
                  .default_value = "symmetric",
                  .choices = {"symmetric", "exact"},
                  .doc = "tangent of gyroscopic and follower forces; with contacts always symmetric"},
                 {.key = "constraint_stiffness",
                  .type = DELASSUS_OPTION_CHOICE,
                  .default_value = "definite",
                  .choices = {"definite", "none"},
                  .doc =
                      "what keeps light bodies under heavy pull stable: the positive part of the reactions' stiffness"},
                 linearization_option()},
     .constraints = true,
     .unilateral = true,
     .sleeping = true,
     .shared = true,
     .order = 1,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>& values) -> std::unique_ptr<Timestepper> {
         return std::make_unique<EulerImplicitLinearized>(system, values);
     }}};

}  // namespace
}  // namespace delassus
