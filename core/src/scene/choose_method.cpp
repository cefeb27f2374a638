// SPDX-License-Identifier: BSD-3-Clause
#include "scene/choose_method.hpp"

#include <fmt/format.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace delassus::scene {
namespace {

// ---- Which method pays ----
//
// Where nothing touches, motions are smooth, and methods of order 5 take them for the price of a few implicit steps
// of order 1 with errors smaller by orders. An explicit one pays as long as its steps are limited by accuracy. Its
// stability limit is h ω ≈ 1 to 3 for the fastest motion ω, and a step beyond it is divided, so that h ω says into how
// many parts. Beyond that an implicit one does, whose steps cost some fifteen explicit parts. With joints the
// velocities are those with C_q v = 0: x ← P M⁻¹ A x with the projection P = 1 − M⁻¹ C_qᵀ (C_q M⁻¹ C_qᵀ)⁻¹ C_q has the
// eigenvalues of A among them. None is above the largest of the bodies without joints, as eigenvalues of a projected
// pencil lie between those of the whole: so the joints are looked at only where the bodies alone are too fast.

/// h ω up to which explicit parts cost less than an implicit step (measured).
constexpr double most_explicit_rate = 50.0;
/// With elements: they vibrate in as many ways as they have nodes or bodies, without damping, and a share of each
/// tolerance feeds all of them where steps are near the stability limit.
constexpr double most_explicit_rate_of_elements = 1.0;
/// h ω up to which fixed steps are right: of the rates of springs and dashpots the trapezoidal rule is off by the share
/// (h ω)²/12, which is the accuracy where nothing is said.
constexpr double most_rate_of_fixed_steps = 0.1;
/// h ω up to which the trapezoidal rule, which damps nothing, has a faint error of the fastest motion.
constexpr double most_rate_of_order_2 = 2.0;
/// The same where steps are divided until their error is small.
constexpr double most_rate_of_chosen_steps = 100.0;
/// Beside contacts, where the flights between them are taken in explicit parts and contacts in parts by their error
/// (measured on servos of an arm).
constexpr double most_motion_beside_contacts = 10.0, most_damping_beside_contacts = most_explicit_rate;
/// m and rad. An explicit method of order 5 pays a tenth of the errors with half of its time.
constexpr const char *error_limit = "1e-4", *error_limit_of_explicit = "1e-5";

using Matrix = Eigen::SparseMatrix<double>;
using Factor = Eigen::SimplicialLDLT<Matrix>;

template <class Add>
Matrix assembled(std::int32_t rows, std::int32_t columns, Add add) {
    MatrixAssembler assembler;
    assembler.begin(rows, columns);
    add(assembler);
    const SparseMatrix& matrix = assembler.finish();
    return Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>>(
        rows, columns, matrix.entries(), matrix.row_start.data(), matrix.column.data(), matrix.value.data());
}

/// The rates of a system at its start, with the joints or without.
class Rates {
public:
    explicit Rates(const MultibodySystem& mechanics)
        : mechanics_(mechanics), n_(mechanics.n()), start_(mechanics.initial_state()) {
        M_.compute(assembled(n_, n_, [&](MatrixAssembler& target) { mechanics_.add_metric(1.0, target); }));
    }

    /// The fastest of vibrations, spins and decays, 1/s.
    struct Fastest {
        double stiffness, spin, damping;
        /// A scene of round numbers may have h ω at a limit: it is within, whatever rounding makes of it.
        [[nodiscard]] bool within(const Fastest& limits, double step) const {
            constexpr double rounding = 1e-6;
            const double least = step / (1.0 + rounding);
            return stiffness * least <= limits.stiffness && spin * least <= limits.spin &&
                   damping * least <= limits.damping;
        }
    };
    [[nodiscard]] Fastest fastest() const {
        const auto radius = [&](auto add) {
            return spectral_radius(assembled(
                n_, n_, [&](MatrixAssembler& target) { (mechanics_.*add)(start_, 1.0, Tangent::Symmetric, target); }));
        };
        double spin = 0.0;
        for (BodyIndex body = 0; body < mechanics_.body_count(); ++body)
            if (const auto column = mechanics_.body_column(body); column >= 0)
                spin = std::max(spin, Eigen::Map<const Eigen::Vector3d>(start_.v.data() + column + 3).norm());
        return {std::sqrt(radius(&MultibodySystem::add_stiffness)), spin, radius(&MultibodySystem::add_damping)};
    }

    /// From now on velocities are those that joints allow, if that can be found out. Rows that repeat each other make
    /// C M⁻¹ Cᵀ singular: its diagonal is raised by rounding.
    void hold_joints() {
        const std::int32_t m = mechanics_.m();
        C_ = assembled(m, n_, [&](MatrixAssembler& target) { mechanics_.add_constraint_jacobian(start_, 0, target); });
        const Matrix columns = C_.transpose();
        Matrix S = C_ * Matrix(M_.solve(columns));
        for (std::int32_t i = 0; i < m; ++i) S.coeffRef(i, i) *= 1.0 + 1e-9;
        S_.compute(S);
        if (S_.info() != Eigen::Success) C_.resize(0, n_);  // a bound all the same: that of the bodies alone
    }

private:
    /// |largest eigenvalue| of M⁻¹ A: the power method from a vector without symmetry, until it stands still. Where
    /// several are nearly as large, it is below them by a share like their distance.
    [[nodiscard]] double spectral_radius(const Matrix& A) const {
        constexpr int iterations = 400;
        constexpr double still = 1e-10;
        if (A.norm() == 0.0) return 0.0;
        Eigen::VectorXd x = Eigen::VectorXd::NullaryExpr(
            n_, [](Eigen::Index i) { return 1.0 + 0.5 * std::sin(1.7 * static_cast<double>(i)); });
        double radius = 0.0;
        for (int i = 0; i < iterations; ++i) {
            x.normalize();
            x = M_.solve(Eigen::VectorXd(A * x));
            if (C_.rows() > 0) x -= M_.solve(Eigen::VectorXd(C_.transpose() * S_.solve(Eigen::VectorXd(C_ * x))));
            const double before = std::exchange(radius, x.norm());
            if (!(radius > 0.0) || !std::isfinite(radius) || std::abs(radius - before) <= still * radius) break;
        }
        return std::isfinite(radius) ? radius : std::numeric_limits<double>::infinity();
    }

    const MultibodySystem& mechanics_;
    std::int32_t n_;
    State start_;
    Factor M_, S_;
    Matrix C_;
};

/// Whether joint coordinates can hold a joint, where it closes no loop.
bool can_be_in_a_tree(const SceneSystem& system, const JointParameters& joint) {
    const auto told = [&](BodyIndex body) {
        return body != world_body && system.bodies[static_cast<std::size_t>(body)].motion.has_value();
    };
    const bool row_alone =
        joint.kind == JointKind::PointOnPlane || joint.kind == JointKind::Distance || joint.kind == JointKind::Gear;
    return !row_alone && !told(joint.first) && !told(joint.second);
}

/// Why its problems have to be those of maximal coordinates; empty: others will do.
std::string why_maximal(const SceneSystem& system) {
    if (!system.solver.name.empty() && system.solver.name != "auto") return "the scene names a solver for its problems";
    if (!system.leave_out) return "leave_out is false";
    return {};
}

/// Why only the default of all systems takes it; empty: others do.
std::string why_default(const SceneSystem& system) {
    const MultibodySystem& mechanics = *system.system;
    if (system.sleeping) return "bodies may sleep";
    if (mechanics.n() == 0) return "nothing moves";
    if (!mechanics.cables().empty()) return "it has cables, which go slack";
    return {};
}

/// Whether something acts in a joint at any time, whatever its coordinate is: dry friction, or a force with a limit.
bool always_acts(const SceneSystem& system) {
    const auto rubs = [](const JointParameters& joint) {
        return joint.slide.friction > 0.0 || joint.turn.friction > 0.0;
    };
    const auto limited = [](double limit) { return std::isfinite(limit); };
    return std::ranges::any_of(system.joints, rubs) ||
           std::ranges::any_of(system.motors, limited, &MotorParameters::force_limit) ||
           std::ranges::any_of(system.actuators, limited, &ActuatorParameters::force_limit);
}

/// Whether it has nodes or beams.
bool has_elements(const SceneSystem& system) {
    return system.system->node_count() > 0 || !system.beams.empty();
}

/// Whether of the moving bodies that may touch more than half are held by no joint.
bool mostly_without_joints(const SceneSystem& system) {
    std::vector<char> held(system.bodies.size(), 0), touches(system.bodies.size(), 0);
    for (const JointParameters& joint : system.joints)
        for (const BodyIndex body : {joint.first, joint.second})
            if (body != world_body) held[static_cast<std::size_t>(body)] = 1;
    for (const Shape& shape : system.system->shapes())
        if (shape.body != world_body && system.system->body_column(shape.body) >= 0)
            touches[static_cast<std::size_t>(shape.body)] = 1;
    std::size_t alone = 0, all = 0;
    for (std::size_t body = 0; body < held.size(); ++body)
        if (touches[body]) {
            ++all;
            if (!held[body]) ++alone;
        }
    return 2 * alone > all;
}

/// How fast forces are, for a method that takes h ω up to these limits; empty: it takes them.
std::string how_fast(const SceneSystem& system, const Rates::Fastest& most) {
    // A tolerance chooses its steps; these are as long as its users take them.
    const double step = system.control               ? std::min(system.control->largest, 0.01)
                        : system.steps_by_accuracy() ? std::min(system.step, 0.01)
                                                     : system.step;
    Rates rates(*system.system);
    if (rates.fastest().within(most, step)) return {};
    if (system.system->m() > 0) rates.hold_joints();
    const Rates::Fastest found = rates.fastest();
    if (found.within(most, step)) return {};
    const double rate = std::max({found.stiffness, std::isfinite(most.spin) ? found.spin : 0.0, found.damping});
    return fmt::format("rates of up to {:.2g}/s, {:.2g} in a step", rate, rate * step);
}

/// The same, of motions with spins.
std::string why_stiff(const SceneSystem& system, double most_motion, double most_damping) {
    const std::string fast = how_fast(system, {most_motion, most_motion, most_damping});
    return fast.empty() ? fast : "forces are stiff: " + fast;
}

/// For bodies that may touch, stops and dry friction in maximal coordinates. Between impacts a method of order 2 takes
/// rolling, sliding and turning bodies for the price of the linearised Euler method, one problem a step, with errors
/// smaller by orders. Of springs it damps the stiff ones alone, of elements none: what impacts excite there would
/// rattle on.
void choose_in_touch(SceneSystem& system, const std::string& reason) {
    const bool vibrates = has_elements(system);
    if (!vibrates) system.integrator = "linearly_implicit_trapezoidal";
    system.method_reason = reason + (vibrates ? ", and elements vibrate" : "");
}

/// For a system with contacts, stops or forces with limits.
void choose_with_unilateral(SceneSystem& system, bool in_joints) {
    const bool touching = system.system->detects_contacts();
    if (touching && (!in_joints || mostly_without_joints(system))) {
        choose_in_touch(system, in_joints ? "bodies may touch, most of these have no joints" : "bodies may touch");
        return;
    }
    const bool chosen_steps = system.control || system.steps_by_accuracy();
    if (!in_joints || (system.control && !touching)) {
        system.method_reason = "joints have stops, dry friction or forces with limits";
        if (!system.control) choose_in_touch(system, system.method_reason);
        return;
    }
    const bool flies = !chosen_steps && !always_acts(system);
    const std::string stiff = chosen_steps ? why_stiff(system, most_rate_of_chosen_steps, most_rate_of_chosen_steps)
                              : touching && flies
                                  ? why_stiff(system, most_motion_beside_contacts, most_damping_beside_contacts)
                                  : why_stiff(system, most_rate_of_order_2, most_rate_of_order_2);
    system.coordinates = Coordinates::Joint;
    system.method_reason =
        (touching ? "bodies with joints may touch, and "
                  : "nothing can touch, joints have stops, dry friction or forces with limits, and ") +
        (stiff.empty() ? "no force is stiff" : stiff);
    // What beams vibrate with stays in a method of order 2. Of springs it damps the stiff ones alone.
    if (!stiff.empty() && !flies && has_elements(system)) return;
    const bool switches = flies ? touching || !stiff.empty() : touching && !chosen_steps && stiff.empty();
    if (!switches) {
        system.integrator = "moreau_jean";
        return;
    }
    // In flight a stiff force costs nothing, and in contact the undamped method keeps what little it excites.
    system.integrator = "switching";
    system.integrator_options.insert_or_assign("error_limit", error_limit);
    if (!stiff.empty()) system.integrator_options.insert_or_assign("flight", "radau_iia");
}

/// Whether it has one of the two methods that take contacts at the speeds of both ends of a step.
bool is_of_order_2(const SceneSystem& system) {
    return system.integrator == "linearly_implicit_trapezoidal" || system.integrator == "moreau_jean";
}

/// What a method would do to the motion in fixed steps; empty: too little to matter, or what nobody could pay to avoid.
/// Those of order 2 do not follow what vibrates or decays within a few of them. The one of order 1 damps everything;
/// but with joints its estimate wants steps in proportion to the accuracy, and where elements touch, forty times the
/// time.
std::string why_divided(const SceneSystem& system) {
    if (system.integrator == "euler_implicit_linearized") {
        const bool dear = system.system->m() > 0 || !system.elastic_blocks.empty() || !system.beams.empty();
        return dear || system.sleeping || system.system->n() == 0 ? std::string() : "its method is of order 1";
    }
    if (!is_of_order_2(system)) return {};
    constexpr double any = std::numeric_limits<double>::infinity();
    const std::string fast = how_fast(system, {most_rate_of_fixed_steps, any, most_rate_of_fixed_steps});
    return fast.empty() ? fast : "forces have " + fast;
}

void divide_by_error(SceneSystem& system) {
    if (system.control || system.steps_by_accuracy()) return;
    const std::string why = why_divided(system);
    if (why.empty()) return;
    system.division = StepDivision::ToChosenAccuracy;
    system.method_reason += fmt::format("; {}, so steps are divided by their error", why);
}

/// What happens within a fixed step is early or late by up to its length. Where bodies sleep, what it did is not
/// undone.
void divide_while_cheap(SceneSystem& system) {
    const bool fixed = !system.control && !system.steps_by_accuracy() && !system.sleeping;
    const bool order_2 = system.integrator == "switching" || is_of_order_2(system);
    if (!fixed || !order_2 || !system.system->has_unilateral()) return;
    system.division = StepDivision::WhileCheap;
    system.method_reason += "; fixed steps that err are divided while that is cheap";
}

void choose_of_all(SceneSystem& system) {
    system.integrator = "euler_implicit_linearized";
    system.method_reason = why_default(system);
    if (!system.method_reason.empty()) return;
    if (const std::string reason = why_maximal(system); !reason.empty()) {
        system.method_reason = reason;
        if (system.system->detects_contacts()) choose_in_touch(system, reason);
        return;
    }
    // Joint coordinates take rigid bodies alone, with masses of their own.
    const bool in_joints = (system.coordinates_chosen || system.coordinates == Coordinates::Joint) &&
                           system.system->node_count() == 0 && !system.system->has_consistent_mass() &&
                           std::any_of(system.joints.begin(), system.joints.end(),
                                       [&](const JointParameters& joint) { return can_be_in_a_tree(system, joint); });
    if (system.system->has_unilateral()) {
        choose_with_unilateral(system, in_joints);
        return;
    }
    const double most = has_elements(system) ? most_explicit_rate_of_elements : most_explicit_rate;
    const std::string stiff = why_stiff(system, most, most);
    if (in_joints) system.coordinates = Coordinates::Joint;
    system.integrator = stiff.empty() ? "dormand_prince" : "radau_iia";
    system.method_reason = "nothing can touch, and " + (stiff.empty() ? "no force is stiff" : stiff);
    if (!system.control && !system.steps_by_accuracy())
        system.integrator_options.insert_or_assign("error_limit",
                                                   stiff.empty() ? error_limit_of_explicit : error_limit);
}

}  // namespace

void choose_method(SceneSystem& system) {
    if (system.coordinates_chosen && !system.system->needs_joint_coordinates().empty())
        system.coordinates = Coordinates::Joint;
    if (system.integrator != chosen) return;
    choose_of_all(system);
    divide_by_error(system);
    divide_while_cheap(system);
}

}  // namespace delassus::scene
