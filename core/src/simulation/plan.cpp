// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "delassus/error.hpp"
#include "delassus/sdk/cones.hpp"
#include "delassus/simulation.hpp"
#include "simulation/shared_reactions.hpp"
#include "simulation/touching.hpp"
#include "solver/auto_solver.hpp"

namespace delassus {
namespace {

std::string counted(std::size_t count, std::string_view one, std::string_view many) {
    return fmt::format("{} {}", count, count == 1 ? one : many);
}

/// The reason where a scene asks for it.
constexpr const char* everything = "leave_out is false: as if the scene needed everything";

class Planner {
public:
    Planner(SceneSystem& system, const Registry& registry)
        : system_(system),
          registry_(registry),
          end_(std::exchange(system.end, std::max(system.end, system.step))),
          simulation_(system, registry),
          touching_(system) {
        plan_.name = system.name;
        const JointCoordinates* joints = simulation_.joint_coordinates();
        plan_.velocities = joints ? joints->n() : system.system->n();
        plan_.constraints = system.system->constraint_rows();
    }

    SystemPlan make() {
        first_step();
        method();
        bodies();
        files();
        constraints();
        contacts();
        matrix();
        sleeping();
        solvers();
        if (!system_.leave_out) keep("one problem", everything);
        plan_.left_out.insert(plan_.left_out.begin(), nothing_.begin(), nothing_.end());
        for (const auto& one : system_.left_out) plan_.left_out.push_back({one.what, one.reason});
        return std::move(plan_);
    }

private:
    void keep(std::string what, std::string reason) { plan_.kept.push_back({std::move(what), std::move(reason)}); }
    void leave(std::string what, std::string reason) { plan_.left_out.push_back({std::move(what), std::move(reason)}); }

    void first_step() {
        simulation_.solver().watch([this](const Problem& problem) {
            std::int32_t parts = 0;
            for (const auto& part : simulation_.solver().parts(problem)) {
                sparse_ = sparse_ || part.structure > Structure::Blocks;
                if (part.m == 0 && system_.leave_out) continue;
                ++parts;
                needs_ |= part.needs;
            }
            plan_.parts = std::max(plan_.parts, parts);
        });
        simulation_.step();
        system_.end = end_;
        plan_.solvers = simulation_.solver().loaded();
    }

    void method() {
        if (system_.method_reason.empty()) return;
        keep(fmt::format("integrator {}", system_.integrator), "the scene names none: " + system_.method_reason);
    }

    void bodies() {
        std::vector<std::string> fixed, free, moving, prescribed;
        std::set<BodyIndex> held;
        const auto hold = [&](BodyIndex first, BodyIndex second) {
            held.insert(first);
            held.insert(second);
        };
        for (const auto& joint : system_.joints)
            if (joint.kind != JointKind::Gear) hold(joint.first, joint.second);
        for (const auto& spring : system_.springs) hold(spring.first, spring.second);
        for (const auto& bushing : system_.bushings) hold(bushing.first, bushing.second);
        for (const auto& [first, second] : system_.beams) hold(first, second);
        for (const auto& attachment : system_.attachments) hold(attachment.body, attachment.body);
        if (!touching_.pairs().empty())
            for (const auto& shape : system_.system->shapes()) held.insert(shape.body);
        for (std::size_t i = 0; i < system_.bodies.size(); ++i) {
            const auto& body = system_.bodies[i];
            moving.push_back(body.name);
            if (body.fixed) {
                fixed.push_back(body.name);
                moving.pop_back();
            } else if (body.motion) {
                prescribed.push_back(body.name);
                moving.pop_back();
            } else if (!held.contains(static_cast<BodyIndex>(i))) {
                free.push_back(body.name);
            }
        }
        if (!moving.empty())
            keep(counted(moving.size(), "moving body", "moving bodies"),
                 (simulation_.joint_coordinates() ? "placed by joint coordinates: " : "6 velocities each: ") +
                     some_of(moving));
        auto nodes = static_cast<std::size_t>(system_.system->node_count());
        for (const auto& body : system_.system->reduced_bodies()) nodes -= body.places.size();
        if (nodes > 0) keep(counted(nodes, "node", "nodes"), "3 velocities for each that moves");
        for (const auto& body : system_.system->reduced_bodies()) {
            const std::size_t own = body.places.size(), modes = body.frequencies.size();
            keep(fmt::format("elastic body \"{}\" of {}", body.name, counted(modes, "mode", "modes")),
                 fmt::format("{} velocities, those of its frame included; frequencies of the free body from {:.4g} to "
                             "{:.4g} Hz",
                             6 + modes, body.frequencies.front(), body.frequencies.back()));
            leave(fmt::format("{} velocities of the {} of \"{}\"", 3 * own, counted(own, "node", "nodes"), body.name),
                  "its modes move them");
        }
        if (!system_.system->reduced_bodies().empty()) plan_.libraries.emplace_back("delassus_eigenmodes.so");
        if (!prescribed.empty())
            keep(counted(prescribed.size(), "kinematic body", "kinematic bodies"),
                 "its motion is given: no columns, its velocity is part of its contacts and joints: " +
                     some_of(prescribed));
        if (!fixed.empty())
            leave(counted(fixed.size(), "fixed body", "fixed bodies"), "no unknowns, no columns: " + some_of(fixed));
        if (!free.empty() && system_.leave_out)
            leave(counted(free.size(), "free body", "free bodies"),
                  "nothing touches or holds them, so they reach no solver: " + some_of(free));
    }

    void files() {
        if (system_.surfaces_read) {
            keep("surfaces in files", "the scene names them");
            plan_.libraries.emplace_back("delassus_surface_mesh.so");
        }
        if (system_.tetrahedra_read) {
            keep("tetrahedra in files", "the scene names them");
            plan_.libraries.emplace_back("delassus_volume_mesh.so");
        }
    }

    void constraints() {
        std::size_t attached = 0;
        std::int32_t interfaces = 0;
        const auto& reduced = system_.system->reduced_bodies();
        for (const auto& attachment : system_.attachments) {
            const auto node = attachment.nodes.front();
            const bool of_modes = std::any_of(reduced.begin(), reduced.end(), [&](const ReducedBody& body) {
                return node >= body.first_node &&
                       node - body.first_node < static_cast<std::int32_t>(body.places.size());
            });
            if (of_modes) {
                ++interfaces;
            } else {
                attached += attachment.nodes.size();
            }
        }
        if (interfaces > 0)
            keep(counted(static_cast<std::size_t>(interfaces), "interface", "interfaces"),
                 "six rows for each attachment of an elastic body with modes, three for that of a single node");
        if (attached > 0)
            keep(counted(attached, "attached node", "attached nodes"),
                 "three rows for each that a moving body carries; one of a fixed body is fixed and has none");
        if (const auto rows = system_.system->m(); rows > 0) {
            keep(fmt::format("{} rows of joints, motors and attachments", rows),
                 fmt::format("{}, in {} that are solved apart", counted(system_.joints.size(), "joint", "joints"),
                             counted(static_cast<std::size_t>(plan_.parts), "part", "parts")));
        } else {
            leave("bilateral constraints", "the system has no joint or attachment with rows");
        }
        const JointCoordinates* joints = simulation_.joint_coordinates();
        const std::int32_t of_trees = joints ? joints->rows_saved() : 0;
        if (joints) {
            std::vector<std::string> loops;
            std::set<std::int32_t> held;
            for (const TreeJoint& one : joints->joints()) held.insert(one.joint);
            for (std::size_t i = 0; i < system_.joints.size(); ++i)
                if (!held.contains(static_cast<std::int32_t>(i))) loops.push_back(system_.joints[i].name);
            keep("joint coordinates",
                 fmt::format("{}: {} velocities{}",
                             system_.coordinates_chosen ? "the scene names none" : "the scene asks for them",
                             joints->n(),
                             loops.empty() ? std::string(", no loops") : "; as rows stay " + some_of(loops)));
            leave(fmt::format("{} of {} velocities and {} rows", joints->body_velocities() - joints->n(),
                              joints->body_velocities(), of_trees),
                  "joints of trees hold by their coordinates");
        }
        if (const auto redundant = plan_.constraints - of_trees - system_.system->m(); redundant > 0)
            leave(counted(static_cast<std::size_t>(redundant), "row of joints and motors", "rows of joints and motors"),
                  "others imply them in every configuration; " + shared_reactions(*system_.system));
        if (const std::string start = simulation_.start(); !start.empty())
            keep("a start other than the scene places it", start);
        if (has_limits()) {
            needs_ |= DELASSUS_CAN_NONNEGATIVE;
            keep("joint limits", "a row λ ≥ 0 each, while the joint is near its stop");
        }
        for (const auto& motor : system_.motors) {
            if (std::isinf(motor.force_limit)) continue;
            needs_ |= DELASSUS_CAN_BOX;
            keep(fmt::format("motor \"{}\" as a box row", motor.name), "its force is limited");
        }
        joint_forces();
    }
    void joint_forces() {
        std::vector<std::string> springs, frictions;
        for (const auto& joint : system_.joints) {
            const auto any = [&](double JointCoordinate::*of) { return joint.slide.*of > 0.0 || joint.turn.*of > 0.0; };
            if (any(&JointCoordinate::stiffness) || any(&JointCoordinate::damping)) springs.push_back(joint.name);
            if (any(&JointCoordinate::friction)) frictions.push_back(joint.name);
        }
        if (!springs.empty())
            keep(counted(springs.size(), "joint with a spring or damping", "joints with springs or damping"),
                 "stiffness and damping are parts of H: " + some_of(springs));
        if (!frictions.empty()) {
            needs_ |= DELASSUS_CAN_BOX;
            keep(counted(frictions.size(), "joint with dry friction", "joints with dry friction"),
                 "a box row for each coordinate: " + some_of(frictions));
        }
        for (const auto& actuator : system_.actuators) {
            const bool limited = !std::isinf(actuator.force_limit);
            if (limited) needs_ |= DELASSUS_CAN_BOX | DELASSUS_CAN_COMPLIANCE;
            keep(fmt::format("actuator \"{}\"{}", actuator.name, limited ? " as a box row with a compliance" : ""),
                 limited ? "its force is limited" : "its gains are parts of H");
        }
    }
    [[nodiscard]] bool has_limits() const {
        return std::any_of(system_.joints.begin(), system_.joints.end(),
                           [](const auto& joint) { return !std::isnan(joint.lower) || !std::isnan(joint.upper); });
    }

    void contacts() {
        if (!touching_.detects() && !system_.leave_out) {
            keep("the collision library", everything);
            plan_.libraries.emplace_back("delassus_collision.so");
        } else if (touching_.detects()) {
            keep("collision detection", counted(system_.system->shapes().size(), "shape", "shapes") +
                                            (touching_.nodes_touch() ? " and nodes of elements" : ""));
            plan_.libraries.emplace_back("delassus_collision.so");
        } else {
            leave("collision detection",
                  system_.system->shapes().empty() ? "no body has a shape" : "no two shapes could ever meet");
        }
        if (touching_.meshes() > 1)
            keep("contacts between meshes", fmt::format("the surfaces of {} meshes touch", touching_.meshes()));
        const bool friction = touching_.friction() || (!touching_.pairs().empty() && !system_.leave_out);
        for (const auto& pair : touching_.pairs()) {
            const auto& first = system_.materials[static_cast<std::size_t>(pair.first)].name;
            const auto& second = system_.materials[static_cast<std::size_t>(pair.second)].name;
            if (pair.friction > 0.0 || !system_.leave_out) {
                keep(fmt::format("friction cones of 3 rows, {} on {}", first, second),
                     pair.friction > 0.0 ? fmt::format("friction {:.4g}", pair.friction) : everything);
            } else {
                needs_ |= DELASSUS_CAN_NONNEGATIVE;
                keep(fmt::format("contacts of 1 row, {} on {}", first, second), "friction is zero");
                leave(fmt::format("2 of 3 rows of each contact, {} on {}", first, second), "friction is zero");
            }
        }
        if (friction) {
            const Law law = system_.solver.law.value_or(law_of_scenes);
            needs_ |= DELASSUS_CAN_FRICTION | (law == Law::Coulomb ? DELASSUS_CAN_COULOMB : DELASSUS_CAN_ASSOCIATED);
        } else {
            leave("friction cones",
                  touching_.pairs().empty() ? "nothing can touch" : "no pair of materials has friction");
        }
    }

    void matrix() {
        if (!system_.leave_out) {
            keep("H as a sparse matrix, factorised", everything);
        } else if (sparse_) {
            keep("a sparse H", "forces or constraints couple bodies in it; it is factorised");
        } else {
            leave("factorisation of H", simulation_.joint_coordinates()
                                            ? "H is diagonal by blocks, or accelerations follow from link to link"
                                            : "no stiffness couples bodies: H is diagonal by blocks of one body");
        }
    }

    void sleeping() {
        if (const auto& rule = system_.sleeping) {
            keep("sleeping bodies",
                 fmt::format("parts slower than {:g} m/s for {:g} s that stay at rest reach no solver until something "
                             "about them changes",
                             rule->speed, rule->time));
        } else {
            leave("sleeping", "off: bodies at rest are solved for in every step (docs/scenes.md, \"sleeping\")");
        }
    }

    void solvers() {
        if ((needs_ & sdk::all_cones) == 0) {
            nothing_.push_back({"a solver", "no row in any problem: velocities follow from H alone"});
            return;
        }
        // Contacts that are not there yet: bodies may touch, with any kind of redundancy among their rows.
        if (needs_ & sdk::cones_not_linear) {
            std::uint64_t all = needs_ | (sparse_ ? DELASSUS_CAN_H_DEFINITE : DELASSUS_CAN_H_BLOCKS);
            if (!touching_.pairs().empty()) all |= DELASSUS_CAN_REDUNDANT;
            const std::string name = simulation_.solver().choice(all);
            if (name.empty())
                throw Unsupported(fmt::format("system \"{}\": no installed solver can take all that it may need: {}",
                                              system_.name, fmt::join(capability_names(all), ", ")));
            if (std::find(plan_.solvers.begin(), plan_.solvers.end(), name) == plan_.solvers.end())
                plan_.solvers.push_back(name);
            find_later_solvers(all);
        } else {
            nothing_.push_back({"a solver for cones", "no contact, stop or limited motor: every row is bilateral"});
            // The first step may be the answer by itself, as where a motor goes on at the speed of the start.
            const std::string name = simulation_.solver().choice(needs_);
            if (plan_.solvers.empty() && !name.empty()) plan_.solvers.push_back(name);
        }
        if (!plan_.later_solvers.empty())
            leave(fmt::format("the solvers {}", fmt::join(plan_.later_solvers, ", ")),
                  fmt::format("loaded only if {} does not reach the tolerance", fmt::join(plan_.solvers, " or ")));
        for (const auto& name : plan_.solvers) {
            const bool chosen = name == system_.solver.name;
            keep(fmt::format("solver {}", name), chosen ? "the scene names it" : "auto starts with it");
            plan_.libraries.push_back(is_library_path(name) ? name : registry_.find(name).library.filename().string());
        }
    }

    /// Those that `auto` turns to where the first fails.
    void find_later_solvers(std::uint64_t needs) {
        const SolverConfig& solver = system_.solver;
        if (!solver.name.empty() && solver.name != auto_name) return;
        for (auto& name : auto_choice(registry_, solver.options, needs, Origin::Step).later)
            if (std::find(plan_.solvers.begin(), plan_.solvers.end(), name) == plan_.solvers.end())
                plan_.later_solvers.push_back(std::move(name));
    }

    SceneSystem& system_;
    const Registry& registry_;
    double end_;  // of the system, which has at least one step while the plan is made
    Simulation simulation_;
    Touching touching_;
    SystemPlan plan_;
    std::vector<PlanLine> nothing_;
    std::uint64_t needs_ = 0;
    bool sparse_ = false;
};

}  // namespace

std::vector<SystemPlan> make_plan(Scene& scene, const Registry& registry) {
    std::vector<SystemPlan> plans;
    for (auto& system : scene.systems) plans.push_back(Planner(system, registry).make());
    return plans;
}

}  // namespace delassus
