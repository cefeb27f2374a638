// SPDX-License-Identifier: BSD-3-Clause
// Materials, bodies with their shapes, and nodes of a scene.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "problem/cone_kinds.hpp"
#include "scene/hull.hpp"
#include "scene/mass_properties.hpp"
#include "scene/system_reader.hpp"

namespace delassus::scene {

ContactMaterial SystemReader::read_contact_material(const YAML::Node& node, std::string_view name,
                                                    std::vector<std::pair<std::string_view, Handler>> more) {
    ContactMaterial material;
    more.emplace_back("friction", [&](const YAML::Node& n) {
        material.friction = nonnegative_number(source_, n, "friction");
        if (const auto& mu = operations_of(ConeKind::Friction).named_parameters()[0]; !mu.takes(material.friction))
            source_.refuse(n, fmt::format("\"friction\" is {}; it must be {}", material.friction, domain_of(mu)));
    });
    more.emplace_back("restitution", [&](const YAML::Node& n) {
        material.restitution = finite_number(source_, n, "restitution");
        if (material.restitution < 0.0 || material.restitution > 1.0)
            source_.refuse(n, fmt::format("\"restitution\" is {}; it must be from 0 to 1", material.restitution));
    });
    read_map(source_, node, name, more);
    return material;
}

void SystemReader::read_materials(const YAML::Node& node) {
    if (!node.IsMap()) source_.refuse(node, "\"materials\" must be a map of names to materials");
    for (const auto& entry : node) {
        const std::string name = scalar(source_, entry.first, "key");
        const auto material = read_contact_material(entry.second, fmt::format("the material \"{}\"", name));
        const auto number = at(entry.second, [&] { return result_.system->add_material(material); });
        take_name(entry.first, materials_, "material", name, number);
        result_.materials.push_back({name, material});
    }
}

void SystemReader::read_material_pair(const YAML::Node& item, const Copy&) {
    std::int32_t first = -1, second = -1;
    bool touch = true;
    auto material = read_contact_material(
        item, "a material pair",
        {{"first", [&](const YAML::Node& n) { first = material_named(n, "first"); }},
         {"second", [&](const YAML::Node& n) { second = material_named(n, "second"); }},
         {"touch", [&](const YAML::Node& n) { touch = value<bool>(source_, n, "touch", "true or false"); }}});
    material.touch = touch;
    if (first < 0 || second < 0) source_.refuse(item, "a material pair needs the keys \"first\" and \"second\"");
    at(item, [&] { result_.system->set_material_pair(first, second, material); });
    result_.material_pairs.push_back({std::min(first, second), std::max(first, second), material});
}

namespace {

constexpr std::array<std::string_view, 6> shape_kinds = {"sphere", "box", "capsule", "cylinder", "plane", "convex"};

}  // namespace

Shape SystemReader::read_shape_kind(const YAML::Node& item, std::string_view kind, const YAML::Node& node) {
    Shape shape;
    std::optional<double> radius, length;
    std::optional<Vector3> size;
    const auto name = fmt::format("\"{}\"", kind);
    const auto need = [&](const auto& number, std::string_view key) {
        if (!number) source_.refuse(node.IsDefined() ? node : item, fmt::format("{} lacks the key \"{}\"", name, key));
        return *number;
    };
    const std::pair<std::string_view, Handler> read_radius{
        "radius", [&](const YAML::Node& n) { radius = positive_number(source_, n, "radius"); }};
    const std::pair<std::string_view, Handler> read_length{
        "length", [&](const YAML::Node& n) { length = positive_number(source_, n, "length"); }};
    if (kind == "sphere") {
        shape.kind = ShapeKind::Sphere;
        read_map(source_, node, name, {read_radius});
        shape.size[0] = need(radius, "radius");
    } else if (kind == "box") {
        shape.kind = ShapeKind::Box;
        read_map(source_, node, name,
                 {{"size", [&](const YAML::Node& n) {
                       size = vector3(source_, n, "size");
                       if (!std::all_of(size->begin(), size->end(), [](double v) { return v > 0; }))
                           source_.refuse(n, "\"size\" must be three positive numbers");
                   }}});
        shape.size = need(size, "size");
        for (double& edge : shape.size) edge *= 0.5;
    } else if (kind == "plane") {
        shape.kind = ShapeKind::Plane;
        if (!node.IsNull()) read_map(source_, node, name, {});
    } else if (kind == "convex") {
        shape.kind = ShapeKind::Convex;
        std::optional<std::vector<Vector3>> points;
        read_map(source_, node, name, {{"points", [&](const YAML::Node& n) {
                                            points.emplace();
                                            for (const YAML::Node& point : elements(source_, n, "points"))
                                                points->push_back(vector3(source_, point, "points"));
                                        }}});
        const auto given = need(points, "points");
        shape.mesh = at(node, [&] { return std::make_shared<Mesh>(hull_of_points(given)); });
    } else {
        shape.kind = kind == "capsule" ? ShapeKind::Capsule : ShapeKind::Cylinder;
        read_map(source_, node, name, {read_radius, read_length});
        shape.size = {need(radius, "radius"), 0.5 * need(length, "length"), 0.0};
    }
    return shape;
}

Shape SystemReader::read_terrain_shape(const YAML::Node& node) {
    std::string file;
    double scale = 1.0;
    if (node.IsScalar()) {
        file = node.Scalar();
    } else {
        read_map(source_, node, "\"terrain\"",
                 {{"file", [&](const YAML::Node& n) { file = scalar(source_, n, "file"); }},
                  {"scale", [&](const YAML::Node& n) { scale = positive_number(source_, n, "scale"); }}});
    }
    if (file.empty()) source_.refuse(node, "\"terrain\" lacks the key \"file\"");
    result_.surfaces_read = true;
    Shape shape;
    shape.kind = ShapeKind::Terrain;
    shape.mesh = at(node, [&] { return std::make_shared<const Mesh>(read_terrain(source_.folder() / file, scale)); });
    return shape;
}

Shape SystemReader::read_height_field(const YAML::Node& node) {
    std::optional<Heights> heights;
    std::optional<std::array<double, 2>> size;
    double scale = 1.0;
    const auto only_once = [&](const YAML::Node& n) {
        if (heights) source_.refuse(n, "a height field has either \"heights\" or \"file\", not both");
    };
    read_map(source_, node, "\"height_field\"",
             {{"heights",
               [&](const YAML::Node& n) {
                   only_once(n);
                   heights.emplace();
                   for (const YAML::Node& row : elements(source_, n, "heights")) {
                       const auto values = elements(source_, row, "heights");
                       if (heights->rows > 0 && static_cast<std::int32_t>(values.size()) != heights->columns)
                           source_.refuse(row, fmt::format("the row has {} heights, those before it {}", values.size(),
                                                           heights->columns));
                       heights->columns = static_cast<std::int32_t>(values.size());
                       ++heights->rows;
                       for (const YAML::Node& value : values)
                           heights->values.push_back(finite_number(source_, value, "heights"));
                   }
               }},
              {"file",
               [&](const YAML::Node& n) {
                   only_once(n);
                   heights = at(n, [&] { return read_heights(source_.folder() / scalar(source_, n, "file")); });
               }},
              {"size",
               [&](const YAML::Node& n) {
                   const auto values = elements(source_, n, "size");
                   if (values.size() != 2) source_.refuse(n, "\"size\" must be two numbers, along x and y");
                   size = {positive_number(source_, values[0], "size"), positive_number(source_, values[1], "size")};
               }},
              {"scale", [&](const YAML::Node& n) { scale = finite_number(source_, n, "scale"); }}});
    if (!heights) source_.refuse(node, "\"height_field\" lacks the key \"heights\" (or \"file\")");
    if (!size) source_.refuse(node, "\"height_field\" lacks the key \"size\"");
    Shape shape;
    shape.kind = ShapeKind::HeightField;
    shape.mesh =
        at(node, [&] { return std::make_shared<const Mesh>(height_field(*heights, (*size)[0], (*size)[1], scale)); });
    return shape;
}

std::vector<Shape> SystemReader::read_mesh_shapes(const YAML::Node& node) {
    std::string file;
    double scale = 1.0;
    bool centered = false;
    if (node.IsScalar()) {
        file = node.Scalar();
    } else {
        read_map(source_, node, "\"mesh\"",
                 {{"file", [&](const YAML::Node& n) { file = scalar(source_, n, "file"); }},
                  {"scale", [&](const YAML::Node& n) { scale = positive_number(source_, n, "scale"); }},
                  {"centered", [&](const YAML::Node& n) { centered = truth(source_, n, "centered"); }}});
    }
    if (file.empty()) source_.refuse(node, "\"mesh\" lacks the key \"file\"");
    result_.surfaces_read = true;
    return at(node, [&] {
        std::vector<Shape> shapes;
        for (auto& part : read_surface_mesh(source_.folder() / file, scale)) {
            Shape shape;
            shape.kind = ShapeKind::Convex;
            shape.mesh = std::make_shared<const Mesh>(std::move(part));
            shapes.push_back(std::move(shape));
        }
        if (!centered) return shapes;
        const Vector3 centre = mass_properties(shapes).centre;
        for (auto& shape : shapes) {
            Mesh moved = *shape.mesh;
            for (auto& vertex : moved.vertices)
                for (std::size_t i = 0; i < 3; ++i) vertex[i] -= centre[i];
            shape.mesh = std::make_shared<const Mesh>(std::move(moved));
        }
        return shapes;
    });
}

std::vector<SystemReader::ShapeOfBody> SystemReader::read_shapes(const YAML::Node& node) {
    std::vector<ShapeOfBody> shapes;
    for (const YAML::Node& item : elements(source_, node, "shapes")) {
        std::vector<Shape> kind;  // one, or the parts of a mesh
        ShapeOfBody one;
        one.node = item;
        Pose pose;
        double margin = 0.0;
        std::vector<std::pair<std::string_view, Handler>> handlers = {
            {"material", [&](const YAML::Node& n) { one.material = material_named(n, "material"); }},
            {"position", [&](const YAML::Node& n) { pose.position = vector3(source_, n, "position"); }},
            {"orientation", [&](const YAML::Node& n) { pose.orientation = orientation(source_, n); }},
            {"margin", [&](const YAML::Node& n) { margin = nonnegative_number(source_, n, "margin"); }}};
        for (const std::string_view name : shape_kinds)
            handlers.emplace_back(name, [&, name](const YAML::Node& n) {
                if (!kind.empty()) source_.refuse(n, "a shape is of one kind, not of several");
                kind = {read_shape_kind(item, name, n)};
            });
        handlers.emplace_back("terrain", [&](const YAML::Node& n) {
            if (!kind.empty()) source_.refuse(n, "a shape is of one kind, not of several");
            kind = {read_terrain_shape(n)};
        });
        handlers.emplace_back("height_field", [&](const YAML::Node& n) {
            if (!kind.empty()) source_.refuse(n, "a shape is of one kind, not of several");
            kind = {read_height_field(n)};
        });
        handlers.emplace_back("mesh", [&](const YAML::Node& n) {
            if (!kind.empty()) source_.refuse(n, "a shape is of one kind, not of several");
            kind = read_mesh_shapes(n);
        });
        read_map(source_, item, "a shape", handlers);
        if (kind.empty())
            source_.refuse(
                item, fmt::format("a shape must have one of the keys \"{}\", \"mesh\", \"terrain\", \"height_field\"",
                                  fmt::join(shape_kinds, "\", \"")));
        for (const Shape& part : kind) {
            one.shape = part;
            one.shape.pose = pose;
            one.shape.margin = margin;
            shapes.push_back(one);
        }
    }
    return shapes;
}

namespace {

Inertia scaled(const Inertia& inertia, double factor) {
    return {factor * inertia.xx, factor * inertia.yy, factor * inertia.zz,
            factor * inertia.xy, factor * inertia.xz, factor * inertia.yz};
}

}  // namespace

// motion: {translation: [x, y, z], rotation: {axis, angle, point}}
BodyMotion SystemReader::read_body_motion(const YAML::Node& node, const Copy& copy) {
    BodyMotion result;
    bool translation = false, rotation = false, angle = false;
    read_map(source_, node, "\"motion\"",
             {{"translation",
               [&](const YAML::Node& n) {
                   result.translation = three_motions(n, "translation", nullptr);
                   translation = true;
               }},
              {"rotation", [&](const YAML::Node& n) {
                   rotation = true;
                   read_map(
                       source_, n, "\"rotation\"",
                       {{"axis", [&](const YAML::Node& v) { result.axis = vector3(source_, v, "axis"); }},
                        {"angle",
                         [&](const YAML::Node& v) {
                             result.angle = motion(source_, v, "angle", nullptr);
                             angle = true;
                         }},
                        {"point", [&](const YAML::Node& v) { result.point = point_in(source_, v, "point", copy); }}});
                   if (!angle) source_.refuse(n, "\"rotation\" lacks the key \"angle\"");
               }}});
    if (!translation && !rotation)
        source_.refuse(node, "\"motion\" is empty; it must have a translation or a rotation");
    return result;
}

void SystemReader::refuse_endless_shape(const ShapeOfBody& shape, const std::string& body) {
    const ShapeKind kind = shape.shape.kind;
    if (kind == ShapeKind::Plane)
        source_.refuse(shape.node,
                       fmt::format("a plane is for fixed bodies only, and body \"{}\" moves; use a box", body));
    if (kind == ShapeKind::Terrain || kind == ShapeKind::HeightField)
        source_.refuse(shape.node,
                       fmt::format("terrain is for fixed bodies only, and body \"{}\" moves; use convex shapes", body));
}

void SystemReader::read_body(const YAML::Node& item, const Copy& copy) {
    BodyParameters body;
    body.pose.position = copy.offset;
    std::optional<double> mass, density;
    std::optional<Inertia> inertia;
    std::vector<ShapeOfBody> shapes;
    YAML::Node motion_place(YAML::NodeType::Undefined);
    read_map(source_, item, "a body",
             {{"name", [&](const YAML::Node& n) { body.name = name_in(source_, n, "name", copy); }},
              {"mass", [&](const YAML::Node& n) { mass = positive_number(source_, n, "mass"); }},
              {"density", [&](const YAML::Node& n) { density = positive_number(source_, n, "density"); }},
              {"inertia",
               [&](const YAML::Node& n) {
                   Inertia J{0.0, 0.0, 0.0};
                   const auto into = [&](double& entry, std::string_view key) {
                       return std::pair<std::string_view, Handler>{
                           key, [&, key](const YAML::Node& v) { entry = finite_number(source_, v, key); }};
                   };
                   read_map(source_, n, "\"inertia\"",
                            {into(J.xx, "xx"), into(J.yy, "yy"), into(J.zz, "zz"), into(J.xy, "xy"), into(J.xz, "xz"),
                             into(J.yz, "yz")});
                   inertia = J;
               }},
              {"position", [&](const YAML::Node& n) { body.pose.position = point_in(source_, n, "position", copy); }},
              {"orientation", [&](const YAML::Node& n) { body.pose.orientation = orientation(source_, n); }},
              {"velocity", [&](const YAML::Node& n) { body.velocity = vector3(source_, n, "velocity"); }},
              {"angular_velocity",
               [&](const YAML::Node& n) { body.angular_velocity = vector3(source_, n, "angular_velocity"); }},
              {"fixed", [&](const YAML::Node& n) { body.fixed = truth(source_, n, "fixed"); }},
              {"massless", [&](const YAML::Node& n) { body.massless = truth(source_, n, "massless"); }},
              {"motion",
               [&](const YAML::Node& n) {
                   body.motion = read_body_motion(n, copy);
                   motion_place.reset(n);
               }},
              {"shapes", [&](const YAML::Node& n) { shapes = read_shapes(n); }},
              {"repeat", [](const YAML::Node&) {}}});
    if (body.motion && body.fixed)
        source_.refuse(motion_place,
                       fmt::format("body \"{}\" is fixed, and has a \"motion\"; give one of them", body.name));
    if (body.motion && (body.velocity != Vector3{} || body.angular_velocity != Vector3{}))
        source_.refuse(motion_place, fmt::format("the velocities of body \"{}\" follow from its \"motion\"; give no "
                                                 "\"velocity\" and no \"angular_velocity\"",
                                                 body.name));
    if (body.massless && (mass || density || inertia))
        source_.refuse(item,
                       fmt::format("body \"{}\" is massless, and has a mass, a density or an inertia", body.name));
    if (!body.fixed)
        for (const ShapeOfBody& one : shapes) refuse_endless_shape(one, body.name);
    if (mass && density) source_.refuse(item, "a body has either \"mass\" or \"density\", not both");
    if (!body.fixed && !body.motion && !body.massless) {
        if (!mass && !density)
            source_.refuse(item,
                           fmt::format("body \"{}\" lacks the key \"mass\" (or \"density\", with shapes)", body.name));
        if (density && inertia) source_.refuse(item, "a body with \"density\" takes its inertia from its shapes");
        if (inertia) {
            body.mass = *mass;
            body.inertia = *inertia;
        } else {
            if (shapes.empty())
                source_.refuse(item, fmt::format("body \"{}\" lacks the key \"inertia\", and has no shapes from which "
                                                 "it would follow",
                                                 body.name));
            std::vector<Shape> solids;
            for (const auto& one : shapes) solids.push_back(one.shape);
            const auto properties = at(item, [&] { return mass_properties(solids); });
            const auto& c = properties.centre;
            if (std::hypot(c[0], c[1], c[2]) > 1e-6 * std::cbrt(properties.volume))
                source_.refuse(item, fmt::format("the mass centre of the shapes of body \"{}\" is at ({:.6g}, {:.6g}, "
                                                 "{:.6g}) in its frame; it must be at the origin",
                                                 body.name, c[0], c[1], c[2]));
            body.mass = mass ? *mass : *density * properties.volume;
            body.inertia = scaled(properties.inertia, body.mass / properties.volume);
        }
    }
    const auto index = at(item, [&] { return result_.system->add_body(body); });
    take_name(item, bodies_, "body", body.name, index);
    if (body.motion) body.pose = result_.system->body(index).pose;  // at t = 0
    result_.bodies.push_back(body);
    for (auto& one : shapes) {
        if (one.material < 0) {
            const auto [place, added] = materials_.emplace("frictionless", 0);
            if (added) {
                place->second = result_.system->add_material({});
                result_.materials.push_back({"frictionless", {}});
            }
            one.material = place->second;
        }
        one.shape.body = index;
        at(one.node, [&] { result_.system->add_shape(one.shape, one.material); });
        result_.shape_material.push_back(one.material);
    }
}

void SystemReader::read_node(const YAML::Node& item, const Copy& copy) {
    NodeParameters node;
    node.position = copy.offset;
    read_map(source_, item, "a node",
             {{"name", [&](const YAML::Node& n) { node.name = name_in(source_, n, "name", copy); }},
              {"mass", [&](const YAML::Node& n) { node.mass = nonnegative_number(source_, n, "mass"); }},
              {"position", [&](const YAML::Node& n) { node.position = point_in(source_, n, "position", copy); }},
              {"velocity", [&](const YAML::Node& n) { node.velocity = vector3(source_, n, "velocity"); }},
              {"fixed", [&](const YAML::Node& n) { node.fixed = truth(source_, n, "fixed"); }},
              {"repeat", [](const YAML::Node&) {}}});
    const auto number = at(item, [&] { return result_.system->add_node(node); });
    take_name(item, nodes_, "node", node.name, number);
    result_.nodes.push_back(node);
}

}  // namespace delassus::scene
