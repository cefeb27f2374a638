// SPDX-License-Identifier: BSD-3-Clause
// The problem of one step, made of MuJoCo's mass matrix, smooth forces and constraints.
#pragma once

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "constraint_rows.hpp"
#include "delassus/error.hpp"
#include "delassus/problem.hpp"
#include "reverse_cholesky.hpp"
#include "versions.hpp"

/// Which constraints are rigid.
enum class Compliance {
    /// At velocities. x = v⁺, the velocities at the end of MuJoCo's step; λ = h f; H as the integrator has it, M + h B;
    /// a = H v_f with the velocities v_f of a step without constraints.
    ///
    ///   contact, limit   u = J v⁺ + b      b = Φ/h where there is a gap Φ; else the speed that pushes apart, below 0
    ///   friction loss    u = J v⁺          |λ| ≤ h · frictionloss
    ///   equality         u = J v⁺ + R λ − (J v + h a_ref)    MuJoCo's own, with its compliance
    ///
    /// (The last is h times MuJoCo's J a + R f = a_ref.)
    Hard,
    /// At accelerations, as MuJoCo: x = qacc, λ = f, H = M, a = qfrc_smooth, u = J a + R f − a_ref for all rows.
    Mujoco
};

/// Posed anew in each step; keeps its memory.
class ContactProblem {
public:
    explicit ContactProblem(Compliance compliance) : compliance_(compliance) {}

    /// Reads what mj_fwdAcceleration left. derivative: ∂f/∂v of an implicit integrator, nv × nv, else null. Throws
    /// delassus::Unsupported where H is not definite.
    void read(const mjModel* m, const mjData* d, const double* derivative) {
        nv_ = static_cast<std::size_t>(m->nv);
        step_ = m->opt.timestep;
        factor_mass(m, d, derivative);
        x_free_.assign(nv_, 0.0);
        if (compliance_ == Compliance::Mujoco) {
            std::copy_n(d->qacc_smooth, nv_, x_free_.begin());
        } else {
            std::copy_n(d->qfrc_smooth, nv_, x_free_.begin());
            H_.solve_transposed(x_free_.data());
            H_.solve(x_free_.data());
            for (std::size_t k = 0; k < nv_; ++k) x_free_[k] = d->qvel[k] + step_ * x_free_[k];
        }
        blocks_.clear();
        J_.clear();
        E_.clear();
        b_.clear();
        add_rows(m, d);
        whiten();
    }

    [[nodiscard]] bool empty() const { return blocks_.empty(); }
    [[nodiscard]] std::size_t rows() const { return b_.size(); }
    [[nodiscard]] const std::vector<ConstraintBlock>& blocks() const { return blocks_; }
    /// Whether there is torsional or rolling friction.
    [[nodiscard]] bool has_bounds() const {
        return std::any_of(blocks_.begin(), blocks_.end(), [](const ConstraintBlock& block) {
            return block.kind == ConstraintBlock::Spin || block.kind == ConstraintBlock::Roll;
        });
    }
    /// From now on what overlaps is left as it is: for problems where it cannot be undone. False if nothing was undone.
    bool leave_overlaps() {
        bool any = false;
        if (compliance_ == Compliance::Mujoco) return any;
        for (const ConstraintBlock& block : blocks_) {
            if (block.kind != ConstraintBlock::Limit && block.kind != ConstraintBlock::Frictionless &&
                block.kind != ConstraintBlock::Contact)
                continue;
            double& b = b_[static_cast<std::size_t>(block.row)];
            any = any || b < 0.0;
            b = std::max(b, 0.0);
        }
        return any;
    }
    /// λ = scale · force.
    [[nodiscard]] double scale() const { return compliance_ == Compliance::Hard ? step_ : 1.0; }
    /// Unknowns of the free motion; may be corrected before problem().
    [[nodiscard]] std::vector<double>& x_free() { return x_free_; }
    [[nodiscard]] const ReverseCholesky& H() const { return H_; }

    /// In its reduced form: n = 0, E = J H⁻¹ Jᵀ + diag E, b = J x_free + b. lambda: of the solve before, whose normal
    /// forces bound torsional and rolling friction.
    [[nodiscard]] delassus::Problem problem(const mjData* d, const std::vector<double>& lambda, delassus::Law law) {
        delassus::Problem problem;
        problem.name = "the step of MuJoCo";
        problem.law = law;
        const std::size_t m = rows();
        problem.E.rows = problem.E.columns = static_cast<std::int32_t>(m);
        problem.E.row_start.assign(row_start_.begin(), row_start_.end());
        problem.E.column.assign(column_.begin(), column_.end());
        problem.E.value.assign(value_.begin(), value_.end());
        std::vector<double> b = b_;
        for (std::size_t i = 0; i < m; ++i)
            for (std::size_t k = 0; k < nv_; ++k) b[i] += J_[i * nv_ + k] * x_free_[k];
        for (const ConstraintBlock& block : blocks_) problem.cones.push_back(cone_of(d, block, lambda, b));
        problem.b.assign(b.begin(), b.end());
        return problem;
    }

    /// x = x_free + H⁻¹ Jᵀ λ.
    void unknowns(const std::vector<double>& lambda, std::vector<double>& x) const {
        x.assign(nv_, 0.0);
        for (std::size_t i = 0; i < rows(); ++i)
            for (std::size_t k = 0; k < nv_; ++k) x[k] += Y_[i * nv_ + k] * lambda[i];
        H_.solve(x.data());
        for (std::size_t k = 0; k < nv_; ++k) x[k] += x_free_[k];
    }

    /// Writes efc_force and efc_state, of rows that have no block too.
    void write_forces(const mjModel* m, mjData* d, const std::vector<double>& lambda) const {
        mju_zero(d->efc_force, d->nefc);
        std::fill_n(d->efc_state, d->nefc, static_cast<int>(mjCNSTRSTATE_SATISFIED));
        const double unit = 1.0 / scale();
        for (std::size_t k = 0; k < blocks_.size(); ++k) {
            const ConstraintBlock& block = blocks_[k];
            const double first = lambda[static_cast<std::size_t>(block.row)] * unit;
            int& state = d->efc_state[block.efc];
            switch (block.kind) {
                case ConstraintBlock::Equality:
                    d->efc_force[block.efc] = first;
                    state = mjCNSTRSTATE_QUADRATIC;
                    break;
                case ConstraintBlock::Loss:
                    d->efc_force[block.efc] = first;
                    state = first >= block.mu    ? mjCNSTRSTATE_LINEARNEG
                            : first <= -block.mu ? mjCNSTRSTATE_LINEARPOS
                                                 : mjCNSTRSTATE_QUADRATIC;
                    break;
                case ConstraintBlock::Limit:
                case ConstraintBlock::Frictionless:
                    d->efc_force[block.efc] = first;
                    state = first > 0.0 ? mjCNSTRSTATE_QUADRATIC : mjCNSTRSTATE_SATISFIED;
                    break;
                case ConstraintBlock::Contact: {
                    const mjContact& contact = d->contact[block.contact];
                    const std::array<double, 6> force = force_of(k, lambda);
                    write_contact_force(d, block.efc, contact, force);
                    const bool pyramid = d->efc_type[block.efc] == mjCNSTR_CONTACT_PYRAMIDAL;
                    const bool slides =
                        std::hypot(force[1], force[2] / block.stretch) >= block.mu * force[0] * (1.0 - 1e-12);
                    const int rows = pyramid ? 2 * (contact.dim - 1) : contact.dim;
                    std::fill_n(&state, rows,
                                static_cast<int>(force[0] <= 0.0      ? mjCNSTRSTATE_SATISFIED
                                                 : slides && !pyramid ? mjCNSTRSTATE_CONE
                                                                      : mjCNSTRSTATE_QUADRATIC));
                    break;
                }
                case ConstraintBlock::Spin:
                case ConstraintBlock::Roll:
                    break;  // with their contact
            }
        }
        static_cast<void>(m);
    }

    /// Of a contact, N and N m in its frame; the blocks of spin and roll follow it.
    [[nodiscard]] std::array<double, 6> force_of(std::size_t contact, const std::vector<double>& lambda) const {
        std::array<double, 6> force{};
        const double unit = 1.0 / scale();
        const auto at = [&](int row) { return lambda[static_cast<std::size_t>(row)] * unit; };
        for (std::size_t k = contact; k < blocks_.size() && blocks_[k].contact == blocks_[contact].contact; ++k) {
            const ConstraintBlock& block = blocks_[k];
            if (block.kind == ConstraintBlock::Contact) {
                force[0] = at(block.row);
                force[1] = at(block.row + 1);
                force[2] = at(block.row + 2) * block.stretch;
            } else if (block.kind == ConstraintBlock::Spin) {
                force[3] = at(block.row);
            } else {
                force[4] = at(block.row + 1);
                force[5] = at(block.row + 2) * block.stretch;
            }
        }
        return force;
    }

private:
    void factor_mass(const mjModel* m, const mjData* d, const double* derivative) {
        mass_.resize(nv_ * nv_);
        versions::full_mass(m, d, mass_.data());
        if (compliance_ == Compliance::Hard) {
            if (derivative) {  // the symmetric part; what the rest adds is found by trying the integrator
                for (std::size_t i = 0; i < nv_; ++i)
                    for (std::size_t j = 0; j < nv_; ++j)
                        mass_[i * nv_ + j] -= 0.5 * step_ * (derivative[i * nv_ + j] + derivative[j * nv_ + i]);
            } else {
                for (std::size_t i = 0; i < nv_; ++i) mass_[i * nv_ + i] += step_ * damping(m, static_cast<int>(i));
            }
        }
        if (!H_.factor(mass_, nv_))
            throw delassus::Unsupported("The matrix of MuJoCo's integrator, M − h ∂f/∂v, is not positive definite.");
    }
    /// What mj_Euler takes implicitly.
    static double damping(const mjModel* m, int dof) {
#if mjVERSION_HEADER >= 300
        if (m->opt.disableflags & mjDSBL_EULERDAMP) return 0.0;
#endif
        return m->dof_damping[dof] > 0.0 ? m->dof_damping[dof] : 0.0;
    }

    void row_of(const mjModel* m, const mjData* d, int efc, std::vector<double>& row) const {
        if (!mj_isSparse(m)) {
            const double* from = d->efc_J + static_cast<std::size_t>(efc) * nv_;
            row.assign(from, from + nv_);
            return;
        }
        row.assign(nv_, 0.0);
        for (int k = d->efc_J_rowadr[efc], end = k + d->efc_J_rownnz[efc]; k < end; ++k)
            row[static_cast<std::size_t>(d->efc_J_colind[k])] = d->efc_J[k];
    }

    void add_rows(const mjModel* m, const mjData* d) {
        const bool hard = compliance_ == Compliance::Hard;
        for (int efc = 0; efc < d->nefc; ++efc) {
            const int type = d->efc_type[efc];
            if (type == mjCNSTR_CONTACT_PYRAMIDAL || type == mjCNSTR_CONTACT_ELLIPTIC) {
                const mjContact& contact = d->contact[d->efc_id[efc]];
                add_contact(m, d, efc, contact);
                efc += (type == mjCNSTR_CONTACT_ELLIPTIC ? contact.dim : 2 * (contact.dim - 1)) - 1;
                continue;
            }
            ConstraintBlock block;
            block.efc = efc;
            double E = d->efc_R[efc], b = -d->efc_aref[efc];
            if (type == mjCNSTR_EQUALITY) {
                block.kind = ConstraintBlock::Equality;
                if (hard) b = -(d->efc_vel[efc] + step_ * d->efc_aref[efc]);
            } else if (type == mjCNSTR_FRICTION_DOF || type == mjCNSTR_FRICTION_TENDON) {
                block.kind = ConstraintBlock::Loss;
                block.mu = d->efc_frictionloss[efc];
                if (hard) E = b = 0.0;
            } else {
                const bool touches = type == mjCNSTR_CONTACT_FRICTIONLESS;
                block.kind = touches ? ConstraintBlock::Frictionless : ConstraintBlock::Limit;
                if (touches) block.contact = d->efc_id[efc];
                if (hard) {
                    E = 0.0;
                    b = touches ? contact_approach(m, d->contact[block.contact])
                                : approach(d->efc_pos[efc], rest_overlap, limit_recovery(d, efc));
                }
            }
            row_of(m, d, efc, row_);
            add_row(row_, 1.0, E, b);
            add_block(block, 1);
        }
    }

    void add_contact(const mjModel* m, const mjData* d, int efc, const mjContact& contact) {
        const bool hard = compliance_ == Compliance::Hard;
        contact_rows_.read(m, d, efc, contact,
                           [&](int row, std::vector<double>& jacobian) { row_of(m, d, row, jacobian); });
        const auto add = [&](std::size_t k, double stretch) {
            add_row(contact_rows_.jacobian[k], stretch, hard ? 0.0 : stretch * stretch * contact_rows_.compliance[k],
                    hard ? 0.0 : -stretch * contact_rows_.reference[k]);
        };
        ConstraintBlock block;
        block.kind = ConstraintBlock::Contact;
        block.efc = efc;
        block.contact = d->efc_id[efc];
        block.mu = contact.friction[0];
        block.stretch = contact.friction[1] / contact.friction[0];
        const auto normal = static_cast<int>(rows());
        add(0, 1.0);
        if (hard) b_.back() = contact_approach(m, contact);
        add(1, 1.0);
        add(2, block.stretch);
        add_block(block, 3);
        block.normal = normal;
        if (contact.dim >= 4) {
            block.kind = ConstraintBlock::Spin;
            block.mu = contact.friction[2];
            add(3, 1.0);
            add_block(block, 1);
        }
        if (contact.dim >= 6) {
            block.kind = ConstraintBlock::Roll;
            block.mu = contact.friction[3];
            block.stretch = contact.friction[4] / contact.friction[3];
            row_.assign(nv_, 0.0);
            add_row(row_, 1.0, 0.0, 0.0);
            add(4, 1.0);
            add(5, block.stretch);
            add_block(block, 3);
        }
    }

    void add_row(const std::vector<double>& jacobian, double factor, double E, double b) {
        for (std::size_t k = 0; k < nv_; ++k) J_.push_back(factor * jacobian[k]);
        E_.push_back(E);
        b_.push_back(b);
    }
    void add_block(ConstraintBlock block, int rows_of_block) {
        block.rows = rows_of_block;
        block.row = static_cast<int>(rows()) - rows_of_block;
        blocks_.push_back(block);
    }

    /// b of a row that closes at `distance`: at most the speed `recovery` pushes apart what overlaps. Surfaces come to
    /// rest with an overlap of δ, and between none and 2 δ they are left as they are: MuJoCo reports what touches only
    /// if it overlaps, or by a margin, and rounding must not decide whether a body that rests is held.
    [[nodiscard]] double approach(double distance, double overlap, double recovery) const {
        const double gap = distance + overlap;
        return std::abs(gap) <= overlap ? 0.0 : std::max(gap / step_, -recovery);
    }
    /// δ of limits, in the coordinate's unit, and of contacts, in parts of the mean size of bodies: √ε.
    static constexpr double rest_overlap = 1.5e-8;
    /// As in scenes of Delassus (D023): a hundredth of √(g s).
    [[nodiscard]] double contact_approach(const mjModel* m, const mjContact& contact) const {
        const double size = m->stat.meansize;
        return approach(contact.dist, rest_overlap * size, 0.01 * std::sqrt(mju_norm(m->opt.gravity, 3) * size));
    }
    /// The speed that MuJoCo's own reference would give within a step, from rest.
    [[nodiscard]] double limit_recovery(const mjData* d, int efc) const {
        return step_ * d->efc_KBIP[4 * efc] * d->efc_KBIP[4 * efc + 2] * std::max(0.0, -d->efc_pos[efc]);
    }

    /// Y = J L⁻¹ and N = Y Yᵀ + diag E, without what is zero.
    void whiten() {
        Y_ = J_;
        const std::size_t m = rows();
        support_start_.assign(1, 0);
        support_.clear();
        for (std::size_t i = 0; i < m; ++i) {
            H_.solve_transposed(&Y_[i * nv_]);
            for (std::size_t k = 0; k < nv_; ++k)
                if (Y_[i * nv_ + k] != 0.0) support_.push_back(k);
            support_start_.push_back(support_.size());
        }
        dense_.assign(m * m, 0.0);
        for (std::size_t i = 0; i < m; ++i) {
            for (std::size_t j = 0; j <= i; ++j) {
                double sum = 0.0;
                for (std::size_t p = support_start_[i]; p < support_start_[i + 1]; ++p)
                    sum += Y_[i * nv_ + support_[p]] * Y_[j * nv_ + support_[p]];
                dense_[i * m + j] = dense_[j * m + i] = sum;
            }
            dense_[i * m + i] += E_[i];
        }
        for (const ConstraintBlock& block : blocks_) {  // of the bound's row: of the size of the two beside it
            if (block.kind != ConstraintBlock::Roll) continue;
            const auto row = static_cast<std::size_t>(block.row);
            dense_[row * m + row] = 0.5 * (dense_[(row + 1) * m + row + 1] + dense_[(row + 2) * m + row + 2]);
        }
        row_start_.assign(1, 0);
        column_.clear();
        value_.clear();
        for (std::size_t i = 0; i < m; ++i) {
            for (std::size_t j = 0; j < m; ++j) {
                if (dense_[i * m + j] == 0.0) continue;
                column_.push_back(static_cast<std::int32_t>(j));
                value_.push_back(dense_[i * m + j]);
            }
            row_start_.push_back(static_cast<std::int32_t>(column_.size()));
        }
    }

    delassus::Cone cone_of(const mjData* d, const ConstraintBlock& block, const std::vector<double>& lambda,
                           std::vector<double>& b) const {
        using delassus::Cone;
        switch (block.kind) {
            case ConstraintBlock::Equality:
                return Cone::free(1);
            case ConstraintBlock::Loss: {
                const double most = scale() * d->efc_frictionloss[block.efc];
                return Cone::box({-most}, {most});
            }
            case ConstraintBlock::Limit:
            case ConstraintBlock::Frictionless:
                return Cone::nonnegative(1);
            case ConstraintBlock::Contact:
                return Cone::friction(block.mu);
            case ConstraintBlock::Spin: {
                const double most = block.mu * std::max(0.0, lambda[static_cast<std::size_t>(block.normal)]);
                return Cone::box({-most}, {most});
            }
            case ConstraintBlock::Roll:
                break;
        }
        const auto row = static_cast<std::size_t>(block.row);
        b[row] = -dense_[row * rows() + row] * std::max(0.0, lambda[static_cast<std::size_t>(block.normal)]);
        return Cone::friction(block.mu);
    }

    Compliance compliance_;
    std::size_t nv_ = 0;
    double step_ = 0.0;
    ReverseCholesky H_;
    ContactRows contact_rows_;
    std::vector<ConstraintBlock> blocks_;
    std::vector<double> mass_, x_free_, row_;
    std::vector<double> J_, Y_, E_, b_, dense_;  // rows × nv, rows, rows × rows
    std::vector<std::size_t> support_, support_start_;
    std::vector<std::int32_t> row_start_, column_;
    std::vector<double> value_;
};
