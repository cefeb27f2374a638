// SPDX-License-Identifier: BSD-3-Clause
#include "fclib/isolated.hpp"

#include "fclib/fclib.hpp"
#include "hdf5/isolated.hpp"

namespace delassus::fclib {
namespace {

/// Transfers friction cones and free rows only: FCLib has no others.
template <class Message>
void transfer(Message& message, Problem& problem) {
    for (SparseMatrix* A : {&problem.H, &problem.D, &problem.E}) {
        message(A->rows);
        message(A->columns);
        message(A->row_start);
        message(A->column);
        message(A->value);
    }
    message(problem.a);
    message(problem.b);
    message.each(problem.cones, [&](Cone& cone) {
        message(cone.kind);
        message(cone.rows);
        message(cone.parameters[0]);
    });
    message(problem.law);
    for (std::string* text : {&problem.name, &problem.source, &problem.notes}) message(*text);
}

}  // namespace

Problem read_isolated(const std::filesystem::path& file) {
    Problem problem;
    const auto read = [&](hdf5::Packer& message) {
        problem = read_file(file);
        transfer(message, problem);
    };
    hdf5::read_isolated(file, read, [&](hdf5::Unpacker& message) { transfer(message, problem); });
    validate(problem);
    return problem;
}

}  // namespace delassus::fclib
