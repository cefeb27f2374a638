// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/linkage.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "support/pivoted_qr.hpp"

namespace delassus::mechanics {

namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();
/// By which a motor's residual and starts are followed: rad, or a share of the size.
constexpr double part_of_way = 0.1;

/// The bodies of a joint that move.
std::vector<BodyIndex> movers(const Joint& joint, const std::vector<Body>& bodies) {
    std::vector<BodyIndex> all = {joint.parameters.first, joint.parameters.second};
    if (joint.gear) all.assign(joint.gear->bodies.begin(), joint.gear->bodies.end());
    std::erase_if(
        all, [&](BodyIndex body) { return body == world_body || bodies[static_cast<std::size_t>(body)].column < 0; });
    return all;
}

}  // namespace

struct Linkage::Values {
    Eigen::VectorXd C, rate;                         // in the rows' own units
    Eigen::SparseMatrix<double, Eigen::RowMajor> J;  // C_q
};

std::vector<Linkage> Linkage::of(const std::vector<Body>& bodies, const std::vector<Joint>& joints,
                                 const Placements& at) {
    std::vector<BodyIndex> leader(bodies.size());
    std::iota(leader.begin(), leader.end(), 0);
    const auto find = [&](BodyIndex body) {
        auto& of = leader;
        while (of[static_cast<std::size_t>(body)] != body) {
            auto& next = of[static_cast<std::size_t>(body)];
            next = of[static_cast<std::size_t>(next)];
            body = next;
        }
        return body;
    };
    for (const Joint& joint : joints) {
        const auto own = movers(joint, bodies);
        for (const BodyIndex body : own) leader[static_cast<std::size_t>(find(body))] = find(own.front());
    }
    std::map<BodyIndex, std::pair<std::vector<BodyIndex>, std::vector<std::int32_t>>> groups;
    for (std::size_t j = 0; j < joints.size(); ++j) {
        const auto own = movers(joints[j], bodies);
        if (!own.empty()) groups[find(own.front())].second.push_back(static_cast<std::int32_t>(j));
    }
    for (std::size_t k = 0; k < bodies.size(); ++k)
        if (const auto group = groups.find(find(static_cast<BodyIndex>(k))); group != groups.end())
            group->second.first.push_back(static_cast<BodyIndex>(k));
    const auto placements = std::make_shared<Placements>(at);
    for (std::size_t k = 0; k < bodies.size(); ++k)
        (*placements)[static_cast<BodyIndex>(k)].column =
            bodies[k].prescribed ? prescribed_column(static_cast<BodyIndex>(k)) : -1;
    std::vector<Linkage> linkages;
    for (auto& [first, group] : groups)
        linkages.push_back(Linkage(bodies, joints, std::move(group.first), group.second, placements));
    return linkages;
}

// A tree of joints has independent rows: the last body of a branch moves freely but for its own joint.
Linkage::Linkage(const std::vector<Body>& bodies, const std::vector<Joint>& joints, std::vector<BodyIndex> members,
                 const std::vector<std::int32_t>& own_joints, std::shared_ptr<Placements> at)
    : bodies_(&bodies), members_(std::move(members)), at_(std::move(at)) {
    for (std::size_t k = 0; k < bodies.size(); ++k)
        if (bodies[k].prescribed) prescribed_.push_back(static_cast<BodyIndex>(k));
    Eigen::AlignedBox3d box;
    double radius = 0.0;
    for (std::size_t k = 0; k < members_.size(); ++k) {
        const Body& body = bodies[static_cast<std::size_t>(members_[k])];
        (*at_)[members_[k]].column = static_cast<std::int32_t>(6 * k);
        box.extend((*at_)[members_[k]].x);
        arms_.push_back(std::sqrt(body.metric_inertia.diagonal().maxCoeff() / body.metric_mass));
        radius = std::max(radius, arms_.back());
    }
    const auto reach = [&](BodyIndex body, const Vector3d& point) {
        box.extend(point);
        if (body == world_body || (*at_)[body].column < 0) return;
        double& arm = arms_[static_cast<std::size_t>((*at_)[body].column / 6)];
        arm = std::max(arm, (point - (*at_)[body].x).norm());
    };
    bool grounded = false;
    for (const auto index : own_joints) {
        const Joint& joint = joints[static_cast<std::size_t>(index)];
        const auto own = movers(joint, bodies);
        grounded = grounded || own.size() < (joint.gear ? 4U : 2U);
        has_loops_ = has_loops_ || joint.gear;
        if (joint.gear) {
            rows_.push_back({&joint, nullptr, nullptr, false, !joint.gear->first.angle});
        } else {
            const JointParameters& given = joint.parameters;
            reach(given.first, vector(given.point));
            reach(given.second, vector(given.kind == JointKind::Distance ? given.second_point : given.point));
        }
        const std::size_t own_rows = joint.rows.size() - joint.motors.size();
        for (std::size_t i = 0; i < joint.rows.size(); ++i) {
            const Row& row = joint.rows[i];
            rows_.push_back({&joint, &row, i < own_rows ? nullptr : &joint.motors[i - own_rows], row.drive != nullptr,
                             row.u.count == 2});
        }
        has_loops_ = has_loops_ || joint.motors.size() > 1;
        for (std::int32_t i = 0; i < joint.row_count(); ++i) numbers_.push_back(joint.first_row + i);
    }
    has_loops_ = has_loops_ || own_joints.size() + 1 > members_.size() + (grounded ? 1 : 0);
    size_ = std::max(box.diagonal().norm(), radius);
    reach_ = std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
    for (std::size_t i = 0; i < rows_.size(); ++i) {
        all_.push_back(i);
        if (!rows_[i].driven) scleronomic_.push_back(i);
    }
    for (const auto index : own_joints) {
        const Joint& joint = joints[static_cast<std::size_t>(index)];
        for (const bool turns : {true, false}) {
            const JointCoordinate& start = turns ? joint.parameters.turn : joint.parameters.slide;
            if (start.start) starts_.push_back(rows_.size());
            if (start.start_rate) start_rates_.push_back(rows_.size());
            if (start.start || start.start_rate)
                rows_.push_back({&joint, turns ? &joint.turn : &joint.slide, nullptr, true, !turns, &start});
        }
    }
}

int Linkage::parts_of_starts() const {
    if (!has_loops_) return 1;
    double most = 0.0;
    for (const auto row : starts_) most = std::max(most, std::abs(*rows_[row].start->start) / unit_of(row));
    return std::max(1, static_cast<int>(std::ceil(most / part_of_way)));
}

std::string Linkage::owner_of(std::size_t row) const {
    const RowOfJoint& one = rows_[row];
    return one.motor ? fmt::format("motor \"{}\"", *one.motor)
                     : fmt::format("{}joint \"{}\"", one.start ? "the start of " : "", one.joint->parameters.name);
}

// ---- Motions ----

void Linkage::Largest::include(const Vector3d& line, const Vector3d& turn) {
    linear = std::max(linear, line.norm());
    angular = std::max(angular, turn.norm());
}

namespace {

Quaterniond orientation(const State& state, const Body& body) {
    const double* q = state.q.data() + body.position;
    return {q[3], q[4], q[5], q[6]};
}
Vector3d three(const std::vector<double>& values, std::int32_t first) {
    return Vector3d(values.data() + first);
}

}  // namespace

Linkage::Largest Linkage::displacement(const State& from, const State& to) const {
    Largest largest;
    for (const BodyIndex index : members_) {
        const Body& body = (*bodies_)[static_cast<std::size_t>(index)];
        largest.include(three(to.q, body.position) - three(from.q, body.position),
                        logarithm(orientation(from, body).conjugate() * orientation(to, body)));
    }
    return largest;
}

Linkage::Largest Linkage::velocity_change(const State& from, const State& to, bool of_given) const {
    Largest largest;
    const auto change = [&](std::int32_t column) -> Vector3d {
        if (of_given && three(from.v, column).isZero(0.0)) return Vector3d::Zero();
        return three(to.v, column) - three(from.v, column);
    };
    for (const BodyIndex index : members_) {
        const auto column = (*bodies_)[static_cast<std::size_t>(index)].column;
        largest.include(change(column), change(column + 3));
    }
    return largest;
}

Linkage::Largest Linkage::speed(const State& state) const {
    Largest largest;
    for (const BodyIndex index : members_) {
        const auto column = (*bodies_)[static_cast<std::size_t>(index)].column;
        largest.include(three(state.v, column), three(state.v, column + 3));
    }
    return largest;
}

void Linkage::increment(State& state, const Eigen::VectorXd& change) const {
    for (std::size_t k = 0; k < members_.size(); ++k) {
        const Body& body = (*bodies_)[static_cast<std::size_t>(members_[k])];
        const auto by = change.segment<6>(static_cast<Eigen::Index>(6 * k));
        const Quaterniond turned = rotated(orientation(state, body), by.tail<3>());
        double* q = state.q.data() + body.position;
        for (int i = 0; i < 3; ++i) q[i] += by[i];
        q[3] = turned.w();
        q[4] = turned.x();
        q[5] = turned.y();
        q[6] = turned.z();
    }
    place(state);
    for (const RowOfJoint& one : rows_)
        if (const auto& angle = one.joint->turn.angle; angle && angle->counted >= 0)
            *(state.q.end() - static_cast<std::ptrdiff_t>(at_->angles.size()) + angle->counted) =
                angle->value(*at_) - angle->prescribed_turn(*at_);
}

void Linkage::place(const State& state) const {
    std::copy(state.q.end() - static_cast<std::ptrdiff_t>(at_->angles.size()), state.q.end(), at_->angles.begin());
    for (const BodyIndex index : prescribed_)
        (*bodies_)[static_cast<std::size_t>(index)].prescribed->place(state.t, (*at_)[index]);
    for (const BodyIndex index : members_) {
        const Body& body = (*bodies_)[static_cast<std::size_t>(index)];
        (*at_)[index].x = three(state.q, body.position);
        (*at_)[index].A = orientation(state, body).toRotationMatrix();
    }
}

// ---- Rows ----

void Linkage::evaluate(const State& state, const std::vector<std::size_t>& rows, Values& values) const {
    place(state);
    const auto m = static_cast<Eigen::Index>(rows.size());
    values.C.resize(m);
    values.rate.setZero(m);
    std::vector<Eigen::Triplet<double>> entries;
    RowVector gradient;
    const auto add_row = [&](std::size_t i, const Row& row, double factor) {
        const auto columns = row.columns(*at_);
        row.gradient(*at_, columns, gradient);
        for (int k = 0; k < columns.bodies; ++k)
            for (int j = 0; j < 6; ++j)
                entries.emplace_back(static_cast<int>(i), columns.column[static_cast<std::size_t>(k)] + j,
                                     factor * gradient[6 * k + j]);
    };
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const RowOfJoint& one = rows_[rows[i]];
        const auto index = static_cast<Eigen::Index>(i);
        if (one.row == nullptr) {
            const Gear& gear = *one.joint->gear;
            values.C[index] = gear.value(*at_, state.t);
            values.rate[index] = gear.rate(*at_, state.t);
            add_row(i, gear.second, 1.0);
            add_row(i, gear.first, -gear.ratio());
            continue;
        }
        const Row& row = *one.row;
        values.C[index] = row.value(*at_, state.t);
        values.rate[index] = row.rate(*at_, state.t);
        if (one.start) {
            values.C[index] -= share_ * one.start->start.value_or(0.0);
            values.rate[index] -= one.start->start_rate.value_or(0.0);
        }
        add_row(i, row, 1.0);
    }
    values.J.resize(m, static_cast<Eigen::Index>(6 * members_.size()));
    values.J.setFromTriplets(entries.begin(), entries.end());
}

namespace {

constexpr double rounding = 64.0 * epsilon;

}  // namespace

bool Linkage::is_rounding(const Residual& position) const {
    return position.value <= rounding * (1.0 + reach_ / size_);
}

bool Linkage::is_rounding_of_rates(const Residual& rate) {
    return std::min(rate.value, rate.share) <= rounding;
}

Linkage::Residual Linkage::residual(const State& state, const std::vector<std::size_t>& rows) const {
    Values values;
    evaluate(state, rows, values);
    Residual worst;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const double value = std::abs(values.C[static_cast<Eigen::Index>(i)]) / unit_of(rows[i]);
        if (!(value <= worst.value) && !std::isnan(worst.value)) worst = {value, rows[i]};
    }
    return worst;
}

Linkage::Residual Linkage::rate_residual(const State& state, const std::vector<std::size_t>& rows) const {
    Values values;
    evaluate(state, rows, values);
    Residual worst;
    double largest = 0.0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const auto index = static_cast<Eigen::Index>(i);
        double sum = values.rate[index], terms = std::abs(sum);
        for (decltype(values.J)::InnerIterator entry(values.J, index); entry; ++entry) {
            const Body& body =
                (*bodies_)[static_cast<std::size_t>(members_[static_cast<std::size_t>(entry.col() / 6)])];
            const double term = entry.value() * state.v[static_cast<std::size_t>(body.column + entry.col() % 6)];
            sum += term;
            terms += std::abs(term);
        }
        largest = std::max(largest, terms / unit_of(rows[i]));
        const double value = std::abs(sum) / unit_of(rows[i]);
        if (!(value <= worst.value) && !std::isnan(worst.value)) worst = {value, rows[i]};
    }
    if (largest > 0.0) worst.share = worst.value / largest;
    return worst;
}

// ---- The shortest change ----
//
// With the unit lengths of a metric, z = T⁻¹ δ, where M = T⁻ᵀ T⁻¹ for that of the mass: T = 1/√m of a mass centre and
// L⁻ᵀ of a rotation, J = L Lᵀ. The metric of lengths has T = 1 and 1/arm. The shortest z with A z = −c, A = C_q T, has
// no part in the null space of A. Rows are scaled to length one.

Eigen::SparseMatrix<double, Eigen::RowMajor> Linkage::scaled(const Values& values, Metric metric) const {
    const auto n = static_cast<Eigen::Index>(6 * members_.size());
    std::vector<Eigen::Triplet<double>> entries;
    for (std::size_t k = 0; k < members_.size(); ++k) {
        const auto first = static_cast<int>(6 * k);
        const Body& body = (*bodies_)[static_cast<std::size_t>(members_[k])];
        Matrix3d turn = Matrix3d::Identity() / arms_[k];
        double line = 1.0;
        if (metric == Metric::Mass) {
            line = 1.0 / std::sqrt(body.metric_mass);
            turn = body.metric_inertia.llt().matrixU().solve(Matrix3d::Identity());
        }
        for (int i = 0; i < 3; ++i) {
            entries.emplace_back(first + i, first + i, line);
            for (int j = 0; j < 3; ++j)
                if (turn(i, j) != 0.0) entries.emplace_back(first + 3 + i, first + 3 + j, turn(i, j));
        }
    }
    Eigen::SparseMatrix<double, Eigen::RowMajor> T(n, n);
    T.setFromTriplets(entries.begin(), entries.end());
    return values.J * T;
}

Eigen::VectorXd Linkage::unscaled(const Eigen::VectorXd& change, Metric metric) const {
    Eigen::VectorXd result = change;
    for (std::size_t k = 0; k < members_.size(); ++k) {
        const Body& body = (*bodies_)[static_cast<std::size_t>(members_[k])];
        auto line = result.segment<3>(static_cast<Eigen::Index>(6 * k));
        auto turn = result.segment<3>(static_cast<Eigen::Index>(6 * k + 3));
        if (metric == Metric::Mass) {
            line /= std::sqrt(body.metric_mass);
            turn = body.metric_inertia.llt().matrixU().solve(Vector3d(turn));
        } else {
            turn /= arms_[k];
        }
    }
    return result;
}

namespace {

/// Directions in which rows differ by less are singular, where the kept rows alone are asked.
constexpr double singular = 1e-10;
/// Rows that are dependent to this relative measure repeat each other: coordinates of six digits are no better.
constexpr double dependent = 1e-5;

/// The lengths of rows; 1 of rows of zeros.
Eigen::VectorXd lengths_of_rows(const Eigen::SparseMatrix<double, Eigen::RowMajor>& A) {
    Eigen::VectorXd lengths(A.rows());
    for (Eigen::Index i = 0; i < A.rows(); ++i) {
        lengths[i] = A.row(i).norm();
        if (!(lengths[i] > 0.0)) lengths[i] = 1.0;
    }
    return lengths;
}

}  // namespace

// With some velocities alone A z = −c has a solution or not: then z makes |A z + c| least. A row in which these have
// next to no part, as where a body would turn about a point that lies in the row's direction, does not hold them:
// coordinates of few digits, or turned ones, would ask for any speed there. Rows that repeat each other make A Aᵀ
// singular, and columns Aᵀ A; a small diagonal leaves the solution within their span.
Eigen::VectorXd Linkage::shortest(const Values& values, const Eigen::VectorXd& value, Metric metric, double threshold,
                                  const Eigen::VectorXd* marks) const {
    Eigen::SparseMatrix<double, Eigen::RowMajor> A = scaled(values, metric);
    const Eigen::VectorXd lengths = lengths_of_rows(A);
    A = lengths.cwiseInverse().asDiagonal() * A;
    if (marks) {
        A = A * marks->asDiagonal();
        A.prune(1.0, dependent);
    }
    const Eigen::VectorXd b = -value.cwiseQuotient(lengths);
    if (rows_.size() <= most_dense_rows) return unscaled(least_solution(A, b, threshold), metric);
    const Eigen::SparseMatrix<double, Eigen::RowMajor> At = A.transpose();
    Eigen::SparseMatrix<double> G = marks ? At * A : A * At;
    constexpr double shift = 1e-12;
    for (Eigen::Index i = 0; i < G.rows(); ++i) G.coeffRef(i, i) += shift;
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(G);
    return unscaled(marks ? Eigen::VectorXd(factor.solve(At * b)) : Eigen::VectorXd(At * factor.solve(b)), metric);
}

// ---- Assembly ----

Linkage::Residual Linkage::settle(State& state, const std::vector<std::size_t>& rows, Metric metric, double threshold,
                                  int iterations) const {
    constexpr double longest = 0.4;  // of one iteration: rad, or as a share of the size
    constexpr double good = 1e-10;   // where no iteration helps, this much is well
    Values values;
    double last = HUGE_VAL;
    while (true) {
        const Residual left = residual(state, rows);
        if (is_rounding(left) || (left.value <= good && left.value > 0.5 * last) || iterations-- == 0 ||
            !std::isfinite(left.value))
            return left;
        last = left.value;
        evaluate(state, rows, values);
        // A motor or a start that is far off is followed in parts, so that the other joints stay nearly closed.
        for (std::size_t i = 0; i < rows.size(); ++i) {
            const double most = part_of_way * unit_of(rows[i]);
            double& C = values.C[static_cast<Eigen::Index>(i)];
            if (rows_[rows[i]].driven) C = std::clamp(C, -most, most);
        }
        Eigen::VectorXd change = shortest(values, values.C, metric, threshold);
        double most = 0.0;
        for (std::size_t k = 0; k < members_.size(); ++k) {
            const auto by = change.segment<6>(static_cast<Eigen::Index>(6 * k));
            most = std::max({most, by.head<3>().norm() / size_, by.tail<3>().norm()});
        }
        if (most > longest) change *= longest / most;
        increment(state, change);
        if (most <= 4.0 * epsilon) return residual(state, rows);
    }
}

namespace {

/// For directions and residuals on the way to a configuration.
constexpr double coarse = 1e-4;

}  // namespace

void Linkage::approach(State& state) const {
    // On the way to a start a motor is not yet where it drives the joint.
    std::vector<std::size_t> rows = share_ < 1.0 ? scleronomic_ : all_;
    rows.insert(rows.end(), starts_.begin(), starts_.end());
    if (residual(state, rows).value > coarse) settle(state, rows, Metric::Mass, coarse, 100);
}

Linkage::Residual Linkage::assemble_positions(State& state, const std::vector<std::size_t>& rows) const {
    return settle(state, rows, Metric::Mass, singular, 100);
}

// A velocity of a mass centre or of a turning that is 0 was not given: it follows those that were, as far as it can. So
// the rows are first brought as near to 0 as these velocities alone allow, and all of them change for what is left.
Linkage::Residual Linkage::assemble_velocities(State& state, const std::vector<std::size_t>& rows,
                                               bool zeros_follow) const {
    Values values;
    evaluate(state, rows, values);
    const auto n = static_cast<Eigen::Index>(6 * members_.size());
    Eigen::VectorXd v(n);
    for (std::size_t k = 0; k < members_.size(); ++k)
        v.segment<6>(static_cast<Eigen::Index>(6 * k)) = Eigen::Map<const Eigen::Matrix<double, 6, 1>>(
            state.v.data() + (*bodies_)[static_cast<std::size_t>(members_[k])].column);
    if (zeros_follow) {
        Eigen::VectorXd follows(n);
        for (Eigen::Index i = 0; i < n; i += 3)
            follows.segment<3>(i).setConstant(v.segment<3>(i).isZero(0.0) ? 1.0 : 0.0);
        if (follows.minCoeff() < 1.0)
            v += shortest(values, values.J * v + values.rate, Metric::Mass, dependent, &follows);
    }
    const Eigen::VectorXd given = v;
    for (int pass = 0; pass < 3; ++pass)  // the later ones remove what rounding left
        v += shortest(values, values.J * v + values.rate, Metric::Mass, singular);
    // Nothing can move: what is left of the velocities given is rounding, which would miss by all that adds up in it.
    if (v.norm() <= rounding * given.norm()) v.setZero();
    for (std::size_t k = 0; k < members_.size(); ++k)
        Eigen::Map<Eigen::Matrix<double, 6, 1>>(state.v.data() +
                                                (*bodies_)[static_cast<std::size_t>(members_[k])].column) =
            v.segment<6>(static_cast<Eigen::Index>(6 * k));
    return rate_residual(state, rows);
}

void Linkage::fit_velocities(State& state) const {
    if (!is_rounding_of_rates(rate_residual(state, scleronomic_))) assemble_velocities(state, scleronomic_, true);
}

// ---- Rows that others imply ----
//
// Rows are redundant if they depend on others in every configuration that the mechanism can take. At a dead centre, or
// where a parallelogram is flat, rows depend on each other too, but nowhere else; there they are needed. So the rank is
// found at the start and after finite motions along which the rows that do not depend on time hold: the largest one
// counts. Rank is a matter of geometry, so lengths and not masses scale the columns (a body of small mass between heavy
// ones would make its joints look dependent). Column-pivoted QR of the transposed Jacobian then chooses rows (Haug,
// Computer Aided Kinematics and Dynamics of Mechanical Systems, 1989, ch. 3; Wojtyra and Frączek, Multibody System
// Dynamics 30, 2013).

struct Linkage::Rank {
    std::vector<std::size_t> order;  // rows, the most independent first
    Eigen::VectorXd pivots;          // over the first one
    std::size_t rank = 0;
    Eigen::MatrixXd Q;  // its columns from `rank` on are the free motions, in lengths; empty unless asked for

    [[nodiscard]] std::vector<std::size_t> first(std::size_t count) const {
        std::vector<std::size_t> rows(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count));
        std::sort(rows.begin(), rows.end());
        return rows;
    }
};

// Certain rows come first: with the QR factors of theirs, Qᵀ takes the others to the space beside them, where they are
// chosen by pivots. Rows have length one, so that pivots need no scale.
Linkage::Rank Linkage::rank_at(const State& state, const std::vector<std::size_t>& rows, double threshold,
                               bool motions) const {
    Rank rank;
    std::vector<std::size_t> others;
    for (const auto row : rows)
        (std::binary_search(certain_.begin(), certain_.end(), row) ? rank.order : others).push_back(row);
    const auto sure = static_cast<Eigen::Index>(rank.order.size());
    std::vector<std::size_t> sorted = rank.order;
    sorted.insert(sorted.end(), others.begin(), others.end());
    Values values;
    evaluate(state, sorted, values);
    const auto A = scaled(values, Metric::Length);
    const Eigen::VectorXd lengths = lengths_of_rows(A);
    const Eigen::MatrixXd columns = Eigen::MatrixXd(A).transpose() * lengths.cwiseInverse().asDiagonal();
    const Eigen::HouseholderQR<Eigen::MatrixXd> first(columns.leftCols(sure));
    const Eigen::MatrixXd turned = first.householderQ().transpose() * columns.rightCols(columns.cols() - sure);
    const PivotedQr factor(turned.bottomRows(columns.rows() - sure));
    const Eigen::VectorXd pivots = factor.pivots();
    rank.pivots.setOnes(sure + pivots.size());
    rank.pivots.tail(pivots.size()) = pivots;
    if (sure == 0 && pivots.size() > 0 && pivots[0] > 0.0) rank.pivots /= pivots[0];
    for (const std::size_t i : factor.order()) rank.order.push_back(others[i]);
    rank.rank = static_cast<std::size_t>((rank.pivots.array() > threshold).count());
    if (motions) {
        rank.Q = first.householderQ();
        rank.Q.rightCols(columns.rows() - sure) = (rank.Q.rightCols(columns.rows() - sure) * factor.Q()).eval();
    }
    return rank;
}

bool Linkage::move(State& state, std::uint32_t seed) const {
    constexpr int parts = 5;
    constexpr double part = 0.08;     // rad, or as a share of the size
    constexpr double straight = 0.1;  // what must be left of a direction from part to part
    const State begin = state;
    const auto n = static_cast<Eigen::Index>(6 * members_.size());
    Eigen::VectorXd direction(n);
    for (Eigen::Index i = 0; i < n; ++i) {
        seed = 1664525U * seed + 1013904223U;  // Numerical Recipes' generator
        direction[i] = static_cast<double>(seed) / 4294967296.0 - 0.5;
    }
    for (int k = 0; k < parts; ++k) {
        const Rank rank = rank_at(state, scleronomic_, coarse, true);
        Eigen::VectorXd along = rank.Q.transpose() * direction;
        along.head(static_cast<Eigen::Index>(rank.rank)).setZero();
        const Eigen::VectorXd next = rank.Q * along;
        if (!(next.norm() > (k == 0 ? 1e-6 : straight) * direction.norm())) break;
        const Eigen::VectorXd change = unscaled(next, Metric::Length);
        double most = 0.0;
        for (Eigen::Index b = 0; b < n; b += 6)
            most = std::max({most, change.segment<3>(b).norm() / size_, change.segment<3>(b + 3).norm()});
        State tried = state;
        increment(tried, part / most * change);
        if (!(settle(tried, scleronomic_, Metric::Length, coarse, 12).value <= coarse)) break;
        state = std::move(tried);
        direction = next;
    }
    const Largest moved = displacement(begin, state);
    return std::max(moved.linear / size_, moved.angular) > part;
}

std::vector<std::size_t> Linkage::independent_rows(const State& state) const {
    if (!has_loops_ || all_.size() > most_dense_rows) return all_;
    Rank best = rank_at(state, all_, dependent);
    if (best.rank == all_.size()) return all_;
    if (rank_at(state, scleronomic_, dependent).rank == 6 * members_.size()) return best.first(best.rank);
    bool moved = false;
    for (const std::uint32_t seed : {1U, 2U}) {
        State end = state;
        if (!move(end, seed)) continue;
        moved = true;
        Rank there = rank_at(end, all_, dependent);
        if (there.rank > best.rank) best = std::move(there);
    }
    return moved ? best.first(best.rank) : all_;
}

std::vector<std::size_t> Linkage::rows_by_rank(const State& state, double threshold) const {
    const Rank rank = rank_at(state, all_, threshold);
    return rank.first(rank.rank);
}

std::string Linkage::owners_of_implying(const State& state, std::size_t row,
                                        const std::vector<std::size_t>& rows) const {
    constexpr double counts = 1e-3;
    std::vector<std::size_t> all = rows;
    all.push_back(row);
    Values values;
    evaluate(state, all, values);
    const auto A = scaled(values, Metric::Length);
    const Eigen::MatrixXd columns = Eigen::MatrixXd(A).transpose() * lengths_of_rows(A).cwiseInverse().asDiagonal();
    const auto count = static_cast<Eigen::Index>(rows.size());
    const Eigen::VectorXd shares = least_solution(columns.leftCols(count), columns.col(count), dependent).cwiseAbs();
    std::vector<std::string> owners, motors;
    for (Eigen::Index i = 0; i < count; ++i) {
        if (!(shares[i] > counts * largest_entry(shares))) continue;
        const std::size_t other = rows[static_cast<std::size_t>(i)];
        auto& into = rows_[other].motor ? motors : owners;
        std::string owner = owner_of(other);
        if (owner != owner_of(row) && (into.empty() || into.back() != owner)) into.push_back(std::move(owner));
    }
    return fmt::format("{}", fmt::join(motors.empty() ? owners : motors, ", "));
}

bool Linkage::better_rows(const State& state, std::vector<std::size_t>& kept) const {
    constexpr double much_worse = 0.1;
    if (kept.empty()) return false;
    const Rank best = rank_at(state, all_, dependent), own = rank_at(state, kept, dependent);
    if (best.rank < kept.size()) return false;
    const auto last = static_cast<Eigen::Index>(kept.size()) - 1;
    if (own.pivots[last] >= much_worse * best.pivots[last]) return false;
    kept = best.first(kept.size());
    return true;
}

}  // namespace delassus::mechanics
