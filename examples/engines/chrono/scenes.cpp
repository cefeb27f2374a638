// SPDX-License-Identifier: BSD-3-Clause
// Three scenes of Chrono, each with two of Chrono's solvers and with one of Delassus under both laws of friction: a box
// slides on an incline in many directions, a stack of boxes stands, spheres fall into a pit.
#include <chrono/collision/ChCollisionShapeBox.h>
#include <chrono/collision/ChCollisionShapeSphere.h>
#include <chrono/physics/ChBody.h>
#include <chrono/physics/ChContactMaterialNSC.h>
#include <chrono/physics/ChSystemNSC.h>
#include <chrono/solver/ChSolverBB.h>
#include <chrono/solver/ChSolverPSOR.h>

#include <exception>
#include <memory>
#include <numbers>

#include "../record.hpp"
#include "delassus_chrono_solver.hpp"

namespace {

using chrono::ChVector3d;
using delassus::Law;

constexpr double mu = 0.5, tolerance = 1e-12;

/// Hands everything to another solver, and measures its answers by the law that it has.
class Recorded : public chrono::ChSolver {
public:
    Record record;

    Recorded(Record to, std::shared_ptr<chrono::ChSolver> solver, Law law)
        : record(std::move(to)), solver_(std::move(solver)), judge_("auto", tolerance, law) {}

    bool IsIterative() const override { return false; }
    bool IsDirect() const override { return false; }
    bool SolveRequiresMatrix() const override { return true; }
    bool Setup(chrono::ChSystemDescriptor& descriptor, bool analyze) override {
        return solver_->Setup(descriptor, analyze);
    }
    double Solve(chrono::ChSystemDescriptor& descriptor) override {
        if (descriptor.CountActiveConstraints() == 0) return solver_->Solve(descriptor);
        const delassus::PreparedProblem& problem = judge_.pose(descriptor);
        const double result = record.timed([&] { return solver_->Solve(descriptor); });
        const delassus::Solution solution = judge_.solution_of(descriptor);
        record.add(problem.meter().measure(solution.x, solution.lambda).natural);
        return result;
    }

private:
    std::shared_ptr<chrono::ChSolver> solver_;
    DelassusChronoSolver judge_;
};

class World {
public:
    World(const std::shared_ptr<Recorded>& solver, const ChVector3d& gravity) {
        system.SetCollisionSystemType(chrono::ChCollisionSystem::Type::BULLET);
        system.SetGravitationalAcceleration(gravity);
        system.SetNumThreads(1, 1, 1);
        system.SetSolver(solver);
        material_->SetFriction(static_cast<float>(mu));
        add_box(ChVector3d(100, 100, 2), ChVector3d(0, 0, -1), 0.0);
    }

    std::shared_ptr<chrono::ChBody> add_box(const ChVector3d& size, const ChVector3d& position, double mass) {
        const double x = size.x() * size.x(), y = size.y() * size.y(), z = size.z() * size.z();
        return add(chrono_types::make_shared<chrono::ChCollisionShapeBox>(material_, size.x(), size.y(), size.z()),
                   position, mass, ChVector3d(y + z, z + x, x + y) * (mass / 12.0));
    }
    std::shared_ptr<chrono::ChBody> add_ball(double radius, const ChVector3d& position, double mass) {
        return add(chrono_types::make_shared<chrono::ChCollisionShapeSphere>(material_, radius), position, mass,
                   ChVector3d(1, 1, 1) * (0.4 * mass * radius * radius));
    }

    chrono::ChSystemNSC system;

private:
    std::shared_ptr<chrono::ChBody> add(const std::shared_ptr<chrono::ChCollisionShape>& shape,
                                        const ChVector3d& position, double mass, const ChVector3d& inertia) {
        auto body = chrono_types::make_shared<chrono::ChBody>();
        body->SetFixed(mass == 0.0);
        if (mass > 0.0) {
            body->SetMass(mass);
            body->SetInertiaXX(inertia);
        }
        body->SetPos(position);
        body->AddCollisionShape(shape);
        body->EnableCollision(true);
        system.AddBody(body);
        return body;
    }

    std::shared_ptr<chrono::ChContactMaterialNSC> material_ = chrono_types::make_shared<chrono::ChContactMaterialNSC>();
};

/// The incline lies in the plane z = 0; gravity is turned instead.
void incline(const std::shared_ptr<Recorded>& solver) {
    constexpr int directions = 64, steps = 10;
    constexpr double step = 0.001, slope = 0.3;
    const ChVector3d gravity(9.81 * std::sin(slope), 0, -9.81 * std::cos(slope));
    for (int k = 0; k < directions; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / directions;
        World world(solver, gravity);
        const auto block = world.add_box(ChVector3d(0.5, 0.4, 0.2), ChVector3d(0, 0, 0.1), 2.0);
        block->SetLinVel(ChVector3d(std::cos(angle), std::sin(angle), 0));
        for (int n = 0; n < steps; ++n) {
            const ChVector3d before = block->GetLinVel();
            world.system.DoStepDynamics(step);
            const ChVector3d velocity = block->PointSpeedLocalToParent(ChVector3d(0, 0, -0.1));
            const ChVector3d change = block->GetLinVel() - before - gravity * step;
            solver->record.slid(Eigen::Vector3d(velocity.eigen()), Eigen::Vector3d(change.eigen()),
                                Eigen::Vector3d(0, 0, 1), mu);
        }
    }
}

void stack(const std::shared_ptr<Recorded>& solver) {
    World world(solver, ChVector3d(0, 0, -9.81));
    for (int k = 0; k < 10; ++k) world.add_box(ChVector3d(1, 1, 1), ChVector3d(0, 0, 0.5 + k), 1.0);
    for (int n = 0; n < 100; ++n) world.system.DoStepDynamics(0.005);
}

void pile(const std::shared_ptr<Recorded>& solver) {
    World world(solver, ChVector3d(0, 0, -9.81));
    for (const double side : {-1.0, 1.0}) {
        world.add_box(ChVector3d(1, 4, 2), ChVector3d(1.15 * side, 0, 1), 0.0);
        world.add_box(ChVector3d(4, 1, 2), ChVector3d(0, 1.15 * side, 1), 0.0);
    }
    for (int k = 0; k < 24; ++k) {
        const int layer = k / 4, place = k % 4;
        const double shift = 0.03 * std::sin(7.0 * k);  // so that they do not stand on one another
        world.add_ball(
            0.15, ChVector3d(0.32 * (place % 2) - 0.16 + shift, 0.32 * (place / 2) - 0.16 - shift, 0.2 + 0.35 * layer),
            1.0);
    }
    for (int n = 0; n < 200; ++n) world.system.DoStepDynamics(0.005);
}

struct Scene {
    const char* name;
    void (*run)(const std::shared_ptr<Recorded>&);
};

}  // namespace

int main(int argc, char** argv) {
    try {
        const std::string name = argc > 1 ? argv[1] : "auto";
        bool shown = true;
        Record::print_head();
        for (const Scene& scene : {Scene{"incline", incline}, Scene{"stack", stack}, Scene{"pile", pile}}) {
            const auto run = [&](const std::string& label, std::shared_ptr<chrono::ChSolver> solver, Law law) {
                const auto recorded =
                    chrono_types::make_shared<Recorded>(Record(scene.name, label), std::move(solver), law);
                scene.run(recorded);
                recorded->record.print();
                return recorded->record;
            };
            const Record psor = run("Chrono, PSOR", chrono_types::make_shared<chrono::ChSolverPSOR>(), Law::Associated);
            run("Chrono, BB", chrono_types::make_shared<chrono::ChSolverBB>(), Law::Associated);
            run("Delassus, " + name + ", associated",
                chrono_types::make_shared<DelassusChronoSolver>(name, tolerance, Law::Associated), Law::Associated);
            const Record exact = run("Delassus, " + name + ", Coulomb",
                                     chrono_types::make_shared<DelassusChronoSolver>(name, tolerance), Law::Coulomb);
            shown = shown && exact.friction() < 1e-9 && exact.mean() < 1e-3 * psor.mean();
        }
        return shown ? 0 : 1;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 2;
    }
}
