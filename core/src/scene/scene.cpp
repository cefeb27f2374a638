// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/scene.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "config/sections.hpp"
#include "scene/choose_method.hpp"
#include "scene/overrides.hpp"
#include "scene/system_reader.hpp"
#include "solver/auto_solver.hpp"
#include "solver/name_with_options.hpp"
#include "support/text_file.hpp"

namespace delassus {
namespace {

using scene::SystemReader;

void read_one_system(const Source& source, const YAML::Node& map, Scene& scene, std::string name, std::string_view what,
                     std::vector<std::pair<std::string_view, Handler>> more = {}) {
    SceneSystem system;
    system.name = std::move(name);
    SystemReader reader(source, system);
    auto handlers = reader.handlers();
    handlers.insert(handlers.end(), more.begin(), more.end());
    read_map(source, map, what, handlers);
    reader.build(map);
    scene.systems.push_back(std::move(system));
}

/// A name of a system becomes part of file names.
void check_system_name(const Source& source, const YAML::Node& node, const std::string& name) {
    const bool plain = !name.empty() && name.size() <= 100 && std::all_of(name.begin(), name.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
    });
    if (!plain) source.refuse(node, fmt::format("\"{}\" cannot name a system; use letters, digits, _ and -", name));
}

/// Puts what --solver or --integrator names where the file would have it, so that --set can add to it. The options of
/// another one than the file's mean nothing to this one and go. unnamed: what the file means where it gives no name.
void put_method(const std::string& key, const std::string& text, std::string_view unnamed, Source& source,
                YAML::Node map) {
    if (text.empty() || !map.IsMap()) return;  // refused when it is read
    const auto [name, options] = parse_name_with_options(text, key);
    const std::string place = fmt::format("--{} {}", key, text);
    const auto node_of = [&](const std::string& value) {
        const YAML::Node node(value);
        source.comes_from(node, place);
        return node;
    };
    const YAML::Node given = std::as_const(map)[key];
    YAML::Node section(YAML::NodeType::Map);
    std::string before;
    if (given.IsDefined() && given.IsScalar()) before = given.Scalar();
    if (given.IsDefined() && given.IsMap()) {
        section.reset(given);
        const YAML::Node named = std::as_const(section)["name"];
        if (named.IsDefined() && named.IsScalar()) before = named.Scalar();
    } else {
        source.comes_from(section, place);
        map[key] = section;
    }
    NameWithOptions old{std::string(unnamed), {}};
    if (!before.empty()) old = parse_name_with_options(before, key);
    if (old.name.empty()) old.name = name;
    if (old.name != name) {
        section.remove("options");
        old.options.clear();
    }
    section["name"] = node_of(name);
    if (old.options.empty() && options.empty()) return;
    if (!std::as_const(section)["options"].IsDefined()) section["options"] = YAML::Node(YAML::NodeType::Map);
    YAML::Node all = section["options"];
    if (!all.IsMap()) return;  // refused when it is read
    for (const auto& [option, value] : old.options)
        if (!std::as_const(all)[option].IsDefined()) all[option] = node_of(value);
    for (const auto& [option, value] : options) all[option] = node_of(value);
}

/// The overrides for every system, put where the file would have them.
void put_values(const SceneOverrides& overrides, Source& source, YAML::Node map) {
    if (!map.IsMap()) return;  // refused when it is read
    const auto put = [&](const char* key, const std::optional<double>& value) {
        if (!value) return;
        const YAML::Node node(fmt::format("{:.17g}", *value));
        source.comes_from(node, fmt::format("--{} {}", key, *value));
        map[key] = node;
    };
    if (overrides.accuracy && overrides.tolerance)
        throw InputError("--accuracy and --tolerance exclude each other: steps follow from one of them");
    if (overrides.step && overrides.tolerance)
        throw InputError("--step is for fixed steps, --tolerance for steps that follow from it; give one of them");
    if (overrides.step || overrides.accuracy) map.remove("tolerance");
    if (overrides.tolerance) map.remove("accuracy");
    if (overrides.tolerance && map["step"].IsDefined() && map["step"].IsScalar()) map.remove("step");
    put("step", overrides.step);
    put("tolerance", overrides.tolerance);
    put("accuracy", overrides.accuracy);
    put("end", overrides.end);
    if (overrides.leave_out) map["leave_out"] = *overrides.leave_out;
}

/// Takes out what does not change the steps.
void keep_what_steps_depend_on(YAML::Node system) {
    system.remove("end");
    if (!system["solver"].IsDefined() || !system["solver"].IsMap()) return;
    system["solver"].remove("threads");
    if (system["solver"].size() == 0) system.remove("solver");
}

std::string canonical_text(const YAML::Node& root, const SceneOverrides& overrides) {
    YAML::Node copy = YAML::Clone(root);
    copy.remove("title");
    keep_what_steps_depend_on(copy);
    if (copy["systems"].IsDefined())
        for (auto entry : copy["systems"]) keep_what_steps_depend_on(entry.second);
    return fmt::format("{}\nsolver {}\nintegrator {}\n{}", YAML::Dump(copy), overrides.solver, overrides.integrator,
                       overrides.law ? fmt::format("law {}\n", name_of(*overrides.law)) : "");
}

}  // namespace

Scene parse_scene(const std::string& yaml, std::string_view where, const SceneOverrides& overrides) {
    Source source(where);
    Scene scene;
    try {
        const YAML::Node root = load_document(source, yaml);
        if (!root.IsMap()) throw InputError(fmt::format("{}: a scene must be a map of keys to values", where));
        std::vector<YAML::Node> system_nodes;
        if (root["systems"].IsDefined() && root["systems"].IsMap()) {
            for (const auto& entry : root["systems"]) system_nodes.push_back(entry.second);
        } else {
            system_nodes.push_back(root);
        }
        for (const auto& system : system_nodes) {
            put_method("solver", overrides.solver, auto_name, source, system);
            put_method("integrator", overrides.integrator, {}, source, system);
        }
        for (const auto& [path, text] : overrides.values) scene::set_value(source, root, path, text);
        std::vector<double> planned_ends;
        for (const auto& system : system_nodes) {
            const YAML::Node end = system.IsMap() ? system["end"] : YAML::Node();
            planned_ends.push_back(end.IsDefined() && end.IsScalar() ? end.as<double>(0.0) : 0.0);
            put_values(overrides, source, system);
        }
        const std::pair<std::string_view, Handler> title{
            "title", [&](const YAML::Node& n) { scene.title = scalar(source, n, "title"); }};
        if (root["systems"].IsDefined()) {
            read_map(source, root, "a scene with \"systems\"",
                     {title, {"systems", [&](const YAML::Node& systems) {
                                  if (!systems.IsMap() || systems.size() == 0)
                                      source.refuse(systems, "\"systems\" must be a map of names to systems");
                                  for (const auto& entry : systems) {
                                      const std::string name = scalar(source, entry.first, "key");
                                      check_system_name(source, entry.first, name);
                                      for (const auto& other : scene.systems)
                                          if (other.name == name)
                                              source.refuse(entry.first, fmt::format("\"{}\" is given twice", name));
                                      read_one_system(source, entry.second, scene, name,
                                                      fmt::format("the system \"{}\"", name));
                                  }
                              }}});
        } else {
            read_one_system(source, root, scene, "main", "the scene", {title, {"systems", [](const YAML::Node&) {}}});
        }
        for (std::size_t i = 0; i < scene.systems.size(); ++i) {
            SceneSystem& system = scene.systems[i];
            system.planned_end = planned_ends[i] > 0.0 ? planned_ends[i] : system.end;
            if (overrides.law) system.solver.law = overrides.law;
            scene::choose_method(system);
        }
        scene.canonical = canonical_text(root, overrides);
    } catch (const YAML::Exception& error) {
        throw InputError(fmt::format("{}: not valid YAML: {}", source.at(error.mark), error.msg));
    }
    return scene;
}

Scene read_scene(const std::filesystem::path& file, const SceneOverrides& overrides) {
    return parse_scene(read_file(file), file.string(), overrides);
}

}  // namespace delassus
