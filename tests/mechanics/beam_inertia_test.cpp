// SPDX-License-Identifier: BSD-3-Clause
// Beams with a consistent mass: derivatives, what is conserved, and frequencies.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

#include "delassus/error.hpp"
#include "delassus/joint_coordinates.hpp"
#include "delassus/multibody.hpp"
#include "support/system_derivatives.hpp"

namespace delassus::beam_inertia_test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using tests::dense;

constexpr double infinite = std::numeric_limits<double>::infinity();

MatrixXd matrix_of(const MultibodySystem& system, auto&& add) {
    MatrixAssembler assembler;
    assembler.begin(system.n(), system.n());
    add(assembler);
    return dense(assembler.finish());
}

/// Thick and soft, so that all parts of the inertia count.
ElasticBeamParameters thick_beam(int elements) {
    ElasticBeamParameters beam;
    beam.name = "beam";
    beam.from = {0.1, -0.2, 0.3};
    beam.to = {1.2, 0.5, 0.6};
    beam.elements = elements;
    beam.section_y = {0.1, 1.0, 0.3};
    beam.section = {0.7, 0.3, 0.5, 0.6, 1.1, 0.9};
    beam.material = {30.0, 0.3, 2.0, 0.0};
    beam.mass = BeamMass::Consistent;
    return beam;
}

/// Moved from the start by an increment of this amount, with velocities likewise.
State tumbled(const MultibodySystem& system, double amount, double speed) {
    State state = system.initial_state();
    VectorXd delta(system.n());
    for (int i = 0; i < delta.size(); ++i) {
        delta[i] = amount * std::sin(1.0 + 3.0 * i);
        state.v[static_cast<std::size_t>(i)] = speed * std::cos(2.0 + 5.0 * i);
    }
    return tests::moved(system, state, delta);
}

TEST(BeamInertia, HasTheDerivativesItClaims) {
    for (const bool clamped : {false, true})
        for (const double amount : {0.0, 1e-3, 0.2, 0.6})
            for (const double speed : {0.0, 1.5}) {
                MultibodySystem system;
                system.set_gravity({3.0, -5.0, 2.0});
                auto beam = thick_beam(2);
                beam.fixed_from = clamped;
                system.add_elastic_beam(beam);
                system.finish();
                const State state = tumbled(system, amount, speed);
                tests::expect_derivatives(system, state, VectorXd(), 1e-7, true);
                const VectorXd a = VectorXd::LinSpaced(system.n(), -2.0, 3.0);
                const auto momentum = [&](const State& at) {
                    VectorXd result = VectorXd::Zero(system.n());
                    system.multiply_mass(at, 1.0, a.data(), result.data());
                    return result;
                };
                tests::expect_near(
                    matrix_of(system,
                              [&](auto& H) { system.add_inertial_stiffness(state, a.data(), 1.0, Tangent::Exact, H); }),
                    tests::along_positions(system, state, momentum), 1e-7, "inertial stiffness");
            }
}

TEST(BeamInertia, ItsKineticEnergyIsThatOfItsMass) {
    MultibodySystem system;
    system.add_elastic_beam(thick_beam(3));
    system.finish();
    const State state = tumbled(system, 0.4, 1.0);
    const Eigen::Map<const VectorXd> v(state.v.data(), system.n());
    const MatrixXd M = matrix_of(system, [&](auto& H) { system.add_mass(state, 1.0, H); });
    EXPECT_NEAR(system.kinetic_energy(state), 0.5 * v.dot(M * v), 1e-12 * system.kinetic_energy(state));
    tests::expect_near(M, M.transpose(), 1e-14, "M is symmetric");
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatrixXd>(M).eigenvalues()[0], 0.0);
}

/// dE/dt and the rates of momentum and angular momentum along M v̇ = f, by central differences in time.
TEST(BeamInertia, ConservesEnergyAndMomentum) {
    for (const double weight : {0.0, 1.0}) {
        MultibodySystem system;
        system.set_gravity({0.0, 0.0, -9.81 * weight});
        system.add_elastic_beam(thick_beam(2));
        system.finish();
        for (const double amount : {0.0, 0.3, 0.7}) {
            const State state = tumbled(system, amount, 1.3);
            const MatrixXd M = matrix_of(system, [&](auto& H) { system.add_mass(state, 1.0, H); });
            VectorXd f = VectorXd::Zero(system.n());
            system.add_force(state, 1.0, f.data());
            const VectorXd acceleration = M.ldlt().solve(f);
            const auto after = [&](double time) {
                const Eigen::Map<const VectorXd> v(state.v.data(), system.n());
                // To the second order in time; ω̄ of the body frame stays what it is along exp(t ω̄).
                State at = tests::moved(system, state, time * v + 0.5 * time * time * acceleration);
                for (int i = 0; i < system.n(); ++i) at.v[static_cast<std::size_t>(i)] += time * acceleration[i];
                return at;
            };
            const double step = 1e-5, size = system.kinetic_energy(state) + 1.0;
            EXPECT_NEAR((system.energy(after(step)) - system.energy(after(-step))) / (2.0 * step), 0.0, 1e-7 * size);
            const auto before = system.momentum(after(-step)), later = system.momentum(after(step));
            const Vector3d mass_g(0.0, 0.0, -9.81 * weight * 2.0 * 0.7 * Vector3d(1.1, 0.7, 0.3).norm());
            for (std::size_t i = 0; i < 3; ++i) {
                const auto k = static_cast<Eigen::Index>(i);
                EXPECT_NEAR((later[0][i] - before[0][i]) / (2.0 * step), mass_g[k], 1e-7 * size) << amount;
                if (weight > 0.0) continue;
                EXPECT_NEAR((later[1][i] - before[1][i]) / (2.0 * step), 0.0, 1e-7 * size) << amount;
            }
        }
    }
}

TEST(BeamInertia, AUniformVelocityChangesNothing) {
    MultibodySystem system;
    system.set_gravity({1.0, -2.0, 3.0});
    system.add_elastic_beam(thick_beam(2));
    system.finish();
    const State state = tumbled(system, 0.5, 1.0);
    State fast = state;
    for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t i = 0; i < 3; ++i) fast.v[6 * k + i] += 100.0 * (1.0 + static_cast<double>(i));
    VectorXd f = VectorXd::Zero(system.n()), of_fast = f;
    system.add_force(state, 1.0, f.data());
    system.add_force(fast, 1.0, of_fast.data());
    EXPECT_LE((of_fast - f).norm(), 1e-10 * f.norm());
    const double mass = 2.0 * 0.7 * Vector3d(1.1, 0.7, 0.3).norm();
    const auto slow = system.momentum(state)[0], after = system.momentum(fast)[0];
    for (std::size_t i = 0; i < 3; ++i)
        EXPECT_NEAR(after[i] - slow[i], 100.0 * mass * (1.0 + static_cast<double>(i)), 1e-9);
}

TEST(BeamInertia, ABentBeamFallsAsWithoutWeight) {
    const auto accelerations = [](const Vector3& gravity) {
        MultibodySystem system;
        system.set_gravity(gravity);
        system.add_elastic_beam(thick_beam(2));
        system.finish();
        const State state = tumbled(system, 0.5, 1.0);
        const MatrixXd M = matrix_of(system, [&](auto& H) { system.add_mass(state, 1.0, H); });
        VectorXd f = VectorXd::Zero(system.n());
        system.add_force(state, 1.0, f.data());
        return VectorXd(M.ldlt().solve(f));
    };
    const VectorXd change = accelerations({1.0, -2.0, 3.0}) - accelerations({0.0, 0.0, 0.0});
    for (Eigen::Index k = 0; k < 3; ++k) {
        EXPECT_LE((change.segment<3>(6 * k) - Vector3d(1.0, -2.0, 3.0)).norm(), 1e-10);
        EXPECT_LE(change.segment<3>(6 * k + 3).norm(), 1e-10);
    }
}

TEST(BeamInertia, AStraightBeamFallsStraight) {
    MultibodySystem system;
    system.set_gravity({1.0, -2.0, 3.0});
    system.add_elastic_beam(thick_beam(3));
    system.finish();
    const State state = system.initial_state();
    const MatrixXd M = matrix_of(system, [&](auto& H) { system.add_mass(state, 1.0, H); });
    VectorXd f = VectorXd::Zero(system.n());
    system.add_force(state, 1.0, f.data());
    const VectorXd acceleration = M.ldlt().solve(f);
    for (Eigen::Index k = 0; k < 4; ++k) {
        EXPECT_LE((acceleration.segment<3>(6 * k) - Vector3d(1.0, -2.0, 3.0)).norm(), 1e-11);
        EXPECT_LE(acceleration.segment<3>(6 * k + 3).norm(), 1e-11);
    }
}

TEST(BeamInertia, ARigidBeamHasItsInertia) {
    // About its middle, across: ρ A L³/12 + ρ I L; along: ρ (I_y + I_z) L.
    for (const int elements : {1, 3}) {
        MultibodySystem system;
        ElasticBeamParameters beam = thick_beam(elements);
        beam.from = {-0.5, 0.0, 0.0};
        beam.to = {0.5, 0.0, 0.0};
        beam.section_y = {0.0, 1.0, 0.0};
        system.add_elastic_beam(beam);
        system.finish();
        const auto inertia = [&](const Vector3d& omega) {
            State state = system.initial_state();
            for (int k = 0; k <= elements; ++k) {
                const Vector3d x(-0.5 + static_cast<double>(k) / elements, 0.0, 0.0);
                Eigen::Map<Vector3d>(state.v.data() + 6 * k) = omega.cross(x);
                Eigen::Map<Vector3d>(state.v.data() + 6 * k + 3) = omega;
            }
            return 2.0 * system.kinetic_energy(state);
        };
        EXPECT_NEAR(inertia({1.0, 0.0, 0.0}), 2.0 * 0.8, 1e-12);
        EXPECT_NEAR(inertia({0.0, 1.0, 0.0}), 2.0 * 0.7 / 12.0 + 2.0 * 0.3, 1e-12);
        EXPECT_NEAR(inertia({0.0, 0.0, 1.0}), 2.0 * 0.7 / 12.0 + 2.0 * 0.5, 1e-12);
    }
}

// ---- Frequencies ----

/// Along x, E I_z/(ρ A) = 1 with the length 1, about y far stiffer.
ElasticBeamParameters slender_beam(int elements, BeamMass mass, double radius, double shear_area, bool clamped) {
    ElasticBeamParameters beam;
    beam.name = "beam";
    beam.elements = elements;
    beam.section_y = {0.0, 1.0, 0.0};
    const double inertia = radius * radius;  // A = 1
    beam.section = {1.0, 1e6 * inertia, inertia, 1e6 * inertia, shear_area, infinite};
    beam.material = {1.0 / inertia, 0.25, 1.0, 0.0};
    beam.mass = mass;
    beam.fixed_from = clamped;
    return beam;
}

/// The frequencies of bending in the plane of x and y, ascending, without rigid motions; 1/s.
VectorXd bending(const ElasticBeamParameters& beam) {
    MultibodySystem system;
    system.set_gravity({0.0, 0.0, 0.0});
    system.add_elastic_beam(beam);
    system.finish();
    const State state = system.initial_state();
    const MatrixXd K = matrix_of(system, [&](auto& H) { system.add_stiffness(state, 1.0, Tangent::Exact, H); });
    const MatrixXd M = matrix_of(system, [&](auto& H) { system.add_mass(state, 1.0, H); });
    const int bodies = system.n() / 6;
    MatrixXd k(2 * bodies, 2 * bodies), m(2 * bodies, 2 * bodies);
    const auto dof = [](int i) { return 6 * (i / 2) + (i % 2 == 0 ? 1 : 5); };
    for (int i = 0; i < 2 * bodies; ++i)
        for (int j = 0; j < 2 * bodies; ++j) {
            k(i, j) = K(dof(i), dof(j));
            m(i, j) = M(dof(i), dof(j));
        }
    const VectorXd squares =
        Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(0.5 * (k + k.transpose()), m, Eigen::EigenvaluesOnly)
            .eigenvalues();
    const int rigid = beam.fixed_from ? 0 : 2;
    return squares.tail(squares.size() - rigid).cwiseMax(0.0).cwiseSqrt();
}

/// Errors with n and 2n elements, and the order that they give.
struct Convergence {
    double coarse, fine;
    [[nodiscard]] double order() const { return std::log2(std::abs(coarse / fine)); }
};
Convergence convergence(int elements, BeamMass mass, double radius, double shear_area, bool clamped, int mode,
                        double exact) {
    const auto error = [&](int n) {
        return bending(slender_beam(n, mass, radius, shear_area, clamped))[mode] / exact - 1.0;
    };
    return {error(elements), error(2 * elements)};
}

TEST(BeamInertia, FrequenciesOfSlenderBeamsConvergeWithOrderFour) {
    // cos β cosh β = −1 and +1; a section of next to no inertia of its own.
    struct Case {
        bool clamped;
        double beta[3];
    };
    for (const Case& known : {Case{true, {1.875104068711961, 4.694091132974175, 7.854757438237613}},
                              Case{false, {4.730040744862704, 7.853204624095838, 10.995607838001671}}})
        for (int mode = 0; mode < 3; ++mode) {
            const double beta = known.beta[mode], exact = beta * beta;
            const int elements = mode == 0 && known.clamped ? 4 : 8;
            const auto consistent =
                convergence(elements, BeamMass::Consistent, 1e-4, infinite, known.clamped, mode, exact);
            EXPECT_NEAR(consistent.order(), 4.0, 0.2) << mode;
            EXPECT_GT(consistent.coarse, 0.0) << "from above";
            // (β h)⁴/1440, as of the cubic element.
            EXPECT_NEAR(consistent.fine / std::pow(beta / (2.0 * elements), 4) * 1440.0, 1.0, 0.2) << mode;
            const auto lumped = convergence(elements, BeamMass::Lumped, 1e-4, infinite, known.clamped, mode, exact);
            EXPECT_NEAR(lumped.order(), 2.0, 0.3) << mode;
            EXPECT_LT(lumped.coarse, 0.0);
            EXPECT_LT(consistent.coarse, 0.1 * std::abs(lumped.coarse));
            const std::string name = std::string(known.clamped ? "cantilever_" : "free_") + std::to_string(mode);
            RecordProperty(name, std::to_string(1e6 * lumped.fine) + " and " + std::to_string(1e6 * consistent.fine) +
                                     " ppm with " + std::to_string(2 * elements) + " elements");
        }
}

/// ω of the mode of Timoshenko's cantilever near a guess: the determinant of its end conditions vanishes.
double timoshenko_cantilever(double radius, double shear_area, double guess) {
    // w = e^{kx}, θ = g e^{kx}: E I θ'' + G A (w' − θ) + ω² ρ I θ = 0,  G A (w'' − θ') + ω² ρ A w = 0.
    const double inertia = radius * radius, young = 1.0 / inertia, shear = young / 2.5 * shear_area;
    const auto determinant = [&](double omega) {
        const double o2 = omega * omega;
        // k⁴ + k² (o2/shear + o2 I) + (o2² I/shear − o2) = 0 with E I = ρ A = 1.
        const double p = o2 / shear + o2 * inertia, q = o2 * o2 * inertia / shear - o2;
        const double root = std::sqrt(0.25 * p * p - q);
        const double a = std::sqrt(root - 0.5 * p), b = std::sqrt(root + 0.5 * p);  // k = ±a, ±i b
        // w: cosh, sinh, cos, sin; θ by G A (w'' − θ') = −ω² w: θ' = w'' + (o2/shear) w.
        const double ha = a + o2 / (shear * a), hb = b - o2 / (shear * b);
        // θ = ha sinh, ha cosh, −hb sin, hb cos.
        const double c = std::cosh(a), s = std::sinh(a), C = std::cos(b), S = std::sin(b);
        Eigen::Matrix4d A;
        A << 1.0, 0.0, 1.0, 0.0,                                     // w(0)
            0.0, ha, 0.0, hb,                                        // θ(0)
            ha * a * c, ha * a * s, -hb * b * C, -hb * b * S,        // θ'(1)
            (a - ha) * s, (a - ha) * c, (hb - b) * S, (b - hb) * C;  // w'(1) − θ(1)
        return A.determinant();
    };
    double low = 0.999 * guess, high = 1.001 * guess;
    for (int i = 0; i < 200 && determinant(low) * determinant(high) > 0.0; ++i) {
        low *= 0.999;
        high *= 1.001;
    }
    const double sign = determinant(low);
    for (int i = 0; i < 200; ++i) (determinant(0.5 * (low + high)) * sign > 0.0 ? low : high) = 0.5 * (low + high);
    return low;
}

TEST(BeamInertia, ThickBeamsHaveTimoshenkosFrequencies) {
    // Radius of gyration 0.05, and shear as of a rectangle: L/height = 5.8.
    const double radius = 0.05, shear_area = 5.0 / 6.0;
    for (int mode = 0; mode < 3; ++mode) {
        const VectorXd fine = bending(slender_beam(160, BeamMass::Consistent, radius, shear_area, true));
        const double exact = timoshenko_cantilever(radius, shear_area, fine[mode]);
        const auto consistent = convergence(8, BeamMass::Consistent, radius, shear_area, true, mode, exact);
        const auto lumped = convergence(8, BeamMass::Lumped, radius, shear_area, true, mode, exact);
        EXPECT_NEAR(fine[mode] / exact, 1.0, 1e-5) << mode;
        EXPECT_LT(std::abs(consistent.coarse), 0.03 * std::abs(lumped.coarse)) << mode;
        EXPECT_GT(consistent.order(), 1.5);
        const std::string name = "thick_" + std::to_string(mode);
        RecordProperty(name, std::to_string(1e6 * lumped.coarse) + " and " + std::to_string(1e6 * consistent.coarse) +
                                 " ppm with 8 elements, orders " + std::to_string(lumped.order()) + " and " +
                                 std::to_string(consistent.order()));
    }
}

TEST(BeamInertia, RodsStretchAndTwistWithOrderFour) {
    // Clamped and free: ω = π c/2.
    const auto error = [](int elements, BeamMass mass, bool twist) {
        ElasticBeamParameters beam;
        beam.name = "rod";
        beam.elements = elements;
        beam.section = {1.0, 0.5, 0.5, 1.0, infinite, infinite};
        beam.material = {1.0, 0.0, 1.0, 0.0};
        beam.mass = mass;
        beam.fixed_from = true;
        MultibodySystem system;
        system.set_gravity({0.0, 0.0, 0.0});
        system.add_elastic_beam(beam);
        system.finish();
        const State state = system.initial_state();
        const MatrixXd K = matrix_of(system, [&](auto& H) { system.add_stiffness(state, 1.0, Tangent::Exact, H); });
        const MatrixXd M = matrix_of(system, [&](auto& H) { system.add_mass(state, 1.0, H); });
        MatrixXd k(elements, elements), m(elements, elements);
        const int first = twist ? 3 : 0;
        for (int i = 0; i < elements; ++i)
            for (int j = 0; j < elements; ++j) {
                k(i, j) = K(6 * i + first, 6 * j + first);
                m(i, j) = M(6 * i + first, 6 * j + first);
            }
        const double square =
            Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(k, m, Eigen::EigenvaluesOnly).eigenvalues()[0];
        return std::sqrt(square) / (0.5 * M_PI * (twist ? std::sqrt(0.5) : 1.0)) - 1.0;
    };
    for (const bool twist : {false, true}) {
        EXPECT_NEAR(std::log2(error(4, BeamMass::Consistent, twist) / error(8, BeamMass::Consistent, twist)), 4.0, 0.1);
        EXPECT_NEAR(std::log2(error(4, BeamMass::Lumped, twist) / error(8, BeamMass::Lumped, twist)), 2.0, 0.1);
    }
}

TEST(BeamInertia, JointCoordinatesRefuseIt) {
    MultibodySystem system;
    system.add_elastic_beam(thick_beam(2));
    system.finish();
    EXPECT_TRUE(system.has_consistent_mass());
    EXPECT_THROW(JointCoordinates coordinates(system), Unsupported);
}

}  // namespace
}  // namespace delassus::beam_inertia_test
