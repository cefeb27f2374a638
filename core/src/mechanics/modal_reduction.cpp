// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/modal_reduction.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "mechanics/checks.hpp"
#include "mechanics/eigenmodes.hpp"
#include "support/pivoted_qr.hpp"

namespace delassus::mechanics {
namespace {

using Nodes = std::vector<std::int32_t>;

[[noreturn]] void refuse(const std::string& name, const std::string& rule) {
    throw InputError(fmt::format("the elastic body \"{}\" cannot be reduced to modes: {}", name, rule));
}

Vector3d mean_of(const Nodes& nodes, const Matrix3Xd& places) {
    Vector3d sum = Vector3d::Zero();
    for (const auto node : nodes) sum += places.col(node);
    return sum / static_cast<double>(nodes.size());
}

/// Σ (|d|² I − d dᵀ) over the nodes about their mean.
Matrix3d spread_of(const Nodes& nodes, const Matrix3Xd& places) {
    const Vector3d mean = mean_of(nodes, places);
    Matrix3d sum = Matrix3d::Zero();
    for (const auto node : nodes) sum -= skew(places.col(node) - mean) * skew(places.col(node) - mean);
    return sum;
}

/// The matrix times a vector, or each of several.
MatrixXd times(const SparseMatrix& K, const MatrixXd& x) {
    MatrixXd result = MatrixXd::Zero(K.rows, x.cols());
    for (Eigen::Index j = 0; j < x.cols(); ++j) K.multiply_add(1.0, x.col(j).data(), result.col(j).data());
    return result;
}

class Reduction {
public:
    Reduction(const std::string& name, const ElasticStructure& structure, const std::vector<Nodes>& interfaces,
              const std::vector<ModalLoadPattern>& loads, std::int32_t normal)
        : name_(name), structure_(structure), interfaces_(interfaces), loads_(loads), normal_(normal) {
        mass_ = structure.mass.replicate(1, 3).transpose().reshaped();
    }

    ModalModel make() {
        must_hang_together();
        centre();
        rigid_modes();
        sort_interfaces();
        MatrixXd basis = span();
        diagonalise(basis);
        inertia();
        for (const Nodes& nodes : interfaces_) model_.interfaces.push_back(interface_of(nodes));
        for (const auto& load : loads_) model_.loads.push_back(load_of(load));
        return std::move(model_);
    }

private:
    void must_hang_together() const {
        std::vector<std::int32_t> parent(static_cast<std::size_t>(structure_.mass.size()));
        std::iota(parent.begin(), parent.end(), 0);
        const auto root = [&](std::int32_t i) {
            const auto up = [&](std::int32_t j) -> std::int32_t& { return parent[static_cast<std::size_t>(j)]; };
            while (up(i) != i) i = up(i) = up(up(i));
            return i;
        };
        auto parts = static_cast<std::int32_t>(parent.size());
        for (std::int32_t row = 0; row < structure_.K.rows; ++row)
            for (auto e = structure_.K.row_start[static_cast<std::size_t>(row)];
                 e < structure_.K.row_start[static_cast<std::size_t>(row) + 1]; ++e) {
                const auto first = root(row / 3), second = root(structure_.K.column[static_cast<std::size_t>(e)] / 3);
                if (first == second) continue;
                parent[static_cast<std::size_t>(std::max(first, second))] = std::min(first, second);
                --parts;
            }
        if (parts > 1) refuse(name_, fmt::format("its mesh falls into {} parts that do not hang together", parts));
    }

    void centre() {
        model_.inertia.mass = structure_.mass.sum();
        model_.centre = structure_.places * structure_.mass / model_.inertia.mass;
        model_.places = structure_.places.colwise() - model_.centre;
    }

    /// Translations and rotations, M-orthonormal.
    void rigid_modes() {
        const auto& X = model_.places;
        rigid_.setZero(mass_.size(), 6);
        for (Eigen::Index i = 0; i < X.cols(); ++i) {
            rigid_.block<3, 3>(3 * i, 0).setIdentity();
            rigid_.block<3, 3>(3 * i, 3) = -skew(X.col(i));
        }
        rigid_.leftCols<3>() /= std::sqrt(model_.inertia.mass);
        auto turns = rigid_.rightCols<3>();
        const Matrix3d J = turns.transpose() * mass_.asDiagonal() * turns;
        turns = (J.llt().matrixL().solve(turns.transpose())).transpose().eval();
    }

    void sort_interfaces() {
        held_.assign(static_cast<std::size_t>(structure_.mass.size()), false);
        const double size = (model_.places.rowwise().maxCoeff() - model_.places.rowwise().minCoeff()).norm();
        for (const Nodes& nodes : interfaces_) {
            if (nodes.size() == 1) continue;
            const Eigen::SelfAdjointEigenSolver<Matrix3d> spread(spread_of(nodes, model_.places));
            const double width = std::sqrt(std::max(0.0, spread.eigenvalues()[0]) / static_cast<double>(nodes.size()));
            if (width < 1e-6 * size)
                refuse(name_, fmt::format("the {} nodes of one of its interfaces lie on a line, which holds no turn "
                                          "about it; take a single node, or three that make a triangle",
                                          nodes.size()));
            for (const auto node : nodes) held_[static_cast<std::size_t>(node)] = true;
            ++rigid_interfaces_;
        }
        place_.assign(static_cast<std::size_t>(mass_.size()), -1);
        for (Eigen::Index i = 0; i < mass_.size(); ++i)
            if (!held_[static_cast<std::size_t>(i / 3)]) {
                place_[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(free_.size());
                free_.push_back(static_cast<std::int32_t>(i));
            }
        if (free_.empty()) refuse(name_, "attachments hold all of its nodes");
    }

    /// The rows and columns of K that nothing holds.
    [[nodiscard]] SparseMatrix free_stiffness() const {
        const auto& K = structure_.K;
        SparseMatrix part;
        part.rows = part.columns = static_cast<std::int32_t>(free_.size());
        for (const auto row : free_) {
            for (auto e = static_cast<std::size_t>(K.row_start[static_cast<std::size_t>(row)]);
                 e < static_cast<std::size_t>(K.row_start[static_cast<std::size_t>(row) + 1]); ++e) {
                const auto column = place_[static_cast<std::size_t>(K.column[e])];
                if (column < 0) continue;
                part.column.push_back(column);
                part.value.push_back(K.value[e]);
            }
            part.row_start.push_back(static_cast<std::int32_t>(part.column.size()));
        }
        return part;
    }

    [[nodiscard]] MatrixXd free_rows(const MatrixXd& full) const { return full(free_, Eigen::all); }
    [[nodiscard]] MatrixXd with_held_rows(const MatrixXd& part) const {
        MatrixXd full = MatrixXd::Zero(mass_.size(), part.cols());
        full(free_, Eigen::all) = part;
        return full;
    }

    /// The smallest ω² that one of the six uniform strains gives: 12 E/(ρ L²) for a rod of the length L.
    [[nodiscard]] double square_of_stretching() const {
        const auto& X = model_.places;
        double least = std::numeric_limits<double>::infinity();
        for (Eigen::Index a = 0; a < 3; ++a)
            for (Eigen::Index b = 0; b <= a; ++b) {
                MatrixXd u = MatrixXd::Zero(mass_.size(), 1);
                for (Eigen::Index i = 0; i < X.cols(); ++i) {
                    u(3 * i + a, 0) += X(b, i);
                    if (a != b) u(3 * i + b, 0) += X(a, i);
                }
                const double energy = (u.transpose() * times(structure_.K, u))(0, 0);
                least = std::min(least, energy / u.col(0).dot(mass_.cwiseProduct(u.col(0))));
            }
        return least;
    }

    /// Forces at single nodes and of loads, one a column.
    [[nodiscard]] MatrixXd load_forces() const {
        std::vector<VectorXd> forces;
        const auto add = [&](const std::vector<NodeShare>& shares, Eigen::Index along) {
            VectorXd& force = forces.emplace_back(VectorXd::Zero(mass_.size()));
            for (const auto& [node, share] : shares) force[3 * node + along] += share;
        };
        for (const Nodes& nodes : interfaces_)
            if (nodes.size() == 1)
                for (Eigen::Index along = 0; along < 3; ++along) add({{nodes[0], 1.0}}, along);
        for (const auto& load : loads_)
            for (std::size_t along = 0; along < 3; ++along)
                if (load.along[along]) add(load.shares, static_cast<Eigen::Index>(along));
        MatrixXd result(mass_.size(), static_cast<Eigen::Index>(forces.size()));
        for (std::size_t j = 0; j < forces.size(); ++j) result.col(static_cast<Eigen::Index>(j)) = forces[j];
        return result;
    }

    /// The rigid motions of the held interfaces but the first, each with the others at rest.
    [[nodiscard]] MatrixXd interface_motions() const {
        MatrixXd motions = MatrixXd::Zero(mass_.size(), 6 * std::max(0, rigid_interfaces_ - 1));
        Eigen::Index column = 0;
        bool first = true;
        for (const Nodes& nodes : interfaces_) {
            if (nodes.size() == 1 || std::exchange(first, false)) continue;
            const Vector3d mean = mean_of(nodes, model_.places);
            for (const auto node : nodes) {
                motions.block<3, 3>(3 * node, column).setIdentity();
                motions.block<3, 3>(3 * node, column + 3) = -skew(model_.places.col(node) - mean);
            }
            column += 6;
        }
        return motions;
    }

    /// A basis of the span less the rigid motions, columns that need not be independent.
    MatrixXd span() {
        const bool floats = rigid_interfaces_ == 0;
        const MatrixXd motions = interface_motions();
        MatrixXd loads = load_forces();
        stretching_ = square_of_stretching();
        const double shift = floats ? 1e-4 * stretching_ : 0.0;
        if (floats) loads -= mass_.asDiagonal() * (rigid_ * (rigid_.transpose() * loads));
        const auto freedoms = static_cast<std::int32_t>(free_.size());
        const std::int32_t count = normal_ + (floats && normal_ > 0 ? 6 : 0);
        if (2 * count > freedoms)
            refuse(name_, fmt::format("{} normal modes are too many for the {} freedoms of its nodes that are not "
                                      "held; up to {} can be kept",
                                      normal_, freedoms, std::max(0, freedoms / 2 - (floats ? 6 : 0))));
        const SparseMatrix K = free_stiffness();
        const VectorXd mass = free_rows(mass_);
        MatrixXd forces(freedoms, motions.cols() + loads.cols());
        forces.leftCols(motions.cols()) = -free_rows(times(structure_.K, motions));
        forces.rightCols(loads.cols()) = free_rows(loads);
        const Eigenmodes found =
            find_eigenmodes(K, mass, floats ? rigid_ : MatrixXd(freedoms, 0), shift, forces, count);
        MatrixXd responses = with_held_rows(found.responses);
        responses.leftCols(motions.cols()) += motions;
        MatrixXd basis(mass_.size(), responses.cols() + normal_);
        basis.leftCols(responses.cols()) = responses;
        basis.rightCols(normal_) = with_held_rows(found.modes.rightCols(normal_));
        for (int twice = 0; twice < 2; ++twice)
            basis -= rigid_ * (rigid_.transpose() * (mass_.asDiagonal() * basis)).eval();
        return basis;
    }

    /// model_.shapes and squares. The inverse of the stiffness in an M-orthonormal basis has the low modes as its
    /// largest ones, to all digits; of the high ones the stiffness itself knows ω² better.
    void diagonalise(const MatrixXd& basis) {
        const VectorXd root = mass_.cwiseSqrt();
        MatrixXd scaled = root.asDiagonal() * basis;
        for (Eigen::Index j = 0; j < scaled.cols(); ++j)
            if (const double norm = scaled.col(j).norm(); norm > 0.0) scaled.col(j) /= norm;
        const PivotedQr qr(scaled);
        const Eigen::Index k = qr.rank(1e-10);
        if (k == 0) refuse(name_, "no mode is left of it; keep at least one");
        MatrixXd W = qr.Q(k);
        W = root.cwiseInverse().asDiagonal() * W;
        MatrixXd stiffness = W.transpose() * times(structure_.K, W);
        stiffness = (0.5 * (stiffness + stiffness.transpose())).eval();
        const Eigen::LLT<MatrixXd> factor(stiffness);
        if (factor.info() != Eigen::Success) not_held_together();
        MatrixXd inverse = factor.solve(MatrixXd::Identity(k, k));
        inverse = (0.5 * (inverse + inverse.transpose())).eval();
        const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(inverse);
        const MatrixXd modes = solver.eigenvectors().rowwise().reverse();
        const VectorXd flexibility = solver.eigenvalues().reverse();
        const double middle = std::sqrt(flexibility[0] * std::max(flexibility[k - 1], 0.0));
        VectorXd& squares = model_.inertia.squares;
        squares = (modes.transpose() * stiffness * modes).diagonal();
        for (Eigen::Index j = 0; j < k; ++j)
            if (flexibility[j] > middle) squares[j] = 1.0 / flexibility[j];
        if (!(squares.minCoeff() > 1e-9 * stretching_)) not_held_together();
        model_.shapes = std::sqrt(model_.inertia.mass) * (W * modes);
    }

    [[noreturn]] void not_held_together() const {
        refuse(name_, "parts of its mesh hang together by a point or an edge alone, and can move without force");
    }

    void inertia() {
        const auto& X = model_.places;
        const auto nodes = X.cols(), k = model_.shapes.cols();
        std::array<MatrixXd, 3> shape;
        for (Eigen::Index i = 0; i < 3; ++i) {
            auto& own = shape[static_cast<std::size_t>(i)];
            own.resize(nodes, k);
            for (Eigen::Index node = 0; node < nodes; ++node) own.row(node) = model_.shapes.row(3 * node + i);
        }
        constexpr std::array<std::array<std::size_t, 2>, 6> pairs = {{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
        ModalInertia& result = model_.inertia;
        for (std::size_t c = 0; c < pairs.size(); ++c) {
            const auto [a, b] = pairs[c];
            const VectorXd first = structure_.mass.cwiseProduct(X.row(static_cast<Eigen::Index>(a)).transpose());
            const VectorXd second = structure_.mass.cwiseProduct(X.row(static_cast<Eigen::Index>(b)).transpose());
            result.moments[c] = first.dot(X.row(static_cast<Eigen::Index>(b)));
            result.linear_moments[c] = shape[b].transpose() * first + shape[a].transpose() * second;
            const MatrixXd square = shape[a].transpose() * structure_.mass.asDiagonal() * shape[b];
            result.square_moments[c] = 0.5 * (square + square.transpose());
        }
        for (std::size_t i = 0; i < 3; ++i) {
            const MatrixXd product = shape[(i + 1) % 3].transpose() * structure_.mass.asDiagonal() * shape[(i + 2) % 3];
            result.products[i] = product - product.transpose();
        }
    }

    [[nodiscard]] Matrix3Xd shape_of(std::int32_t node) const { return model_.shapes.middleRows(3 * node, 3); }

    /// The rigid motion that fits its nodes best; all of them have it, but for rounding.
    [[nodiscard]] ModalInterface interface_of(const Nodes& nodes) const {
        ModalInterface result;
        result.point.place = mean_of(nodes, model_.places);
        result.point.shape = Matrix3Xd::Zero(3, model_.shapes.cols());
        for (const auto node : nodes) result.point.shape += shape_of(node) / static_cast<double>(nodes.size());
        if (nodes.size() == 1) return result;
        Matrix3Xd moment = Matrix3Xd::Zero(3, model_.shapes.cols());
        for (const auto node : nodes)
            moment += skew(model_.places.col(node) - result.point.place) * (shape_of(node) - result.point.shape);
        result.turn = spread_of(nodes, model_.places).llt().solve(moment);
        return result;
    }

    [[nodiscard]] ModalPoint load_of(const ModalLoadPattern& load) const {
        ModalPoint result{Vector3d::Zero(), Matrix3Xd::Zero(3, model_.shapes.cols())};
        for (const auto& [node, share] : load.shares) {
            result.place += share * model_.places.col(node);
            result.shape += share * shape_of(node);
        }
        return result;
    }

    const std::string& name_;
    const ElasticStructure& structure_;
    const std::vector<Nodes>& interfaces_;
    const std::vector<ModalLoadPattern>& loads_;
    std::int32_t normal_;
    VectorXd mass_;   // of x, y, z of all nodes
    MatrixXd rigid_;  // M-orthonormal
    std::vector<bool> held_;
    std::vector<std::int32_t> free_, place_;  // rows of K that nothing holds, and the place of each row among them
    int rigid_interfaces_ = 0;
    double stretching_ = 0.0;
    ModalModel model_;
};

}  // namespace

ModalModel reduce(const std::string& name, const ElasticStructure& structure,
                  const std::vector<std::vector<std::int32_t>>& interfaces, const std::vector<ModalLoadPattern>& loads,
                  std::int32_t normal) {
    return Reduction(name, structure, interfaces, loads, normal).make();
}

}  // namespace delassus::mechanics
