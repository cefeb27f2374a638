// SPDX-License-Identifier: BSD-3-Clause
// What today's MJCF has, and libmujoco 2.2 refuses; and what is mended, lost or refused.
#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "delassus/error.hpp"
#include "delassus/simulation.hpp"
#include "import/imported.hpp"

#ifdef DELASSUS_HAS_MJCF

namespace delassus::tests {
namespace import_mjcf {

const std::string bob = "<geom type='sphere' size='0.1'/>";

/// The scene of a model given as text; other files lie beside it.
struct Made {
    ScratchFolder folder;
    ImportedScene text;
    YAML::Node scene;

    explicit Made(const std::string& model, const ImportSettings& settings = {},
                  const std::map<std::string, std::string>& files = {}) {
        for (const auto& [name, content] : files) std::ofstream(folder / name) << content;
        std::ofstream(folder / "model.xml") << model;
        text = import_model(folder / "model.xml", folder / "scene.yaml", settings);
        scene = YAML::Load(text.yaml);
    }
    [[nodiscard]] YAML::Node named(const char* list, const std::string& name) const {
        for (std::size_t i = 0; i < scene[list].size(); ++i)
            if (scene[list][i]["name"].as<std::string>() == name) return scene[list][i];
        ADD_FAILURE() << "no " << name << " among " << list << "\n" << text.yaml;
        return {};
    }
    [[nodiscard]] double inertia(const std::string& body, const char* key) const {
        const YAML::Node value = named("bodies", body)["inertia"][key];
        return value ? value.as<double>() : 0.0;
    }
};

std::string mjcf(const std::string& world, const std::string& before = "", const std::string& after = "") {
    return "<mujoco>" + before + "<worldbody>" + world + "</worldbody>" + after + "</mujoco>";
}

// The same controls, constant from a keyframe and as inputs that are set: the same motion. Those of the third keyframe
// lie beyond the ranges.
TEST(ImportMjcfToday, ControlsBecomeInputs) {
    const std::string model =
        mjcf("<body name='a'><joint name='j' damping='0.1' ref='20'/>" + bob +
                 "<geom type='sphere' size='0.05' pos='0.3 0 0'/>" +
                 "<body name='b' pos='0.5 0 0'><joint name='s' type='slide' axis='1 1 0'/>" + bob +
                 "<body name='c' pos='0 0 0.4'><joint name='k' axis='0 1 0'/>" + bob + "</body></body></body>",
             "<option gravity='0 0 0' timestep='0.002'/>",
             "<actuator><motor name='push' joint='s' gear='2' ctrlrange='-3 3' forcerange='-4 2'/>"
             "<position name='servo' joint='j' kp='30' kv='4' ctrlrange='-1 1'/>"
             "<velocity name='spin' joint='k' kv='0.5'/>"
             "<general name='offset' joint='k' gainprm='3' biastype='affine' biasprm='0.2 0 0'/></actuator>"
             "<keyframe><key name='rest' ctrl='0.1 0.2 0.3 0.4'/><key name='driven' ctrl='1.5 -0.5 2 -1'/>"
             "<key name='beyond' ctrl='2.7 4 -2 1'/></keyframe>");
    const auto run = [&](const char* key, bool inputs, const std::vector<double>& controls) {
        ImportSettings settings;
        settings.keyframe = key;
        settings.inputs = inputs;
        settings.end = 0.3;
        const Made made(model, settings);
        Scene scene = read_scene([&] {
            std::ofstream(made.folder / "scene.yaml") << made.text.yaml;
            return made.folder / "scene.yaml";
        }());
        const Registry registry;
        Simulation simulation(scene.systems.at(0), registry);
        const std::vector<std::string> names = {"push", "servo", "spin", "offset"};
        EXPECT_EQ(scene.systems[0].inputs.names().size(), inputs ? 4u : 0u) << made.text.yaml;
        for (std::size_t k = 0; k < controls.size(); ++k) simulation.set_input(names[k], controls[k]);
        while (!simulation.finished()) simulation.step();
        return simulation.state();
    };
    const auto expect_equal = [](const State& a, const State& b) {
        ASSERT_EQ(a.v.size(), b.v.size());
        for (std::size_t k = 0; k < a.v.size(); ++k) EXPECT_NEAR(a.v[k], b.v[k], 1e-5) << k;
    };
    const State driven = run("driven", false, {}), beyond = run("beyond", false, {});
    EXPECT_GT(std::abs(driven.v[0]) + std::abs(driven.v[1]), 0.01);
    expect_equal(run("driven", true, {}), driven);
    expect_equal(run("rest", true, {1.5, -0.5, 2.0, -1.0}), driven);
    expect_equal(run("rest", true, {2.7, 4.0, -2.0, 1.0}), beyond);
}

TEST(ImportMjcfToday, TakesAttributesThatOlderReadersRefuse) {
    const Made made(
        mjcf("<body name='a' gravcomp='0'><joint name='j' range='-90 90' actuatorfrcrange='-3 3'/>" + bob +
                 "</body><body name='b' pos='1 0 0'><freejoint align='true'/>" + bob + "</body>",
             "<size memory='1M'/><option integrator='implicitfast'/><compiler autolimits='true'/>",
             "<actuator><position name='servo' joint='j' kp='100' dampratio='1' ctrlrange='-1 1'/></actuator>"));
    EXPECT_TRUE(made.text.lost.empty()) << made.text.yaml;
    const YAML::Node joint = made.named("joints", "j");
    EXPECT_NEAR(joint["lower"].as<double>(), -0.5 * M_PI, 1e-15);
    const YAML::Node servo = made.named("actuators", "servo");
    // kv = 2 √(kp J), J = 2/5 m r² of a ball about its centre
    const double mass = 1000.0 * 4.0 / 3.0 * M_PI * 1e-3;
    EXPECT_NEAR(servo["kd"].as<double>(), 2.0 * std::sqrt(100.0 * 0.4 * mass * 0.01), 1e-12);
    EXPECT_EQ(servo["limit"].as<double>(), 3.0);
}

TEST(ImportMjcfToday, PutsFramesReplicasAndAttachedModelsTogether) {
    const std::string child =
        "<mujoco model='finger'><compiler angle='radian'/><default><geom density='500'/></default><worldbody>"
        "<body name='tip' pos='0 0 1'><joint name='bend' range='-1 1'/>" +
        bob + "</body></worldbody><actuator><position name='pull' joint='bend' kp='5'/></actuator></mujoco>";
    const Made made(
        mjcf("<frame pos='1 0 0' euler='0 0 90'><body name='hand' pos='1 0 0'><freejoint/>" + bob +
                 "<attach model='finger' body='tip' prefix='left_'/></body></frame>"
                 "<replicate count='3' offset='0 2 0' sep='_'><body name='post' pos='5 0 0'><joint name='p'/>" +
                 bob + "</body></replicate>",
             "<asset><model name='finger' file='finger.xml'/></asset>",
             "<actuator><velocity name='v' joint='p' kv='2'/></actuator>"),
        {}, {{"finger.xml", child}});
    const YAML::Node hand = made.named("bodies", "hand"), tip = made.named("bodies", "left_tip");
    EXPECT_NEAR(hand["position"][0].as<double>(), 1.0, 1e-15);
    EXPECT_NEAR(hand["position"][1].as<double>(), 1.0, 1e-15);
    EXPECT_NEAR(tip["position"][2].as<double>(), 1.0, 1e-15);
    EXPECT_NEAR(tip["mass"].as<double>(), 0.5 * hand["mass"].as<double>(), 1e-12);  // the child's own defaults
    EXPECT_EQ(made.named("joints", "left_bend")["upper"].as<double>(), 1.0);        // and its own unit of angles
    EXPECT_EQ(made.named("actuators", "left_pull")["joint"].as<std::string>(), "left_bend");
    EXPECT_NEAR(made.named("bodies", "post_2")["position"][1].as<double>(), 4.0, 1e-15);
    EXPECT_EQ(made.named("actuators", "v_1")["joint"].as<std::string>(), "p_1");
}

// A tetrahedron with right angles and edges of 1: volume 1/6, its centre at 1/4, ∫x² over it 1/60.
TEST(ImportMjcfToday, WeighsMeshesByTheirVolumeOrSurface) {
    const std::string vertices = "vertex='0 0 0 1 0 0 0 1 0 0 0 1' face='0 2 1 0 1 3 0 3 2 1 2 3'";
    const auto model = [&](const std::string& kind) {
        return mjcf("<body name='t'><freejoint/><geom type='mesh' mesh='m' density='6'/></body>",
                    "<asset><mesh name='m' inertia='" + kind + "' " + vertices + "/></asset>");
    };
    for (const char* kind : {"exact", "legacy", "convex"}) {
        const Made made(model(kind));
        EXPECT_NEAR(made.named("bodies", "t")["mass"].as<double>(), 1.0, 1e-14) << kind;
        EXPECT_NEAR(made.named("bodies", "t")["position"][0].as<double>(), 0.25, 1e-14) << kind;
        EXPECT_NEAR(made.inertia("t", "xx"), 2.0 * (6.0 / 60.0 - 1.0 / 16.0), 1e-14) << kind;
    }
    const Made shell(model("shell"));
    EXPECT_NEAR(shell.named("bodies", "t")["mass"].as<double>(), 6.0 * (1.5 + std::sqrt(3.0) / 2.0), 1e-13);
    EXPECT_NE(import_model(model_file("meshes.xml"), "scene.yaml").yaml.find("mass: 2"), std::string::npos);
}

// A mesh that is not there has a mass that is not known, or is known without its moments: both are said.
TEST(ImportMjcfToday, SaysThatTheMassOfAMissingMeshIsMissing) {
    const Made made(
        mjcf("<body name='a'><joint/>" + bob +
                 "<geom name='m' type='mesh' mesh='m' contype='0' conaffinity='0'/></body>"
                 "<body name='b' pos='1 0 0'><freejoint/><geom name='n' type='mesh' mesh='m' mass='2'/></body>",
             "<asset><mesh name='m' file='away.stl'/></asset>"));
    const auto lost = items(made.text.lost);
    ASSERT_GE(lost.size(), 3U) << made.text.yaml;
    EXPECT_EQ(lost[0], "geom \"m\"");
    EXPECT_EQ(lost[1], "geom \"n\"");
    EXPECT_EQ(lost.back(), "body \"b\"");  // its moments
    EXPECT_NE(made.text.lost[0].why.find("its mass: its mesh \"m\" is of no use: the file is not there"),
              std::string::npos);
    EXPECT_EQ(made.named("bodies", "b")["mass"].as<double>(), 2.0);
}

// Masks are of geoms: of the two balls of a body one touches the ground, the other passes through it.
TEST(ImportMjcfToday, MasksAreOfGeoms) {
    const std::string model = mjcf(
        "<geom name='floor' type='plane' size='1 1 1' contype='1' conaffinity='1'/>"
        "<body name='a' pos='0 0 0.05'><freejoint/><geom name='felt' type='sphere' size='0.1' contype='1' "
        "conaffinity='1'/>"
        "<geom name='ghost' type='sphere' size='0.1' pos='1 0 0' contype='2' conaffinity='2'/></body>"
        "<body name='b' pos='3 0 1'><freejoint/><geom name='other' type='sphere' size='0.1' contype='3' "
        "conaffinity='3'/></body>");
    Made made(model);
    EXPECT_TRUE(made.text.lost.empty()) << made.text.yaml;
    int passing = 0;
    for (const auto& pair : made.scene["material_pairs"])
        if (pair["touch"] && !pair["touch"].as<bool>()) ++passing;
    EXPECT_EQ(passing, 1) << made.text.yaml;
    Scene scene = parse_scene(made.text.yaml, "scene");
    MultibodySystem& system = *scene.systems.front().system;
    system.assemble();
    UnilateralRows rows;
    system.collect_unilateral(system.initial_state(), 0.001, rows);
    EXPECT_EQ(rows.contacts().size(), 1U);
}

TEST(ImportMjcfToday, WhatIsUnknownIsALoss) {
    const Made made(
        mjcf("<body><joint name='j' hum='1'/>" + bob + "<wing span='2'/></body><composite type='cable' prefix='C'/>",
             "", "<future x='1'/><equality><joint joint1='j' joint2='Clast'/></equality>"));
    EXPECT_EQ(items(made.text.lost),
              (std::vector<std::string>{"composite \"C\"", "joint \"\"", "attribute hum of <joint>", "element <wing>",
                                        "element <future>"}));
    EXPECT_FALSE(made.text.yaml.empty());
}

std::string refusal_of(const std::string& model) {
    try {
        const Made made(model);
    } catch (const InputError& error) {
        const std::string what = error.what();
        return what.substr(what.find("model.xml"));
    }
    return "";
}

TEST(ImportMjcfToday, RefusesWithFileAndLine) {
    EXPECT_EQ(refusal_of(mjcf("\n<body><joint range='1 x'/>" + bob + "</body>")),
              "model.xml: line 2: <joint>: range=\"1 x\" is to be numbers, and \"x\" is none");
    EXPECT_EQ(refusal_of(mjcf("<body>\n<geom size='1 2 3 4'/></body>")),
              "model.xml: line 2: <geom>: size has 4 numbers in place of 1 to 3");
    EXPECT_EQ(refusal_of(mjcf("<body><joint class='none'/></body>")),
              "model.xml: line 1: <joint>: there is no class \"none\" of defaults");
    EXPECT_EQ(refusal_of(mjcf("<body><joint/>" + bob + "</body>", "", "<actuator>\n<motor joint='k'/></actuator>")),
              "model.xml: line 2: <motor>: there is no joint \"k\"");
    EXPECT_EQ(refusal_of(mjcf("<body><geom type='mesh' mesh='m'/></body>")),
              "model.xml: line 1: <geom>: there is no mesh \"m\"");
    EXPECT_EQ(refusal_of("<mujoco>\n<include file='away.xml'/></mujoco>"),
              "model.xml: line 2: <include>: there is no file \"away.xml\"");
    EXPECT_EQ(refusal_of("<mujoco><include file='model.xml'/></mujoco>").find("includes itself") == std::string::npos,
              false);
    EXPECT_NE(refusal_of(mjcf("<replicate count='1000000000'><body/></replicate>")).find("more than 1000000 parts"),
              std::string::npos);
}

// For a second: pieces of a model cut off, and characters of it replaced, are taken or refused with one sentence.
TEST(ImportMjcfToday, DamagedModelsGiveOneSentence) {
    std::ifstream file(model_file("everything.xml"));
    const std::string whole((std::istreambuf_iterator<char>(file)), {});
    std::mt19937 random(3);
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(1);
    int refused = 0;
    for (int k = 0; k < 400 && std::chrono::steady_clock::now() < end; ++k) {
        std::string text = whole;
        const std::size_t place = random() % text.size();
        if (k % 3 == 0)
            text.resize(place);
        else
            text[place] = k % 3 == 1 ? "x0-.9<\"' >"[random() % 10] : static_cast<char>(random() % 256);
        try {
            const Made made(text);
        } catch (const InputError& error) {
            ++refused;
            const std::string what = error.what();
            EXPECT_EQ(what.find('\n'), std::string::npos) << what;
            EXPECT_EQ(what.find("is damaged"), std::string::npos) << what;  // the reader crashed
        }
    }
    EXPECT_GT(refused, 0);
}

TEST(ImportRepairs, BalancesInertiasAndDropsFlatShapes) {
    const Made made(
        mjcf("<body name='a'><joint name='j'/><inertial pos='0 0 0' mass='1' diaginertia='0.1 0.1 0.5'/>"
             "<geom name='dot' type='sphere' size='0' mass='0'/></body><body name='z' pos='3 0 0'><freejoint/>"
             "<inertial pos='0 0 0' mass='2' diaginertia='0 0 0'/>" +
             bob + "</body>"));
    // S = diag(0.25, 0.25, −0.15) loses its negative entry.
    EXPECT_NEAR(made.inertia("a", "xx"), 0.25, 1e-12);
    EXPECT_NEAR(made.inertia("a", "zz"), 0.5, 1e-12);
    const double radius = std::cbrt(3.0 * 2.0 / (4.0 * M_PI * 1000.0));
    EXPECT_NEAR(made.inertia("z", "yy"), 0.8 * radius * radius, 1e-12);
    EXPECT_EQ(items(made.text.lost), (std::vector<std::string>{"shape \"dot\"", "body \"a\"", "body \"z\""}))
        << made.text.yaml;
    Scene scene = parse_scene(made.text.yaml, "scene");
    EXPECT_NO_THROW((void)scene.systems.front().system->assemble());
}

TEST(ImportRepairs, GroupsLosses) {
    std::vector<NotCarriedOver> all;
    for (int k = 0; k < 5; ++k) all.push_back({"geom \"" + std::to_string(k) + "\"", "a size of " + std::to_string(k)});
    all.push_back({"joint \"j\"", "spring"});
    const auto lines = grouped(all);
    ASSERT_EQ(lines.size(), 2U);
    EXPECT_EQ(lines[0].what, "5 × geom \"0\", geom \"1\", geom \"2\" and 2 more");
    EXPECT_EQ(lines[0].why, "a size of 0 (the first; the others have other numbers or names)");
    EXPECT_EQ(lines[1].what, "joint \"j\"");
}

TEST(ImportGround, LiesUnderTheModelAndABaseIsHeld) {
    const std::string model = mjcf(
        "<body name='base' pos='0 0 7'><freejoint/><geom name='b' type='box' size='0.2 0.2 0.1'/>"
        "<body name='leg' pos='0 0 -0.1'><joint name='hip' axis='0 1 0'/>"
        "<geom name='l' type='capsule' fromto='0 0 0 0 0 -0.5' size='0.05'/></body></body>");
    ImportSettings settings;
    settings.ground = true;
    settings.height = 0.25;
    const Made made(model, settings);
    EXPECT_NEAR(made.named("bodies", "base")["position"][2].as<double>(), 0.25 + 0.05 + 0.5 + 0.1, 1e-12);
    EXPECT_TRUE(made.named("bodies", "added ground")["fixed"].as<bool>());
    settings = {};
    settings.fixed_base = true;
    const Made held(model, settings);
    EXPECT_TRUE(held.named("bodies", "base")["fixed"].as<bool>());
    EXPECT_FALSE(held.named("bodies", "leg")["fixed"]);
    EXPECT_THROW(Made(mjcf("<body><joint/>" + bob + "</body>"), settings), InputError);
}

TEST(ImportCommand, NamesOverlapsAndTakesThemOut) {
    const ScratchFolder folder;
    std::ofstream(folder / "m.xml") << mjcf(
        "<body name='a'><freejoint/><geom type='box' size='0.1 0.1 0.1'/></body>"
        "<body name='b' pos='0.1 0 0'><freejoint/><geom type='box' size='0.1 0.1 0.1'/></body>");
    const std::string call = "import " + (folder / "m.xml").string() + " -o " + (folder / "s.yaml").string();
    const auto told = run_command(call);
    ASSERT_EQ(told.exit_code, 0) << told.err;
    EXPECT_NE(told.out.find("--part-overlaps"), std::string::npos) << told.out;
    EXPECT_NE(told.out.find("\"a\" and \"b\": 0.1 m"), std::string::npos) << told.out;
    const auto parted = run_command(call + " --part-overlaps");
    ASSERT_EQ(parted.exit_code, 0) << parted.err;
    EXPECT_EQ(YAML::LoadFile((folder / "s.yaml").string())["keep_apart"].size(), 1U);
}

// A shin overlaps the pelvis over the knee and the hip, whose three hinges have no masses between them; the foot is a
// joint too far.
TEST(ImportCommand, KeepsOverlapsNearAJointApart) {
    const ScratchFolder folder;
    const auto part = [](const char* name, double x, const std::string& joints, const std::string& rest) {
        return fmt::format("<body name='{}' pos='{} 0 0'>{}<geom type='box' size='0.1 0.1 0.1'/>{}</body>", name, x,
                           joints, rest);
    };
    const std::string hinge = "<joint axis='0 1 0'/>",
                      hip = "<joint axis='1 0 0'/><joint axis='0 1 0'/><joint axis='0 0 1'/>";
    std::ofstream(folder / "m.xml") << mjcf(
        part("pelvis", 0.0, "<freejoint/>",
             part("thigh", 0.05, hip, part("shin", 0.05, hinge, part("foot", 0.05, hinge, "")))));
    const std::string call = "import " + (folder / "m.xml").string() + " -o " + (folder / "s.yaml").string();
    const auto pairs = [&] {
        std::vector<std::string> names;
        for (const auto& pair : YAML::LoadFile((folder / "s.yaml").string())["keep_apart"])
            names.push_back(pair[0].as<std::string>() + " " + pair[1].as<std::string>());
        std::ranges::sort(names);
        return names;
    };
    const auto near = run_command(call);
    ASSERT_EQ(near.exit_code, 0) << near.err;
    EXPECT_NE(near.out.find("--keep-overlaps"), std::string::npos) << near.out;
    EXPECT_NE(near.out.find("--part-overlaps"), std::string::npos) << near.out;
    const std::vector<std::string> neighbours = pairs();
    ASSERT_EQ(run_command(call + " --keep-overlaps").exit_code, 0);
    const std::vector<std::string> none = pairs();
    ASSERT_EQ(run_command(call + " --part-overlaps").exit_code, 0);
    const std::vector<std::string> all = pairs();
    EXPECT_EQ(neighbours.size(), none.size() + 2);
    EXPECT_EQ(all.size(), none.size() + 3);
    EXPECT_TRUE(std::ranges::count(neighbours, "pelvis shin") + std::ranges::count(neighbours, "shin pelvis") == 1);
    EXPECT_EQ(run_command(call + " --part-overlaps --keep-overlaps").exit_code, 2);
}

#ifdef DELASSUS_HAS_URDF
TEST(ImportUrdfLosses, StrictRefusesWhatTheLibraryPassesOver) {
    const ScratchFolder folder;
    const std::string link =
        "<inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>";
    std::ofstream(folder / "m.urdf")
        << "<robot name='r'><link name='a'/><link name='b'>" + link +
               "</link><joint name='j' type='continuous'><parent link='a'/><child link='b'/><axis xyz='0 1 0'/></joint>"
               "<loop_joint name='loop'/><gazebo reference='b'><mu1>0.2</mu1></gazebo></robot>";
    EXPECT_EQ(items(import_model(folder / "m.urdf", folder / "s.yaml").lost),
              (std::vector<std::string>{"loop_joint \"loop\"", "gazebo \"b\""}));
    const auto strict =
        run_command("import " + (folder / "m.urdf").string() + " --strict -o " + (folder / "s.yaml").string());
    EXPECT_EQ(strict.exit_code, 2);
}
#endif

#ifdef DELASSUS_HAS_SDF
TEST(ImportSdfLosses, SoftContactsAreLost) {
    const ScratchFolder folder;
    std::ofstream(folder / "m.sdf")
        << "<sdf version='1.7'><model name='m'><link name='a'><collision name='c'><geometry><sphere><radius>1</radius>"
           "</sphere></geometry><surface><contact><ode><kp>1e5</kp><soft_cfm>0.1</soft_cfm></ode></contact></surface>"
           "</collision></link></model></sdf>";
    const auto lost = import_model(folder / "m.sdf", folder / "s.yaml").lost;
    ASSERT_EQ(lost.size(), 1U);
    EXPECT_EQ(lost[0].why, "kp, soft_cfm: contacts are rigid");
}
#endif

// torquescale 0: the anchor in the second body stays where it is in the first, and the second body turns about it.
TEST(ImportMjcfToday, AWeldWithoutTorquesIsAConnection) {
    const std::string ball = "<freejoint/><geom type='sphere' size='0.1' contype='0' conaffinity='0'/></body>";
    const auto welded = [&](const std::string& how) {
        return Made(mjcf("<body name='a' pos='0 0 1'>" + ball + "<body name='b' pos='1 0 1'>" + ball, "",
                         "<equality><weld name='w' body1='a' body2='b' " + how + "/></equality>"));
    };
    const Made loose = welded("torquescale='0' anchor='-0.5 0 0'");
    EXPECT_TRUE(loose.text.lost.empty()) << loose.text.yaml;
    EXPECT_EQ(loose.named("joints", "w")["kind"].as<std::string>(), "spherical");
    EXPECT_EQ(loose.named("joints", "w")["point"][0].as<double>(), 0.5);
    const Made posed =
        welded("torquescale='0' anchor='-0.4 0 0' relpose='0.6 0 0 0 1 0 0'");  // turned, but not held so
    EXPECT_EQ(posed.named("joints", "w")["point"][0].as<double>(), 0.6);
    const Made rigid = welded("");
    EXPECT_EQ(rigid.named("joints", "w")["kind"].as<std::string>(), "fixed");
    const Made half = welded("torquescale='0.5'");
    ASSERT_EQ(half.text.lost.size(), 1U);
    EXPECT_EQ(half.text.lost[0].why, "torquescale 0.5: the weld is rigid");
    EXPECT_EQ(half.named("joints", "w")["kind"].as<std::string>(), "fixed");
}

TEST(ImportMjcfToday, RefusesTwoOrientationsZeroOnesAndNamesThatAreThereTwice) {
    const auto refusal = [](const std::string& model) -> std::string {
        try {
            const Made made(model);
        } catch (const InputError& error) {
            const std::string what = error.what();
            return what.substr(what.find("line"));
        }
        return "";
    };
    EXPECT_EQ(refusal(mjcf("<body euler='0 0 3' quat='1 0 0 0'><freejoint/>" + bob + "</body>")),
              "line 1: <body>: it has two orientations, quat and euler");
    EXPECT_EQ(refusal(mjcf("<body><freejoint/><geom size='0.1' zaxis='0 0 1' axisangle='0 0 1 1'/></body>")),
              "line 1: <geom>: it has two orientations, axisangle and zaxis");
    EXPECT_EQ(refusal(mjcf("<body quat='0 0 0 0'><freejoint/>" + bob + "</body>")),
              "line 1: <body>: quat is no rotation: its numbers are all 0");
    const std::string hinge = "<body name='a'><joint name='j'/>" + bob + "</body>";
    const std::string two = "<motor name='m' joint='j'/><motor name='m' joint='j'/>";
    EXPECT_EQ(refusal(mjcf(hinge, "", "<actuator>" + two + "</actuator>")),
              "line 1: <motor>: there is another actuator \"m\"");
    EXPECT_EQ(
        refusal(mjcf(hinge, "",
                     "<equality><joint name='e' joint1='j'/><weld name='e' body1='a' active='false'/></equality>")),
        "line 1: <weld>: there is another equality \"e\"");
    EXPECT_EQ(refusal(mjcf(hinge, "", "<keyframe><key name='k'/><key name='k'/></keyframe>")),
              "line 1: <key>: there is another keyframe \"k\"");
}

TEST(ImportMjcfToday, ARangeWhoseEndsAreNotInTheirOrderIsALoss) {
    const Made made(
        mjcf("<body name='a'><joint name='j' range='30 -30' actuatorfrcrange='2 -2'/>" + bob + "</body>", "",
             "<actuator><motor name='m' joint='j' ctrlrange='1 -1'/></actuator>" +
                 std::string("<keyframe><key ctrl='3'/></keyframe>")),
        [] {
            ImportSettings settings;
            settings.keyframe = "0";
            return settings;
        }());
    std::vector<std::string> why;
    for (const auto& one : made.text.lost) why.push_back(one.why);
    EXPECT_EQ(why,
              (std::vector<std::string>{"range 30 -30, whose ends are not in their order: it limits nothing",
                                        "actuatorfrcrange 2 -2, whose ends are not in their order: it limits nothing",
                                        "ctrlrange 1 -1, whose ends are not in their order: it limits nothing"}));
    EXPECT_FALSE(made.named("joints", "j")["limits"]);
    const Made off(mjcf("<body name='a'><joint name='j' range='30 -30' limited='false'/>" + bob + "</body>"));
    EXPECT_TRUE(off.text.lost.empty());
}

}  // namespace import_mjcf
}  // namespace delassus::tests

#endif
