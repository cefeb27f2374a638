// SPDX-License-Identifier: BSD-3-Clause
// Geoms of an MJCF model, what their surfaces are like, and which of them touch.
//
// Two geoms touch with friction max(μ₁, μ₂), or with that of the one with the higher priority; without, where the
// contact has the dimension 1. A scene has friction by pairs of materials. So geoms with the same friction, priority
// and dimension share a material, one that an explicit pair names has its own, and every pair of materials gets its
// friction.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "delassus/error.hpp"
#include "importers/mjcf_reader.hpp"

namespace delassus::importers {

using model_import::Form;

namespace {

struct Surface {
    double friction = 0.0;
    int dimension = 3, priority = 0, own = -1;  // own: the geom that has it alone
    auto operator<=>(const Surface&) const = default;
};

std::array<std::int32_t, 2> ordered(std::int32_t a, std::int32_t b) {
    return {std::min(a, b), std::max(a, b)};
}

double friction_between(const Surface& a, const Surface& b) {
    const bool first = a.priority > b.priority, second = b.priority > a.priority;
    const int dimension = first ? a.dimension : second ? b.dimension : std::max(a.dimension, b.dimension);
    const double friction = first ? a.friction : second ? b.friction : std::max(a.friction, b.friction);
    return dimension == 1 ? 0.0 : friction;
}

}  // namespace

void MjcfReader::read_materials() {
    std::set<int> paired;
    for (int k = 0; k < m_.npair; ++k) paired.insert({m_.pair_geom1[k], m_.pair_geom2[k]});
    std::vector<Surface> surfaces;
    model_import::Names names;
    for (int g = 0; g < m_.ngeom; ++g) {
        const Surface own{m_.geom_friction[3 * g], m_.geom_condim[g], m_.geom_priority[g], paired.contains(g) ? g : -1};
        const auto known = std::find(surfaces.begin(), surfaces.end(), own);
        class_[static_cast<std::size_t>(g)] = static_cast<int>(known - surfaces.begin());
        if (known != surfaces.end()) continue;
        surfaces.push_back(own);
        const double friction = own.dimension == 1 ? 0.0 : own.friction;
        const std::string name =
            own.own >= 0 ? "of " + name_of(mjOBJ_GEOM, g) : fmt::format("friction {:.6g}", friction);
        model_.materials.push_back({names.take(name, "surface"), friction, 0.0});
    }
    for (std::size_t a = 0; a < surfaces.size(); ++a)
        for (std::size_t b = a; b < surfaces.size(); ++b)
            model_.material_pairs.push_back({static_cast<std::int32_t>(a), static_cast<std::int32_t>(b),
                                             friction_between(surfaces[a], surfaces[b]), 0.0});
    for (int k = 0; k < m_.npair; ++k) {
        const int a = class_[static_cast<std::size_t>(m_.pair_geom1[k])],
                  b = class_[static_cast<std::size_t>(m_.pair_geom2[k])];
        const double friction = m_.pair_dim[k] == 1 ? 0.0 : m_.pair_friction[5 * k];
        for (auto& pair : model_.material_pairs)
            if (pair.first == std::min(a, b) && pair.second == std::max(a, b)) pair.friction = friction;
        const std::string what = fmt::format("pair of {} and {}", item("geom", mjOBJ_GEOM, m_.pair_geom1[k]),
                                             item("geom", mjOBJ_GEOM, m_.pair_geom2[k]));
        if (m_.pair_dim[k] > 3) model_.lose(what, "spinning and rolling friction");
        if (m_.pair_dim[k] >= 3 && m_.pair_friction[5 * k] != m_.pair_friction[5 * k + 1])
            model_.lose(what, "another friction along the second tangent: the first holds in all directions");
        if (m_.pair_margin[k] != 0.0 || m_.pair_gap[k] != 0.0) model_.lose(what, "margin and gap of the contact");
    }
}

// Whether MuJoCo looks for contacts of two geoms.
bool MjcfReader::touches(int a, int b) const {
    if (disabled(mjDSBL_CONTACT) || disabled(mjDSBL_CONSTRAINT)) return false;
    const int collision = m_.opt.collision;
    if (collision != mjCOL_DYNAMIC)
        for (int k = 0; k < m_.npair; ++k)
            if ((m_.pair_geom1[k] == a && m_.pair_geom2[k] == b) || (m_.pair_geom1[k] == b && m_.pair_geom2[k] == a))
                return true;
    if (collision == mjCOL_PAIR) return false;
    if (((m_.geom_contype[a] & m_.geom_conaffinity[b]) | (m_.geom_contype[b] & m_.geom_conaffinity[a])) == 0)
        return false;
    const int first = m_.geom_bodyid[a], second = m_.geom_bodyid[b];
    const int weld = m_.body_weldid[first], other = m_.body_weldid[second];
    if (weld == other) return false;
    const int above = m_.body_weldid[m_.body_parentid[weld]], above_other = m_.body_weldid[m_.body_parentid[other]];
    if (!disabled(mjDSBL_FILTERPARENT) && weld != 0 && other != 0 && (weld == above_other || other == above))
        return false;
    const int signature = ((std::min(first, second) + 1) << 16) + std::max(first, second) + 1;
    return std::find(m_.exclude_signature, m_.exclude_signature + m_.nexclude, signature) ==
           m_.exclude_signature + m_.nexclude;
}

// A geom that touches nothing is looked at only. It is a shape where its body has none that touches, so that the body
// can be seen; read_touching() keeps such bodies apart from all others.
void MjcfReader::read_shapes() {
    const auto owner = [&](int g) {
        const int body = m_.geom_bodyid[g];
        return static_cast<std::size_t>(moves(body) ? m_.body_weldid[body] : body);
    };
    std::vector<char> meets(static_cast<std::size_t>(m_.ngeom), 0), body_meets(static_cast<std::size_t>(m_.nbody), 0);
    for (int g = 0; g < m_.ngeom; ++g) {
        for (int other = 0; other < m_.ngeom && meets[static_cast<std::size_t>(g)] == 0; ++other)
            if (other != g && touches(g, other)) meets[static_cast<std::size_t>(g)] = body_meets[owner(g)] = 1;
    }
    std::vector<std::string> seen_only;
    for (int g = 0; g < m_.ngeom; ++g) {
        const bool acts = meets[static_cast<std::size_t>(g)] != 0;
        if (!acts) seen_only.push_back(name_of(mjOBJ_GEOM, g));
        if (!acts && body_meets[owner(g)] != 0) continue;
        const std::size_t losses = model_.lost.size();
        read_shape(g);
        if (!acts) model_.lost.resize(losses);
    }
    if (!seen_only.empty())
        model_.without_effect.push_back({"geoms that touch nothing", fmt::format("{}", fmt::join(seen_only, ", "))});
}

void MjcfReader::read_shape(int g) {
    const int body = m_.geom_bodyid[g];
    ModelShape shape;
    shape.name = name_of(mjOBJ_GEOM, g);
    const Quaterniond turn = quaternion_at(data_->xquat, body).normalized();
    shape.orientation = turn * quaternion_at(m_.geom_quat, g).normalized();
    shape.position = vector_at(data_->xpos, body) + turn * vector_at(m_.geom_pos, g);
    shape.material = class_[static_cast<std::size_t>(g)];
    const Vector3d size = vector_at(m_.geom_size, g);
    const std::string what = item("geom", mjOBJ_GEOM, g);
    switch (m_.geom_type[g]) {
        case mjGEOM_PLANE:
            shape.form = Form::Plane;
            break;
        case mjGEOM_SPHERE:
            shape.form = Form::Sphere;
            shape.size.x() = size.x();
            break;
        case mjGEOM_CAPSULE:
        case mjGEOM_CYLINDER:
            shape.form = m_.geom_type[g] == mjGEOM_CAPSULE ? Form::Capsule : Form::Cylinder;
            shape.size = {size.x(), 2.0 * size.y(), 0.0};
            break;
        case mjGEOM_BOX:
            shape.form = Form::Box;
            shape.size = 2.0 * size;
            break;
        case mjGEOM_ELLIPSOID:
            shape = model_import::ellipsoid(model_, std::move(shape), size, what);
            break;
        case mjGEOM_MESH: {
            const int mesh = m_.geom_dataid[g], graph = m_.mesh_graphadr[mesh];
            shape.form = Form::Hull;
            shape.name = name_of(mjOBJ_MESH, mesh);
            const float* vertices = m_.mesh_vert + 3 * m_.mesh_vertadr[mesh];
            const auto vertex = [&](int k) -> Vector3d {
                return Eigen::Map<const Eigen::Vector3f>(vertices + 3 * k).cast<double>();
            };
            if (graph < 0) {
                for (int k = 0; k < m_.mesh_vertnum[mesh]; ++k) shape.points.push_back(vertex(k));
                break;
            }
            // numvert, numface, vert_edgeadr[numvert], vert_globalid[numvert], edge_localid[numvert + 3 numface],
            // face_globalid[3 numface]
            const int* data = m_.mesh_graph + graph;
            const int points = data[0], faces = data[1];
            const int* global = data + 2 + points;
            const int* corner = global + points + points + 3 * faces;
            Vector3d centre = Vector3d::Zero();
            for (int k = 0; k < points; ++k) {
                shape.points.push_back(vertex(global[k]));
                centre += shape.points.back() / points;
            }
            for (int f = 0; f < faces; ++f) {
                std::array<std::int32_t, 3> triangle{};
                for (int k = 0; k < 3; ++k)
                    triangle[static_cast<std::size_t>(k)] =
                        static_cast<std::int32_t>(std::find(global, global + points, corner[3 * f + k]) - global);
                const auto at = [&](std::size_t k) { return shape.points[static_cast<std::size_t>(triangle[k])]; };
                if ((at(1) - at(0)).cross(at(2) - at(0)).dot(at(0) - centre) < 0.0) std::swap(triangle[1], triangle[2]);
                shape.triangles.push_back(triangle);
            }
            break;
        }
        case mjGEOM_HFIELD: {
            const int field = m_.geom_dataid[g];
            const mjtNum* extent = m_.hfield_size + 4 * field;
            shape.form = Form::HeightField;
            shape.name = name_of(mjOBJ_HFIELD, field);
            shape.size = {2.0 * extent[0], 2.0 * extent[1], 0.0};
            shape.rows = m_.hfield_nrow[field];
            shape.columns = m_.hfield_ncol[field];
            // MuJoCo has the row of the least y first.
            for (int row = shape.rows; row-- > 0;)
                for (int column = 0; column < shape.columns; ++column)
                    shape.heights.push_back(
                        extent[2] *
                        static_cast<double>(m_.hfield_data[m_.hfield_adr[field] + row * shape.columns + column]));
            if (moves(body)) {
                model_.lose(what, "a height field on a body that moves: it touches nothing");
                return;
            }
            break;
        }
        default:
            model_.lose(what, "a shape of a kind that scenes have not");
            return;
    }
    note_softness(g);
    is_shape_[static_cast<std::size_t>(g)] = 1;
    model_.bodies[static_cast<std::size_t>(body_[static_cast<std::size_t>(body)])].shapes.push_back(std::move(shape));
}

void MjcfReader::note_softness(int g) {
    const std::string what = item("geom", mjOBJ_GEOM, g);
    if (m_.geom_condim[g] > 3)
        model_.lose(what, m_.geom_condim[g] == 4 ? "spinning friction" : "spinning and rolling friction");
    if (!std::equal(usual_solref.begin(), usual_solref.end(), m_.geom_solref + mjNREF * g) ||
        !std::equal(usual_solimp.begin(), usual_solimp.end(), m_.geom_solimp + mjNIMP * g))
        model_.lose(what, "solref and solimp: contacts are rigid");
    if (m_.geom_margin[g] != 0.0 || m_.geom_gap[g] != 0.0)
        model_.lose(what, "margin and gap: shapes touch where they are");
}

// A body of the scene is a set of bodies of MuJoCo that are welded together, or one that the world holds. Geoms that
// touch nothing are not among its shapes.
void MjcfReader::read_touching() {
    std::vector<std::vector<int>> geoms(static_cast<std::size_t>(m_.nbody));
    for (int g = 0; g < m_.ngeom; ++g) {
        const int body = m_.geom_bodyid[g];
        if (is_shape_[static_cast<std::size_t>(g)] != 0)
            geoms[static_cast<std::size_t>(moves(body) ? m_.body_weldid[body] : body)].push_back(g);
    }
    std::set<std::array<std::int32_t, 2>> joined;  // they never touch
    for (const ModelJoint& joint : model_.joints)
        joined.insert(ordered(joint.parameters.first, joint.parameters.second));
    for (int a = 0; a < m_.nbody; ++a)
        for (int b = a + 1; b < m_.nbody; ++b) {
            if (!moves(a) && !moves(b)) continue;
            std::size_t possible = 0, wanted = 0;
            for (const int first : geoms[static_cast<std::size_t>(a)])
                for (const int second : geoms[static_cast<std::size_t>(b)]) {
                    ++possible;
                    if (touches(first, second)) ++wanted;
                }
            if (possible == wanted) continue;
            const auto own = body_[static_cast<std::size_t>(a)], other = body_[static_cast<std::size_t>(b)];
            if (wanted > 0) {
                model_.lose(
                    fmt::format("contacts of {} and {}", item("body", mjOBJ_BODY, a), item("body", mjOBJ_BODY, b)),
                    fmt::format("only {} of {} pairs of geoms are to touch: here all do", wanted, possible));
            } else if (!joined.contains(ordered(own, other))) {
                model_.apart.push_back({own, other});
            }
        }
}

}  // namespace delassus::importers
