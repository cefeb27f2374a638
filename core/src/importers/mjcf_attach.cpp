// SPDX-License-Identifier: BSD-3-Clause
// What refers to bodies, joints and geoms of an MJCF file by names, and models that it attaches.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "delassus/error.hpp"
#include "importers/mjcf_parser.hpp"

namespace delassus::importers::mjcf {

namespace {

const XmlElement* find_named(const XmlElement& element, const std::string& kind, const std::string& name) {
    for (const XmlElement& child : element.children) {
        if (child.name == kind && child.text("name") == name) return &child;
        if (const XmlElement* found = find_named(child, kind, name)) return found;
    }
    return nullptr;
}

/// Looks, sensors, sizes and code of others: nothing of the motion. The kind by which they are reported, or null.
const char* harmless_kind(const std::string& element, const std::string& parent) {
    if (parent == "sensor") return "sensors";
    if (parent == "custom") return "numbers and texts";
    static const std::map<std::string, const char*> kinds = {{"texture", "textures"},
                                                             {"material", "materials of looks"},
                                                             {"skin", "skins"},
                                                             {"camera", "cameras"},
                                                             {"light", "lights"}};
    const auto found = kinds.find(element);
    return found == kinds.end() || parent == "default" ? nullptr : found->second;
}

bool is_quiet(const std::string& element) {
    static const std::set<std::string> all = {"visual", "statistic", "size",  "extension", "lengthrange", "flag",
                                              "layer",  "camera",    "light", "texture",   "material",    "skin"};
    return all.contains(element);
}

}  // namespace

void Parser::read_all() {
    spec_.title = root_.text("model");
    Body world;
    world.name = "world";
    building_.taken["body"].emplace("world", 0);
    spec_.bodies.push_back(std::move(world));
    Scope scope;
    scope.defaults = &classes_.at("main");
    for (const XmlElement& section : root_.children)
        if (section.name == "worldbody") {
            Scope own = scope;
            own.defaults = &child_defaults_of(section, *scope.defaults);
            read_children(section, own);
        }
    read_references(false);
    note_unread(root_);
}

void Parser::attach(const std::string& body_name, const std::string& frame_name, std::int32_t body, const Frame& frame,
                    const XmlElement& by) {
    Scope scope;
    scope.body = body;
    scope.frame = frame;
    scope.suffix = suffix_;
    scope.defaults = &classes_.at("main");
    const bool all = body_name.empty() && frame_name.empty();
    bool found = all;
    for (const XmlElement& section : root_.children) {
        if (section.name != "worldbody") continue;
        if (all) {
            read_children(section, scope);
            note_unread(section);
            continue;
        }
        const XmlElement* part =
            find_named(section, body_name.empty() ? "frame" : "body", body_name.empty() ? frame_name : body_name);
        if (part == nullptr) continue;
        found = true;
        XmlElement holder;
        holder.name = "attach";
        holder.children.push_back(*part);
        read_children(holder, scope);
        note_unread(holder);
    }
    if (!found) by.refuse(fmt::format("the model has no body or frame \"{}{}\"", body_name, frame_name));
    read_references(true);
}

void Parser::read_attachment(const XmlElement& element, const Scope& scope) {
    const std::string* name = element.find("model");
    const std::string prefix = element.text("prefix"), body = element.text("body"), frame = element.text("frame");
    if (name == nullptr) {  // a part of this model again
        const XmlElement* part = nullptr;
        for (const XmlElement& section : root_.children)
            if (section.name == "worldbody" && part == nullptr)
                part = body.empty() ? find_named(section, "frame", frame) : find_named(section, "body", body);
        if (part == nullptr) element.refuse(fmt::format("there is no body or frame \"{}{}\"", body, frame));
        if (!attaching_.insert(part).second) element.refuse("it attaches what it is in");
        const std::string before = prefix_;
        XmlElement holder;
        holder.name = "attach";
        holder.children.push_back(*part);
        prefix_ = before + prefix;
        // Meshes keep their names, so they are known by both.
        const auto meshes = building_.meshes;
        for (const auto& [mesh, content] : meshes)
            if (mesh.starts_with(before)) building_.meshes.emplace(prefix_ + mesh.substr(before.size()), content);
        const auto fields = building_.height_fields;
        for (const auto& [field, index] : fields)
            if (field.starts_with(before))
                building_.height_fields.emplace(prefix_ + field.substr(before.size()), index);
        read_children(holder, scope);
        prefix_ = before;
        attaching_.erase(part);
        return;
    }
    const auto found = models_.find(*name);
    if (found == models_.end()) element.refuse(fmt::format("there is no model \"{}\" among the assets", *name));
    const std::string file = found->second->text("file");
    std::filesystem::path path = folder_ / file;
    if (!std::filesystem::is_regular_file(path)) found->second->refuse(fmt::format("there is no file \"{}\"", file));
    XmlElement root = read_xml(path, file);
    expand_includes(root, path.parent_path());
    if (root.name != "mujoco")
        throw InputError(
            fmt::format("{}: only models in MJCF are attached, and this is <{}>", root.where(), root.name));
    Parser(root, path.parent_path(), prefix_ + prefix, scope.suffix, depth_ + 1, building_)
        .attach(body, frame, scope.body, scope.frame, element);
}

std::string Parser::referred(const std::string& name, const std::string& suffix) const {
    if (name == "world") return name;
    if (suffix.empty()) return full(name, suffix_);
    return building_.replicas.contains(full(name, "")) ? full(name, suffix) : full(name, suffix_);
}

void Parser::for_each_replica(const XmlElement& element, std::initializer_list<const char*> attributes,
                              const std::function<void(const std::string&)>& f) {
    for (const char* attribute : attributes) {
        const std::string* name = element.find(attribute);
        if (name == nullptr) continue;
        const std::string own = full(*name, "");
        const auto found = building_.replicas.find(own);
        const bool named = std::any_of(building_.taken.begin(), building_.taken.end(),
                                       [&](const auto& kind) { return kind.second.contains(full(*name, suffix_)); });
        if (found == building_.replicas.end() || named) continue;
        std::vector<std::string> suffixes = found->second;
        std::sort(suffixes.begin(), suffixes.end());
        suffixes.erase(std::unique(suffixes.begin(), suffixes.end()), suffixes.end());
        for (const std::string& suffix : suffixes) {
            count(element);
            f(suffix);
        }
        return;
    }
    f(suffix_);
}

void Parser::read_references(bool attached) {
    // What refers to a part that is not there is refused, but where only a part of a model was attached or something
    // that has names was left out.
    const auto is_there = [&](const XmlElement& element, const char* kind, const std::string& name) {
        if (is_taken(kind, name)) return true;
        if (attached) return false;
        if (building_.names_are_lost) {
            building_.model.lose(fmt::format("{} \"{}\"", element.name, element.text("name")),
                                 fmt::format("it acts on a {} that is left out", kind));
            return false;
        }
        element.refuse(fmt::format("there is no {} \"{}\"", kind, name));
    };
    const Defaults& main = classes_.at("main");
    for (const XmlElement& section : root_.children) {
        if (section.name == "contact") read_contacts(section, attached);
        for (const XmlElement& child : section.children) {
            if (section.name == "equality") {
                for_each_replica(child, {"body1", "site1", "joint1"}, [&](const std::string& suffix) {
                    Equality equality = defaults_of(child, main).equality;
                    equality.name.clear();
                    read_equality(child, equality);
                    equality.name = full(equality.name, suffix);
                    equality.first = referred(equality.first, suffix);
                    equality.second = referred(equality.second, suffix);
                    if (equality.type == EqualityType::Other) {  // a loss as a whole
                        for (const XmlAttribute& attribute : child.attributes) attribute.read = true;
                        spec_.equalities.push_back(std::move(equality));
                        return;
                    }
                    const char* kind = equality.type == EqualityType::Joint ? "joint"
                                       : equality.by_sites                  ? "site"
                                                                            : "body";
                    if (!is_there(child, kind, equality.first)) return;
                    if (!equality.second.empty() && !is_there(child, kind, equality.second)) return;
                    take_alone(child, "equality", equality.name);
                    spec_.equalities.push_back(std::move(equality));
                });
            } else if (section.name == "actuator" && is_actuator(child.name)) {
                for_each_replica(child, {"joint", "jointinparent", "site", "body"}, [&](const std::string& suffix) {
                    Actuator actuator = defaults_of(child, main).actuator;
                    actuator.name.clear();
                    read_actuator(child, actuator);
                    actuator.name = full(actuator.name, suffix);
                    actuator.target = referred(actuator.target, suffix);
                    const bool joint = actuator.transmission == Transmission::Joint ||
                                       actuator.transmission == Transmission::JointInParent;
                    if (joint && !is_there(child, "joint", actuator.target)) return;
                    take_alone(child, "actuator", actuator.name);
                    spec_.actuators.push_back(std::move(actuator));
                });
            } else if (section.name == "tendon" && (child.name == "spatial" || child.name == "fixed")) {
                for_each_replica(child, {}, [&](const std::string& suffix) {
                    Tendon tendon = defaults_of(child, main).tendon;
                    tendon.name.clear();
                    read_tendon(child, tendon);
                    tendon.name = full(tendon.name, suffix);
                    take_alone(child, "tendon", tendon.name);
                    spec_.tendons.push_back(std::move(tendon));
                });
            } else if (section.name == "keyframe" && child.name == "key" && !attached) {
                read_key(child);
            } else if (section.name == "deformable") {
                if (child.name == "flex")
                    building_.model.lose(fmt::format("flex \"{}\"", child.text("name")), "a soft body");
            }
        }
    }
}

void Parser::read_contacts(const XmlElement& section, bool attached) {
    const auto is_there = [&](const XmlElement& element, const char* kind, const std::string& name) {
        if (is_taken(kind, name)) return true;
        if (attached || building_.names_are_lost) return false;
        element.refuse(fmt::format("there is no {} \"{}\"", kind, name));
    };
    for (const XmlElement& child : section.children) {
        if (child.name == "pair") {
            for_each_replica(child, {"geom1", "geom2"}, [&](const std::string& suffix) {
                Pair pair = defaults_of(child, classes_.at("main")).pair;
                read_pair(child, pair);
                pair.first = referred(pair.first, suffix);
                pair.second = referred(pair.second, suffix);
                if (is_there(child, "geom", pair.first) && is_there(child, "geom", pair.second))
                    spec_.pairs.push_back(std::move(pair));
            });
        } else if (child.name == "exclude") {
            for_each_replica(child, {"body1", "body2"}, [&](const std::string& suffix) {
                Exclude exclude{referred(child.text("body1"), suffix), referred(child.text("body2"), suffix),
                                child.where()};
                if (is_there(child, "body", exclude.first) && is_there(child, "body", exclude.second))
                    spec_.excludes.push_back(std::move(exclude));
            });
        }
    }
}

void Parser::read_key(const XmlElement& element) {
    Key key;
    key.name = element.text("name");
    take_alone(element, "keyframe", key.name);
    key.where = element.where();
    for (const auto& [attribute, values] :
         {std::pair("qpos", &key.qpos), std::pair("qvel", &key.qvel), std::pair("ctrl", &key.ctrl),
          std::pair("mpos", &key.mpos), std::pair("mquat", &key.mquat)})
        if (auto given = element.numbers(attribute)) *values = std::move(*given);
    spec_.keys.push_back(std::move(key));
}

void Parser::note_unread(const XmlElement& element) {
    static const std::set<std::string> known = {
        "mujoco",         "mujocoinclude", "compiler", "option",    "default",   "asset",      "worldbody",
        "contact",        "equality",      "actuator", "keyframe",  "sensor",    "custom",     "tendon",
        "deformable",     "body",          "geom",     "joint",     "freejoint", "inertial",   "site",
        "frame",          "replicate",     "attach",   "composite", "flexcomp",  "plugin",     "pair",
        "exclude",        "connect",       "weld",     "flex",      "spatial",   "fixed",      "key",
        "mesh",           "hfield",        "model",    "distance",  "flexvert",  "flexstrain", "include",
        "surface_contact"};
    static const std::set<std::string> harmless = {"name",
                                                   "class",
                                                   "childclass",
                                                   "group",
                                                   "rgba",
                                                   "material",
                                                   "user",
                                                   "model",
                                                   "file",
                                                   "time",
                                                   "act",
                                                   "texcoord",
                                                   "normal",
                                                   "smoothnormal",
                                                   "maxhullvert",
                                                   "params",
                                                   "content_type",
                                                   "solmix",
                                                   "usethread",
                                                   "saveinertial",
                                                   "conflict",
                                                   "fusestatic",
                                                   "convexhull",
                                                   "octree_maxdepth",
                                                   "fluidshape",
                                                   "fluidcoef",
                                                   "sleep",
                                                   "simple",
                                                   "lengthrange",
                                                   "nsample",
                                                   "interp",
                                                   "actdim",
                                                   "actearly",
                                                   "solreffriction",
                                                   "solimpfriction",
                                                   "plugin",
                                                   "instance",
                                                   "margin",
                                                   "width",
                                                   "springlength"};
    for (const XmlElement& child : element.children) {
        if (const char* kind = harmless_kind(child.name, element.name)) {
            spec_.seen[kind].push_back(child.text("name", child.name));
            continue;
        }
        if (is_quiet(child.name) || is_actuator(child.name)) continue;
        if (!known.contains(child.name)) {
            building_.model.lose(fmt::format("element <{}>", child.name), "MJCF as it is read here does not have it");
            continue;
        }
        const bool looks_only = child.name == "spatial" || child.name == "fixed" || child.name == "composite" ||
                                child.name == "flexcomp" || child.name == "flex" || child.name == "plugin" ||
                                child.name == "option";
        if (looks_only) continue;
        const bool site = child.name == "site";
        for (const XmlAttribute& attribute : child.attributes)
            if (site && (attribute.name == "size" || attribute.name == "type")) attribute.read = true;  // looks
        for (const XmlAttribute& attribute : child.attributes)
            if (!attribute.read && !harmless.contains(attribute.name))
                building_.model.lose(fmt::format("attribute {} of <{}>", attribute.name, child.name),
                                     "MJCF as it is read here does not have it");
        note_unread(child);
    }
}

Spec read_spec(const std::filesystem::path& file, model_import::Model& model) {
    XmlElement root = read_xml(file, "");
    expand_includes(root, file.parent_path());
    Building building{{}, model, {}, {}, {}, {}, false, 0};
    Parser(root, file.parent_path(), "", "", 0, building).read_all();
    finish(building.spec, model);
    finish_actuators(building.spec, model);
    return std::move(building.spec);
}

}  // namespace delassus::importers::mjcf
