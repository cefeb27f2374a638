// SPDX-License-Identifier: BSD-3-Clause
// Structures that stand by friction and shape alone, bracketed within 3 % of where they fall.
//
// Both friction laws have the same limits here. Where the associated law slides it also opens the contact, by
// u_n = μ‖u_t‖; but whether a structure can stand is a question of reactions alone, and both laws have the same cone.
#include <algorithm>
#include <numbers>

#include "mechanics/contact_fixture.hpp"

namespace delassus::masonry_test {
namespace {

using tests::about_y;
using tests::g;

class MasonryTest : public tests::ContactTest {
protected:
    /// The largest speed of the body that is the fastest, after `end` in steps of h.
    double speed_after(double end, double h, Law law) {
        SolverConfig config;
        config.name = "pgs";
        config.tolerance = 1e-8;
        config.max_iterations = 200000;
        config.law = law;
        const State state = run(end, h, {}, config);
        double most = 0.0;
        for (const double v : state.v) most = std::max(most, std::abs(v));
        return most;
    }
};

// Two cards at the angle θ to the ground that lean on each other push one another with H, by their moments about their
// feet:  H L sin θ = ½ m g (L cos θ − d sin θ),  and the ground with m g. They stand where
//     μ ≥ H/(m g) = ½ (cot θ − d/L)
// for cards of the length L and the thickness d between the centres of their rounded edges; ½ cot θ for thin ones.
TEST_F(MasonryTest, CardsLeanWhereFrictionSuffices) {
    const double theta = std::numbers::pi / 3, half_length = 0.5, half_thickness = 0.005, margin = 0.0049;
    const double length = 2.0 * (half_length - margin), thickness = 2.0 * (half_thickness - margin);
    const double limit = 0.5 * (1.0 / std::tan(theta) - thickness / length);
    EXPECT_NEAR(limit, 0.5 / std::tan(theta), 1e-3 * limit);
    for (const Law law : {Law::Associated, Law::Coulomb})
        for (const double factor : {0.97, 1.03}) {
            start_anew();
            add_ground(0.0, factor * limit);
            const double x = margin + 0.5 * (length * std::cos(theta) + thickness * std::sin(theta));
            const double z = margin + 0.5 * (length * std::sin(theta) + thickness * std::cos(theta));
            for (const double side : {-1.0, 1.0}) {
                BodyParameters card;
                card.name = "card";
                card.inertia = Inertia::box(card.mass, {2 * half_length, 0.6, 2 * half_thickness});
                card.pose = {{side * x, 0.0, z}, about_y(side < 0.0 ? -theta : theta)};
                Shape shape;
                shape.kind = ShapeKind::Box;
                shape.size = {half_length, 0.3, half_thickness};
                shape.margin = margin;
                shape.body = system->add_body(card);
                system->add_shape(shape, 0);
            }
            system->finish();
            const double speed = speed_after(0.1, 5e-3, law);
            if (factor > 1.0) {
                EXPECT_LT(speed, 1e-6) << name_of(law);
            } else {
                EXPECT_GT(speed, 5e-3) << name_of(law);
            }
        }
}

/// A semicircular arch of the mean radius 1 m and an even number of stones between radial joints: hexahedra whose
/// vertices are on the joints, so that their upper and lower faces are chords.
struct Arch {
    int stones;
    double thickness;

    [[nodiscard]] double inner() const { return 1.0 - 0.5 * thickness; }
    [[nodiscard]] double outer() const { return 1.0 + 0.5 * thickness; }
    [[nodiscard]] double angle() const { return std::numbers::pi / stones; }  ///< of one stone
    /// Per metre of depth and unit of density.
    [[nodiscard]] double area() const { return 0.5 * (outer() * outer() - inner() * inner()) * std::sin(angle()); }
    /// Of a stone's centroid: of a trapezium with sides ∝ inner and outer, at the distances inner and outer × cos(½
    /// angle).
    [[nodiscard]] double centroid() const {
        const double i = inner(), o = outer();
        return std::cos(0.5 * angle()) * (i + (o - i) * (i + 2.0 * o) / (3.0 * (i + o)));
    }

    // Limit analysis (Heyman, The stone skeleton, 1966): it stands if some thrust keeps within all joints. Half of the
    // arch, from the joint at the crown, carries there the horizontal H at the radius P/H and has the weight W with the
    // moment W x about the centre. The joint at the angle φ from the crown is met at the radius
    //     r = (P + W x)/(H cos φ + W sin φ),     inner ≤ r ≤ outer.
    // Each joint bounds P from below and above, linearly in H: the gap between the bounds is concave in H.
    [[nodiscard]] bool stands() const {
        const auto room = [&](double H) {
            double low = inner() * H, high = outer() * H, W = 0.0, moment = 0.0;
            for (int k = 1; k <= stones / 2; ++k) {
                W += area();
                moment += area() * centroid() * std::sin((k - 0.5) * angle());
                const double normal = H * std::cos(k * angle()) + W * std::sin(k * angle());
                low = std::max(low, inner() * normal - moment);
                high = std::min(high, outer() * normal - moment);
            }
            return high - low;
        };
        double left = 0.0, right = stones * area();
        for (int k = 0; k < 100; ++k) {
            const double a = left + (right - left) / 3.0, b = right - (right - left) / 3.0;
            (room(a) < room(b) ? left : right) = room(a) < room(b) ? a : b;
        }
        return room(left) >= 0.0;
    }

    /// The least thickness with which it stands.
    static double limit(int stones) {
        double falls = 0.02, stands = 0.3;
        for (int k = 0; k < 50; ++k) {
            const double middle = 0.5 * (falls + stands);
            (Arch{stones, middle}.stands() ? stands : falls) = middle;
        }
        return stands;
    }
};

TEST_F(MasonryTest, ArchStandsAboveItsLeastThickness) {
    EXPECT_NEAR(Arch::limit(400), 0.1075, 1e-4) << "Milankovitch, 1907";
    const double limit = Arch::limit(10);
    EXPECT_NEAR(limit, 0.1070, 1e-4) << "the joints are not quite where hinges would form";
    for (const Law law : {Law::Associated, Law::Coulomb})
        for (const double factor : {0.97, 1.03}) {
            const Arch arch{10, factor * limit};
            start_anew();
            add_ground(0.0, 1.5);  // so much that nothing slides
            auto mesh = std::make_shared<Mesh>();
            const double half = 0.5 * arch.angle(), depth = 0.2;
            for (const double radius : {arch.inner(), arch.outer()})
                for (const double x : {-radius * std::sin(half), radius * std::sin(half)})
                    for (const double y : {-depth, depth})
                        mesh->vertices.push_back({x, y, radius * std::cos(half) - arch.centroid()});
            mesh->triangles = {{0, 1, 3}, {0, 3, 2}, {4, 6, 7}, {4, 7, 5}, {0, 4, 5}, {0, 5, 1},
                               {2, 3, 7}, {2, 7, 6}, {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};
            for (int k = 0; k < arch.stones; ++k) {
                const double phi = (k + 0.5) * arch.angle() - 0.5 * std::numbers::pi;
                BodyParameters stone;
                stone.name = "stone";
                stone.mass = 1000.0 * arch.area();
                stone.inertia = Inertia::box(stone.mass, {arch.angle(), 2.0 * depth, arch.thickness});
                stone.pose = {{arch.centroid() * std::sin(phi), 0.0, arch.centroid() * std::cos(phi)}, about_y(phi)};
                Shape shape;
                shape.kind = ShapeKind::Convex;
                shape.mesh = mesh;
                shape.body = system->add_body(stone);
                system->add_shape(shape, 0);
            }
            system->finish();
            const double speed = speed_after(0.1, 1e-2, law);
            if (factor > 1.0) {
                EXPECT_LT(speed, 1e-5) << name_of(law);
            } else {
                EXPECT_GT(speed, 1e-3) << name_of(law);
            }
        }
}

}  // namespace
}  // namespace delassus::masonry_test
