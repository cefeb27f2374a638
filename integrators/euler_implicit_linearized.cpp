// SPDX-License-Identifier: BSD-3-Clause
// The linearised implicit Euler method for differential variational inequalities (seed eq. 123, 148): one linear or
// cone problem a step, contacts and impacts included. Order 1.
#include <algorithm>
#include <cmath>
#include <utility>

#include "delassus/timestepper.hpp"
#include "dynamics/linear_problem.hpp"
#include "dynamics/linearization.hpp"
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
// Constraints at the end of the step, again to first order, C(q⁺, t⁺) ≈ C(q, t⁺) + h C_q v⁺ = 0, divided by h, are rows
// with b = C(q, t⁺)/h. The part C(q, t)/h of it is error of earlier steps; it is recovered with at most the speed η_s
// (seed footnote 5). A gap Φ ≥ 0 likewise:
//
//     u = D v⁺ + Φ/h + Φ_t ≥ 0,      recovering a penetration (Φ < 0) with at most η_s
//
// Newton's law of impact: where a contact would close in this step, u_n⁺ ≥ −e u_n⁻, that is b = e u_n⁻.
//
// How far f(q⁺, v⁺, t⁺) is from the linear model is measured after the step (dynamics/linearization.hpp).
class EulerImplicitLinearized : public Timestepper {
public:
    EulerImplicitLinearized(DynamicalSystem& system, const std::vector<OptionValue>& values)
        : system_(system),
          recovery_speed_(values[0].real),
          restitution_speed_(values[1].real),
          exact_(values[2].text == "exact" && !system.has_unilateral()),
          constraint_stiffness_(values[3].text == "definite"),
          linearization_(system, values[4].real),
          blocks_(system.constraint_blocks()),
          n_(system.n()),
          m_(system.m()) {
        before_.resize(static_cast<std::size_t>(m_));
        after_.resize(static_cast<std::size_t>(m_));
        delta_.resize(static_cast<std::size_t>(n_));
    }

    [[nodiscard]] int order() const override { return 1; }
    [[nodiscard]] bool damps_at_once() const override { return true; }
    void restart() override {
        multipliers_.clear();
        kept_.clear();
        impulses_.clear();
        last_h_ = 0.0;
    }

    // h, whether there are multipliers, these, and for each unilateral block its key in two halves, which a double
    // holds exactly, its number of rows and its impulses.
    std::vector<double> save() const override {
        std::vector<double> memory = {last_h_, multipliers_.empty() ? 0.0 : 1.0};
        memory.insert(memory.end(), multipliers_.begin(), multipliers_.end());
        for (const auto& [key, first, rows] : kept_) {
            memory.insert(memory.end(), {static_cast<double>(key >> 32U), static_cast<double>(key & 0xffffffffU),
                                         static_cast<double>(rows)});
            memory.insert(memory.end(), impulses_.begin() + first, impulses_.begin() + first + rows);
        }
        return memory;
    }
    void load(const std::vector<double>& memory) override {
        restart();
        auto next = memory.begin();
        const auto take = [&](std::ptrdiff_t count) {
            if (count < 0 || memory.end() - next < count)
                throw InputError("the memory of euler_implicit_linearized is too short");
            next += count;
            return next - count;
        };
        const auto head = take(2);
        const auto multipliers = take(head[1] == 0.0 ? 0 : m_);
        multipliers_.assign(multipliers, next);
        last_h_ = head[0];
        while (next != memory.end()) {
            const auto block = take(3);
            const auto key = (static_cast<std::uint64_t>(block[0]) << 32U) | static_cast<std::uint64_t>(block[1]);
            const auto impulse = take(static_cast<std::ptrdiff_t>(block[2]));
            kept_.push_back({key, static_cast<std::int32_t>(impulses_.size()), static_cast<std::int32_t>(block[2])});
            impulses_.insert(impulses_.end(), impulse, next);
        }
        sort_kept();
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
        if (system_.has_unilateral()) system_.collect_unilateral(state, h, rows_);
        assemble_balance(state, h);
        assemble_constraints(state, h);
        assemble_unilateral(h);

        report.newton_iterations = 1;
        report.unilateral_blocks = static_cast<std::int32_t>(rows_.blocks().size());
        solution_.x = state.v;
        // Judging the linearisation needs H and a again; otherwise the problem is moved to the solver.
        report.solved = linearization_.wanted() ? solver.solve(problem_, solution_, true)
                                                : solver.solve(std::move(problem_), solution_, true);
        if (!report.solved) report.message = solver.effort().unsolved;
        for (std::int32_t i = 0; i < n_; ++i) delta_[i] = h * solution_.x[i];
        system_.increment(state.q.data(), delta_.data(), end_.q.data());
        end_.v = solution_.x;
        require_finite(state, end_, h, "euler_implicit_linearized");
        if (linearization_.wanted()) judge_linearization(state, h, report);
        report_reactions(solution_.lambda, h, report);
        report.contacts.swap(rows_.contacts());
        state = end_;
        keep(solution_.lambda, h);
        report.multipliers = multipliers_;
    }

    /// Where the impulses of a unilateral block of the last step stand in impulses_.
    struct Kept {
        std::uint64_t key;
        std::int32_t first, rows;
    };
    /// What decides whether a unilateral block had an impact in this step.
    struct Approach {
        double gap, speed;  ///< gap ≥ 0; the speed of closing
        bool along_normal, pushed_before;
    };

    /// The normal row of a unilateral block that penetrates.
    struct Penetrating {
        std::size_t block;  ///< its number
        double rate;        ///< of the row
        std::size_t end;    ///< of its entries, which begin where those of the one before end
    };

    void assemble_balance(const State& state, double h) {
        const Tangent tangent = exact_ ? Tangent::Exact : Tangent::Symmetric;
        H_.begin(n_, n_);
        system_.add_mass(state, 1.0, H_);
        problem_.a.assign(static_cast<std::size_t>(n_), 0.0);
        system_.multiply_mass(state, 1.0, state.v.data(), problem_.a.data());
        system_.add_force(end_, h, problem_.a.data());
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
    void judge_linearization(const State& begin, double h, StepReport& report) {
        for (std::int32_t i = 0; i < n_; ++i) delta_[i] = end_.v[i] - begin.v[i];
        impulse_ = problem_.a;
        problem_.H.multiply_add(-1.0, end_.v.data(), impulse_.data());
        G_.finish().multiply_add(1.0, end_.v.data(), impulse_.data());
        system_.multiply_mass(begin, 1.0, delta_.data(), impulse_.data());
        force_.assign(static_cast<std::size_t>(n_), 0.0);
        system_.add_force(end_, h, force_.data());
        report.linearization = linearization_.error(begin, end_, h, force_, impulse_, problem_.H);
        linearization_.judge(report.linearization, begin, h, "euler_implicit_linearized");
    }

    // D takes its arrays from the unilateral rows where there are no others.
    void assemble_constraints(const State& state, double h) {
        problem_.D.rows = 0;
        problem_.D.columns = n_;
        problem_.b.resize(static_cast<std::size_t>(m_) + rows_.rows().size());
        if (m_ == 0) return;
        D_.begin(m_, n_);
        system_.add_constraint_jacobian(end_, 0, D_);
        system_.constraint(state, before_.data());
        system_.constraint(end_, after_.data());
        for (std::int32_t i = 0; i < m_; ++i) {
            const double drift = std::clamp(before_[i] / h, -recovery_speed_, recovery_speed_);
            problem_.b[i] = drift + (after_[i] - before_[i]) / h;
        }
        D_.finish_into(problem_.D);
    }

    // One walk over the blocks collects their cones, b, their impulses of the last step as a start, and what is needed
    // of them after the solve. Blocks usually come by ascending keys, the order in which impulses are kept: then each
    // search for the last impulses begins where the one before ended.
    void assemble_unilateral(double h) {
        rows_.move_into(problem_.D);
        problem_.cones.resize(blocks_.size() + rows_.blocks().size());
        for (std::size_t k = 0; k < blocks_.size(); ++k) copy_cone(Cone::free(blocks_[k]), problem_.cones[k]);
        auto& lambda = solution_.lambda;
        lambda.resize(problem_.b.size());
        for (std::int32_t i = 0; i < m_; ++i) lambda[i] = multipliers_.empty() ? 0.0 : last_h_ * multipliers_[i];
        next_kept_.clear();
        approaches_.clear();
        penetrating_.clear();
        penetrating_column_.clear();
        penetrating_value_.clear();
        std::int32_t row = 0;
        Cone* cone = problem_.cones.data() + blocks_.size();
        auto last = kept_.cbegin();
        for (const auto& block : rows_.blocks()) {
            const std::int32_t rows = block.cone.rows;
            copy_cone(block.cone, *cone);
            for (auto* bounds : {&cone->lo, &cone->hi})
                for (double& bound : *bounds) bound *= h;
            ++cone;
            if (last == kept_.end() || last->key > block.key) last = first_kept(block.key);
            while (last != kept_.end() && last->key < block.key) ++last;
            const bool known = last != kept_.end() && last->key == block.key;
            const bool fits = known && last->rows == rows;
            for (std::int32_t i = 0; i < rows; ++i) {
                problem_.b[m_ + row + i] = offset(block, i, row + i, h);
                lambda[m_ + row + i] = fits ? impulses_[last->first + i] : 0.0;
            }
            if (block.along_normal() && rows_.rows()[row].gap < 0.0) keep_penetrating(next_kept_.size(), row);
            next_kept_.push_back({block.key, row, rows});
            approaches_.push_back({std::max(rows_.rows()[row].gap, 0.0), -block.speed, block.along_normal(),
                                   known && impulses_[last->first] > 0.0});
            row += rows;
        }
    }

    // Impacts: a contact with the gap Φ > 0 that pushes would otherwise have closed within the step, with a mean speed
    // of at least Φ/h even if its first speed was less. A contact that opened and comes back within the step (a ball
    // that bounces low) closes about as fast. A penetrating contact supplies the energy λ_n (u_n + u_n⁺)/2 when it
    // pushes the bodies apart.
    void report_reactions(const std::vector<double>& lambda, double h, StepReport& report) const {
        for (std::size_t k = 0; k < next_kept_.size(); ++k) {
            const auto& [key, first, rows] = next_kept_[k];
            const double reaction = lambda[m_ + first];
            const auto& [gap, approach, along_normal, pushed_before] = approaches_[k];
            BlockReaction& acted = report.reactions.emplace_back();
            acted.key = key;
            for (std::int32_t i = 0; i < std::min(rows, 3); ++i) acted.force[i] = lambda[m_ + first + i] / h;
            if (reaction != 0.0) ++report.active_blocks;
            if (!along_normal || !(reaction > 0.0)) continue;
            const double speed = std::max(std::abs(approach), gap / h);
            if ((approach < 0.0 || !pushed_before) && speed > report.impact_speed) {
                report.impact_speed = speed;
                report.impact_time = approach < 0.0 ? h : gap / speed;
            }
        }
        std::size_t entry = 0;
        for (const auto& [block, rate, end] : penetrating_) {
            double speed = rate;
            for (; entry < end; ++entry) speed += penetrating_value_[entry] * end_.v[penetrating_column_[entry]];
            const double reaction = lambda[m_ + next_kept_[block].first];
            report.recovered += std::max(0.5 * reaction * (speed - approaches_[block].speed), 0.0);
        }
    }

    /// Keeps the normal row of a penetrating block. Called before the solve, which takes D away.
    void keep_penetrating(std::size_t block, std::size_t row) {
        const auto& [rows, columns, row_start, column, value] = problem_.D;
        const auto first = row_start[m_ + row], last = row_start[m_ + row + 1];
        penetrating_column_.insert(penetrating_column_.end(), column.begin() + first, column.begin() + last);
        penetrating_value_.insert(penetrating_value_.end(), value.begin() + first, value.begin() + last);
        penetrating_.push_back({block, rows_.rows()[row].rate, penetrating_value_.size()});
    }

    /// b of row number `row`, the i-th of its block.
    [[nodiscard]] double offset(const UnilateralRows::Block& block, std::int32_t i, std::int32_t row, double h) const {
        const auto& [gap, rate] = rows_.rows()[row];
        if (i == 0 && block.along_normal() && block.restitution > 0.0 && block.speed < -restitution_speed_ &&
            gap + h * block.speed <= 0.0)
            return rate + block.restitution * block.speed;
        return rate + std::max(gap / h, -recovery_speed_);
    }

    /// The first with a key not less.
    [[nodiscard]] std::vector<Kept>::const_iterator first_kept(std::uint64_t key) const {
        return std::lower_bound(kept_.begin(), kept_.end(), key,
                                [](const Kept& kept, std::uint64_t wanted) { return kept.key < wanted; });
    }

    void keep(const std::vector<double>& lambda, double h) {
        last_h_ = h;
        multipliers_.resize(static_cast<std::size_t>(m_));
        for (std::int32_t i = 0; i < m_; ++i) multipliers_[i] = lambda[i] / h;
        impulses_.assign(lambda.begin() + m_, lambda.end());
        kept_.swap(next_kept_);
        sort_kept();
    }
    void sort_kept() {
        const auto before = [](const Kept& a, const Kept& b) {
            return a.key != b.key ? a.key < b.key : a.first < b.first;
        };
        if (!std::is_sorted(kept_.begin(), kept_.end(), before)) std::sort(kept_.begin(), kept_.end(), before);
    }

    DynamicalSystem& system_;
    double recovery_speed_, restitution_speed_;
    bool exact_;
    bool constraint_stiffness_;
    Linearization linearization_;
    std::vector<std::int32_t> blocks_;
    std::int32_t n_, m_;
    MatrixAssembler H_, R_, D_, G_;
    UnilateralRows rows_;
    std::vector<double> before_, after_, delta_, impulse_, force_;
    double last_h_ = 0.0;
    std::vector<Kept> kept_;  // by ascending keys
    std::vector<double> impulses_;
    std::vector<Kept> next_kept_;       // of the blocks of rows_, in their order
    std::vector<Approach> approaches_;  // likewise
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
     .options = {{.key = "recovery_speed",
                  .type = DELASSUS_OPTION_REAL,
                  .default_value = "inf",
                  .minimum = 0.0,
                  .maximum = HUGE_VAL,
                  .unit = "m/s",
                  .doc = "largest speed with which errors of position are corrected"},
                 {.key = "restitution_speed",
                  .type = DELASSUS_OPTION_REAL,
                  .default_value = "0",
                  .minimum = 0.0,
                  .maximum = HUGE_VAL,
                  .unit = "m/s",
                  .doc = "contacts that close slower than this do not bounce"},
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
     .order = 1,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>& values) -> std::unique_ptr<Timestepper> {
         return std::make_unique<EulerImplicitLinearized>(system, values);
     }}};

}  // namespace
}  // namespace delassus
