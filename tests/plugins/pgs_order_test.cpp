// SPDX-License-Identifier: BSD-3-Clause
// pgs: the orders in which a sweep visits its blocks, and the threads that share them.
#include <gtest/gtest.h>

#include <Eigen/SparseCore>
#include <algorithm>
#include <utility>

#include "../../plugins/pgs/model.hpp"
#include "delassus/errors.hpp"
#include "delassus/generate.hpp"
#include "delassus/sdk/residual.hpp"
#include "delassus/thread_team.hpp"

namespace delassus::pgs_test {
namespace {

/// What fell into a heap.
Problem pile(std::int32_t contacts) {
    SpherePileParameters parameters;
    parameters.contacts = contacts;
    parameters.speed = 0.5;
    return generate_sphere_pile(parameters);
}

/// A model of a problem, with λ and its errors after some sweeps both ways.
struct Swept {
    PreparedProblem prepared;
    pgs::Model model;
    sdk::DelassusOperator N;
    sdk::Vector lambda;
    double error = 0.0;

    Swept(Problem problem, pgs::Ordering ordering, bool on_velocities, int threads, pgs::Local local)
        : prepared(std::move(problem)) {
        const sdk::ProblemView view(prepared.raw());
        N.analyze(view);
        N.factorize(view);
        model.build(view, N, on_velocities, false, true, ordering);
        model.set_right_hand_side(view, N, delassus::sdk::block_scaling(view.cones, N.diagonal()));
        pgs::SweepState state;
        model.state_of(sdk::Vector::Zero(view.m), state);
        ThreadTeam members(threads);
        model.use(members.team());
        pgs::SweepRule rule;
        rule.local = local;
        rule.coulomb = view.coulomb;
        rule.omega = 1.2;
        for (int k = 0; k < 40; ++k) {
            rule.direction = k % 3 == 2 ? pgs::Direction::Backward : pgs::Direction::Forward;
            model.sweep_in_place(rule, state);
        }
        error = model.recorded_sweep(rule, state) + model.look(state, view.coulomb);
        model.renew(state);
        model.reactions(state, lambda);
        model.use({});
    }
};

TEST(PgsOrder, EveryBlockIsVisitedOnce) {
    for (const auto ordering : {pgs::Ordering::Given, pgs::Ordering::Spaced, pgs::Ordering::Coloured,
                                pgs::Ordering::Domains, pgs::Ordering::Auto}) {
        for (const bool on_velocities : {true, false}) {
            const Swept swept(pile(200), ordering, on_velocities, 1, pgs::Local::Diagonal);
            std::vector<std::int32_t> order = swept.model.order().block;
            std::sort(order.begin(), order.end());
            for (std::size_t k = 0; k < order.size(); ++k) ASSERT_EQ(order[k], static_cast<std::int32_t>(k));
            EXPECT_EQ(order.size(), swept.prepared.problem().cones.size());
            EXPECT_EQ(swept.model.order().piece.back(), order.size());
            EXPECT_EQ(swept.model.order().phase.back() + 1, swept.model.order().piece.size());
        }
    }
}

TEST(PgsOrder, PiecesOfOnePhaseDoNotTouch) {
    for (const auto ordering : {pgs::Ordering::Coloured, pgs::Ordering::Domains}) {
        const Swept swept(pile(5000), ordering, true, 1, pgs::Local::Diagonal);
        const auto& order = swept.model.order();
        ASSERT_GE(order.phases(), 2u);
        for (std::size_t f = 0; f < order.phases(); ++f) {
            std::vector<std::size_t> user(static_cast<std::size_t>(swept.prepared.problem().n()) + sdk::chunk_padding);
            for (std::size_t piece = order.phase[f]; piece < order.phase[f + 1]; ++piece)
                for (std::size_t k = order.piece[piece]; k < order.piece[piece + 1]; ++k) {
                    const auto& group = swept.model.rows().groups()[k];
                    for (int chunk = 0; chunk < group.chunks; ++chunk)
                        for (int j = 0; j < swept.model.rows().width(); ++j) {
                            auto& by = user[static_cast<std::size_t>(swept.model.rows().starts(group)[chunk] + j)];
                            EXPECT_TRUE(by == 0 || by == piece + 1);
                            by = piece + 1;
                        }
                }
        }
    }
}

// All phases but the last are colours; there the blocks without one may be.
TEST(PgsOrder, BlocksOfOneColourDoNotTouch) {
    const Swept swept(pile(200), pgs::Ordering::Coloured, true, 1, pgs::Local::Diagonal);
    const auto& order = swept.model.order();
    ASSERT_GT(order.phases(), 3u);
    EXPECT_GT(order.piece[order.phase[order.phases() - 1]], order.block.size() / 2);
    for (std::size_t f = 0; f + 1 < order.phases(); ++f) {
        std::vector<int> visits(static_cast<std::size_t>(swept.prepared.problem().n()) + sdk::chunk_padding);
        for (std::size_t k = order.piece[order.phase[f]]; k < order.piece[order.phase[f + 1]]; ++k) {
            const auto& group = swept.model.rows().groups()[k];
            for (int chunk = 0; chunk < group.chunks; ++chunk)
                for (int j = 0; j < swept.model.rows().width(); ++j)
                    EXPECT_EQ(++visits[static_cast<std::size_t>(swept.model.rows().starts(group)[chunk] + j)], 1);
        }
    }
}

TEST(PgsOrder, DomainsOfAHeapShareTheWork) {
    for (const auto& [contacts, domains] : {std::pair{1200, 2u}, std::pair{5000, 4u}}) {
        const Swept swept(pile(contacts), pgs::Ordering::Auto, true, 1, pgs::Local::Diagonal);
        const auto& order = swept.model.order();
        ASSERT_GE(order.phases(), 2u);
        ASSERT_EQ(order.phase[1], domains);
        std::size_t inside = order.piece[domains], longest = 0;
        for (std::size_t k = 0; k < domains; ++k) longest = std::max(longest, order.piece[k + 1] - order.piece[k]);
        EXPECT_GT(inside, order.block.size() * 2 / 3);
        EXPECT_LT(longest, 1.3 * static_cast<double>(inside) / domains);
    }
}

/// Blocks of three rows that touch the two bodies given.
sdk::BlockRows rows_between(const std::vector<std::pair<int, int>>& bodies, int count) {
    std::vector<Eigen::Triplet<double>> entries;
    std::vector<sdk::RowGroup> groups;
    for (const auto& [first, second] : bodies) {
        const auto row = static_cast<std::int32_t>(3 * groups.size());
        groups.push_back({row, 3});
        for (int i = 0; i < 3; ++i)
            for (const int body : {first, second})
                for (int j = 0; j < 6; ++j) entries.emplace_back(row + i, 6 * body + j, 1.0);
    }
    sdk::SparseRows matrix(3 * static_cast<Eigen::Index>(bodies.size()), 6 * count);
    matrix.setFromTriplets(entries.begin(), entries.end());
    return {matrix, groups, nullptr, nullptr};
}

TEST(PgsOrder, AChainIsCutWhereItIsThin) {
    std::vector<std::pair<int, int>> links;
    for (int k = 0; k < 3000; ++k) links.emplace_back((7 * k) % 3001, (7 * k + 7) % 3001);
    for (auto& [first, second] : links)
        if (first > second) std::swap(first, second);
    const auto domains = pgs::SweepDomains::of(rows_between(links, 3001));
    ASSERT_EQ(domains.inside.size(), 2u);
    EXPECT_EQ(domains.between[0].size(), 1u);
    EXPECT_TRUE(domains.rest.empty());
    EXPECT_NEAR(static_cast<double>(domains.inside[0].size()), 1500.0, 2.0);
}

TEST(PgsOrder, WhereAllTouchOneBodyNothingIsCut) {
    std::vector<std::pair<int, int>> spokes;
    for (int k = 1; k <= 1500; ++k) spokes.emplace_back(0, k);
    const auto domains = pgs::SweepDomains::of(rows_between(spokes, 1501));
    EXPECT_TRUE(domains.inside.empty());
    EXPECT_TRUE(domains.between.empty());
    ASSERT_EQ(domains.rest.size(), 1500u);
    for (std::int32_t k = 0; k < 1500; ++k) EXPECT_EQ(domains.rest[static_cast<std::size_t>(k)], k);
}

TEST(PgsOrder, SpacedNeighboursRarelyShareABody) {
    const auto sharing = [](pgs::Ordering ordering) {
        const Swept swept(pile(200), ordering, true, 1, pgs::Local::Diagonal);
        int count = 0;
        const auto groups = swept.model.rows().groups();
        for (std::size_t k = 1; k < groups.size(); ++k)
            for (int i = 0; i < groups[k].chunks; ++i)
                for (int j = 0; j < groups[k - 1].chunks; ++j)
                    count += swept.model.rows().starts(groups[k])[i] == swept.model.rows().starts(groups[k - 1])[j];
        return count;
    };
    EXPECT_LT(10 * sharing(pgs::Ordering::Spaced), sharing(pgs::Ordering::Given));
}

TEST(PgsThreads, GiveTheSameBits) {
    for (const Law law : {Law::Associated, Law::Coulomb})
        for (const auto ordering : {pgs::Ordering::Coloured, pgs::Ordering::Domains})
            for (const auto local : {pgs::Local::Diagonal, pgs::Local::Exact})
                for (const bool on_velocities : {true, false}) {
                    Problem problem = pile(on_velocities ? 1500 : 200);
                    problem.law = law;
                    const Swept one(problem, ordering, on_velocities, 1, local);
                    ASSERT_GT(one.lambda.norm(), 0.0);
                    for (const int threads : {2, 4}) {
                        const Swept several(problem, ordering, on_velocities, threads, local);
                        EXPECT_EQ(one.lambda, several.lambda) << threads << " threads";
                        EXPECT_EQ(one.error, several.error) << threads << " threads";
                    }
                }
}

}  // namespace
}  // namespace delassus::pgs_test
