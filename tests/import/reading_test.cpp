// SPDX-License-Identifier: BSD-3-Clause
// What is refused, and details of what is written.
#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>

#include "delassus/error.hpp"
#include "import/imported.hpp"

namespace delassus::tests {
namespace import_reading {

std::string refusal(const std::string& name, const std::string& text, const ImportSettings& settings = {}) {
    const ScratchFolder folder;
    std::ofstream(folder / name) << text;
    try {
        (void)import_model(folder / name, folder / "scene.yaml", settings);
    } catch (const InputError& error) {
        std::string what = error.what();
        const auto place = what.find(folder.path().string() + "/");
        return place == std::string::npos ? what : what.erase(place, folder.path().string().size() + 1);
    }
    return "";
}

std::string urdf_of(const std::string& inside) {
    return "<robot name=\"r\">" + inside + "</robot>";
}
std::string link_of(const std::string& name, const std::string& mass = "1") {
    return "<link name=\"" + name + "\"><inertial><mass value=\"" + mass +
           "\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link>";
}
std::string hinge_of(const std::string& first, const std::string& second, const std::string& more = "") {
    return "<joint name=\"" + first + second + "\" type=\"continuous\"><parent link=\"" + first + "\"/><child link=\"" +
           second + "\"/><axis xyz=\"0 1 0\"/>" + more + "</joint>";
}

TEST(Import, RefusesWhatIsNoModel) {
    EXPECT_NE(refusal("a.xml", "hello").find("a.xml: it has no XML element"), std::string::npos);
    EXPECT_NE(refusal("a.xml", "<?xml version='1.0'?><!-- <robot> --><html/>").find("its root is <html>"),
              std::string::npos);
    EXPECT_THROW((void)import_model("/nowhere/model.xml", "scene.yaml"), InputError);
    ImportSettings settings;
    settings.end = -1.0;
    EXPECT_NE(refusal("a.xml", "<mujoco/>", settings).find("must be positive"), std::string::npos);
}

std::string nested(const std::string& root, const std::string& tag, int depth) {
    std::string text = "<" + root + ">";
    for (int k = 0; k < depth; ++k) text += "<" + tag + " name=\"a>b\">";
    for (int k = 0; k < depth; ++k) text += "</" + tag + ">";
    return text + "</" + root + ">";
}

// The stack of a library's parser ends somewhere.
TEST(Import, BoundsHowDeepElementsAreNested) {
    for (const auto& [root, tag] : {std::pair{"robot", "link"}, {"sdf", "model"}, {"mujoco", "body"}})
        EXPECT_EQ(refusal("deep.xml", nested(root, tag, 100000)),
                  "deep.xml: its elements are nested more than 1000 deep");
    const auto flat = refusal(
        "flat.xml", "<?xml version=\"1.0\"?><!-- <a><b> --><robot name='r'>" + [] {
            std::string all;
            for (int k = 0; k < 3000; ++k) all += "<gazebo x='</'/>";
            return all;
        }() + "<![CDATA[<a><a>]]></robot>");
    EXPECT_EQ(flat.find("nested"), std::string::npos) << flat;
}

TEST(Import, DoesNotWriteOverTheModel) {
    const ScratchFolder folder;
    const auto model = (folder / "model.urdf").string();
    std::ofstream(model) << urdf_of(link_of("a"));
    const auto result = run_command("import " + model + " -o " + model);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("the scene would replace the model"), std::string::npos) << result.err;
    EXPECT_EQ(text_of(model), urdf_of(link_of("a")));
    EXPECT_EQ(run_command("import " + model).exit_code, 2);  // no -o
    EXPECT_NE(run_command("import --help").out.find("--strict"), std::string::npos);
}

#ifdef DELASSUS_HAS_URDF
// As urdfdom itself does, link by link.
TEST(ImportUrdf, AChainOnWhichTheLibraryFailsIsRefused) {
    std::string links, hinges;
    for (int k = 0; k < 100000; ++k) {
        links += link_of(std::to_string(k));
        if (k > 0) hinges += hinge_of(std::to_string(k - 1), std::to_string(k));
    }
    EXPECT_EQ(refusal("long.urdf", urdf_of(links + hinges)), "long.urdf is damaged: liburdfdom fails on it.");
}

TEST(ImportUrdf, RefusesWithOneSentence) {
    ImportSettings settings;
    settings.keyframe = "home";
    EXPECT_EQ(refusal("a.urdf", urdf_of(link_of("a")), settings),
              "a.urdf: only MJCF models have keyframes, and this is URDF");
    EXPECT_NE(refusal("a.urdf", "<robot").find("urdfdom refuses the model"), std::string::npos);
    EXPECT_NE(refusal("a.urdf", urdf_of("")).find("urdfdom refuses the model: No link elements found"),
              std::string::npos);
    EXPECT_EQ(refusal("a.urdf", urdf_of(link_of("a"))), "a.urdf: nothing in the model moves that has mass");
    EXPECT_NE(refusal("a.urdf", urdf_of(link_of("a") + link_of("b") + hinge_of("a", "c"))).find("urdfdom refuses"),
              std::string::npos);
    EXPECT_NE(refusal("a.urdf", urdf_of(link_of("a") + link_of("b", "-1") + hinge_of("a", "b"))).find("mass"),
              std::string::npos);
    EXPECT_EQ(
        refusal("a.urdf", urdf_of(link_of("a") + link_of("b", "0") + hinge_of("a", "b"))),
        "a.urdf: nothing in the model moves that has mass; not carried over: link \"b\": an inertia without a mass: "
        "left out; body \"b\": it has no mass and carries none: left out, with its joint");
    EXPECT_EQ(refusal("a.urdf", urdf_of(link_of("a") + link_of("b", "abc") + hinge_of("a", "b"))),
              "a.urdf: link \"b\": line 1: <mass>: value=\"abc\" is to be numbers, and \"abc\" is none");
    EXPECT_NE(refusal("a.urdf", urdf_of(link_of("a") + link_of("b") + hinge_of("a", "b", "<mimic joint=\"ab\"/>")))
                  .find("mimics itself"),
              std::string::npos);
}

TEST(ImportUrdf, TakesMeshesByPackagesAndListsWhatTheyLose) {
    Imported crane(model_file("robot_description/urdf/crane.urdf"));
    EXPECT_EQ(items(crane.text.lost),
              (std::vector<std::string>{"collision 2 of link \"jib\"", "collision 3 of link \"jib\""}));
    const YAML::Node scene = YAML::Load(crane.text.yaml);
    ASSERT_EQ(scene["bodies"].size(), 2U);
    const YAML::Node mast = scene["bodies"][0], jib = scene["bodies"][1];
    EXPECT_TRUE(mast["fixed"].as<bool>());
    EXPECT_EQ(mast["shapes"][0]["mesh"]["scale"].as<double>(), 0.1);
    EXPECT_NE(mast["shapes"][0]["mesh"]["file"].as<std::string>().find("meshes/wedge.obj"), std::string::npos);
    EXPECT_EQ(jib["shapes"][0]["convex"]["points"].size(), 6U);  // the mirrored wedge
    EXPECT_EQ(jib["shapes"][1]["convex"]["points"].size(), 8U);  // the hull of the open box
    EXPECT_EQ(scene["keep_apart"].size(), 1U);
}

// The axes of an inertia are those of its origin, and the scene has the link's: R J Rᵀ.
TEST(ImportUrdf, MendsWhatRobotsOfOthersHave) {
    const ScratchFolder folder;
    // Neighbours that run along their edge in the same direction; a tetrahedron by its points.
    std::ofstream(folder / "turned.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 3 4\n";
    std::ofstream(folder / "turned.off") << "OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 2 3\n";
    const auto collision = [](const char* file) {
        return std::string("<collision><geometry><mesh filename=\"") + file + "\"/></geometry></collision>";
    };
    const std::string rounded =
        "<link name=\"b\"><inertial><mass value=\"2\"/><inertia ixx=\"2e-18\" ixy=\"0\" ixz=\"0\" iyy=\"2e-18\" "
        "iyz=\"0\" izz=\"2e-18\"/></inertial>" +
        collision("turned.obj") + collision("turned.off") + "</link>";
    std::ofstream(folder / "m.urdf") << urdf_of(link_of("a") + rounded + hinge_of("a", "b", "<mimic joint=\"none\"/>"));
    const auto made = import_model(folder / "m.urdf", folder / "s.yaml");
    std::map<std::string, std::string> lost;
    for (const auto& item : made.lost) lost[item.what] = item.why;
    EXPECT_EQ(lost.size(), 4U);
    std::ofstream(folder / "nameless.urdf")
        << "<robot>" + link_of("a") + link_of("b") + hinge_of("a", "b") + "</robot>";
    EXPECT_NE(import_model(folder / "nameless.urdf", folder / "s.yaml").yaml.find("title: \"nameless\""),
              std::string::npos);
    EXPECT_EQ(lost["joint \"ab\""], "it mimics \"none\", and there is no such joint");
    EXPECT_EQ(lost["collision 1 of link \"b\""], "an open mesh: the convex hull of its points collides");
    EXPECT_EQ(lost["collision 2 of link \"b\""], "an open mesh: the convex hull of its points collides");
    EXPECT_NE(lost["body \"b\""].find("that of a ball of water"), std::string::npos) << lost["body \"b\""];
    EXPECT_NE(made.yaml.find("inertia: {xx: 0.0048"), std::string::npos) << made.yaml;
}

TEST(ImportUrdf, NamesXacroWhereItsMacrosAreStillThere) {
    const std::string two = link_of("a") + link_of("b");
    EXPECT_EQ(refusal("a.urdf.xacro", urdf_of(two + "<xacro:wheel side='left'/>" + hinge_of("a", "b"))),
              "a.urdf.xacro: it has macros of xacro; expand it first: xacro a.urdf.xacro > a.urdf");
    EXPECT_EQ(refusal("a.urdf", urdf_of(link_of("a") + link_of("b", "${m}") + hinge_of("a", "b"))),
              "a.urdf: it has macros of xacro; expand it first: xacro a.urdf > a.expanded.urdf");
    EXPECT_EQ(refusal("a.xml", urdf_of("<gazebo><k>${k}</k></gazebo>" + two + hinge_of("a", "b"))),
              "a.xml: it has macros of xacro; expand it first: xacro a.xml > a.expanded.urdf");
    EXPECT_EQ(refusal("a.urdf", "<robot name='r' xmlns:xacro='http://ros.org/wiki/xacro'>" + two + hinge_of("a", "b") +
                                    "</robot>"),
              "");
}

TEST(ImportUrdf, ListsWhatTheLibraryPassesOver) {
    const ScratchFolder folder;
    std::ofstream(folder / "a.urdf") << urdf_of(
        link_of("a") +
        "<link name='b'><inertial><origin xzy='0 0 1'/><mass value='1' unit='g'/><inertia ixx='1' ixy='0' ixz='0' "
        "iyy='1' "
        "iyz='0' izz='1'/></inertial></link>" +
        hinge_of("a", "b", "<dynamics damping='1' spring_stiffness='2'/><orign xyz='0 0 1'/>"));
    EXPECT_EQ(items(import_model(folder / "a.urdf", folder / "s.yaml").lost),
              (std::vector<std::string>{"attribute xzy=\"0 0 1\" of <origin> of <inertial> of link \"b\"",
                                        "attribute unit=\"g\" of <mass> of <inertial> of link \"b\"",
                                        "attribute spring_stiffness=\"2\" of <dynamics> of joint \"ab\"",
                                        "element <orign> of joint \"ab\""}));
}

TEST(ImportUrdf, TurnsInertias) {
    const ScratchFolder folder;
    std::ofstream(folder / "a.urdf") << urdf_of(
        link_of("a") +
        "<link name='b'><inertial><origin xyz='1 2 3' rpy='0.3 -0.2 0.7'/><mass value='2'/><inertia ixx='1' ixy='0.1' "
        "ixz='-0.2' iyy='1.5' iyz='0.05' izz='2'/></inertial></link>" +
        hinge_of("a", "b"));
    const auto body = YAML::Load(import_model(folder / "a.urdf", folder / "s.yaml").yaml)["bodies"][0];
    const Eigen::Matrix3d R =
        (Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
    Eigen::Matrix3d J, written;
    J << 1.0, 0.1, -0.2, 0.1, 1.5, 0.05, -0.2, 0.05, 2.0;
    const auto entry = [&](const char* key) { return body["inertia"][key].as<double>(); };
    written << entry("xx"), entry("xy"), entry("xz"), entry("xy"), entry("yy"), entry("yz"), entry("xz"), entry("yz"),
        entry("zz");
    EXPECT_LE((R * J * R.transpose() - written).norm(), 1e-14);
    EXPECT_EQ(body["position"][2].as<double>(), 3.0);
}

TEST(ImportUrdf, LetsTheRootFloatIfAsked) {
    const ScratchFolder folder;
    std::ofstream(folder / "a.urdf") << urdf_of(link_of("a") + link_of("b") + hinge_of("a", "b"));
    const auto held = YAML::Load(import_model(folder / "a.urdf", folder / "s.yaml").yaml);
    ImportSettings settings;
    settings.floating = true;
    const auto floats = YAML::Load(import_model(folder / "a.urdf", folder / "s.yaml", settings).yaml);
    EXPECT_EQ(held["bodies"].size(), 1U);  // the world holds a, which has no shapes
    EXPECT_EQ(floats["bodies"].size(), 2U);
    EXPECT_EQ(floats["joints"][0]["first"].as<std::string>(), "a");
}
#endif

#ifdef DELASSUS_HAS_SDF
TEST(ImportSdf, RefusesWithOneSentence) {
    EXPECT_EQ(refusal("a.sdf", "<sdf version='1.9'/>"), "a.sdf: it has neither a world nor a model");
    EXPECT_NE(refusal("a.sdf", "<sdf version='1.9'><model/></sdf>").find("libsdformat refuses the model"),
              std::string::npos);
    EXPECT_NE(refusal("a.sdf", "<sdf version='1.9'><world name='w'/></sdf>").find("nothing in the model moves"),
              std::string::npos);
    EXPECT_NE(refusal("a.sdf",
                      "<sdf version='1.9'><model name='m'><link name='a'/><joint name='j' type='ball'>"
                      "<parent>a</parent><child>none</child></joint></model></sdf>")
                  .find("libsdformat refuses the model"),
              std::string::npos);
}

// libsdformat passes over what its version of SDF does not have.
TEST(ImportSdf, ListsWhatTheLibraryPassesOver) {
    const auto lost = [](const std::string& of_link, const std::string& of_model = "",
                         const std::string& version = "1.9") {
        const ScratchFolder folder;
        std::ofstream(folder / "a.sdf") << "<sdf version='" + version +
                                               "' xmlns:x='x'><world name='w'><model name='m'>" + "<link name='a'>" +
                                               of_link + "</link></model>" + of_model + "</world></sdf>";
        return items(import_model(folder / "a.sdf", folder / "s.yaml").lost);
    };
    using Items = std::vector<std::string>;
    EXPECT_EQ(lost("<inertial auto='true'/>"), Items{"attribute auto=\"true\" of <inertial> of link \"a\""});
    EXPECT_EQ(lost("<inertial auto='false'/>"), Items{});
    EXPECT_EQ(lost("<poze>0 0 1 0 0 0</poze><inertial><mas>5</mas></inertial>"),
              (Items{"element <poze> of link \"a\"", "element <mas> of <inertial> of link \"a\""}));
    EXPECT_EQ(lost("<inertial><fluid_added_mass><xx>5</xx></fluid_added_mass></inertial>"),
              Items{"element <fluid_added_mass> of <inertial> of link \"a\""});
    EXPECT_EQ(lost("", "<joint name='j' type='fixed'><parent>world</parent><child>m::a</child></joint>"),
              Items{"element <joint> of world \"w\""});
    EXPECT_EQ(lost("<self_collide>0</self_collide><must_be_base_link>true</must_be_base_link>"),
              Items{"element <must_be_base_link> of link \"a\""});
    EXPECT_EQ(lost("<visual name='v'><geometry><cone/></geometry></visual>", "", "1.12"), Items{});
    EXPECT_EQ(lost("", "", "99"), Items{"version 99 of SDF"});
    const std::string hinge =
        "<joint name='j' type='revolute'><parent>world</parent><child>b</child><axis><limit>"
        "<lower>-1</lower><upper>1</upper><stiffness>1e+08</stiffness></limit><mimic joint='k'/>"
        "</axis></joint>";
    EXPECT_EQ(lost("", "<model name='n'><link name='b'/>" + hinge + "</model>"),
              Items{"element <mimic> of <axis> of joint \"j\""});
}

TEST(ImportSdf, TakesFrictionsOfOneEngineAlone) {
    const ScratchFolder folder;
    std::ofstream(folder / "a.sdf")
        << "<sdf version='1.9'><model name='m'><link name='a'><collision name='c'><geometry><sphere><radius>1</radius>"
           "</sphere></geometry><surface><friction><bullet><friction>0.3</friction><friction2>0.3</friction2></bullet>"
           "</friction></surface></collision></link></model></sdf>";
    const auto made = import_model(folder / "a.sdf", folder / "s.yaml");
    EXPECT_EQ(items(made.lost), std::vector<std::string>{});
    EXPECT_EQ(YAML::Load(made.yaml)["materials"]["friction 0.3"]["friction"].as<double>(), 0.3);
}

TEST(ImportSdf, TakesSurfacesBitMasksAndLosses) {
    Imported boxes(model_file("boxes.sdf"));
    EXPECT_EQ(items(boxes.text.lost),
              (std::vector<std::string>{"collision \"ball\" of link \"two::ball\"", "link \"three::capsule\""}));
    const YAML::Node scene = YAML::Load(boxes.text.yaml);
    EXPECT_EQ(scene["bodies"].size(), 4U);
    EXPECT_EQ(scene["keep_apart"].size(), 1U);
    EXPECT_EQ(scene["keep_apart"][0][0].as<std::string>(), "one::box");
    EXPECT_EQ(scene["keep_apart"][0][1].as<std::string>(), "two::ball");
    EXPECT_EQ(scene["materials"]["friction 0.2"]["friction"].as<double>(), 0.2);
    bool lesser = false;
    for (const auto& pair : scene["material_pairs"]) lesser = lesser || pair["friction"].as<double>() == 0.2;
    EXPECT_TRUE(lesser) << boxes.text.yaml;

    Imported trailer(model_file("trailer.sdf"));
    const YAML::Node road = YAML::Load(trailer.text.yaml);
    EXPECT_EQ(road["material_pairs"].size(), 3U) << trailer.text.yaml;
    EXPECT_EQ(road["materials"]["friction 0.9"]["friction"].as<double>(), 0.9);
}
#endif

#ifdef DELASSUS_HAS_MJCF
std::string mjcf_of(const std::string& inside) {
    return "<mujoco><worldbody>" + inside + "</worldbody></mujoco>";
}
const std::string bob = "<geom type='sphere' size='0.1'/>";

TEST(ImportMjcf, RefusesWithOneSentence) {
    EXPECT_NE(refusal("a.xml", "<mujoco>\n").find("a.xml: line 1: it is no XML: "), std::string::npos);
    EXPECT_EQ(refusal("a.xml", mjcf_of("<body>\n<joint type='door'/>" + bob + "</body>")),
              "a.xml: line 2: <joint>: type=\"door\" is none of free, ball, slide, hinge");
    EXPECT_EQ(refusal("a.xml", mjcf_of(bob)), "a.xml: nothing in the model moves that has mass");
    EXPECT_EQ(
        refusal("a.xml", mjcf_of("<body name='b'><freejoint/><geom name='g' type='box' size='0.1 0 0.1'/></body>")),
        "a.xml: nothing in the model moves that has mass; not carried over: shape \"g\": a size of it is not "
        "positive: left out; body \"b\": it has no mass, and nothing holds it: left out");
    ImportSettings settings;
    settings.keyframe = "home";
    EXPECT_EQ(refusal("a.xml", mjcf_of("<body><joint/>" + bob + "</body>"), settings),
              "a.xml: it has no keyframes, and so none named \"home\"");
    settings.keyframe.clear();
    settings.floating = true;
    EXPECT_NE(
        refusal("a.xml", mjcf_of("<body><joint/>" + bob + "</body>"), settings).find("only the root of a URDF model"),
        std::string::npos);
}

TEST(ImportMjcf, ListsWhatAFreeJointHas) {
    const ScratchFolder folder;
    std::ofstream(folder / "a.xml") << mjcf_of(
        "<body><joint name='f' type='free' armature='1' damping='1' stiffness='1' frictionloss='1'/>" + bob +
        "</body>");
    EXPECT_EQ(items(import_model(folder / "a.xml", folder / "s.yaml").lost),
              (std::vector<std::string>(4, "joint \"f\"")));
}

TEST(ImportMjcf, LowersAFrictionThatScenesDoNotHave) {
    const ScratchFolder folder;
    std::ofstream(folder / "a.xml") << mjcf_of(
        "<geom type='plane' size='1 1 1' friction='1e15'/><body pos='0 0 1'><freejoint/>"
        "<geom type='sphere' size='0.1' friction='1e15'/></body>");
    const auto imported = import_model(folder / "a.xml", folder / "s.yaml");
    EXPECT_NE(std::ranges::find_if(
                  imported.lost,
                  [](const NotCarriedOver& one) { return one.why.find("it becomes 10000") != std::string::npos; }),
              imported.lost.end());
    EXPECT_NO_THROW(static_cast<void>(parse_scene(imported.yaml, "s.yaml")));
}

TEST(ImportMjcf, MakesAChainOfABodyWithSeveralJoints) {
    Imported person(model_file("humanoid.xml"));
    const YAML::Node scene = YAML::Load(person.text.yaml);
    int massless = 0;
    for (const auto& body : scene["bodies"])
        if (body["massless"]) ++massless;
    EXPECT_EQ(massless, 6);                  // two beyond the torso, two at each hip
    EXPECT_EQ(scene["bodies"].size(), 17U);  // the ground, ten bodies of the model, of which feet are parts, and pieces
    EXPECT_EQ(person.scene.systems[0].coordinates, Coordinates::Joint);
    // Parents and children do not touch, across pieces either.
    bool apart = false;
    for (const auto& pair : scene["keep_apart"])
        apart = apart || (pair[0].as<std::string>() == "torso" && pair[1].as<std::string>() == "pelvis");
    EXPECT_TRUE(apart);
}

TEST(ImportMjcf, WritesFrictionByPairs) {
    Imported bodies(model_file("free_bodies.xml"));
    const YAML::Node scene = YAML::Load(bodies.text.yaml);
    std::map<std::string, std::string> material;
    for (const auto& body : scene["bodies"])
        for (const auto& shape : body["shapes"])
            material[body["name"].as<std::string>()] = shape["material"].as<std::string>();
    const auto friction = [&](const std::string& a, const std::string& b) {
        for (const auto& pair : scene["material_pairs"]) {
            const auto first = pair["first"].as<std::string>(), second = pair["second"].as<std::string>();
            if ((first == material.at(a) && second == material.at(b)) ||
                (first == material.at(b) && second == material.at(a)))
                return pair["friction"].as<double>();
        }
        return std::sqrt(scene["materials"][material.at(a)]["friction"].as<double>() *
                         scene["materials"][material.at(b)]["friction"].as<double>());
    };
    EXPECT_EQ(friction("box", "drum"), 1.0);    // the larger
    EXPECT_EQ(friction("rod", "drum"), 0.3);    // by priority
    EXPECT_EQ(friction("ball", "ghost"), 1.0);  // dimensions 1 and 3
}

TEST(ImportMjcf, TakesARoundEllipsoidForASphere) {
    const ScratchFolder folder;
    std::ofstream(folder / "a.xml") << mjcf_of(
        "<geom type='plane' size='1 1 1'/><body><freejoint/><geom type='ellipsoid' size='0.1 0.1 0.1' pos='0 0 0.2'/>"
        "<geom type='ellipsoid' size='0.1 0.1 0.2'/></body>");
    const auto imported = import_model(folder / "a.xml", folder / "s.yaml");
    EXPECT_EQ(imported.lost.size(), 1U);
    const auto shapes = YAML::Load(imported.yaml)["bodies"][1]["shapes"];
    ASSERT_EQ(shapes.size(), 2U);
    EXPECT_EQ(shapes[0]["sphere"]["radius"].as<double>(), 0.1);
    EXPECT_TRUE(shapes[1]["convex"]);
}

TEST(ImportMjcf, WritesHullsBesideTheScene) {
    Imported meshes(model_file("meshes.xml"));
    ASSERT_EQ(meshes.text.files.size(), 1U);
    EXPECT_EQ(meshes.text.files[0].path, "scene_meshes/round.obj");
    const YAML::Node scene = YAML::Load(meshes.text.yaml);
    for (const auto& body : scene["bodies"]) {
        const auto name = body["name"].as<std::string>();
        if (name == "stone") {
            EXPECT_EQ(body["shapes"][0]["mesh"].as<std::string>(), "scene_meshes/round.obj");
        }
        if (name == "door") {
            EXPECT_EQ(body["shapes"][0]["convex"]["points"].size(), 6U);
        }
    }
}

TEST(ImportMjcf, KeepsNothingOfAModelThatIsRefused) {
    const ScratchFolder folder;
    const auto scene = folder / "scene.yaml";
    const auto result = run_command("import " + model_file("losses.xml").string() + " --strict -o " + scene.string());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("17 items of the model have no counterpart in a scene; --strict writes nothing then"),
              std::string::npos)
        << result.err;
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}
#endif

}  // namespace import_reading
}  // namespace delassus::tests
