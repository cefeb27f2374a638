// SPDX-License-Identifier: BSD-3-Clause
// Geoms of an MJCF model, what their surfaces are like, and which of them touch.
//
// Two geoms touch with friction max(μ₁, μ₂), or with that of the one with the higher priority; without, where the
// contact has the dimension 1. A scene has friction by pairs of materials, and pairs of materials that never touch. So
// geoms with the same friction, priority, dimension and masks share a material, one that an explicit pair names has its
// own, and every pair of materials gets its friction, or none where the masks do not match. Pairs of bodies of which no
// geoms touch are kept apart. What then remains are bodies that an exclusion names and that others are welded to: their
// geoms get materials by bodies.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "delassus/error.hpp"
#include "importers/mjcf_reader.hpp"

namespace delassus::importers {

using mjcf::GeomType;
using model_import::Form;

namespace {

struct Surface {
    double friction = 0.0;
    int dimension = 3, priority = 0, contype = 1, conaffinity = 1;
    std::int64_t own = -1, body = -1;  // the geom, or the body, that has it alone
    auto operator<=>(const Surface&) const = default;
};

std::array<std::int32_t, 2> ordered(std::int32_t a, std::int32_t b) {
    return {std::min(a, b), std::max(a, b)};
}

double friction_between(const mjcf::Geom& a, const mjcf::Geom& b) {
    const bool first = a.priority > b.priority, second = b.priority > a.priority;
    const int dimension = first ? a.condim : second ? b.condim : std::max(a.condim, b.condim);
    const double friction = first ? a.friction[0] : second ? b.friction[0] : std::max(a.friction[0], b.friction[0]);
    return dimension == 1 ? 0.0 : std::max(0.0, friction);
}

}  // namespace

void MjcfReader::find_pairs() {
    std::map<std::string, std::size_t> number;
    for (std::size_t k = 0; k < geoms_.size(); ++k) number.emplace(geoms_[k]->name, k);
    for (const mjcf::Pair& pair : spec_.pairs) {
        const auto first = number.find(pair.first), second = number.find(pair.second);
        if (first == number.end() || second == number.end()) continue;
        pairs_[std::minmax(first->second, second->second)] = &pair;
    }
    std::map<std::string, std::int32_t> bodies;
    for (std::size_t k = 0; k < spec_.bodies.size(); ++k)
        bodies.emplace(spec_.bodies[k].name, static_cast<std::int32_t>(k));
    for (mjcf::Exclude& exclude : spec_.excludes) {
        const auto first = bodies.find(exclude.first), second = bodies.find(exclude.second);
        if (first == bodies.end() || second == bodies.end()) continue;
        exclude.first_id = std::min(first->second, second->second);
        exclude.second_id = std::max(first->second, second->second);
    }
}

const mjcf::Pair* MjcfReader::pair_of(std::size_t a, std::size_t b) const {
    const auto found = pairs_.find(std::minmax(a, b));
    return found == pairs_.end() ? nullptr : found->second;
}

bool MjcfReader::masks_touch(std::size_t a, std::size_t b) const {
    const mjcf::Geom &first = *geoms_[a], &second = *geoms_[b];
    return ((first.contype & second.conaffinity) | (second.contype & first.conaffinity)) != 0;
}

bool MjcfReader::bodies_touch(std::int32_t first, std::int32_t second) const {
    const std::int32_t weld = body_at(first).weld, other = body_at(second).weld;
    if (weld == other) return false;
    const auto above = [&](std::int32_t body) { return body == 0 ? 0 : body_at(body_at(body).parent).weld; };
    if (spec_.option.filter_parent && weld != 0 && other != 0 && (weld == above(other) || other == above(weld)))
        return false;
    const auto pair = ordered(first, second);
    return std::none_of(spec_.excludes.begin(), spec_.excludes.end(),
                        [&](const mjcf::Exclude& one) { return one.first_id == pair[0] && one.second_id == pair[1]; });
}

bool MjcfReader::touches(std::size_t a, std::size_t b) const {
    const mjcf::Option& option = spec_.option;
    if (!option.contact || !option.constraint) return false;
    const std::int32_t first = geoms_[a]->body, second = geoms_[b]->body;
    if (!moves(first) && !moves(second)) return false;
    if (option.collision != "dynamic" && pair_of(a, b) != nullptr) return true;
    return option.collision != "predefined" && masks_touch(a, b) && bodies_touch(first, second);
}

// A geom that touches nothing is looked at only. It is a shape where its body has none that touches, so that the body
// can be seen; read_touching() keeps such bodies apart from all others.
void MjcfReader::read_shapes() {
    std::vector<char> meets(geoms_.size(), 0), body_meets(spec_.bodies.size(), 0);
    const auto owner_of = [&](std::size_t g) { return static_cast<std::size_t>(owner(geoms_[g]->body)); };
    for (std::size_t g = 0; g < geoms_.size(); ++g)
        for (std::size_t other = 0; other < geoms_.size() && meets[g] == 0; ++other)
            if (other != g && touches(g, other)) meets[g] = body_meets[owner_of(g)] = 1;
    std::vector<std::string> seen_only;
    for (std::size_t g = 0; g < geoms_.size(); ++g) {
        const bool acts = meets[g] != 0;
        if (!acts) seen_only.push_back(geoms_[g]->name);
        if (!acts && body_meets[owner_of(g)] != 0) continue;
        const std::size_t losses = model_.lost.size();
        read_shape(g);
        if (!acts) model_.lost.resize(losses);
    }
    if (!seen_only.empty())
        model_.without_effect.push_back({"geoms that touch nothing", fmt::format("{}", fmt::join(seen_only, ", "))});
}

void MjcfReader::read_shape(std::size_t g) {
    const mjcf::Geom& geom = *geoms_[g];
    const mjcf::Frame at =
        placed_[static_cast<std::size_t>(geom.body)].frame * mjcf::frame_of(geom.position, geom.orientation);
    ModelShape shape;
    shape.name = geom.name;
    shape.orientation = Quaterniond(at.linear()).normalized();
    shape.position = at.translation();
    const Vector3d& size = geom.size;
    const std::string what = fmt::format("geom \"{}\"", geom.name);
    switch (geom.type) {
        case GeomType::Plane:
            if (moves(geom.body)) return model_.lose(what, "a plane on a body that moves: it touches nothing");
            shape.form = Form::Plane;
            break;
        case GeomType::Sphere:
            shape.form = Form::Sphere;
            shape.size.x() = size.x();
            break;
        case GeomType::Capsule:
        case GeomType::Cylinder:
            shape.form = geom.type == GeomType::Capsule ? Form::Capsule : Form::Cylinder;
            shape.size = {size.x(), 2.0 * size.y(), 0.0};
            break;
        case GeomType::Box:
            shape.form = Form::Box;
            shape.size = 2.0 * size;
            break;
        case GeomType::Ellipsoid:
            shape = model_import::ellipsoid(model_, std::move(shape), size, what);
            break;
        case GeomType::Mesh: {
            const mjcf::Mesh& mesh = *geom.of_mesh;
            const mjcf::Mesh::Hull& hull = mesh.hull();
            if (hull.points.empty())
                return model_.lose(what, fmt::format("its mesh \"{}\" is of no use: {}", mesh.name,
                                                     mesh.points.empty() ? mesh.trouble : hull.trouble));
            shape.form = Form::Hull;
            shape.name = mesh.name;
            shape.points = hull.points;
            shape.triangles = hull.triangles;
            break;
        }
        case GeomType::HeightField: {
            const auto field =
                std::find_if(spec_.height_fields.begin(), spec_.height_fields.end(),
                             [&](const mjcf::HeightField& one) { return one.name == geom.height_field; });
            if (field == spec_.height_fields.end() || !field->trouble.empty())
                return model_.lose(
                    what, fmt::format("its height field is of no use: {}",
                                      field == spec_.height_fields.end() ? "it is not there" : field->trouble));
            if (moves(geom.body)) return model_.lose(what, "a height field on a body that moves: it touches nothing");
            shape.form = Form::HeightField;
            shape.name = field->name;
            shape.size = {2.0 * field->size[0], 2.0 * field->size[1], 0.0};
            shape.rows = field->rows;
            shape.columns = field->columns;
            // MuJoCo has the row of the least y first.
            for (std::int32_t row = shape.rows; row-- > 0;)
                for (std::int32_t column = 0; column < shape.columns; ++column)
                    shape.heights.push_back(field->size[2] *
                                            field->heights[static_cast<std::size_t>(row * shape.columns + column)]);
            break;
        }
    }
    note_softness(geom);
    is_shape_[g] = 1;
    shape.material = static_cast<std::int32_t>(g);  // until read_materials()
    model_.bodies[static_cast<std::size_t>(body_[static_cast<std::size_t>(geom.body)])].shapes.push_back(
        std::move(shape));
}

void MjcfReader::note_softness(const mjcf::Geom& geom) {
    const std::string what = fmt::format("geom \"{}\"", geom.name);
    if (geom.condim > 3) model_.lose(what, geom.condim == 4 ? "spinning friction" : "spinning and rolling friction");
    if (!geom.softness.is_usual()) model_.lose(what, "solref and solimp: contacts are rigid");
    if (geom.margin != 0.0 || geom.gap != 0.0) model_.lose(what, "margin and gap: shapes touch where they are");
    if (geom.adhesion != 0.0) model_.lose(what, "adhesion");
    if (std::any_of(geom.surface_velocity.begin(), geom.surface_velocity.end(), [](double v) { return v != 0.0; }))
        model_.lose(what, "a surface that moves along itself (surfacevel)");
}

// A body of the scene is a set of bodies of MuJoCo that are welded together, or one that the world holds. Geoms that
// touch nothing are not among its shapes.
void MjcfReader::read_touching() {
    std::map<std::int32_t, std::vector<std::size_t>> geoms;  // by owners
    for (std::size_t g = 0; g < geoms_.size(); ++g)
        if (is_shape_[g] != 0) geoms[owner(geoms_[g]->body)].push_back(g);
    std::set<std::array<std::int32_t, 2>> joined;  // they never touch
    for (const ModelJoint& joint : model_.joints)
        joined.insert(ordered(joint.parameters.first, joint.parameters.second));
    for (auto a = geoms.begin(); a != geoms.end(); ++a)
        for (auto b = std::next(a); b != geoms.end(); ++b) {
            if (!moves(a->first) && !moves(b->first)) continue;
            const bool any = std::any_of(a->second.begin(), a->second.end(), [&](std::size_t first) {
                return std::any_of(b->second.begin(), b->second.end(),
                                   [&](std::size_t second) { return touches(first, second); });
            });
            const auto own = body_[static_cast<std::size_t>(a->first)],
                       other = body_[static_cast<std::size_t>(b->first)];
            if (!any && !joined.contains(ordered(own, other))) model_.apart.push_back({own, other});
            if (any && joined.contains(ordered(own, other)))
                model_.lose(
                    fmt::format("contacts of bodies \"{}\" and \"{}\"", body_at(a->first).name, body_at(b->first).name),
                    "bodies with a joint between them never touch in a scene");
        }
}

void MjcfReader::read_materials() {
    std::set<std::size_t> paired;
    for (const auto& [geoms, pair] : pairs_) paired.insert({geoms.first, geoms.second});
    std::set<std::array<std::int32_t, 2>> never;
    for (const auto& pair : model_.apart) never.insert(ordered(pair[0], pair[1]));
    for (const ModelJoint& joint : model_.joints)
        never.insert(ordered(joint.parameters.first, joint.parameters.second));
    std::vector<std::size_t> shapes;
    for (std::size_t g = 0; g < geoms_.size(); ++g)
        if (is_shape_[g] != 0) shapes.push_back(g);
    // Whether the materials of two geoms decide if these touch.
    const auto decides = [&](std::size_t a, std::size_t b) {
        const std::int32_t first = owner(geoms_[a]->body), second = owner(geoms_[b]->body);
        if (first == second || (!moves(first) && !moves(second))) return false;
        return !never.contains(
            ordered(body_[static_cast<std::size_t>(first)], body_[static_cast<std::size_t>(second)]));
    };
    std::vector<Surface> surfaces;
    std::vector<std::int64_t> alone(geoms_.size(), -1);  // bodies whose geoms have materials of their own
    std::vector<std::vector<int>> verdict;               // of pairs: bit 0: some touch, bit 1: some do not
    for (int round = 0; round < 2; ++round) {
        surfaces.clear();
        for (const std::size_t g : shapes) {
            const mjcf::Geom& geom = *geoms_[g];
            const Surface own{geom.friction[0], geom.condim,
                              geom.priority,    geom.contype,
                              geom.conaffinity, paired.contains(g) ? static_cast<std::int64_t>(g) : -1,
                              alone[g]};
            const auto known = std::find(surfaces.begin(), surfaces.end(), own);
            class_[g] = static_cast<int>(known - surfaces.begin());
            if (known == surfaces.end()) surfaces.push_back(own);
        }
        verdict.assign(surfaces.size(), std::vector<int>(surfaces.size(), 0));
        for (std::size_t i = 0; i < shapes.size(); ++i)
            for (std::size_t j = i + 1; j < shapes.size(); ++j) {
                if (!decides(shapes[i], shapes[j])) continue;
                const auto a = static_cast<std::size_t>(class_[shapes[i]]),
                           b = static_cast<std::size_t>(class_[shapes[j]]);
                const int bit = touches(shapes[i], shapes[j]) ? 1 : 2;
                verdict[a][b] |= bit;
                verdict[b][a] |= bit;
            }
        bool mixed = false;
        for (const std::size_t g : shapes) {
            const auto& row = verdict[static_cast<std::size_t>(class_[g])];
            if (std::find(row.begin(), row.end(), 3) == row.end()) continue;
            alone[g] = geoms_[g]->body;
            mixed = true;
        }
        if (!mixed) break;
    }
    model_import::Names names;
    std::vector<std::size_t> one_of(surfaces.size(), 0);
    for (const std::size_t g : shapes) one_of[static_cast<std::size_t>(class_[g])] = g;
    for (std::size_t k = 0; k < surfaces.size(); ++k) {
        const Surface& own = surfaces[k];
        const double friction = own.dimension == 1 ? 0.0 : std::max(0.0, own.friction);
        const std::string name = own.own >= 0 ? "of " + geoms_[static_cast<std::size_t>(own.own)]->name
                                              : fmt::format("friction {:.6g}", friction);
        model_.materials.push_back({names.take(name, "surface"), friction, 0.0});
    }
    for (std::size_t a = 0; a < surfaces.size(); ++a)
        for (std::size_t b = a; b < surfaces.size(); ++b) {
            const mjcf::Pair* pair =
                surfaces[a].own >= 0 && surfaces[b].own >= 0 ? pair_of(one_of[a], one_of[b]) : nullptr;
            double friction = friction_between(*geoms_[one_of[a]], *geoms_[one_of[b]]);
            if (pair != nullptr && (pair->has_friction || pair->has_condim)) {
                const double given = pair->has_friction ? pair->friction[0] : friction;
                friction = pair->condim == 1 ? 0.0 : std::max(0.0, given);
            }
            model_.material_pairs.push_back(
                {static_cast<std::int32_t>(a), static_cast<std::int32_t>(b), friction, 0.0, verdict[a][b] != 2});
        }
    for (const auto& [geoms, pair] : pairs_) {
        const std::string what = fmt::format("pair of geom \"{}\" and geom \"{}\"", pair->first, pair->second);
        if (pair->has_condim && pair->condim > 3) model_.lose(what, "spinning and rolling friction");
        if (pair->has_friction && pair->condim >= 3 && pair->friction[0] != pair->friction[1])
            model_.lose(what, "another friction along the second tangent: the first holds in all directions");
        if (pair->margin != 0.0 || pair->gap != 0.0) model_.lose(what, "margin and gap of the contact");
        if (!pair->softness.is_usual()) model_.lose(what, "solref and solimp: contacts are rigid");
    }
    for (ModelBody& body : model_.bodies)
        for (ModelShape& shape : body.shapes)
            if (shape.material >= 0) shape.material = class_[static_cast<std::size_t>(shape.material)];
}

}  // namespace delassus::importers
