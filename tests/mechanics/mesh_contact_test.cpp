// SPDX-License-Identifier: BSD-3-Clause
// Contacts between elastic meshes: which there are, their rows against differences of their gaps, and their names.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "delassus/error.hpp"
#include "delassus/multibody.hpp"

namespace delassus::mesh_contact_test {
namespace {

constexpr double radius = 0.002;

ElasticBlock block(const Vector3& corner, const Vector3& edges, const std::array<std::int32_t, 3>& cells, int order) {
    ElasticBlock result;
    result.corner = corner;
    result.edges = edges;
    result.cells = cells;
    result.order = static_cast<ElementOrder>(order);
    result.contact_radius = radius;
    result.contact_material = 0;
    return result;
}

struct Blocks {
    MultibodySystem system;
    UnilateralRows rows;

    explicit Blocks(const std::vector<ElasticBlock>& blocks, double friction = 0.3) {
        system.add_material({friction, 0.0});
        for (const auto& one : blocks) system.add_elastic_block(one);
        system.set_gravity({0.0, 0.0, 0.0});
        system.set_envelope(1e-3);
        system.finish();
    }
    const UnilateralRows& collect(const State& state, double h = 0.0) {
        system.collect_unilateral(state, h, rows);
        return rows;
    }
    /// D v of a row.
    double speed(std::size_t row, const std::vector<double>& v) const {
        double sum = 0.0;
        for (auto e = rows.row_start()[row]; e < rows.row_start()[row + 1]; ++e)
            sum += rows.value()[static_cast<std::size_t>(e)] *
                   v[static_cast<std::size_t>(rows.column()[static_cast<std::size_t>(e)])];
        return sum;
    }
};

/// One on the other, at the distance of both radii.
std::vector<ElasticBlock> pile(std::int32_t below, std::int32_t above, int order) {
    return {block({0.0, 0.0, 0.0}, {0.2, 0.2, 0.1}, {below, below, 1}, order),
            block({0.0, 0.0, 0.1 + 2 * radius}, {0.2, 0.2, 0.1}, {above, above, 1}, order)};
}

TEST(MeshContact, OfNodesThatMeetEachPairIsOneContact) {
    for (const int order : {1, 2}) {
        Blocks blocks(pile(3, 3, order));
        const auto& rows = blocks.collect(blocks.system.initial_state());
        const std::size_t along = static_cast<std::size_t>(3 * order + 1);
        ASSERT_EQ(rows.contacts().size(), along * along) << order;
        ASSERT_EQ(rows.blocks().size(), along * along);
        std::set<std::uint64_t> keys;
        for (std::size_t k = 0; k < rows.contacts().size(); ++k) {
            const auto& contact = rows.contacts()[k];
            EXPECT_NEAR(contact.gap, 0.0, 1e-15);
            EXPECT_NEAR(std::abs(contact.normal[2]), 1.0, 1e-15);
            EXPECT_NEAR(contact.point_a[2], 0.1 + radius, 1e-15);
            EXPECT_NEAR(contact.point_b[2], 0.1 + radius, 1e-15);
            EXPECT_LT(contact.shape_a, contact.shape_b);
            EXPECT_EQ(rows.blocks()[k].cone.kind, ConeKind::Friction);
            keys.insert(rows.blocks()[k].key);
        }
        EXPECT_EQ(keys.size(), rows.contacts().size()) << "each has a name of its own";
    }
}

TEST(MeshContact, OfMeshesThatDoNotMatchAllNodesTouch) {
    Blocks linear(pile(2, 3, 1));
    EXPECT_EQ(linear.collect(linear.system.initial_state()).contacts().size(), 9U + 16U - 4U) << "corners meet";
    Blocks quadratic(pile(2, 3, 2));
    // 25 and 49 nodes, of which 9 meet, and the middles of 8 and 18 sides, of which none has edges that all meet.
    EXPECT_EQ(quadratic.collect(quadratic.system.initial_state()).contacts().size(), 25U + 49U - 9U + 8U + 18U);
}

TEST(MeshContact, WithoutFrictionHasOneRow) {
    Blocks blocks(pile(1, 1, 1), 0.0);
    const auto& rows = blocks.collect(blocks.system.initial_state());
    ASSERT_EQ(rows.blocks().size(), 4U);
    for (const auto& one : rows.blocks()) EXPECT_EQ(one.cone.rows, 1);
}

// The gap as a function of the positions has the normal row as its derivative, whatever feature it is between; and
// no row feels a translation. Two blocks turned against each other so that vertices, middles of sides and edges meet;
// nodes moved at random, so that sides are curved.
TEST(MeshContact, RowsAreDerivativesOfGaps) {
    std::mt19937 engine(5);
    std::uniform_real_distribution<double> noise(-1.0, 1.0);
    for (const int order : {1, 2}) {
        std::map<std::uint64_t, int> seen;
        for (int trial = 0; trial < 6; ++trial) {
            // The upper one lies across the lower one, a little shifted: rims cross.
            Blocks blocks({block({-0.2, -0.05, 0.0}, {0.4, 0.1, 0.05}, {4, 2, 1}, order),
                           block({-0.0612345, -0.2, 0.05 + 2 * radius}, {0.1, 0.4, 0.05}, {2, 3, 1}, order)});
            State state = blocks.system.initial_state();
            for (double& q : state.q) q += 2e-4 * noise(engine);
            std::vector<double> way(state.q.size());
            for (double& one : way) one = noise(engine);
            const auto gaps = [&](double share) {
                State moved = state;
                for (std::size_t i = 0; i < way.size(); ++i) moved.q[i] += share * way[i];
                std::map<std::uint64_t, double> result;
                blocks.collect(moved);
                for (std::size_t k = 0; k < blocks.rows.contacts().size(); ++k)
                    result[blocks.rows.blocks()[k].key] = blocks.rows.contacts()[k].gap;
                return result;
            };
            const double step = 1e-7;
            const auto before = gaps(-step), after = gaps(step);
            blocks.collect(state);
            std::size_t row = 0, compared = 0, exact = 0, of_edges = 0;
            const std::vector<double> shift(way.size(), 1.0);
            for (const auto& one : blocks.rows.blocks()) {
                for (std::size_t i = row; i < row + 3; ++i) EXPECT_NEAR(blocks.speed(i, shift), 0.0, 1e-12);
                const auto b = before.find(one.key), a = after.find(one.key);
                if (b != before.end() && a != after.end()) {
                    // On curved sides the normal is exact inside; at borders, ridges and crossings it is of the chords.
                    const double error = std::abs(blocks.speed(row, way) - (a->second - b->second) / (2.0 * step));
                    EXPECT_LT(error, order == 2 ? 3e-2 : 1e-5) << one.key;
                    const bool edges = one.key >> 60 == 9;
                    of_edges += edges ? 1U : 0U;
                    exact += !edges && error < 1e-5 ? 1U : 0U;
                    ++compared;
                    ++seen[one.key >> 60];
                }
                row += 3;
            }
            EXPECT_GT(compared, 3U);
            EXPECT_GT(2 * exact, compared - of_edges);
        }
        EXPECT_EQ(seen.size(), order == 2 ? 3U : 2U) << "vertices, edges, and with quadratic elements sides";
    }
}

// Where a face slides over another, its nodes pass over the borders of triangles. They keep their names and the normal
// of the plane.
TEST(MeshContact, NodesKeepTheirNamesWhileTheySlide) {
    for (const int order : {1, 2}) {
        Blocks blocks({block({0.0, 0.0, 0.0}, {0.6, 0.2, 0.1}, {6, 2, 1}, order),
                       block({0.0512345, 0.0512345, 0.1 + 2 * radius}, {0.1, 0.1, 0.1}, {2, 2, 1}, order)});
        State state = blocks.system.initial_state();
        std::set<std::uint64_t> nodes;  // of the upper block: they touch all the time
        const auto nodes_of_upper = [&] {
            std::set<std::uint64_t> result;
            for (std::size_t k = 0; k < blocks.rows.contacts().size(); ++k) {
                const auto& contact = blocks.rows.contacts()[k];
                EXPECT_NEAR(std::abs(contact.normal[2]), 1.0, 1e-12);
                EXPECT_GT(contact.gap, -1e-12) << "nodes below that are just beyond the rim have a gap";
                if (contact.normal[2] > 0.0 || blocks.rows.blocks()[k].key >> 60 != 7) continue;
                EXPECT_LT(contact.gap, 1e-12);
                result.insert(blocks.rows.blocks()[k].key);
            }
            return result;
        };
        const auto upper_begin = state.q.size() - 3U * (order == 1 ? 3U * 3U * 2U : 5U * 5U * 3U);
        for (int k = 0; k < 200; ++k) {
            blocks.collect(state);
            const auto now = nodes_of_upper();
            if (k == 0) {
                nodes = now;
                EXPECT_EQ(nodes.size(), order == 1 ? 9U : 25U);
            }
            EXPECT_EQ(now, nodes) << "after " << k << " shifts";
            for (std::size_t i = upper_begin; i < state.q.size(); i += 3) {
                state.q[i] += 0.0017;
                state.q[i + 1] += 0.0002;
            }
        }
    }
}

// The upper block is a little wider: its rim hangs over, and is not pushed outward by the rim below.
TEST(MeshContact, ARimThatHangsOverIsNotPushedOutward) {
    for (const int order : {1, 2})
        for (const double over : {1e-9, 1e-6, 1e-4, 1e-3, 1e-2}) {
            Blocks blocks(
                {block({0.0, 0.0, 0.0}, {0.2, 0.2, 0.1}, {2, 2, 1}, order),
                 block({-over, -over, 0.1 + 2 * radius}, {0.2 + 2 * over, 0.2 + 2 * over, 0.1}, {3, 3, 1}, order)});
            const auto& rows = blocks.collect(blocks.system.initial_state());
            std::size_t corners = 0;
            for (const auto& contact : rows.contacts()) {
                EXPECT_NEAR(std::abs(contact.normal[2]), 1.0, 1e-9) << over;
                for (const double x : {0.0, 0.2})
                    for (const double y : {0.0, 0.2})
                        if (std::hypot(contact.point_a[0] - x, contact.point_a[1] - y) < 1e-6) ++corners;
            }
            EXPECT_EQ(corners, 4U) << "the corners of the lower block carry, each once: " << over;
        }
}

TEST(MeshContact, IsFoundOnTheWay) {
    auto blocks = pile(1, 1, 1);
    blocks[1].corner[2] += 0.5;
    blocks[1].corner[0] += 0.0512345;
    blocks[1].velocity = {0.0, 0.0, -100.0};
    Blocks system(blocks);
    const State state = system.system.initial_state();
    EXPECT_TRUE(system.collect(state, 0.0049).contacts().empty());
    const auto& contacts = system.collect(state, 0.0051).contacts();
    ASSERT_FALSE(contacts.empty());
    for (const auto& contact : contacts) {
        EXPECT_NEAR(contact.gap, 0.5, 1e-12);
        EXPECT_NEAR(std::abs(contact.normal[2]), 1.0, 1e-12);
    }
    // One that flies past.
    blocks[1].velocity = {100.0, 0.0, -100.0};
    Blocks past(blocks);
    EXPECT_TRUE(past.collect(past.system.initial_state(), 0.0051).contacts().empty());
}

// It begins a millimetre above the plane of the lower block and 50 mm beside it, and comes over it within the step.
TEST(MeshContact, IsFoundWhereANodeComesOverAFaceWithinTheStep) {
    auto blocks = pile(1, 1, 1);
    blocks[1].corner[0] -= 0.25;
    blocks[1].corner[2] += 0.001;
    blocks[1].velocity = {100.0, 0.0, -1.0};
    Blocks system(blocks);
    const auto& contacts = system.collect(system.system.initial_state(), 0.0015).contacts();
    ASSERT_FALSE(contacts.empty());
    for (const auto& contact : contacts) {
        EXPECT_NEAR(contact.gap, 0.001, 1e-12);
        EXPECT_NEAR(std::abs(contact.normal[2]), 1.0, 1e-12);
    }
}

TEST(MeshContact, MeshesThatOneBodyCarriesDoNotTouchWhereItHoldsThem) {
    for (const bool fixed : {true, false}) {
        MultibodySystem system;
        system.add_material({0.3, 0.0});
        BodyParameters body;
        body.name = "hub";
        body.fixed = fixed;
        const auto hub = system.add_body(body);
        std::vector<std::int32_t> nodes;
        for (const auto& one : pile(1, 1, 1)) {
            const auto first = system.add_elastic_block(one);
            for (auto node = first; node < system.node_count(); ++node)
                if (one.corner[2] == 0.0 || node % 2 == 0) nodes.push_back(node);
        }
        AttachmentParameters attachment;
        attachment.name = "glue";
        attachment.body = hub;
        attachment.nodes = nodes;
        system.add_attachment(attachment);
        system.finish();
        ASSERT_TRUE(system.detects_contacts());
        UnilateralRows rows;
        system.collect_unilateral(system.initial_state(), 1e-3, rows);
        EXPECT_TRUE(rows.contacts().empty()) << fixed;
    }
}

TEST(MeshContact, NamesItsNodeAndTheFirstNodeOfTheOtherMesh) {
    Blocks blocks({block({0.0, 0.0, 0.0}, {0.2, 0.2, 0.1}, {1, 1, 1}, 1),
                   block({0.05, 0.06, 0.1 + 2 * radius}, {0.1, 0.1, 0.1}, {1, 1, 1}, 1)});
    const auto& rows = blocks.collect(blocks.system.initial_state());
    // Its four nodes, and where its rim crosses the diagonal of the face below.
    ASSERT_EQ(rows.contacts().size(), 6U);
    for (std::size_t k = 0; k < 6; ++k) {
        const auto [first, second] = blocks.system.contact_bodies(rows.contacts()[k]);
        if (k < 4) {
            EXPECT_GE(first, 8) << "a node of the upper block";
            EXPECT_EQ(second, 0) << "the surface of the lower one";
        } else {
            EXPECT_EQ(first, 0);
            EXPECT_EQ(second, 8);
        }
    }
}

TEST(MeshContact, OneMeshAloneLooksForNone) {
    Blocks blocks({block({0.0, 0.0, 0.0}, {0.2, 0.2, 0.1}, {1, 1, 1}, 1)});
    EXPECT_FALSE(blocks.system.detects_contacts());
    EXPECT_FALSE(blocks.system.has_unilateral());
}

TEST(MeshContact, InitialVelocitiesOfChosenNodes) {
    MultibodySystem system;
    system.add_material({0.0, 0.0});
    auto one = block({0.0, 0.0, 0.0}, {0.2, 0.2, 0.1}, {1, 1, 1}, 1);
    one.fixed_faces[0] = true;
    const auto first = system.add_elastic_block(one);
    const auto nodes = system.nodes_in(first, system.node_count(), {{-1.0, -1.0, 0.05}, {1.0, 1.0, 1.0}});
    system.set_initial_velocity(nodes, {1.0, 2.0, 3.0});
    EXPECT_THROW(system.set_initial_velocity(system.nodes_in(first, 8, {{0, 0, 0}, {0, 1, 1}}), {1, 0, 0}), InputError);
    EXPECT_THROW(system.set_initial_velocity({8}, {1, 0, 0}), InputError);
    EXPECT_THROW(system.set_initial_velocity(nodes, {std::nan(""), 0, 0}), InputError);
    system.finish();
    const State state = system.initial_state();
    int moving = 0;
    for (std::int32_t node = 0; node < system.node_count(); ++node) {
        const auto column = system.node_column(node);
        if (column < 0) continue;
        const bool upper = system.node_position(state, node)[2] > 0.05;
        moving += upper ? 1 : 0;
        for (std::size_t i = 0; i < 3; ++i)
            EXPECT_EQ(state.v[static_cast<std::size_t>(column) + i], upper ? static_cast<double>(i) + 1.0 : 0.0);
    }
    EXPECT_EQ(moving, 2) << "those that are fixed stay";
}

}  // namespace
}  // namespace delassus::mesh_contact_test
