// SPDX-License-Identifier: BSD-3-Clause
// Any solver of Delassus in Project Chrono 10, for systems with non-smooth contact:
//
//     system.SetSolver(chrono_types::make_shared<DelassusChronoSolver>("auto"));
#pragma once

#include <chrono/solver/ChConstraintContactNormal.h>
#include <chrono/solver/ChConstraintTwoGenericBoxed.h>
#include <chrono/solver/ChSolver.h>
#include <chrono/solver/ChSystemDescriptor.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "delassus/error.hpp"
#include "delassus/needs.hpp"
#include "delassus/problem.hpp"
#include "delassus/registry.hpp"
#include "delassus/solver.hpp"
#include "delassus/solver_config.hpp"

/// Chrono's system descriptor holds the problem of docs/problem.md, with other letters:
///
///     H q − Cqᵀ l = f,   Cq q + cfm l + b = c      x = q,  λ = l,  a = f,  D = Cq,  E = diag(cfm),  u = c
///
/// H are masses, or masses, damping and stiffness together where an implicit timestepper asks for them.
class DelassusChronoSolver : public chrono::ChSolver {
public:
    /// solver: as --solver has it, "pgs" or "ssn(…)". Chrono's own solvers know the associated law alone. Throws
    /// delassus::InputError.
    explicit DelassusChronoSolver(const std::string& solver = "auto", double tolerance = 1e-8,
                                  delassus::Law law = delassus::Law::Coulomb)
        : solver_(make_solver(registry_, delassus::parse_solver(solver))), law_(law) {
        settings.tolerance = tolerance;
        settings.warm_start = true;
    }

    delassus::SolveSettings settings;

    Type GetType() const override { return Type::CUSTOM; }
    // Chrono casts to its own classes where one of these is true.
    bool IsIterative() const override { return false; }
    bool IsDirect() const override { return false; }
    bool SolveRequiresMatrix() const override { return true; }

    /// The natural error of what was written to the descriptor. Throws delassus::Unsupported on rolling friction.
    double Solve(chrono::ChSystemDescriptor& descriptor) override {
        pose(descriptor);
        delassus::Solution solution = solution_of(descriptor);
        report_ = solver_.solve(*problem_, solution, settings);
        for (std::size_t k = 0; k < cohesion_.size(); ++k) solution.lambda[k] -= cohesion_[k];
        using Vector = Eigen::Map<const Eigen::VectorXd>;
        descriptor.FromVectorToVariables(Vector(solution.x.data(), static_cast<Eigen::Index>(solution.x.size())));
        descriptor.FromVectorToConstraints(
            Vector(solution.lambda.data(), static_cast<Eigen::Index>(solution.lambda.size())));
        return report_.error.natural;
    }

    /// Of the latest solve: status, time, errors as Delassus measures them.
    [[nodiscard]] const delassus::SolveReport& report() const { return report_; }

    /// The problem that the descriptor holds.
    const delassus::PreparedProblem& pose(chrono::ChSystemDescriptor& descriptor) {
        delassus::Problem problem;
        problem.name = "of Chrono";
        problem.law = law_;
        const auto n = static_cast<int>(descriptor.CountActiveVariables());
        const auto m = static_cast<int>(descriptor.CountActiveConstraints());
        chrono::ChSparseMatrix H(n, n), D(m, n);
        descriptor.PasteMassKRMMatrixInto(H);
        descriptor.PasteConstraintsJacobianMatrixInto(D);
        problem.H = matrix_of(H);
        problem.D = matrix_of(D);
        chrono::ChVectorDynamic<> f;
        descriptor.BuildFbVector(f);
        cones_of(descriptor, problem);
        std::vector<delassus::Triplet> compliance;
        for (int row = 0; row < m; ++row) compliance.push_back({row, row, cfm_[static_cast<std::size_t>(row)]});
        problem.E = delassus::SparseMatrix::from_triplets(m, m, std::move(compliance));
        // A contact with cohesion c has ‖λ_t‖ ≤ μ (λ_n + c): the cone is that of λ + c e_n.
        problem.a.assign(f.data(), f.data() + f.size());
        problem.D.transpose_multiply_add(-1.0, cohesion_.data(), problem.a.data());
        problem.E.multiply_add(-1.0, cohesion_.data(), problem.b.data());
        return problem_.emplace(std::move(problem));
    }

    /// What the descriptor has as its solution, in the terms of the problem that was posed.
    [[nodiscard]] delassus::Solution solution_of(const chrono::ChSystemDescriptor& descriptor) const {
        chrono::ChVectorDynamic<> q, l;
        descriptor.FromVariablesToVector(q);
        descriptor.FromConstraintsToVector(l);
        delassus::Solution solution{{q.data(), q.data() + q.size()}, {l.data(), l.data() + l.size()}};
        for (std::size_t k = 0; k < cohesion_.size(); ++k) solution.lambda[k] += cohesion_[k];
        return solution;
    }

private:
    static delassus::SparseMatrix matrix_of(chrono::ChSparseMatrix& matrix) {
        matrix.makeCompressed();
        delassus::SparseMatrix result;
        result.rows = static_cast<std::int32_t>(matrix.rows());
        result.columns = static_cast<std::int32_t>(matrix.cols());
        result.row_start.assign(matrix.outerIndexPtr(), matrix.outerIndexPtr() + matrix.rows() + 1);
        result.column.assign(matrix.innerIndexPtr(), matrix.innerIndexPtr() + matrix.nonZeros());
        result.value.assign(matrix.valuePtr(), matrix.valuePtr() + matrix.nonZeros());
        return result;
    }

    /// Cones, b, and cfm_ and cohesion_ of each row.
    void cones_of(chrono::ChSystemDescriptor& descriptor, delassus::Problem& problem) {
        using chrono::ChConstraint;
        std::vector<ChConstraint*> rows;
        for (ChConstraint* row : descriptor.GetConstraints())
            if (row->IsActive()) rows.push_back(row);
        cfm_.clear();
        cohesion_.assign(rows.size(), 0.0);
        for (const ChConstraint* row : rows) {
            cfm_.push_back(row->GetComplianceTerm());
            problem.b.push_back(row->GetRightHandSide());
        }
        for (std::size_t k = 0; k < rows.size(); ++k) {
            if (auto* normal = dynamic_cast<chrono::ChConstraintContactNormal*>(rows[k])) {
                if (k + 2 >= rows.size() || rows[k + 1] != normal->GetTangentialConstraintU() ||
                    rows[k + 2] != normal->GetTangentialConstraintV())
                    throw delassus::Unsupported("A contact of Chrono's lacks the two rows of friction after its own.");
                problem.cones.push_back(delassus::Cone::friction(normal->GetFrictionCoefficient()));
                cohesion_[k] = normal->GetCohesion();
                k += 2;
            } else if (auto* box = dynamic_cast<chrono::ChConstraintTwoGenericBoxed*>(rows[k])) {
                problem.cones.push_back(delassus::Cone::box({box->GetBoxedMin()}, {box->GetBoxedMax()}));
            } else if (rows[k]->GetMode() == ChConstraint::Mode::UNILATERAL) {
                problem.cones.push_back(delassus::Cone::nonnegative(1));
            } else if (rows[k]->GetMode() == ChConstraint::Mode::LOCK) {
                problem.cones.push_back(delassus::Cone::free(1));
            } else if (rows[k]->GetMode() == ChConstraint::Mode::FREE) {
                problem.cones.push_back(delassus::Cone::box({0.0}, {0.0}));
            } else {
                throw delassus::Unsupported("Chrono's rolling and spinning friction has no cone in Delassus.");
            }
        }
    }

    delassus::Registry registry_;
    delassus::Solver solver_;
    delassus::Law law_;
    std::vector<double> cfm_, cohesion_;
    std::optional<delassus::PreparedProblem> problem_;
    delassus::SolveReport report_;
};
