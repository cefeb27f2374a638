// SPDX-License-Identifier: BSD-3-Clause
#include "errors.hpp"

#include <array>
#include <cstdlib>

namespace delassus::mumps {

namespace {

struct Row {
    int code;
    const char* sentence;
};

constexpr std::array<Row, 18> table = {{
    {-5, "memory for the analysis could not be allocated"},
    {-6, "the matrix is singular in structure: some rows can never be matched with columns"},
    {-7, "memory for the analysis could not be allocated"},
    {-8, "the integer workspace is too small, even after it was enlarged: raise memory_relaxation"},
    {-9, "the workspace for the factors is too small, even after it was enlarged: raise memory_relaxation"},
    {-10, "the matrix is numerically singular"},
    {-11, "the workspace of the solve is too small: raise memory_relaxation"},
    {-13, "memory for the factors could not be allocated: the fill is too large for this machine"},
    {-14, "the integer workspace of the solve is too small: raise memory_relaxation"},
    {-15, "the integer workspace of the refinement is too small: raise memory_relaxation"},
    {-17, "the send buffer is too small: raise memory_relaxation"},
    {-19, "the permitted working memory is too small for this matrix"},
    {-20, "the receive buffer is too small: raise memory_relaxation"},
    {-29, "the factors could not be sent between the processes"},
    {-38, "the parallel ordering was asked for, but MUMPS was built without it: choose another ordering"},
    {-39, "the parallel ordering failed: choose another ordering"},
    {-51, "the graph is too large for the 32-bit ordering library: choose another ordering"},
    {-52, "the ordering library failed: choose another ordering"},
}};

}  // namespace

std::string error_sentence(int code, int detail) {
    const std::string number = "MUMPS error " + std::to_string(code) + " (detail " + std::to_string(detail) + ")";
    for (const auto& row : table)
        if (row.code == code) return std::string(row.sentence) + " [" + number + "]";
    return number + ": see the MUMPS users' guide, section on error and warning diagnostics";
}

}  // namespace delassus::mumps
