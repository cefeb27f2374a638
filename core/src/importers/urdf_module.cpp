// SPDX-License-Identifier: BSD-3-Clause
// Reads a URDF file by urdfdom.
#include <console_bridge/console.h>
#include <fmt/format.h>
#include <tinyxml2.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "delassus/error.hpp"
#include "delassus/export.hpp"
#include "importers/xml_known.hpp"
#include "importers/xml_tree.hpp"
#include "model_import/model.hpp"
#include "support/text_file.hpp"

namespace delassus::importers {
namespace {

using model_import::Form;
using model_import::Matrix3d;
using model_import::Model;
using model_import::ModelBody;
using model_import::ModelJoint;
using model_import::ModelShape;
using model_import::Quaterniond;
using model_import::Vector3d;

/// While it lives, what urdfdom says is kept in place of being printed.
class UrdfReports : public console_bridge::OutputHandler {
public:
    UrdfReports() { console_bridge::useOutputHandler(this); }
    ~UrdfReports() override { console_bridge::restorePreviousOutputHandler(); }
    UrdfReports(const UrdfReports&) = delete;
    UrdfReports& operator=(const UrdfReports&) = delete;
    void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
        if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR) {
            errors.push_back(text);
        } else if (level == console_bridge::CONSOLE_BRIDGE_LOG_WARN) {
            warnings.push_back(text);
        }
    }
    std::vector<std::string> errors, warnings;
};

Vector3d vector_of(const urdf::Vector3& v) {
    return {v.x, v.y, v.z};
}

Eigen::Isometry3d transform_of(const urdf::Pose& pose) {
    double x = 0.0, y = 0.0, z = 0.0, w = 1.0;
    pose.rotation.getQuaternion(x, y, z, w);
    Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
    result.linear() = Quaterniond(w, x, y, z).normalized().toRotationMatrix();
    result.translation() = vector_of(pose.position);
    return result;
}

class UrdfReader {
public:
    UrdfReader(const urdf::ModelInterface& robot, const std::filesystem::path& file, Model& model)
        : robot_(robot), file_(file), model_(model) {}

    void read(bool floating) {
        model_.title = robot_.getName();
        model_.materials.push_back({"default", 1.0, 0.0});
        const urdf::LinkConstSharedPtr root = robot_.getRoot();
        if (!root) throw InputError("it has no root link");
        read_link(*root, Eigen::Isometry3d::Identity());
        ModelBody& first = model_.bodies.front();
        if (!floating)
            first.fixed = true;
        else if (first.mass == 0.0 && !carries_by_fixed(*root))
            throw InputError(fmt::format("the root link \"{}\" has no mass and cannot float", root->name));
        read_mimics();
        std::vector<std::int32_t> all;
        for (std::size_t k = 0; k < model_.bodies.size(); ++k) all.push_back(static_cast<std::int32_t>(k));
        model_import::keep_all_apart(model_, all);
        if (!efforts_.empty())
            model_.without_effect.push_back({"limits of effort and velocity, as no motor drives the joints",
                                             fmt::format("{}", fmt::join(efforts_, ", "))});
        if (!controllers_.empty())
            model_.without_effect.push_back(
                {"safety controllers and calibrations", fmt::format("{}", fmt::join(controllers_, ", "))});
        if (visuals_ > 0) model_.without_effect.push_back({"visuals", fmt::format("{} of them", visuals_)});
    }

private:
    bool carries_by_fixed(const urdf::Link& link) const {
        return std::any_of(link.child_joints.begin(), link.child_joints.end(), [&](const auto& joint) {
            if (joint->type != urdf::Joint::FIXED) return false;
            const auto child = robot_.getLink(joint->child_link_name);
            return child && ((child->inertial && child->inertial->mass > 0.0) || carries_by_fixed(*child));
        });
    }

    // The body's axes are those of the link.
    void read_link(const urdf::Link& link, const Eigen::Isometry3d& place) {
        ModelBody body;
        body.name = body_names_.take(link.name, "link");
        body.position = place.translation();
        body.orientation = Quaterniond(place.linear()).normalized();
        if (link.inertial) {
            const urdf::Inertial& own = *link.inertial;
            const Eigen::Isometry3d at = transform_of(own.origin);
            body.mass = own.mass;
            Matrix3d J;
            J << own.ixx, own.ixy, own.ixz, own.ixy, own.iyy, own.iyz, own.ixz, own.iyz, own.izz;
            body.inertia = at.linear() * J * at.linear().transpose();
            body.position = place * at.translation();
            if (!(body.mass >= 0.0) || !std::isfinite(body.mass))
                throw InputError(fmt::format("the mass of link \"{}\" is {}", link.name, body.mass));
            if (body.mass == 0.0 && !body.inertia.isZero(0.0)) {
                model_.lose(fmt::format("link \"{}\"", link.name), "an inertia without a mass: left out");
                body.inertia.setZero();
            }
        }
        for (const auto& collision : link.collision_array) read_shape(link, *collision, place, body);
        visuals_ += link.visual_array.size();
        const auto number = static_cast<std::int32_t>(model_.bodies.size());
        model_.bodies.push_back(std::move(body));
        for (const auto& joint : link.child_joints) {
            const auto child = robot_.getLink(joint->child_link_name);
            if (!child) continue;
            const Eigen::Isometry3d at = place * transform_of(joint->parent_to_joint_origin_transform);
            const auto next = static_cast<std::int32_t>(model_.bodies.size());
            const Eigen::Isometry3d placed = read_joint(*joint, at, number, next);
            read_link(*child, placed);
        }
    }

    /// The coordinate of a joint where the scene has its 0: where mimicking joints are when those that they follow are
    /// at theirs, so that a ratio alone remains.
    double reference(const urdf::Joint& joint, std::set<std::string> before = {}) const {
        if (!joint.mimic) return 0.0;
        if (!before.insert(joint.name).second)
            throw InputError(fmt::format("the joint \"{}\" mimics itself", joint.name));
        const auto followed = robot_.getJoint(joint.mimic->joint_name);
        if (!followed) return 0.0;
        return joint.mimic->multiplier * reference(*followed, std::move(before)) + joint.mimic->offset;
    }

    /// Where the child is. at: the frame of the joint.
    Eigen::Isometry3d read_joint(const urdf::Joint& joint, const Eigen::Isometry3d& at, std::int32_t first,
                                 std::int32_t second) {
        const std::string what = fmt::format("joint \"{}\"", joint.name);
        ModelJoint result;
        JointParameters& own = result.parameters;
        own.first = first;
        own.second = second;
        own.point = model_import::array(at.translation());
        Vector3d axis = vector_of(joint.axis);
        if (joint.type != urdf::Joint::FIXED && joint.type != urdf::Joint::FLOATING) {
            if (!(axis.norm() > 0.0)) throw InputError(fmt::format("the axis of {} has no direction", what));
            axis.normalize();
        }
        own.axis = model_import::array(at.linear() * axis);
        Eigen::Isometry3d moved = at;
        const double zero = reference(joint);
        switch (joint.type) {
            case urdf::Joint::REVOLUTE:
            case urdf::Joint::CONTINUOUS:
                own.kind = JointKind::Revolute;
                moved.rotate(Eigen::AngleAxisd(zero, axis));
                break;
            case urdf::Joint::PRISMATIC:
                own.kind = JointKind::Prismatic;
                moved.translate(zero * axis);
                break;
            case urdf::Joint::PLANAR:
                own.kind = JointKind::Planar;
                break;
            case urdf::Joint::FIXED:
                own.kind = JointKind::Fixed;
                break;
            case urdf::Joint::FLOATING:
                joint_names_.take(joint.name, "joint");
                return at;
            default:
                throw InputError(fmt::format("{} has no type that is known", what));
        }
        own.name = joint_names_.take(joint.name, "joint");
        if (own.kind == JointKind::Revolute || own.kind == JointKind::Prismatic) {
            read_coordinate(joint, what, zero, own);
        } else if (joint.dynamics && (joint.dynamics->damping != 0.0 || joint.dynamics->friction != 0.0)) {
            model_.lose(what, "damping and friction of a planar or fixed joint");
        }
        place_[joint.name] = static_cast<std::int32_t>(model_.joints.size());
        model_.joints.push_back(std::move(result));
        return moved;
    }

    void read_coordinate(const urdf::Joint& joint, const std::string& what, double zero, JointParameters& own) {
        const bool turns = own.kind == JointKind::Revolute;
        JointCoordinate& coordinate = turns ? own.turn : own.slide;
        if (joint.dynamics) {
            coordinate.damping = joint.dynamics->damping;
            coordinate.friction = joint.dynamics->friction;
            if (coordinate.damping < 0.0 || coordinate.friction < 0.0)
                throw InputError(fmt::format("{} has a negative damping or friction", what));
        }
        if (joint.safety || joint.calibration) controllers_.push_back(joint.name);
        if (!joint.limits) return;
        if (joint.limits->effort > 0.0 || joint.limits->velocity > 0.0) efforts_.push_back(joint.name);
        if (joint.type == urdf::Joint::CONTINUOUS) return;
        if (std::isfinite(joint.limits->lower)) own.lower = joint.limits->lower - zero;
        if (std::isfinite(joint.limits->upper)) own.upper = joint.limits->upper - zero;
        if (own.lower > own.upper)
            throw InputError(
                fmt::format("the limits of {} are {} and {}", what, joint.limits->lower, joint.limits->upper));
        const double start = own.lower > 0.0 ? own.lower : own.upper < 0.0 ? own.upper : 0.0;
        if (start != 0.0) {
            coordinate.start = start;
            model_.lose(what, "its 0 lies beyond its limits: it starts at the nearer one");
        }
    }

    void read_mimics() {
        for (const auto& [name, joint] : robot_.joints_) {
            if (!joint->mimic || !place_.contains(name)) continue;
            const std::string what = fmt::format("joint \"{}\"", name);
            const std::int32_t second = place_.at(name);
            const auto followed = place_.find(joint->mimic->joint_name);
            const auto kind = [&](std::int32_t k) {
                return model_.joints[static_cast<std::size_t>(k)].parameters.kind;
            };
            const double ratio = joint->mimic->multiplier;
            if (followed == place_.end() || kind(second) != kind(followed->second) ||
                kind(second) == JointKind::Planar) {
                model_.lose(what,
                            fmt::format("it mimics \"{}\", {}", joint->mimic->joint_name,
                                        robot_.getJoint(joint->mimic->joint_name) ? "which is a joint of another kind"
                                                                                  : "and there is no such joint"));
                continue;
            }
            if (ratio == 0.0) {
                model_.locks.push_back({name + " stands still", second, 0.0});
                continue;
            }
            ModelJoint gear;
            JointParameters& own = gear.parameters;
            own.kind = JointKind::Gear;
            own.name = joint_names_.take(fmt::format("{} mimics {}", name, joint->mimic->joint_name), "mimic");
            own.gear_first = followed->second;
            own.gear_second = second;
            own.gear_ratio = ratio;
            if (kind(second) == JointKind::Revolute) {
                const auto [p, q] = model_import::nearest_fraction(ratio);
                own.gear_ratio = p / q;
                if (std::abs(p / q - ratio) > 1e-9 * std::abs(ratio))
                    model_.lose(what, fmt::format("the ratio {} of what it mimics becomes {}/{}", ratio, p, q));
            }
            model_.joints.push_back(std::move(gear));
        }
    }

    void read_shape(const urdf::Link& link, const urdf::Collision& collision, const Eigen::Isometry3d& place,
                    ModelBody& body) {
        if (!collision.geometry) return;
        const std::string what = fmt::format("collision {} of link \"{}\"", body.shapes.size() + 1, link.name);
        const Eigen::Isometry3d at = place * transform_of(collision.origin);
        ModelShape shape;
        shape.name = link.name;
        shape.position = at.translation();
        shape.orientation = Quaterniond(at.linear()).normalized();
        shape.material = 0;
        switch (collision.geometry->type) {
            case urdf::Geometry::SPHERE:
                shape.form = Form::Sphere;
                shape.size.x() = dynamic_cast<const urdf::Sphere&>(*collision.geometry).radius;
                break;
            case urdf::Geometry::BOX:
                shape.form = Form::Box;
                shape.size = vector_of(dynamic_cast<const urdf::Box&>(*collision.geometry).dim);
                break;
            case urdf::Geometry::CYLINDER: {
                const auto& cylinder = dynamic_cast<const urdf::Cylinder&>(*collision.geometry);
                shape.form = Form::Cylinder;
                shape.size = {cylinder.radius, cylinder.length, 0.0};
                break;
            }
            case urdf::Geometry::MESH: {
                const auto& mesh = dynamic_cast<const urdf::Mesh&>(*collision.geometry);
                model_import::add_mesh(model_, shape, mesh.filename, vector_of(mesh.scale), file_, what, body.shapes);
                return;
            }
        }
        body.shapes.push_back(std::move(shape));
    }

    const urdf::ModelInterface& robot_;
    std::filesystem::path file_;
    Model& model_;
    model_import::Names body_names_, joint_names_;
    std::map<std::string, std::int32_t> place_;  // of joints in the model
    std::vector<std::string> efforts_, controllers_;
    std::size_t visuals_ = 0;
};

/// The model with a name, which urdfdom insists on.
std::string with_name(const std::string& text, const std::string& name) {
    tinyxml2::XMLDocument document;
    if (document.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS) return text;
    tinyxml2::XMLElement* robot = document.RootElement();
    if (robot == nullptr || robot->Attribute("name") != nullptr) return text;
    robot->SetAttribute("name", name.c_str());
    tinyxml2::XMLPrinter printer;
    document.Print(&printer);
    return printer.CStr();
}

constexpr std::array<KnownElement, 18> urdf_elements = {{
    {"link", "name type~", "inertial collision visual~"},
    {"inertial", "", "origin mass inertia"},
    {"origin", "xyz rpy", ""},
    {"mass", "value", ""},
    {"inertia", "ixx ixy ixz iyy iyz izz", ""},
    {"collision", "name group~", "origin geometry"},
    {"geometry", "", "box sphere cylinder mesh"},
    {"box", "size", ""},
    {"sphere", "radius", ""},
    {"cylinder", "radius length", ""},
    {"mesh", "filename scale", ""},
    {"joint", "name type", "origin parent child axis dynamics limit calibration~ mimic safety_controller~"},
    {"parent", "link", ""},
    {"child", "link", ""},
    {"axis", "xyz", ""},
    {"dynamics", "damping friction", ""},
    {"limit", "lower upper effort velocity", ""},
    {"mimic", "joint multiplier offset", ""},
}};

/// Nothing where the file is no XML, which urdfdom refuses in its words.
std::optional<XmlElement> try_read_xml(const std::filesystem::path& file) {
    try {
        return read_xml(file, "");
    } catch (const InputError&) {
        return std::nullopt;
    }
}

/// Whether it is a text for xacro, which puts other texts in the place of macros and of ${…} and $(…).
bool has_macros(const XmlElement& element) {
    const auto has = [](const std::string& text, const char* sign) { return text.find(sign) != std::string::npos; };
    return element.name.starts_with("xacro:") || has(element.content, "${") ||
           std::any_of(element.attributes.begin(), element.attributes.end(),
                       [&](const XmlAttribute& one) { return has(one.value, "${") || has(one.value, "$("); }) ||
           std::any_of(element.children.begin(), element.children.end(), has_macros);
}

void refuse_macros(const XmlElement& robot, const std::filesystem::path& file) {
    if (!has_macros(robot)) return;
    std::filesystem::path expanded = file.filename();
    if (expanded.extension() == ".xacro") expanded.replace_extension();
    expanded.replace_extension(expanded == file.filename() ? ".expanded.urdf" : ".urdf");
    throw InputError(fmt::format("it has macros of xacro; expand it first: xacro {} > {}", file.filename().string(),
                                 expanded.string()));
}

/// urdfdom leaves the mass of such a link out.
void refuse_masses_without_numbers(const XmlElement& robot) {
    for (const XmlElement& link : robot.children) {
        if (link.name != "link") continue;
        for (const XmlElement& inertial : link.children) {
            if (inertial.name != "inertial") continue;
            for (const XmlElement& part : inertial.children)
                for (const char* name : {"value", "xyz", "rpy", "ixx", "ixy", "ixz", "iyy", "iyz", "izz"}) try {
                        (void)part.numbers(name);
                    } catch (const InputError& error) {
                        throw InputError(fmt::format("link \"{}\": {}", link.text("name"), error.what()));
                    }
        }
    }
}

/// What urdfdom passes over without a word.
void note_unread(const XmlElement& robot, Model& model) {
    static const std::set<std::string> looks = {"material", "sensor", "visual", "dynamic_shadows", "laser_retro"};
    for (const XmlElement& part : robot.children) {
        const std::string name = part.text("name");
        if (part.name == "link" || part.name == "joint") {
            note_unknown(part, urdf_elements, "URDF", model);
        } else if (part.name == "gazebo") {
            std::vector<std::string> acts;
            for (const XmlElement& child : part.children)
                if (!looks.contains(child.name)) acts.push_back(child.name);
            if (!acts.empty())
                model.lose(fmt::format("gazebo \"{}\"", part.text("reference", robot.text("name"))),
                           fmt::format("what only Gazebo reads: {}", fmt::join(acts, ", ")));
        } else if (part.name == "transmission" || part.name == "ros2_control") {
            model.without_effect.push_back({fmt::format("{} \"{}\"", part.name, name), "no motor drives the joints"});
        } else if (part.name == "mujoco" || part.name == "sensor") {
            model.without_effect.push_back({fmt::format("element <{}>", part.name), "settings of MuJoCo, and sensors"});
        } else if (part.name != "material") {
            model.lose(fmt::format("{} \"{}\"", part.name, name), "URDF as it is read here does not have it");
        }
    }
}

}  // namespace
}  // namespace delassus::importers

extern "C" DELASSUS_API void delassus_import_urdf_read(const std::filesystem::path& file,
                                                       const delassus::ImportSettings& settings,
                                                       delassus::model_import::Model& model) {
    using namespace delassus;
    const auto given = importers::try_read_xml(file);
    if (given) {
        importers::refuse_macros(*given, file);
        importers::refuse_masses_without_numbers(*given);
    }
    importers::UrdfReports reports;
    const urdf::ModelInterfaceSharedPtr robot =
        urdf::parseURDF(importers::with_name(read_file(file), file.stem().string()));
    if (!robot)
        throw InputError("urdfdom refuses the model: " +
                         (reports.errors.empty() ? "it gives no reason" : reports.errors.front()));
    for (const auto& error : reports.errors) model.lose("error of urdfdom", error);
    for (const auto& warning : reports.warnings) model.without_effect.push_back({"warning of urdfdom", warning});
    if (given) importers::note_unread(*given, model);
    importers::UrdfReader(*robot, file, model).read(settings.floating);
}
