// SPDX-License-Identifier: BSD-3-Clause
// Elastic parts of a scene: blocks of tetrahedra, cables between nodes.
#include <array>
#include <limits>

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

}  // namespace

void SystemReader::read_elastic_block(const YAML::Node& item, const Copy& copy) {
    ElasticBlockParameters block;
    block.corner = copy.offset;
    bool edges = false, cells = false;
    const auto number = [&](double& value, std::string_view key, auto&& read) {
        return std::pair<std::string_view, Handler>{
            key, [this, &value, key, read](const YAML::Node& n) { value = read(source_, n, key); }};
    };
    const auto read_contact = [&](const YAML::Node& node) {
        bool radius = false, material = false;
        read_map(source_, node, "\"contact\"",
                 {{"radius",
                   [&](const YAML::Node& n) {
                       block.contact_radius = positive_number(source_, n, "radius");
                       radius = true;
                   }},
                  {"material", [&](const YAML::Node& n) {
                       block.contact_material = material_named(n, "material");
                       material = true;
                   }}});
        if (!radius || !material)
            source_.refuse(node, fmt::format("\"contact\" lacks the key \"{}\"", radius ? "material" : "radius"));
    };
    read_map(source_, item, "an elastic block",
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
              number(block.material.young, "young", positive_number),
              number(block.material.poisson, "poisson", finite_number),
              number(block.material.density, "density", positive_number),
              number(block.material.damping_time, "damping_time", nonnegative_number),
              {"model", [&](const YAML::Node& n) { block.model = element_model(source_, n); }},
              {"fixed_faces",
               [&](const YAML::Node& n) {
                   for (const YAML::Node& one : elements(source_, n, "fixed_faces"))
                       block.fixed_faces[face(source_, one)] = true;
               }},
              {"velocity", [&](const YAML::Node& n) { block.velocity = vector3(source_, n, "velocity"); }},
              {"contact", read_contact},
              {"repeat", [](const YAML::Node&) {}}});
    if (!edges || !cells)
        source_.refuse(item,
                       fmt::format("elastic block \"{}\" lacks the key \"{}\"", block.name, edges ? "cells" : "edges"));
    const auto first = at(item, [&] { return result_.system->add_elastic_block(block); });
    take_name(item, blocks_, "elastic block", block.name, first);
    result_.elastic_blocks.push_back(block);
}

void SystemReader::read_cable(const YAML::Node& item, const Copy& copy) {
    CableParameters cable;
    bool nodes = false;
    const auto node_named = [&](const YAML::Node& node) {
        const std::string name = name_in(source_, node, "nodes", copy);
        const auto found = nodes_.find(name);
        if (found == nodes_.end())
            source_.refuse(node, fmt::format("\"nodes\" names \"{}\", but there is no such node", name));
        return found->second;
    };
    read_map(
        source_, item, "a cable",
        {{"name", [&](const YAML::Node& n) { cable.name = name_in(source_, n, "name", copy); }},
         {"nodes",
          [&](const YAML::Node& n) {
              const auto ends = elements(source_, n, "nodes");
              if (ends.size() != 2) source_.refuse(n, "\"nodes\" must be the names of two nodes");
              cable.nodes = {node_named(ends[0]), node_named(ends[1])};
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
