// SPDX-License-Identifier: BSD-3-Clause
// Masses of geoms and bodies as MuJoCo's compiler has them.
//
// Solid shapes have the moments of textbooks, with halves a, b, c as sizes: m (b² + c²)/3 of a box, m (b² + c²)/5 of an
// ellipsoid, m (3 r² + l²)/12 and m r²/2 of a cylinder of length l. A capsule is a cylinder with two half balls, whose
// centres of mass are 3/8 r beyond its ends. Shells (shellinertia) have their mass in their surface. That of an
// ellipsoid is a thin one between it and one with radii longer by the same: m (…)/5 differentiated, as MuJoCo takes it.
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "delassus/error.hpp"
#include "importers/mjcf_spec.hpp"

namespace delassus::importers::mjcf {

namespace {

constexpr double least = 1e-14;  // kg or m³: what MuJoCo takes for nothing
constexpr double pi = std::numbers::pi;

/// V (or the area of a shell), and the moments of a mass of one.
struct Shape {
    double volume = 0.0;
    Vector3d moments = Vector3d::Zero();
};

Shape solid(GeomType type, const Vector3d& s) {
    const double r = s.x(), l = 2.0 * s.y();
    const Vector3d squares(s.y() * s.y() + s.z() * s.z(), s.x() * s.x() + s.z() * s.z(), s.x() * s.x() + s.y() * s.y());
    switch (type) {
        case GeomType::Sphere:
            return {4.0 * pi * r * r * r / 3.0, Vector3d::Constant(0.4 * r * r)};
        case GeomType::Ellipsoid:
            return {4.0 * pi * s.prod() / 3.0, squares / 5.0};
        case GeomType::Box:
            return {8.0 * s.prod(), squares / 3.0};
        case GeomType::Cylinder: {
            const double across = (3.0 * r * r + l * l) / 12.0;
            return {pi * r * r * l, Vector3d(across, across, 0.5 * r * r)};
        }
        case GeomType::Capsule: {
            const double balls = 4.0 * r / (4.0 * r + 3.0 * l), straight = 1.0 - balls;
            const double across =
                straight * (3.0 * r * r + l * l) / 12.0 + balls * (0.4 * r * r + l * (3.0 * r + 2.0 * l) / 8.0);
            return {pi * (r * r * l + 4.0 * r * r * r / 3.0),
                    Vector3d(across, across, straight * 0.5 * r * r + balls * 0.4 * r * r)};
        }
        default:
            return {};
    }
}

Shape shell(GeomType type, const Vector3d& s) {
    const double r = s.x(), l = 2.0 * s.y();
    switch (type) {
        case GeomType::Sphere:
            return {4.0 * pi * r * r, Vector3d::Constant(2.0 * r * r / 3.0)};
        case GeomType::Ellipsoid: {
            constexpr double p = 1.6075;  // Thomsen's formula for the area
            const double sum = std::pow(s.x() * s.y(), p) + std::pow(s.y() * s.z(), p) + std::pow(s.z() * s.x(), p);
            constexpr double by = 1e-6;
            const Shape inner = solid(type, s), outer = solid(type, s + Vector3d::Constant(by));
            return {4.0 * pi * std::pow(sum / 3.0, 1.0 / p),
                    (outer.volume * outer.moments - inner.volume * inner.moments) / (outer.volume - inner.volume)};
        }
        case GeomType::Box: {
            const Vector3d full = 2.0 * s;
            Shape result;
            for (int k = 0; k < 3; ++k) {  // two sides normal to axis k
                const int i = (k + 1) % 3, j = (k + 2) % 3;
                const double area = full[i] * full[j];
                result.volume += 2.0 * area;
                result.moments[i] += 2.0 * area * (full[j] * full[j] / 12.0 + s[k] * s[k]);
                result.moments[j] += 2.0 * area * (full[i] * full[i] / 12.0 + s[k] * s[k]);
                result.moments[k] += 2.0 * area * (full[i] * full[i] + full[j] * full[j]) / 12.0;
            }
            if (result.volume > 0.0) result.moments /= result.volume;
            return result;
        }
        case GeomType::Cylinder: {
            const double disk = pi * r * r, side = 2.0 * pi * r * l, all = 2.0 * disk + side;
            const double across = (side * (6.0 * r * r + l * l) / 12.0 + 2.0 * disk * (r * r + l * l) / 4.0) / all;
            return {all, Vector3d(across, across, (side * r * r + disk * r * r) / all)};
        }
        case GeomType::Capsule: {
            const double balls = 4.0 * pi * r * r, side = 2.0 * pi * r * l, all = balls + side;
            const double beyond = 0.5 * l + 0.5 * r;  // of the centre of half a hollow ball
            const double across =
                (side * (6.0 * r * r + l * l) / 12.0 + balls * (2.0 * r * r / 3.0 + beyond * beyond - 0.25 * r * r)) /
                all;
            return {all, Vector3d(across, across, (side * r * r + balls * 2.0 * r * r / 3.0) / all)};
        }
        default:
            return {};
    }
}

/// In the geom's frame.
MassProperties mass_of(const Geom& geom) {
    MassProperties result;
    if (geom.of_mesh && geom.type == GeomType::Mesh) {
        const MassProperties& unit = geom.of_mesh->unit;
        if (!geom.of_mesh->trouble.empty() || !(unit.mass > least)) return result;
        result = unit;
        result.mass = std::isnan(geom.mass) ? geom.density * unit.mass : geom.mass;
        result.inertia *= result.mass / unit.mass;
        return result;
    }
    const Shape shape = geom.shell ? shell(geom.type, geom.size) : solid(geom.type, geom.size);
    if (!std::isnan(geom.mass) && !(shape.volume > least)) return result;
    result.mass = std::isnan(geom.mass) ? geom.density * shape.volume : geom.mass;
    result.inertia = (result.mass * shape.moments).asDiagonal();
    return result;
}

/// Of a geom that is a primitive of a mesh: as large as its box of equal inertia, or as its bounding box in its
/// principal axes.
void fit(Geom& geom, const Compiler& compiler) {
    const Mesh& mesh = *geom.of_mesh;
    const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(mesh.unit.inertia);
    Matrix3d axes = solver.eigenvectors().rowwise().reverse();  // the largest moment first
    if (axes.determinant() < 0.0) axes.col(2) *= -1.0;
    const Vector3d moments = solver.eigenvalues().reverse();
    Vector3d box, centre = Vector3d::Zero();
    const auto halves = [&](int k) {
        const double twice = moments.sum() - 2.0 * moments[k];
        return 0.5 * std::sqrt(std::max(0.0, 6.0 * twice / mesh.unit.mass));
    };
    for (int k = 0; k < 3; ++k) box[k] = halves(k);
    if (compiler.fit_aabb) {
        Eigen::AlignedBox3d bounds;
        for (const Vector3d& point : mesh.points) bounds.extend(axes.transpose() * (point - mesh.unit.centre));
        centre = bounds.center();
        box = 0.5 * bounds.sizes();
    }
    Vector3d& size = geom.size;
    const bool capsule = geom.type == GeomType::Capsule;
    if (geom.type == GeomType::Sphere) {
        size.x() = compiler.fit_aabb ? box.maxCoeff() : box.mean();
    } else if (capsule || geom.type == GeomType::Cylinder) {
        size.x() = compiler.fit_aabb ? std::max(box.x(), box.y()) : 0.5 * (box.x() + box.y());
        size.y() = box.z();
        if (capsule) size.y() = compiler.fit_aabb ? size.y() - size.x() : std::max(0.0, size.y() - 0.5 * size.x());
    } else {
        size = box;
    }
    size *= geom.fit_scale;
    const Frame at =
        frame_of(geom.position, geom.orientation) * frame_of(mesh.unit.centre + axes * centre, Quaterniond(axes));
    geom.position = at.translation();
    geom.orientation = Quaterniond(at.linear()).normalized();
}

/// With its principal moments by f.
template <class F>
Matrix3d with_moments(const Matrix3d& inertia, F&& f) {
    const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(inertia);
    const Matrix3d& axes = solver.eigenvectors();
    return axes * f(Vector3d(solver.eigenvalues())).asDiagonal() * axes.transpose();
}

void weigh(Body& body, const Compiler& compiler, model_import::Model& model) {
    const bool wanted =
        compiler.inertia_from_geom == Switch::On || (compiler.inertia_from_geom == Switch::Auto && !body.has_inertial);
    std::vector<MassProperties> parts;
    const Geom* last = nullptr;
    for (const Geom& geom : body.geoms) {
        if (geom.group < compiler.inertia_groups[0] || geom.group > compiler.inertia_groups[1]) continue;
        const bool known = !geom.of_mesh || geom.of_mesh->trouble.empty();
        if (wanted && !known && (std::isnan(geom.mass) ? geom.density > 0.0 : geom.mass > 0.0)) {
            const std::string what = fmt::format("geom \"{}\"", geom.name.empty() ? body.name : geom.name);
            if (std::isnan(geom.mass)) {
                model.lose(what, fmt::format("its mass: its mesh \"{}\" is of no use: {}", geom.of_mesh->name,
                                             geom.of_mesh->trouble));
                continue;
            }
            model.lose(what, fmt::format("its mass is one point: its mesh \"{}\" is of no use: {}", geom.of_mesh->name,
                                         geom.of_mesh->trouble));
            parts.push_back({geom.mass, geom.position, Matrix3d::Zero()});
            continue;
        }
        if (!(geom.own.mass > least)) continue;
        parts.push_back(moved(geom.own, frame_of(geom.position, geom.orientation)));
        last = &geom;
    }
    if (wanted && !parts.empty()) {
        body.own = sum_of(parts);
        body.principal.reset();
        if (parts.size() == 1 && last != nullptr && !last->of_mesh) body.principal = last->orientation;
    }
    body.own.mass = std::max(body.own.mass, compiler.bound_mass);
    if (compiler.bound_inertia > 0.0)
        body.own.inertia = with_moments(body.own.inertia, [&](const Vector3d& moments) {
            return Vector3d(moments.cwiseMax(compiler.bound_inertia));
        });
    if (!compiler.balance_inertia) return;
    body.own.inertia = with_moments(body.own.inertia, [](const Vector3d& moments) {
        const bool possible = moments[0] + moments[1] >= moments[2] * (1.0 - 1e-12);
        return possible ? moments : Vector3d(Vector3d::Constant(moments.mean()));
    });
}

/// Mass, geoms and sites of a body from its frame to another one.
void move_parts(Body& body, const Frame& to) {
    const Quaterniond turn(to.linear());
    body.own = moved(body.own, to);
    for (Geom& geom : body.geoms) {
        geom.position = to * geom.position;
        geom.orientation = (turn * geom.orientation).normalized();
    }
    for (Site& site : body.sites) {
        site.position = to * site.position;
        site.orientation = (turn * site.orientation).normalized();
    }
}

/// Everything that a model with global coordinates has in the world's frame becomes the body's own. world: of bodies.
void localise(Body& body, const Frame& parent, Frame& own) {
    if (!body.placed && body.has_inertial) {
        body.position = body.own.centre;
    } else if (!body.placed && !body.geoms.empty()) {
        std::vector<MassProperties> parts;
        for (const Geom& geom : body.geoms)
            if (geom.own.mass > least) parts.push_back(moved(geom.own, frame_of(geom.position, geom.orientation)));
        if (!parts.empty()) body.position = sum_of(parts).centre;
    }
    own = frame_of(body.position, body.orientation);
    const Frame back = own.inverse();
    move_parts(body, back);
    for (Joint& joint : body.joints) {
        joint.position = back * joint.position;
        joint.axis = back.linear() * joint.axis;
    }
    const Frame local = parent.inverse() * own;
    body.position = local.translation();
    body.orientation = Quaterniond(local.linear()).normalized();
}

/// The frame of a body that moves freely becomes that of its inertia.
void align(Body& body) {
    Quaterniond turn = Quaterniond::Identity();
    if (body.principal) {
        turn = *body.principal;
    } else {
        const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(body.own.inertia);
        Matrix3d axes = solver.eigenvectors().rowwise().reverse();
        if (axes.determinant() < 0.0) axes.col(2) *= -1.0;
        turn = Quaterniond(axes).normalized();
    }
    const Frame inertial = frame_of(body.own.centre, turn), back = inertial.inverse();
    const Frame own = frame_of(body.position, body.orientation) * inertial;
    body.position = own.translation();
    body.orientation = Quaterniond(own.linear()).normalized();
    move_parts(body, back);
}

void finish_joint(Joint& joint, const Compiler& compiler, model_import::Model& model) {
    const std::string what = fmt::format("joint \"{}\"", joint.name);
    const bool turns = joint.type == JointType::Hinge || joint.type == JointType::Ball;
    joint.is_limited =
        joint.type != JointType::Free && limits(joint.limited, "range", joint.range, compiler, what, model);
    joint.is_force_limited = freedoms_of(joint.type) == 1 &&
                             limits(joint.force_limited, "actuatorfrcrange", joint.force_range, compiler, what, model);
    if (compiler.degree && turns)
        for (double& end : joint.range) end *= pi / 180.0;
    if (compiler.degree && joint.type == JointType::Hinge) {
        joint.reference *= pi / 180.0;
        joint.spring_reference *= pi / 180.0;
    }
    if (joint.type == JointType::Free || joint.type == JointType::Ball) joint.axis = Vector3d::UnitZ();
    if (!(joint.axis.norm() >= least))
        throw InputError(fmt::format("{}: the axis of {} has no direction", joint.where, what));
    joint.axis.normalize();
    if (joint.type == JointType::Free) joint.position.setZero();
}

}  // namespace

bool limits(Switch given, const char* attribute, const std::array<double, 2>& range, const Compiler& compiler,
            const std::string& what, model_import::Model& model) {
    if (given == Switch::Off || (given == Switch::Auto && !compiler.auto_limits)) return false;
    if (range[0] < range[1]) return true;
    if (given == Switch::On || range[0] > range[1])
        model.lose(what, fmt::format("{} {:.6g} {:.6g}, whose ends are not in their order: it limits nothing",
                                     attribute, range[0], range[1]));
    return false;
}

MassProperties moved(const MassProperties& of, const Frame& frame) {
    return {of.mass, frame * of.centre, frame.linear() * of.inertia * frame.linear().transpose()};
}

MassProperties sum_of(const std::vector<MassProperties>& parts) {
    MassProperties result;
    for (const MassProperties& part : parts) {
        result.mass += part.mass;
        result.centre += part.mass * part.centre;
    }
    if (result.mass > 0.0) result.centre /= result.mass;
    for (const MassProperties& part : parts) {
        const Vector3d d = part.centre - result.centre;
        result.inertia += part.inertia;
        if (part.mass > 0.0) result.inertia += part.mass * (d.squaredNorm() * Matrix3d::Identity() - d * d.transpose());
    }
    return result;
}

void complete(Geom& geom, const XmlElement& element, const Compiler& compiler) {
    if (!std::isnan(geom.from_to[0])) {
        const Vector3d from(geom.from_to.data()), to(geom.from_to.data() + 3), way = from - to;
        const bool round = geom.type == GeomType::Capsule || geom.type == GeomType::Cylinder;
        if (!round && geom.type != GeomType::Box && geom.type != GeomType::Ellipsoid)
            element.refuse("only capsules, cylinders, boxes and ellipsoids have a fromto");
        if (!(way.norm() >= least)) element.refuse("the ends of its fromto are in one point");
        geom.size = round ? Vector3d(geom.size.x(), 0.5 * way.norm(), 0.0)
                          : Vector3d(geom.size.x(), geom.size.x(), 0.5 * way.norm());
        geom.position = 0.5 * (from + to);
        geom.orientation = z_towards(way);
    } else if (geom.of_mesh && geom.type != GeomType::Mesh && geom.of_mesh->trouble.empty()) {
        fit(geom, compiler);
    }
    geom.own = mass_of(geom);
}

void finish(Spec& spec, model_import::Model& model) {
    std::vector<Frame> world(spec.bodies.size(), Frame::Identity());
    double total = 0.0;
    for (std::size_t k = 0; k < spec.bodies.size(); ++k) {
        Body& body = spec.bodies[k];
        const Compiler& compiler = spec.compilers[body.compiler];
        if (k > 0) {
            const Frame& parent = world[static_cast<std::size_t>(body.parent)];
            spec.bodies[static_cast<std::size_t>(body.parent)].has_children = true;
            if (body.global)
                localise(body, parent, world[k]);
            else
                world[k] = parent * frame_of(body.position, body.orientation);
            weigh(body, compiler, model);
            total += body.own.mass;
            const bool moves = !body.joints.empty() || body.mocap;
            body.weld = moves ? static_cast<std::int32_t>(k) : spec.bodies[static_cast<std::size_t>(body.parent)].weld;
        }
        int freedoms = 0;
        for (Joint& joint : body.joints) {
            finish_joint(joint, compiler, model);
            joint.body = static_cast<std::int32_t>(k);
            joint.coordinate = spec.coordinates;
            joint.freedom = spec.freedoms;
            spec.coordinates += coordinates_of(joint.type);
            spec.freedoms += freedoms_of(joint.type);
            freedoms += freedoms_of(joint.type);
            const bool free = joint.type == JointType::Free;
            if (free && body.joints.size() > 1)
                throw InputError(
                    fmt::format("{}: the body \"{}\" has a free joint and others", joint.where, body.name));
            if (free && body.parent != 0)
                throw InputError(fmt::format("{}: the body \"{}\" has a free joint and is no child of the world",
                                             joint.where, body.name));
        }
        if (freedoms > 6)
            throw InputError(fmt::format("{}: the body \"{}\" has more than 6 freedoms", body.where, body.name));
        for (Geom& geom : body.geoms) geom.body = static_cast<std::int32_t>(k);
        for (Site& site : body.sites) site.body = static_cast<std::int32_t>(k);
        spec.mocaps += body.mocap ? 1 : 0;
    }
    for (Body& body : spec.bodies) {
        if (body.joints.size() != 1 || body.joints[0].type != JointType::Free || body.has_children) continue;
        const Switch wanted = body.joints[0].align;
        if (wanted == Switch::On || (wanted == Switch::Auto && spec.compilers[body.compiler].align_free)) align(body);
    }
    const double wanted = spec.compilers.front().total_mass;
    if (wanted > 0.0 && total > 0.0)
        for (Body& body : spec.bodies) {
            body.own.mass *= wanted / total;
            body.own.inertia *= wanted / total;
        }
}

}  // namespace delassus::importers::mjcf
