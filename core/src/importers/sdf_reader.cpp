// SPDX-License-Identifier: BSD-3-Clause
#include "importers/sdf_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "delassus/error.hpp"

namespace delassus::importers {

using model_import::Form;
using model_import::Matrix3d;
using model_import::ModelBody;
using model_import::ModelJoint;
using model_import::ModelShape;
using model_import::Quaterniond;
using model_import::Vector3d;

namespace {

Vector3d vector_of(const ignition::math::Vector3d& v) {
    return {v.X(), v.Y(), v.Z()};
}

Eigen::Isometry3d transform_of(const ignition::math::Pose3d& pose) {
    Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
    const auto& q = pose.Rot();
    result.linear() = Quaterniond(q.W(), q.X(), q.Y(), q.Z()).normalized().toRotationMatrix();
    result.translation() = vector_of(pose.Pos());
    return result;
}

Eigen::Isometry3d resolved(const sdf::SemanticPose& pose, const std::string& what,
                           const std::string& relative_to = "") {
    ignition::math::Pose3d result;
    const sdf::Errors errors = pose.Resolve(result, relative_to);
    if (!errors.empty()) throw InputError(fmt::format("the pose of {}: {}", what, errors.front().Message()));
    return transform_of(result);
}

/// The element at the end of a path, or null.
sdf::ElementPtr element_at(sdf::ElementPtr element, std::initializer_list<const char*> path) {
    for (const char* name : path) {
        if (!element || !element->HasElement(name)) return nullptr;
        element = element->GetElement(name);
    }
    return element;
}

double number_at(const sdf::ElementPtr& element, std::initializer_list<const char*> path, double otherwise) {
    const sdf::ElementPtr found = element_at(element, path);
    return found ? found->Get<double>() : otherwise;
}

}  // namespace

void SdfReader::read(const sdf::Root& root) {
    if (root.WorldCount() > 1)
        model_.lose("worlds", fmt::format("the file has {}: the first is taken", root.WorldCount()));
    if (root.WorldCount() > 0) {
        read_world(*root.WorldByIndex(0));
    } else if (const sdf::Model* given = root.Model()) {
        model_.title = given->Name();
        std::vector<std::int32_t> links;
        read_model(*given, Placed::Identity(), "", false, links);
    } else {
        throw InputError("it has neither a world nor a model");
    }
    // As Gazebo has it, two surfaces rub with the lesser friction and rebound with the lesser restitution.
    for (std::size_t a = 0; a < model_.materials.size(); ++a)
        for (std::size_t b = a; b < model_.materials.size(); ++b)
            model_.material_pairs.push_back(
                {static_cast<std::int32_t>(a), static_cast<std::int32_t>(b),
                 std::min(model_.materials[a].friction, model_.materials[b].friction),
                 std::min(model_.materials[a].restitution, model_.materials[b].restitution)});
    read_bitmasks();
    if (!efforts_.empty())
        model_.without_effect.push_back({"limits of effort and velocity, as no motor drives the joints",
                                         fmt::format("{}", fmt::join(efforts_, ", "))});
    if (!seen_.empty())
        model_.without_effect.push_back({"looks and sensors", fmt::format("{}", fmt::join(seen_, ", "))});
}

void SdfReader::read_world(const sdf::World& world) {
    model_.title = world.Name();
    model_.gravity = vector_of(world.Gravity());
    if (world.PhysicsCount() > 0) model_.step = world.PhysicsByIndex(0)->MaxStepSize();
    for (std::uint64_t k = 0; k < world.ModelCount(); ++k) {
        const sdf::Model& given = *world.ModelByIndex(k);
        std::vector<std::int32_t> links;
        read_model(given, Placed::Identity(), given.Name(), false, links);
    }
    for (std::uint64_t k = 0; k < world.ActorCount(); ++k)
        model_.lose(fmt::format("actor \"{}\"", world.ActorByIndex(k)->Name()), "it is moved by a script");
    if (world.LightCount() > 0) seen_.push_back(fmt::format("{} lights", world.LightCount()));
    const Vector3d wind = vector_of(world.WindLinearVelocity());
    if (!wind.isZero(0.0)) model_.lose("wind", "its forces on links");
    note_plugins(world.Element(), "the world", false);
}

void SdfReader::note_plugins(const sdf::ElementPtr& element, const std::string& of, bool acts) {
    if (!element || !element->HasElement("plugin")) return;
    for (sdf::ElementPtr plugin = element->GetElement("plugin"); plugin; plugin = plugin->GetNextElement("plugin")) {
        const std::string name = plugin->Get<std::string>("name");
        if (acts)
            model_.lose(fmt::format("plugin \"{}\" of {}", name, of), "what its code does");
        else
            seen_.push_back(fmt::format("plugin \"{}\" of {}", name, of));
    }
}

void SdfReader::read_model(const sdf::Model& given, const Placed& around, const std::string& name, bool fixed,
                           std::vector<std::int32_t>& links) {
    const std::string what = fmt::format("model \"{}\"", given.Name());
    const Placed place = around * resolved(given.SemanticPose(), what);
    const bool still = fixed || given.Static();
    const auto inside = [&](const std::string& own) { return name.empty() ? own : name + "::" + own; };
    std::vector<std::int32_t> own;
    for (std::uint64_t k = 0; k < given.LinkCount(); ++k) {
        const sdf::Link& link = *given.LinkByIndex(k);
        read_link(link, place, inside(link.Name()), still, own);
    }
    for (std::uint64_t k = 0; k < given.ModelCount(); ++k) {
        const sdf::Model& nested = *given.ModelByIndex(k);
        read_model(nested, place, inside(nested.Name()), still, own);
    }
    for (std::uint64_t k = 0; k < given.JointCount(); ++k) read_joint(*given.JointByIndex(k), place, name);
    if (!given.SelfCollide()) model_import::keep_all_apart(model_, own);
    links.insert(links.end(), own.begin(), own.end());
    note_plugins(given.Element(), what, true);
}

void SdfReader::read_link(const sdf::Link& link, const Placed& model, const std::string& name, bool fixed,
                          std::vector<std::int32_t>& links) {
    const std::string what = fmt::format("link \"{}\"", name);
    const Placed place = model * resolved(link.SemanticPose(), what);
    const ignition::math::Inertiald& inertial = link.Inertial();
    const Placed at = transform_of(inertial.Pose());
    ModelBody body;
    body.name = body_names_.take(name, "link");
    body.fixed = fixed;
    body.mass = inertial.MassMatrix().Mass();
    const ignition::math::Matrix3d moments = inertial.MassMatrix().Moi();
    Matrix3d J;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) J(i, j) = moments(static_cast<std::size_t>(i), static_cast<std::size_t>(j));
    body.inertia = at.linear() * J * at.linear().transpose();
    body.position = place * at.translation();
    body.orientation = Quaterniond(place.linear()).normalized();
    for (std::uint64_t k = 0; k < link.CollisionCount(); ++k) {
        const sdf::Collision& collision = *link.CollisionByIndex(k);
        const std::size_t before = body.shapes.size();
        read_shape(collision, place, fmt::format("collision \"{}\" of {}", collision.Name(), what), fixed, body);
        const sdf::ElementPtr mask = element_at(collision.Element(), {"surface", "contact", "collide_bitmask"});
        const auto bits = static_cast<std::uint16_t>(mask ? mask->Get<unsigned int>() : 0xffffU);
        for (std::size_t shape = before; shape < body.shapes.size(); ++shape)
            masks_.push_back({static_cast<std::int32_t>(model_.bodies.size()), bits});
    }
    if (link.VisualCount() > 0) seen_.push_back(fmt::format("visuals of {}", what));
    if (link.SensorCount() > 0) seen_.push_back(fmt::format("sensors of {}", what));
    const sdf::ElementPtr element = link.Element();
    if (const auto gravity = element_at(element, {"gravity"}); gravity && !gravity->Get<bool>() && !fixed)
        model_.lose(what, "it has no weight: in a scene it has");
    if (const auto kinematic = element_at(element, {"kinematic"}); kinematic && kinematic->Get<bool>())
        model_.lose(what, "it is kinematic: here forces move it");
    if (element_at(element, {"velocity_decay"})) model_.lose(what, "decay of its velocity");
    note_plugins(element, what, true);
    const auto number = static_cast<std::int32_t>(model_.bodies.size());
    links_[name] = number;
    links.push_back(number);
    model_.bodies.push_back(std::move(body));
}

std::int32_t SdfReader::material_of(const sdf::Collision& collision, const std::string& what) {
    const sdf::ElementPtr surface = element_at(collision.Element(), {"surface"});
    const double of_bullet = number_at(surface, {"friction", "bullet", "friction"}, 1.0);
    const double along = number_at(surface, {"friction", "ode", "mu"}, of_bullet);
    const bool has_ode = element_at(surface, {"friction", "ode"}) != nullptr;
    const double across = has_ode ? number_at(surface, {"friction", "ode", "mu2"}, along)
                                  : number_at(surface, {"friction", "bullet", "friction2"}, along);
    const double friction = std::max(0.0, std::min(along, across));
    const double restitution = std::clamp(number_at(surface, {"bounce", "restitution_coefficient"}, 0.0), 0.0, 1.0);
    if (along != across)
        model_.lose(what, fmt::format("frictions {:.6g} and {:.6g} that differ: the lesser holds in all directions",
                                      along, across));
    if (along < 0.0 || across < 0.0) model_.lose(what, "a negative friction: it becomes 0");
    if (element_at(surface, {"friction", "torsional"})) model_.lose(what, "spinning friction");
    if (element_at(surface, {"soft_contact"})) model_.lose(what, "a soft contact: contacts are rigid");
    if (number_at(surface, {"friction", "ode", "slip1"}, 0.0) != 0.0 ||
        number_at(surface, {"friction", "ode", "slip2"}, 0.0) != 0.0)
        model_.lose(what, "slip");
    const auto differs = [&](std::initializer_list<const char*> path, double usual) {
        return number_at(surface, path, usual) != usual;
    };
    std::vector<std::string> soft;
    for (const auto& [name, usual] :
         {std::pair("kp", 1e12), std::pair("kd", 1.0), std::pair("soft_cfm", 0.0), std::pair("soft_erp", 0.2)})
        if (differs({"contact", "ode", name}, usual) || differs({"contact", "bullet", name}, usual))
            soft.push_back(name);
    if (!soft.empty()) model_.lose(what, fmt::format("{}: contacts are rigid", fmt::join(soft, ", ")));
    if (element_at(surface, {"friction", has_ode ? "ode" : "bullet", "fdir1"}))
        model_.lose(what, "a direction of friction (fdir1)");
    auto& all = model_.materials;
    const auto known = std::find_if(all.begin(), all.end(), [&](const auto& one) {
        return one.friction == friction && one.restitution == restitution;
    });
    if (known != all.end()) return static_cast<std::int32_t>(known - all.begin());
    all.push_back({restitution > 0.0 ? fmt::format("friction {:.6g}, restitution {:.6g}", friction, restitution)
                                     : fmt::format("friction {:.6g}", friction),
                   friction, restitution});
    return static_cast<std::int32_t>(all.size()) - 1;
}

void SdfReader::read_shape(const sdf::Collision& collision, const Placed& link, const std::string& what, bool fixed,
                           ModelBody& body) {
    const sdf::Geometry* geometry = collision.Geom();
    if (geometry == nullptr || geometry->Type() == sdf::GeometryType::EMPTY) return;
    const Placed at = link * resolved(collision.SemanticPose(), what);
    ModelShape shape;
    shape.name = body.name + "_" + collision.Name();
    shape.position = at.translation();
    shape.orientation = Quaterniond(at.linear()).normalized();
    shape.material = material_of(collision, what);
    switch (geometry->Type()) {
        case sdf::GeometryType::BOX:
            shape.form = Form::Box;
            shape.size = vector_of(geometry->BoxShape()->Size());
            break;
        case sdf::GeometryType::SPHERE:
            shape.form = Form::Sphere;
            shape.size.x() = geometry->SphereShape()->Radius();
            break;
        case sdf::GeometryType::CYLINDER:
            shape.form = Form::Cylinder;
            shape.size = {geometry->CylinderShape()->Radius(), geometry->CylinderShape()->Length(), 0.0};
            break;
        case sdf::GeometryType::CAPSULE:
            shape.form = Form::Capsule;
            shape.size = {geometry->CapsuleShape()->Radius(), geometry->CapsuleShape()->Length(), 0.0};
            break;
        case sdf::GeometryType::ELLIPSOID:
            shape = model_import::ellipsoid(model_, shape, vector_of(geometry->EllipsoidShape()->Radii()), what);
            break;
        case sdf::GeometryType::PLANE: {
            if (!fixed) return model_.lose(what, "a plane on a link that moves: it touches nothing");
            shape.form = Form::Plane;
            const Vector3d normal = vector_of(geometry->PlaneShape()->Normal());
            shape.orientation = shape.orientation * Quaterniond::FromTwoVectors(Vector3d::UnitZ(), normal);
            break;
        }
        case sdf::GeometryType::MESH: {
            const sdf::Mesh& mesh = *geometry->MeshShape();
            if (!mesh.Submesh().empty()) model_.lose(what, "a part of a mesh: all of it is taken");
            return model_import::add_mesh(model_, shape, mesh.Uri(), vector_of(mesh.Scale()),
                                          mesh.FilePath().empty() ? file_ : std::filesystem::path(mesh.FilePath()),
                                          what, body.shapes);
        }
        default:
            return model_.lose(what, "a shape of a kind that scenes have not (a height map)");
    }
    body.shapes.push_back(std::move(shape));
}

void SdfReader::read_joint(const sdf::Joint& joint, const Placed& model, const std::string& scope) {
    const std::string what = fmt::format("joint \"{}\"", scope.empty() ? joint.Name() : scope + "::" + joint.Name());
    const auto body_of = [&](bool child) {
        std::string name;
        const sdf::Errors errors = child ? joint.ResolveChildLink(name) : joint.ResolveParentLink(name);
        if (!errors.empty()) throw InputError(fmt::format("{}: {}", what, errors.front().Message()));
        if (name == "world") return std::int32_t{-1};
        const auto found = links_.find(scope.empty() ? name : scope + "::" + name);
        if (found == links_.end())
            throw InputError(fmt::format("{} names the link \"{}\", which is not there", what, name));
        return found->second;
    };
    const std::int32_t parent = body_of(false), child = body_of(true);
    const Placed at = model * resolved(joint.SemanticPose(), what, "__model__");
    const auto with_axis = [&](unsigned int index, JointKind kind) {
        ModelJoint result;
        JointParameters& own = result.parameters;
        own.kind = kind;
        own.first = parent;
        own.second = child;
        own.point = model_import::array(at.translation());
        const sdf::JointAxis* axis = joint.Axis(index);
        if (axis == nullptr) return result;
        ignition::math::Vector3d direction;
        const sdf::Errors errors = axis->ResolveXyz(direction, "__model__");
        if (!errors.empty()) throw InputError(fmt::format("the axis of {}: {}", what, errors.front().Message()));
        own.axis = model_import::array(model.linear() * vector_of(direction).normalized());
        return result;
    };
    const std::string name = scope.empty() ? joint.Name() : scope + "::" + joint.Name();
    const auto put = [&](ModelJoint result) {
        result.parameters.name = joint_names_.take(name, "joint");
        model_.joints.push_back(std::move(result));
    };
    if (joint.SensorCount() > 0) seen_.push_back(fmt::format("sensors of {}", what));
    switch (joint.Type()) {
        case sdf::JointType::FIXED:
            return put(with_axis(0, JointKind::Fixed));
        case sdf::JointType::BALL:
            return put(with_axis(0, JointKind::Spherical));
        case sdf::JointType::REVOLUTE:
        case sdf::JointType::CONTINUOUS:
        case sdf::JointType::PRISMATIC: {
            ModelJoint result =
                with_axis(0, joint.Type() == sdf::JointType::PRISMATIC ? JointKind::Prismatic : JointKind::Revolute);
            if (joint.Axis(0) != nullptr) read_coordinate(*joint.Axis(0), joint.Element(), what, result.parameters);
            return put(std::move(result));
        }
        case sdf::JointType::SCREW: {
            model_.lose(what, "its thread: it slides and turns freely");
            return put(with_axis(0, JointKind::Cylindrical));
        }
        case sdf::JointType::UNIVERSAL:
        case sdf::JointType::REVOLUTE2: {
            std::vector<ModelJoint> both = {with_axis(0, JointKind::Revolute), with_axis(1, JointKind::Revolute)};
            for (unsigned int k = 0; k < 2; ++k)
                if (joint.Axis(k) != nullptr)
                    read_coordinate(*joint.Axis(k), k == 0 ? joint.Element() : nullptr,
                                    fmt::format("{}, axis {}", what, k + 1), both[k].parameters);
            const JointParameters &first = both[0].parameters, &second = both[1].parameters;
            const bool acts = std::any_of(both.begin(), both.end(), [](const ModelJoint& one) {
                const auto& [damping, stiffness, rest, friction, armature, start, rate] = one.parameters.turn;
                return std::isfinite(one.parameters.lower) || std::isfinite(one.parameters.upper) || damping > 0.0 ||
                       stiffness > 0.0 || friction > 0.0 || start;
            });
            const Eigen::Map<const Vector3d> a(first.axis.data()), b(second.axis.data());
            if (!acts && std::abs(a.dot(b)) < 1e-12) {
                ModelJoint one = both[0];
                one.parameters.kind = JointKind::Universal;
                one.parameters.second_axis = second.axis;
                return put(std::move(one));
            }
            const std::string own = joint_names_.take(name, "joint");
            both[0].parameters.name = own;
            both[1].parameters.name = joint_names_.take(own + ", axis 2", "joint");
            return model_import::add_chain(model_, parent, child, std::move(both),
                                           {2, {Vector3d::Zero(), Vector3d::Zero()}});
        }
        case sdf::JointType::GEARBOX:
            return model_.lose(what, "a gearbox");
        default:
            return model_.lose(what, "a joint of a kind that scenes have not");
    }
}

void SdfReader::read_coordinate(const sdf::JointAxis& axis, const sdf::ElementPtr& joint_element,
                                const std::string& what, JointParameters& own) {
    const bool turns = own.kind == JointKind::Revolute;
    JointCoordinate& coordinate = turns ? own.turn : own.slide;
    coordinate.damping = axis.Damping();
    coordinate.friction = axis.Friction();
    coordinate.stiffness = axis.SpringStiffness();
    if (coordinate.stiffness > 0.0) coordinate.rest = axis.SpringReference();
    if (coordinate.damping < 0.0 || coordinate.friction < 0.0 || coordinate.stiffness < 0.0)
        throw InputError(fmt::format("{} has a negative damping, friction or stiffness", what));
    constexpr double no_limit = 1e15;  // 1e16 and infinity stand for none
    if (axis.Lower() > -no_limit) own.lower = axis.Lower();
    if (axis.Upper() < no_limit) own.upper = axis.Upper();
    if (own.lower > own.upper)
        throw InputError(fmt::format("the limits of {} are {} and {}", what, own.lower, own.upper));
    const double start = own.lower > 0.0 ? own.lower : own.upper < 0.0 ? own.upper : 0.0;
    if (start != 0.0) {
        coordinate.start = start;
        model_.lose(what, "its 0 lies beyond its limits: it starts at the nearer one");
    }
    if (const sdf::ElementPtr physics = element_at(joint_element, {"physics"})) {
        std::vector<std::string> acts;
        for (const auto& path : {std::vector<const char*>{"ode", "cfm"},
                                 {"ode", "erp"},
                                 {"ode", "cfm_damping"},
                                 {"ode", "limit", "cfm"},
                                 {"ode", "limit", "erp"},
                                 {"ode", "suspension"},
                                 {"ode", "max_force"}}) {
            sdf::ElementPtr at = physics;
            for (const char* name : path) at = at && at->HasElement(name) ? at->GetElement(name) : nullptr;
            if (at) acts.emplace_back(fmt::format("{}", fmt::join(path, "/")));
        }
        if (!acts.empty()) model_.lose(what, fmt::format("{}: joints and stops are rigid", fmt::join(acts, ", ")));
    }
    const auto limited = [](double limit) { return limit > 0.0 && limit < 1e15; };
    if (limited(axis.Effort()) || limited(axis.MaxVelocity())) efforts_.push_back(what);
}

// Two shapes touch if their masks have a bit in common.
void SdfReader::read_bitmasks() {
    std::map<std::array<std::int32_t, 2>, std::array<int, 2>> pairs;  // how many there are, and touch
    if (std::all_of(masks_.begin(), masks_.end(), [](const Mask& one) { return one.bits == 0xffff; })) return;
    for (std::size_t a = 0; a < masks_.size(); ++a)
        for (std::size_t b = a + 1; b < masks_.size(); ++b) {
            if (masks_[a].body == masks_[b].body) continue;
            auto& [all, touch] = pairs[{masks_[a].body, masks_[b].body}];
            ++all;
            if ((masks_[a].bits & masks_[b].bits) != 0) ++touch;
        }
    for (const auto& [pair, count] : pairs) {
        if (count[1] == count[0]) continue;
        if (count[1] == 0) {
            model_.apart.push_back(pair);
        } else {
            model_.lose(
                fmt::format("contacts of \"{}\" and \"{}\"", model_.bodies[static_cast<std::size_t>(pair[0])].name,
                            model_.bodies[static_cast<std::size_t>(pair[1])].name),
                fmt::format("only {} of {} pairs of collisions are to touch: here all do", count[1], count[0]));
        }
    }
}

}  // namespace delassus::importers
