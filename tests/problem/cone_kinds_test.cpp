// SPDX-License-Identifier: BSD-3-Clause
// What the host makes of the table of cones, for every kind in it: files, checks, needs, and what the documentation
// says.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <limits>

#include "delassus/error.hpp"
#include "delassus/needs.hpp"
#include "delassus/problem_files.hpp"
#include "problem/cone_kinds.hpp"
#include "support/places.hpp"
#include "support/problem_equality.hpp"
#include "support/run_command.hpp"
#include "support/small_problems.hpp"

namespace delassus::tests {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// An ordinary block of the kind.
Cone example_of(const sdk::ConeOperations& kind, std::int32_t rows) {
    Cone cone{static_cast<ConeKind>(kind.kind), rows, {}, {}, {}};
    for (std::size_t k = 0; k < kind.named_parameters().size(); ++k) cone.parameters[k] = kind.parameters[k].example;
    if (kind.has_bounds) {
        cone.lo.assign(static_cast<std::size_t>(rows), -1.0);
        cone.hi.assign(static_cast<std::size_t>(rows), infinity);
    }
    return cone;
}

/// Masses of 1, each with a row.
Problem problem_of(std::vector<Cone> cones) {
    std::int32_t m = 0;
    for (const Cone& cone : cones) m += cone.rows;
    Problem problem;
    problem.H = identity(m);
    problem.D = identity(m);
    problem.a.assign(static_cast<std::size_t>(m), 1.0);
    problem.b.assign(static_cast<std::size_t>(m), 0.0);
    problem.cones = std::move(cones);
    return problem;
}

class EachKind : public testing::TestWithParam<std::size_t> {
protected:
    const sdk::ConeOperations& kind = sdk::cone_table[GetParam()];
};

TEST_P(EachKind, ReadsBackFromAProblemFolder) {
    const ScratchFolder scratch;
    Cone other = example_of(kind, kind.usual_rows);
    for (std::size_t k = 0; k < kind.named_parameters().size(); ++k) other.parameters[k] *= 3.0;
    const Problem problem = problem_of({example_of(kind, kind.usual_rows), example_of(kind, kind.least_rows),
                                        example_of(kind, kind.usual_rows), other});
    write_problem(problem, scratch / "p");
    expect_same(problem, read_problem(scratch / "p"));
}

TEST_P(EachKind, SaysWhatIsWrongWithItsParametersAndRows) {
    const auto refused = [&](const Cone& cone, const std::string& words) {
        expect_sentence(sentence_of<InputError>([&] { validate(problem_of({cone})); }), words);
    };
    for (std::size_t k = 0; k < kind.named_parameters().size(); ++k) {
        for (const double value :
             {kind.parameters[k].least - 0.5, infinity, std::numeric_limits<double>::quiet_NaN()}) {
            Cone cone = example_of(kind, kind.usual_rows);
            cone.parameters[k] = value;
            refused(cone, fmt::format("{} {}", kind.parameters[k].name, value));
        }
    }
    Cone cone = example_of(kind, kind.usual_rows);
    if (kind.parameter_count < sdk::most_parameters) {
        cone.parameters.back() = 1.0;
        refused(cone, fmt::format("the kind {} has {}", kind.name, kind.parameter_count));
    }
    if (kind.most_rows <= sdk::largest_block_rows)
        refused(example_of(kind, kind.most_rows + 1), std::string(kind.allowed_rows));
    if (!kind.has_bounds) {
        cone = example_of(kind, kind.usual_rows);
        cone.lo.assign(static_cast<std::size_t>(cone.rows), 0.0);
        refused(cone, "0 of each");
    }
}

TEST_P(EachKind, IsNeededAndNamed) {
    const PreparedProblem prepared(problem_of({example_of(kind, kind.usual_rows), example_of(kind, kind.usual_rows)}));
    EXPECT_EQ(prepared.needs() & sdk::all_cones, kind.capability());
    EXPECT_EQ((prepared.needs() & (DELASSUS_CAN_ASSOCIATED | DELASSUS_CAN_COULOMB)) != 0, kind.has_law());
    const auto count = kind.is_separable() ? 2 * kind.usual_rows : 2;
    EXPECT_EQ(prepared.describe(kind.capability()), fmt::format("{} {}", count, kind.plural));
    EXPECT_EQ(capability_names(kind.capability()), std::vector<std::string>{std::string(kind.name)});
    EXPECT_EQ(capabilities_of({std::string(kind.name)}), kind.capability());
}

#ifndef DELASSUS_TEST_CONE  // which is no user's
TEST_P(EachKind, StandsInTheDocumentation) {
    const auto docs = std::filesystem::path(tests::places::source) / "docs";
    const std::string row =
        fmt::format("| `{}` | {} | {} | {} | {} |\n", kind.name, kind.allowed_rows, kind.set, kind.dual, kind.use);
    EXPECT_NE(text_of(docs / "problem.md").find(row), std::string::npos) << "docs/problem.md lacks\n" << row;
    std::string keys = kind.is_separable() ? "`rows`" : "`count`";
    for (const auto& parameter : kind.named_parameters()) keys += fmt::format(", `{}`", parameter.key);
    if (kind.has_bounds) keys += ", `lo`, `hi`";
    if (!kind.is_separable()) keys += fmt::format(", `dimension` ({})", kind.allowed_rows);
    const std::string line = fmt::format("  | `{}` | {} |\n", kind.name, keys);
    EXPECT_NE(text_of(docs / "files.md").find(line), std::string::npos) << "docs/files.md lacks\n" << line;
}
#endif

INSTANTIATE_TEST_SUITE_P(ConeKinds, EachKind, testing::Range<std::size_t>(0, sdk::cone_table.size()),
                         [](const auto& chosen) { return std::string(sdk::cone_table[chosen.param].name); });

}  // namespace
}  // namespace delassus::tests
