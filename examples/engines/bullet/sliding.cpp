// SPDX-License-Identifier: BSD-3-Clause
// A box in Bullet slides over the ground in many directions: with Bullet's solvers, whose friction is a pyramid, and
// with one of Delassus, whose friction is a cone. Prints, for each, by how much the friction of a contact differs from
// μ N at most, relative to it, the largest natural error of its answers to the problem with cones, and the time it
// took.
#include <BulletDynamics/MLCPSolvers/btDantzigSolver.h>
#include <BulletDynamics/MLCPSolvers/btMLCPSolver.h>
#include <BulletDynamics/MLCPSolvers/btSolveProjectedGaussSeidel.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "delassus_mlcp.hpp"

namespace {

constexpr double mu = 0.5;

/// Hands everything to another solver, and measures its answers.
class Judged : public btMLCPSolverInterface {
public:
    explicit Judged(btMLCPSolverInterface& solver) : solver_(solver) {}
    bool solveMLCP(const btMatrixXu& A, const btVectorXu& b, btVectorXu& x, const btVectorXu& lo, const btVectorXu& hi,
                   const btAlignedObjectArray<int>& limitDependency, int iterations, bool sparse) override {
        if (A.rows() == 0) return true;
        const delassus::PreparedProblem problem(DelassusMlcp::problem_of(A, b, lo, hi, limitDependency));
        const auto begin = std::chrono::steady_clock::now();
        const bool solved = solver_.solveMLCP(A, b, x, lo, hi, limitDependency, iterations, sparse);
        seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        if (!solved) return false;
        std::vector<double> lambda;
        for (const int row : DelassusMlcp::order_of(limitDependency)) lambda.push_back(static_cast<double>(x[row]));
        error = std::max(error, problem.meter().measure({}, lambda).natural);
        const double largest = *std::max_element(lambda.begin(), lambda.end());
        for (std::size_t k = 0; k + 2 < lambda.size(); k += 3)  // every contact slides
            if (lambda[k] > 0.01 * largest)
                friction =
                    std::max(friction, std::abs(std::hypot(lambda[k + 1], lambda[k + 2]) / (mu * lambda[k]) - 1.0));
        return true;
    }
    double error = 0.0, friction = 0.0, seconds = 0.0;

private:
    btMLCPSolverInterface& solver_;
};

void slide(Judged& solver, double angle) {
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btDbvtBroadphase broadphase;
    btMLCPSolver constraints(&solver);
    btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &constraints, &configuration);
    world.setGravity(btVector3(0, 0, btScalar(-9.81)));
    world.getSolverInfo().m_solverMode |=
        SOLVER_USE_2_FRICTION_DIRECTIONS | SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION;
    btStaticPlaneShape plane(btVector3(0, 0, 1), 0);
    btBoxShape box(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.1)));
    btRigidBody ground(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &plane));
    btVector3 inertia;
    box.calculateLocalInertia(1, inertia);
    btRigidBody body(btRigidBody::btRigidBodyConstructionInfo(1, nullptr, &box, inertia));
    body.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, 0, btScalar(0.1))));
    body.setActivationState(DISABLE_DEACTIVATION);
    ground.setFriction(1);
    body.setFriction(btScalar(mu));
    body.setLinearVelocity(btVector3(btScalar(3 * std::cos(angle)), btScalar(3 * std::sin(angle)), 0));
    world.addRigidBody(&ground);
    world.addRigidBody(&body);
    for (int n = 0; n < 60; ++n) world.stepSimulation(btScalar(1.0 / 240.0), 0);
    world.removeRigidBody(&body);
    world.removeRigidBody(&ground);
}

}  // namespace

int main(int argc, char** argv) {
    try {
        const std::string name = argc > 1 ? argv[1] : "auto";
        btDantzigSolver dantzig;
        btSolveProjectedGaussSeidel sweeps;
        DelassusMlcp delassus(name);
        double own = 1.0, engines = 1.0;
        std::printf("%-20s %22s %16s %10s\n", "solver", "|friction/(mu N) - 1|", "natural error", "seconds");
        for (const auto& [label, solver] : {std::pair<std::string, btMLCPSolverInterface*>{"Bullet, Dantzig", &dantzig},
                                            {"Bullet, sweeps", &sweeps},
                                            {"Delassus, " + name, &delassus}}) {
            Judged judged(*solver);
            for (int k = 0; k < 16; ++k) slide(judged, 2.0 * std::numbers::pi * k / 16.0 + 0.1);
            std::printf("%-20s %22.2e %16.2e %10.4f\n", label.c_str(), judged.friction, judged.error, judged.seconds);
            (solver == &delassus ? own : engines) = judged.error;
        }
        return own < 1e-5 && own < 1e-3 * engines ? 0 : 1;  // Bullet counts in single precision
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 2;
    }
}
