// SPDX-License-Identifier: BSD-3-Clause
// What acts between the bodies of a scene: joints, motors, springs, bushings, loads, pairs kept apart.
#include <algorithm>
#include <array>

#include "scene/joint_kinds.hpp"
#include "scene/system_reader.hpp"

namespace delassus::scene {
namespace {

JointKind joint_kind(const Source& source, const YAML::Node& node) {
    const std::string name = scalar(source, node, "kind");
    std::vector<std::string_view> names;
    for (const auto& [known, kind] : joint_kinds) {
        if (known == name) return kind;
        names.push_back(known);
    }
    source.refuse(node, fmt::format("there is no kind of joint \"{}\"{}", name, nearest_name_hint(name, names)));
}

}  // namespace

SystemReader::Handlers SystemReader::coordinate_handlers(JointCoordinate& forces) {
    return {{"damping", [&](const YAML::Node& n) { forces.damping = nonnegative_number(source_, n, "damping"); }},
            {"spring",
             [&](const YAML::Node& n) {
                 bool stiffness = false;
                 read_map(source_, n, "\"spring\"",
                          {{"stiffness",
                            [&](const YAML::Node& v) {
                                forces.stiffness = positive_number(source_, v, "stiffness");
                                stiffness = true;
                            }},
                           {"rest", [&](const YAML::Node& v) { forces.rest = finite_number(source_, v, "rest"); }}});
                 if (!stiffness) source_.refuse(n, "\"spring\" lacks the key \"stiffness\"");
             }},
            {"friction", [&](const YAML::Node& n) { forces.friction = nonnegative_number(source_, n, "friction"); }},
            {"armature", [&](const YAML::Node& n) { forces.armature = nonnegative_number(source_, n, "armature"); }},
            {"start", [&](const YAML::Node& n) { forces.start = finite_number(source_, n, "start"); }},
            {"start_rate", [&](const YAML::Node& n) { forces.start_rate = finite_number(source_, n, "start_rate"); }}};
}

// A joint with one coordinate has damping, spring, friction and start of its own; a cylindrical one has them in two
// maps.
void SystemReader::read_joint(const YAML::Node& item, const Copy& copy) {
    JointParameters joint;
    joint.point = joint.second_point = copy.offset;
    bool kind = false, second = false, gear_first = false, gear_second = false;
    JointCoordinate own;
    YAML::Node own_place(YAML::NodeType::Undefined), parts(YAML::NodeType::Undefined);
    const auto part = [&](JointCoordinate& forces, std::string_view key) {
        return std::pair<std::string_view, Handler>{key, [&, key](const YAML::Node& n) {
                                                        read_map(source_, n, fmt::format("\"{}\"", key),
                                                                 coordinate_handlers(forces));
                                                        parts.reset(n);
                                                    }};
    };
    Handlers handlers = coordinate_handlers(own);
    for (auto& [key, handler] : handlers)
        handler = [&own_place, read = std::move(handler)](const YAML::Node& n) {
            read(n);
            own_place.reset(n);
        };
    const Handlers others = {
        {"name", [&](const YAML::Node& n) { joint.name = name_in(source_, n, "name", copy); }},
        {"kind",
         [&](const YAML::Node& n) {
             joint.kind = joint_kind(source_, n);
             kind = true;
         }},
        {"first", [&](const YAML::Node& n) { joint.first = body_named(n, "first", copy); }},
        {"second",
         [&](const YAML::Node& n) {
             joint.second = body_named(n, "second", copy);
             second = true;
         }},
        {"point", [&](const YAML::Node& n) { joint.point = point_in(source_, n, "point", copy); }},
        {"second_point", [&](const YAML::Node& n) { joint.second_point = point_in(source_, n, "second_point", copy); }},
        {"axis", [&](const YAML::Node& n) { joint.axis = vector3(source_, n, "axis"); }},
        {"second_axis", [&](const YAML::Node& n) { joint.second_axis = vector3(source_, n, "second_axis"); }},
        {"gear_first",
         [&](const YAML::Node& n) {
             joint.gear_first = joint_named(n, "gear_first", copy);
             gear_first = true;
         }},
        {"gear_second",
         [&](const YAML::Node& n) {
             joint.gear_second = joint_named(n, "gear_second", copy);
             gear_second = true;
         }},
        {"gear_ratio", [&](const YAML::Node& n) { joint.gear_ratio = finite_number(source_, n, "gear_ratio"); }},
        {"lower", [&](const YAML::Node& n) { joint.lower = finite_number(source_, n, "lower"); }},
        {"upper", [&](const YAML::Node& n) { joint.upper = finite_number(source_, n, "upper"); }},
        part(joint.slide, "slide"),
        part(joint.turn, "turn"),
        {"repeat", [](const YAML::Node&) {}}};
    handlers.insert(handlers.end(), others.begin(), others.end());
    read_map(source_, item, "a joint", handlers);
    const auto need = [&](bool given, std::string_view key) {
        if (!given) source_.refuse(item, fmt::format("joint \"{}\" lacks the key \"{}\"", joint.name, key));
    };
    need(kind, "kind");
    if (joint.kind == JointKind::Cylindrical) {
        if (own_place.IsDefined())
            source_.refuse(own_place,
                           fmt::format("the cylindrical joint \"{}\" has two coordinates: give damping, spring, "
                                       "friction, armature and start in \"slide: {{…}}\" and \"turn: {{…}}\"",
                                       joint.name));
    } else {
        if (parts.IsDefined())
            source_.refuse(parts,
                           fmt::format("\"slide\" and \"turn\" are for cylindrical joints; the joint \"{}\" takes "
                                       "\"damping\", \"spring\", \"friction\", \"armature\" and \"start\" themselves",
                                       joint.name));
        (joint.kind == JointKind::Prismatic ? joint.slide : joint.turn) = own;
    }
    if (joint.kind == JointKind::Gear) {
        need(gear_first, "gear_first");
        need(gear_second, "gear_second");
        if (joint.gear_first < 0 || joint.gear_second < 0)
            source_.refuse(
                item, fmt::format("joint \"{}\" couples a joint between fixed bodies, which cannot turn", joint.name));
    } else {
        need(second, "second");
        if (joint.first == joint.second)
            source_.refuse(
                item,
                fmt::format("joint \"{}\" joins a body to itself: \"first\" and \"second\" must differ", joint.name));
        if (!moves(joint.first) && !moves(joint.second)) {
            take_name(item, joints_, "joint", joint.name, -1);
            result_.left_out.push_back({fmt::format("joint \"{}\"", joint.name), no_effect(joint.first, joint.second)});
            return;
        }
    }
    const auto number = at(item, [&] { return result_.system->add_joint(joint); });
    take_name(item, joints_, "joint", joint.name, number);
    result_.joints.push_back(joint);
    if (joint.kind != JointKind::Gear)
        result_.apart.push_back({std::min(joint.first, joint.second), std::max(joint.first, joint.second)});
}

void SystemReader::read_motor(const YAML::Node& item, const Copy& copy) {
    MotorParameters motor;
    YAML::Node motion_place{YAML::NodeType::Undefined};
    bool has_joint = false;
    read_map(source_, item, "a motor",
             {{"name", [&](const YAML::Node& n) { motor.name = name_in(source_, n, "name", copy); }},
              {"joint",
               [&](const YAML::Node& n) {
                   has_joint = true;
                   motor.joint = joint_named(n, "joint", copy);
                   if (motor.joint < 0)
                       source_.refuse(n, "\"joint\" names a joint between fixed bodies, which no motor can move");
               }},
              {"speed", [&](const YAML::Node& n) { motor.speed = truth(source_, n, "speed"); }},
              {"motion", [&](const YAML::Node& n) { motion_place.reset(n); }},
              {"force_limit",
               [&](const YAML::Node& n) { motor.force_limit = nonnegative_number(source_, n, "force_limit"); }},
              {"repeat", [](const YAML::Node&) {}}});
    if (!has_joint) source_.refuse(item, "a motor lacks the key \"joint\"");
    if (!motion_place.IsDefined()) source_.refuse(item, "a motor lacks the key \"motion\"");
    motor.motion = motion(source_, motion_place, "motion", motor.speed ? &result_.inputs : nullptr);
    take_name(item, others_, "motor", motor.name, 0);
    at(item, [&] { result_.system->add_motor(motor); });
    result_.motors.push_back(motor);
}

void SystemReader::read_actuator(const YAML::Node& item, const Copy& copy) {
    ActuatorParameters actuator;
    bool has_joint = false;
    read_map(source_, item, "an actuator",
             {{"name", [&](const YAML::Node& n) { actuator.name = name_in(source_, n, "name", copy); }},
              {"joint",
               [&](const YAML::Node& n) {
                   has_joint = true;
                   actuator.joint = joint_named(n, "joint", copy);
                   if (actuator.joint < 0)
                       source_.refuse(n, "\"joint\" names a joint between fixed bodies, which no actuator can move");
               }},
              {"position",
               [&](const YAML::Node& n) { actuator.position = motion(source_, n, "position", &result_.inputs); }},
              {"speed", [&](const YAML::Node& n) { actuator.speed = motion(source_, n, "speed", &result_.inputs); }},
              {"kp", [&](const YAML::Node& n) { actuator.kp = nonnegative_number(source_, n, "kp"); }},
              {"kd", [&](const YAML::Node& n) { actuator.kd = nonnegative_number(source_, n, "kd"); }},
              {"limit", [&](const YAML::Node& n) { actuator.force_limit = nonnegative_number(source_, n, "limit"); }},
              {"repeat", [](const YAML::Node&) {}}});
    if (!has_joint) source_.refuse(item, "an actuator lacks the key \"joint\"");
    take_name(item, others_, "actuator", actuator.name, 0);
    at(item, [&] { result_.system->add_actuator(actuator); });
    result_.actuators.push_back(actuator);
}

void SystemReader::read_spring(const YAML::Node& item, const Copy& copy) {
    SpringParameters spring;
    bool second = false, first_point = false, second_point = false;
    read_map(
        source_, item, "a spring",
        {{"name", [&](const YAML::Node& n) { spring.name = name_in(source_, n, "name", copy); }},
         {"first", [&](const YAML::Node& n) { spring.first = body_named(n, "first", copy); }},
         {"second",
          [&](const YAML::Node& n) {
              spring.second = body_named(n, "second", copy);
              second = true;
          }},
         {"first_point",
          [&](const YAML::Node& n) {
              spring.first_point = point_in(source_, n, "first_point", copy);
              first_point = true;
          }},
         {"second_point",
          [&](const YAML::Node& n) {
              spring.second_point = point_in(source_, n, "second_point", copy);
              second_point = true;
          }},
         {"stiffness", [&](const YAML::Node& n) { spring.stiffness = nonnegative_number(source_, n, "stiffness"); }},
         {"damping", [&](const YAML::Node& n) { spring.damping = nonnegative_number(source_, n, "damping"); }},
         {"rest_length",
          [&](const YAML::Node& n) { spring.rest_length = nonnegative_number(source_, n, "rest_length"); }},
         {"repeat", [](const YAML::Node&) {}}});
    if (!second) source_.refuse(item, fmt::format("spring \"{}\" lacks the key \"second\"", spring.name));
    if (!first_point) spring.first_point = position(spring.first);
    if (!second_point) spring.second_point = position(spring.second);
    take_name(item, others_, "spring", spring.name, 0);
    if (!moves(spring.first) && !moves(spring.second)) {
        result_.left_out.push_back({fmt::format("spring \"{}\"", spring.name), no_effect(spring.first, spring.second)});
        return;
    }
    at(item, [&] { result_.system->add_spring(spring); });
    result_.springs.push_back(spring);
}

void SystemReader::read_bushing(const YAML::Node& item, const Copy& copy) {
    BushingParameters bushing;
    bushing.point = copy.offset;
    bool second = false;
    const auto coefficients = [&](Vector3& into, std::string_view key) {
        return std::pair<std::string_view, Handler>{key, [&, key](const YAML::Node& n) {
                                                        into = vector3(source_, n, key);
                                                        for (const double entry : into)
                                                            if (entry < 0.0)
                                                                source_.refuse(
                                                                    n, fmt::format("\"{}\" must hold no negative "
                                                                                   "number",
                                                                                   key));
                                                    }};
    };
    read_map(source_, item, "a bushing",
             {{"name", [&](const YAML::Node& n) { bushing.name = name_in(source_, n, "name", copy); }},
              {"first", [&](const YAML::Node& n) { bushing.first = body_named(n, "first", copy); }},
              {"second",
               [&](const YAML::Node& n) {
                   bushing.second = body_named(n, "second", copy);
                   second = true;
               }},
              {"point", [&](const YAML::Node& n) { bushing.point = point_in(source_, n, "point", copy); }},
              coefficients(bushing.stiffness, "stiffness"),
              coefficients(bushing.damping, "damping"),
              coefficients(bushing.turn_stiffness, "turn_stiffness"),
              coefficients(bushing.turn_damping, "turn_damping"),
              {"repeat", [](const YAML::Node&) {}}});
    if (!second) source_.refuse(item, fmt::format("bushing \"{}\" lacks the key \"second\"", bushing.name));
    take_name(item, others_, "bushing", bushing.name, 0);
    if (!moves(bushing.first) && !moves(bushing.second)) {
        result_.left_out.push_back(
            {fmt::format("bushing \"{}\"", bushing.name), no_effect(bushing.first, bushing.second)});
        return;
    }
    at(item, [&] { result_.system->add_bushing(bushing); });
    result_.bushings.push_back(bushing);
}

std::array<Motion, 3> SystemReader::three_motions(const YAML::Node& node, std::string_view key, Inputs* inputs) {
    const auto list = elements(source_, node, key);
    if (list.size() != 3) source_.refuse(node, fmt::format("\"{}\" must be a list of 3 numbers or motions", key));
    return {motion(source_, list[0], key, inputs), motion(source_, list[1], key, inputs),
            motion(source_, list[2], key, inputs)};
}

void SystemReader::read_load(const YAML::Node& item, const Copy& copy) {
    LoadParameters load;
    bool body = false, point = false;
    YAML::Node node{YAML::NodeType::Undefined};
    SideKeys sides;
    std::string of_bodies;  // the first key that only a load on a body has
    const auto note = [&](const char* key) {
        if (of_bodies.empty()) of_bodies = key;
    };
    read_map(source_, item, "a load",
             {{"name", [&](const YAML::Node& n) { load.name = name_in(source_, n, "name", copy); }},
              {"body",
               [&](const YAML::Node& n) {
                   load.body = body_named(n, "body", copy);
                   body = true;
               }},
              {"force", [&](const YAML::Node& n) { load.force = three_motions(n, "force", &result_.inputs); }},
              {"node", [&](const YAML::Node& n) { node.reset(n); }},
              {"elastic", [&](const YAML::Node& n) { sides.elastic.reset(n); }},
              {"face", [&](const YAML::Node& n) { sides.face.reset(n); }},
              {"box", [&](const YAML::Node& n) { sides.box.reset(n); }},
              {"torque",
               [&](const YAML::Node& n) {
                   load.torque = three_motions(n, "torque", &result_.inputs);
                   note("torque");
               }},
              {"point",
               [&](const YAML::Node& n) {
                   load.point = point_in(source_, n, "point", copy);
                   point = true;
                   note("point");
               }},
              {"follower",
               [&](const YAML::Node& n) {
                   load.follower = truth(source_, n, "follower");
                   note("follower");
               }},
              {"repeat", [](const YAML::Node&) {}}});
    if (int{body} + int{node.IsDefined()} + int{sides.elastic.IsDefined()} != 1)
        source_.refuse(item, fmt::format("load \"{}\" needs one of \"body\", \"node\" and \"elastic\"", load.name));
    if (!sides.elastic.IsDefined() && (sides.face.IsDefined() || sides.box.IsDefined()))
        source_.refuse(item, fmt::format("\"face\" and \"box\" of load \"{}\" need \"elastic\"", load.name));
    if (!body) {
        if (!of_bodies.empty())
            source_.refuse(item, fmt::format("load \"{}\" acts on nodes, which take no \"{}\"", load.name, of_bodies));
        load.nodes = node.IsDefined() ? std::vector<NodeShare>{{node_named(node, "node", copy), 1.0}}
                                      : sides_named(item, sides, copy);
        take_name(item, others_, "load", load.name, 0);
        at(item, [&] { result_.system->add_load(load); });
        result_.loads.push_back(load);
        return;
    }
    if (!point) load.point = position(load.body);
    take_name(item, others_, "load", load.name, 0);
    if (!moves(load.body)) {
        const bool fixed = load.body == world_body || result_.bodies[static_cast<std::size_t>(load.body)].fixed;
        result_.left_out.push_back(
            {fmt::format("load \"{}\"", load.name), fixed ? "its body is fixed" : "the motion of its body is given"});
        return;
    }
    at(item, [&] { result_.system->add_load(load); });
    result_.loads.push_back(load);
}

void SystemReader::read_keep_apart(const YAML::Node& node) {
    for (const YAML::Node& pair : elements(source_, node, "keep_apart")) {
        const auto names = elements(source_, pair, "keep_apart");
        if (names.size() != 2) source_.refuse(pair, "an item of \"keep_apart\" must be a list of two bodies");
        const auto first = body_named(names[0], "keep_apart", {}), second = body_named(names[1], "keep_apart", {});
        at(pair, [&] { result_.system->keep_apart(first, second); });
        result_.apart.push_back({std::min(first, second), std::max(first, second)});
    }
}

}  // namespace delassus::scene
