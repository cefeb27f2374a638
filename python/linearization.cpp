// SPDX-License-Identifier: BSD-3-Clause
#include "linearization.hpp"

#include <Eigen/LU>
#include <Eigen/SparseLU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace delassus::python {

/// Dense where it is small.
struct Linearization::Factor {
    std::optional<Eigen::PartialPivLU<Eigen::MatrixXd>> dense;
    std::optional<Eigen::SparseLU<Eigen::SparseMatrix<double>>> sparse;
};

Linearization::~Linearization() = default;

Linearization::Linearization(const PreparedProblem& problem, const std::vector<double>& lambda,
                             const std::vector<double>& u, bool coulomb, double tolerance)
    : problem_(&problem), n_(problem.problem().n()), m_(problem.problem().m()) {
    find_local_mobilities();
    std::int32_t row = 0, number = 0;
    for (const Cone& cone : problem.problem().cones) {
        const double* of_lambda = lambda.data() + row;
        const double* of_u = u.data() + row;
        if (add(cone, row, number, of_lambda, of_u, coulomb, tolerance)) degenerate_.push_back(number);
        row += cone.rows;
        ++number;
    }
}

bool Linearization::has_small_blocks() const {
    constexpr std::int32_t most_rows = 64;
    const Structure structure = problem_->structure();
    if (structure != Structure::Definite) return structure <= Structure::Blocks;
    const delassus_problem& raw = problem_->raw();
    for (std::int32_t b = 0; b < raw.h_block_count; ++b)
        if (raw.h_block_start[b + 1] - raw.h_block_start[b] > most_rows) return false;
    return true;
}

bool Linearization::factorize(double compliance) {
    invert_blocks();
    number_active_rows();
    Eigen::SparseMatrix<double> matrix = reduced(compliance);
    size_ = Vector::Zero(active());
    for (Eigen::Index k = 0; k < matrix.outerSize(); ++k)
        for (decltype(matrix)::InnerIterator entry(matrix, k); entry; ++entry)
            size_[entry.row()] = std::max(size_[entry.row()], std::abs(entry.value()));
    // Rows of unlike units: each is divided by its largest entry.
    size_ = size_.cwiseMax(1e-300);
    for (Eigen::Index k = 0; k < matrix.outerSize(); ++k)
        for (decltype(matrix)::InnerIterator entry(matrix, k); entry; ++entry) entry.valueRef() /= size_[entry.row()];
    factor_.reset();
    if (active() == 0) return true;
    factor_ = std::make_unique<Factor>();
    if (active() <= 48) {
        factor_->dense.emplace(Eigen::MatrixXd(matrix));
        const Vector pivots = factor_->dense->matrixLU().diagonal().cwiseAbs();
        return pivots.minCoeff() > 1e-11 * pivots.maxCoeff();
    }
    factor_->sparse.emplace(matrix);
    if (factor_->sparse->info() != Eigen::Success) return false;
    // A vector without special directions shows a kernel by its size.
    Vector probe(active());
    for (Eigen::Index k = 0; k < active(); ++k) probe[k] = std::sin(1.0 + static_cast<double>(k));
    const Vector answer = factor_->sparse->solve(probe);
    return answer.allFinite() && answer.cwiseAbs().maxCoeff() < 1e11;
}

std::pair<Linearization::Vector, Linearization::Vector> Linearization::solve(const Vector& first,
                                                                             const Vector& second) const {
    const Vector right = second - moved(rows_times(of_H(first)));
    const Vector lambda = scatter(backsubstitute(gather(right)));
    return {of_H(first + columns_times(lambda)), lambda};
}

std::pair<Linearization::Vector, Linearization::Vector> Linearization::solve_transposed(const Vector& to_x,
                                                                                        const Vector& to_lambda) const {
    const Vector q = scatter(backsubstitute_transposed(gather(to_lambda + rows_times(of_H(to_x)))));
    return {of_H(to_x - columns_times(moved_back(q))), q};
}

Linearization::Vector Linearization::moved(const Vector& v) const {
    Vector result = Vector::Zero(m_);
    for (const auto& unit : units_)
        result.segment(unit.first, unit.rows()) = unit.moved * v.segment(unit.first, unit.rows());
    return result;
}

Linearization::Vector Linearization::moved_back(const Vector& v) const {
    Vector result = Vector::Zero(m_);
    for (const auto& unit : units_)
        result.segment(unit.first, unit.rows()) = unit.moved.transpose() * v.segment(unit.first, unit.rows());
    return result;
}

Linearization::Vector Linearization::rows_times(const Vector& v) const {
    Vector result = Vector::Zero(m_);
    if (n_ > 0) problem().D.multiply_add(1.0, v.data(), result.data());
    return result;
}

Linearization::Vector Linearization::columns_times(const Vector& v) const {
    Vector result = Vector::Zero(n_);
    if (n_ > 0) problem().D.transpose_multiply_add(1.0, v.data(), result.data());
    return result;
}

Linearization::Vector Linearization::compliance_times(const Vector& v, bool transposed) const {
    Vector result = Vector::Zero(m_);
    const SparseMatrix& E = problem().E;
    if (E.entries() == 0) return result;
    transposed ? E.transpose_multiply_add(1.0, v.data(), result.data()) : E.multiply_add(1.0, v.data(), result.data());
    return result;
}

void Linearization::find_local_mobilities() {
    const SparseMatrix &H = problem().H, &D = problem().D, &E = problem().E;
    std::vector<double> inverse(static_cast<std::size_t>(n_), 0.0);
    const auto at_diagonal = [](const SparseMatrix& matrix, std::int32_t row) {
        for (auto k = matrix.row_start[row]; k < matrix.row_start[row + 1]; ++k)
            if (matrix.column[k] == row) return matrix.value[k];
        return 0.0;
    };
    for (std::int32_t i = 0; i < n_; ++i) inverse[i] = 1.0 / std::max(at_diagonal(H, i), 1e-300);
    local_.assign(static_cast<std::size_t>(m_), 0.0);
    for (std::int32_t row = 0; row < m_; ++row) {
        for (auto k = D.row_start[row]; k < D.row_start[row + 1]; ++k)
            local_[row] += D.value[k] * D.value[k] * inverse[D.column[k]];
        if (E.entries() > 0) local_[row] += at_diagonal(E, row);
    }
}

bool Linearization::add(const Cone& cone, std::int32_t row, std::int32_t number, const double* lambda, const double* u,
                        bool coulomb, double tolerance) {
    double mobility = 0.0, of_lambda = 0.0, of_u = 0.0;
    for (std::int32_t i = 0; i < cone.rows; ++i) {
        mobility += local_[row + i];
        of_lambda += lambda[i] * lambda[i];
        of_u += u[i] * u[i];
    }
    const double rho = mobility > 0.0 ? cone.rows / mobility : 1.0;
    const double size = std::max({std::sqrt(of_lambda), rho * std::sqrt(of_u), 1e-300});
    if (cone.kind == ConeKind::Friction)
        return add_friction(cone, row, number, lambda, u, coulomb, rho, tolerance * size);
    bool degenerate = false;
    for (std::int32_t i = 0; i < cone.rows; ++i) {
        if (cone.kind != ConeKind::Free) {
            constexpr double infinity = std::numeric_limits<double>::infinity();
            const double lo = cone.kind == ConeKind::Box ? cone.lo[i] : 0.0;
            const double hi = cone.kind == ConeKind::Box ? cone.hi[i] : infinity;
            const double z = lambda[i] - rho * u[i];
            degenerate |= std::min(std::abs(z - lo), std::abs(z - hi)) <= tolerance * size;
            if (!(z > lo && z < hi)) continue;
        }
        units_.push_back({row + i, number, ActiveUnit::Matrix::Identity(1, 1), rho * ActiveUnit::Matrix::Identity(1, 1),
                          ActiveUnit::Vector::Zero(1)});
    }
    return degenerate;
}

bool Linearization::add_friction(const Cone& cone, std::int32_t row, std::int32_t number, const double* lambda,
                                 const double* u, bool coulomb, double rho, double near) {
    const std::int32_t rows = cone.rows;
    const double mu = cone.parameters[0];
    const Eigen::Map<const Eigen::VectorXd> force(lambda, rows), velocity(u, rows);
    ActiveUnit::Matrix C = ActiveUnit::Matrix::Identity(rows, rows);
    ActiveUnit::Vector speed_by_mu = ActiveUnit::Vector::Zero(rows), moved_velocity = velocity;
    if (coulomb) {
        const double speed = velocity.tail(rows - 1).norm();
        moved_velocity[0] += mu * speed;
        speed_by_mu[0] = speed;
        if (rho * speed > near) C.row(0).tail(rows - 1) += mu / speed * velocity.tail(rows - 1).transpose();
    }
    Eigen::Vector3d z = Eigen::Vector3d::Zero();
    z.head(rows) = force - rho * moved_velocity;
    const double normal = z[0], tangential = std::hypot(z[1], z[2]);
    const double sticks = tangential - mu * normal, opens = normal + mu * tangential;
    const bool degenerate = std::min(std::abs(sticks), std::abs(opens)) <= near;
    ActiveUnit unit{row, number, ActiveUnit::Matrix::Identity(rows, rows), {}, ActiveUnit::Vector::Zero(rows)};
    if (sticks > 0.0) {
        if (opens <= 0.0) return degenerate;
        const ActiveUnit::Vector t = z.segment(1, rows - 1) / tangential;
        ActiveUnit::Vector along(rows);
        along[0] = 1.0;
        along.tail(rows - 1) = mu * t;
        const double alpha = opens / (1.0 + mu * mu);
        unit.J = along * along.transpose() / (1.0 + mu * mu);
        unit.J.bottomRightCorner(rows - 1, rows - 1) +=
            mu * alpha / tangential *
            (ActiveUnit::Matrix::Identity(rows - 1, rows - 1) - ActiveUnit::Matrix(t * t.transpose()));
        const double alpha_by_mu = (tangential - 2.0 * mu * alpha) / (1.0 + mu * mu);
        unit.by_mu[0] = alpha_by_mu;
        unit.by_mu.tail(rows - 1) = (alpha + mu * alpha_by_mu) * t;
    }
    unit.moved = rho * unit.J * C;
    unit.by_mu -= rho * unit.J * speed_by_mu;
    units_.push_back(std::move(unit));
    return degenerate;
}

void Linearization::invert_blocks() {
    if (!inverse_.empty() || n_ == 0) return;
    const delassus_problem& raw = problem_->raw();
    const SparseMatrix& H = problem().H;
    place_.resize(static_cast<std::size_t>(n_));
    for (std::int32_t b = 0; b < raw.h_block_count; ++b) {
        const std::int32_t begin = raw.h_block_start[b], size = raw.h_block_start[b + 1] - begin;
        for (std::int32_t i = 0; i < size; ++i) place_[raw.h_block_index[begin + i]] = {b, i};
        Eigen::MatrixXd block = Eigen::MatrixXd::Zero(size, size);
        for (std::int32_t i = 0; i < size; ++i) {
            const std::int32_t row = raw.h_block_index[begin + i];
            for (auto k = H.row_start[row]; k < H.row_start[row + 1]; ++k) {
                block(i, place_[H.column[k]].row) = H.value[k];
            }
        }
        inverse_.push_back(size == 1 ? block.cwiseInverse() : Eigen::MatrixXd(block.inverse()));
    }
}

void Linearization::number_active_rows() {
    if (!number_of_.empty()) return;
    number_of_.assign(static_cast<std::size_t>(m_), -1);
    for (const auto& unit : units_)
        for (std::int32_t i = 0; i < unit.rows(); ++i) {
            number_of_[unit.first + i] = static_cast<std::int32_t>(row_of_.size());
            row_of_.push_back(unit.first + i);
        }
}

Linearization::Vector Linearization::of_H(const Vector& v) const {
    Vector result(n_);
    const delassus_problem& raw = problem_->raw();
    for (std::int32_t b = 0; n_ > 0 && b < raw.h_block_count; ++b) {
        const std::int32_t* index = raw.h_block_index + raw.h_block_start[b];
        const auto& inverse = inverse_[b];
        for (Eigen::Index i = 0; i < inverse.rows(); ++i) {
            double sum = 0.0;
            for (Eigen::Index j = 0; j < inverse.cols(); ++j) sum += inverse(i, j) * v[index[j]];
            result[index[i]] = sum;
        }
    }
    return result;
}

Eigen::SparseMatrix<double> Linearization::reduced(double compliance) const {
    const SparseMatrix &D = problem().D, &E = problem().E;
    const delassus_problem& raw = problem_->raw();
    // Active rows of D by their columns.
    std::vector<std::vector<std::pair<std::int32_t, double>>> by_column(static_cast<std::size_t>(n_));
    for (const std::int32_t row : row_of_)
        for (auto k = D.row_start[row]; k < D.row_start[row + 1]; ++k)
            by_column[D.column[k]].emplace_back(number_of_[row], D.value[k]);
    const std::size_t size = row_of_.size();
    std::array<std::vector<double>, 3> sums;
    for (auto& sum : sums) sum.assign(size, 0.0);
    std::vector<std::int32_t> touched, stamp(size, -1);
    std::vector<double> inverse_times(16);
    std::vector<Eigen::Triplet<double>> entries;
    for (std::size_t u = 0; u < units_.size(); ++u) {
        const auto& unit = units_[u];
        touched.clear();
        const auto add = [&](std::vector<double>& sum, std::int32_t number, double value) {
            if (stamp[number] != static_cast<std::int32_t>(u)) {
                stamp[number] = static_cast<std::int32_t>(u);
                touched.push_back(number);
            }
            sum[number] += value;
        };
        for (std::int32_t i = 0; i < unit.rows(); ++i) {
            const std::int32_t row = unit.first + i;
            for (auto k = D.row_start[row]; n_ > 0 && k < D.row_start[row + 1]; ++k) {
                const auto [block, at] = place_[D.column[k]];
                const auto& inverse = inverse_[block];
                const std::int32_t* index = raw.h_block_index + raw.h_block_start[block];
                for (Eigen::Index j = 0; j < inverse.rows(); ++j) {
                    const double factor = D.value[k] * inverse(j, at);
                    if (factor == 0.0) continue;
                    for (const auto& [number, value] : by_column[index[j]]) add(sums[i], number, factor * value);
                }
            }
            for (auto k = E.row_start[row]; E.entries() > 0 && k < E.row_start[row + 1]; ++k)
                if (number_of_[E.column[k]] >= 0) add(sums[i], number_of_[E.column[k]], E.value[k]);
            add(sums[i], number_of_[row], compliance);
        }
        const std::int32_t own = number_of_[unit.first];
        for (const std::int32_t number : touched)
            for (std::int32_t i = 0; i < unit.rows(); ++i) {
                double value = 0.0;
                for (std::int32_t j = 0; j < unit.rows(); ++j) value += unit.moved(i, j) * sums[j][number];
                const std::int32_t column = number - own;
                if (column >= 0 && column < unit.rows()) value += (i == column ? 1.0 : 0.0) - unit.J(i, column);
                entries.emplace_back(own + i, number, value);
            }
        for (const std::int32_t number : touched)
            for (auto& sum : sums) sum[number] = 0.0;
    }
    Eigen::SparseMatrix<double> matrix(static_cast<Eigen::Index>(size), static_cast<Eigen::Index>(size));
    matrix.setFromTriplets(entries.begin(), entries.end());
    return matrix;
}

Linearization::Vector Linearization::gather(const Vector& v) const {
    Vector result(active());
    for (Eigen::Index k = 0; k < active(); ++k) result[k] = v[row_of_[static_cast<std::size_t>(k)]];
    return result;
}

Linearization::Vector Linearization::scatter(const Vector& v) const {
    Vector result = Vector::Zero(m_);
    for (Eigen::Index k = 0; k < active(); ++k) result[row_of_[static_cast<std::size_t>(k)]] = v[k];
    return result;
}

Linearization::Vector Linearization::backsubstitute_transposed(const Vector& v) const {
    if (!factor_) return v;
    const Vector result =
        factor_->dense ? Vector(factor_->dense->transpose().solve(v)) : Vector(factor_->sparse->transpose().solve(v));
    return result.cwiseQuotient(size_);
}

Linearization::Vector Linearization::backsubstitute(const Vector& v) const {
    if (!factor_) return v;
    const Vector scaled = v.cwiseQuotient(size_);
    return factor_->dense ? Vector(factor_->dense->solve(scaled)) : Vector(factor_->sparse->solve(scaled));
}

}  // namespace delassus::python
