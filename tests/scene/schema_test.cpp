// SPDX-License-Identifier: BSD-3-Clause
// The published schema of scenes against the reader: the same keys everywhere.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <map>
#include <set>

#include "delassus/error.hpp"
#include "delassus/scene.hpp"
#include "delassus/scene_schema.hpp"
#include "support/json_schema.hpp"
#include "support/places.hpp"
#include "support/run_command.hpp"
#include "support/scenes.hpp"

namespace delassus::tests::schema_test {
namespace {

using Json = nlohmann::json;
using Names = std::set<std::string>;

const Json& schema() {
    static const Json parsed = Json::parse(scene_schema());
    return parsed;
}

/// The keys of the object that a part of the schema describes, at whatever depth; null if there is none.
const Json* properties_of(const Json& part) {
    if (!part.is_structured()) return nullptr;
    if (part.is_object() && part.contains("properties")) return &part.at("properties");
    for (const auto& inner : part)
        if (const Json* found = properties_of(inner)) return found;
    return nullptr;
}

// A key that is near to none, so that the reader's complaint lists all that there are.
const std::string far_from_all(60, 'q');

/// Keys that the reader knows where the text has @.
Names reader_keys(std::string yaml) {
    yaml.replace(yaml.find('@'), 1, far_from_all + ": 1");
    try {
        static_cast<void>(parse_scene(yaml, "s"));
    } catch (const InputError& error) {
        const std::string told = error.what();
        const std::string before = "has no key \"" + far_from_all + "\"; there are ";
        const auto at = told.find(before);
        EXPECT_NE(at, std::string::npos) << told;
        if (at == std::string::npos) return {};
        Names names;
        std::istringstream list(told.substr(at + before.size()));
        for (std::string name; list >> name;) names.insert(name.substr(0, name.find(',')));
        return names;
    }
    ADD_FAILURE() << "was taken: " << yaml;
    return {};
}

/// A scene for each part of the schema with keys, with @ where they stand.
std::map<std::string, std::string> scenes_of_parts() {
    const std::string ball = "step: 1\nend: 1\nbodies: [{name: b, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}]\n";
    std::map<std::string, std::string> scenes = {{"one_system", "@\n"},
                                                 {"several_systems", "@\nsystems: {}"},
                                                 {"system", "systems: {a: {@}}"},
                                                 {"integrator", "integrator: {@}"},
                                                 {"solver", "solver: {@}"},
                                                 {"material", ball + "materials: {m: {@}}"},
                                                 {"material_pair", ball + "material_pairs: [{@}]"},
                                                 {"body", "step: 1\nend: 1\nbodies: [{@}]"},
                                                 {"inertia", "step: 1\nend: 1\nbodies: [{inertia: {@}}]"},
                                                 {"orientation", "step: 1\nend: 1\nbodies: [{orientation: {@}}]"},
                                                 {"repeat", "step: 1\nend: 1\nbodies: [{name: b, repeat: {@}}]"},
                                                 {"shape", "step: 1\nend: 1\nbodies: [{shapes: [{@}]}]"},
                                                 {"node", "step: 1\nend: 1\nnodes: [{@}]"},
                                                 {"elastic_block", "step: 1\nend: 1\nelastic_blocks: [{@}]"},
                                                 {"block_contact", "step: 1\nend: 1\nelastic_blocks: [{contact: {@}}]"},
                                                 {"cable", "step: 1\nend: 1\ncables: [{@}]"},
                                                 {"motion", ball + "loads: [{force: [{@}, 0, 0]}]"},
                                                 {"linear", ball + "loads: [{force: [{linear: {@}}, 0, 0]}]"},
                                                 {"sine", ball + "loads: [{force: [{sine: {@}}, 0, 0]}]"}};
    for (const std::string kind :
         {"sphere", "box", "capsule", "cylinder", "plane", "convex", "terrain", "height_field"})
        scenes[kind] = "step: 1\nend: 1\nbodies: [{shapes: [{" + kind + ": {@}}]}]";
    for (const std::string kind : {"joint", "motor", "spring", "load", "attachment"})
        scenes[kind] = ball + kind + "s: [{@}]";
    scenes["mesh"] = "step: 1\nend: 1\nbodies: [{shapes: [{mesh: {@}}]}]";
    scenes["elastic_mesh"] = "step: 1\nend: 1\nelastic_meshes: [{@}]";
    scenes["fixed_box"] = "step: 1\nend: 1\nelastic_meshes: [{fixed_boxes: [{@}]}]";
    scenes["beam"] = "step: 1\nend: 1\nbeams: [{@}]";
    scenes["section"] = "step: 1\nend: 1\nbeams: [{section: {@}}]";
    scenes["step_bounds"] = "step: {@}";
    scenes["sleeping"] = "sleeping: {@}";
    scenes["start"] = "start: {@}";
    scenes["equilibrium"] = "start: {equilibrium: {@}}";
    scenes["tolerance"] = "tolerance: {@}";
    scenes["limits"] = "limits: {@}";
    scenes["joint_spring"] = ball + "joints: [{spring: {@}}]";
    scenes["coordinate"] = ball + "joints: [{slide: {@}}]";
    scenes["initial_velocity"] = ball + "initial_velocities: [{@}]";
    scenes["actuator"] = ball + "actuators: [{@}]";
    scenes["body_motion"] = "step: 1\nend: 1\nbodies: [{motion: {@}}]";
    scenes["rotation"] = "step: 1\nend: 1\nbodies: [{motion: {rotation: {@}}}]";
    scenes["table"] = ball + "loads: [{force: [{table: {@}}, 0, 0]}]";
    scenes["input"] = ball + "loads: [{force: [{input: {@}}, 0, 0]}]";
    scenes["ramp"] = ball + "loads: [{force: [{ramp: {@}}, 0, 0]}]";
    scenes["bushing"] = ball + "bushings: [{@}]";
    return scenes;
}

TEST(SceneSchema, HasTheReadersKeysEverywhere) {
    const auto scenes = scenes_of_parts();
    for (const auto& [name, part] : schema().at("definitions").items()) {
        const Json* properties = properties_of(part);
        if (properties == nullptr) continue;
        const auto scene = scenes.find(name);
        ASSERT_NE(scene, scenes.end()) << "no scene shows where " << name << " stands";
        Names keys;
        for (const auto& [key, value] : properties->items()) keys.insert(key);
        if (name == "one_system") keys.insert("systems");  // with it, it is the other kind of scene
        EXPECT_EQ(reader_keys(scene->second), keys) << name;
    }
    for (const auto& [name, scene] : scenes) EXPECT_TRUE(schema().at("definitions").contains(name)) << name;
}

/// YAML as JSON by the core schema of YAML 1.2.
Json json_of(const YAML::Node& node) {
    if (node.IsMap()) {
        Json map = Json::object();
        for (const auto& entry : node) map[entry.first.Scalar()] = json_of(entry.second);
        return map;
    }
    if (node.IsSequence()) {
        Json list = Json::array();
        for (const auto& item : node) list.push_back(json_of(item));
        return list;
    }
    if (node.IsNull()) return nullptr;
    if (node.Tag() == "!") return node.Scalar();  // quoted
    double number = 0.0;
    if (YAML::convert<double>::decode(node, number)) return number;
    bool truth = false;
    if (YAML::convert<bool>::decode(node, truth)) return truth;
    return node.Scalar();
}

TEST(SceneSchema, TakesEveryExample) {
    const JsonSchema published(schema());
    int count = 0;
    for (const auto& entry :
         std::filesystem::directory_iterator(std::filesystem::path(example_scene("x")).parent_path())) {
        if (entry.path().extension() != ".yaml") continue;
        ++count;
        EXPECT_EQ(published.fault(json_of(YAML::LoadFile(entry.path().string()))), "") << entry.path();
    }
    EXPECT_GT(count, 15);
}

TEST(SceneSchema, RefusesWhatIsWrong) {
    const JsonSchema published(schema());
    const auto fault = [&](const std::string& yaml) { return published.fault(json_of(YAML::Load(yaml))); };
    EXPECT_EQ(fault("{step: 1, end: 1}"), "");
    EXPECT_EQ(fault("{step: 1}"), ": required end");
    EXPECT_EQ(fault("{step: 0, end: 1}"), "/step: oneOf");
    EXPECT_EQ(fault("{end: 1}"), ": anyOf");
    EXPECT_EQ(fault("{tolerance: 1.0e-4, step: {initial: 0.1}, end: 1}"), "");
    EXPECT_EQ(fault("{step: 1, end: 1, gravty: [0, 0, 0]}"), "/gravty: additionalProperties");
    EXPECT_EQ(fault("{step: 1, end: 1, gravity: [0, 0]}"), "/gravity: minItems");
    EXPECT_EQ(fault("{step: 1, end: 1, bodies: [{name: b, mass: heavy}]}"), "/bodies/0/mass: type \"number\"");
    EXPECT_EQ(fault("{step: 1, end: 1, bodies: [{name: b, mass: 1, density: 1}]}"), "/bodies/0: not");
    EXPECT_EQ(fault("{step: 1, end: 1, bodies: [{name: b, shapes: [{plane: {}, sphere: {radius: 1}}]}]}"),
              "/bodies/0/shapes/0: oneOf");
    EXPECT_EQ(fault("{step: 1, end: 1, joints: [{name: j, kind: revolut}]}"), "/joints/0/kind: enum");
    EXPECT_EQ(fault("{systems: {a/b: {step: 1, end: 1}}}"), "/systems/a/b: pattern");
    EXPECT_EQ(fault("{systems: {}}"), "/systems: minProperties");
}

TEST(SceneSchema, IsPrintedByTheCommand) {
    const auto result = run_command("run --schema");
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.out, text_of(std::filesystem::path(tests::places::source) / "docs" / "scene.schema.json"));
}

}  // namespace
}  // namespace delassus::tests::schema_test
