// SPDX-License-Identifier: BSD-3-Clause
// Beams of a scene: made with bodies at their nodes, or between existing bodies.
#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "scene/system_reader.hpp"

namespace delassus::scene {
namespace {

BeamSection section_of(const Source& source, const YAML::Node& node) {
    std::optional<BeamSection> shape;
    constexpr std::array<std::string_view, 6> keys = {"area",    "inertia_y",    "inertia_z",
                                                      "torsion", "shear_area_y", "shear_area_z"};
    constexpr std::size_t needed = 4;
    std::array<std::optional<double>, keys.size()> values;
    std::vector<std::pair<std::string_view, Handler>> handlers = {
        {"rectangle",
         [&](const YAML::Node& n) {
             const auto edges = elements(source, n, "rectangle");
             if (edges.size() != 2) source.refuse(n, "\"rectangle\" must be [width along y, height along z]");
             shape = BeamSection::rectangle(positive_number(source, edges[0], "rectangle"),
                                            positive_number(source, edges[1], "rectangle"));
         }},
        {"circle", [&](const YAML::Node& n) { shape = BeamSection::circle(positive_number(source, n, "circle")); }}};
    for (std::size_t i = 0; i < keys.size(); ++i)
        handlers.emplace_back(keys[i],
                              [&, i](const YAML::Node& n) { values[i] = positive_number(source, n, keys[i]); });
    read_map(source, node, "\"section\"", handlers);
    const bool numbers = std::any_of(values.begin(), values.end(), [](const auto& value) { return value.has_value(); });
    if (node.size() > 1 && shape)
        source.refuse(node, "\"section\" must be a rectangle, a circle or its numbers, not several of them");
    if (shape) return *shape;
    for (std::size_t i = 0; i < needed; ++i)
        if (!values[i])
            source.refuse(node, numbers ? fmt::format("\"section\" lacks the key \"{}\"", keys[i])
                                        : "\"section\" must have one of the keys \"rectangle\", \"circle\", \"area\"");
    constexpr double stiff = std::numeric_limits<double>::infinity();
    return {*values[0], *values[1], *values[2], *values[3], values[4].value_or(stiff), values[5].value_or(stiff)};
}

}  // namespace

void SystemReader::read_beam(const YAML::Node& item, const Copy& copy) {
    ElasticBeamParameters beam;
    std::vector<BodyIndex> bodies;
    std::optional<Vector3> from, to;
    bool section = false;
    std::string_view of_made_bodies;  // a key that has no meaning between existing bodies
    const auto made = [&](std::string_view key, const Handler& read) {
        return std::pair<std::string_view, Handler>{key, [&of_made_bodies, key, read](const YAML::Node& n) {
                                                        of_made_bodies = key;
                                                        read(n);
                                                    }};
    };
    read_map(
        source_, item, "a beam",
        {{"name", [&](const YAML::Node& n) { beam.name = name_in(source_, n, "name", copy); }},
         {"bodies",
          [&](const YAML::Node& n) {
              for (const YAML::Node& one : elements(source_, n, "bodies"))
                  bodies.push_back(body_named(one, "bodies", copy));
              if (bodies.size() < 2) source_.refuse(n, "\"bodies\" must name at least two bodies");
          }},
         made("from", [&](const YAML::Node& n) { from = point_in(source_, n, "from", copy); }),
         made("to", [&](const YAML::Node& n) { to = point_in(source_, n, "to", copy); }),
         made("elements",
              [&](const YAML::Node& n) {
                  beam.elements = value<std::int32_t>(source_, n, "elements", "a whole number");
                  if (beam.elements < 1 || beam.elements > 100000)
                      source_.refuse(n, fmt::format("\"elements\" is {}; it must be from 1 to 100000", beam.elements));
              }),
         made("density", [&](const YAML::Node& n) { beam.material.density = positive_number(source_, n, "density"); }),
         made("mass",
              [&](const YAML::Node& n) {
                  const std::string name = scalar(source_, n, "mass");
                  if (name != "lumped" && name != "consistent")
                      source_.refuse(
                          n, fmt::format("there is no mass \"{}\" of beams; it must be lumped or consistent", name));
                  beam.mass = name == "consistent" ? BeamMass::Consistent : BeamMass::Lumped;
              }),
         made("velocity", [&](const YAML::Node& n) { beam.velocity = vector3(source_, n, "velocity"); }),
         made("angular_velocity",
              [&](const YAML::Node& n) { beam.angular_velocity = vector3(source_, n, "angular_velocity"); }),
         made("fixed_ends",
              [&](const YAML::Node& n) {
                  for (const YAML::Node& one : elements(source_, n, "fixed_ends")) {
                      const std::string end = scalar(source_, one, "fixed_ends");
                      if (end != "from" && end != "to")
                          source_.refuse(one, fmt::format("there is no end \"{}\"; it must be from or to", end));
                      (end == "from" ? beam.fixed_from : beam.fixed_to) = true;
                  }
              }),
         {"section",
          [&](const YAML::Node& n) {
              beam.section = section_of(source_, n);
              section = true;
          }},
         {"section_y", [&](const YAML::Node& n) { beam.section_y = vector3(source_, n, "section_y"); }},
         {"young", [&](const YAML::Node& n) { beam.material.young = positive_number(source_, n, "young"); }},
         {"poisson", [&](const YAML::Node& n) { beam.material.poisson = finite_number(source_, n, "poisson"); }},
         {"damping_time",
          [&](const YAML::Node& n) { beam.material.damping_time = nonnegative_number(source_, n, "damping_time"); }},
         {"repeat", [](const YAML::Node&) {}}});
    const auto lacks = [&](std::string_view key) {
        source_.refuse(item, fmt::format("beam \"{}\" lacks the key \"{}\"", beam.name, key));
    };
    if (!section) lacks("section");
    const auto note = [&](BodyIndex first, BodyIndex second) {
        result_.beams.push_back({first, second});
        result_.apart.push_back({std::min(first, second), std::max(first, second)});
    };
    if (!bodies.empty()) {
        if (!of_made_bodies.empty())
            source_.refuse(item, fmt::format("beam \"{}\" has the key \"{}\", which is for beams that make their "
                                             "bodies; \"bodies\" are there",
                                             beam.name, of_made_bodies));
        for (std::size_t i = 0; i + 1 < bodies.size(); ++i) {
            const BodyIndex first = bodies[i], second = bodies[i + 1];
            at(item, [&] {
                result_.system->add_beam({beam.name, first, second, position(first), position(second), beam.section_y,
                                          beam.section, beam.material});
            });
            note(first, second);
        }
    } else {
        if (!from) lacks("from");
        if (!to) lacks("to");
        beam.from = *from;
        beam.to = *to;
        const BodyIndex first = at(item, [&] { return result_.system->add_elastic_beam(beam); });
        for (BodyIndex body = first; body <= first + beam.elements; ++body) {
            const auto& made_body = result_.system->body(body);
            take_name(item, bodies_, "body", made_body.name, body);
            result_.bodies.push_back(made_body);
            if (body > first) note(body - 1, body);
        }
    }
    take_name(item, others_, "beam", beam.name, 0);
}

}  // namespace delassus::scene
