// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/velocity_contacts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "dynamics/row_entries.hpp"
#include "problem/copy_cone.hpp"

namespace delassus {

// ---- Where D is taken ----
//
// The velocities at the end of the step shall obey u⁺ = D(q⁺) v⁺, and the impulse P acts along D(q(t))ᵀ over the step.
// A problem has one D for both. With D taken at q̄ = q ∘ exp(θ h v) the impulse has the direction of the middle of the
// step (θ = ½: an error of order h² in a step of smooth motion, for P = O(h)), and the row is made that of the end by
//
//     u⁺ = D̄ v⁺ + (D(q⁺) − D̄) ṽ⁺,      D(q⁺) − D̄ ≈ (1 − θ)/θ (D̄ − D(q))
//
// with the guess ṽ⁺ of v⁺ (of the last iteration). So contacts are looked for twice, at q and at q̄, and paired by keys.
// The term counts for contacts that pushed in the step before, which is where rows turn along with a smooth motion. A
// contact that closes gets its impulse in one configuration, D̄ or (`once`) that in which it meets: then u⁺ = −e u⁻ with
// one D on both sides, and e ≤ 1 gains no energy. It does not count either where rows changed by more than a turn of a
// smooth motion explains: the tangents of a contact may jump.
//
// Rates, those of bodies with a given motion, are means over the step that rows are collected for: at q over all of it,
// at q̄ over the rest (1 − θ) h. So they belong to t + h/2 and t + (1 + θ) h/2, and the same formula gives the rate at
// the end. D is extrapolated with means as well, (v + ṽ⁺)/2 in place of ṽ⁺: what errs is then ¼ h² d(Ḋ v)/dt and not
// ¼ h² D̈ v⁺, so that what rides in a drum stays where it is, and what rolls over an edge leaves it as it should. A step
// in which anything strikes keeps ṽ⁺. All this is about what the contact's own motion changes: entries beside angular
// velocities are brought to the same axes first (turning_axes.hpp).
//
// ---- The law ----
//
// With the gap g and the speed u⁻ at the beginning of the step, b of a normal row is (Moreau 1988; Jean 1999; Acary and
// Brogliato 2008, ch. 10)
//
//     closed, g ≤ 0:                            b = 0:                        u⁺ ≥ 0
//     closing with restitution, g + h u⁻ ≤ 0:   b = e u⁻:                     u⁺ ≥ −e u⁻
//     else                                      b = (g + (1 − θ) h u⁻)/(θ h): g + (1 − θ) h u⁻ + θ h u⁺ ≥ 0
//
// but not below 0 in the last case. There the gap at the end of the step, g⁺ to first order, stays open: a contact
// without restitution lands with g⁺ = 0, and loses what is left of its speed in the next step. If it were stopped in
// one step, half the way would remain open, and the body would fall through it again, with a speed of the order √h. A
// contact with restitution would lose by such a row what it is to return; so it is left alone until it closes at its
// own speed (b has −u⁻ besides), and what it penetrates by acceleration, below ½ a h², is undone in the positions.
//
// Gaps nearer to 0 than the resolution are 0.
//
// A method that knows the velocities ṽ⁺ at the end of a step in which nothing meets knows the acceleration of a row
// besides impulses, a = D̄ (ṽ⁺ − v)/h (time_meetings()). So with u⁻ = D̄ v a contact meets when g + u⁻ τ + ½ a τ² = 0,
// strikes with the speed that it has then, and has moved on at the end of the step, or stays (impact.cpp): b = −u⁺ of
// that. Speeds before and after are those of one D̄, so that e ≤ 1 gains no energy. What the velocities change by at τ
// moves positions from then on (find_impacts()). Friction acts at the impact, too: after the flight F since the bodies
// parted, tangential rows have a F of u⁺ from forces alone, so that b_t = −a F leaves the law that of u_t at the
// impact.
//
// What strikes gets D and the gap of that time from the system, which takes the bodies along v + (ṽ⁺ − v) t/h + c t (t
// − h) until then, and τ follows from them (DynamicalSystem::collect_contact()). c is the curve of free spins: by w = c
// τ (τ − h) a body spins otherwise at τ than the line from v to ṽ⁺ has it, so that u⁻ has D w more and the law is that
// of D v⁺ − a F + D w. Then an impact errs by O(h³). Contacts that the system does not know by themselves (stops,
// nodes) get D between those of the beginning and the middle.
//
// A body that is struck at τ moves as it did until then, so that its open contacts close by what comes after: g(τ) + (h
// − τ) u⁺ ≥ 0, with D and the gap of τ. One that is closed by this strikes, if it has no restitution. Else it would
// bounce with a speed that the step does not know: a step with such a contact is cut between the two impacts
// (StepReport::cut), and in the second part both bodies have the speeds with which they meet.
//
// Without restitution a contact strikes if it closes faster at the beginning of the step than a step makes it, u⁻ < a h
// with the a < 0 of the body, now or in the step before, or with that of the surface. What is slower belongs to the
// smooth motion, as the next corner of what rolls: it lands by the last case, and its time would change positions by
// O(h²). With D̄ of the meeting, which knows no turn after it, rolling would be of order 1. An a > 0 makes nothing
// close: what it slows down grazes the surface within the step, and the last case does not see that. Where a bounce was
// given up, since it gained energy, |a| is the bound.
//
// What a step leaves of the gap of a closed contact, O(h³) by the curvature of its motion, is undone in the positions
// (position_projection.cpp), or by the row itself: `once`. A row that asks for u⁺ = −g⁺/(θ h), with g⁺ = g + h ((1 − θ)
// u⁻ + θ u⁺), is
//
//     closed, or pushed in the step before:     b = (g + (1 − θ) h u⁻)/(2 θ h),      b ≥ −η
//
// with the recovery speed η. Then u⁻ = −g/(θ h) from the step before, and for θ = ½ the gap is gone in one step
// (dynamics/theta_method.cpp has the same for constraints). u⁻ counts up to that size; more of it is a contact that
// closes, and b = 0. A contact that bounced in the step before, and opens faster than a gap or η explains, is open.
//
// ---- Energy ----
//
// What contacts do in a step is P·u_θ; at an impact within it, P times the mean of its speeds before and after. For θ =
// ½ a contact that bounces has P_n (u⁻ + u⁺)/2 ≤ 0, and so have all without friction. With friction bounces may gain
// energy (contact_gain.hpp), and rows that turn far in a step are not those of its end. Such a step is solved again
// with less restitution, and if it gains with none, with D̄ for both sides: then u⁺ = 0 where P_n > 0.
//
// ---- Friction ----
//
// The associated law on the level of velocities would lift a sliding contact at the speed μ |u_t| in each step. So
// De Saxcé's term s = μ |u_t⁺| stands in b, by which the answer obeys Coulomb's law: with u_t of the guess, until
// further iterations do not move it. A term that is too large by δ costs the impulse m δ, whose friction changes |u_t|
// by μ δ: the iteration s ← μ |u_t⁺(s)| contracts by about μ² only, so each contact takes its secant.
// Where contacts stick and slip in turns, the terms jump for ever. So late ones only fall: with less than μ |u_t| the
// law lies between Coulomb's and the associated one, and the contact opens at the speed μ |u_t| − s in this step.
//
// `once` takes s of the guess alone, which is off by O(h²) while a contact slides: the contact opens or closes at that
// speed, and the gap is g⁺ = ½ h (μ |u_t⁺| − s) = O(h³), since the row above takes back what the step before left. No
// energy comes of it: the impulse does the work P·u⁺ = −P_n (s + b). Where the guess has turned round against u_t⁻, the
// contact comes to rest in this step, and s = 0. A contact that strikes needs its s to leave at e u⁻ and not at some
// other speed: this one iterates as above.

namespace {

/// Of the square of a block's rows, beyond which they did not turn along with a smooth motion.
constexpr double largest_turn_squared = 0.25;
/// The largest slope that the iteration of De Saxcé's terms is taken to have.
constexpr double steepest = 0.5;
/// Of a step, from the point where D is taken to its end, at least.
constexpr double shortest_rest = 0.05;
/// What further iterations may move them by, as a share, unless the solver leaves more.
constexpr double settled_share = 1e-6;
/// After so many iterations they only fall.
constexpr int patience = 15;

bool in_order_of_shapes(const ContactPoint& one, const ContactPoint& other) {
    return std::pair(one.shape_a, one.shape_b) < std::pair(other.shape_a, other.shape_b);
}

}  // namespace

void diagonal_of(const SparseMatrix& H, std::vector<double>& diagonal) {
    diagonal.assign(static_cast<std::size_t>(H.rows), 1.0);
    for (std::size_t row = 0; row < diagonal.size(); ++row)
        for (auto e = H.row_start[row]; e < H.row_start[row + 1]; ++e) {
            const auto entry = static_cast<std::size_t>(e);
            if (static_cast<std::size_t>(H.column[entry]) == row && H.value[entry] > 0.0)
                diagonal[row] = H.value[entry];
        }
}

void set_compliance(Problem& problem, std::span<const UnilateralRows::Block> blocks,
                    std::span<const double> compliances) {
    SparseMatrix& E = problem.E;
    const bool any = std::any_of(compliances.begin(), compliances.end(), [](double value) { return value > 0.0; });
    if (!any && E.rows == 0) return;
    E.rows = E.columns = any ? problem.m() : 0;
    E.row_start.assign(1, 0);
    E.column.clear();
    E.value.clear();
    if (!any) return;
    std::int32_t row = problem.m();
    for (const auto& block : blocks) row -= block.cone.rows;
    E.row_start.assign(static_cast<std::size_t>(row) + 1, 0);
    for (std::size_t k = 0; k < blocks.size(); ++k)
        for (std::int32_t i = 0; i < blocks[k].cone.rows; ++i, ++row) {
            if (compliances[k] > 0.0) {
                E.column.push_back(row);
                E.value.push_back(compliances[k]);
            }
            E.row_start.push_back(static_cast<std::int32_t>(E.value.size()));
        }
}

VelocityContacts::VelocityContacts(DynamicalSystem& system, VelocityContactSettings settings)
    : system_(system),
      settings_(settings),
      resolution_(system),
      bilateral_cones_(system.constraint_blocks().size()),
      axes_(system) {}

void VelocityContacts::collect(const State& begin, double h, double theta, double restitution) {
    restitution_ = restitution;
    h_ = h;
    theta_ = theta;
    before_.clear();
    rows_.clear();
    keys_.clear();
    deepest_ = 0.0;
    if (!system_.has_unilateral()) return;
    before_.measure_speeds_at(begin.v.data());
    rows_.measure_speeds_at(begin.v.data(), theta * h);
    system_.collect_unilateral(begin, h, before_);
    begin_ = &begin;
    begin_speeds_ = begin.v.data();
    axes_.begin(begin_speeds_, theta * h, h);
    std::size_t row = 0;
    bool compliant = false;
    for (std::size_t k = 0; k < before_.blocks().size(); ++k) {
        const auto& block = before_.blocks()[k];
        compliant = compliant || block.compliance > 0.0;
        keys_.push_back({block.key, k, row});
        if (block.along_normal()) deepest_ = std::min(deepest_, before_.rows()[row].gap);
        row += static_cast<std::size_t>(block.cone.rows);
    }
    const auto by_key = [](const Before& a, const Before& b) { return a.key < b.key; };
    if (!std::is_sorted(keys_.begin(), keys_.end(), by_key)) std::sort(keys_.begin(), keys_.end(), by_key);
    servos_.clear();
    if (compliant) system_.collect_unilateral(begin, theta * h, servos_);
    middle_ = begin;
    middle_.t += theta * h;
    delta_.resize(begin.v.size());
    for (std::size_t i = 0; i < delta_.size(); ++i) delta_[i] = theta * h * begin.v[i];
    system_.increment(begin.q.data(), delta_.data(), middle_.q.data());
    system_.collect_unilateral(middle_, std::max(1.0 - theta, shortest_rest) * h, rows_);
    require_same_side(begin, h);
}

// What closes before the middle of the step is as deep there as at the end of the step: the position moves on with (1 −
// θ) of the old velocity. So the same shapes must touch there, and on the same side; or one of them and a shape in
// which the surface of the other one goes on, since at a seam of flush shapes the contact passes from one to the next.
void VelocityContacts::require_same_side(const State& begin, double h) const {
    constexpr double least_cosine = 0.5, flush_cosine = 1.0 - 1e-6;
    constexpr double flush_share = 1e-2;               // of the way to the middle
    const double shallow = 1e6 * resolution_.least();  // too little for a body to get to the other side
    const auto& contacts = before_.contacts();
    const auto& later = rows_.contacts();
    const std::size_t first = before_.blocks().size() - contacts.size();
    for (std::size_t k = 0; k < contacts.size(); ++k) {
        const ContactPoint& contact = contacts[k];
        const double speed = before_.blocks()[first + k].speed;
        if (!(contact.gap > -shallow && contact.gap + theta_ * h * speed < -shallow)) continue;
        const auto [same, others] = std::equal_range(later.begin(), later.end(), contact, in_order_of_shapes);
        const bool found = std::any_of(same, others, [&](const ContactPoint& one) {
            double cosine = 0.0;
            for (std::size_t i = 0; i < 3; ++i) cosine += contact.normal[i] * one.normal[i];
            return cosine > least_cosine;
        });
        const auto goes_on = [&](const ContactPoint& one) {
            const bool of_a = one.shape_a == contact.shape_a || one.shape_b == contact.shape_a;
            if (!of_a && one.shape_a != contact.shape_b && one.shape_b != contact.shape_b) return false;
            const bool turned = one.shape_a == contact.shape_b || one.shape_b == contact.shape_a;
            const Vector3& before = of_a ? contact.point_b : contact.point_a;
            const Vector3& now = of_a == turned ? one.point_a : one.point_b;
            double cosine = 0.0, height = 0.0;
            for (std::size_t i = 0; i < 3; ++i) {
                cosine += (turned ? -contact.normal[i] : contact.normal[i]) * one.normal[i];
                height += contact.normal[i] * (now[i] - before[i]);
            }
            return cosine > flush_cosine && std::abs(height) < flush_share * theta_ * h * -speed;
        };
        if (!found && std::none_of(later.begin(), later.end(), goes_on))
            throw StepTooLong(fmt::format(
                "the step from t = {:.9g} with h = {:.9g} is too long: a body would go through another one, which it "
                "meets after {:.3g} s at {:.3g} m/s, before the method looks for contacts in the middle of the step; "
                "take shorter steps, or euler_implicit_linearized, which looks for them on the way",
                begin.t, h, contact.gap / -speed, -speed));
    }
}

/// Null where there is none, or several: then nothing tells them apart.
const VelocityContacts::Before* VelocityContacts::find_before(std::uint64_t key) const {
    const auto found = std::lower_bound(keys_.begin(), keys_.end(), key,
                                        [](const Before& entry, std::uint64_t wanted) { return entry.key < wanted; });
    if (found == keys_.end() || found->key != key) return nullptr;
    if (found + 1 != keys_.end() && (found + 1)->key == key) return nullptr;
    return &*found;
}

LimitedServo VelocityContacts::find_servo(std::uint64_t key, const Before* before, const Contact& contact) const {
    std::size_t row = 0, block = 0;
    const auto blocks = servos_.blocks();
    while (block < blocks.size() && blocks[block].key != key)
        row += static_cast<std::size_t>(blocks[block++].cone.rows);
    if (!before || block == blocks.size())
        throw InputError("a system gave a row with a compliance within a step that it had not at its beginning");
    double mobility = 0.0;
    for (auto e = static_cast<std::size_t>(rows_.row_start()[contact.row]);
         e < static_cast<std::size_t>(rows_.row_start()[contact.row + 1]); ++e)
        mobility += rows_.value()[e] * rows_.value()[e] / diagonal_[static_cast<std::size_t>(rows_.column()[e])];
    return {{servos_.rows()[row].rate, blocks[block].compliance},
            {before_.rows()[before->row].rate, before_.blocks()[before->block].compliance},
            theta_,
            h_,
            mobility};
}

/// Whether rows of rows_ are those of before_, but for a turn that a smooth motion explains. Rows act on lengths and
/// angles alike; what they change in velocities, H⁻¹ Dᵀ, compares these in any units (H by its diagonal_).
bool VelocityContacts::nearly_equal(std::size_t row, std::size_t before, std::int32_t rows) const {
    double change = 0.0, size = 0.0;
    for (std::int32_t i = 0; i < rows; ++i) {
        const auto k = row + static_cast<std::size_t>(i), l = before + static_cast<std::size_t>(i);
        auto e = static_cast<std::size_t>(rows_.row_start()[k]), f = static_cast<std::size_t>(before_.row_start()[l]);
        const auto e_end = static_cast<std::size_t>(rows_.row_start()[k + 1]);
        const auto f_end = static_cast<std::size_t>(before_.row_start()[l + 1]);
        while (e < e_end || f < f_end) {
            if (axes_.at(rows_.column(), e, e_end) && axes_.at(before_.column(), f, f_end) &&
                rows_.column()[e] == before_.column()[f]) {
                const Eigen::Vector3d turned = axes_.from_middle(rows_.column()[e], &rows_.value()[e]);
                for (Eigen::Index axis = 0; axis < 3; ++axis, ++e, ++f) {
                    const double a = turned[axis], b = before_.value()[f];
                    const double H = diagonal_[static_cast<std::size_t>(before_.column()[f])];
                    change += (a - b) * (a - b) / H;
                    size += a * a / H;
                }
                continue;
            }
            const bool now = e < e_end && (f == f_end || rows_.column()[e] <= before_.column()[f]);
            const bool then = f < f_end && (e == e_end || before_.column()[f] <= rows_.column()[e]);
            const double H = diagonal_[static_cast<std::size_t>(now ? rows_.column()[e] : before_.column()[f])];
            const double a = now ? rows_.value()[e++] : 0.0, b = then ? before_.value()[f++] : 0.0;
            change += (a - b) * (a - b) / H;
            size += a * a / H;
        }
    }
    return change <= largest_turn_squared * size;
}

void VelocityContacts::set_normal(const UnilateralRows::Block& block, Contact& contact, double middle_speed) const {
    const double e = restitution_ * block.restitution;
    const double gap = contact.resolved_gap();
    // What does not push yet closes by the row in the middle of the step, of order 2 along a path that curves.
    const double speed = settings_.once || contact.pushed ? -contact.approach : middle_speed;
    const double drift = (1.0 - theta_) * h_ * speed;
    contact.normal = 0.0;
    if (!settings_.once && e > 0.0 && speed < -settings_.restitution_speed) {
        const bool closes = gap + h_ * speed <= 0.0;
        contact.strikes = closes && !contact.pushed;
        contact.normal = closes ? e * std::min(speed, 0.0) : std::max(gap + drift, 0.0) / (theta_ * h_) - speed;
        if (closes) contact.turns = contact.turns && contact.pushed;
    } else if (settings_.once && (gap <= 0.0 || contact.pushed) && !contact.left) {
        const double wanted = gap + std::clamp(drift, -std::abs(gap), std::abs(gap));
        contact.normal = std::max(wanted / (2.0 * theta_ * h_), -settings_.recovery_speed);
        contact.recovery = std::max(-contact.normal, 0.0);
    } else if (gap > 0.0 || contact.left) {
        contact.normal = std::max(gap + drift, 0.0) / (theta_ * h_);
    }
}

// Shapes of which no contact was known at the beginning were apart there, whatever their speed in the middle says: one
// of them has gone round the other.
void VelocityContacts::append_to(Problem& problem, std::vector<double>& lambda, bool coulomb, double last_h) {
    constexpr double open = 2.0;  // of the resolution of a gap
    const auto was_near = [&](const ContactPoint& point) {
        const auto& contacts = before_.contacts();
        return std::binary_search(contacts.begin(), contacts.end(), point, in_order_of_shapes);
    };
    first_row_ = problem.b.size();
    coulomb_ = coulomb;
    settled_ = true;
    held_through_bounces_ = takes_only_ = false;
    struck_.clear();
    contacts_.clear();
    compliances_.clear();
    kept_.begin_walk();
    const std::size_t first_contact = rows_.blocks().size() - rows_.contacts().size();
    std::size_t row = 0;
    std::size_t cone = bilateral_cones_;
    problem.cones.resize(cone + rows_.blocks().size());
    problem.b.resize(first_row_ + rows_.rows().size(), 0.0);
    lambda.resize(problem.b.size(), 0.0);
    if (!rows_.blocks().empty()) diagonal_of(problem.H, diagonal_);
    for (std::size_t k = 0; k < rows_.blocks().size(); ++k) {
        const auto& block = rows_.blocks()[k];
        const auto size = static_cast<std::size_t>(block.cone.rows);
        Cone& target = problem.cones[cone++];
        copy_cone(block.cone, target);
        for (auto* bounds : {&target.lo, &target.hi})
            for (double& bound : *bounds) bound *= h_;
        Contact& contact = contacts_.emplace_back();
        contact.row = row;
        contact.along_normal = block.along_normal();
        const ContactPoint* point = k < first_contact ? nullptr : &rows_.contacts()[k - first_contact];
        const auto [pushed, impulsive] = kept_.start(block, point, {lambda.data() + first_row_ + row, size});
        contact.pushed = pushed;
        contact.impulsive = impulsive;
        if ((pushed && contact.along_normal) || is_between_bounds(k))
            std::copy_n(lambda.begin() + static_cast<std::ptrdiff_t>(first_row_ + row), std::min<std::size_t>(size, 3),
                        contact.last.begin());
        const Before* before = find_before(block.key);
        if (before && before_.blocks()[before->block].cone.rows != block.cone.rows) before = nullptr;
        if (before) {
            const std::size_t first_before = before_.blocks().size() - before_.contacts().size();
            contact.met_on_the_way =
                before->block >= first_before && before_.contacts()[before->block - first_before].on_the_way;
            const bool counts = settings_.once || contact.pushed || !contact.along_normal;
            const bool nearly = (point || counts) && nearly_equal(row, before->row, block.cone.rows);
            contact.nearly_as_before = nearly && counts;
            // Points are named by their order where nothing else tells them apart, which changes where one comes or
            // goes: what has the name, and rows that no motion explains, is another one.
            if (point && !nearly && !contact.met_on_the_way) before = nullptr;
        }
        if (before) {
            contact.before = before->row;
            contact.was_there = true;
            contact.gap = before_.rows()[before->row].gap;
            contact.approach = -before_.blocks()[before->block].speed;
        } else {
            contact.gap = rows_.rows()[row].gap - theta_ * h_ * block.speed;
            contact.approach = -block.speed;
        }
        const double opening = -contact.approach;
        contact.left = settings_.once && block.restitution > 0.0 && opening > settings_.recovery_speed &&
                       (1.0 - theta_) * h_ * opening > std::abs(contact.gap);
        contact.pushed = contact.pushed && !contact.left;
        contact.turns = (contact.pushed || !contact.along_normal) && contact.nearly_as_before;
        const auto entry = static_cast<std::size_t>(rows_.row_start()[row]);
        const auto entries = static_cast<std::size_t>(rows_.row_start()[row + 1]) - entry;
        contact.resolution =
            point ? resolution_.of(std::span(rows_.column()).subspan(entry, entries), h_) : resolution_.least();
        if (point && !was_near(*point)) contact.gap = std::max(contact.gap, open * contact.resolution);
        if (contact.along_normal) set_normal(block, contact, block.speed);
        if (block.compliance > 0.0) contact.servo = find_servo(block.key, before, contact);
        compliances_.push_back(contact.servo ? contact.servo->compliance(contact.struck) : 0.0);
        if (block.cone.kind == ConeKind::Friction && block.cone.parameters[0] > 0.0 && !coulomb)
            contact.friction = block.cone.parameters[0];
        row += size;
    }
    rows_.move_into(problem.D);
    axes_.stretch(first_row_, problem.D);
    set_compliance(problem, rows_.blocks(), compliances_);
    if (settings_.once && last_h > 0.0) press_on(problem, last_h);
}

// To close a gap of O(h³) that a longer step left may take more than a short one's force: then nothing would push in
// it, and an impact that comes next would find the contact open. So it takes at most a part of the speed that the force
// of the step before gives the row in this one.
void VelocityContacts::press_on(const Problem& problem, double last_h) {
    constexpr double part = 0.5;
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        Contact& contact = contacts_[k];
        if (!contact.along_normal || !contact.pushed || !(contact.normal > 0.0)) continue;
        const std::size_t row = first_row_ + contact.row;
        const auto rows =
            std::min<std::size_t>(static_cast<std::size_t>(rows_.blocks()[k].cone.rows), contact.last.size());
        double change = 0.0;
        for (std::size_t i = 0; i < rows; ++i) change += coupling(problem.D, diagonal_, row, row + i) * contact.last[i];
        contact.normal = std::min(contact.normal, part * std::max(change, 0.0) * h_ / last_h);
    }
}

void VelocityContacts::set_b(Problem& problem, const Solution& solution, std::span<const double> guess, int iteration,
                             double natural_error) {
    const auto& D = problem.D;
    settled_ = true;
    if (contacts_.empty()) return;
    if (iteration == 0) find_friction_reach(problem);
    axes_.turn(guess, h_, theta_, in_begin_, in_middle_);
    const double share = std::max(settled_share, 10.0 * natural_error);
    double largest = 0.0;
    for (const double speed : guess) largest = std::max(largest, std::abs(speed));
    const bool jumps = std::any_of(contacts_.begin(), contacts_.end(),
                                   [](const Contact& contact) { return contact.strikes || contact.impact; });
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        Contact& contact = contacts_[k];
        const std::size_t first = first_row_ + contact.row;
        if (settings_.once && iteration > 0 && (!contact.strikes || !(solution.lambda[first] > 0.0))) continue;
        const auto size = static_cast<std::size_t>(rows_.blocks()[k].cone.rows);
        double squares = 0.0, along = 0.0;  // of the sliding speed at the end; that times the one at the beginning
        for (std::size_t i = 0; i < size; ++i) {
            const std::size_t row = first + i;
            const double here = D.row_times(static_cast<std::int32_t>(row), guess.data());
            double& b = problem.b[row];
            b = rows_.rows()[contact.row + i].rate;
            if (contact.servo) {
                b = contact.servo->rate(contact.struck, D.row_times(static_cast<std::int32_t>(row), begin_speeds_));
            } else if (contact.turns) {
                const std::size_t then = contact.before + i;
                const double in_middle = D.row_times(static_cast<std::int32_t>(row), in_middle_.data());
                double change = in_middle + b - before_.speed(then, in_begin_.data());
                if (!jumps)
                    change = 0.5 * (change + D.row_times(static_cast<std::int32_t>(row), begin_speeds_) + b -
                                    before_.speed(then, begin_speeds_));
                b += in_middle - here + (1.0 - theta_) / theta_ * change;
            }
            if (i == 0) continue;
            if (contact.impact)
                b += contact.deviation_of(i) - contact.impact->flight * smooth_acceleration(problem, row);
            squares += (here + b) * (here + b);
            if (settings_.once && contact.was_there)
                along += (here + b) * before_.speed(contact.before + i, begin_speeds_);
        }
        set_friction_direction(problem, contact, size, guess, squares);
        double& b = problem.b[first];
        b += contact.normal;
        if (contact.friction == 0.0) continue;
        const double wanted = contact.friction * std::sqrt(squares);
        if (settings_.once && iteration == 0) {
            contact.sliding = along < 0.0 ? 0.0 : wanted;
            contact.moved = contact.sliding;
            contact.wanted = contact.sliding;
        } else {
            const double enough = share * std::max({wanted, contact.friction * contact.approach, 1e-2 * largest});
            set_sliding_term(contact, wanted, enough, iteration);
        }
        b += contact.sliding;
    }
}

void VelocityContacts::set_sliding_term(Contact& contact, double wanted, double enough, int iteration) {
    const double last = std::max(contact.sliding, 0.0), change = wanted - last;
    double next = wanted;
    if (iteration < patience) {
        const double slope = contact.moved == 0.0 ? 0.0 : (wanted - contact.wanted) / contact.moved;
        next = std::max(0.0, last + change / (1.0 - std::clamp(slope, -steepest, steepest)));
        settled_ = settled_ && std::abs(change) <= enough;
    } else {
        if (change > 0.0) next = last;
        if (change < 0.0 && iteration >= 2 * patience) next = 0.0;
        settled_ = settled_ && change >= -enough;
    }
    contact.moved = contact.sliding < 0.0 ? 0.0 : next - contact.sliding;
    contact.wanted = wanted;
    contact.sliding = next;
}

// An interior point leaves impulses above 0 where nothing pushes: they change the speed of their row by next to nothing
// beside the speed with which it opens, or beside all momentum, both as velocities in the norm of H (by its diagonal).
void VelocityContacts::drop_negligible(const Problem& problem, Solution& solution) {
    constexpr double share = 1e-6, share_of_momentum = 1e-9;
    double scale = 0.0;
    diagonal_of(problem.H, diagonal_);
    for (std::size_t i = 0; i < problem.a.size(); ++i) scale += problem.a[i] * problem.a[i] / diagonal_[i];
    scale = std::sqrt(scale);
    const auto& D = problem.D;
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        Contact& contact = contacts_[k];
        if (!contact.along_normal) continue;
        const std::size_t first = first_row_ + contact.row;
        const double speed = D.row_times(static_cast<std::int32_t>(first), solution.x.data());
        const double mobility = mobility_of(D, diagonal_, first);
        const double opening = speed + problem.b[first] - std::max(contact.sliding, 0.0);
        double* impulse = solution.lambda.data() + first;
        contact.end_speed = speed + rows_.rows()[contact.row].rate;
        contact.change = mobility * impulse[0];
        if (impulse[0] * std::sqrt(mobility) <= share_of_momentum * scale || contact.change <= share * opening)
            std::fill_n(impulse, rows_.blocks()[k].cone.rows, 0.0);
    }
}

bool VelocityContacts::make_persistent(const Solution& solution) {
    bool any = false;
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        Contact& contact = contacts_[k];
        const UnilateralRows::Block& block = rows_.blocks()[k];
        if (!contact.along_normal || contact.pushed || contact.left || contact.impact || contact.struck <= h_ ||
            !contact.nearly_as_before || !(solution.lambda[first_row_ + contact.row] > 0.0))
            continue;
        const double turn = h_ * std::abs(block.speed + contact.approach) / theta_;
        if (contact.resolved_gap() > turn || h_ * std::abs(contact.approach) > turn + contact.resolution) continue;
        contact.pushed = contact.turns = true;
        set_normal(block, contact, block.speed);
        any = any || turn > contact.resolution;
    }
    return any;
}

void VelocityContacts::only_take() {
    takes_only_ = true;
    for (Contact& contact : contacts_) {
        if (!contact.along_normal) continue;
        contact.turns = contact.strikes = false;
        const double gap = contact.resolved_gap();
        contact.normal = gap > 0.0 ? std::max(gap - (1.0 - theta_) * h_ * contact.approach, 0.0) / (theta_ * h_) : 0.0;
    }
}

void VelocityContacts::add_steady_impulse(const Problem& problem, const std::vector<double>& lambda,
                                          double* result) const {
    const auto& D = problem.D;
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        const Contact& contact = contacts_[k];
        const std::size_t first = first_row_ + contact.row;
        if (contact.along_normal && !contact.steady()) continue;
        for (std::size_t row = first; row < first + static_cast<std::size_t>(rows_.blocks()[k].cone.rows); ++row)
            for (auto e = D.row_start[row]; e < D.row_start[row + 1]; ++e)
                result[D.column[static_cast<std::size_t>(e)]] += D.value[static_cast<std::size_t>(e)] * lambda[row];
    }
}

bool VelocityContacts::landed(const Solution& solution) const {
    return std::any_of(contacts_.begin(), contacts_.end(), [&](const Contact& contact) {
        if (!contact.along_normal || !(solution.lambda[first_row_ + contact.row] > 0.0) || contact.forced())
            return false;
        const double gap = contact.gap + h_ * ((theta_ - 1.0) * contact.approach + theta_ * contact.end_speed);
        return gap < std::min(contact.gap, 0.0) - contact.resolution;
    });
}

// A contact that closed is one that pushes and did not in the step before (`once`: and whose impulse does not come from
// forces, since its rows leave gaps and speeds of O(h²) that are no impacts); it closes after g/|u⁻|, or with at least
// g/h where it was slower at first. Gaps are reported as they were at the beginning of the step.
void VelocityContacts::finish(const Problem& problem, const Solution& solution, StepReport& report) {
    const std::vector<double>& lambda = solution.lambda;
    find_impulsive(problem, solution);
    report.unilateral_blocks = static_cast<std::int32_t>(contacts_.size());
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        const Contact& contact = contacts_[k];
        const std::size_t first = first_row_ + contact.row;
        BlockReaction& acted = report.reactions.emplace_back();
        acted.key = rows_.blocks()[k].key;
        const auto rows = static_cast<std::size_t>(rows_.blocks()[k].cone.rows);
        for (std::size_t i = 0; i < std::min<std::size_t>(rows, 3); ++i) acted.force[i] = lambda[first + i] / h_;
        if (lambda[first] != 0.0) ++report.active_blocks;
        if (!contact.along_normal) continue;
        if (!(lambda[first] > 0.0)) {
            report_closing(contact, report);
            continue;
        }
        report.energy.recovered +=
            lambda[first] * std::clamp(0.5 * (contact.end_speed - contact.approach), 0.0, contact.recovery);
        if (contact.impact) {
            if (contact.strikes && contact.impact->closing > report.impact_speed) {
                report.impact_speed = contact.impact->closing;
                report.impact_time = contact.impact->meets;
            }
            continue;
        }
        const double gap = std::max(contact.gap, 0.0), speed = std::max(std::abs(contact.approach), gap / h_);
        if (settings_.once && speed <= 0.25 * contact.change) continue;
        note_impact(rows_.blocks()[k], gap, contact.approach, contact.pushed, h_, settings_.restitution_speed, report);
    }
    const auto struck_alone = [&](std::size_t block) {
        bool alone = true;
        for_each_entry(problem.D, first_row_ + contacts_[block].row, 1,
                       [&](std::size_t, std::size_t column, double) { alone = alone && on_velocities_[column].alone; });
        return alone;
    };
    // What pushed until an impact alone does not push any more, nor what has bounced and is apart; a force between
    // bounds is that after an impact.
    ended_.assign(lambda.begin() + static_cast<std::ptrdiff_t>(first_row_), lambda.end());
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
        const Contact& contact = contacts_[k];
        if (!contact.along_normal && contact.struck <= h_) {
            ended_[contact.row] = (ended_[contact.row] - contact.known[0]) * h_ / rest_after(contact.struck, h_);
        } else if ((contact.known[0] > 0.0 && ended_[contact.row] <= contact.known[0]) ||
                   (acts(contact, solution) && restitution_of(k) > 0.0 && struck_alone(k) &&
                    contact.impact->flight > 0.0)) {
            std::fill_n(ended_.begin() + static_cast<std::ptrdiff_t>(contact.row), rows_.blocks()[k].cone.rows, 0.0);
        }
    }
    kept_.keep(rows_.blocks(), rows_.contacts(), ended_, impulsive_);
    const std::size_t first_contact = contacts_.size() - rows_.contacts().size();
    for (std::size_t k = 0; k < rows_.contacts().size(); ++k) {
        // Of a contact that nobody knew at the beginning the gap follows from its speed: it was no deeper than the
        // others.
        const Contact& contact = contacts_[first_contact + k];
        rows_.contacts()[k].gap = contact.was_there ? contact.gap : std::max(contact.gap, deepest_);
    }
    report.contacts.swap(rows_.contacts());
}

// A new point of bodies that overlap already must not push them apart at once.
double VelocityContacts::least_gap(std::uint64_t key) const {
    const Before* found = find_before(key);
    const double before = found ? before_.rows()[found->row].gap : deepest_;
    return std::min(0.0, before + settings_.recovery_speed * h_);
}

// ---- Options ----

OptionInfo recovery_speed_option() {
    return {.key = "recovery_speed",
            .type = DELASSUS_OPTION_REAL,
            .default_value = "-1",
            .minimum = -1.0,
            .maximum = HUGE_VAL,
            .unit = "m/s",
            .doc =
                "largest speed with which penetration that a step finds is undone; negative: a hundredth of the speed "
                "that a fall through the size of the shapes gives"};
}

OptionInfo restitution_speed_option() {
    return {.key = "restitution_speed",
            .type = DELASSUS_OPTION_REAL,
            .default_value = "0",
            .minimum = 0.0,
            .maximum = HUGE_VAL,
            .unit = "m/s",
            .doc = "contacts that close slower than this do not bounce"};
}

VelocityContactSettings velocity_contact_settings(const DynamicalSystem& system, const OptionValue& recovery_speed,
                                                  const OptionValue& restitution_speed) {
    return {recovery_speed.real < 0.0 ? system.recovery_speed() : recovery_speed.real, restitution_speed.real};
}

}  // namespace delassus
