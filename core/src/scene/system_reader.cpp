// SPDX-License-Identifier: BSD-3-Clause
#include "scene/system_reader.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "config/sections.hpp"
#include "scene/choose_method.hpp"
#include "solver/name_with_options.hpp"

namespace delassus::scene {

SystemReader::SystemReader(const Source& source, SceneSystem& result) : source_(source), result_(result) {
    result_.system = std::make_unique<MultibodySystem>();
    result_.integrator = chosen;
    result_.coordinates_chosen = true;
}

std::vector<std::pair<std::string_view, Handler>> SystemReader::handlers() {
    std::vector<std::pair<std::string_view, Handler>> all = {
        {"gravity", [this](const YAML::Node& n) { gravity_ = vector3(source_, n, "gravity"); }},
        {"step", [this](const YAML::Node& n) { read_step(n); }},
        {"tolerance", [this](const YAML::Node& n) { read_tolerance(n); }},
        {"accuracy",
         [this](const YAML::Node& n) {
             result_.accuracy = positive_number(source_, n, "accuracy");
             result_.division = StepDivision::ToAccuracy;
         }},
        {"end", [this](const YAML::Node& n) { end_ = nonnegative_number(source_, n, "end"); }},
        {"sleeping", [this](const YAML::Node& n) { read_sleeping(n); }},
        {"start", [this](const YAML::Node& n) { read_start(n); }},
        {"coordinates", [this](const YAML::Node& n) { read_coordinates(n); }},
        {"integrator", [this](const YAML::Node& n) { read_integrator(n); }},
        {"solver", [this](const YAML::Node& n) { result_.solver = read_solver(source_, n); }},
        {"leave_out",
         [this](const YAML::Node& n) { result_.leave_out = value<bool>(source_, n, "leave_out", "true or false"); }},
        {"limits", [this](const YAML::Node& n) { read_limits(n); }},
        {"envelope", [this](const YAML::Node& n) { envelope_ = positive_number(source_, n, "envelope"); }}};
    for (const char* list : {"materials", "material_pairs", "bodies", "nodes", "elastic_blocks", "elastic_meshes",
                             "cables", "beams", "joints", "motors", "actuators", "springs", "bushings", "loads",
                             "attachments", "initial_velocities", "keep_apart"})
        all.emplace_back(list, [this, list](const YAML::Node& n) { lists_.insert_or_assign(list, n); });
    return all;
}

void SystemReader::build(const YAML::Node& place) {
    const auto missing = [&](std::string_view key, std::string_view example) {
        source_.refuse(place, fmt::format("system \"{}\" lacks the key \"{}\", e.g. {}", result_.name, key, example));
    };
    if (!step_node_.IsDefined() && !tolerance_) missing("step", "step: 0.001");
    if (!end_) missing("end", "end: 10");
    constexpr double most_steps = 1e12;  // beyond, the time of the last ones has no digits for them
    if (step_ && *end_ > most_steps * *step_)
        source_.refuse(step_node_,
                       fmt::format("\"step\" is {:g} s, of which a run until {:g} s would take {:.1g}; {:g} are "
                                   "the most",
                                   *step_, *end_, *end_ / *step_, most_steps));
    build_step(place);
    result_.end = *end_;
    if (gravity_) result_.system->set_gravity(*gravity_);
    if (envelope_) result_.system->set_envelope(*envelope_);
    if (const auto found = lists_.find("materials"); found != lists_.end()) read_materials(found->second);
    read_items("material_pairs", &SystemReader::read_material_pair);
    read_items("bodies", &SystemReader::read_body);
    read_items("nodes", &SystemReader::read_node);
    read_items("elastic_blocks", &SystemReader::read_elastic_block);
    read_items("elastic_meshes", &SystemReader::read_elastic_mesh);
    read_items("cables", &SystemReader::read_cable);
    read_items("beams", &SystemReader::read_beam);
    // An empty list is allowed: a scene may have nothing in it. A scene without any such list is a mistake.
    const std::array<std::string_view, 5> moving = {"bodies", "nodes", "elastic_blocks", "elastic_meshes", "beams"};
    if (std::none_of(moving.begin(), moving.end(), [&](std::string_view key) { return lists_.contains(key); }))
        missing("bodies", "bodies: [{name: ball, mass: 1, …}]");
    // A gear names joints, which may stand after it.
    const auto is_gear = [](const YAML::Node& item) {
        return item["kind"].IsDefined() && item["kind"].IsScalar() && item["kind"].Scalar() == "gear";
    };
    read_items("joints", &SystemReader::read_joint, [&](const YAML::Node& item) { return !is_gear(item); });
    read_items("joints", &SystemReader::read_joint, is_gear);
    read_items("motors", &SystemReader::read_motor);
    read_items("actuators", &SystemReader::read_actuator);
    read_items("springs", &SystemReader::read_spring);
    read_items("bushings", &SystemReader::read_bushing);
    read_items("loads", &SystemReader::read_load);
    read_items("initial_velocities", &SystemReader::read_initial_velocity);
    read_items("attachments", &SystemReader::read_attachment);
    if (const auto found = lists_.find("keep_apart"); found != lists_.end()) read_keep_apart(found->second);
    if (!result_.leave_out) result_.system->leave_nothing_out();
    at(place, [&] { result_.system->finish(); });
}

void SystemReader::read_items(std::string_view key, ItemReader reader,
                              const std::function<bool(const YAML::Node&)>& takes) {
    const auto found = lists_.find(key);
    if (found == lists_.end() || found->second.IsNull()) return;
    for (const YAML::Node& item : elements(source_, found->second, key)) {
        if (!item.IsMap()) source_.refuse(item, fmt::format("an item of \"{}\" must be a map of keys to values", key));
        if (takes && !takes(item)) continue;
        const YAML::Node repeated = item["repeat"];
        if (!repeated.IsDefined()) {
            (this->*reader)(item, {});
            continue;
        }
        for (const Copy& copy : repeat(source_, repeated)) (this->*reader)(item, copy);
    }
}

// step: 0.001, or with a tolerance step: {initial, smallest, largest}
void SystemReader::read_step(const YAML::Node& node) {
    step_node_ = node;
    if (!node.IsMap()) {
        step_ = positive_number(source_, node, "step");
        return;
    }
    read_map(source_, node, "\"step\"",
             {{"initial", [&](const YAML::Node& n) { initial_ = positive_number(source_, n, "initial"); }},
              {"smallest", [&](const YAML::Node& n) { control_.smallest = positive_number(source_, n, "smallest"); }},
              {"largest", [&](const YAML::Node& n) { control_.largest = positive_number(source_, n, "largest"); }}});
}

// tolerance: 1e-4, or tolerance: {absolute, relative}
void SystemReader::read_tolerance(const YAML::Node& node) {
    tolerance_ = true;
    if (!node.IsMap()) {
        control_.absolute = control_.relative = positive_number(source_, node, "tolerance");
        return;
    }
    bool absolute = false;
    control_.relative = 0.0;
    read_map(
        source_, node, "\"tolerance\"",
        {{"absolute",
          [&](const YAML::Node& n) {
              control_.absolute = positive_number(source_, n, "absolute");
              absolute = true;
          }},
         {"relative", [&](const YAML::Node& n) { control_.relative = nonnegative_number(source_, n, "relative"); }}});
    if (!absolute) source_.refuse(node, "\"tolerance\" lacks the key \"absolute\"");
}

// sleeping: true, or sleeping: {speed, time}
void SystemReader::read_sleeping(const YAML::Node& node) {
    if (node.IsScalar()) {
        if (truth(source_, node, "sleeping")) result_.sleeping.emplace();
        return;
    }
    SleepingRule& rule = result_.sleeping.emplace();
    read_map(source_, node, "\"sleeping\"",
             {{"speed", [&](const YAML::Node& n) { rule.speed = positive_number(source_, n, "speed"); }},
              {"time", [&](const YAML::Node& n) { rule.time = positive_number(source_, n, "time"); }}});
}

// start: equilibrium, or start: {equilibrium: {load_steps, tolerance, method}}
void SystemReader::read_start(const YAML::Node& node) {
    if (node.IsScalar()) {
        if (node.Scalar() != "equilibrium")
            source_.refuse(node, fmt::format("\"start\" is \"{}\"; it must be equilibrium, or left out for a start as "
                                             "given",
                                             node.Scalar()));
        result_.equilibrium.emplace();
        return;
    }
    read_map(source_, node, "\"start\"",
             {{"equilibrium", [&](const YAML::Node& inner) {
                   EquilibriumRule& rule = result_.equilibrium.emplace();
                   read_map(source_, inner, "\"equilibrium\"",
                            {{"load_steps",
                              [&](const YAML::Node& n) {
                                  rule.load_steps = value<std::int32_t>(source_, n, "load_steps", "a whole number");
                                  if (rule.load_steps < 1 || rule.load_steps > 100000)
                                      source_.refuse(n, fmt::format("\"load_steps\" is {}; it must be from 1 to 100000",
                                                                    rule.load_steps));
                              }},
                             {"tolerance",
                              [&](const YAML::Node& n) { rule.tolerance = positive_number(source_, n, "tolerance"); }},
                             {"method", [&](const YAML::Node& n) {
                                  const std::string name = scalar(source_, n, "method");
                                  if (name != "load_steps" && name != "arc_length")
                                      source_.refuse(n, fmt::format("there is no method \"{}\" for an equilibrium; it "
                                                                    "must be load_steps or arc_length",
                                                                    name));
                                  rule.method = name == "arc_length" ? EquilibriumMethod::ArcLength
                                                                     : EquilibriumMethod::LoadSteps;
                              }}});
               }}});
    if (!result_.equilibrium) source_.refuse(node, "\"start\" lacks the key \"equilibrium\"");
}

// limits: {energy_growth: 1, drift: null}
void SystemReader::read_limits(const YAML::Node& node) {
    const auto limit = [&](double& target, std::string_view key) -> Handler {
        return [this, &target, key](const YAML::Node& n) {
            target = n.IsNull() ? std::numeric_limits<double>::infinity() : positive_number(source_, n, key);
        };
    };
    read_map(source_, node, "\"limits\"",
             {{"energy_growth", limit(result_.limits.energy_growth, "energy_growth")},
              {"drift", limit(result_.limits.drift, "drift")}});
}

void SystemReader::build_step(const YAML::Node& place) {
    if (!tolerance_) {
        if (!step_) source_.refuse(step_node_, "a \"step\" with bounds needs a \"tolerance\", e.g. tolerance: 1.0e-4");
        result_.step = *step_;
        return;
    }
    if (result_.steps_by_accuracy())
        source_.refuse(place, "an \"accuracy\" and a \"tolerance\" exclude each other: steps follow from one of them");
    if (step_)
        source_.refuse(step_node_,
                       "a fixed \"step\" and a \"tolerance\" exclude each other; bounds of the step are given as "
                       "step: {initial, smallest, largest}");
    control_.initial = initial_.value_or(std::clamp(control_.initial, control_.smallest, control_.largest));
    if (!(control_.smallest <= control_.initial && control_.initial <= control_.largest))
        source_.refuse(step_node_.IsDefined() ? step_node_ : place,
                       fmt::format("\"step\" must have smallest ≤ initial ≤ largest, not {}, {} and {}",
                                   control_.smallest, control_.initial, control_.largest));
    result_.control = control_;
    result_.step = control_.initial;
}

void SystemReader::read_coordinates(const YAML::Node& node) {
    const std::string name = scalar(source_, node, "coordinates");
    if (name != chosen && name != "maximal" && name != "joint")
        source_.refuse(node, fmt::format("\"coordinates\" is \"{}\"; it must be auto, maximal or joint", name));
    result_.coordinates_chosen = name == chosen;
    result_.coordinates = name == "joint" ? Coordinates::Joint : Coordinates::Maximal;
}

void SystemReader::read_integrator(const YAML::Node& node) {
    OptionTexts of_name;
    const auto choose = [&](const YAML::Node& n, const std::string& text) {
        if (text.empty()) return;
        try {
            NameWithOptions parsed = parse_name_with_options(text, "integrator");
            result_.integrator = std::move(parsed.name);
            of_name = std::move(parsed.options);
        } catch (const InputError& error) {
            source_.refuse(n, error.what());
        }
    };
    bool named = false;
    if (node.IsScalar()) {  // integrator: rk4, integrator: newmark(beta=0.3)
        choose(node, node.Scalar());
        result_.integrator_options = std::move(of_name);
        return;
    }
    read_map(source_, node, "\"integrator\"",
             {{"name",
               [&](const YAML::Node& n) {
                   choose(n, scalar(source_, n, "name"));
                   named = true;
               }},
              {"options", [&](const YAML::Node& n) { result_.integrator_options = read_options(source_, n); }}});
    if (!named) source_.refuse(node, "\"integrator\" lacks the key \"name\"");
    result_.integrator_options.merge(of_name);  // a key of "options" counts
}

namespace {

/// The end of a sentence that says which names there are.
std::string hint(const std::string& name, const std::map<std::string, std::int32_t, std::less<>>& numbers) {
    if (numbers.empty()) return "; there are none";
    std::vector<std::string_view> names;
    for (const auto& [known, number] : numbers) names.push_back(known);
    return nearest_name_hint(name, names);
}

}  // namespace

void SystemReader::take_name(const YAML::Node& node, Numbers& numbers, std::string_view kind, const std::string& name,
                             std::int32_t number) {
    if (name.empty()) source_.refuse(node, fmt::format("a {} lacks the key \"name\"", kind));
    if (name == "world") source_.refuse(node, fmt::format("a {} cannot be named \"world\"", kind));
    if (!numbers.emplace(name, number).second)
        source_.refuse(node, fmt::format("there are two {} named \"{}\"; names must differ",
                                         kind == "body" ? std::string("bodies") : fmt::format("{}s", kind), name));
}

std::int32_t SystemReader::number_of(const YAML::Node& node, std::string_view key, std::string_view verb,
                                     const std::string& name, std::string_view kind, const Numbers& numbers) {
    const auto found = numbers.find(name);
    if (found == numbers.end())
        source_.refuse(node, fmt::format("\"{}\" {} \"{}\", but there is no such {}{}", key, verb, name, kind,
                                         hint(name, numbers)));
    return found->second;
}

std::int32_t SystemReader::material_named(const YAML::Node& node, std::string_view key) {
    return number_of(node, key, "is", scalar(source_, node, key), "material", materials_);
}

std::int32_t SystemReader::node_named(const YAML::Node& node, std::string_view key, const Copy& copy) {
    return number_of(node, key, "names", name_in(source_, node, key, copy), "node", nodes_);
}

std::int32_t SystemReader::elastic_named(const YAML::Node& node, std::string_view key, const Copy& copy) {
    return number_of(node, key, "names", name_in(source_, node, key, copy), "elastic block or mesh", blocks_);
}

BodyIndex SystemReader::body_named(const YAML::Node& node, std::string_view key, const Copy& copy) {
    const std::string name = name_in(source_, node, key, copy);
    return name == "world" ? world_body : number_of(node, key, "is", name, "body", bodies_);
}

std::int32_t SystemReader::joint_named(const YAML::Node& node, std::string_view key, const Copy& copy) {
    return number_of(node, key, "is", name_in(source_, node, key, copy), "joint", joints_);
}

bool SystemReader::moves(BodyIndex body) const {
    if (body == world_body) return false;
    const BodyParameters& parameters = result_.bodies[static_cast<std::size_t>(body)];
    return !parameters.fixed && !parameters.motion;
}

std::string SystemReader::no_effect(BodyIndex first, BodyIndex second) const {
    const auto prescribed = [&](BodyIndex body) {
        return body != world_body && result_.bodies[static_cast<std::size_t>(body)].motion.has_value();
    };
    return prescribed(first) || prescribed(second) ? "the motions of both ends are given" : "both ends are fixed";
}

Vector3 SystemReader::position(BodyIndex body) const {
    return body == world_body ? Vector3{} : result_.bodies[static_cast<std::size_t>(body)].pose.position;
}

}  // namespace delassus::scene
