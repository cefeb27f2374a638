// SPDX-License-Identifier: BSD-3-Clause
// What a wrong scene is told: file, line, key, and what would be right.
#include <gtest/gtest.h>

#include "delassus/error.hpp"
#include "delassus/scene.hpp"
#include "support/run_command.hpp"

namespace delassus::tests::errors_test {
namespace {

const std::string head = "step: 0.01\nend: 1\n";
const std::string ball = "  - {name: ball, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}\n";
const std::string bodies = "bodies:\n" + ball;

struct Case {
    const char* name;
    std::string yaml, sentence;
};

void PrintTo(const Case& one, std::ostream* out) {
    *out << one.name;
}

class BadScene : public testing::TestWithParam<Case> {};

TEST_P(BadScene, IsToldInOneSentence) {
    try {
        static_cast<void>(parse_scene(GetParam().yaml, "s.yaml"));
        FAIL() << "was taken";
    } catch (const InputError& error) {
        EXPECT_EQ(std::string(error.what()), GetParam().sentence);
    }
}

INSTANTIATE_TEST_SUITE_P(
    Scene, BadScene,
    testing::Values(
        Case{"NotYaml", "a: [", "s.yaml, line 1: not valid YAML: end of sequence flow not found"},
        Case{"NoMap", "- a", "s.yaml: a scene must be a map of keys to values"},
        Case{"UnknownKey", head + "gravty: [0, 0, 0]\n" + bodies,
             "s.yaml, line 3: the scene has no key \"gravty\"; did you mean \"gravity\"?"},
        Case{"TwiceAKey", head + "step: 1\n" + bodies, "s.yaml, line 3: \"step\" is given twice"},
        Case{"NoStep", "end: 1\n" + bodies, "s.yaml, line 1: system \"main\" lacks the key \"step\", e.g. step: 0.001"},
        Case{"NoBodies", head,
             "s.yaml, line 1: system \"main\" lacks the key \"bodies\", e.g. bodies: [{name: ball, mass: 1, …}]"},
        Case{"NegativeStep", "step: -1\nend: 1\n" + bodies, "s.yaml, line 1: \"step\" is -1; it must be positive"},
        Case{"StepWithoutEnd", "step: 1e-300\nend: 1\n" + bodies,
             "s.yaml, line 1: \"step\" is 1e-300 s, of which a run until 1 s would take 1e+300; 1e+12 are the most"},
        Case{"UnknownBodyKey", head + "bodies:\n  - {name: b, mas: 1}\n",
             "s.yaml, line 4: a body has no key \"mas\"; did you mean \"mass\"?"},
        Case{"ZeroMass", head + "bodies:\n  - {name: b, mass: 0}\n",
             "s.yaml, line 4: \"mass\" is 0; it must be positive"},
        Case{"NanMass", head + "bodies:\n  - {name: b, mass: .nan}\n",
             "s.yaml, line 4: \"mass\" is nan; it must be finite"},
        Case{"InfinitePosition", head + "bodies:\n  - name: b\n    position: [0, .inf, 0]\n",
             "s.yaml, line 5: \"position\" is inf; it must be finite"},
        Case{"TextForNumber", head + "bodies:\n  - {name: b, mass: heavy}\n",
             "s.yaml, line 4: \"mass\" is \"heavy\"; it must be a number"},
        Case{"ShortVector", head + "bodies:\n  - {name: b, position: [0, 1]}\n",
             "s.yaml, line 4: \"position\" must be a list of 3 numbers"},
        Case{"NoMass", head + "bodies:\n  - {name: b}\n",
             "s.yaml, line 4: body \"b\" lacks the key \"mass\" (or \"density\", with shapes)"},
        Case{"NoInertia", head + "bodies:\n  - {name: b, mass: 1}\n",
             "s.yaml, line 4: body \"b\" lacks the key \"inertia\", and has no shapes from which it would follow"},
        Case{"Triangle", head + "bodies:\n  - {name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 3}}\n",
             "s.yaml, line 4: the inertia of body \"b\" has the principal moments 1, 1, 3; the largest exceeds the sum "
             "of the others, which no mass distribution has"},
        Case{"OffCentre",
             head + "bodies:\n  - {name: b, mass: 1, shapes: [{sphere: {radius: 1}, position: [2, 0, 0]}]}\n",
             "s.yaml, line 4: the mass centre of the shapes of body \"b\" is at (2, 0, 0) in its frame; it must be at "
             "the origin"},
        Case{"NoName", head + "bodies:\n  - {mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}\n",
             "s.yaml, line 4: a body lacks the key \"name\""},
        Case{"TwoOfAName", head + bodies + ball,
             "s.yaml, line 5: there are two bodies named \"ball\"; names must differ"},
        Case{"LongQuaternion", head + "bodies:\n  - {name: b, orientation: [1, 1, 0, 0]}\n",
             "s.yaml, line 4: \"orientation\" is a quaternion of length 1.414; it must have length 1"},
        Case{"NoAxis", head + "bodies:\n  - {name: b, orientation: {angle: 90}}\n",
             "s.yaml, line 4: the \"axis\" of \"orientation\" must be a vector that is not zero"},
        Case{"NegativeFriction", head + "materials:\n  ice: {friction: -0.1}\n" + bodies,
             "s.yaml, line 4: \"friction\" is -0.1; it must not be negative"},
        Case{"HugeFriction", head + "materials:\n  ice: {friction: 1e10}\n" + bodies,
             "s.yaml, line 4: \"friction\" is 10000000000; it must be at least 0 and at most 10000: beyond that, "
             "errors within "
             "any tolerance hide the velocity along the normal"},
        Case{"Restitution", head + "materials:\n  gum: {restitution: 1.5}\n" + bodies,
             "s.yaml, line 4: \"restitution\" is 1.5; it must be from 0 to 1"},
        Case{"MissingMaterial",
             head + "materials: {stone: {friction: 1}}\nbodies:\n  - {name: b, mass: 1, shapes: [{sphere: {radius: 1}, "
                    "material: stones}]}\n",
             "s.yaml, line 5: \"material\" is \"stones\", but there is no such material; did you mean \"stone\"?"},
        Case{"NoRadius", head + "bodies:\n  - {name: b, mass: 1, shapes: [{sphere: {}}]}\n",
             "s.yaml, line 4: \"sphere\" lacks the key \"radius\""},
        Case{"TwoKinds", head + "bodies:\n  - {name: b, shapes: [{plane: {}, sphere: {radius: 1}}]}\n",
             "s.yaml, line 4: a shape is of one kind, not of several"},
        Case{"MissingBody", head + bodies + "joints:\n  - {name: j, kind: spherical, second: bal}\n",
             "s.yaml, line 6: \"second\" is \"bal\", but there is no such body; did you mean \"ball\"?"},
        Case{"JointKind", head + bodies + "joints:\n  - {name: j, kind: revolut, second: ball}\n",
             "s.yaml, line 6: there is no kind of joint \"revolut\"; did you mean \"revolute\"?"},
        Case{"JointToItself", head + bodies + "joints:\n  - {name: j, kind: fixed, first: ball, second: ball}\n",
             "s.yaml, line 6: joint \"j\" joins a body to itself: \"first\" and \"second\" must differ"},
        Case{"MissingJoint", head + bodies + "motors:\n  - {name: m, joint: hinge, motion: 1}\n",
             "s.yaml, line 6: \"joint\" is \"hinge\", but there is no such joint; there are none"},
        Case{
            "EmptyMotion",
            head + bodies +
                "joints:\n  - {name: j, kind: revolute, second: ball}\nmotors:\n  - {name: m, joint: j, motion: {}}\n",
            "s.yaml, line 8: \"motion\" is empty; it must be constant, linear, sine, table, polynomial, ramp or input"},
        Case{"NegativeJointFriction",
             head + bodies + "joints:\n  - {name: j, kind: revolute, second: ball, friction: -1}\n",
             "s.yaml, line 6: \"friction\" is -1; it must not be negative"},
        Case{"SpringOfABallJoint",
             head + bodies + "joints:\n  - {name: j, kind: spherical, second: ball, spring: {stiffness: 1}}\n",
             "s.yaml, line 6: the joint \"j\" has no single angle for a spring, friction or start: spherical and "
             "universal "
             "joints take damping alone"},
        Case{"DampingOfAFixedJoint", head + bodies + "joints:\n  - {name: j, kind: fixed, second: ball, damping: 1}\n",
             "s.yaml, line 6: the joint \"j\" has no angle for a spring, damping, friction, armature or start: "
             "revolute and "
             "cylindrical "
             "joints have, and spherical and universal ones take damping"},
        Case{"DampingOfACylindricalJoint",
             head + bodies + "joints:\n  - {name: j, kind: cylindrical, second: ball, damping: 1}\n",
             "s.yaml, line 6: the cylindrical joint \"j\" has two coordinates: give damping, spring, friction, "
             "armature and "
             "start in "
             "\"slide: {…}\" and \"turn: {…}\""},
        Case{"SlideOfARevoluteJoint",
             head + bodies + "joints:\n  - {name: j, kind: revolute, second: ball, slide: {damping: 1}}\n",
             "s.yaml, line 6: \"slide\" and \"turn\" are for cylindrical joints; the joint \"j\" takes \"damping\", "
             "\"spring\", \"friction\", \"armature\" and \"start\" themselves"},
        Case{"StartBeyondTheLimits",
             head + bodies + "joints:\n  - {name: j, kind: revolute, second: ball, upper: 1, start: 1.2}\n",
             "s.yaml, line 6: the start of the joint \"j\" lies beyond its limits"},
        Case{"StartOfASphericalJoint",
             head + bodies + "joints:\n  - {name: j, kind: spherical, second: ball, start: 1}\n",
             "s.yaml, line 6: the joint \"j\" has no single angle for a spring, friction or start: spherical and "
             "universal "
             "joints take damping alone"},
        Case{"JointSpringWithoutStiffness",
             head + bodies + "joints:\n  - {name: j, kind: revolute, second: ball, spring: {rest: 1}}\n",
             "s.yaml, line 6: \"spring\" lacks the key \"stiffness\""},
        Case{
            "ActuatorWithoutGains",
            head + bodies +
                "joints:\n  - {name: j, kind: revolute, second: ball}\nactuators:\n  - {name: m, joint: j, speed: 1}\n",
            "s.yaml, line 8: the gains of the actuator \"m\" must be finite and not negative, and kp or kd must be "
            "positive"},
        Case{"ActuatorWithoutAPosition",
             head + bodies +
                 "joints:\n  - {name: j, kind: revolute, second: ball}\nactuators:\n  - {name: m, joint: j, kp: 1}\n",
             "s.yaml, line 8: the actuator \"m\" has a kp, but no position to go to"},
        Case{"ActuatorOfABallJoint",
             head + bodies +
                 "joints:\n  - {name: j, kind: spherical, second: ball}\nactuators:\n  - {name: m, joint: j, kd: 1, "
                 "speed: 2}\n",
             "s.yaml, line 8: the actuator \"m\" must drive a revolute or a prismatic joint"},
        Case{"FixedAndMoving", head + "bodies:\n  - {name: b, fixed: true, motion: {translation: [1, 0, 0]}}\n",
             "s.yaml, line 4: body \"b\" is fixed, and has a \"motion\"; give one of them"},
        Case{"KinematicWithAVelocity",
             head + "bodies:\n  - {name: b, velocity: [1, 0, 0], motion: {translation: [1, 0, 0]}}\n",
             "s.yaml, line 4: the velocities of body \"b\" follow from its \"motion\"; give no \"velocity\" and no "
             "\"angular_velocity\""},
        Case{"EmptyBodyMotion", head + "bodies:\n  - {name: b, motion: {}}\n",
             "s.yaml, line 4: \"motion\" is empty; it must have a translation or a rotation"},
        Case{"RotationWithoutAngle", head + "bodies:\n  - {name: b, motion: {rotation: {axis: [0, 0, 1]}}}\n",
             "s.yaml, line 4: \"rotation\" lacks the key \"angle\""},
        Case{"RotationAboutNothing", head + "bodies:\n  - {name: b, motion: {rotation: {axis: [0, 0, 0], angle: 1}}}\n",
             "s.yaml, line 4: the axis of the motion of body \"b\" has no direction"},
        Case{"TableThatGoesBack",
             head + bodies +
                 "loads:\n  - {name: l, body: ball, force: [{table: {times: [0, 2, 1], values: [0, 1, 2]}}, 0, 0]}\n",
             "s.yaml, line 6: the times of a table must ascend, and 2 is followed by 1"},
        Case{"TableOfUnknownKind",
             head + bodies + "loads:\n  - {name: l, body: ball, force: [{table: {interpolation: quintic}}, 0, 0]}\n",
             "s.yaml, line 6: \"interpolation\" is \"quintic\"; it must be linear or cubic"},
        Case{"RampWithoutEnd",
             head + bodies + "loads:\n  - {name: l, body: ball, force: [{ramp: {duration: 1}}, 0, 0]}\n",
             "s.yaml, line 6: \"ramp\" lacks the key \"to\""},
        Case{"RoughRamp",
             head + bodies +
                 "loads:\n  - {name: l, body: ball, force: [{ramp: {to: 1, duration: 1, smoothness: 3}}, 0, 0]}\n",
             "s.yaml, line 6: \"smoothness\" is 3; it must be 1 or 2"},
        Case{"EmptyPolynomial", head + bodies + "loads:\n  - {name: l, body: ball, force: [{polynomial: []}, 0, 0]}\n",
             "s.yaml, line 6: a polynomial needs one finite coefficient or more"},
        Case{"NegativeStiffness", head + bodies + "springs:\n  - {name: s, second: ball, stiffness: -1}\n",
             "s.yaml, line 6: \"stiffness\" is -1; it must not be negative"},
        Case{"RepeatedName",
             head + "bodies:\n  - {name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, repeat: {count: 2}}\n",
             "s.yaml, line 4: there are two bodies named \"b\"; names must differ"},
        Case{"RepeatPattern",
             head + "bodies:\n  - {name: \"b{n}\", mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, repeat: {count: 2}}\n",
             "s.yaml, line 4: \"name\" holds {n}; a repeated name may hold {i}, {j}, {k}, and {i+1} or {i-1} for its "
             "neighbours"},
        Case{"RepeatCount", head + "bodies:\n  - {name: \"b{i}\", mass: 1, repeat: {count: 0}}\n",
             "s.yaml, line 4: \"count\" is 0; it must be from 1 to 1000000"},
        Case{"KeyInSystem", "systems:\n  left:\n    step: 0.01\n    end: 1\n    bodys: []\n",
             "s.yaml, line 5: the system \"left\" has no key \"bodys\"; did you mean \"bodies\"?"},
        Case{"SystemName", "systems:\n  a/b: {}\n",
             "s.yaml, line 2: \"a/b\" cannot name a system; use letters, digits, _ and -"},
        Case{"GearOfItself", head + bodies + "joints:\n  - {name: g, kind: gear, gear_first: g, gear_second: g}\n",
             "s.yaml, line 6: \"gear_first\" is \"g\", but there is no such joint; there are none"},
        Case{"AliasOfItself", head + "bodies: &all\n  - *all\n",
             "s.yaml, line 3: an item of \"bodies\" must be a map of keys to values"},
        Case{"ShapeIsNoMap", head + "bodies:\n  - {name: b, fixed: true, shapes: [{box: [1, 1, 1]}]}\n",
             "s.yaml, line 4: \"box\" must be a map of keys to values; its keys are size"},
        Case{"InvertedElements", head + "elastic_blocks:\n  - {name: e, edges: [1, 1, -1], cells: [1, 1, 1]}\n",
             "s.yaml, line 4: the edges of the elastic block \"e\" must be positive and finite"},
        Case{"FlatConvex",
             head + "bodies:\n  - {name: b, mass: 1, shapes: [{convex: {points: [[0, 0, 0], [1, 0, 0], [0, 1, 0], "
                    "[1, 1, 0]]}}]}\n",
             "s.yaml, line 4: the points of a convex shape must span a volume"},
        Case{"NoPoints", head + "bodies:\n  - {name: b, mass: 1, shapes: [{convex: {}}]}\n",
             "s.yaml, line 4: \"convex\" lacks the key \"points\""},
        Case{"NoKind", head + "bodies:\n  - {name: b, mass: 1, shapes: [{margin: 1}]}\n",
             "s.yaml, line 4: a shape must have one of the keys \"sphere\", \"box\", \"capsule\", \"cylinder\", "
             "\"plane\", \"convex\", \"mesh\", \"terrain\", \"height_field\""},
        Case{"PlaneMoves", head + "bodies:\n  - {name: b, mass: 1, shapes: [{plane: {}}]}\n",
             "s.yaml, line 4: a plane is for fixed bodies only, and body \"b\" moves; use a box"},
        Case{"PlaneThatNothingCanTouch",
             head + "bodies:\n  - {name: a, fixed: true}\n  - {name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1},\n"
                    "     shapes: [{plane: {}}]}\n",
             "s.yaml, line 6: a plane is for fixed bodies only, and body \"b\" moves; use a box"},
        Case{"TerrainMoves",
             head + "bodies:\n  - {name: b, mass: 1, shapes: [{height_field: {heights: [[0, 0], [0, 0]], size: [1, "
                    "1]}}]}\n",
             "s.yaml, line 4: terrain is for fixed bodies only, and body \"b\" moves; use convex shapes"}),
    [](const auto& parameter) { return std::string(parameter.param.name); });

TEST(BadSceneFile, EndsTheCommandWithCodeTwoAndOneSentence) {
    const ScratchFolder scratch;
    const auto file = scratch / "s.yaml";
    std::ofstream(file) << head << "bodies:\n  - {name: b, mass: 0}\n";
    for (const std::string command : {"run ", "plan "}) {
        const auto result = run_command(command + file.string());
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_EQ(result.err, "delassus: " + file.string() + ", line 4: \"mass\" is 0; it must be positive\n");
        EXPECT_EQ(result.out, "");
    }
}

std::string told(const std::string& path, const std::string& value) {
    SceneOverrides overrides;
    overrides.values = {{path, value}};
    try {
        static_cast<void>(parse_scene(head + bodies, "s.yaml", overrides));
    } catch (const InputError& error) {
        return error.what();
    }
    return "taken";
}

TEST(SceneOverride, LeadsByNameOrPosition) {
    EXPECT_EQ(told("bodies.ball.mass", "3"), "taken");
    EXPECT_EQ(told("bodies.0.inertia.xx", "1.5"), "taken");
    EXPECT_EQ(told("solver", "{name: pgs, options: {omega: 1}}"), "taken");
    EXPECT_EQ(told("bodies.bal.mass", "3"),
              "--set bodies.bal.mass=3: there is no item \"bal\"; did you mean \"ball\"?");
    EXPECT_EQ(told("bodis.ball.mass", "3"),
              "--set bodis.ball.mass=3: there is no key \"bodis\"; did you mean \"bodies\"?");
    EXPECT_EQ(told("step.x.y", "3"), "--set step.x.y=3: \"x\" leads into a single value");
    EXPECT_EQ(told("bodies.ball.mass", "-1"), "--set bodies.ball.mass=-1: \"mass\" is -1; it must be positive");
    EXPECT_EQ(told("stpe", "1"), "--set stpe=1: the scene has no key \"stpe\"; did you mean \"step\"?");
}

}  // namespace
}  // namespace delassus::tests::errors_test
