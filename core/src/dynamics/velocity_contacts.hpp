// SPDX-License-Identifier: BSD-3-Clause
// Contacts, stops and bounded motors on the level of velocities, for timesteppers of order 2 (internal).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/timestepper.hpp"
#include "dynamics/gap_resolution.hpp"
#include "dynamics/impact.hpp"
#include "dynamics/kept_impulses.hpp"
#include "dynamics/limited_servo.hpp"
#include "dynamics/turning_axes.hpp"

namespace delassus {

/// The diagonal of H; 1 where it is not positive.
DELASSUS_API void diagonal_of(const SparseMatrix& H, std::vector<double>& diagonal);

/// E of a problem whose last rows are those of these blocks: diagonal, compliances[k] in each row of the k-th; absent
/// where all are 0.
DELASSUS_API void set_compliance(Problem& problem, std::span<const UnilateralRows::Block> blocks,
                                 std::span<const double> compliances);

/// What a user may choose of contacts on the level of velocities.
struct VelocityContactSettings {
    double recovery_speed = 0.01;    ///< with which penetration that a step finds is undone at most
    double restitution_speed = 0.0;  ///< contacts that close slower do not bounce
    /// One problem a step: gaps are corrected by the speeds of their rows, and De Saxcé's terms are those of the guess,
    /// but for contacts that strike. Otherwise gaps are left to PositionProjection.
    bool once = false;
};

/// The rows of the unilateral blocks in a step's problem [H −Dᵀ; D 0] for the velocities at its end, and their law:
/// D v⁺ + b ∈ Υ*. The derivation is in velocity_contacts.cpp.
class DELASSUS_API VelocityContacts {
public:
    /// system outlives it.
    VelocityContacts(DynamicalSystem& system, VelocityContactSettings settings);

    void restart() {
        kept_.clear();
        resolution_.forget();
    }

    /// Collects the rows of a step of size h from `begin`: their gaps there, D at begin.q ∘ exp(θ h v); θ in (0, 1].
    /// restitution: the share of each contact's coefficient that this solve of the step takes, in [0, 1].
    /// Throws StepFailure if a body would go through another one before the contacts at that place are known.
    void collect(const State& begin, double h, double theta, double restitution);
    /// Whether there are any.
    [[nodiscard]] bool any() const { return !rows_.blocks().empty(); }

    /// Appends D, cones and zeros of b to the problem, which holds the bilateral rows (cones beyond theirs are those of
    /// an earlier step), and to lambda the impulses of the last step as a start. coulomb: the solver knows Coulomb's
    /// law, else De Saxcé's term stands in b. last_h: the size of the step before, where steps are chosen by their
    /// error, else 0. The rows of problem.D are used again until the next collect().
    void append_to(Problem& problem, std::vector<double>& lambda, bool coulomb, double last_h = 0.0);
    /// After append_to(): whether an impact is possible in this step.
    [[nodiscard]] bool may_strike() const;
    /// Takes the rows of contacts and stops that do not push on out of a copy of the step's problem.
    void take_out_open(Problem& problem) const;
    /// Before set_b(): contacts that meet within the step get the rows of that time, and strike then. smooth:
    /// the velocities at the end of the step without impacts, n. curve: SmoothMotion::curve of them. last_changes:
    /// accelerations of the step before, n or empty. last_h: as of time_turns(). smooth and curve outlive the step.
    void time_meetings(Problem& problem, std::span<const double> smooth, std::span<const double> curve,
                       std::span<const double> last_changes, double last_h);
    /// Whether impacts lead to other speeds than in the first answer: since friction is to go on through them, or
    /// other forces change by `changes` from then on, n, N or N m, or empty. Then the problem is to be solved again.
    [[nodiscard]] bool revise_impacts(Problem& problem, const Solution& solution, std::span<const double> changes);
    /// After revise_impacts() and its solve: friction and forces between bounds that went on through what bounces act
    /// as they do after it. Whether there are any: then the problem is to be solved again.
    [[nodiscard]] bool go_on_after_bounces(Problem& problem, const Solution& solution);
    /// In which share of the time after bounces, on the average, friction and forces between bounds act at their bounds
    /// in the answer that follows them, in [0, 1].
    [[nodiscard]] double share_of_rest(const Problem& problem, const Solution& solution) const;
    /// Whether in the answer the friction of a joint, or a motor at its limit, does not act all the step as it began.
    [[nodiscard]] bool any_turns_round(const Problem& problem, const Solution& solution) const;
    /// Whatever slides at the beginning of the step gets the impulse of sliding on, in a copy of the step's problem.
    void let_slide_on(Problem& problem) const;
    /// What turns round within the step gets the bounds of that time. sliding: the velocities at the end of the step if
    /// it slid on, n; last_h: the size of the step before, where steps are chosen by their error, else 0.
    void time_turns(Problem& problem, std::span<const double> sliding, double last_h);
    /// problem.a += Dᵀ of what contacts did until an impact or until their friction turned round.
    void add_known_impulses(Problem& problem) const;
    /// lambda of the whole problem += the same.
    void add_known_impulses(std::vector<double>& lambda) const;
    /// b for a guess of the velocities at the end, n. `iteration` counts from 0: late ones only lower De Saxcé's terms.
    /// solution: of the last iteration; natural_error: of the solves so far.
    void set_b(Problem& problem, const Solution& solution, std::span<const double> guess, int iteration,
               double natural_error);
    /// Whether the last set_b() left De Saxcé's terms where they were.
    [[nodiscard]] bool settled() const { return settled_; }

    /// Takes impulses that a solver leaves where nothing pushes for none. solution: of the whole problem.
    void drop_negligible(const Problem& problem, Solution& solution);
    /// Whether a contact that closed in this step is left overlapping by more than it was.
    [[nodiscard]] bool landed(const Solution& solution) const;
    /// What acted, into the report, and kept for the next step; hands the contacts to the report. solution: of the
    /// whole problem.
    void finish(const Problem& problem, const Solution& solution, StepReport& report);

    /// What impacts do to a velocity.
    struct OnVelocity {
        double share = -1.0;  ///< of its change against a motion without them; below 0 where none acts
        double late = 0.0;  ///< share · (1 − θ − τ/h), for impacts at the time τ after the beginning of the step
        bool alone = false;  ///< of all contacts only these act on it
    };
    /// Whether contacts struck in this step at times within it.
    [[nodiscard]] bool any_impact(const Solution& solution) const;
    /// Likewise of materials with restitution.
    [[nodiscard]] bool any_bounce(const Solution& solution) const;
    /// As any_impact(); on_velocities() then has what they do. solution: of the whole problem.
    [[nodiscard]] bool find_impacts(const Problem& problem, const Solution& solution);
    [[nodiscard]] std::span<const OnVelocity> on_velocities() const { return on_velocities_; }  ///< n
    /// Of these impacts, whether all have restitution: then steps are cut between those that lead to one another.
    [[nodiscard]] bool all_bounce() const { return all_bounce_; }
    /// Timestepper::follow_impacts().
    void follow_impacts(bool follow) { follows_ = follow; }
    [[nodiscard]] bool follows_impacts() const { return follows_; }
    /// Contacts that touch, are no faster than their turn explains, and push in this answer are persistent, as if they
    /// had pushed before: what lies on something when a run begins, or goes over an edge. Returns whether the answer
    /// changes by that.
    [[nodiscard]] bool make_persistent(const Solution& solution);
    /// report.doubtful_speed and report.cut; and in report.error, unless that is empty, what these impacts make
    /// the step err by, and rows of impacts that are not known at their time. solution, last_h: as of add_error().
    void note_impacts(const Problem& problem, const Solution& solution, double last_h, StepReport& report) const;

    /// The work of contacts and stops, Σ P·u at the mean velocities of the step, n, or those of impacts within it.
    /// solution: of the whole problem.
    [[nodiscard]] double work(const Problem& problem, const Solution& solution, std::span<const double> mean) const;
    /// Energy of a step, J.
    struct Account {
        double work = 0.0;  ///< Σ P·u of all contacts, stops, friction and limited motors; below 0 they take energy
        double supplied = 0.0;  ///< by bodies with a given motion that touch, limited motors and servos
        double turnover = 0.0;  ///< the same, absolute values of each row
        double doubt = 0.0;     ///< by how much of it `supplied` may be off
    };
    /// At the mean velocities of the step, n, or those of impacts within it. solution: as of work().
    [[nodiscard]] Account account(const Problem& problem, const Solution& solution, std::span<const double> mean);
    /// After append_to(), of contacts without restitution: none strikes at its time, and rows stay as they are in the
    /// middle of the step. Such contacts take energy only.
    void only_take();

    /// error += what the step errs by in positions, n, because contacts and stops that push until its end let go within
    /// it, as their forces in this step and in the one before, of size last_h, show. solution: of the whole problem.
    void add_error(const Problem& problem, const Solution& solution, double last_h, std::vector<double>& error) const;

    /// result += D_Aᵀ P of what pushed steadily: not of impacts. P: impulses, `lambda` of the whole problem; n.
    void add_steady_impulse(const Problem& problem, const std::vector<double>& lambda, double* result) const;

    /// The least gap that the block may have at the end of the step: 0, or less where it penetrated at the beginning.
    [[nodiscard]] double least_gap(std::uint64_t key) const;

    /// Whether something penetrated at the beginning of the step, beyond the resolution of gaps.
    [[nodiscard]] bool begins_deep() const { return deepest_ < -resolution_.least(); }

    /// Of gaps; told what solves leave, it counts smaller ones as closed.
    [[nodiscard]] GapResolution& resolution() { return resolution_; }
    [[nodiscard]] const GapResolution& resolution() const { return resolution_; }

    /// The impulses kept from step to step, for checkpoints.
    [[nodiscard]] const KeptImpulses& kept() const { return kept_; }
    void keep(KeptImpulses impulses) { kept_ = std::move(impulses); }

private:
    void require_same_side(const State& begin, double h) const;

    /// A block at the beginning of the step.
    struct Before {
        std::uint64_t key;
        std::size_t block, row;  ///< its number in before_, and its first row
    };
    /// A block of the problem.
    struct Contact {
        std::size_t row = 0;     ///< its first one in rows_
        std::size_t before = 0;  ///< its first one in before_, where it turns
        bool along_normal = false;
        bool was_there = false;             ///< it is in before_
        bool turns = false;                 ///< b has what its rows turn until the end of the step
        bool nearly_as_before = false;      ///< it is known, and its rows turn as a smooth motion lets them
        bool met_on_the_way = false;        ///< its rows in before_ are those of the meeting
        double gap = 0.0;                   ///< at the beginning
        double resolution = 0.0;            ///< of it
        double approach = 0.0;              ///< speed with which it closes there
        double normal = 0.0;                ///< b of the first row but for what follows from the guess
        double friction = 0.0;              ///< of a contact with De Saxcé's term
        double sliding = -1.0;              ///< the term; negative: not known yet
        double moved = 0.0;                 ///< by which it changed last
        double wanted = 0.0;                ///< what it should have been before
        double end_speed = 0.0;             ///< of the normal row
        double change = 0.0;                ///< of the normal row's speed by its impulse, D diag(H)⁻¹ Dᵀ λ
        bool passes_on = false;             ///< has an impact, with the impulse of another one
        double recovery = 0.0;              ///< speed with which it is pushed apart
        std::optional<LimitedServo> servo;  ///< of a row with a compliance
        bool pushed = false;                ///< in the step before
        bool left = false;                  ///< `once`: it bounced in the step before, and opens
        bool strikes = false;               ///< b is that of an impact
        std::optional<Impact> impact;       ///< it strikes at a time within the step
        Approach before_impact;             ///< until then
        std::array<double, 3> deviation{};  ///< of the speeds of its rows when it strikes: deviation_at()
        double turning = 0.0;               ///< what the turn of its row adds to the acceleration of its gap
        double row_error = 0.0;             ///< of its rows then, as a share of their size
        double struck = HUGE_VAL;           ///< when an impact first strikes one of its bodies, if it has none itself
        double gap_when_struck = 0.0;       ///< of an open one, ≥ 0
        std::array<double, 3> last{};       ///< its impulse in the step before, where it pushed
        bool impulsive = false;             ///< that is not of forces alone
        double goes_on = 0.0;               ///< after that impact, if all went on: of `last`
        bool rubs_on = false;               ///< its friction goes on through the impact
        std::array<double, 3> known{};      ///< of this step's, until an impact or until friction turned round

        [[nodiscard]] double known_impulse(std::size_t i) const { return i < known.size() ? known[i] : 0.0; }
        [[nodiscard]] double deviation_of(std::size_t i) const { return i < deviation.size() ? deviation[i] : 0.0; }
        /// Its impulse comes from forces, not from the speed with which it closes: less than a quarter of the change is
        /// due to that. Of a contact that pushes.
        [[nodiscard]] bool forced() const { return approach <= 0.25 * change; }
        [[nodiscard]] bool steady() const { return pushed && forced(); }
        /// In a step that moves it by `way` at the speed that it has at the beginning: it corrects its gap, or stays
        /// where that is resolved to.
        [[nodiscard]] bool pushes_on(double way) const {
            return pushed && std::abs(way) <= 2.0 * std::abs(resolved_gap()) + resolution;
        }
        [[nodiscard]] double resolved_gap() const { return gap - std::clamp(gap, -resolution, resolution); }
    };

    /// An impact of bodies that another impact of the step strikes before it.
    struct SecondImpact {
        double after, meets;  ///< when they are struck, and when this one comes, after the beginning of the step, s
        double speed;         ///< by which the contact may be wrong after it
        double mobility;      ///< change of that speed by an impulse, 1/kg
    };
    [[nodiscard]] std::optional<SecondImpact> second_impact(const Problem& problem, const Solution& solution,
                                                            std::size_t block) const;
    /// error += what an impulse along a row that should not be there, or lacks, makes of positions, n.
    void add_error_of(double impulse, const SparseMatrix& D, std::size_t row, std::vector<double>& error) const;
    /// What the rows of an impact are.
    enum class RowsOf { Meeting, Between, Middle };
    [[nodiscard]] double turn_error(const SparseMatrix& D, const Contact& contact, RowsOf rows, double time) const;
    [[nodiscard]] double work_of_block(std::size_t block, const Problem& problem, const Solution& solution,
                                       std::span<const double> mean) const;
    [[nodiscard]] double mean_rate(const Contact& contact, std::size_t i) const;
    /// The speeds of a row at both ends of the step by the rates at these instants; of in_middle_.
    [[nodiscard]] std::array<double, 2> speeds_at_ends(const Problem& problem, std::size_t row,
                                                       std::size_t before) const;
    [[nodiscard]] double restitution_of(std::size_t block) const {
        return restitution_ * rows_.blocks()[block].restitution;
    }
    [[nodiscard]] bool acts(const Contact& contact, const Solution& solution) const;
    /// After a solve: an open contact without restitution that an impact closes within the step gets one of its own.
    /// Whether it does.
    bool strike_when_struck(const Problem& problem, const Solution& solution, std::size_t block);
    /// Of a contact that pushed until an impact: what its impulse has of forces that it could not give at the impact.
    [[nodiscard]] double lent_impulse(const Solution& solution, std::size_t block, double last_h) const;
    /// Bounds the speed with which contacts that push close gaps that are left.
    void press_on(const Problem& problem, double last_h);
    void find_passing(const Problem& problem, const Solution& solution);
    [[nodiscard]] const Before* find_before(std::uint64_t key) const;
    /// Of rows in rows_ and before_, with means of the rates about these times, m/s or rad/s.
    [[nodiscard]] double speed_at_begin(std::size_t row, std::size_t before) const;
    [[nodiscard]] double speed_at_end(const Problem& problem, std::size_t row, std::size_t before,
                                      const double* v) const;
    /// Whether the block is the friction of a joint, or a motor or servo with a limit.
    [[nodiscard]] bool is_between_bounds(std::size_t block) const;
    /// The speed at the beginning of the step of a force between bounds that may turn round; 0 of all else.
    [[nodiscard]] double sliding_speed(std::size_t block) const;
    /// Whether a force between bounds needs more than a faint impulse to stop its row from that speed.
    [[nodiscard]] bool slides(const Problem& problem, std::size_t block, double speed) const;
    /// A force between bounds that an impact strikes acts until then as before it: Contact::last. What follows is that
    /// of the rest of the step, or while something leaves an impact, the same force.
    void hold_until_struck(Problem& problem, std::size_t block, double last_h, double sliding, bool leaves);
    /// Gives a force between bounds those of the rest of the step.
    void give_rest_of_step(Problem& problem, std::size_t block) const;
    /// Of a force between bounds, what a solver may leave.
    [[nodiscard]] double faint_impulse(const Problem& problem, std::size_t block) const;
    [[nodiscard]] LimitedServo find_servo(std::uint64_t key, const Before* before, const Contact& contact) const;
    [[nodiscard]] bool nearly_equal(std::size_t row, std::size_t before, std::int32_t rows) const;
    void take_rates_of_end(const Contact& contact, const UnilateralRows::Block& block);
    /// Gives a contact the rows and rates that it has so long after the beginning, s, if nothing strikes until then;
    /// its gap there, or nothing if the system does not know.
    [[nodiscard]] std::optional<double> collect_rows_at(double time, std::size_t block, Problem& problem);
    /// The same by the rows at the beginning and in the middle, if it is nearly as before; false if that cannot be.
    bool take_rows_at(double time, std::size_t block, Problem& problem);
    /// Gives its rows the rates at that time after the beginning, s.
    void set_rates_at(double time, std::size_t block);
    /// Of a row of the problem besides impacts, m/s² or rad/s²; after time_meetings().
    [[nodiscard]] double smooth_acceleration(const Problem& problem, std::size_t row) const;
    /// What SmoothMotion::curve adds to the speed of a row of the problem at that time after the beginning.
    [[nodiscard]] double deviation_at(const Problem& problem, std::size_t row, double time) const;
    void report_closing(const Contact& contact, StepReport& report) const;
    void set_normal(const UnilateralRows::Block& block, Contact& contact, double middle_speed) const;
    /// Contact::struck, and what follows for b and for what pushes.
    void find_struck(Problem& problem, double last_h);
    /// impulsive_ ← which contacts got their impulse from more than forces.
    void find_impulsive(const Problem& problem, const Solution& solution);
    /// friction_reach_ ← by what the friction of all contacts can change each velocity, as large as it was in the step
    /// before.
    void find_friction_reach(const Problem& problem);
    /// Has the friction of a contact that slides on act against the velocity of θ. end_squares: |u_t|² at the end of
    /// the guess.
    void set_friction_direction(Problem& problem, const Contact& contact, std::size_t size,
                                std::span<const double> guess, double end_squares) const;
    void set_sliding_term(Contact& contact, double wanted, double enough, int iteration);

    DynamicalSystem& system_;
    VelocityContactSettings settings_;
    GapResolution resolution_;
    std::size_t bilateral_cones_;
    TurningAxes axes_;
    double h_ = 0.0, theta_ = 0.5, restitution_ = 1.0;
    UnilateralRows before_, rows_;     // at the beginning; at the point where D is taken
    UnilateralRows servos_;            // those of a step of size θ h, if there are any
    UnilateralRows then_;              // those of a contact that strikes
    std::vector<double> compliances_;  // entries of E; of each block
    std::vector<Before> keys_;         // of before_, ascending
    double deepest_ = 0.0;             // the least gap of before_, ≤ 0
    std::vector<Contact> contacts_;
    State middle_;
    std::vector<double> delta_, diagonal_;
    std::vector<double> in_begin_, in_middle_;  // the guess in the axes of the beginning, and of where D is taken
    std::vector<OnVelocity> on_velocities_;
    struct Sum {
        double weight = 0.0, share = 0.0, late = 0.0;
    };
    std::vector<Sum> sums_;           // of what acts on velocities, by weights
    std::vector<std::size_t> found_;  // velocities
    std::vector<double> ended_;       // of the rows at the end of the step: what acts on
    std::vector<double> struck_;      // of each velocity, when an impact first changes it; empty where there is none
    std::vector<double> impulsive_changes_;  // by what impulsive contacts change each velocity, by the diagonal of H
    std::vector<char> impulsive_;            // of each block
    KeptImpulses kept_;
    const State* begin_ = nullptr;          // of the step; until its end
    const double* begin_speeds_ = nullptr;  // there
    const double* smooth_ = nullptr;        // velocities at the end without impacts; from time_meetings() on
    std::span<const double> curve_;         // of them, SmoothMotion::curve
    std::size_t first_row_ = 0;             // in the problem
    std::vector<double> friction_reach_;
    bool held_through_bounces_ = false;  // friction or forces between bounds, until go_on_after_bounces()
    bool takes_only_ = false;
    bool coulomb_ = false, settled_ = true, follows_ = false, all_bounce_ = false;
};

/// report ← the impact of a normal row that pushes, if it is one and the fastest so far: it did not push in the step
/// before, or it opens as fast as what bounced does. gap, approach: at the beginning, the latter the speed of closing.
void note_impact(const UnilateralRows::Block& block, double gap, double approach, bool pushed, double h,
                 double restitution_speed, StepReport& report);

/// The options of timesteppers that take contacts, and what their values say.
OptionInfo recovery_speed_option();
OptionInfo restitution_speed_option();
VelocityContactSettings velocity_contact_settings(const DynamicalSystem& system, const OptionValue& recovery_speed,
                                                  const OptionValue& restitution_speed);

}  // namespace delassus
