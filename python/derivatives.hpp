// SPDX-License-Identifier: BSD-3-Clause
// The linear system of a solution's derivative (delassus/_derivative.py has the equations): blocks of the projection's
// derivative, and the factor of the rows that are active.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <Eigen/SparseCore>
#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "problems.hpp"

namespace delassus::python {

/// Rows of λ that the derivative of the projection couples: a block of friction, or one row of another kind.
struct ActiveUnit {
    using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3>;
    using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1>;
    std::int32_t first = 0;  ///< row
    std::int32_t cone = 0;
    Matrix J;      ///< derivative of the projection
    Matrix moved;  ///< ρ J C
    Vector by_mu;  ///< ∂Π/∂μ − ρ J ∂û/∂μ
    [[nodiscard]] std::int32_t rows() const { return static_cast<std::int32_t>(J.rows()); }
};

/// The derivative of a solution's equations. It reads H, D, E and the cones of the problem, which never change and must
/// outlive it.
class Linearization {
public:
    using Vector = Eigen::VectorXd;

    /// lambda, u: m. tolerance: how near to an edge of the projection a block counts as degenerate, relative.
    Linearization(const PreparedProblem& problem, const std::vector<double>& lambda, const std::vector<double>& u,
                  bool coulomb, double tolerance)
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

    [[nodiscard]] const std::vector<std::int32_t>& degenerate() const { return degenerate_; }
    [[nodiscard]] const std::vector<double>& local() const { return local_; }
    /// Whether factorize() can: H is reduced, diagonal or of small blocks.
    [[nodiscard]] bool has_small_blocks() const {
        const Structure structure = problem_->structure();
        return structure == Structure::Reduced || structure == Structure::Diagonal || structure == Structure::Blocks;
    }

    /// Factors the system with more compliance on its diagonal; false where it is singular to working precision.
    bool factorize(double compliance) {
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
            for (decltype(matrix)::InnerIterator entry(matrix, k); entry; ++entry)
                entry.valueRef() /= size_[entry.row()];
        dense_.reset();
        sparse_.reset();
        if (active() == 0) return true;
        if (active() <= 48) {
            dense_.emplace(Eigen::MatrixXd(matrix));
            const auto pivots = dense_->matrixLU().diagonal().cwiseAbs();
            return pivots.minCoeff() > 1e-11 * pivots.maxCoeff();
        }
        sparse_ = std::make_unique<Lu>();
        sparse_->compute(matrix);
        if (sparse_->info() != Eigen::Success) return false;
        // A vector without special directions shows a kernel by its size.
        Vector probe(active());
        for (Eigen::Index k = 0; k < active(); ++k) probe[k] = std::sin(1.0 + static_cast<double>(k));
        const Vector answer = sparse_->solve(probe);
        return answer.allFinite() && answer.cwiseAbs().maxCoeff() < 1e11;
    }

    /// (dx, dλ) with H dx − Dᵀ dλ = first and ρ J C D dx + (I − J + ρ J C E) dλ = second.
    std::pair<Vector, Vector> solve(const Vector& first, const Vector& second) const {
        const Vector right = second - moved(rows_times(of_H(first)));
        const Vector lambda = scatter(backsubstitute(gather(right)));
        return {of_H(first + columns_times(lambda)), lambda};
    }
    /// (p, q) with the transposed matrix; q of rows that are not active is left 0, since nothing asks for it.
    std::pair<Vector, Vector> solve_transposed(const Vector& to_x, const Vector& to_lambda) const {
        const Vector q = scatter(backsubstitute_transposed(gather(to_lambda + rows_times(of_H(to_x)))));
        return {of_H(to_x - columns_times(moved_back(q))), q};
    }
    /// ρ J C v; m.
    [[nodiscard]] Vector moved(const Vector& v) const {
        Vector result = Vector::Zero(m_);
        for (const auto& unit : units_)
            result.segment(unit.first, unit.rows()) = unit.moved * v.segment(unit.first, unit.rows());
        return result;
    }
    /// (ρ J C)ᵀ v; m.
    [[nodiscard]] Vector moved_back(const Vector& v) const {
        Vector result = Vector::Zero(m_);
        for (const auto& unit : units_)
            result.segment(unit.first, unit.rows()) = unit.moved.transpose() * v.segment(unit.first, unit.rows());
        return result;
    }
    [[nodiscard]] const std::vector<ActiveUnit>& units() const { return units_; }
    [[nodiscard]] std::int32_t n() const { return n_; }
    [[nodiscard]] std::int32_t m() const { return m_; }
    [[nodiscard]] const Problem& problem() const { return problem_->problem(); }

    /// D v; m. v: n.
    [[nodiscard]] Vector rows_times(const Vector& v) const {
        Vector result = Vector::Zero(m_);
        if (n_ > 0) problem().D.multiply_add(1.0, v.data(), result.data());
        return result;
    }
    /// Dᵀ v; n. v: m.
    [[nodiscard]] Vector columns_times(const Vector& v) const {
        Vector result = Vector::Zero(n_);
        if (n_ > 0) problem().D.transpose_multiply_add(1.0, v.data(), result.data());
        return result;
    }
    /// E v; m. E is symmetric up to rounding; transposed: Eᵀ v.
    [[nodiscard]] Vector compliance_times(const Vector& v, bool transposed) const {
        Vector result = Vector::Zero(m_);
        const SparseMatrix& E = problem().E;
        if (E.entries() == 0) return result;
        transposed ? E.transpose_multiply_add(1.0, v.data(), result.data())
                   : E.multiply_add(1.0, v.data(), result.data());
        return result;
    }

private:
    using Lu = Eigen::SparseLU<Eigen::SparseMatrix<double>>;

    [[nodiscard]] Eigen::Index active() const { return static_cast<Eigen::Index>(row_of_.size()); }

    /// The diagonal of D diag(H)⁻¹ Dᵀ + E.
    void find_local_mobilities() {
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

    /// Adds the units of a block of rows that are active; whether the solution is not differentiable there.
    bool add(const Cone& cone, std::int32_t row, std::int32_t number, const double* lambda, const double* u,
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
            units_.push_back({row + i, number, ActiveUnit::Matrix::Identity(1, 1),
                              rho * ActiveUnit::Matrix::Identity(1, 1), ActiveUnit::Vector::Zero(1)});
        }
        return degenerate;
    }

    bool add_friction(const Cone& cone, std::int32_t row, std::int32_t number, const double* lambda, const double* u,
                      bool coulomb, double rho, double near) {
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
        const ActiveUnit::Vector z = force - rho * moved_velocity;
        const double normal = z[0], tangential = z.tail(rows - 1).norm();
        const double sticks = tangential - mu * normal, opens = normal + mu * tangential;
        const bool degenerate = std::min(std::abs(sticks), std::abs(opens)) <= near;
        ActiveUnit unit{row, number, ActiveUnit::Matrix::Identity(rows, rows), {}, ActiveUnit::Vector::Zero(rows)};
        if (sticks > 0.0) {
            if (opens <= 0.0) return degenerate;
            const ActiveUnit::Vector t = z.tail(rows - 1) / tangential;
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

    void invert_blocks() {
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
                    const auto* found =
                        std::find(raw.h_block_index + begin, raw.h_block_index + begin + size, H.column[k]);
                    block(i, found - (raw.h_block_index + begin)) = H.value[k];
                }
            }
            inverse_.push_back(size == 1 ? block.cwiseInverse() : Eigen::MatrixXd(block.inverse()));
        }
    }

    void number_active_rows() {
        if (!number_of_.empty()) return;
        number_of_.assign(static_cast<std::size_t>(m_), -1);
        for (const auto& unit : units_)
            for (std::int32_t i = 0; i < unit.rows(); ++i) {
                number_of_[unit.first + i] = static_cast<std::int32_t>(row_of_.size());
                row_of_.push_back(unit.first + i);
            }
    }

    /// H⁻¹ v; n.
    [[nodiscard]] Vector of_H(const Vector& v) const {
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

    /// I − J + ρ J C (D H⁻¹ Dᵀ + E + compliance I) of the active rows.
    [[nodiscard]] Eigen::SparseMatrix<double> reduced(double compliance) const {
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

    [[nodiscard]] Vector gather(const Vector& v) const {
        Vector result(active());
        for (Eigen::Index k = 0; k < active(); ++k) result[k] = v[row_of_[static_cast<std::size_t>(k)]];
        return result;
    }
    [[nodiscard]] Vector scatter(const Vector& v) const {
        Vector result = Vector::Zero(m_);
        for (Eigen::Index k = 0; k < active(); ++k) result[row_of_[static_cast<std::size_t>(k)]] = v[k];
        return result;
    }
    [[nodiscard]] Vector backsubstitute(const Vector& v) const {
        const Vector scaled = v.cwiseQuotient(size_);
        if (active() == 0) return v;
        return dense_ ? Vector(dense_->solve(scaled)) : Vector(sparse_->solve(scaled));
    }
    [[nodiscard]] Vector backsubstitute_transposed(const Vector& v) const {
        if (active() == 0) return v;
        const Vector result = dense_ ? Vector(dense_->transpose().solve(v)) : Vector(sparse_->transpose().solve(v));
        return result.cwiseQuotient(size_);
    }

    struct Place {
        std::int32_t block, row;
    };
    const PreparedProblem* problem_;
    std::int32_t n_, m_;
    std::vector<double> local_;
    std::vector<std::int32_t> degenerate_;
    std::vector<ActiveUnit> units_;
    std::vector<Eigen::MatrixXd> inverse_;  // of each block of H
    std::vector<Place> place_;              // of each velocity in the blocks of H
    std::vector<std::int32_t> number_of_;   // of each row among the active ones; −1: not active
    std::vector<std::int32_t> row_of_;      // its inverse
    Vector size_;                           // of each row of the reduced system
    std::optional<Eigen::PartialPivLU<Eigen::MatrixXd>> dense_;
    std::unique_ptr<Lu> sparse_;
};

inline Eigen::VectorXd eigen_of(const Reals& values, std::int32_t size, std::string_view name) {
    const std::vector<double> checked = vector_of(values, name);
    if (checked.size() != static_cast<std::size_t>(size))
        throw InputError(fmt::format("{} has the shape ({},); it must be ({},)", name, checked.size(), size));
    return Eigen::Map<const Eigen::VectorXd>(checked.data(), size);
}

inline py::array_t<double> array_of(const Eigen::VectorXd& values) {
    return array_of(std::vector<double>(values.data(), values.data() + values.size()));
}

/// Σ left rightᵀ at the entries of the pattern.
inline std::vector<double> outer(const SparseMatrix& pattern, const Eigen::VectorXd& left,
                                 const Eigen::VectorXd& right) {
    std::vector<double> result(static_cast<std::size_t>(pattern.entries()));
    for (std::int32_t row = 0; row < pattern.rows; ++row)
        for (auto k = pattern.row_start[row]; k < pattern.row_start[row + 1]; ++k)
            result[static_cast<std::size_t>(k)] = left[row] * right[pattern.column[k]];
    return result;
}

inline void bind_derivatives(py::module_& module) {
    using namespace py::literals;
    using Vector = Eigen::VectorXd;

    const auto matrix_parts = [](const Linearization& self, bool moved) {
        std::vector<double> values;
        std::vector<std::int32_t> rows, columns;
        for (const auto& unit : self.units())
            for (std::int32_t i = 0; i < unit.rows(); ++i)
                for (std::int32_t j = 0; j < unit.rows(); ++j) {
                    values.push_back(moved ? unit.moved(i, j) : unit.J(i, j));
                    rows.push_back(unit.first + i);
                    columns.push_back(unit.first + j);
                }
        return py::make_tuple(array_of(std::move(values)),
                              py::make_tuple(array_of(std::move(rows)), array_of(std::move(columns))));
    };
    py::class_<Linearization>(module, "_Linearization")
        .def(py::init(
                 [](const SharedProblem& problem, const Reals& lambda, const Reals& u, bool coulomb, double tolerance) {
                     return std::make_unique<Linearization>(*problem.prepared, vector_of(lambda, "lam"),
                                                            vector_of(u, "u"), coulomb, tolerance);
                 }),
             py::keep_alive<1, 2>())
        .def_property_readonly("degenerate", &Linearization::degenerate)
        .def_property_readonly("local", [](const Linearization& self) { return array_of(std::vector(self.local())); })
        .def_property_readonly("has_small_blocks", &Linearization::has_small_blocks)
        .def("J", [matrix_parts](const Linearization& self) { return matrix_parts(self, false); })
        .def("JC", [matrix_parts](const Linearization& self) { return matrix_parts(self, true); })
        .def("factorize",
             [](Linearization& self, double compliance) {
                 const py::gil_scoped_release without_gil;
                 return self.factorize(compliance);
             })
        .def("solve",
             [](const Linearization& self, const Reals& first, const Reals& second) {
                 const auto [x, lambda] = self.solve(eigen_of(first, self.n(), "a"), eigen_of(second, self.m(), "b"));
                 return py::make_tuple(array_of(x), array_of(lambda));
             })
        .def("solve_transposed",
             [](const Linearization& self, const Reals& to_x, const Reals& to_lambda) {
                 const auto [p, q] =
                     self.solve_transposed(eigen_of(to_x, self.n(), "x"), eigen_of(to_lambda, self.m(), "lam"));
                 return py::make_tuple(array_of(p), array_of(q));
             })
        .def("moved",
             [](const Linearization& self, const Reals& v) { return array_of(self.moved(eigen_of(v, self.m(), "u"))); })
        .def("by_mu",
             [](const Linearization& self, const Reals& mu) {
                 const auto cones = static_cast<std::int32_t>(self.problem().cones.size());
                 const Vector change = eigen_of(mu, cones, "mu");
                 Vector result = Vector::Zero(self.m());
                 for (const auto& unit : self.units())
                     result.segment(unit.first, unit.rows()) = change[unit.cone] * unit.by_mu;
                 return array_of(result);
             })
        .def("gradient_parts",
             [](const Linearization& self, const Reals& given_p, const Reals& given_q, const Reals& given_u,
                const Reals& given_x, const Reals& given_lambda) {
                 const Vector p = eigen_of(given_p, self.n(), "x"), q = eigen_of(given_q, self.m(), "lam"),
                              x = eigen_of(given_x, self.n(), "x"), lambda = eigen_of(given_lambda, self.m(), "lam");
                 const Vector w = eigen_of(given_u, self.m(), "u") - self.moved_back(q);
                 std::vector<double> mu(self.problem().cones.size(), 0.0);
                 for (const auto& unit : self.units())
                     mu[static_cast<std::size_t>(unit.cone)] += unit.by_mu.dot(q.segment(unit.first, unit.rows()));
                 std::vector<double> by_D = outer(self.problem().D, lambda, p);
                 const std::vector<double> more = outer(self.problem().D, w, x);
                 for (std::size_t k = 0; k < by_D.size(); ++k) by_D[k] += more[k];
                 return py::make_tuple(array_of(w), array_of(std::move(mu)), array_of(outer(self.problem().H, -p, x)),
                                       array_of(std::move(by_D)), array_of(outer(self.problem().E, w, lambda)));
             })
        .def("gradient_start",
             [](const Linearization& self, const Reals& to_x, const Reals& to_lambda, const Reals& to_u) {
                 const Vector u = eigen_of(to_u, self.m(), "u");
                 const Vector x = eigen_of(to_x, self.n(), "x") + self.columns_times(u);
                 const Vector lambda = eigen_of(to_lambda, self.m(), "lam") + self.compliance_times(u, true);
                 return py::make_tuple(array_of(x), array_of(lambda));
             });
}

}  // namespace delassus::python
