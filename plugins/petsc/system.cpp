// SPDX-License-Identifier: BSD-3-Clause
#include "system.hpp"

#include "delassus/sdk/saddle_point.hpp"

namespace delassus::petsc {

using sdk::ProblemView;
using sdk::Vector;

Layout::Layout(std::int64_t n, std::int64_t m, int rank, int size) : n_(n) {
    x_number_.resize(static_cast<std::size_t>(n));
    lambda_number_.resize(static_cast<std::size_t>(m));
    for (int p = 0; p < size; ++p) {
        const std::int64_t x_begin = n * p / size, x_end = n * (p + 1) / size;
        const std::int64_t y_begin = m * p / size, y_end = m * (p + 1) / size;
        for (auto i = x_begin; i < x_end; ++i)
            x_number_[static_cast<std::size_t>(i)] = static_cast<PetscInt>(y_begin + i);
        for (auto k = y_begin; k < y_end; ++k)
            lambda_number_[static_cast<std::size_t>(k)] = static_cast<PetscInt>(x_end + k);
        if (p == rank) {
            first_ = static_cast<PetscInt>(x_begin + y_begin);
            local_x_ = static_cast<PetscInt>(x_end - x_begin);
            local_lambda_ = static_cast<PetscInt>(y_end - y_begin);
            first_lambda_ = y_begin;
        }
    }
}

void make_matrix(const sdk::MpiCommunicator& communicator, PetscInt local, std::vector<PetscInt> rows,
                 std::vector<PetscInt> columns, MatrixHandle& matrix) {
    check(MatCreate(communicator.get(), matrix.make()));
    check(MatSetSizes(matrix.get(), local, local, PETSC_DETERMINE, PETSC_DETERMINE));
    check(MatSetType(matrix.get(), MATAIJ));
    check(MatSetPreallocationCOO(matrix.get(), static_cast<PetscCount>(rows.size()), rows.data(), columns.data()));
}

void System::analyze(const ProblemView& problem, const Vector& C) {
    layout_ = Layout(problem.n, problem.m, communicator_.rank(), communicator_.size());
    std::vector<PetscInt> rows, columns;
    sdk::visit_saddle_point(problem, C, 0.0, [&](std::int32_t i, std::int32_t j, double) {
        if (!layout_.owns(i)) return;
        rows.push_back(layout_.of(i));
        columns.push_back(layout_.of(j));
    });
    make_matrix(communicator_, layout_.local_rows(), rows, columns, exact_);
    make_matrix(communicator_, layout_.local_rows(), std::move(rows), std::move(columns), shifted_);
    check(MatCreateVecs(exact_.get(), solution_.make(), right_hand_side_.make()));
    check(VecScatterCreateToAll(solution_.get(), to_all_.make(), everything_.make()));
    check(ISCreateStride(communicator_.get(), layout_.local_x(), layout_.first(), 1, x_rows_.make()));
    check(ISCreateStride(communicator_.get(), layout_.local_lambda(), layout_.first() + layout_.local_x(), 1,
                         lambda_rows_.make()));
}

void System::factorize(const ProblemView& problem, const Vector& C, double shift) {
    const bool symmetric = !problem.needs_any(DELASSUS_CAN_H_UNSYMMETRIC);
    for (const bool with_shift : {false, true}) {
        Mat matrix = with_shift ? shifted() : exact();
        std::vector<PetscScalar> values;
        sdk::visit_saddle_point(problem, C, with_shift ? shift : 0.0, [&](std::int32_t i, std::int32_t, double value) {
            if (layout_.owns(i)) values.push_back(value);
        });
        check(MatSetValuesCOO(matrix, values.data(), INSERT_VALUES));
        check(MatSetOption(matrix, MAT_SYMMETRIC, symmetric ? PETSC_TRUE : PETSC_FALSE));
    }
}

void System::scatter(const Vector& values, Vec distributed) const {
    PetscScalar* local = nullptr;
    check(VecGetArrayWrite(distributed, &local));
    for (Eigen::Index i = 0; i < values.size(); ++i)
        if (layout_.owns(i)) local[layout_.of(i) - layout_.first()] = values[i];
    check(VecRestoreArrayWrite(distributed, &local));
}

void System::gather(Vec distributed, Vector& values) const {
    check(VecScatterBegin(to_all_.get(), distributed, everything_.get(), INSERT_VALUES, SCATTER_FORWARD));
    check(VecScatterEnd(to_all_.get(), distributed, everything_.get(), INSERT_VALUES, SCATTER_FORWARD));
    const PetscScalar* all = nullptr;
    check(VecGetArrayRead(everything_.get(), &all));
    for (Eigen::Index i = 0; i < values.size(); ++i) values[i] = all[layout_.of(i)];
    check(VecRestoreArrayRead(everything_.get(), &all));
}

}  // namespace delassus::petsc
