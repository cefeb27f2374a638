// SPDX-License-Identifier: BSD-3-Clause
// What a multibody system refuses, each with a sentence that names the item.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "delassus/error.hpp"
#include "delassus/multibody.hpp"

namespace delassus::input_test {
namespace {

BodyParameters good(const std::string& name) {
    BodyParameters body;
    body.name = name;
    return body;
}

void expect_refused(const std::string& words, const std::function<void(MultibodySystem&)>& build) {
    MultibodySystem system;
    system.add_body(good("a"));
    system.add_body(good("b"));
    try {
        build(system);
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
        return;
    }
    ADD_FAILURE() << "accepted what should be refused with: " << words;
}

TEST(Refusals, OfBodies) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    expect_refused("the mass of body \"c\" is 0 kg; it must be positive", [](auto& system) {
        auto body = good("c");
        body.mass = 0.0;
        system.add_body(body);
    });
    expect_refused("the mass of body \"c\" is nan", [&](auto& system) {
        auto body = good("c");
        body.mass = nan;
        system.add_body(body);
    });
    expect_refused("the largest exceeds the sum of the others", [](auto& system) {
        auto body = good("c");
        body.inertia = {1.0, 1.0, 2.1};
        system.add_body(body);
    });
    expect_refused("is not positive definite", [](auto& system) {
        auto body = good("c");
        body.inertia = {1.0, 1.0, 1.0, 1.5};
        system.add_body(body);
    });
    expect_refused("the position of body \"c\" is not finite", [&](auto& system) {
        auto body = good("c");
        body.pose.position[1] = nan;
        system.add_body(body);
    });
    expect_refused("is not a quaternion of positive length", [](auto& system) {
        auto body = good("c");
        body.pose.orientation = {0.0, 0.0, 0.0, 0.0};
        system.add_body(body);
    });
}

TEST(Refusals, OfJoints) {
    const auto joint = [](JointKind kind) {
        JointParameters parameters;
        parameters.name = "j";
        parameters.kind = kind;
        parameters.first = 0;
        parameters.second = 1;
        return parameters;
    };
    expect_refused("the joint \"j\" joins a body to itself", [&](auto& system) {
        auto parameters = joint(JointKind::Revolute);
        parameters.second = 0;
        system.add_joint(parameters);
    });
    expect_refused("\"j\" names the body 7; there are 2", [&](auto& system) {
        auto parameters = joint(JointKind::Revolute);
        parameters.second = 7;
        system.add_joint(parameters);
    });
    expect_refused("the axis of \"j\" has no direction", [&](auto& system) {
        auto parameters = joint(JointKind::Revolute);
        parameters.axis = {0.0, 0.0, 0.0};
        system.add_joint(parameters);
    });
    expect_refused("not normal to each other", [&](auto& system) {
        auto parameters = joint(JointKind::Universal);
        parameters.axis = parameters.second_axis = {0.0, 1.0, 0.0};
        system.add_joint(parameters);
    });
    expect_refused("the points of the distance joint \"j\" coincide",
                   [&](auto& system) { system.add_joint(joint(JointKind::Distance)); });
    expect_refused("only revolute and prismatic joints can", [&](auto& system) {
        auto parameters = joint(JointKind::Spherical);
        parameters.lower = 0.0;
        system.add_joint(parameters);
    });
    expect_refused("the lower must not exceed the upper", [&](auto& system) {
        auto parameters = joint(JointKind::Prismatic);
        parameters.lower = 1.0;
        parameters.upper = 0.0;
        system.add_joint(parameters);
    });
    expect_refused("must join two revolute joints", [&](auto& system) { system.add_joint(joint(JointKind::Gear)); });
    expect_refused("is not a fraction of whole numbers below 1000", [&](auto& system) {
        auto parameters = joint(JointKind::Gear);
        auto hinge = joint(JointKind::Revolute);
        parameters.gear_first = system.add_joint(hinge);
        hinge.point = {1.0, 0.0, 0.0};
        parameters.gear_second = system.add_joint(hinge);
        parameters.gear_ratio = std::sqrt(2.0);
        system.add_joint(parameters);
    });
}

TEST(Refusals, OfMotorsSpringsAndMaterials) {
    expect_refused("the motor \"m\" drives no joint", [](auto& system) {
        MotorParameters motor;
        motor.name = "m";
        motor.joint = 3;
        system.add_motor(motor);
    });
    expect_refused("the motor \"m\" has a force limit, so it must be driven by speed", [](auto& system) {
        JointParameters hinge;
        hinge.kind = JointKind::Revolute;
        hinge.first = 0;
        hinge.second = 1;
        MotorParameters motor;
        motor.name = "m";
        motor.joint = system.add_joint(hinge);
        motor.motion = Motion::constant(1.0);
        motor.force_limit = 2.0;
        system.add_motor(motor);
    });
    expect_refused("must be finite and not negative", [](auto& system) {
        SpringParameters spring;
        spring.first = 0;
        spring.second = 1;
        spring.second_point = {1.0, 0.0, 0.0};
        spring.stiffness = -1.0;
        system.add_spring(spring);
    });
    expect_refused("the friction coefficient is -0.1", [](auto& system) { system.add_material({-0.1, 0.0}); });
    expect_refused("the friction coefficient is 10000000000; it must be at least 0 and at most 10000",
                   [](auto& system) {
                       system.add_material({1e10, 0.0});
                   });
    expect_refused("the restitution is 1.5", [](auto& system) { system.add_material({0.1, 1.5}); });
    expect_refused("a shape has the material 0; there are 0", [](auto& system) { system.add_shape({}, 0); });
    expect_refused("has no mass and no element gives it any", [](auto& system) {
        system.add_node({});
        system.finish();
    });
}

TEST(Refusals, OfTheWrongOrder) {
    expect_refused("was not finished", [](auto& system) { static_cast<void>(system.initial_state()); });
    expect_refused("is finished", [](auto& system) {
        system.finish();
        system.add_body(good("c"));
    });
}

}  // namespace
}  // namespace delassus::input_test
