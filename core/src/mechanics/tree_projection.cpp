// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/tree_projection.hpp"

#include <algorithm>
#include <cmath>

namespace delassus::mechanics {

TreeProjection::TreeProjection(const KinematicTree& tree, const TreeDerivatives& derivatives, std::int32_t n)
    : tree_(tree), derivatives_(derivatives), link_at_(static_cast<std::size_t>(n / 6), 0) {
    for (std::size_t k = 1; k < tree.links().size(); ++k)
        link_at_[static_cast<std::size_t>(tree.links()[k].body_column / 6)] = k;
}

std::span<const TreeProjection::Entry> TreeProjection::row(std::span<const std::int32_t> column,
                                                           std::span<const double> value) {
    constexpr double rounding = 1e-12;
    loaded_.clear();
    entries_.clear();
    for (std::size_t e = 0; e < column.size();) {
        const std::int32_t first = column[e] / 6 * 6;
        Vector6 g = Vector6::Zero();
        for (; e < column.size() && column[e] < first + 6; ++e) g[column[e] - first] += value[e];
        const std::size_t link = link_at(first);
        loaded_.push_back({link, {tree_.motion(link).A * g.tail<3>(), g.head<3>()}});
    }
    std::sort(loaded_.begin(), loaded_.end(), [](const Loaded& a, const Loaded& b) { return a.link < b.link; });
    while (!loaded_.empty()) {
        const auto [k, wrench] = loaded_.back();
        loaded_.pop_back();
        const Link& link = tree_.links()[k];
        const LinkMotion& motion = tree_.motion(k);
        for (std::int32_t j = link.freedoms; j-- > 0;) {
            const double entry = motion.angular.col(j).dot(wrench.angular) + motion.linear.col(j).dot(wrench.linear);
            // What a joint does not move by more than rounding it does not move: a row of rounding has no answer.
            const double size = motion.angular.col(j).norm() * wrench.angular.norm() +
                                motion.linear.col(j).norm() * wrench.linear.norm();
            entries_.push_back({link.column + j, std::abs(entry) <= rounding * size ? 0.0 : entry});
        }
        if (link.parent == 0) continue;
        const auto parent = static_cast<std::size_t>(link.parent);
        const Spatial moved{wrench.angular + motion.d.cross(wrench.linear), wrench.linear};
        auto at = std::lower_bound(loaded_.begin(), loaded_.end(), parent,
                                   [](const Loaded& one, std::size_t wanted) { return one.link < wanted; });
        if (at == loaded_.end() || at->link != parent) {
            loaded_.insert(at, {parent, moved});
            continue;
        }
        const double torque = at->wrench.angular.norm() + moved.angular.norm();
        const double push = at->wrench.linear.norm() + moved.linear.norm();
        at->wrench.angular += moved.angular;
        at->wrench.linear += moved.linear;
        if (at->wrench.angular.norm() <= rounding * torque && at->wrench.linear.norm() <= rounding * push)
            loaded_.erase(at);
    }
    std::reverse(entries_.begin(), entries_.end());
    return entries_;
}

void TreeProjection::find_way(std::size_t k) {
    way_.clear();
    const LinkMotion& body = tree_.motion(k);
    Vector3d arm = Vector3d::Zero();  // from the link on the way
    for (std::size_t at = k; at > 0; at = static_cast<std::size_t>(tree_.links()[at].parent)) {
        const Link& link = tree_.links()[at];
        const LinkMotion& motion = tree_.motion(at);
        for (std::int32_t j = 0; j < link.freedoms; ++j) {
            const Vector3d axis = motion.angular.col(j);
            Vector6 column;
            column << motion.linear.col(j) + axis.cross(arm), body.A.transpose() * axis;
            way_.emplace_back(link.column + j, column);
        }
        arm += motion.d;
    }
}

void TreeProjection::add_matrix(MatrixAssembler& A, double factor, MatrixAssembler& H) {
    add_matrix(A.finish(), factor, false, H);
    A.for_each_product([&](std::span<const std::int32_t> columns, std::span<const double> g, double weight) {
        row(columns, g);
        for (const auto& [first, own] : entries_)
            for (const auto& [column, other] : entries_) H.add(first, column, factor * weight * (own * other));
    });
}

void TreeProjection::add_matrix_along_velocities(const SparseMatrix& A, double factor, MatrixAssembler& H) {
    add_matrix(A, factor, true, H);
}

void TreeProjection::Carried::clear() {
    for (const auto& [column, wrench] : columns) place[static_cast<std::size_t>(column)] = -1;
    columns.clear();
}

void TreeProjection::Carried::add(std::int32_t column, const Spatial& more) {
    const auto at = static_cast<std::size_t>(column);
    if (at >= place.size()) place.resize(at + 1, -1);
    if (place[at] < 0) {
        place[at] = static_cast<std::int32_t>(columns.size());
        columns.emplace_back(column, more);
        return;
    }
    auto& known = columns[static_cast<std::size_t>(place[at])].second;
    known.angular += more.angular;
    known.linear += more.linear;
}

// As forces do, the columns of A J go from each body to the ground, and each link takes of them what acts along its own
// freedoms.
void TreeProjection::add_matrix(const SparseMatrix& A, double factor, bool along_velocities, MatrixAssembler& H) {
    if (A.column.empty()) return;
    const std::size_t links = tree_.links().size();
    carried_.resize(links);
    for (Carried& one : carried_) one.clear();
    for (std::int32_t row = 0; row < A.rows / 6; ++row) {
        const std::size_t own = link_at(6 * row);
        const Matrix3d& turn = tree_.motion(own).A;
        find_blocks(A, row);
        for (const auto& [body, block] : blocks_) {
            const std::size_t other = link_at(6 * body);
            find_way(other);
            for (const auto& [j, J] : way_) {
                const Vector6 pull = block * (along_velocities ? derivatives_.turned_velocity(other, j) : J);
                carried_[own].add(j, {turn * pull.tail<3>(), pull.head<3>()});
            }
        }
    }
    for (std::size_t k = links; k-- > 1;) {
        const Link& link = tree_.links()[k];
        const LinkMotion& motion = tree_.motion(k);
        for (const auto& [j, wrench] : carried_[k].columns) {
            for (std::int32_t i = 0; i < link.freedoms; ++i)
                H.add(link.column + i, j,
                      factor * (motion.angular.col(i).dot(wrench.angular) + motion.linear.col(i).dot(wrench.linear)));
            if (link.parent > 0)
                carried_[static_cast<std::size_t>(link.parent)].add(
                    j, {wrench.angular + motion.d.cross(wrench.linear), wrench.linear});
        }
    }
}

void TreeProjection::find_blocks(const SparseMatrix& A, std::int32_t row) {
    blocks_.clear();
    for (std::int32_t i = 0; i < 6; ++i) {
        const auto at = static_cast<std::size_t>(6 * row + i);
        for (auto e = static_cast<std::size_t>(A.row_start[at]); e < static_cast<std::size_t>(A.row_start[at + 1]);
             ++e) {
            const std::int32_t body = A.column[e] / 6;
            auto found = std::ranges::find(blocks_, body, &std::pair<std::int32_t, Matrix6>::first);
            if (found == blocks_.end()) found = blocks_.insert(found, {body, Matrix6::Zero()});
            found->second(i, A.column[e] % 6) += A.value[e];
        }
    }
}

}  // namespace delassus::mechanics
