// SPDX-License-Identifier: BSD-3-Clause
// Three scenes of Bullet, each with Bullet's default (sequential impulses), with its exact solver (Dantzig's), whose
// friction is a pyramid, and with one of Delassus, whose friction is a cone: a box slides on an incline in many
// directions, a stack of boxes stands, spheres fall into a pit.
#include <BulletDynamics/MLCPSolvers/btDantzigSolver.h>
#include <BulletDynamics/MLCPSolvers/btMLCPSolver.h>
#include <btBulletDynamicsCommon.h>

#include <exception>
#include <memory>
#include <numbers>

#include "delassus_mlcp.hpp"
#include "record.hpp"

namespace {

constexpr double mu = 0.5;
double tolerance = 1e-12;

/// Gives up, so that Bullet falls back on its default.
class Sequential : public btMLCPSolverInterface {
public:
    bool solveMLCP(const btMatrixXu&, const btVectorXu&, btVectorXu&, const btVectorXu&, const btVectorXu&,
                   const btAlignedObjectArray<int>&, int, bool) override {
        return false;
    }
};

/// A solver in Bullet, and a record of the impulses that Bullet applies.
class Recorded : public btMLCPSolver {
public:
    Record record;

    Recorded(Record to, std::unique_ptr<btMLCPSolverInterface> solver)
        : btMLCPSolver(solver.get()), record(std::move(to)), solver_(std::move(solver)) {}

private:
    btScalar solveGroupCacheFriendlyIterations(btCollisionObject** bodies, int count, btPersistentManifold** manifolds,
                                               int manifold_count, btTypedConstraint** joints, int joint_count,
                                               const btContactSolverInfo& info, btIDebugDraw* draw) override {
        const auto solve = [&] {
            return btMLCPSolver::solveGroupCacheFriendlyIterations(bodies, count, manifolds, manifold_count, joints,
                                                                   joint_count, info, draw);
        };
        if (m_b.rows() == 0) return solve();
        const auto& problem = judge_.pose(m_A.rows(), m_A, m_b, m_lo, m_hi, m_limitDependencies);
        const btScalar result = record.timed(solve);
        std::vector<double> impulses;
        for (int i = 0; i < m_allConstraintPtrArray.size(); ++i)
            impulses.push_back(m_allConstraintPtrArray[i]->m_appliedImpulse);
        record.judge(judge_, problem, impulses);
        return result;
    }

    BoxedLcp judge_;
    std::unique_ptr<btMLCPSolverInterface> solver_;
};

/// A world and what is in it.
class World {
public:
    World(Recorded& solver, double step, const btVector3& gravity) : step_(step), solver_(solver) {
        world_.setGravity(gravity);
        world_.getSolverInfo().m_solverMode |=
            SOLVER_USE_2_FRICTION_DIRECTIONS | SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION;
        world_.getSolverInfo().m_minimumSolverBatchSize = 1;
        add(std::make_unique<btBoxShape>(btVector3(50, 50, 1)), btVector3(0, 0, -1), 0.0);
    }
    ~World() {
        for (const auto& body : bodies_) world_.removeRigidBody(body.get());
    }
    World(const World&) = delete;
    World& operator=(const World&) = delete;

    btRigidBody& add(std::unique_ptr<btCollisionShape> shape, const btVector3& position, double mass) {
        btVector3 inertia(0, 0, 0);
        if (mass > 0.0) shape->calculateLocalInertia(mass, inertia);
        auto body = std::make_unique<btRigidBody>(
            btRigidBody::btRigidBodyConstructionInfo(mass, nullptr, shape.get(), inertia));
        body->setWorldTransform(btTransform(btQuaternion::getIdentity(), position));
        body->setActivationState(DISABLE_DEACTIVATION);
        body->setFriction(std::sqrt(mu));  // Bullet multiplies those of two bodies
        world_.addRigidBody(body.get());
        shapes_.push_back(std::move(shape));
        bodies_.push_back(std::move(body));
        return *bodies_.back();
    }
    void step() { world_.stepSimulation(step_, 0); }

private:
    double step_;
    Recorded& solver_;
    btDefaultCollisionConfiguration configuration_;
    btCollisionDispatcher dispatcher_{&configuration_};
    btDbvtBroadphase broadphase_;
    btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
    std::vector<std::unique_ptr<btCollisionShape>> shapes_;
    std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

/// The incline lies in the plane z = 0; gravity is turned instead.
void incline(Recorded& solver) {
    constexpr int directions = 64, steps = 10;
    constexpr double step = 0.001, slope = 0.3;
    const btVector3 gravity(9.81 * std::sin(slope), 0, -9.81 * std::cos(slope)), normal(0, 0, 1);
    for (int k = 0; k < directions; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / directions;
        World world(solver, step, gravity);
        btRigidBody& block =
            world.add(std::make_unique<btBoxShape>(btVector3(0.25, 0.2, 0.1)), btVector3(0, 0, 0.1 - 1e-4), 2.0);
        block.setLinearVelocity(btVector3(std::cos(angle), std::sin(angle), 0));
        for (int n = 0; n < steps; ++n) {
            const btVector3 before = block.getLinearVelocity();
            world.step();
            solver.record.slid(block.getVelocityInLocalPoint(btVector3(0, 0, -0.1)),
                               block.getLinearVelocity() - before - gravity * step, normal, mu);
        }
    }
}

void stack(Recorded& solver) {
    World world(solver, 0.005, btVector3(0, 0, -9.81));
    for (int k = 0; k < 10; ++k)
        world.add(std::make_unique<btBoxShape>(btVector3(0.5, 0.5, 0.5)), btVector3(0, 0, 0.4999 + 0.9998 * k), 1.0);
    for (int n = 0; n < 100; ++n) world.step();
}

void pile(Recorded& solver) {
    World world(solver, 0.005, btVector3(0, 0, -9.81));
    for (const double side : {-1.0, 1.0}) {
        world.add(std::make_unique<btBoxShape>(btVector3(0.5, 2, 1)), btVector3(1.15 * side, 0, 1), 0.0);
        world.add(std::make_unique<btBoxShape>(btVector3(2, 0.5, 1)), btVector3(0, 1.15 * side, 1), 0.0);
    }
    for (int k = 0; k < 24; ++k) {
        const int layer = k / 4, place = k % 4;
        const double shift = 0.03 * std::sin(7.0 * k);  // so that they do not stand on one another
        world.add(std::make_unique<btSphereShape>(0.15),
                  btVector3(0.32 * (place % 2) - 0.16 + shift, 0.32 * (place / 2) - 0.16 - shift, 0.2 + 0.35 * layer),
                  1.0);
    }
    for (int n = 0; n < 200; ++n) world.step();
}

struct Scene {
    const char* name;
    void (*run)(Recorded&);
};

}  // namespace

int main(int argc, char** argv) {
    try {
        const std::string name = argc > 1 ? argv[1] : "auto";
        if (argc > 2) tolerance = std::stod(argv[2]);
        bool shown = true;
        Record::print_head();
        for (const Scene& scene : {Scene{"incline", incline}, Scene{"stack", stack}, Scene{"pile", pile}}) {
            Recorded engine(Record(scene.name, "Bullet, sequential impulses"), std::make_unique<Sequential>());
            Recorded dantzig(Record(scene.name, "Bullet, Dantzig"), std::make_unique<btDantzigSolver>());
            Recorded delassus(Record(scene.name, "Delassus, " + name), std::make_unique<DelassusMlcp>(name, tolerance));
            for (Recorded* solver : {&engine, &dantzig, &delassus}) {
                scene.run(*solver);
                solver->record.print();
            }
            shown = shown && delassus.record.friction() < 1e-9 && delassus.getNumFallbacks() == 0 &&
                    delassus.record.mean() < 1e-3 * engine.record.mean();
        }
        return shown ? 0 : 1;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 2;
    }
}
