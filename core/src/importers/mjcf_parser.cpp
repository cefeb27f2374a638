// SPDX-License-Identifier: BSD-3-Clause
#include "importers/mjcf_parser.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "delassus/error.hpp"

namespace delassus::importers::mjcf {

namespace {

constexpr std::size_t most_made = 1000000;
constexpr int most_attached = 20;

}  // namespace

Parser::Parser(const XmlElement& root, std::filesystem::path folder, std::string prefix, std::string suffix, int depth,
               Building& building)
    : root_(root),
      folder_(std::move(folder)),
      prefix_(std::move(prefix)),
      suffix_(std::move(suffix)),
      depth_(depth),
      building_(building),
      spec_(building.spec),
      compiler_number_(building.spec.compilers.size()) {
    if (depth > most_attached) root.refuse(fmt::format("models are attached more than {} deep", most_attached));
    spec_.compilers.emplace_back();
    read_settings();
}

void Parser::read_settings() {
    for (const XmlElement& section : root_.children) {
        if (section.name == "compiler") read_compiler(section, compiler_);
        if (section.name == "option") {
            Option unused;
            read_option(section, depth_ == 0 ? spec_.option : unused);
        }
    }
    if (compiler_.exact_mesh_inertia) classes_["main"].mesh.inertia = MeshInertia::Exact;
    spec_.compilers[compiler_number_] = compiler_;
    classes_.try_emplace("main");
    for (const XmlElement& section : root_.children)
        if (section.name == "default") read_defaults(section, classes_.at("main"), true);
    for (const XmlElement& section : root_.children)
        if (section.name == "asset") read_assets(section);
}

void Parser::read_defaults(const XmlElement& element, const Defaults& parent, bool top) {
    const std::string* given = element.find("class");
    const std::string name = given != nullptr ? *given : "main";
    if (!top && given == nullptr) element.refuse("a class of defaults within another one needs a name (class)");
    Defaults own = parent;
    for (const XmlElement& child : element.children) {
        if (child.name == "geom") read_geom(child, compiler_, own.geom);
        if (child.name == "joint") read_joint(child, compiler_, own.joint);
        if (child.name == "site") read_site(child, compiler_, own.site);
        if (child.name == "equality") read_equality(child, own.equality);
        if (child.name == "pair") read_pair(child, own.pair);
        if (child.name == "tendon") read_tendon(child, own.tendon);
        if (child.name == "mesh") {
            child.read("scale", own.mesh.scale.data(), 3, 3);
            if (const int kind = child.word("inertia", {"convex", "exact", "legacy", "shell"}); kind >= 0)
                own.mesh.inertia = static_cast<MeshInertia>(kind);
        }
        if (is_actuator(child.name)) read_actuator(child, own.actuator);
    }
    if (top) classes_["main"] = own;
    classes_[name] = own;
    for (const XmlElement& child : element.children)
        if (child.name == "default") read_defaults(child, own, false);
}

std::filesystem::path Parser::asset(const XmlElement& element, const std::string& folder) const {
    const std::string* given = element.find("file");
    if (given == nullptr || given->empty()) return {};
    if (given->find("://") != std::string::npos) {
        const auto found = model_import::find_file(*given, folder_ / "model.xml", building_.model.package_paths);
        return found.empty() ? std::filesystem::path(*given) : found;
    }
    std::filesystem::path path = *given;
    if (compiler_.strip_path) path = path.filename();
    return path.is_absolute() ? path : folder_ / folder / path;
}

void Parser::read_assets(const XmlElement& element) {
    for (const XmlElement& child : element.children) {
        if (child.name == "mesh") read_mesh_asset(child);
        if (child.name == "hfield") read_height_field_asset(child);
        if (child.name == "model") {
            const std::string file = child.text("file");
            if (file.empty()) child.refuse("it names no file");
            std::string name = child.text("name");
            if (name.empty() && std::filesystem::is_regular_file(folder_ / file))
                name = read_xml(folder_ / file, file).text("model");
            models_[name.empty() ? std::filesystem::path(file).stem().string() : name] = &child;
        }
    }
}

void Parser::read_mesh_asset(const XmlElement& element) {
    const auto file = asset(element, compiler_.mesh_folder);
    Mesh mesh = read_mesh(element, defaults_of(element, classes_.at("main")).mesh, file);
    mesh.name = element.text("name", file.stem().string());
    if (mesh.name.empty()) element.refuse("it has neither a name nor a file");
    const std::string name = full(mesh.name, suffix_);
    mesh.name = name;
    if (!building_.meshes.emplace(name, std::make_shared<const Mesh>(std::move(mesh))).second)
        element.refuse(fmt::format("there is another mesh \"{}\"", name));
    spec_.meshes.push_back(building_.meshes.at(name));
}

void Parser::read_height_field_asset(const XmlElement& element) {
    const auto file = asset(element, compiler_.mesh_folder);
    HeightField field = read_height_field(element, file);
    field.name = full(element.text("name", file.stem().string()), suffix_);
    if (!building_.height_fields.emplace(field.name, spec_.height_fields.size()).second)
        element.refuse(fmt::format("there is another height field \"{}\"", field.name));
    spec_.height_fields.push_back(std::move(field));
}

const Defaults& Parser::defaults_of(const XmlElement& element, const Defaults& otherwise) const {
    const std::string* name = element.find("class");
    if (name == nullptr) return otherwise;
    const auto found = classes_.find(*name);
    if (found == classes_.end()) element.refuse(fmt::format("there is no class \"{}\" of defaults", *name));
    return found->second;
}

const Defaults& Parser::child_defaults_of(const XmlElement& element, const Defaults& otherwise) const {
    const std::string* name = element.find("childclass");
    if (name == nullptr) return otherwise;
    const auto found = classes_.find(*name);
    if (found == classes_.end()) element.refuse(fmt::format("there is no class \"{}\" of defaults", *name));
    return found->second;
}

std::string Parser::full(const std::string& name, const std::string& suffix) const {
    return name.empty() ? name : prefix_ + name + suffix;
}

void Parser::count(const XmlElement& element) {
    if (++building_.made > most_made) element.refuse(fmt::format("the model has more than {} parts", most_made));
}

bool Parser::is_taken(const char* kind, const std::string& name) const {
    const auto all = building_.taken.find(kind);
    return all != building_.taken.end() && all->second.contains(name);
}

void Parser::take(const XmlElement& element, const char* kind, std::string& name, const std::string& suffix,
                  std::int32_t number) {
    count(element);
    if (name.empty()) return;
    if (!suffix.empty()) building_.replicas[prefix_ + name].push_back(suffix);
    name = full(name, suffix);
    take_alone(element, kind, name, number);
}

void Parser::take_alone(const XmlElement& element, const char* kind, const std::string& name, std::int32_t number) {
    if (!name.empty() && !building_.taken[kind].emplace(name, number).second)
        element.refuse(fmt::format("there is another {} \"{}\"", kind, name));
}

void Parser::read_children(const XmlElement& element, const Scope& scope) {
    for (const XmlElement& child : element.children) {
        const bool world = scope.body == 0;
        const Defaults& defaults = child.name == "body" || child.name == "frame" || child.name == "replicate"
                                       ? *scope.defaults
                                       : defaults_of(child, *scope.defaults);
        if (child.name == "body") {
            read_body(child, scope, defaults);
        } else if (child.name == "geom") {
            read_geom_of(child, scope, defaults);
        } else if (child.name == "joint" || child.name == "freejoint") {
            if (world) child.refuse("the world has no joints");
            read_joint_of(child, scope, defaults);
        } else if (child.name == "inertial") {
            if (world) child.refuse("the world has no inertia");
            read_inertial(child, compiler_, spec_.bodies[static_cast<std::size_t>(scope.body)]);
        } else if (child.name == "site") {
            read_site_of(child, scope, defaults);
        } else if (child.name == "frame") {
            Scope inner = scope;
            Vector3d position = Vector3d::Zero();
            child.read("pos", position.data(), 3, 3);
            inner.frame =
                scope.frame * frame_of(position, orientation_of(child, compiler_).value_or(Quaterniond::Identity()));
            inner.defaults = &child_defaults_of(child, *scope.defaults);
            read_children(child, inner);
        } else if (child.name == "replicate") {
            read_replicas(child, scope, defaults);
        } else if (child.name == "attach") {
            read_attachment(child, scope);
        } else if (child.name == "composite" || child.name == "flexcomp") {
            building_.names_are_lost = true;
            building_.model.lose(fmt::format("{} \"{}\"", child.name, child.text("prefix", child.text("name"))),
                                 "cables, cloths and soft bodies that MuJoCo makes");
        } else if (child.name == "plugin") {
            building_.model.lose(fmt::format("plugin \"{}\"", child.text("plugin", child.text("instance"))),
                                 "what its code does");
        }
    }
}

void Parser::read_body(const XmlElement& element, const Scope& scope, const Defaults& defaults) {
    const auto number = static_cast<std::int32_t>(spec_.bodies.size());
    Body body;
    body.name = element.text("name");
    if (body.name == "world" && prefix_.empty() && scope.suffix.empty()) element.refuse("only the world is named so");
    take(element, "body", body.name, scope.suffix, number);
    body.parent = scope.body;
    body.where = element.where();
    body.compiler = compiler_number_;
    body.global = compiler_.global;
    body.placed = element.read("pos", body.position.data(), 3, 3) > 0;
    body.orientation = orientation_of(element, compiler_).value_or(Quaterniond::Identity());
    element.read("mocap", body.mocap);
    element.read("gravcomp", body.gravity_compensation);
    if (body.mocap && scope.body != 0) element.refuse("only a child of the world is moved from outside (mocap)");
    if (!body.global) {
        const Frame at = scope.frame * frame_of(body.position, body.orientation);
        body.position = at.translation();
        body.orientation = Quaterniond(at.linear()).normalized();
    }
    spec_.bodies.push_back(std::move(body));
    Scope inner;
    inner.body = number;
    inner.suffix = scope.suffix;
    inner.defaults = &child_defaults_of(element, defaults);
    read_children(element, inner);
}

void Parser::read_joint_of(const XmlElement& element, const Scope& scope, const Defaults& defaults) {
    Joint joint;
    if (element.name == "joint") {
        joint = defaults.joint;
        joint.name.clear();
        read_joint(element, compiler_, joint);
    } else {
        joint.type = JointType::Free;
        joint.where = element.where();
        element.read("name", joint.name);
        if (const int align = element.word("align", {"false", "true", "auto"}); align >= 0)
            joint.align = static_cast<Switch>(align);
    }
    take(element, "joint", joint.name, scope.suffix, 0);
    joint.position = scope.frame * joint.position;
    joint.axis = scope.frame.linear() * joint.axis;
    Body& body = spec_.bodies[static_cast<std::size_t>(scope.body)];
    if (body.mocap) element.refuse("a body that is moved from outside (mocap) has no joints");
    body.joints.push_back(std::move(joint));
}

void Parser::read_geom_of(const XmlElement& element, const Scope& scope, const Defaults& defaults) {
    Geom geom = defaults.geom;
    geom.name.clear();
    read_geom(element, compiler_, geom);
    if (!geom.mesh.empty()) {
        const auto found = building_.meshes.find(full(geom.mesh, suffix_));
        if (found == building_.meshes.end()) element.refuse(fmt::format("there is no mesh \"{}\"", geom.mesh));
        geom.of_mesh = found->second;
        geom.mesh = found->first;
    } else if (geom.type == GeomType::Mesh) {
        element.refuse("it names no mesh");
    }
    if (geom.type == GeomType::HeightField) {
        geom.height_field = full(geom.height_field, suffix_);
        if (!building_.height_fields.contains(geom.height_field))
            element.refuse(fmt::format("there is no height field \"{}\"", geom.height_field));
    }
    if (element.text("type") == "sdf")
        building_.model.lose(fmt::format("geom \"{}\"", geom.name), "a distance field: the hull of its mesh collides");
    complete(geom, element, compiler_);
    take(element, "geom", geom.name, scope.suffix, 0);
    const Frame at = scope.frame * frame_of(geom.position, geom.orientation);
    geom.position = at.translation();
    geom.orientation = Quaterniond(at.linear()).normalized();
    spec_.bodies[static_cast<std::size_t>(scope.body)].geoms.push_back(std::move(geom));
}

void Parser::read_site_of(const XmlElement& element, const Scope& scope, const Defaults& defaults) {
    Site site = defaults.site;
    site.name.clear();
    read_site(element, compiler_, site);
    if (!std::isnan(site.from_to[0])) {
        const Vector3d from(site.from_to.data()), to(site.from_to.data() + 3);
        site.position = 0.5 * (from + to);
        if ((from - to).norm() > 0.0) site.orientation = z_towards(from - to);
    }
    take(element, "site", site.name, scope.suffix, 0);
    const Frame at = scope.frame * frame_of(site.position, site.orientation);
    site.position = at.translation();
    site.orientation = Quaterniond(at.linear()).normalized();
    spec_.seen["sites"].push_back(site.name.empty() ? "site" : site.name);
    spec_.bodies[static_cast<std::size_t>(scope.body)].sites.push_back(std::move(site));
}

// Replica i is turned by i times the angles, and is an offset, seen from the one before, away from that.
void Parser::read_replicas(const XmlElement& element, const Scope& scope, const Defaults& defaults) {
    int count = 0;
    if (!element.read("count", count)) element.refuse("it has no count");
    if (count < 1) element.refuse(fmt::format("the count is {}", count));
    Vector3d offset = Vector3d::Zero(), angles = Vector3d::Zero();
    element.read("offset", offset.data(), 3, 3);
    element.read("euler", angles.data(), 3, 3);
    const std::string separator = element.text("sep");
    const std::size_t digits = std::to_string(count).size();
    Vector3d position = Vector3d::Zero();
    for (int k = 0; k < count; ++k) {
        this->count(element);
        XmlElement turn;
        turn.name = element.name;
        turn.file = element.file;
        turn.line = element.line;
        const Vector3d own = k * angles;
        turn.attributes.push_back({"euler", fmt::format("{} {} {}", own.x(), own.y(), own.z())});
        const Quaterniond q = orientation_of(turn, compiler_).value_or(Quaterniond::Identity());
        const std::string index = std::to_string(k);
        Scope inner = scope;
        inner.frame = scope.frame * frame_of(position, q);
        // The innermost suffix comes first.
        inner.suffix = separator + std::string(digits - index.size(), '0') + index + scope.suffix;
        inner.defaults = &child_defaults_of(element, defaults);
        read_children(element, inner);
        position += q * offset;
    }
}

}  // namespace delassus::importers::mjcf
