// SPDX-License-Identifier: BSD-3-Clause
// Attributes of single elements over what defaults say.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "importers/mjcf_spec.hpp"

namespace delassus::importers::mjcf {

namespace {

constexpr double least_length = 1e-14;  // shorter directions have none, as in MuJoCo

void read_vector(const XmlElement& element, const char* attribute, Vector3d& value) {
    element.read(attribute, value.data(), 3, 3);
}

template <std::size_t N>
void read_some(const XmlElement& element, const char* attribute, std::array<double, N>& values) {
    element.read(attribute, values.data(), N, 1);
}

void read_softness(const XmlElement& element, const char* solref, const char* solimp, Softness& value) {
    read_some(element, solref, value.solref);
    read_some(element, solimp, value.solimp);
}

void read_orientation(const XmlElement& element, const Compiler& compiler, Quaterniond& value) {
    if (const auto given = orientation_of(element, compiler)) value = *given;
}

/// A linear coefficient, and those of powers, which replace what the defaults say.
void read_polynomial(const XmlElement& element, const char* attribute, std::array<double, 3>& values) {
    std::array<double, 3> given{};
    if (element.read(attribute, given.data(), 3, 1) > 0) values = given;
}

Vector3d direction(const XmlElement& element, const char* attribute, const Vector3d& given) {
    if (!(given.norm() >= least_length)) element.refuse(fmt::format("{} has no direction", attribute));
    return given.normalized();
}

}  // namespace

void read_switch(const XmlElement& element, const char* attribute, Switch& value) {
    if (const int which = element.word(attribute, {"false", "true", "auto"}); which >= 0)
        value = static_cast<Switch>(which);
}

Quaterniond z_towards(const Vector3d& direction) {
    const Vector3d z = direction.normalized(), axis = Vector3d::UnitZ().cross(z);
    const double sine = axis.norm();
    if (sine < 1e-10) return z.z() > 0.0 ? Quaterniond::Identity() : Quaterniond(0.0, 1.0, 0.0, 0.0);
    return Quaterniond(Eigen::AngleAxisd(std::atan2(sine, z.z()), axis / sine));
}

std::optional<Quaterniond> orientation_of(const XmlElement& element, const Compiler& compiler) {
    const double unit = compiler.degree ? std::numbers::pi / 180.0 : 1.0;
    const char* given = nullptr;
    for (const char* one : {"quat", "axisangle", "xyaxes", "zaxis", "euler"}) {
        if (element.find(one) == nullptr) continue;
        if (given != nullptr) element.refuse(fmt::format("it has two orientations, {} and {}", given, one));
        given = one;
    }
    std::optional<Quaterniond> result;
    std::array<double, 4> four{};
    if (element.read("quat", four.data(), 4, 4) > 0) {
        const Quaterniond q(four[0], four[1], four[2], four[3]);
        if (!(q.norm() >= least_length)) element.refuse("quat is no rotation: its numbers are all 0");
        result = q.normalized();
    }
    if (element.read("axisangle", four.data(), 4, 4) > 0)
        result = Quaterniond(
            Eigen::AngleAxisd(four[3] * unit, direction(element, "axisangle", Vector3d(four[0], four[1], four[2]))));
    if (std::array<double, 6> axes{}; element.read("xyaxes", axes.data(), 6, 6) > 0) {
        const Vector3d x = direction(element, "xyaxes", Vector3d(axes.data()));
        const Vector3d second(axes.data() + 3);
        const Vector3d y = direction(element, "xyaxes", second - second.dot(x) * x);
        Matrix3d turn;
        turn << x, y, x.cross(y);
        result = Quaterniond(turn).normalized();
    }
    if (Vector3d z; element.read("zaxis", z.data(), 3, 3) > 0) result = z_towards(direction(element, "zaxis", z));
    if (Vector3d angles; element.read("euler", angles.data(), 3, 3) > 0) {
        Quaterniond q = Quaterniond::Identity();
        for (std::size_t k = 0; k < 3; ++k) {
            const char axis = compiler.euler_sequence[k];
            const bool fixed = axis >= 'X' && axis <= 'Z';
            const Vector3d about = Vector3d::Unit(axis - (fixed ? 'X' : 'x'));
            const Quaterniond turn(Eigen::AngleAxisd(angles[static_cast<Eigen::Index>(k)] * unit, about));
            q = fixed ? turn * q : q * turn;
        }
        result = q.normalized();
    }
    return result;
}

void read_joint(const XmlElement& element, const Compiler&, Joint& joint) {
    joint.where = element.where();
    element.read("name", joint.name);
    if (const int type = element.word("type", {"free", "ball", "slide", "hinge"}); type >= 0)
        joint.type = static_cast<JointType>(type);
    read_vector(element, "pos", joint.position);
    read_vector(element, "axis", joint.axis);
    read_switch(element, "limited", joint.limited);
    read_switch(element, "actuatorfrclimited", joint.force_limited);
    read_switch(element, "align", joint.align);
    element.read("range", joint.range.data(), 2, 2);
    element.read("actuatorfrcrange", joint.force_range.data(), 2, 2);
    element.read("springdamper", joint.spring_damper.data(), 2, 2);
    element.read("margin", joint.margin);
    element.read("ref", joint.reference);
    element.read("springref", joint.spring_reference);
    element.read("armature", joint.armature);
    element.read("frictionloss", joint.friction_loss);
    element.read("actuatorgravcomp", joint.gravity_compensated);
    read_polynomial(element, "stiffness", joint.stiffness);
    read_polynomial(element, "damping", joint.damping);
    read_softness(element, "solreflimit", "solimplimit", joint.limit);
    read_softness(element, "solreffriction", "solimpfriction", joint.friction);
}

void read_geom(const XmlElement& element, const Compiler& compiler, Geom& geom) {
    geom.where = element.where();
    element.read("name", geom.name);
    const int type =
        element.word("type", {"plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf"});
    if (type >= 0) geom.type = static_cast<GeomType>(std::min(type, static_cast<int>(GeomType::Mesh)));
    read_vector(element, "pos", geom.position);
    read_orientation(element, compiler, geom.orientation);
    element.read("size", geom.size.data(), 3, 1);
    element.read("fromto", geom.from_to.data(), 6, 6);
    element.read("contype", geom.contype);
    element.read("conaffinity", geom.conaffinity);
    element.read("condim", geom.condim);
    element.read("group", geom.group);
    element.read("priority", geom.priority);
    read_some(element, "friction", geom.friction);
    read_softness(element, "solref", "solimp", geom.softness);
    element.read("margin", geom.margin);
    element.read("gap", geom.gap);
    element.read("mass", geom.mass);
    element.read("density", geom.density);
    element.read("fitscale", geom.fit_scale);
    element.read("adhesion", geom.adhesion);
    read_some(element, "surfacevel", geom.surface_velocity);
    element.read("shellinertia", geom.shell);
    element.read("mesh", geom.mesh);
    element.read("hfield", geom.height_field);
    if (geom.condim != 1 && geom.condim != 3 && geom.condim != 4 && geom.condim != 6)
        element.refuse(fmt::format("condim is to be 1, 3, 4 or 6, not {}", geom.condim));
    if (geom.mass < 0.0 || geom.density < 0.0) element.refuse("its mass or density is negative");
}

void read_site(const XmlElement& element, const Compiler& compiler, Site& site) {
    element.read("name", site.name);
    read_vector(element, "pos", site.position);
    read_orientation(element, compiler, site.orientation);
    element.read("fromto", site.from_to.data(), 6, 6);
}

void read_inertial(const XmlElement& element, const Compiler& compiler, Body& body) {
    body.has_inertial = true;
    MassProperties& own = body.own;
    read_vector(element, "pos", own.centre);
    element.read("mass", own.mass);
    if (own.mass < 0.0) element.refuse(fmt::format("the mass is {}", own.mass));
    Quaterniond turn = Quaterniond::Identity();
    read_orientation(element, compiler, turn);
    if (element.find("fullinertia") == nullptr) body.principal = turn;
    if (Vector3d diagonal; element.read("diaginertia", diagonal.data(), 3, 3) > 0) own.inertia = diagonal.asDiagonal();
    // ixx, iyy, izz, ixy, ixz, iyz
    if (std::array<double, 6> full{}; element.read("fullinertia", full.data(), 6, 6) > 0)
        own.inertia << full[0], full[3], full[4], full[3], full[1], full[5], full[4], full[5], full[2];
    const Matrix3d R = turn.toRotationMatrix();
    own.inertia = (R * own.inertia * R.transpose()).eval();
}

void read_tendon(const XmlElement& element, Tendon& tendon) {
    element.read("name", tendon.name);
    read_switch(element, "limited", tendon.limited);
    element.read("range", tendon.range.data(), 2, 2);
    read_polynomial(element, "stiffness", tendon.stiffness);
    read_polynomial(element, "damping", tendon.damping);
    element.read("frictionloss", tendon.friction_loss);
    element.read("armature", tendon.armature);
}

void read_equality(const XmlElement& element, Equality& equality) {
    equality.where = element.where();
    equality.kind = element.name;
    element.read("name", equality.name);
    element.read("active", equality.active);
    read_softness(element, "solref", "solimp", equality.softness);
    std::array<double, 11>& data = equality.data;
    if (element.name == "connect" || element.name == "weld") {
        equality.type = element.name == "weld" ? EqualityType::Weld : EqualityType::Connect;
        const bool anchored = element.read("anchor", data.data(), 3, 3) > 0;
        if (equality.type == EqualityType::Weld) {
            data[10] = 1.0;
            equality.has_pose = element.read("relpose", data.data() + 3, 7, 7) > 0;
            element.read("torquescale", data[10]);
        }
        if (element.read("site1", equality.first)) {
            equality.by_sites = true;
            if (!element.read("site2", equality.second)) element.refuse("it has a site1 and no site2");
        } else if (element.read("body1", equality.first)) {
            element.read("body2", equality.second);
            if (equality.type == EqualityType::Connect && !anchored) element.refuse("it has no anchor");
        }
    } else if (element.name == "joint") {
        equality.type = EqualityType::Joint;
        element.read("joint1", equality.first);
        element.read("joint2", equality.second);
        data = {0.0, 1.0};
        element.read("polycoef", data.data(), 5, 1);
    }
}

void read_pair(const XmlElement& element, Pair& pair) {
    pair.where = element.where();
    element.read("name", pair.name);
    element.read("geom1", pair.first);
    element.read("geom2", pair.second);
    if (element.read("condim", pair.condim)) pair.has_condim = true;
    if (element.read("friction", pair.friction.data(), 5, 1) > 0) pair.has_friction = true;
    read_softness(element, "solref", "solimp", pair.softness);
    element.read("margin", pair.margin);
    element.read("gap", pair.gap);
}

void read_compiler(const XmlElement& element, Compiler& compiler) {
    if (const int angle = element.word("angle", {"radian", "degree"}); angle >= 0) compiler.degree = angle == 1;
    if (const int kind = element.word("coordinate", {"local", "global"}); kind >= 0) compiler.global = kind == 1;
    element.read("autolimits", compiler.auto_limits);
    element.read("balanceinertia", compiler.balance_inertia);
    element.read("strippath", compiler.strip_path);
    element.read("fitaabb", compiler.fit_aabb);
    element.read("discardvisual", compiler.discard_visual);
    element.read("alignfree", compiler.align_free);
    element.read("exactmeshinertia", compiler.exact_mesh_inertia);
    element.read("boundmass", compiler.bound_mass);
    element.read("boundinertia", compiler.bound_inertia);
    element.read("settotalmass", compiler.total_mass);
    read_switch(element, "inertiafromgeom", compiler.inertia_from_geom);
    if (std::array<double, 2> groups{}; element.read("inertiagrouprange", groups.data(), 2, 2) > 0)
        for (std::size_t k = 0; k < 2; ++k)
            compiler.inertia_groups[k] = static_cast<int>(std::clamp(groups[k], -1e6, 1e6));
    if (element.read("eulerseq", compiler.euler_sequence))
        if (compiler.euler_sequence.size() != 3 ||
            compiler.euler_sequence.find_first_not_of("xyzXYZ") != std::string::npos)
            element.refuse(fmt::format("eulerseq=\"{}\" is to be three letters of xyzXYZ", compiler.euler_sequence));
    if (std::string folder; element.read("assetdir", folder)) compiler.mesh_folder = compiler.texture_folder = folder;
    element.read("meshdir", compiler.mesh_folder);
    element.read("texturedir", compiler.texture_folder);
}

void read_option(const XmlElement& element, Option& option) {
    read_vector(element, "gravity", option.gravity);
    read_vector(element, "wind", option.wind);
    element.read("timestep", option.step);
    if (!(option.step > 0.0)) element.refuse(fmt::format("the timestep is {} s", option.step));
    element.read("density", option.density);
    element.read("viscosity", option.viscosity);
    element.read("collision", option.collision);
    if (const auto groups = element.numbers("actuatorgroupdisable"))
        for (const double group : *groups)
            option.disabled_groups.push_back(static_cast<int>(std::clamp(group, -1.0, 100.0)));
    for (const XmlElement& flag : element.children) {
        if (flag.name != "flag") continue;
        const auto read = [&](const char* name, bool& value) {
            if (const int which = flag.word(name, {"disable", "enable"}); which >= 0) value = which == 1;
        };
        read("contact", option.contact);
        read("constraint", option.constraint);
        read("equality", option.equality);
        read("frictionloss", option.friction_loss);
        read("limit", option.limit);
        if (const int which = flag.word("passive", {"disable", "enable"}); which >= 0)
            option.spring = option.damper = which == 1;
        read("spring", option.spring);
        read("damper", option.damper);
        read("gravity", option.gravity_on);
        read("clampctrl", option.clamp_control);
        read("filterparent", option.filter_parent);
        read("actuation", option.actuation);
    }
}

}  // namespace delassus::importers::mjcf
