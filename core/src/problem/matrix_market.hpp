// SPDX-License-Identifier: BSD-3-Clause
// A strict reader and a writer for the two forms of Matrix Market that problem folders use:
//   %%MatrixMarket matrix coordinate real|integer general|symmetric    a sparse matrix, entries counted from 1;
//                                                                      symmetric holds the lower triangle
//   %%MatrixMarket matrix array real|integer general                   a vector: one column
// Lines that begin with % are comments; blank lines and CRLF are accepted. Everything else is refused with an
// InputError that names the file and the line. Nothing is allocated before the sizes are known to be right.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/problem.hpp"

namespace delassus {

/// Parses the text of a sparse matrix, which must have the given size. file names it in messages.
SparseMatrix parse_matrix_market(std::string_view text, const std::string& file, std::int32_t rows,
                                 std::int32_t columns);

/// Parses the text of a vector, which must have the given size.
std::vector<double> parse_vector_market(std::string_view text, const std::string& file, std::int32_t rows);

/// The text of a matrix, as `symmetric` if it is exactly so and may_be_symmetric. Every number reads back bit by bit.
std::string matrix_market_text(const SparseMatrix& matrix, bool may_be_symmetric);

std::string vector_market_text(std::span<const double> vector);

}  // namespace delassus
