// SPDX-License-Identifier: BSD-3-Clause
// Three scenes of DART, each with DART's own solver (Dantzig's, and its sweeps where that fails), whose friction is a
// pyramid, and with one of Delassus, whose friction is a cone: a box slides on an incline in many directions, a stack
// of boxes stands, spheres fall into a pit.
#include <dart/collision/dart/DARTCollisionDetector.hpp>
#include <dart/constraint/BoxedLcpConstraintSolver.hpp>
#include <dart/constraint/ContactConstraint.hpp>
#include <dart/constraint/DantzigBoxedLcpSolver.hpp>
#include <dart/constraint/PgsBoxedLcpSolver.hpp>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/SphereShape.hpp>
#include <dart/simulation/World.hpp>
#include <exception>
#include <memory>
#include <numbers>

#include "delassus_boxed_lcp_solver.hpp"
#include "record.hpp"

namespace {

using dart::simulation::World;
using Eigen::Vector3d;

constexpr double mu = 0.5;
double tolerance = 1e-12;

/// DART's own solvers in DART's order, or one of Delassus; keeps a record of the answers.
class Recorded : public dart::constraint::BoxedLcpSolver {
public:
    Record record;

    Recorded(Record to, const std::string& solver) : record(std::move(to)) {
        if (!solver.empty()) delassus_ = std::make_unique<DelassusBoxedLcpSolver>(solver, tolerance);
    }
    const std::string& getType() const override { return dantzig_.getType(); }
    bool solve(int n, double* A, double* x, double* b, int nub, double* lo, double* hi, int* findex, bool) override {
        const auto& problem = judge_.pose(n, DelassusBoxedLcpSolver::Rows{A, n}, b, lo, hi, findex);
        std::vector<double> kept_A(A, A + static_cast<std::ptrdiff_t>(n > 1 ? (n + 3) / 4 * 4 : n) * n);
        const std::vector<double> kept_x(x, x + n), kept_b(b, b + n), kept_lo(lo, lo + n), kept_hi(hi, hi + n);
        const std::vector<int> kept_findex(findex, findex + n);
        const bool solved = record.timed([&] {
            if (delassus_) return delassus_->solve(n, A, x, b, nub, lo, hi, findex, false);
            if (dantzig_.solve(n, A, x, b, nub, lo, hi, findex, true) && std::isfinite(sum(x, n))) return true;
            std::copy(kept_x.begin(), kept_x.end(), x);  // Dantzig's has written over all of them
            std::copy(kept_b.begin(), kept_b.end(), b);
            std::copy(kept_lo.begin(), kept_lo.end(), lo);
            std::copy(kept_hi.begin(), kept_hi.end(), hi);
            std::copy(kept_findex.begin(), kept_findex.end(), findex);
            return sweeps_.solve(n, kept_A.data(), x, b, nub, lo, hi, findex, false);
        });
        record.judge(judge_, problem, x);
        return solved || !delassus_;
    }
#ifndef NDEBUG
    bool canSolve(int, const double*) override {
        return true;
    }
#endif

private:
    static double sum(const double* x, int n) {
        return Eigen::Map<const Eigen::VectorXd>(x, n).sum();
    }
    BoxedLcp judge_;
    std::unique_ptr<DelassusBoxedLcpSolver> delassus_;
    dart::constraint::DantzigBoxedLcpSolver dantzig_;
    dart::constraint::PgsBoxedLcpSolver sweeps_;
};

using Solver = std::shared_ptr<Recorded>;

dart::simulation::WorldPtr make_world(const Solver& solver, double step, const Vector3d& gravity) {
    auto world = World::create();
    world->setTimeStep(step);
    world->setGravity(gravity);
    world->setConstraintSolver(std::make_unique<dart::constraint::BoxedLcpConstraintSolver>(solver, nullptr));
    world->getConstraintSolver()->setCollisionDetector(dart::collision::DARTCollisionDetector::create());
    world->getConstraintSolver()->getCollisionOption().maxNumContacts = 10000;
    return world;
}

dart::dynamics::SkeletonPtr add(World& world, const dart::dynamics::ShapePtr& shape, const Vector3d& position,
                                double mass, const Vector3d& velocity = Vector3d::Zero()) {
    using namespace dart::dynamics;
    const SkeletonPtr skeleton = Skeleton::create("body" + std::to_string(world.getNumSkeletons()));
    auto [joint, body] = skeleton->createJointAndBodyNodePair<FreeJoint>();
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = position;
    joint->setTransform(pose);
    joint->setLinearVelocity(velocity);
    auto* node = body->createShapeNodeWith<CollisionAspect, DynamicsAspect>(shape);
    node->getDynamicsAspect()->setFrictionCoeff(mu);
    node->getDynamicsAspect()->setRestitutionCoeff(0.0);
    if (mass > 0.0)
        body->setInertia(Inertia(mass, Vector3d::Zero(), shape->computeInertia(mass)));
    else
        skeleton->setMobile(false);
    world.addSkeleton(skeleton);
    return skeleton;
}

dart::dynamics::ShapePtr box(double x, double y, double z) {
    return std::make_shared<dart::dynamics::BoxShape>(Vector3d(x, y, z));
}

void add_ground(World& world) {
    add(world, box(100, 100, 2), Vector3d(0, 0, -1), 0.0);
}

/// The incline lies in the plane z = 0; gravity is turned instead.
void incline(const Solver& solver) {
    constexpr int directions = 64, steps = 10;
    constexpr double step = 0.001, slope = 0.3;
    const Vector3d gravity(9.81 * std::sin(slope), 0, -9.81 * std::cos(slope)), normal(0, 0, 1);
    // DART's compliance of contacts, 1e-5 if not set, turns friction by 1e-8 against the velocity of the body.
    dart::constraint::ContactConstraint::setConstraintForceMixing(1e-9);
    for (int k = 0; k < directions; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / directions;
        const auto world = make_world(solver, step, gravity);
        add_ground(*world);
        const auto block = add(*world, box(0.5, 0.4, 0.2), Vector3d(0, 0, 0.1 - 1e-4), 2.0,
                               Vector3d(std::cos(angle), std::sin(angle), 0));
        for (int n = 0; n < steps; ++n) {
            world->step();
            Vector3d force = Vector3d::Zero();
            for (const auto& contact : world->getLastCollisionResult().getContacts()) force += contact.force;
            if (force.dot(normal) < 0) force = -force;  // of the ground on the block
            solver->record.slid(block->getBodyNode(0)->getLinearVelocity(Vector3d(0, 0, -0.1)), force, normal, mu);
        }
    }
    dart::constraint::ContactConstraint::setConstraintForceMixing(1e-5);
}

void stack(const Solver& solver) {
    const auto world = make_world(solver, 0.005, Vector3d(0, 0, -9.81));
    add_ground(*world);
    for (int k = 0; k < 10; ++k) add(*world, box(1, 1, 1), Vector3d(0, 0, 0.4999 + 0.9998 * k), 1.0);
    for (int n = 0; n < 100; ++n) world->step();
}

void pile(const Solver& solver) {
    const auto world = make_world(solver, 0.005, Vector3d(0, 0, -9.81));
    add_ground(*world);
    for (const double side : {-1.0, 1.0}) {
        add(*world, box(1, 4, 2), Vector3d(1.15 * side, 0, 1), 0.0);
        add(*world, box(4, 1, 2), Vector3d(0, 1.15 * side, 1), 0.0);
    }
    const auto ball = std::make_shared<dart::dynamics::SphereShape>(0.15);
    for (int k = 0; k < 24; ++k) {
        const int layer = k / 4, place = k % 4;
        const double shift = 0.03 * std::sin(7.0 * k);  // so that they do not stand on one another
        add(*world, ball,
            Vector3d(0.32 * (place % 2) - 0.16 + shift, 0.32 * (place / 2) - 0.16 - shift, 0.2 + 0.35 * layer), 1.0);
    }
    for (int n = 0; n < 200; ++n) world->step();
}

struct Scene {
    const char* name;
    void (*run)(const Solver&);
};

}  // namespace

int main(int argc, char** argv) {
    try {
        const std::string solver = argc > 1 ? argv[1] : "auto";
        if (argc > 2) tolerance = std::stod(argv[2]);
        bool shown = true;
        Record::print_head();
        for (const auto& [name, scene] : {Scene{"incline", incline}, Scene{"stack", stack}, Scene{"pile", pile}}) {
            const auto engine = std::make_shared<Recorded>(Record(name, "DART, Dantzig"), "");
            const auto delassus = std::make_shared<Recorded>(Record(name, "Delassus, " + solver), solver);
            for (const Solver& one : {engine, delassus}) {
                scene(one);
                one->record.print();
            }
            // Where nothing slides, a pyramid is as good as a cone, and Dantzig's answer exact.
            shown = shown && delassus->record.friction() < 1e-9 &&
                    delassus->record.mean() < std::max(1e-3 * engine->record.mean(), 1e-9);
        }
        return shown ? 0 : 1;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 2;
    }
}
