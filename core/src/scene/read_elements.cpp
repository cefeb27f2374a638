// SPDX-License-Identifier: BSD-3-Clause
// Elastic parts of a scene: blocks and meshes of tetrahedra, cables between nodes.
#include <array>
#include <limits>
#include <optional>

#include "scene/system_reader.hpp"

namespace delassus::scene {
namespace {

constexpr std::array<std::string_view, 6> face_names = {"x_min", "x_max", "y_min", "y_max", "z_min", "z_max"};

std::size_t face(const Source& source, const YAML::Node& node) {
    const std::string name = scalar(source, node, "fixed_faces");
    for (std::size_t i = 0; i < face_names.size(); ++i)
        if (face_names[i] == name) return i;
    source.refuse(node, fmt::format("there is no face \"{}\"{}", name, nearest_name_hint(name, face_names)));
}

ElementModel element_model(const Source& source, const YAML::Node& node) {
    constexpr std::array<std::string_view, 2> names = {"corotational", "st_venant_kirchhoff"};
    const std::string name = scalar(source, node, "model");
    if (name == names[0]) return ElementModel::Corotational;
    if (name == names[1]) return ElementModel::StVenantKirchhoff;
    source.refuse(node, fmt::format("there is no element model \"{}\"{}", name, nearest_name_hint(name, names)));
}

ElementOrder element_order(const Source& source, const YAML::Node& node) {
    const auto order = value<int>(source, node, "order", "a whole number");
    if (order != 1 && order != 2)
        source.refuse(node, fmt::format("\"order\" is {}; elements have order 1 or 2", order));
    return static_cast<ElementOrder>(order);
}

}  // namespace

template <class Parameters>
std::vector<std::pair<std::string_view, Handler>> SystemReader::elastic_handlers(Parameters& body,
                                                                                 std::optional<std::int32_t>& modes) {
    const auto number = [&](double& value, std::string_view key, auto&& read) {
        return std::pair<std::string_view, Handler>{
            key, [this, &value, key, read](const YAML::Node& n) { value = read(source_, n, key); }};
    };
    const auto read_contact = [this, &body](const YAML::Node& node) {
        bool radius = false, material = false;
        read_map(source_, node, "\"contact\"",
                 {{"radius",
                   [&](const YAML::Node& n) {
                       body.contact_radius = positive_number(source_, n, "radius");
                       radius = true;
                   }},
                  {"material", [&](const YAML::Node& n) {
                       body.contact_material = material_named(n, "material");
                       material = true;
                   }}});
        if (!radius || !material)
            source_.refuse(node, fmt::format("\"contact\" lacks the key \"{}\"", radius ? "material" : "radius"));
    };
    return {number(body.material.young, "young", positive_number),
            number(body.material.poisson, "poisson", finite_number),
            number(body.material.density, "density", positive_number),
            number(body.material.damping_time, "damping_time", nonnegative_number),
            number(body.material.damping_rate, "damping_rate", nonnegative_number),
            {"model", [this, &body](const YAML::Node& n) { body.model = element_model(source_, n); }},
            {"order", [this, &body](const YAML::Node& n) { body.order = element_order(source_, n); }},
            {"velocity", [this, &body](const YAML::Node& n) { body.velocity = vector3(source_, n, "velocity"); }},
            {"angular_velocity",
             [this, &body](const YAML::Node& n) { body.angular_velocity = vector3(source_, n, "angular_velocity"); }},
            {"modes", [this, &modes](
                          const YAML::Node& n) { modes = value<std::int32_t>(source_, n, "modes", "a whole number"); }},
            {"contact", read_contact},
            {"repeat", [](const YAML::Node&) {}}};
}

void SystemReader::read_elastic_block(const YAML::Node& item, const Copy& copy) {
    ElasticBlock block;
    block.corner = copy.offset;
    bool edges = false, cells = false;
    std::optional<std::int32_t> modes;
    auto handlers = elastic_handlers(block, modes);
    handlers.insert(handlers.end(),
                    {{"name", [&](const YAML::Node& n) { block.name = name_in(source_, n, "name", copy); }},
                     {"corner", [&](const YAML::Node& n) { block.corner = point_in(source_, n, "corner", copy); }},
                     {"edges",
                      [&](const YAML::Node& n) {
                          block.edges = vector3(source_, n, "edges");
                          edges = true;
                      }},
                     {"cells",
                      [&](const YAML::Node& n) {
                          const auto counts = elements(source_, n, "cells");
                          if (counts.size() != 3) source_.refuse(n, "\"cells\" must be three whole numbers");
                          for (std::size_t i = 0; i < 3; ++i)
                              block.cells[i] = value<std::int32_t>(source_, counts[i], "cells", "a whole number");
                          cells = true;
                      }},
                     {"fixed_faces", [&](const YAML::Node& n) {
                          for (const YAML::Node& one : elements(source_, n, "fixed_faces"))
                              block.fixed_faces[face(source_, one)] = true;
                      }}});
    read_map(source_, item, "an elastic block", handlers);
    if (!edges || !cells)
        source_.refuse(item,
                       fmt::format("elastic block \"{}\" lacks the key \"{}\"", block.name, edges ? "cells" : "edges"));
    const auto first = at(item, [&] {
        return modes ? result_.system->add_reduced_body({block, *modes}) : result_.system->add_elastic_block(block);
    });
    if (modes) note_modes(item);
    take_name(item, blocks_, "elastic block", block.name, static_cast<std::int32_t>(elastic_.size()));
    AlignedBox box{block.corner, block.corner};
    for (std::size_t i = 0; i < 3; ++i) box.upper[i] += block.edges[i];
    elastic_.push_back({first, result_.system->node_count() - first, box});
    if (block.contact_radius > 0.0) result_.node_contact_material.push_back(block.contact_material);
    result_.elastic_blocks.push_back(block);
}

void SystemReader::note_modes(const YAML::Node& item) {
    if (result_.sleeping)
        source_.refuse(item, "a body with \"modes\" cannot sleep; leave \"sleeping\" or \"modes\" out");
}

AlignedBox SystemReader::read_box(const YAML::Node& node, std::string_view what) {
    std::optional<Vector3> lower, upper;
    read_map(source_, node, what,
             {{"lower", [&](const YAML::Node& n) { lower = vector3(source_, n, "lower"); }},
              {"upper", [&](const YAML::Node& n) { upper = vector3(source_, n, "upper"); }}});
    if (!lower || !upper) source_.refuse(node, fmt::format("{} lacks the key \"{}\"", what, lower ? "upper" : "lower"));
    return {*lower, *upper};
}

AlignedBox SystemReader::box_named(const YAML::Node& item, const Elastic& body, const SideKeys& keys,
                                   std::string_view what) {
    const std::string name = scalar(source_, keys.elastic, "elastic");
    if (keys.face.IsDefined() == keys.box.IsDefined())
        source_.refuse(item, fmt::format("the {} on \"{}\" needs one of \"face\" and \"box\"", what, name));
    if (keys.box.IsDefined()) return read_box(keys.box, "\"box\"");
    if (!body.box) source_.refuse(keys.face, fmt::format("\"{}\" is a mesh and has no faces; use \"box\"", name));
    const std::size_t number = face(source_, keys.face), axis = number / 2;
    const double low = body.box->lower[axis], high = body.box->upper[axis];
    const double place = number % 2 == 0 ? low : high, slack = 1e-6 * (high - low);
    // The other coordinates are free, so that rounding of the nodes' positions does not matter.
    constexpr double any = std::numeric_limits<double>::infinity();
    AlignedBox box{{-any, -any, -any}, {any, any, any}};
    box.lower[axis] = place - slack;
    box.upper[axis] = place + slack;
    return box;
}

const SystemReader::Elastic& SystemReader::elastic_of(const SideKeys& keys, const Copy& copy) {
    return elastic_[static_cast<std::size_t>(elastic_named(keys.elastic, "elastic", copy))];
}

std::vector<NodeShare> SystemReader::sides_named(const YAML::Node& item, const SideKeys& keys, const Copy& copy) {
    const Elastic& body = elastic_of(keys, copy);
    const AlignedBox box = box_named(item, body, keys, "load");
    return at(item, [&] { return result_.system->spread_over_sides(body.first, body.nodes, box); });
}

// attachments: {name, body, node}, or {name, body, elastic, face or box}
void SystemReader::read_attachment(const YAML::Node& item, const Copy& copy) {
    AttachmentParameters attachment;
    bool body = false;
    YAML::Node node{YAML::NodeType::Undefined};
    SideKeys sides;
    read_map(source_, item, "an attachment",
             {{"name", [&](const YAML::Node& n) { attachment.name = name_in(source_, n, "name", copy); }},
              {"body",
               [&](const YAML::Node& n) {
                   attachment.body = body_named(n, "body", copy);
                   body = true;
               }},
              {"node", [&](const YAML::Node& n) { node.reset(n); }},
              {"elastic", [&](const YAML::Node& n) { sides.elastic.reset(n); }},
              {"face", [&](const YAML::Node& n) { sides.face.reset(n); }},
              {"box", [&](const YAML::Node& n) { sides.box.reset(n); }},
              {"repeat", [](const YAML::Node&) {}}});
    const std::string who = fmt::format("attachment \"{}\"", attachment.name);
    if (!body) source_.refuse(item, who + " lacks the key \"body\"");
    if (node.IsDefined() == sides.elastic.IsDefined())
        source_.refuse(item, who + " needs one of \"node\" and \"elastic\"");
    if (!sides.elastic.IsDefined() && (sides.face.IsDefined() || sides.box.IsDefined()))
        source_.refuse(item, fmt::format("\"face\" and \"box\" of {} need \"elastic\"", who));
    take_name(item, others_, "attachment", attachment.name, 0);
    if (node.IsDefined()) {
        attachment.nodes = {node_named(node, "node", copy)};
    } else {
        const Elastic& elastic = elastic_of(sides, copy);
        const AlignedBox box = box_named(item, elastic, sides, "attachment");
        attachment.nodes = result_.system->nodes_in(elastic.first, elastic.nodes, box);
        if (attachment.nodes.empty()) source_.refuse(item, who + " holds no node: none lies in its box");
    }
    at(item, [&] { result_.system->add_attachment(attachment); });
    result_.attachments.push_back(std::move(attachment));
}

// initial_velocities: {elastic, face or box, velocity}
void SystemReader::read_initial_velocity(const YAML::Node& item, const Copy& copy) {
    SideKeys sides;
    std::optional<Vector3> velocity;
    read_map(source_, item, "an initial velocity",
             {{"elastic", [&](const YAML::Node& n) { sides.elastic.reset(n); }},
              {"face", [&](const YAML::Node& n) { sides.face.reset(n); }},
              {"box", [&](const YAML::Node& n) { sides.box.reset(n); }},
              {"velocity", [&](const YAML::Node& n) { velocity = vector3(source_, n, "velocity"); }},
              {"repeat", [](const YAML::Node&) {}}});
    if (!sides.elastic.IsDefined() || !velocity)
        source_.refuse(item,
                       fmt::format("an initial velocity lacks the key \"{}\"", velocity ? "elastic" : "velocity"));
    const Elastic& elastic = elastic_of(sides, copy);
    const AlignedBox box = box_named(item, elastic, sides, "initial velocity");
    const auto nodes = result_.system->nodes_in(elastic.first, elastic.nodes, box);
    if (nodes.empty()) source_.refuse(item, "an initial velocity holds no node: none lies in its box");
    at(item, [&] { result_.system->set_initial_velocity(nodes, *velocity); });
}

void SystemReader::read_elastic_mesh(const YAML::Node& item, const Copy& copy) {
    ElasticMeshParameters body;
    body.pose.position = copy.offset;
    std::string file;
    double scale = 1.0;
    int refinements = 0;
    std::optional<std::int32_t> modes;
    auto handlers = elastic_handlers(body, modes);
    handlers.insert(
        handlers.end(),
        {{"name", [&](const YAML::Node& n) { body.name = name_in(source_, n, "name", copy); }},
         {"file", [&](const YAML::Node& n) { file = scalar(source_, n, "file"); }},
         {"scale", [&](const YAML::Node& n) { scale = positive_number(source_, n, "scale"); }},
         {"refinements",
          [&](const YAML::Node& n) { refinements = value<int>(source_, n, "refinements", "a whole number"); }},
         {"position", [&](const YAML::Node& n) { body.pose.position = point_in(source_, n, "position", copy); }},
         {"orientation", [&](const YAML::Node& n) { body.pose.orientation = orientation(source_, n); }},
         {"fixed_boxes", [&](const YAML::Node& n) {
              for (const YAML::Node& one : elements(source_, n, "fixed_boxes"))
                  body.fixed_boxes.push_back(read_box(one, "a box of \"fixed_boxes\""));
          }}});
    read_map(source_, item, "an elastic mesh", handlers);
    if (file.empty()) source_.refuse(item, fmt::format("elastic mesh \"{}\" lacks the key \"file\"", body.name));
    result_.tetrahedra_read = true;
    if (!file.ends_with(".vol")) result_.surfaces_read = true;
    const auto first = at(item, [&] {
        body.mesh = read_tetrahedral_mesh(source_.folder() / file, scale, refinements);
        return modes ? result_.system->add_reduced_body({body, *modes}) : result_.system->add_elastic_mesh(body);
    });
    if (modes) note_modes(item);
    take_name(item, blocks_, "elastic mesh", body.name, static_cast<std::int32_t>(elastic_.size()));
    elastic_.push_back({first, result_.system->node_count() - first, {}});
    if (body.contact_radius > 0.0) result_.node_contact_material.push_back(body.contact_material);
}

void SystemReader::read_cable(const YAML::Node& item, const Copy& copy) {
    CableParameters cable;
    bool nodes = false;
    read_map(
        source_, item, "a cable",
        {{"name", [&](const YAML::Node& n) { cable.name = name_in(source_, n, "name", copy); }},
         {"nodes",
          [&](const YAML::Node& n) {
              const auto ends = elements(source_, n, "nodes");
              if (ends.size() != 2) source_.refuse(n, "\"nodes\" must be the names of two nodes");
              cable.nodes = {node_named(ends[0], "nodes", copy), node_named(ends[1], "nodes", copy)};
              nodes = true;
          }},
         {"young", [&](const YAML::Node& n) { cable.young = positive_number(source_, n, "young"); }},
         {"area", [&](const YAML::Node& n) { cable.area = positive_number(source_, n, "area"); }},
         {"density", [&](const YAML::Node& n) { cable.density = nonnegative_number(source_, n, "density"); }},
         {"damping_time",
          [&](const YAML::Node& n) { cable.damping_time = nonnegative_number(source_, n, "damping_time"); }},
         {"rest_length", [&](const YAML::Node& n) { cable.rest_length = positive_number(source_, n, "rest_length"); }},
         {"slack", [&](const YAML::Node& n) { cable.slack = truth(source_, n, "slack"); }},
         {"repeat", [](const YAML::Node&) {}}});
    if (!nodes) source_.refuse(item, fmt::format("cable \"{}\" lacks the key \"nodes\"", cable.name));
    at(item, [&] { result_.system->add_cable(cable); });
    take_name(item, others_, "cable", cable.name, 0);
}

}  // namespace delassus::scene
