// SPDX-License-Identifier: BSD-3-Clause
#include "kkt_system.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "delassus/sdk/dense_algebra.hpp"

namespace delassus::ipm {

namespace {

constexpr double largest_regularization = 1e-4;

}  // namespace

void KktSystem::load(const ScaledSystem& system, bool definite) {
    system_ = &system;
    definite_ = definite;
    delta_ = settings_.regularization;
    rho_ = definite ? 0.0 : delta_;
    std::fill(d_value_.begin(), d_value_.end(), 0.0);
    for (std::size_t k = 0; k < d_slot_.size(); ++k) d_value_[d_slot_[k]] = system.D.valuePtr()[k];
    std::fill(e_value_.begin(), e_value_.end(), 0.0);
    for (std::size_t k = 0; k < e_slot_.size(); ++k)  // E is symmetric: its rows are its columns
        if (e_slot_[k] >= 0) e_value_[static_cast<std::size_t>(e_slot_[k])] = system.E.valuePtr()[k];
}

void KktSystem::rotate(const Complementarity& cones) {
    unsymmetric_ = cones.path() != Path::Associated;
    rotate_D(cones, true, d_rotated_);
    rotate_E(cones, true, e_rotated_);
    if (!unsymmetric_) return;
    beside_.resize(groups_.size());
    for (std::size_t g = 0; g < groups_.size(); ++g) beside_[g] = cones.beside(g);
    rotate_D(cones, false, d_reactions_);
    rotate_E(cones, false, e_mirrored_);
}

// Uᵀ D̂ by blocks, or Zᵀ D̂.
void KktSystem::rotate_D(const Complementarity& cones, bool by_rows, std::vector<double>& result) const {
    result = d_value_;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
        const Basis* basis = by_rows ? cones.row_basis(g) : cones.reaction_basis(g);
        if (!basis) continue;
        const int rows = groups_[g].rows;
        double* column = result.data() + d_blocks_[g].value;
        for (std::int32_t k = 0; k < d_blocks_[g].columns; ++k, column += rows) {
            Triple v{};
            for (int i = 0; i < rows; ++i)
                for (int l = 0; l < rows; ++l) v[i] += (*basis)[i][l] * column[l];
            std::copy_n(v.begin(), rows, column);
        }
    }
}

// Uᵀ Ê Z by blocks, or Zᵀ Ê U.
void KktSystem::rotate_E(const Complementarity& cones, bool by_rows, std::vector<double>& result) const {
    result = e_value_;
    for (const EBlock& block : e_blocks_) {
        const auto row = static_cast<std::size_t>(block.row), column = static_cast<std::size_t>(block.column);
        const int rows = groups_[row].rows, columns = groups_[column].rows;
        double* values = result.data() + block.value;
        if (const Basis* basis = by_rows ? cones.row_basis(row) : cones.reaction_basis(row)) {
            for (int j = 0; j < columns; ++j) {
                Triple v{};
                for (int i = 0; i < rows; ++i)
                    for (int l = 0; l < rows; ++l) v[i] += (*basis)[i][l] * values[j * rows + l];
                std::copy_n(v.begin(), rows, values + j * rows);
            }
        }
        if (const Basis* basis = by_rows ? cones.reaction_basis(column) : cones.row_basis(column)) {
            for (int i = 0; i < rows; ++i) {
                Triple v{};
                for (int j = 0; j < columns; ++j)
                    for (int l = 0; l < columns; ++l) v[j] += (*basis)[j][l] * values[l * rows + i];
                for (int j = 0; j < columns; ++j) values[j * rows + i] = v[j];
            }
        }
    }
}

void KktSystem::factorize(const Complementarity& cones, const sdk::Vector& theta) {
    rotate(cones);
    theta_ = theta;
    weight_ = (1.0 + theta.array()).sqrt().inverse();
    while (true) {
        ++factorizations_;
        assemble(theta);
        if (unsymmetric_ ? factor_.factorize(matrix_, upper_) : factor_.factorize(matrix_)) return;
        delta_ *= 10.0;
        if (!definite_) rho_ = delta_;
        if (!(delta_ <= largest_regularization))
            throw sdk::NumericalFailure(
                "the factorisation broke down for every regularisation up to 1e-4: E is not positive semidefinite, or "
                "H is not");
    }
}

void KktSystem::assemble(const sdk::Vector& theta) {
    double* values = matrix_.valuePtr();
    std::fill_n(values, matrix_.nonZeros(), 0.0);
    for (std::size_t k = 0; k < h_place_.size(); ++k)
        if (h_place_[k] >= 0) values[h_place_[k]] += system_->H.valuePtr()[k];
    for (Eigen::Index j = 0; j < n_; ++j) values[matrix_.outerIndexPtr()[j]] += rho_;
    if (unsymmetric_) upper_.assign(values, values + matrix_.nonZeros());
    if (form_ == Form::Normal) {
        t_.assign(3 * groups_.size(), Triple{});
        for (std::size_t g = 0; g < groups_.size(); ++g) {
            find_T(g, theta);
            add_normal_block(g);
        }
        return;
    }
    const double sign = form_ == Form::Augmented ? -1.0 : 1.0;
    if (form_ == Form::Augmented) {
        for (std::size_t k = 0; k < d_place_.size(); ++k) values[d_place_[k]] += d_rotated_[k];
        if (unsymmetric_)
            for (std::size_t k = 0; k < d_place_.size(); ++k)
                upper_[static_cast<std::size_t>(d_place_[k])] += d_reactions_[k];
    }
    for (const EBlock& block : e_blocks_) {
        const auto row = static_cast<std::size_t>(block.row), column = static_cast<std::size_t>(block.column);
        const int rows = groups_[row].rows, columns = groups_[column].rows;
        for (int j = 0; j < columns; ++j)
            for (int i = 0; i < rows; ++i) {
                if (row == column && i < j) continue;
                const auto k = static_cast<std::size_t>(j * rows + i);
                const auto place = static_cast<std::size_t>(e_place_[block.place + k]);
                const std::int32_t first = groups_[row].first;
                const double diagonal = row == column && i == j ? theta[first + i] + delta_ : 0.0;
                values[place] += sign * (e_rotated_[block.value + k] + diagonal);
                if (!unsymmetric_) continue;
                upper_[place] += sign * (e_mirrored_[block.value + k] + diagonal);
                if (row != column || j != 0 || i == 0) continue;
                if (i == 1) values[place] += sign * beside_[row].below;
                upper_[place] += sign * (i == 1 ? beside_[row].right : beside_[row].far);
            }
    }
}

// T = (Ê' + θ + δ1)⁻¹ of one group.
void KktSystem::find_T(std::size_t group, const sdk::Vector& theta) {
    const int rows = groups_[group].rows;
    const std::int32_t first = groups_[group].first;
    const Eigen::Map<const Eigen::MatrixXd> E(e_rotated_.data() + e_blocks_[group].value, rows, rows);
    const auto beside = unsymmetric_ ? beside_[group] : Complementarity::Beside{};
    Triple* T = &t_[3 * group];
    Triple diagonal{1.0, 1.0, 1.0};
    for (int i = 0; i < rows; ++i) diagonal[i] = theta[first + i] + delta_;
    if (E.isZero(0.0)) {
        // [a, r, e; b, q, 0; 0, 0, t]⁻¹, where a q − b r loses at most a digit
        const double determinant = diagonal[0] * diagonal[1] - beside.below * beside.right;
        if (beside.below == 0.0 || beside.right == 0.0) {
            for (int i = 0; i < rows; ++i) T[i][i] = 1.0 / diagonal[i];
            if (rows > 1) T[1][0] = -beside.below * T[0][0] * T[1][1];
        } else {
            T[0] = {diagonal[1] / determinant, -beside.right / determinant, 0.0};
            T[1] = {-beside.below / determinant, diagonal[0] / determinant, 0.0};
            T[2][2] = 1.0 / diagonal[2];
        }
        if (rows == 3 && beside.far != 0.0)
            for (int i = 0; i < 2; ++i) T[i][2] = -T[i][0] * beside.far * T[2][2];
        return;
    }
    Eigen::Matrix3d block = Eigen::Matrix3d::Identity();
    block.topLeftCorner(rows, rows) = E;
    for (int i = 0; i < rows; ++i) block(i, i) += theta[first + i] + delta_;
    if (rows > 1) {
        block(1, 0) += beside.below;
        block(0, 1) += beside.right;
        if (rows > 2) block(0, 2) += beside.far;
    }
    const Eigen::Matrix3d inverse =
        unsymmetric_ ? Eigen::Matrix3d(block.partialPivLu().inverse()) : sdk::inverse_of_definite(block);
    for (int i = 0; i < rows; ++i)
        for (int j = 0; j < rows; ++j) T[i][j] = inverse(i, j);
}

// The lower triangle += D̂″_gᵀ T_g D̂'_g, and beside it the upper one.
void KktSystem::add_normal_block(std::size_t group) {
    const DBlock& block = d_blocks_[group];
    const int rows = groups_[group].rows;
    const double *D = d_rotated_.data() + block.value, *D2 = reactions_D(group);
    const std::int32_t* place = d_place_.data() + block.place;
    double* values = matrix_.valuePtr();
    for (std::int32_t k = 0; k < block.columns; ++k) {
        Triple weighted{}, mirrored{};  // T D̂'_k, Tᵀ D̂″_k
        for (int i = 0; i < rows; ++i)
            for (int j = 0; j < rows; ++j) {
                weighted[i] += t_[3 * group + i][j] * D[k * rows + j];
                if (unsymmetric_) mirrored[i] += t_[3 * group + j][i] * D2[k * rows + j];
            }
        for (std::int32_t l = k; l < block.columns; ++l, ++place) {
            double sum = 0.0, across = 0.0;
            for (int i = 0; i < rows; ++i) sum += D2[l * rows + i] * weighted[i];
            values[*place] += sum;
            if (!unsymmetric_) continue;
            for (int i = 0; i < rows; ++i) across += D[l * rows + i] * mirrored[i];
            upper_[static_cast<std::size_t>(*place)] += across;
        }
    }
}

void KktSystem::solve_factored(const sdk::Vector& f, const sdk::Vector& g, sdk::Vector& dx, sdk::Vector& dz) {
    if (form_ == Form::Reduced) {
        dx.resize(0);
        dz = g;
        factor_.solve(dz);
        return;
    }
    if (form_ == Form::Augmented) {  // [Ĥ, D̂″ᵀ; D̂', −(Ê' + θ)] {δx; −δz} = {f; g}
        stacked_.resize(n_ + m_);
        stacked_ << f, g;
        factor_.solve(stacked_);
        dx = stacked_.head(n_);
        dz = -stacked_.tail(m_);
        return;
    }
    // (Ĥ + D̂″ᵀ T D̂') δx = f + D̂″ᵀ T g,  δz = T (g − D̂' δx)
    dx = f;
    const auto times_T = [this](std::size_t group, const Triple& v) {
        Triple result{};
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j < 3; ++j) result[i] += t_[3 * group + i][j] * v[j];
        return result;
    };
    for (std::size_t k = 0; k < groups_.size(); ++k) {
        const int rows = groups_[k].rows;
        Triple v{};
        for (int i = 0; i < rows; ++i) v[i] = g[groups_[k].first + i];
        v = times_T(k, v);
        const double* D = reactions_D(k);
        for (std::int32_t c = 0; c < d_blocks_[k].columns; ++c, D += rows) {
            double sum = 0.0;
            for (int i = 0; i < rows; ++i) sum += D[i] * v[i];
            dx[column_[d_blocks_[k].index + static_cast<std::size_t>(c)]] += sum;
        }
    }
    factor_.solve(dx);
    dz.resize(m_);
    for (std::size_t k = 0; k < groups_.size(); ++k) {
        const int rows = groups_[k].rows;
        Triple v{};
        for (int i = 0; i < rows; ++i) v[i] = g[groups_[k].first + i];
        const double* D = d_rotated_.data() + d_blocks_[k].value;
        for (std::int32_t c = 0; c < d_blocks_[k].columns; ++c, D += rows) {
            const double value = dx[column_[d_blocks_[k].index + static_cast<std::size_t>(c)]];
            for (int i = 0; i < rows; ++i) v[i] -= D[i] * value;
        }
        v = times_T(k, v);
        for (int i = 0; i < rows; ++i) dz[groups_[k].first + i] = v[i];
    }
}

void KktSystem::subtract_beside(const sdk::Vector& dz, sdk::Vector& rest) const {
    for (std::size_t g = 0; g < groups_.size(); ++g) {
        const std::int32_t first = groups_[g].first;
        if (groups_[g].rows < 2) continue;
        rest[first] -= beside_[g].right * dz[first + 1];
        rest[first + 1] -= beside_[g].below * dz[first];
        if (groups_[g].rows > 2) rest[first] -= beside_[g].far * dz[first + 2];
    }
}

void KktSystem::solve_once(const Complementarity& cones, const sdk::Vector& f, const sdk::Vector& g, double,
                           sdk::Vector& dx, sdk::Vector& dz) {
    solve_factored(f, g, dx, dz);
    for (Eigen::Index i = 0; i < m_; ++i)
        if (cones.is_held(i)) dz[i] = 0.0;
}

void KktSystem::find_rest(const Complementarity& cones, const sdk::Vector& f, const sdk::Vector& g,
                          const sdk::Vector& dx, const sdk::Vector& dz, sdk::Vector& f_rest, sdk::Vector& g_rest) {
    unrotated_ = dz;
    cones.reactions_from_basis(unrotated_);
    f_rest = f;
    product_.setZero(m_);
    if (n_ > 0) {
        f_rest.noalias() -= system_->H * dx;
        f_rest.noalias() += system_->D.transpose() * unrotated_;
        product_.noalias() += system_->D * dx;
    }
    if (system_->E.nonZeros() > 0) product_.noalias() += system_->E * unrotated_;
    cones.rows_to_basis(product_);
    g_rest = g - product_ - theta_.cwiseProduct(dz);
    if (unsymmetric_) subtract_beside(dz, g_rest);
    for (Eigen::Index i = 0; i < m_; ++i)
        if (cones.is_held(i)) g_rest[i] = 0.0;
}

std::string KktSystem::description() const {
    const char* name = form_ == Form::Normal ? "normal" : form_ == Form::Augmented ? "augmented" : "reduced";
    char text[120];
    std::snprintf(text, sizeof text, "%s form, %.0f entries in the factor, regularisation %.0e", name,
                  factor_.entries(), delta_);
    return factor_.uses_blas() ? text + (", fronts by " + factor_.kernels()) : text;
}

}  // namespace delassus::ipm
