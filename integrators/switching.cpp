// SPDX-License-Identifier: BSD-3-Clause
// A method of high order while nothing touches, and Moreau and Jean's while something does. Impacts are located.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "delassus/adaptive_stepping.hpp"
#include "dynamics/memory.hpp"
#include "dynamics/theta_method.hpp"

namespace delassus {
namespace {

// ---- What a step is made of ----
//
// Methods that find contacts within a step (Moreau and Jean, Acary and Brogliato 2008, ch. 10) have order 2 at best,
// and at an impact with fixed steps order 1: it is early or late by up to a step. Methods that look for each event
// (ch. 8 there) are exact, and have no end where events accumulate. So a step takes the one way while it pays and the
// other one for the rest:
//
//     flight     nothing touches: Dormand and Prince's method or Radau's, in parts by its estimate, as AdaptiveStepping
//                has it, until a gap closes;
//     impact     the part in which it does is taken again up to the time at which it closes; then a step of 10⁻⁶ h of
//                Moreau and Jean's method, in which velocities jump;
//     contact    while something pushes: a step of Moreau and Jean's method for all that is left of h.
//
// After most_impacts impacts within a step all that is left of it is contact, so that what bounces ever sooner comes
// to rest in finite time.
//
// ---- What touches ----
//
// A block touches whose gap g is closed and does not open by itself: its speed u is below half of what forces take in
// the rest r of the step, ½ a r, so that it would close again. Here a is the acceleration with which forces alone, such
// as springs, close it, but at least that of weight. A contact that pushed in the step before may be open by what that
// step left: it touches still where g + u r ≤ ½ a r² and |u| ≤ a r. Rows that are no gaps (dry friction, limited motors
// and servos) always act: with them every step is one of contact. A closed gap that closes by more than a r is an
// impact, which gets a step of its own length before the rest.
//
// ---- When a gap closes ----
//
// At the end of each part of a flight gaps are looked at. One that is below 0, and below what it was where the part
// began, has closed. With its speed a Newton step gives the time, and a step of the flight from the beginning of the
// part the state there; a bracket keeps Newton's iteration safe where gaps have corners. It ends on the open side, with
// a gap within its resolution. Parts are no longer than 1.02 times what the first gap needs to close at the speeds of
// their beginning, and no coordinate goes further than half a unit (rad or m), as what is ahead is looked for along
// straight lines: so shapes are not passed through. What closes and opens again within a part is not seen: at most a
// r²/8 deep at the relative acceleration a.
class Switching : public Timestepper {
public:
    Switching(DynamicalSystem& system, const std::vector<OptionValue>& values)
        : system_(system),
          flight_name_(values[0].text),
          given_limit_(values[1].real),
          limit_(given_limit_),
          contact_(system, ThetaSettings{.name = "switching",
                                         .holds_stiff = false,  // flights resolve what a step would leave in them
                                         .iterations = static_cast<int>(values[2].integer),
                                         .contacts = velocity_contact_settings(system, values[3], values[4]),
                                         .linearization_limit = values[5].real}),
          resolution_(system.gap_resolution()),
          fall_(system.free_fall()) {
        const auto& table = timesteppers();
        const auto row =
            std::find_if(table.begin(), table.end(), [&](const auto& one) { return one.name == flight_name_; });
        flight_ = row->make(system, resolve_options(row->name, row->options, {}));
    }

    [[nodiscard]] int order() const override { return 2; }
    [[nodiscard]] bool estimates_error() const override { return true; }
    /// What is supplied in flight is not known.
    [[nodiscard]] bool accounts() const override { return !system_.is_driven(); }
    void choose_steps(double tolerance) override {
        limit_ = std::isfinite(tolerance) ? tolerance : given_limit_;
        if (!control_) return;
        const std::vector<double> memory = control_->save();
        control_.reset();
        control(control_step_).load(memory);
    }

    void restart() override {
        multipliers_.clear();
        flight_->restart();
        contact_.restart();
        control_.reset();
        pushed_.clear();
        longest_ = std::numeric_limits<double>::infinity();
        seen_known_ = false;
    }
    void forces_jumped() override {
        flight_->forces_jumped();
        contact_.forces_jumped();
        control_.reset();
    }

    // The longest step of contact; the step of the control, and what it keeps; how many numbers the flight keeps, and
    // these; how many blocks pushed, and their keys; what the contact method keeps.
    [[nodiscard]] std::vector<double> save() const override {
        std::vector<double> memory = {std::isfinite(longest_) ? longest_ : 0.0, control_ ? control_step_ : 0.0};
        const auto append = [&](const std::vector<double>& values) {
            memory.insert(memory.end(), values.begin(), values.end());
        };
        if (control_) {
            const std::vector<double> control = control_->save();
            memory.push_back(static_cast<double>(control.size()));
            append(control);
        }
        const std::vector<double> flight = flight_->save();
        memory.push_back(static_cast<double>(flight.size()));
        append(flight);
        memory.push_back(static_cast<double>(pushed_.size()));
        for (const std::uint64_t key : pushed_) {
            memory.push_back(static_cast<double>(key >> 32U));
            memory.push_back(static_cast<double>(key & 0xffffffffU));
        }
        append(contact_.save());
        return memory;
    }

    void load(const std::vector<double>& memory) override {
        restart();
        std::span<const double> rest = memory;
        const auto take = [&](double count) {
            const auto taken = take_from(rest, static_cast<std::size_t>(count), "switching");
            return std::vector<double>(taken.begin(), taken.end());
        };
        if (const double longest = take(1)[0]; longest > 0.0) longest_ = longest;
        if (const double step = take(1)[0]; step > 0.0) {
            control(step);
            control_->load(take(take(1)[0]));
        }
        flight_->load(take(take(1)[0]));
        const std::vector<double> keys = take(2.0 * take(1)[0]);
        for (std::size_t k = 0; k < keys.size(); k += 2)
            pushed_.push_back((static_cast<std::uint64_t>(keys[k]) << 32U) | static_cast<std::uint64_t>(keys[k + 1]));
        contact_.load({rest.begin(), rest.end()});
    }

private:
    /// Of a step: how long the step of an impact is, and what is left after it at least.
    static constexpr double impact_share = 1e-6, least_rest = 1e-3;
    /// Impacts that are located in a step.
    static constexpr int most_impacts = 8;

    void take_step(State& state, double h, StepSolver& solver, StepReport& report) override {
        require_step(system_, state, h, "switching");
        now_ = state;
        h_ = h;
        end_ = state.t + h;
        acted_.clear();
        errors_.assign(state.v.size(), 0.0);
        errors_known_ = true;
        impacts_ = 0;
        while (now_.t < end_) {
            const double rest = end_ - now_.t;
            look(now_, rest);
            if (impacts_ <= most_impacts && meets(rest)) {
                ++impacts_;
                touch(std::min(impact_share * h_, rest), solver, report);
            } else if (impacts_ > most_impacts || touches(rest)) {
                touch(rest, solver, report);
            } else {
                fly(solver, report);
            }
        }
        give(report);
        report.multipliers = multipliers_;
        std::swap(state, now_);
    }

    // ---- Contact ----

    // The midpoint rule and the trapezoidal rule differ by h³ v‴/12 · ½, and the first errs by half as much. It is
    // compared with the velocities, or with what accelerations give in the step, in the norm of the mass; accelerations
    // are those without contacts.
    /// By what factor a step of contact from `begin` to `end` errs more than it may; 0 where the system does not know
    /// its accelerations.
    [[nodiscard]] double error_of_contact(const State& begin, const State& end) {
        constexpr double most = 1e-4;
        const double h = end.t - begin.t;
        trial_ = begin;
        trial_.t += 0.5 * h;
        for (std::size_t i = 0; i < trial_.v.size(); ++i) trial_.v[i] = 0.5 * (begin.v[i] + end.v[i]);
        change_.assign(trial_.v.begin(), trial_.v.end());
        for (double& entry : change_) entry *= 0.5 * h;
        system_.increment(begin.q.data(), change_.data(), trial_.q.data());
        std::fill(change_.begin(), change_.end(), 0.0);
        acceleration_.resize(change_.size());
        for (const auto& [state, factor] : {std::pair(&begin, 0.5), {&end, 0.5}, {&std::as_const(trial_), -1.0}}) {
            if (!system_.accelerate(*state, acceleration_.data())) return 0.0;
            given_.assign(acceleration_.begin(), acceleration_.end());
            for (double& entry : given_) entry *= h;
            for (std::size_t i = 0; i < change_.size(); ++i) change_[i] += factor * given_[i];
        }
        const double moving =
            std::max({energy_norm(trial_, begin.v), energy_norm(trial_, end.v), energy_norm(trial_, given_)});
        return moving > 0.0 ? energy_norm(trial_, change_) / (most * moving) : 0.0;
    }

    [[nodiscard]] double energy_norm(const State& at, const std::vector<double>& v) {
        return std::sqrt(std::max(2.0 * kinetic_energy(system_, at, v, acceleration_), 0.0));
    }

    /// now_ ← after a step of the contact method, which may be as short as its error wants it. Its size.
    double take_contact(double h, StepSolver& solver) {
        constexpr double shortest = 1.0 / 64.0, most_growth = 2.0;
        const double least = shortest * h_;
        double tried = longest_ < h ? h / std::ceil(h / longest_) : h;
        while (true) {
            State next = now_;
            const std::vector<double> memory = contact_.save();
            contact_.step(next, tried, solver, part_);
            const double error = error_of_contact(now_, next);
            if (!(error > 1.0) || tried <= least) {
                const double wanted = tried * std::min(most_growth, 0.9 / std::sqrt(std::max(error, 1e-6)));
                longest_ = wanted < h_ ? std::max(wanted, least) : std::numeric_limits<double>::infinity();
                std::swap(now_, next);
                return tried;
            }
            contact_.load(memory);
            longest_ = std::max(tried * std::max(0.9 / std::sqrt(error), 0.25), least);
            tried = tried / std::ceil(tried / longest_);
        }
    }

    /// A step of the contact method of at most this size.
    void touch(double longest, StepSolver& solver, StepReport& report) {
        const double rest = end_ - now_.t, begin = now_.t;
        const double h = take_contact(longest, solver);
        now_.t = h == rest ? end_ : begin + h;
        pushed_.clear();
        for (const auto& [key, force] : part_.reactions)
            if (force[0] > 0.0) pushed_.push_back(key);
        std::sort(pushed_.begin(), pushed_.end());
        add(part_, h / h_);
        errors_known_ = errors_known_ && (h <= impact_share * h_ || !part_.error.empty());
        for (std::size_t i = 0; i < part_.error.size(); ++i) errors_[i] += part_.error[i];
        part_.follow(report);
        std::swap(part_, report);
        multipliers_ = report.multipliers;
    }

    /// What acted, as a mean over the whole step.
    void add(const StepReport& part, double share) {
        const std::size_t first_contact = part.reactions.size() - part.contacts.size();
        for (std::size_t k = 0; k < part.reactions.size(); ++k) {
            const BlockReaction& one = part.reactions[k];
            auto known = std::find_if(acted_.begin(), acted_.end(),
                                      [&](const Acted& other) { return other.reaction.key == one.key; });
            if (known == acted_.end()) {
                acted_.push_back({{one.key, {}}, {}, k >= first_contact});
                known = acted_.end() - 1;
            }
            for (std::size_t i = 0; i < one.force.size(); ++i) known->reaction.force[i] += share * one.force[i];
            if (k >= first_contact) known->contact = part.contacts[k - first_contact];
        }
    }

    /// Contacts are last.
    void give(StepReport& report) {
        report.reactions.clear();
        report.contacts.clear();
        report.active_blocks = 0;
        for (const bool contacts : {false, true})
            for (const Acted& one : acted_) {
                if (one.is_contact != contacts) continue;
                report.reactions.push_back(one.reaction);
                if (contacts) report.contacts.push_back(one.contact);
                if (one.reaction.force[0] != 0.0) ++report.active_blocks;
            }
        report.impact_speed = report.impact_time = 0.0;  // nobody has to look for them
        report.doubtful_speed = report.second_impact_cut = report.cut = 0.0;
        report.error.clear();
        if (errors_known_) report.error = errors_;
    }

    // ---- Gaps ----

    /// rows_ ← at a state, for what may touch within h.
    void look(const State& at, double h) {
        if (seen_known_ && seen_h_ == h && seen_.t == at.t && seen_.q == at.q && seen_.v == at.v) return;
        rows_.clear();
        seen_ = at;
        seen_h_ = h;
        seen_known_ = true;
        if (!system_.has_unilateral()) return;
        rows_.measure_speeds_at(seen_.v.data());
        system_.collect_unilateral(seen_, h, rows_);
        accelerations_known_ = false;
    }

    /// visit(block, gap, the number of its first row)
    template <class Visit>
    void for_each_gap(Visit visit) const {
        std::size_t row = 0;
        for (const auto& block : rows_.blocks()) {
            if (block.along_normal()) visit(block, rows_.rows()[row].gap, row);
            row += static_cast<std::size_t>(block.cone.rows);
        }
    }

    /// With which forces close a row of rows_, at least that of weight, m/s² or rad/s².
    [[nodiscard]] double closing_acceleration(std::size_t row) {
        if (!accelerations_known_) {
            seen_accelerations_.resize(seen_.v.size());
            if (!system_.accelerate(seen_, seen_accelerations_.data())) seen_accelerations_.clear();
            accelerations_known_ = true;
        }
        if (seen_accelerations_.empty()) return fall_;
        return std::max(fall_, rows_.rows()[row].rate - rows_.speed(row, seen_accelerations_.data()));
    }

    [[nodiscard]] static bool holds(const std::vector<std::uint64_t>& keys, std::uint64_t key) {
        return std::binary_search(keys.begin(), keys.end(), key);
    }

    /// Whether a closed gap in rows_ closes faster than by forces: an impact, now.
    [[nodiscard]] bool meets(double rest) {
        bool found = false;
        for_each_gap([&](const UnilateralRows::Block& block, double gap, std::size_t row) {
            if (found || std::abs(gap) > resolution_ || !(block.speed < -resolution_ / rest)) return;
            found = block.speed < -closing_acceleration(row) * rest;
        });
        return found;
    }

    /// Whether something in rows_ acts for the rest of the step.
    [[nodiscard]] bool touches(double rest) {
        const auto& blocks = rows_.blocks();
        if (std::any_of(blocks.begin(), blocks.end(), [](const auto& block) { return !block.along_normal(); }))
            return true;
        bool found = false;
        for_each_gap([&](const UnilateralRows::Block& block, double gap, std::size_t row) {
            const bool closed = gap <= resolution_;
            if (found || !(closed || holds(pushed_, block.key))) return;
            const double slow = closing_acceleration(row) * rest;
            const bool stays = closed && block.speed <= 0.5 * slow;
            const bool returns = gap + block.speed * rest <= 0.5 * slow * rest && std::abs(block.speed) <= slow;
            found = stays || (returns && holds(pushed_, block.key));
        });
        return found;
    }

    /// In what time the first gap in rows_ closes at the speeds there; infinity: none.
    [[nodiscard]] double time_to_closing() const {
        double soonest = std::numeric_limits<double>::infinity();
        for_each_gap([&](const UnilateralRows::Block& block, double gap, std::size_t) {
            if (gap > resolution_ && block.speed < 0.0) soonest = std::min(soonest, gap / -block.speed);
        });
        return soonest;
    }

    /// What is left of a gap until it has closed: of one that a flight begins with below 0, until it is deeper.
    [[nodiscard]] double left_of(std::uint64_t key, double gap) const {
        const auto deep = std::lower_bound(deep_.begin(), deep_.end(), std::pair(key, -HUGE_VAL));
        return deep != deep_.end() && deep->first == key ? gap - deep->second : gap;
    }

    /// Whether one of rows_ has closed. since: how long ago at the speeds there, the longest.
    [[nodiscard]] bool has_closed(double& since) const {
        bool found = false;
        since = 0.0;
        for_each_gap([&](const UnilateralRows::Block& block, double gap, std::size_t) {
            const double left = left_of(block.key, gap);
            if (left >= -resolution_) return;
            found = true;
            since = std::max(since, block.speed < 0.0 ? left / block.speed : std::numeric_limits<double>::infinity());
        });
        return found;
    }

    // ---- Flight ----

    AdaptiveStepping& control(double h) {
        constexpr double largest = 1e6;
        if (!control_) {
            control_step_ = h;
            StepControl control = StepControl::within(limit_, h);
            control.largest = largest * h;
            control.finds_impacts = false;
            control_ = std::make_unique<AdaptiveStepping>(system_, *flight_, control);
        }
        return *control_;
    }

    /// A part of a flight from now_, and the impact in which it ends, if there is one.
    void fly(StepSolver& solver, StepReport& report) {
        constexpr double beyond = 1.02, turn = 0.5, shortest = 1.0 / 64.0;
        deep_.clear();
        for_each_gap([&](const UnilateralRows::Block& block, double gap, std::size_t) {
            if (gap < -resolution_) deep_.emplace_back(block.key, gap);
        });
        std::sort(deep_.begin(), deep_.end());
        double fastest = 0.0;
        for (const double speed : now_.v) fastest = std::max(fastest, std::abs(speed));
        const double reach = std::max(std::min(beyond * time_to_closing(), turn / fastest), shortest * h_);
        State next = now_;
        AdaptiveStepReport taken;
        try {
            taken = control(h_).step(next, std::min(end_, now_.t + reach), solver);
        } catch (const StepFailure&) {  // as where a mechanism jams, which the other method may pass
            restart_flight();
            touch(end_ - now_.t, solver, report);
            return;
        }
        contact_.add_error_of_last(now_, next, errors_);
        contact_.restart();
        pushed_.clear();
        report.newton_iterations += taken.step.newton_iterations;
        report.solved = report.solved && taken.step.solved;
        if (!taken.step.solved) report.message = taken.step.message;
        multipliers_ = taken.step.multipliers;
        const double rest = end_ - next.t;
        look(next, rest > 0.0 ? rest : h_);
        double since = 0.0;
        if (!has_closed(since)) {
            std::swap(now_, next);
            return;
        }
        locate(next.t - now_.t, since, solver, report);
        ++impacts_;
        const double left = end_ - now_.t, impact = impact_share * h_;
        // An impact at the very end is left to the next step.
        if (left > 0.0) touch(left <= least_rest * h_ ? left : impact, solver, report);
    }

    void restart_flight() {
        flight_->restart();
        control_.reset();
    }

    /// now_ ← where the first gap closes, within `length` from now_, from the open side; since: as in has_closed() at
    /// the end of the part.
    void locate(double length, double since, StepSolver& solver, StepReport& report) {
        constexpr int most = 60;
        constexpr double rounding = 1e-13;
        double open = 0.0, closed = length, guess = length - since;
        const State begin = now_;
        for (int i = 0; i < most && closed - open > rounding * length; ++i) {
            if (!(guess > open && guess < closed)) guess = 0.5 * (open + closed);
            State trial = begin;
            flight_->restart();
            flight_->step(trial, guess, solver, part_);
            report.newton_iterations += part_.newton_iterations;
            look(trial, closed - guess);
            if (has_closed(since)) {
                closed = guess;
                guess -= since;
                continue;
            }
            open = guess;
            std::swap(now_, trial);
            double least = std::numeric_limits<double>::infinity(), soonest = least;
            for_each_gap([&](const UnilateralRows::Block& block, double gap, std::size_t) {
                if (block.speed >= 0.0) return;
                const double left = left_of(block.key, gap);
                least = std::min(least, left);
                soonest = std::min(soonest, left / -block.speed);
            });
            if (least <= resolution_) break;
            guess = open + soonest;
        }
        flight_->restart();
    }

    /// What acted in a block over the step.
    struct Acted {
        BlockReaction reaction;
        ContactPoint contact;
        bool is_contact;
    };

    DynamicalSystem& system_;
    std::string flight_name_;
    double given_limit_, limit_;
    std::unique_ptr<Timestepper> flight_;
    ThetaMethod contact_;
    double resolution_, fall_;
    std::unique_ptr<AdaptiveStepping> control_;  // of flights; made in the first one
    double control_step_ = 0.0;                  // the step for which it was made
    std::vector<std::uint64_t> pushed_;  // keys of what pushed in the last step of the contact method; ascending
    double longest_ = std::numeric_limits<double>::infinity();  // step of contact, s
    // Of the step that is taken:
    double h_ = 0.0, end_ = 0.0;
    int impacts_ = 0;
    State now_;
    std::vector<std::pair<std::uint64_t, double>> deep_;  // gaps that are below 0 where a flight begins, by their keys
    std::vector<Acted> acted_;
    std::vector<double> errors_;  // of steps of contact; flights err by less than they may
    bool errors_known_ = true;    // of all
    StepReport part_;
    State trial_;
    std::vector<double> change_, given_, acceleration_;
    // The last look:
    UnilateralRows rows_;
    State seen_;
    double seen_h_ = 0.0;
    bool seen_known_ = false, accelerations_known_ = false;
    std::vector<double> seen_accelerations_;  // of forces alone; empty where the system does not know them
};

std::vector<OptionInfo> switching_options() {
    return {{.key = "flight",
             .type = DELASSUS_OPTION_CHOICE,
             .default_value = "dormand_prince",
             .choices = {"dormand_prince", "radau_iia"},
             .doc = "the method while nothing touches; radau_iia for stiff forces"},
            {.key = "error_limit",
             .type = DELASSUS_OPTION_REAL,
             .default_value = "1e-4",
             .minimum = std::numeric_limits<double>::min(),
             .maximum = 1.0,
             .unit = "m, rad",
             .doc = "of flights: a tolerance by which they are taken in parts"},
            {.key = "iterations",
             .type = DELASSUS_OPTION_INTEGER,
             .default_value = "2",
             .minimum = 1.0,
             .maximum = 50.0,
             .doc = "of Newton's method in steps of contact, as of moreau_jean"},
            recovery_speed_option(),
            restitution_speed_option(),
            linearization_option()};
}

const RegisterTimestepper switching_row{
    {.name = "switching",
     .description =
         "dormand_prince or radau_iia while nothing touches, moreau_jean while something does; locates impacts",
     .options = switching_options(),
     .constraints = true,
     .unilateral = true,
     .order = 2,
     .make = [](DynamicalSystem& system, const std::vector<OptionValue>& values) -> std::unique_ptr<Timestepper> {
         return std::make_unique<Switching>(system, values);
     }}};

}  // namespace
}  // namespace delassus
