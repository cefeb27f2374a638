// SPDX-License-Identifier: BSD-3-Clause
// Piles that each process makes its own part of, and problems that are moved among processes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "delassus/error.hpp"
#include "delassus/generate_partitioned.hpp"
#include "delassus/repartition.hpp"
#include "support/problem_equality.hpp"

namespace delassus::partitioned_generate_test {
namespace {

using tests::expect_same;

class Generated : public testing::Test {
protected:
    std::shared_ptr<const Communicator> run = communicator_of_run();
};

PileParameters odd_pile() {
    PileParameters parameters;
    parameters.contacts = 3456;
    parameters.layers = 5;
    parameters.jitter = 0.06;
    parameters.speed = 0.37;
    parameters.seed = 12345;
    return parameters;
}

TEST_F(Generated, TheSameForAnyNumberOfProcesses) {
    for (const bool walls : {true, false}) {
        for (const double mu : {0.43, 0.0}) {
            PileParameters parameters = odd_pile();
            parameters.walls = walls;
            parameters.mu = mu;
            const PartitionedProblem part = generate_partitioned(*run, parameters);
            validate(*run, part);
            expect_same(gathered(*run, part), generate_pile(parameters));
        }
    }
    PileParameters other = odd_pile();
    other.seed = 12346;
    EXPECT_NE(generate_pile(other).a, generate_pile(odd_pile()).a);
}

// Against plain geometry: spheres in all pairs.
TEST_F(Generated, HasTheContactsOfItsSpheres) {
    PileParameters parameters;
    parameters.contacts = 300;
    parameters.layers = 4;
    parameters.walls = false;
    const Problem pile = generate_pile(parameters);
    const Problem same = generate("sphere_pile", {{"contacts", 300}, {"layers", 4}, {"pyramid", 0}});
    // The strips of the two families are chosen alike, so that they hold the same bodies and contacts.
    EXPECT_EQ(pile.n(), same.n());
    EXPECT_EQ(pile.m(), same.m());
    EXPECT_EQ(pile.cones.size(), same.cones.size());
    EXPECT_EQ(pile.H.value[0], same.H.value[0]);
    // D Dᵀ has the trace of unit normals and tangents, and arms of one radius.
    const auto trace = [](const Problem& problem) {
        return std::inner_product(problem.D.value.begin(), problem.D.value.end(), problem.D.value.begin(), 0.0);
    };
    EXPECT_NEAR(trace(pile), trace(same), 1e-9 * trace(same));
    // A rigid motion of all spheres and the floor makes no relative velocity between spheres: rows of pairs times equal
    // velocities vanish.
    for (std::int32_t row = 0; row < pile.m(); ++row) {
        const auto first = static_cast<std::size_t>(pile.D.row_start[static_cast<std::size_t>(row)]),
                   last = static_cast<std::size_t>(pile.D.row_start[static_cast<std::size_t>(row) + 1]);
        std::set<std::int32_t> bodies;
        double sum = 0.0;
        for (auto k = first; k < last; ++k) {
            bodies.insert(pile.D.column[k] / 6);
            if (pile.D.column[k] % 6 < 3) sum += pile.D.value[k] * (1.0 + pile.D.column[k] % 6);
        }
        if (bodies.size() == 2) {
            EXPECT_NEAR(sum, 0.0, 1e-14) << row;
        }
    }
}

TEST_F(Generated, RangesAreCompact) {
    PileParameters parameters;
    parameters.contacts = 60000;
    parameters.layers = 20;
    const PartitionedProblem part = generate_partitioned(*run, parameters);
    const PartitionQuality quality = measure_partition(*run, part);
    EXPECT_GE(quality.cones, 60000);
    EXPECT_LT(quality.imbalance, 1.15);
    if (run->size() == 1) {
        EXPECT_EQ(quality.cut_cones, 0);
    } else {
        // About 10 000 spheres: a plane through them has some 450, each with some 4 contacts across it.
        EXPECT_GT(quality.cut_cones, 0);
        EXPECT_LT(static_cast<double>(quality.cut_cones), 3000.0 * std::cbrt(run->size()));
    }
    EXPECT_EQ(chosen_partitioning(*run, part), Partitioning::FileOrder);
}

TEST_F(Generated, TextsGiveParameters) {
    const PileParameters parameters = pile_parameters("pile:contacts=1000000,seed=7,walls=0,mu=0.25");
    EXPECT_EQ(parameters.contacts, 1'000'000u);
    EXPECT_EQ(parameters.seed, 7u);
    EXPECT_FALSE(parameters.walls);
    EXPECT_EQ(parameters.mu, 0.25);
    EXPECT_EQ(to_text(parameters), "pile:contacts=1000000,walls=0,mu=0.25,seed=7");
    EXPECT_EQ(to_text(pile_parameters("pile")), "pile");
    EXPECT_TRUE(is_generated_problem("pile:contacts=5"));
    EXPECT_FALSE(is_generated_problem("pile.h5"));
    const auto sentence = [](const char* text) {
        return tests::sentence_of<InputError>([&] { static_cast<void>(pile_parameters(text)); });
    };
    EXPECT_NE(sentence("pile:contact=5").find("contacts"), std::string::npos);
    EXPECT_NE(sentence("pile:contacts=many").find("it must be a number"), std::string::npos);
    EXPECT_NE(sentence("pile:contacts=1.5").find("whole number"), std::string::npos);
    EXPECT_NE(sentence("pile:layers=0").find("outside its range"), std::string::npos);
    EXPECT_NE(sentence("heap").find("no generated problem"), std::string::npos);
}

/// Puts the moved problem back by its origins and compares it with the whole one.
void expect_moved(const Communicator& run, const PartitionedProblem& moved_part, const Problem& whole) {
    validate(run, moved_part);
    const auto all_of = [&](const std::vector<std::int64_t>& own) {
        std::vector<std::byte> bytes(own.size() * sizeof(std::int64_t));
        if (!own.empty()) std::memcpy(bytes.data(), own.data(), bytes.size());
        std::vector<std::int64_t> all;
        for (const auto& from :
             run.exchange(std::vector<std::vector<std::byte>>(static_cast<std::size_t>(run.size()), bytes))) {
            const auto before = all.size();
            all.resize(before + from.size() / sizeof(std::int64_t));
            if (!from.empty()) std::memcpy(all.data() + before, from.data(), from.size());
        }
        return all;
    };
    const auto column = all_of(moved_part.column_origin), row = all_of(moved_part.row_origin);
    const Problem now = gathered(run, moved_part);
    ASSERT_EQ(column.size(), static_cast<std::size_t>(whole.n()));
    ASSERT_EQ(row.size(), static_cast<std::size_t>(whole.m()));
    const auto back = [](const SparseMatrix& matrix, const std::vector<std::int64_t>& rows,
                         const std::vector<std::int64_t>& columns) {
        std::vector<Triplet> triplets;
        for (std::int32_t i = 0; i < matrix.rows; ++i)
            for (auto k = matrix.row_start[static_cast<std::size_t>(i)];
                 k < matrix.row_start[static_cast<std::size_t>(i) + 1]; ++k)
                triplets.push_back({static_cast<std::int32_t>(rows[static_cast<std::size_t>(i)]),
                                    static_cast<std::int32_t>(
                                        columns[static_cast<std::size_t>(matrix.column[static_cast<std::size_t>(k)])]),
                                    matrix.value[static_cast<std::size_t>(k)]});
        return SparseMatrix::from_triplets(matrix.rows, matrix.columns, std::move(triplets));
    };
    expect_same(back(now.H, column, column), whole.H, "H");
    expect_same(back(now.D, row, column), whole.D, "D");
    if (whole.E.entries() > 0) expect_same(back(now.E, row, row), whole.E, "E");
    std::vector<std::int64_t> first_row = {0};
    for (const Cone& cone : whole.cones) first_row.push_back(first_row.back() + cone.rows);
    for (std::size_t k = 0; k < column.size(); ++k) EXPECT_EQ(now.a[k], whole.a[static_cast<std::size_t>(column[k])]);
    std::size_t at = 0;
    for (const Cone& cone : now.cones) {
        const auto there = std::lower_bound(first_row.begin(), first_row.end(), row[at]) - first_row.begin();
        ASSERT_EQ(first_row[static_cast<std::size_t>(there)], row[at]);
        const Cone& was = whole.cones[static_cast<std::size_t>(there)];
        EXPECT_EQ(cone.kind, was.kind);
        EXPECT_EQ(cone.parameters, was.parameters);
        EXPECT_EQ(cone.lo, was.lo);
        EXPECT_EQ(cone.hi, was.hi);
        for (std::int32_t i = 0; i < cone.rows; ++i, ++at) {
            EXPECT_EQ(row[at], first_row[static_cast<std::size_t>(there)] + i);
            EXPECT_EQ(now.b[at], whole.b[static_cast<std::size_t>(row[at])]);
        }
    }
}

TEST_F(Generated, AMovedProblemIsTheSame) {
    std::vector<Problem> problems = {generate("motors", {}), generate("elastic_block", {}), generate("box_stack", {}),
                                     generate_pile(odd_pile())};
    for (const Problem& whole : problems) {
        SCOPED_TRACE(whole.name);
        const PartitionedProblem part = part_of(*run, whole);
        std::vector<std::int32_t> target;
        for (const auto body : bodies_of(*run, part))
            target.push_back(static_cast<std::int32_t>((body * 7 + body / 5) % run->size()));
        const PartitionedProblem once = moved(*run, part, target);
        expect_moved(*run, once, whole);
        // Twice: the origins are still those of the beginning.
        target.clear();
        for (const auto body : bodies_of(*run, once))
            target.push_back(static_cast<std::int32_t>((body * 3 + 1) % run->size()));
        expect_moved(*run, moved(*run, once, target), whole);
    }
    const PartitionedProblem part = part_of(*run, problems[0]);
    tests::sentence_of<InputError>([&] { static_cast<void>(moved(*run, part, {99})); });
}

#ifdef DELASSUS_HAS_SCOTCH
TEST_F(Generated, ScotchCutsFewerContactsThanAnArbitraryOrder) {
    PileParameters parameters;
    parameters.contacts = 20000;
    const PartitionedProblem part = generate_partitioned(*run, parameters);
    const Problem whole = generate_pile(parameters);
    std::vector<std::int32_t> target;
    for (const auto body : part.body_start)
        target.push_back(static_cast<std::int32_t>((static_cast<std::uint64_t>(body) * 0x9e3779b97f4a7c15u >> 40) %
                                                   static_cast<std::uint64_t>(run->size())));
    const PartitionedProblem scattered = moved(*run, part, target);
    if (run->size() == 1) {
        EXPECT_EQ(chosen_partitioning(*run, scattered), Partitioning::FileOrder);
        return;
    }
    EXPECT_EQ(chosen_partitioning(*run, scattered), Partitioning::Scotch);
    const PartitionQuality bad = measure_partition(*run, scattered), plain = measure_partition(*run, part);
    const PartitionedProblem better = repartition(*run, scattered);
    const PartitionQuality good = measure_partition(*run, better);
    if (run->rank() == 0)
        std::printf("cut: scattered %lld, Scotch %lld, by boxes %lld of %lld; imbalance %.3f; ghosts %lld\n",
                    static_cast<long long>(bad.cut_cones), static_cast<long long>(good.cut_cones),
                    static_cast<long long>(plain.cut_cones), static_cast<long long>(good.cones), good.imbalance,
                    static_cast<long long>(good.ghosts));
    EXPECT_LT(3 * good.cut_cones, bad.cut_cones);
    EXPECT_LT(good.cut_cones, 2 * plain.cut_cones);
    EXPECT_LT(good.imbalance, 1.15);
    expect_moved(*run, better, whole);
    // A problem whose H couples bodies.
    const Problem block = generate("elastic_block", {});
    expect_moved(*run, repartition(*run, part_of(*run, block), Partitioning::Scotch), block);
}
#endif

}  // namespace
}  // namespace delassus::partitioned_generate_test
