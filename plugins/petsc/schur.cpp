// SPDX-License-Identifier: BSD-3-Clause
#include "schur.hpp"

#include "delassus/sdk/dense_algebra.hpp"
#include "delassus/sdk/saddle_point.hpp"

namespace delassus::petsc {

using sdk::ProblemView;
using sdk::SparseRows;
using sdk::Vector;

// B as a sparse matrix, every place of a block stored whatever its value.
SparseRows SchurMatrix::inverse(const ProblemView& problem) const {
    SparseRows B(problem.n, problem.n);
    std::vector<Eigen::Triplet<double, std::int32_t>> entries;
    if (!blocks_) {
        const Vector diagonal = sdk::magnitude_of_diagonal(problem);
        for (std::int32_t i = 0; i < problem.n; ++i) entries.emplace_back(i, i, 1.0 / diagonal[i]);
    } else {
        std::vector<std::int32_t> position(static_cast<std::size_t>(problem.n));
        Eigen::MatrixXd block;
        for (std::size_t k = 0; k + 1 < problem.h_block_start.size(); ++k) {
            const auto begin = problem.h_block_start[k], end = problem.h_block_start[k + 1];
            const auto index =
                problem.h_block_index.subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin));
            for (std::size_t i = 0; i < index.size(); ++i)
                position[static_cast<std::size_t>(index[i])] = static_cast<std::int32_t>(i);
            block.setZero(end - begin, end - begin);
            for (std::size_t i = 0; i < index.size(); ++i)
                for (sdk::SparseRowsView::InnerIterator entry(problem.H, index[i]); entry; ++entry)
                    block(static_cast<Eigen::Index>(i), position[static_cast<std::size_t>(entry.col())]) =
                        entry.value();
            if (!sdk::invert_definite(block))
                throw sdk::NumericalFailure("block " + std::to_string(k) + " of H is not positive definite");
            for (std::size_t i = 0; i < index.size(); ++i)
                for (std::size_t j = 0; j < index.size(); ++j)
                    entries.emplace_back(index[i], index[j],
                                         block(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
        }
    }
    B.setFromTriplets(entries.begin(), entries.end());
    return B;
}

SparseRows SchurMatrix::formed(const ProblemView& problem, const SparseRows& B) const {
    const SparseRows DB = problem.D * B;
    const SparseRows Dt = problem.D.transpose();
    SparseRows N = DB * Dt;
    SparseRows diagonal(problem.m, problem.m);
    diagonal.setIdentity();
    N += 0.0 * diagonal;
    if (problem.E.nonZeros() > 0) N += problem.E;
    return N;
}

void SchurMatrix::analyze(const ProblemView& problem, const Layout& layout, bool blocks) {
    blocks_ = blocks;
    // The pattern alone counts here: the values may be those of blocks not yet known to be definite.
    const SparseRows N = formed(problem, inverse(problem));
    std::vector<PetscInt> rows, columns;
    const auto begin = layout.first_lambda(), end = begin + layout.local_lambda();
    for (auto k = begin; k < end; ++k)
        for (SparseRows::InnerIterator entry(N, k); entry; ++entry) {
            rows.push_back(static_cast<PetscInt>(k));
            columns.push_back(static_cast<PetscInt>(entry.col()));
        }
    make_matrix(communicator_, layout.local_lambda(), std::move(rows), std::move(columns), matrix_);
}

void SchurMatrix::factorize(const ProblemView& problem, const Layout& layout, const Vector& C, double shift) {
    const SparseRows N = formed(problem, inverse(problem));
    const auto scale = C.tail(problem.m);
    std::vector<PetscScalar> values;
    const auto begin = layout.first_lambda(), end = begin + layout.local_lambda();
    for (auto k = begin; k < end; ++k)
        for (SparseRows::InnerIterator entry(N, k); entry; ++entry)
            values.push_back(-(scale[k] * entry.value() * scale[entry.col()] + (entry.col() == k ? shift : 0.0)));
    check(MatSetValuesCOO(matrix_.get(), values.data(), INSERT_VALUES));
    check(MatSetOption(matrix_.get(), MAT_SYMMETRIC, PETSC_TRUE));
}

}  // namespace delassus::petsc
