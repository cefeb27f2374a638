// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/theta_method.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "dynamics/row_entries.hpp"
#include "problem/copy_cone.hpp"

namespace delassus {

// With v_θ = (1 − θ) v + θ v⁺, forces at the point q_θ = q ∘ exp(θ h v_θ), v_θ, t + θ h, and impulses P of the step,
//
//     M(q_θ) (v⁺ − v) = h f(q_θ, v_θ, t_θ) + C_qᵀ P_C + D_Aᵀ P_A,      q⁺ = q ∘ exp(h v_θ)
//
// (Moreau 1988; Jean, CMAME 177, 1999; Acary and Brogliato 2008, ch. 10; for forces linear in q and v this is their
// θ f⁺ + (1 − θ) f, so that θ = ½ is the trapezoidal rule as well as the midpoint rule). The matrix
//
//     H = M + θ h R + θ² h² K,      H v⁺ − Dᵀ P = H ṽ⁺ + M(q̃_θ) (v − ṽ⁺) + h f̃_θ
//
// makes it a problem [H −Dᵀ; D 0] with the cones of contacts about a guess ṽ⁺. Its answer is off by (H − the true
// derivative) (v⁺ − ṽ⁺) and by the square of (v⁺ − ṽ⁺). H is the symmetric part of the derivative, without the
// gyroscopic part and without the turns of C_qᵀ P.
//
// Constraints hold on the level of velocities, C_q(q⁺) v⁺ + C_t = 0, contacts likewise (dynamics/velocity_contacts.cpp,
// which says where D is taken). λ is P/h, the mean over the step: as a value at its end it is of order 1.
//
// Stiff forces −T ∇C, T = k C + c Ċ, which the step does not resolve (DynamicalSystem::find_stiff_forces()): taken at
// θ, what they excite would ring on, for θ = ½ for ever. As k grows they become constraints C = 0, and are taken as
// those are: with their directions ∇C at θ, and with the tension T of the state
//
//     q⁺ ∘ exp((1 − θ) h v⁺),  v⁺,  t⁺ + (1 − θ) h
//
// What is stiff in a step of the longest h stays so in shorter ones: a step leaves C off by what the next one undoes,
// which would be energy in a spring that is not stiff any more.
//
// For one body, k → ∞ makes C + h ((1 − θ) u + u⁺) = 0 with C⁺ = C + h ((1 − θ) u + θ u⁺): two steps lead from any C
// and u to C = u = 0. From C = 0 the first one leaves C⁺ = (1 − θ)² h u, which only such a step may go on from. H has
// h² k ∇C ∇Cᵀ and h c ∇C ∇Cᵀ of them in place of θ² h² k and θ h c.
//
// Gyroscopic torques: a body that spins by itself turns by a rule that keeps its energy and momentum
// (DynamicalSystem::free_spins), and what the other motions of the step add to its torque is taken beside its impulse.
// Where no joint holds it, it turns by the way of that rule, and by θ h (v⁺ − ω⁺) more: h v_θ would be off by O(h³ ω³),
// whatever acts on it.

namespace {

/// h ω up to which the trapezoidal rule has a faint error of the fastest motion.
constexpr double rate_of_faint_error = 2.0;
/// The same where steps are divided until their error is small; they resolve no faster vibrations.
constexpr double rate_that_errors_show = 100.0;

}  // namespace

ThetaMethod::ThetaMethod(DynamicalSystem& system, ThetaSettings settings)
    : system_(system),
      settings_(std::move(settings)),
      theta_(settings_.theta),
      resolved_rate_(rate_of_faint_error),
      contacts_(system, settings_.contacts),
      energy_(system),
      linearization_(system, settings_.linearization_limit),
      projection_(system),
      ways_(system),
      cones_(free_cones(system)),
      bodies_(system.bodies_of_columns()),
      n_(system.n()),
      m_(system.m()),
      velocity_error_(order()),
      position_error_(theta_) {
    std::int32_t next = 0;
    for (const std::int32_t first : system.vectors()) {
        for (; next < first; ++next) vectors_.push_back({next, 1});
        vectors_.push_back({first, 3});
        next = first + 3;
    }
    for (; next < n_; ++next) vectors_.push_back({next, 1});
}

void ThetaMethod::choose_steps(double tolerance) {
    chooses_steps_ = std::isfinite(tolerance);
    resolved_rate_ = chooses_steps_ ? rate_that_errors_show : rate_of_faint_error;
    resolve_up_to(longest_h_);
}

/// act(first, size) for the velocities that are components of one vector, and for each other one.
template <class Act>
void ThetaMethod::for_each_vector(const Act& act) const {
    for (const auto& [first, size] : vectors_) act(first, size);
}

void ThetaMethod::restart() {
    multipliers_.clear();
    contacts_.restart();
    for (auto& change : changes_) change.clear();
    struck_.clear();
    position_error_.forget();
    velocity_error_.forget();
    left_.clear();
    last_h_ = 0.0;
}

void ThetaMethod::forces_jumped() {
    for (auto& change : changes_) change.clear();
    struck_.clear();
    position_error_.forget();
    velocity_error_.forget();
}

// h; the changes of the last steps, their errors, what the last solve left, what an impact changed, and accelerations;
// the multipliers.
StepMemory ThetaMethod::memory() const {
    StepMemory memory;
    memory.numbers = {last_h_, longest_h_};
    memory.numbers.insert(memory.numbers.end(), velocity_error_.sizes().begin(), velocity_error_.sizes().end());
    memory.of_columns.assign(changes_.begin(), changes_.end());
    for (auto& values : velocity_error_.save()) memory.of_columns.push_back(std::move(values));
    memory.of_columns.push_back(left_);
    memory.of_columns.push_back(struck_);
    memory.of_columns.push_back(contacts_.resolution().left());
    memory.of_columns.push_back(position_error_.acceleration());
    memory.of_rows = {multipliers_};
    memory.impulses = contacts_.kept();
    return memory;
}

void ThetaMethod::set_memory(StepMemory&& memory) {
    restart();
    last_h_ = memory.numbers.at(0);
    if (memory.numbers.at(1) > longest_h_) resolve_up_to(memory.numbers.at(1));
    for (std::size_t k = 0; k < changes_.size(); ++k) changes_[k] = std::move(memory.of_columns.at(k));
    velocity_error_.load(std::span(memory.of_columns).subspan(changes_.size(), velocity_error_.kept()),
                         std::span(memory.numbers).subspan(2));
    const auto rest = memory.of_columns.begin() + static_cast<std::ptrdiff_t>(changes_.size() + velocity_error_.kept());
    left_ = std::move(rest[0]);
    struck_ = std::move(rest[1]);
    contacts_.resolution().load(std::move(rest[2]));
    position_error_.load(std::move(rest[3]));
    multipliers_ = std::move(memory.of_rows.at(0));
    contacts_.keep(std::move(memory.impulses));
}

std::vector<double> ThetaMethod::save() const {
    return flat(memory());
}

void ThetaMethod::load(const std::vector<double>& memory) {
    set_memory(unflattened(memory, this->memory(), static_cast<std::size_t>(n_), static_cast<std::size_t>(m_),
                           settings_.name));
}

void ThetaMethod::take_step(State& state, double h, StepSolver& solver, StepReport& report) {
    require_step(system_, state, h, settings_.name);
    note_velocity_error(state, h);
    find_spins(state, h);
    if (settings_.linearly_implicit) extrapolate(h);
    solve_step(state, h, solver, report);
    result_ = Eigen::Map<const Vector>(solution_.x.data(), n_);
    account(state, h, report);
    const double acting = bounced_.size() > 0 ? contacts_.share_of_rest(problem_, solution_) : 0.0;
    contacts_.add_known_impulses(solution_.lambda);
    contacts_.drop_negligible(problem_, solution_);

    move(state, h, result_, 1.0, end_);
    const bool struck = timed_ && contacts_.find_impacts(problem_, solution_);
    if (struck) move_late(state, h, acting);
    end_.v = solution_.x;
    if (struck)
        for (const StruckSpins::Spin& spin : struck_spins_.spins())
            std::copy(spin.speed.begin(), spin.speed.end(), end_.v.begin() + spin.column);
    require_finite(state, end_, h, settings_.name);
    if (!stiff_.empty()) report.energy.damped = lost_by_stiff_forces(state, h, result_);
    if (linearization_.wanted()) judge_linearization(state, h, result_, solver, report);
    const bool projected = !settings_.linearly_implicit || struck || contacts_.landed(solution_);
    if (projected) projection_.project(state, end_, h, problem_, left_, contacts_, solver, report, settings_.name);
    if (struck && m_ > 0) projection_.project_velocities(end_, problem_.H, solver, report);
    if (settings_.linearly_implicit && m_ > 0) judge_constraints(state, h);
    mark_struck(struck);
    if (settings_.linearly_implicit && !contacts_.follows_impacts()) remember_change(result_, h);
    multipliers_.assign(solution_.lambda.begin(), solution_.lambda.begin() + m_);
    for (double& lambda : multipliers_) lambda /= h;
    contacts_.finish(problem_, solution_, report);
    result_ -= free_;
    if (position_error_.note({h, last_h_, result_, struck_, timed_, contacts_.all_bounce()}, report))
        contacts_.add_error(problem_, solution_, last_h_, report.error);
    if (struck) contacts_.note_impacts(problem_, solution_, last_h_, report);
    if (const auto moved = projection_.moved(); projected && !moved.empty()) {
        report.error.resize(moved.size(), 0.0);
        for (std::size_t i = 0; i < moved.size(); ++i) report.error[i] += std::abs(moved[i]);
    }
    last_h_ = h;
    std::swap(state, end_);
    report.multipliers = multipliers_;
}

// What pushed until the end, and lets go of everything there, was let go of within the step: h² |a − a₋|/12, as of two
// steps of one size (PositionError).
void ThetaMethod::add_error_of_last(const State& end, const State& next, std::vector<double>& error) {
    const std::vector<double>& last = position_error_.acceleration();
    const double h = next.t - end.t;
    if (last.empty() || !(h > 0.0)) return;
    find_spins(end, h);
    for (std::size_t i = 0; i < last.size(); ++i) {
        const double acceleration = (next.v[i] - free_[static_cast<Eigen::Index>(i)]) / h;
        error[i] += last_h_ * last_h_ * std::abs(acceleration - last[i]) / 12.0;
    }
}

/// to.q ← q ∘ exp(part h v_θ) for the velocities v⁺ = `last` at the end; to.v and to.t are those of θ.
void ThetaMethod::move(const State& begin, double h, const Vector& last, double part, State& to) {
    const Eigen::Map<const Vector> v(begin.v.data(), n_);
    to.v.resize(begin.v.size());
    Eigen::Map<Vector> mean(to.v.data(), n_);
    mean = (1.0 - theta_) * v + theta_ * last;
    delta_ = part * h * mean;
    if (part == 1.0)
        for (const FreeSpin* spin : turning_spins_)
            for (std::size_t i = 0; i < 3; ++i) {
                const Eigen::Index column = spin->column + static_cast<Eigen::Index>(i);
                delta_[column] += spin->turn[i] - h * ((1.0 - theta_) * v[column] + theta_ * spin->speed[i]);
            }
    to.q.resize(begin.q.size());
    system_.increment(begin.q.data(), delta_.data(), to.q.data());
    to.t = begin.t + part * h;
}

/// The spins of the step, their torques at θ, and the guess that the spinning bodies go on alone.
void ThetaMethod::find_spins(const State& begin, double h) {
    free_ = Eigen::Map<const Vector>(begin.v.data(), n_);
    guess_ = free_;
    end_ = begin;
    end_.t = begin.t + h;
    system_.free_spins(end_, h, spins_);
    if (spins_.empty()) return;
    at_theta_ = begin;
    for (const FreeSpin& spin : spins_)
        for (std::int32_t i = 0; i < 3; ++i) {
            const auto k = static_cast<std::size_t>(i), column = static_cast<std::size_t>(spin.column + i);
            free_[spin.column + i] = spin.speed[k];
            at_theta_.v[column] = (1.0 - theta_) * begin.v[column] + theta_ * spin.speed[k];
        }
    guess_ = free_;
    system_.free_spins(at_theta_, 0.0, theta_spins_);  // for the torques alone
}

// ---- The guess of the linearly implicit method ----
//
// The accelerations of the last two steps, less what spins by itself, say how velocities change in this one. Of each
// vector, or velocity that is part of none, the one nearer to 0 is taken, or 0 where they oppose each other. In a
// smooth motion either is off by O(h), and the guess by O(h²). Beside an impact the smooth one of the two is the
// smaller. Where a stiff mode changes its sign from step to step, an extrapolation would double it: the guess then is
// that velocities stay. A step that is much shorter than this one, a part between two impacts, tells nothing of
// accelerations: whatever it changed would be taken as many times over. After it a history begins anew.
void ThetaMethod::extrapolate(double h) {
    constexpr double short_part = 0.01;
    if (last_h_ < short_part * h)
        for (auto& change : changes_) change.clear();
    if (changes_[0].empty()) return;
    const Eigen::Map<const Vector> last(changes_[0].data(), n_);
    const Eigen::Map<const Vector> before(changes_[1].empty() ? changes_[0].data() : changes_[1].data(), n_);
    for_each_vector([&](std::int32_t first, std::int32_t size) {
        const auto one = last.segment(first, size), other = before.segment(first, size);
        if (!(one.dot(other) > 0.0)) return;
        guess_.segment(first, size) += h * (one.squaredNorm() < other.squaredNorm() ? one : other);
    });
}

// What positions lack by impacts (VelocityContacts::find_impacts()), added to the way of the step. Turns do not
// commute: the way until τ comes first and the rest after it, or the axes of a body, and so its momentum, would be off
// by O(h²). Of what moves after an impact in the step before, the guess ṽ may not know what holds it since, unless
// impacts alone act on it; v is what it would be then. The nearer one to v⁺ counts, by which nothing moves too far. Not
// in the parts of a step that is cut between impacts, each of which follows one.
//
// What friction and forces between bounds change after a bounce, from v⁺ of the bounce alone, comes in the course of
// the rest r of the step: in the share a of it that they act, after which what they stop is at rest. Positions go less
// far by ½ a r of it.
void ThetaMethod::move_late(const State& begin, double h, double acting) {
    const Eigen::Map<const Vector> v(begin.v.data(), n_);
    until_impact_.setZero(n_);
    for_each_vector([&](std::int32_t first, std::int32_t size) {
        const auto k = static_cast<std::size_t>(first);
        const auto& [share, late, alone] = contacts_.on_velocities()[k];
        if (!(share > 0.0)) return;
        Vector change = result_.segment(first, size) - smooth_.segment(first, size);
        const auto held = result_.segment(first, size) - free_.segment(first, size);
        if (settings_.linearly_implicit && !alone && !contacts_.follows_impacts() && !struck_.empty() &&
            struck_[k] > mostly && held.squaredNorm() < change.squaredNorm())
            change = held;
        const double part = 1.0 - theta_ - late / share;  // τ/h
        auto until = until_impact_.segment(first, size);
        until = part * h * ((1.0 - 0.5 * part) * v.segment(first, size) + 0.5 * part * smooth_.segment(first, size));
        delta_.segment(first, size) += late * h * change - until;
        if (bounced_.size() > 0)
            delta_.segment(first, size) -=
                0.5 * acting * (1.0 - part) * h * (result_.segment(first, size) - bounced_.segment(first, size));
    });
    struck_spins_.find(system_, begin, h, theta_, spins_, contacts_.on_velocities(), solution_.x);
    for (const StruckSpins::Spin& spin : struck_spins_.spins())
        for (std::size_t i = 0; i < 3; ++i) {
            until_impact_[spin.column + static_cast<Eigen::Index>(i)] = spin.until[i];
            delta_[spin.column + static_cast<Eigen::Index>(i)] = spin.after[i];
        }
    system_.increment(begin.q.data(), until_impact_.data(), end_.q.data());
    system_.increment(end_.q.data(), delta_.data(), end_.q.data());
}

/// The share of impacts in what the step changes each velocity by.
void ThetaMethod::mark_struck(bool struck) {
    struck_.assign(static_cast<std::size_t>(n_), 0.0);
    if (!struck) return;
    for (std::size_t k = 0; k < struck_.size(); ++k) struck_[k] = std::max(contacts_.on_velocities()[k].share, 0.0);
}

// What an impact changes at once is no acceleration: there the last ones stay, or where there are none, those without
// impacts count.
void ThetaMethod::remember_change(const Vector& result, double h) {
    const auto n = static_cast<std::size_t>(n_);
    std::vector<double>& last = changes_[0];
    std::vector<double>& before = changes_[1];
    const bool first = last.empty();
    if (before.empty()) before = last;
    last.resize(n);
    for (std::int32_t i = 0; i < n_; ++i) {
        const auto k = static_cast<std::size_t>(i);
        const bool struck = struck_[k] > mostly;
        if (struck && !first) continue;
        if (!before.empty()) before[k] = last[k];
        last[k] = ((struck ? smooth_[i] : result[i]) - free_[i]) / h;
    }
}

/// What is stiff from now on, h being the longest step. What is at the bound, as by round numbers, is not, whatever
/// rounding makes of it.
void ThetaMethod::resolve_up_to(double h) {
    constexpr double rounding = 1e-6;
    longest_h_ = h;
    stiff_.clear();
    if (h > 0.0 && settings_.holds_stiff && system_.has_stiffness())
        system_.find_stiff_forces((1.0 + rounding) * resolved_rate_ / h, stiff_);
}

/// H, D and the cones, which stay for the step.
void ThetaMethod::assemble(const State& begin, double h, bool coulomb) {
    problem_.name = "step";
    problem_.law = Law::Associated;
    turning_spins_.clear();
    move(begin, h, guess_, theta_, at_theta_);
    H_.begin(n_, n_);
    system_.add_mass(at_theta_, 1.0, H_);
    if (system_.has_stiffness()) {
        system_.add_damping(at_theta_, theta_ * h, Tangent::Symmetric, H_);
        system_.add_stiffness(at_theta_, theta_ * theta_ * h * h, Tangent::Symmetric, H_);
        if (h > longest_h_) resolve_up_to(h);
        if (!stiff_.empty())
            system_.add_stiff_tangent(at_theta_, stiff_, (1.0 - theta_ * theta_) * h * h, (1.0 - theta_) * h, H_);
    }
    H_.finish_into(problem_.H);
    D_.begin(m_, n_);
    if (m_ > 0) system_.add_constraint_jacobian(at_theta_, 0, D_);
    D_.finish_into(problem_.D);
    problem_.b.assign(static_cast<std::size_t>(m_), 0.0);
    if (problem_.cones.size() < cones_.size()) problem_.cones.resize(cones_.size());
    for (std::size_t k = 0; k < cones_.size(); ++k) copy_cone(cones_[k], problem_.cones[k]);
    solution_.lambda.assign(static_cast<std::size_t>(m_), 0.0);
    for (std::size_t i = 0; i < multipliers_.size(); ++i) solution_.lambda[i] = last_h_ * multipliers_[i];
    solution_.x.assign(guess_.begin(), guess_.end());
    contacts_.append_to(problem_, solution_.lambda, coulomb, chooses_steps_ ? last_h_ : 0.0);
    turning_spins_.find(spins_, problem_.D, m_);
}

/// a and the b of constraints for the guess; the impulse of its forces stays in force_.
void ThetaMethod::linearize(const State& begin, double h) {
    const Eigen::Map<const Vector> v(begin.v.data(), n_);
    impulse_of_forces(begin, h, guess_);
    back_ = v - guess_;
    problem_.a.assign(force_.begin(), force_.end());
    system_.multiply_mass(at_theta_, 1.0, back_.data(), problem_.a.data());
    problem_.H.multiply_add(1.0, guess_.data(), problem_.a.data());
    contacts_.add_known_impulses(problem_);
    for (Eigen::Index i = 0; i < damped_.size(); ++i) problem_.a[static_cast<std::size_t>(i)] += damped_[i];
    if (m_ > 0) set_constraint_rows(begin, h);
}

// With r̃ = C_q(q̃⁺) ṽ⁺ + C_t at the end of the guess, the rows C_q(q⁺) v⁺ + C_t = 0 are D (v⁺ − ṽ⁺) + r̃ = 0. On the
// level of velocities alone C would drift by what a step leaves of it, d = O(h³). The linearly implicit method asks for
//
//     C_q(q⁺) v⁺ + C_t = −C(q⁺)/(θ h),      C(q⁺) ≈ C(q̃⁺) + θ h D (v⁺ − ṽ⁺)
//
// that is D (v⁺ − ṽ⁺) + ½ r̃ + C(q̃⁺)/(2 θ h) = 0. For θ = ½ what C was is gone at once: C⁺ = C + ½ h (u + u⁺) + d with
// u = −2 C/h and u⁺ = −2 C⁺/h is C⁺ = d/2. (Asking for C(q⁺) = 0 instead would leave u⁺ = −u: an oscillation for ever.)
void ThetaMethod::set_constraint_rows(const State& begin, double h) {
    move(begin, h, guess_, 1.0, end_);
    end_.v.assign(guess_.begin(), guess_.end());
    rate_.resize(m_);
    system_.constraint_rate(end_, rate_.data());
    D_.begin(m_, n_);
    system_.add_constraint_jacobian(end_, 0, D_);
    D_.finish().multiply_add(1.0, guess_.data(), rate_.data());
    if (settings_.linearly_implicit) {
        constraint_.resize(static_cast<std::size_t>(m_));
        system_.constraint(end_, constraint_.data());
        rate_ = 0.5 * rate_ + Eigen::Map<const Vector>(constraint_.data(), m_) / (2.0 * theta_ * h);
    }
    for (std::int32_t row = 0; row < m_; ++row)
        problem_.b[static_cast<std::size_t>(row)] = rate_[row] - problem_.D.row_times(row, guess_.data());
}

/// What the impulse of stiff forces differs by from that of at_theta_, which is at the middle of the motion.
void ThetaMethod::add_stiff_impulse(const State& begin, double h, const Vector& last, Vector& impulse) {
    move(begin, h, last, 1.0, beyond_);
    delta_ = (1.0 - theta_) * h * last;
    system_.increment(beyond_.q.data(), delta_.data(), beyond_.q.data());
    beyond_.v.assign(last.begin(), last.end());
    beyond_.t += (1.0 - theta_) * h;
    system_.stiff_tensions(beyond_, stiff_, tensions_);
    system_.stiff_tensions(at_theta_, stiff_, tensions_at_theta_);
    for (std::size_t i = 0; i < stiff_.size(); ++i) tensions_[i] -= tensions_at_theta_[i];
    system_.add_stiff_forces(at_theta_, stiff_, tensions_, h, impulse.data());
}

// At θ = ½ a spring gets back what it gives, and a dashpot takes c u²: the tension at θ times the way is what changes
// its energy. What the tension beyond the step adds to that is lost to its length.
double ThetaMethod::lost_by_stiff_forces(const State& begin, double h, const Vector& last) {
    move(begin, h, last, theta_, at_theta_);
    linear_.setZero(n_);
    add_stiff_impulse(begin, h, last, linear_);
    return -linear_.dot((1.0 - theta_) * Eigen::Map<const Vector>(begin.v.data(), n_) + theta_ * last);
}

/// force_ ← h f for the velocities `last` at the end, at at_theta_, where spinning bodies have their own impulse
/// instead of what they feel alone.
void ThetaMethod::impulse_of_forces(const State& begin, double h, const Vector& last) {
    move(begin, h, last, theta_, at_theta_);
    force_.setZero(n_);
    system_.add_force(at_theta_, h, force_.data());
    if (!stiff_.empty()) add_stiff_impulse(begin, h, last, force_);
    for (std::size_t k = 0; k < spins_.size(); ++k)
        for (std::size_t i = 0; i < 3; ++i)
            force_[spins_[k].column + static_cast<std::int32_t>(i)] +=
                spins_[k].impulse[i] - h * theta_spins_[k].torque[i];
}

/// What contacts do in the step as it is solved. A linearly implicit step moves contacts that overlap apart; of such
/// work, where nothing bounces, nothing is said.
ContactWork ThetaMethod::work_of_contacts(const State& begin) {
    if (!contacts_.any() || !guess_.allFinite()) return {};
    if (settings_.linearly_implicit && !contacts_.any_bounce(solution_)) return {};
    back_ = (1.0 - theta_) * Eigen::Map<const Vector>(begin.v.data(), n_) +
            theta_ * Eigen::Map<const Vector>(solution_.x.data(), n_);
    const double work = contacts_.work(problem_, solution_, {back_.data(), static_cast<std::size_t>(n_)});
    return energy_.with(work, at_theta_, begin.v, solution_.x, problem_);
}

/// The step's velocities and impulses, about the guess of find_spins() and extrapolate().
void ThetaMethod::solve_step(const State& begin, double h, StepSolver& solver, StepReport& report) {
    const bool before = report.solved;
    first_guess_ = guess_;
    bool only_takes = false;
    const auto solve_with = [&](double restitution) {
        guess_ = first_guess_;
        timed_ = false;
        damped_.resize(0);
        bounced_.resize(0);
        report.solved = before;
        contacts_.collect(begin, h, theta_, restitution);
        assemble(begin, h, solver.law() == Law::Coulomb);
        if (only_takes) contacts_.only_take();
        if (settings_.linearly_implicit) {
            solve_once(begin, h, solver, report);
        } else {
            iterate(begin, h, solver, report);
        }
        return work_of_contacts(begin);
    };
    if (!solve_without_gain(solve_with).gains()) return;
    only_takes = true;
    solve_with(0.0);
}

void ThetaMethod::set_b_of_contacts(int iteration, const StepReport& report) {
    contacts_.set_b(problem_, solution_, {guess_.data(), static_cast<std::size_t>(n_)}, iteration, report.natural);
}

// Right-hand sides in √mass · speed: a by the diagonal of H, b by that of D diag(H)⁻¹ Dᵀ.
void ThetaMethod::scale() {
    diagonal_of(problem_.H, diagonal_);
    row_scale_.resize(problem_.m());
    for (std::int32_t j = 0; j < problem_.m(); ++j)
        row_scale_[j] = mobility_of(problem_.D, diagonal_, static_cast<std::size_t>(j));
}

/// Whether the right-hand sides differ from those of the last solve by a negligible share.
bool ThetaMethod::unchanged() const {
    double change = 0.0, size = 0.0;
    for (std::size_t i = 0; i < diagonal_.size(); ++i) {
        const double a = problem_.a[i], difference = a - last_a_[i];
        change += difference * difference / diagonal_[i];
        size += a * a / diagonal_[i];
    }
    for (std::int32_t j = 0; j < problem_.m(); ++j) {
        const double difference = problem_.b[static_cast<std::size_t>(j)] - last_b_[static_cast<std::size_t>(j)];
        if (row_scale_[j] > 0.0) change += difference * difference / row_scale_[j];
    }
    return change <= settings_.tolerance * settings_.tolerance * size;
}

void ThetaMethod::iterate(const State& begin, double h, StepSolver& solver, StepReport& report) {
    if (contacts_.any() && contacts_.may_strike()) time_meetings(begin, h, solver, report);
    scale();
    const bool before = report.solved;
    int revised = 0;  // the iteration that solves the problem which the answers before have changed
    for (int iteration = 0;; ++iteration) {
        linearize(begin, h);
        set_b_of_contacts(iteration, report);
        if (iteration > revised && (unchanged() || (iteration >= settings_.iterations && contacts_.settled()))) return;
        if (iteration == most_iterations) {
            report.solved = false;
            report.message = "the speeds of sliding contacts did not settle";
            return;
        }
        last_a_.assign(problem_.a.begin(), problem_.a.end());
        last_b_.assign(problem_.b.begin(), problem_.b.end());
        report.solved = before;
        const bool solved = solve(solver, report);
        solved_from_ = guess_;
        solved_force_ = force_;
        guess_ = Eigen::Map<const Vector>(solution_.x.data(), n_);
        if (iteration == 0 && solved && contacts_.any_turns_round(problem_, solution_)) {
            time_turns(solver, report);
            revised = 1;
        }
        if (iteration == 0 && timed_ && revise_impacts(h)) revised = 1;
        if (iteration == revised && go_on_after_bounces()) ++revised;
        if (!guess_.allFinite() || !solved) return;
    }
}

/// The velocities at the end of the step about the guess if nothing met.
Vector ThetaMethod::without_impacts(const State& begin, double h, StepSolver& solver, StepReport& report) {
    linearize(begin, h);
    set_b_of_contacts(0, report);
    Problem problem = problem_;
    contacts_.take_out_open(problem);
    Solution solution{.x = {guess_.begin(), guess_.end()}, .lambda = std::vector<double>(problem.b.size(), 0.0)};
    ++report.newton_iterations;
    report.take(solver.solve(std::move(problem), solution, request_));
    return Eigen::Map<const Vector>(solution.x.data(), n_);
}

/// Of a step that is solved: when what slides turns round.
void ThetaMethod::time_turns(StepSolver& solver, StepReport& report) {
    Problem problem = problem_;
    contacts_.let_slide_on(problem);
    Solution solution = solution_;
    ++report.newton_iterations;
    if (report.take(solver.solve(std::move(problem), solution, request_)))
        contacts_.time_turns(problem_, solution.x, 0.0);
}

void ThetaMethod::time_meetings(const State& begin, double h, StepSolver& solver, StepReport& report) {
    smooth_ = guess_;
    if (changes_[0].empty() && contacts_.may_strike()) smooth_ = without_impacts(begin, h, solver, report);
    contacts_.time_meetings(problem_, {smooth_.data(), static_cast<std::size_t>(n_)}, curve_of_spins(begin, h),
                            changes_[0], last_h_);
    timed_ = true;
}

// Through the speeds ω, ω½ and ω⁺ of a free spin at the beginning, the middle and the end runs the parabola with c = 2
// (ω − 2 ω½ + ω⁺)/h².
std::span<const double> ThetaMethod::curve_of_spins(const State& begin, double h) {
    curve_.clear();
    if (spins_.empty() || !contacts_.may_strike()) return curve_;
    system_.free_spins(begin, 0.5 * h, half_spins_);
    curve_.assign(static_cast<std::size_t>(n_), 0.0);
    for (std::size_t k = 0; k < spins_.size(); ++k)
        for (std::size_t i = 0; i < 3 && spins_[k].alone; ++i) {
            const std::size_t column = static_cast<std::size_t>(spins_[k].column) + i;
            curve_[column] = 2.0 * (begin.v[column] - 2.0 * half_spins_[k].speed[i] + spins_[k].speed[i]) / (h * h);
        }
    return curve_;
}

// Forces that depend on velocities are not the same before and after an impact. With the derivative −C of what they
// are, the way h v_θ + x that an answer gives (VelocityContacts::find_impacts()) changes their impulse by −C x, and
// from the impact on they differ by −C (v⁺ − ṽ) from those of ṽ.
/// Of a step that is solved: whether impacts change what acts besides them.
bool ThetaMethod::revise_impacts(double h) {
    if (!contacts_.any_impact(solution_)) return false;
    if (!system_.has_stiffness()) return contacts_.revise_impacts(problem_, solution_, {});
    const auto n = static_cast<std::size_t>(n_);
    Solution answer = solution_;
    contacts_.add_known_impulses(answer.lambda);
    if (!contacts_.find_impacts(problem_, answer)) return false;
    SparseMatrix C;
    H_.begin(n_, n_);
    system_.add_damping(at_theta_, 1.0, Tangent::Symmetric, H_);
    H_.finish_into(C);
    back_ = Eigen::Map<const Vector>(solution_.x.data(), n_) - smooth_;
    linear_.setZero(n_);
    C.multiply_add(-1.0, back_.data(), linear_.data());
    for (std::size_t k = 0; k < n; ++k) back_[static_cast<Eigen::Index>(k)] *= h * contacts_.on_velocities()[k].late;
    damped_.setZero(n_);
    C.multiply_add(-1.0, back_.data(), damped_.data());
    const bool others = contacts_.revise_impacts(problem_, solution_, {linear_.data(), n});
    return others || !damped_.isZero(0.0);
}

bool ThetaMethod::go_on_after_bounces() {
    if (!contacts_.go_on_after_bounces(problem_, solution_)) return false;
    bounced_ = Eigen::Map<const Vector>(solution_.x.data(), n_);
    return true;
}

// One problem. Two in the first step, which has no history to extrapolate from, and where contacts become persistent; a
// few where a contact strikes with friction and the solver does not know Coulomb's law.
void ThetaMethod::solve_once(const State& begin, double h, StepSolver& solver, StepReport& report) {
    if (contacts_.any()) {
        time_meetings(begin, h, solver, report);
        contacts_.time_turns(problem_, {guess_.data(), static_cast<std::size_t>(n_)}, last_h_);
    }
    const auto linearize_at_guess = [&] {
        linearize(begin, h);
        solved_from_ = guess_;
        solved_force_ = force_;
        set_b_of_contacts(0, report);
    };
    const auto found = [&] {
        if (!solve(solver, report)) return false;
        guess_ = Eigen::Map<const Vector>(solution_.x.data(), n_);
        return guess_.allFinite();
    };
    linearize_at_guess();
    if (!found()) return;
    const bool persists = contacts_.make_persistent(solution_);
    if ((timed_ && revise_impacts(h)) || changes_[0].empty() || persists) {
        linearize_at_guess();
        if (!found()) return;
    }
    if (timed_ && go_on_after_bounces()) {
        linearize_at_guess();
        if (!found()) return;
    }
    for (int iteration = 1; iteration <= most_iterations; ++iteration) {
        set_b_of_contacts(iteration, report);
        if (contacts_.settled()) return;
        if (!found()) return;
    }
    report.solved = false;
    report.message = "the speeds of sliding contacts did not settle";
}

bool ThetaMethod::solve(StepSolver& solver, StepReport& report) {
    ++report.newton_iterations;
    const StepAnswer answer = solver.solve(problem_, solution_, request_);
    left_.assign(answer.left_in_masses.begin(), answer.left_in_masses.end());
    if (settings_.linearly_implicit) contacts_.resolution().note(answer.left);
    return report.take(answer);
}

// With the mean velocities v̄ of the step, an impulse P along rows D changes the kinetic energy by P·D v̄. All of it is
// supplied by constraints that have a given rate.
void ThetaMethod::account(const State& begin, double h, StepReport& report) {
    back_ = 0.5 * (Eigen::Map<const Vector>(begin.v.data(), n_) + result_);
    const auto [work, supplied, turnover, doubt] =
        contacts_.account(problem_, solution_, {back_.data(), static_cast<std::size_t>(n_)});
    report.energy.work = work;
    report.energy.supplied = supplied;
    report.energy.turnover = turnover;
    report.energy.doubt = doubt;
    if (!system_.is_driven()) return;
    const auto add = [&](double energy) {
        report.energy.supplied += energy;
        report.energy.turnover += std::abs(energy);
    };
    move(begin, h, result_, theta_, at_theta_);
    at_theta_.v.assign(back_.begin(), back_.end());
    add(h * system_.supplied_power(at_theta_));
    if (m_ == 0) return;
    rate_.resize(m_);
    system_.constraint_rate(at_theta_, rate_.data());
    for (std::int32_t row = 0; row < m_; ++row)
        if (rate_[row] != 0.0)
            add(solution_.lambda[static_cast<std::size_t>(row)] * problem_.D.row_times(row, back_.data()));
}

// Where steps are chosen by their error, the solver must not disturb it.
void ThetaMethod::note_velocity_error(const State& begin, double h) {
    request_ = {.warm_start = true, .bodies = bodies_};
    velocity_error_.note(begin.v, left_, last_h_, h);
    if (chooses_steps_) return;
    request_.method_error = velocity_error_.known();
    request_.error_of_solves = velocity_error_.of_solver();
}

// The linear model of the last problem had h f = h f̃ − (H − M) (v⁺ − ṽ⁺).
void ThetaMethod::judge_linearization(const State& begin, double h, const Vector& result, StepSolver& solver,
                                      StepReport& report) {
    impulse_of_forces(begin, h, result);
    back_ = result - solved_from_;
    linear_ = solved_force_;
    problem_.H.multiply_add(-1.0, back_.data(), linear_.data());
    system_.multiply_mass(at_theta_, 1.0, back_.data(), linear_.data());
    const auto n = static_cast<std::size_t>(n_);
    linearization_.judge(begin, end_, h, {force_.data(), n}, {linear_.data(), n}, problem_.H, settings_.name, solver,
                         report);
}

// A row's C at the end is what the linear model of its step missed. Beyond linearization_limit times the way of what it
// holds, and where it grows, the step was too long for the model.
void ThetaMethod::judge_constraints(const State& begin, double h) {
    ways_.find(problem_, begin, end_, left_);
    system_.constraint(begin, constraint_.data());
    double before = ways_.digits();
    for (const double C : constraint_) before = std::max(before, std::abs(C));
    system_.constraint(end_, constraint_.data());
    for (std::size_t row = 0; row < constraint_.size(); ++row) {
        const double off = std::abs(constraint_[row]);
        if (off <= 2.0 * before) continue;
        const double allowed = settings_.linearization_limit * ways_.of(problem_.D, row);
        if (off <= allowed) continue;
        throw StepTooLong(fmt::format(
            "{} cannot take the step from t = {:.9g} with h = {:.9g}: it leaves a constraint off by {:.2g}, where "
            "linearization_limit, {:.2g}, times the way of what it holds is {:.2g}; take shorter steps, or a method "
            "that iterates (euler_implicit, hht)",
            settings_.name, begin.t, h, off, settings_.linearization_limit, allowed));
    }
}

}  // namespace delassus
