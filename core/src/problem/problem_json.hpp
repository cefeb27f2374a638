// SPDX-License-Identifier: BSD-3-Clause
// problem.json: everything of a problem but its matrices and vectors.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/problem.hpp"

namespace delassus {

struct ProblemJson {
    std::int32_t n = 0;
    std::int32_t m = 0;
    Law law = Law::Associated;
    std::string source;
    std::string notes;

    /// The runs are known to cover m rows. expand_cones() expands them later, once the vectors have confirmed m.
    struct Run {
        ConeKind kind = ConeKind::Free;
        std::int32_t rows = 0;                        ///< of a block
        std::int32_t count = 1;                       ///< blocks
        std::vector<std::vector<double>> parameters;  ///< of the kind: each one for all, or one for each block
        std::vector<double> lo, hi;                   ///< one for all rows, or one for each
    };
    std::vector<Run> runs;
};

/// Parses the text, key by key; file names it in messages. Throws InputError.
ProblemJson parse_problem_json(std::string_view text, const std::string& file);

/// One block for each run of separate rows, and for each of the cones whose rows do not separate.
std::vector<Cone> expand_cones(const ProblemJson& json);

/// The text for a valid problem; neighbouring cones of one kind and dimension whose rows do not separate form a run.
std::string problem_json_text(const Problem& problem);

}  // namespace delassus
