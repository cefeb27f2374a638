// SPDX-License-Identifier: BSD-3-Clause
// The θ-method for velocities, with constraints and contacts on the level of velocities (internal). It is two methods
// of integrators/: moreau_jean iterates, linearly_implicit_trapezoidal solves one problem a step.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/timestepper.hpp"
#include "dynamics/contact_gain.hpp"
#include "dynamics/linear_problem.hpp"
#include "dynamics/linearization.hpp"
#include "dynamics/position_error.hpp"
#include "dynamics/position_projection.hpp"
#include "dynamics/row_ways.hpp"
#include "dynamics/step_memory.hpp"
#include "dynamics/struck_spins.hpp"
#include "dynamics/turning_spins.hpp"
#include "dynamics/velocity_contacts.hpp"
#include "dynamics/velocity_error.hpp"

namespace delassus {

struct ThetaSettings {
    std::string name;    ///< of the method, for messages
    double theta = 0.5;  ///< in [½, 1]: where in the step forces are taken
    /// Linearly implicit: one problem a step about an extrapolated guess, and constraints and gaps corrected by its
    /// rows. Otherwise Newton's method, and positions are projected afterwards.
    bool linearly_implicit = false;
    bool holds_stiff = true;   ///< stiff springs are taken as joints
    int iterations = 2;        ///< of Newton's method, at least
    double tolerance = 1e-10;  ///< no further iteration where right-hand sides change by less than this share
    VelocityContactSettings contacts;
    double linearization_limit = 0.1;
};

class DELASSUS_API ThetaMethod : public Timestepper {
public:
    /// system outlives it.
    ThetaMethod(DynamicalSystem& system, ThetaSettings settings);

    [[nodiscard]] int order() const override { return settings_.theta == 0.5 ? 2 : 1; }
    [[nodiscard]] bool estimates_error() const override { return true; }
    [[nodiscard]] bool accounts() const override { return true; }
    void choose_steps(double tolerance) override;
    void restart() override;
    void follow_impacts(bool follow) override { contacts_.follow_impacts(follow); }
    void forces_jumped() override;
    /// error += what the last step errs by in positions, n, as far as it shows in what another method made of its end:
    /// it went on to `next` with no contacts.
    void add_error_of_last(const State& end, const State& next, std::vector<double>& error);
    [[nodiscard]] StepMemory memory() const override;
    void set_memory(StepMemory&& memory) override;
    [[nodiscard]] std::vector<double> save() const override;
    void load(const std::vector<double>& memory) override;

private:
    void take_step(State& state, double h, StepSolver& solver, StepReport& report) override;

    void move(const State& begin, double h, const Vector& last, double part, State& to);
    void find_spins(const State& begin, double h);
    void extrapolate(double h);
    template <class Act>
    void for_each_vector(const Act& act) const;
    void move_late(const State& begin, double h, double acting);
    void mark_struck(bool struck);
    void remember_change(const Vector& result, double h);
    void resolve_up_to(double h);
    void assemble(const State& begin, double h, bool coulomb);
    void linearize(const State& begin, double h);
    void set_constraint_rows(const State& begin, double h);
    void add_stiff_impulse(const State& begin, double h, const Vector& last, Vector& impulse);
    void impulse_of_forces(const State& begin, double h, const Vector& last);
    void set_b_of_contacts(int iteration, const StepReport& report);
    [[nodiscard]] double lost_by_stiff_forces(const State& begin, double h, const Vector& last);
    [[nodiscard]] ContactWork work_of_contacts(const State& begin);
    void solve_step(const State& begin, double h, StepSolver& solver, StepReport& report);
    void scale();
    [[nodiscard]] bool unchanged() const;
    void iterate(const State& begin, double h, StepSolver& solver, StepReport& report);
    [[nodiscard]] Vector without_impacts(const State& begin, double h, StepSolver& solver, StepReport& report);
    void time_turns(StepSolver& solver, StepReport& report);
    void time_meetings(const State& begin, double h, StepSolver& solver, StepReport& report);
    /// SmoothMotion::curve of the step.
    [[nodiscard]] std::span<const double> curve_of_spins(const State& begin, double h);
    [[nodiscard]] bool revise_impacts(double h);
    [[nodiscard]] bool go_on_after_bounces();
    void solve_once(const State& begin, double h, StepSolver& solver, StepReport& report);
    void note_velocity_error(const State& begin, double h);
    [[nodiscard]] bool solve(StepSolver& solver, StepReport& report);
    void judge_constraints(const State& begin, double h);
    void account(const State& begin, double h, StepReport& report);
    void judge_linearization(const State& begin, double h, const Vector& result, StepSolver& solver,
                             StepReport& report);

    static constexpr int most_iterations = 50;

    DynamicalSystem& system_;
    ThetaSettings settings_;
    double theta_;
    double resolved_rate_;  ///< h ω beyond which a force is stiff
    VelocityContacts contacts_;
    EnergyOfStep energy_;
    Linearization linearization_;
    PositionProjection projection_;
    RowWays ways_;
    std::vector<Cone> cones_;
    std::vector<std::int32_t> bodies_;  ///< by column
    std::int32_t n_, m_;
    double last_h_ = 0.0;
    VelocityError velocity_error_;
    PositionError position_error_;
    StepRequest request_{.warm_start = true};
    std::vector<std::pair<std::int32_t, std::int32_t>> vectors_;  ///< first velocities and sizes, ascending
    std::vector<double> struck_;  ///< the share of impacts in the change of each velocity in the last step; n, or empty
    std::vector<double> left_;    ///< by the last solve, in the norm of the masses, n, or empty
    bool chooses_steps_ = false;  ///< steps are chosen by their error
    MatrixAssembler H_, D_;
    Problem problem_;
    Solution solution_;
    State at_theta_, end_, beyond_;
    std::vector<std::int32_t> stiff_;  ///< forces that the longest step does not resolve
    double longest_h_ = 0.0;
    std::vector<double> tensions_, tensions_at_theta_;
    std::vector<FreeSpin> spins_, theta_spins_, half_spins_;
    TurningSpins turning_spins_;
    StruckSpins struck_spins_;
    /// What the last two steps changed velocities by, besides free spins, m/s² or rad/s²; n or empty. Linearly
    /// implicit.
    std::array<std::vector<double>, 2> changes_;
    bool timed_ = false;                         // whether contacts got the times of their meetings in this step
    Vector smooth_;                              // the velocities at the end without impacts
    std::vector<double> curve_;                  // SmoothMotion::curve of them, or empty
    Vector free_, guess_, force_, rate_;         // v or free spins; ṽ⁺; h f̃ there; C_q ṽ⁺ + C_t at the end
    Vector first_guess_;                         // ṽ⁺ before the first problem
    Vector solved_from_, solved_force_, delta_;  // ṽ⁺ and h f̃ of the last problem
    Vector until_impact_;                        // the way of struck velocities until then
    Vector bounced_;                             // v⁺ of bounces alone, where more comes after them; else empty
    Vector damped_;                              // −C x of impacts; empty without
    Vector result_, back_, linear_;
    std::vector<double> constraint_;
    std::vector<double> last_a_, last_b_;
    std::vector<double> diagonal_;
    Vector row_scale_;
};

}  // namespace delassus
