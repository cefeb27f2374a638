// SPDX-License-Identifier: BSD-3-Clause
// What holds for every kind: shapes, definiteness, determinism, errors, linear growth, and glued().
#include "delassus/generate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "delassus/error.hpp"
#include "support/dense.hpp"

namespace delassus::generate_test {
namespace {

using tests::dense;

std::string message_of(std::string_view kind, const std::map<std::string, double>& values) {
    try {
        (void)generate(kind, values);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

bool same(const SparseMatrix& A, const SparseMatrix& B) {
    return A.rows == B.rows && A.columns == B.columns && A.row_start == B.row_start && A.column == B.column &&
           A.value == B.value;
}

class EveryKind : public ::testing::TestWithParam<std::string> {};

TEST_P(EveryKind, IsAValidProblemWithFullShapes) {
    const Problem problem = generate(GetParam());
    EXPECT_NO_THROW(validate(problem));
    EXPECT_GT(problem.n(), 0);
    EXPECT_GT(problem.m(), 0);
    EXPECT_EQ(problem.H.rows, problem.n());
    EXPECT_EQ(problem.D.rows, problem.m());
    EXPECT_EQ(problem.D.columns, problem.n());
    EXPECT_FALSE(problem.name.empty());
    EXPECT_EQ(problem.source, "delassus generate " + GetParam());
}

TEST_P(EveryKind, HasAPositiveDefiniteSymmetricPart) {
    const Problem problem = generate(GetParam());
    const Eigen::MatrixXd H = dense(problem.H);
    EXPECT_EQ(H.isApprox(H.transpose(), 0.0), GetParam() != "gyroscopic");
    const Eigen::MatrixXd symmetric = 0.5 * (H + H.transpose());
    EXPECT_EQ(Eigen::LLT<Eigen::MatrixXd>(symmetric).info(), Eigen::Success);
}

TEST_P(EveryKind, IsTheSameAgainAndAnotherWithAnotherSeed) {
    const char* amplitude = GetParam() == "gyroscopic" ? "nutation" : "speed";
    const Problem first = generate(GetParam(), {{amplitude, 0.1}, {"seed", 5}});
    const Problem again = generate(GetParam(), {{amplitude, 0.1}, {"seed", 5}});
    const Problem other = generate(GetParam(), {{amplitude, 0.1}, {"seed", 6}});
    EXPECT_TRUE(same(first.H, again.H) && same(first.D, again.D) && same(first.E, again.E));
    EXPECT_EQ(first.a, again.a);
    EXPECT_EQ(first.b, again.b);
    EXPECT_NE(first.a, other.a);
}

// Each parameter's default lies in its range, and both ends of the range are the last values that are taken.
TEST_P(EveryKind, KeepsToTheRangesOfItsTable) {
    const auto table = generators();
    const auto found =
        std::find_if(table.begin(), table.end(), [](const Generator& kind) { return kind.name == GetParam(); });
    ASSERT_NE(found, table.end());
    std::set<std::string_view> keys;
    for (const GeneratorParameter& parameter : found->parameters) {
        const std::string key(parameter.key);
        EXPECT_TRUE(keys.insert(parameter.key).second) << key << " appears twice";
        EXPECT_FALSE(parameter.doc.empty()) << key;
        EXPECT_LE(parameter.minimum, parameter.default_value) << key;
        EXPECT_GE(parameter.maximum, parameter.default_value) << key;
        const double below = parameter.minimum - (parameter.integer ? 1.0 : 1.0 + std::abs(parameter.minimum));
        EXPECT_NE(message_of(GetParam(), {{key, below}}).find(key), std::string::npos) << key;
        const double above = parameter.maximum + (parameter.integer ? 2.0 : 1.0 + std::abs(parameter.maximum));
        EXPECT_NE(message_of(GetParam(), {{key, above}}).find("outside"), std::string::npos) << key;
        EXPECT_NE(message_of(GetParam(), {{key, std::nan("")}}).find("outside"), std::string::npos) << key;
        if (parameter.integer && parameter.maximum > parameter.minimum) {
            EXPECT_NE(message_of(GetParam(), {{key, parameter.minimum + 0.5}}).find("whole number"), std::string::npos)
                << key;
        }
    }
}

std::vector<std::string> kinds() {
    std::vector<std::string> names;
    for (const Generator& kind : generators()) names.emplace_back(kind.name);
    return names;
}

INSTANTIATE_TEST_SUITE_P(Kinds, EveryKind, ::testing::ValuesIn(kinds()), [](const auto& param) { return param.param; });

TEST(Generate, NamesTheNearest) {
    EXPECT_NE(message_of("chian", {}).find("\"chain\""), std::string::npos);
    EXPECT_NE(message_of("chain", {{"mass_ration", 1.0}}).find("\"mass_ratio\""), std::string::npos);
    EXPECT_EQ(message_of("chain", {}), "");
}

TEST(Generate, RefusesContradictionsAndSizesOutOfReach) {
    EXPECT_NE(message_of("chain", {{"closed", 1}, {"planar", 1}, {"revolute", 1}, {"drift", 0.1}}), "");
    EXPECT_NE(message_of("net", {{"diagonals", 2}, {"drift", 0.1}}), "");
    EXPECT_NE(message_of("box_stack", {{"towers", 1e6}, {"boxes", 1e6}}).find("1e+12 boxes"), std::string::npos);
    EXPECT_NE(message_of("elastic_block", {{"elements", 1000}, {"layers", 1000}}).find("nodes"), std::string::npos);
    EXPECT_NE(message_of("brick_wall", {{"courses", 1e5}, {"columns", 1e5}}).find("bricks"), std::string::npos);
    EXPECT_NE(message_of("net", {{"rows", 1e5}, {"columns", 1e5}}).find("nodes"), std::string::npos);
}

TEST(Generate, RefusesAStructOutOfRange) {
    ChainParameters parameters;
    parameters.bodies = 0;
    EXPECT_THROW((void)generate_chain(parameters), InputError);
    parameters.bodies = 2;
    parameters.step = std::nan("");
    EXPECT_THROW((void)generate_chain(parameters), InputError);
}

// Ten times the contacts: ten times the entries, within the share of the base's edges, for each family of contacts.
TEST(Generate, GrowsLinearly) {
    const auto entries = [](const Problem& p) { return static_cast<double>(p.D.entries() + p.H.entries()); };
    const Problem small = generate("sphere_pile", {{"contacts", 10000}});
    const Problem large = generate("sphere_pile", {{"contacts", 100000}});
    EXPECT_NEAR(entries(large) / entries(small), 10.0, 1.5);
    EXPECT_NEAR(entries(generate("box_stack", {{"boxes", 1000}})) / entries(generate("box_stack", {{"boxes", 100}})),
                10, 0.1);
    EXPECT_NEAR(entries(generate("chain", {{"bodies", 10000}})) / entries(generate("chain", {{"bodies", 1000}})), 10,
                0.1);
}

TEST(Glued, TurnsEveryContactIntoConsistentFreeRows) {
    const Problem pile = generate("motors", {{"gap", 0.01}, {"speed", 1.0}});
    const Problem stuck = glued(pile);
    EXPECT_NO_THROW(validate(stuck));
    EXPECT_EQ(stuck.m(), pile.m());
    ASSERT_EQ(stuck.cones.size(), pile.cones.size());
    std::size_t row = 0;
    for (std::size_t c = 0; c < stuck.cones.size(); ++c) {
        EXPECT_EQ(stuck.cones[c].kind, ConeKind::Free);
        EXPECT_TRUE(stuck.cones[c].lo.empty());
        EXPECT_EQ(stuck.cones[c].parameters[0], 0.0);
        EXPECT_EQ(stuck.cones[c].rows, pile.cones[c].rows);
        for (std::int32_t i = 0; i < stuck.cones[c].rows; ++i, ++row) {
            EXPECT_EQ(stuck.b[row], pile.cones[c].kind == ConeKind::Free ? pile.b[row] : 0.0);
        }
    }
}

TEST(Glued, RefusesAReducedProblem) {
    Problem reduced;
    reduced.E = SparseMatrix::from_triplets(1, 1, {{0, 0, 1.0}});
    reduced.b = {1.0};
    reduced.cones = {Cone::nonnegative(1)};
    EXPECT_THROW((void)glued(reduced), InputError);
}

}  // namespace
}  // namespace delassus::generate_test
