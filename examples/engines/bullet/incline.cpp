// SPDX-License-Identifier: BSD-3-Clause
// A box on an incline in Bullet, pulled down in many directions: with Bullet's solvers, whose friction is a pyramid, and
// with one of Delassus, whose friction is a cone. Prints, for each, the largest error of the friction force relative to
// μ N, the largest natural error of its answers to the problem with cones, and the time it took.
#include <BulletDynamics/MLCPSolvers/btDantzigSolver.h>
#include <BulletDynamics/MLCPSolvers/btMLCPSolver.h>
#include <BulletDynamics/MLCPSolvers/btSolveProjectedGaussSeidel.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <functional>
#include <memory>
#include <numbers>

#include "delassus_mlcp.hpp"

namespace {

/// Hands everything to another solver, and measures its answers.
class Judged : public btMLCPSolverInterface {
public:
    explicit Judged(btMLCPSolverInterface& solver) : solver_(solver) {}
    bool solveMLCP(const btMatrixXu& A, const btVectorXu& b, btVectorXu& x, const btVectorXu& lo, const btVectorXu& hi,
                   const btAlignedObjectArray<int>& limitDependency, int iterations, bool sparse) override {
        // Some of Bullet's solvers change what they are given.
        const delassus::PreparedProblem problem(DelassusMlcp::problem_of(A, b, lo, hi, limitDependency));
        const auto begin = std::chrono::steady_clock::now();
        const bool solved = solver_.solveMLCP(A, b, x, lo, hi, limitDependency, iterations, sparse);
        seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        std::vector<double> lambda;
        for (int i = 0; i < problem.problem().m(); ++i) lambda.push_back(static_cast<double>(x[i]));
        if (solved && !lambda.empty()) worst = std::max(worst, problem.meter().measure({}, lambda).natural);
        return solved;
    }
    double worst = 0.0, seconds = 0.0;

private:
    btMLCPSolverInterface& solver_;
};

/// The deceleration of a sliding box, in units of μ g, less 1: the largest deviation over the directions.
double friction_error(btMLCPSolverInterface& solver) {
    constexpr double mu = 0.5, gravity = 9.81, step = 1.0 / 240.0;
    double worst = 0.0;
    for (int k = 0; k < 16; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / 16.0 + 0.1;
        btDefaultCollisionConfiguration configuration;
        btCollisionDispatcher dispatcher(&configuration);
        btDbvtBroadphase broadphase;
        btMLCPSolver constraints(&solver);
        btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &constraints, &configuration);
        world.setGravity(btVector3(0, 0, btScalar(-gravity)));
        world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS | SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION;
        world.getSolverInfo().m_splitImpulse = 0;
        btStaticPlaneShape plane(btVector3(0, 0, 1), 0);
        btBoxShape box(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.1)));
        btRigidBody ground(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &plane));
        btVector3 inertia;
        box.calculateLocalInertia(1, inertia);
        btRigidBody body(btRigidBody::btRigidBodyConstructionInfo(1, nullptr, &box, inertia));
        body.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, 0, btScalar(0.1))));
        body.setActivationState(DISABLE_DEACTIVATION);
        ground.setFriction(btScalar(1));
        body.setFriction(btScalar(mu));
        body.setLinearVelocity(btVector3(btScalar(3 * std::cos(angle)), btScalar(3 * std::sin(angle)), 0));
        world.addRigidBody(&ground);
        world.addRigidBody(&body);
        for (int n = 0; n < 20; ++n) world.stepSimulation(btScalar(step), 0);  // it settles
        const btVector3 before = body.getLinearVelocity();
        constexpr int steps = 60;
        for (int n = 0; n < steps; ++n) world.stepSimulation(btScalar(step), 0);
        const btVector3 change = body.getLinearVelocity() - before;
        const double force = std::hypot(double(change.x()), double(change.y())) / (steps * step) / (mu * gravity);
        worst = std::max(worst, std::abs(force - 1.0));
        world.removeRigidBody(&body);
        world.removeRigidBody(&ground);
    }
    return worst;
}

}  // namespace

int main(int argc, char** argv) {
    try {
        const std::string name = argc > 1 ? argv[1] : "auto";
        btDantzigSolver dantzig;
        btSolveProjectedGaussSeidel sweeps;
        DelassusMlcp delassus(name);
        double own = 0.0, engines = 1.0;
        std::printf("%-24s %18s %16s %10s\n", "solver", "friction/(mu N)-1", "natural error", "seconds");
        for (const auto& [label, solver] : {std::pair<std::string, btMLCPSolverInterface*>{"Bullet, Dantzig", &dantzig},
                                            {"Bullet, sweeps", &sweeps},
                                            {"Delassus, " + name, &delassus}}) {
            Judged judged(*solver);
            const double error = friction_error(judged);
            std::printf("%-24s %18.2e %16.2e %10.4f\n", label.c_str(), error, judged.worst, judged.seconds);
            if (solver == &delassus) {
                own = error;
            } else {
                engines = std::min(engines, error);
            }
        }
        return own < 1e-4 && own < 0.1 * engines ? 0 : 1;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 2;
    }
}
