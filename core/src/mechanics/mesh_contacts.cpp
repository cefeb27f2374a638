// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/mesh_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace delassus::mechanics {

// ---- What touches between two meshes ----
//
// A surface that touches has a layer of the thickness r about it (its radius), so that two surfaces touch at the
// distance R = r_a + r_b and every contact has a direction: that of the shortest way between two features. As with
// terrain (collision/terrain_contacts.cpp), only local minima of the distance become contacts:
//
//   vertex over triangle   along the triangle's normal, the foot inside it
//   vertex over ridge      along the shortest way n, where n lies in the cone of the ridge (n · t ≤ 0 for both
//                          directions t from the ridge into its triangles; about a vertex n · e ≤ 0 for its edges e)
//   edge across edge       along their common normal, where it lies in the cones of both; one of them at least is sharp
//
// in two passes, the vertices of each over the other. The cone of a flat or hollow edge holds no leaning direction, so
// a node that slides over the borders of triangles is not caught there. Both sides have a cone: where the ridge is
// sharp, −n must lie in that of the vertex too. Without this test a corner that bulges over the rim of its support
// would be pushed outward by the rim, though what rests there is the rim under the face: its vertices, and its
// crossings with the edges of the face. That test alone would be too strict where faces are pressed together and are
// not quite flat any more: which of two rims one over the other touches is then a matter of rounding, and a node that
// is let go for one step springs up by its share of the compression. So a face goes on beyond its rim by R/2 for what
// faces it, with its own normal, and with the gap of the distance to the rim.
//
// Why nodes over triangles in two passes, and not an integral over the surfaces (mortar): a contact bounds the gap
// where it is, so that corners and rims hold as well as faces, and each is a point with a cone of its own. The price is
// the patch test: uniform pressure needs nodal impulses that the contacts can give. With linear sides they can, to the
// last digit, where the diagonals of both faces run alike, and to 3 % where they cross. With quadratic sides the corner
// nodes take no part of a uniform pressure (∫N = 0), and nodes alone can give it to 10 % only (2 cells against 3). With
// the middle of each side as one more point it is 0.5 to 2 %, and with three points of integration in each side in
// place of its middle it would be exact, for twice as many contacts. docs/finite-elements.md has the stress.
//
// Nodes that meet nodes (matching meshes) would be two contacts, one of each pass: one of them is left out. Where all
// the middles of a side's edges meet nodes, the middle of the side adds nothing and is left out as well.
//
// A contact acts on the surface where it is: on a quadratic side by its shape functions, of which those of corners are
// negative in its middle. So the work of a contact is that of the gap that it bounds.
//
// What is fast is looked for on its way, as bodies are (collision/swept_pair.hpp): each feature is moved with the
// velocities of the beginning and the weight until the gap closes. The points of that place are carried
// back, and the gap is what they have to go along the normal of the meeting.
//
// That foresees no elastic forces, and those of a node that has just been let go move it far in a step: its share of
// the compression, whatever the step. So the envelope is as wide as the layers are thick unless a scene says otherwise.

namespace {

constexpr double inside_tolerance = 1e-6;  // barycentric: rims that coincide but for rounding
constexpr double rounding_angle = 1e-9;
constexpr double flat_angle = 1e-5;     // directions this near to a face's normal are of the face
constexpr double edge_angle = 0.05;     // likewise of crossing edges: faces that are pressed together are not flat
constexpr double same_crossing = 0.02;  // share of an edge: crossings this near to a vertex are at it
constexpr double same_angle = 0.05;     // contacts of one vertex that differ by less are one
constexpr double same_vertex = 1e-3;    // barycentric: a foot this near to a vertex is there
constexpr double facing_cosine = 0.05;
constexpr double parallel_sine = 1e-2;
constexpr double rim_share = 0.5;     // of the sum of the radii: how far a face goes on beyond its rim
constexpr double rim_angle = 0.1;     // for what faces it up to this angle
constexpr double depth_share = 0.25;  // of an edge: how far behind a surface a vertex is still pushed out

constexpr std::uint64_t ridge_flag = 0x800, patch_bits = 0x7ff;

Vector3d barycentric(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& p) {
    const Vector3d to_b = b - a, to_c = c - a, normal = to_b.cross(to_c);
    const double scale = 1.0 / normal.squaredNorm();
    const double l_b = (p - a).cross(to_c).dot(normal) * scale, l_c = to_b.cross(p - a).dot(normal) * scale;
    return {1.0 - l_b - l_c, l_b, l_c};
}

Box3d around(const Vector3d& from, const Vector3d& way, double more) {
    Box3d box(from);
    box.extend(Vector3d(from + way));
    box.min().array() -= more;
    box.max().array() += more;
    return box;
}

Box3d enlarged(Box3d box, double more) {
    box.min().array() -= more;
    box.max().array() += more;
    return box;
}

void sort_unique(std::vector<std::int32_t>& numbers) {
    std::sort(numbers.begin(), numbers.end());
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
}

struct GapAndRate {
    double gap = 0.0, rate = 0.0;
};

}  // namespace

void MeshContacts::add(std::span<const ElementSide> sides, const std::vector<Vector3d>& position, double radius,
                       std::int32_t material) {
    Surface one{MeshSurface(sides, position), radius, material};
    if (!surfaces_.empty()) {
        const Surface& last = surfaces_.back();
        one.first_edge = last.first_edge + static_cast<std::int32_t>(last.surface.edges().size());
        one.first_side = last.first_side + static_cast<std::int32_t>(last.surface.sides().size());
    }
    surfaces_.push_back(std::move(one));
}

void MeshContacts::find(std::span<const Vector3d> x, std::span<const Vector3d> way, double envelope,
                        std::vector<MeshContact>& contacts) {
    contacts.clear();
    for (Surface& one : surfaces_) one.surface.place(x, way);
    find_near_pairs(envelope);
    has_normals_.assign(surfaces_.size(), 0);
    for (const auto& [a, b] : pairs_) {
        for (const auto one : {a, b}) {
            if (has_normals_[to_index(one)]) continue;
            surfaces_[to_index(one)].surface.find_normals();
            has_normals_[to_index(one)] = 1;
        }
        touch(a, b, envelope, contacts);
    }
    std::sort(contacts.begin(), contacts.end(), [](const MeshContact& a, const MeshContact& b) {
        const auto key = [](const MeshContact& one) {
            const bool vertex = one.kind == MeshContact::Kind::Vertex;
            return std::tuple(!vertex, vertex ? one.a.nodes[0] : one.surface_a, one.surface_b, one.kind, one.feature);
        };
        return key(a) < key(b);
    });
}

// Sorted by their least x, boxes are compared with those that begin before they end.
void MeshContacts::find_near_pairs(double envelope) {
    pairs_.clear();
    order_.resize(surfaces_.size());
    for (std::size_t i = 0; i < order_.size(); ++i) order_[i] = static_cast<std::int32_t>(i);
    const auto box = [&](std::int32_t i) -> const Box3d& { return surfaces_[to_index(i)].surface.box(); };
    std::sort(order_.begin(), order_.end(), [&](std::int32_t a, std::int32_t b) {
        return std::pair(box(a).min().x(), a) < std::pair(box(b).min().x(), b);
    });
    double thickest = 0.0;
    for (const Surface& one : surfaces_) thickest = std::max(thickest, one.radius);
    for (std::size_t i = 0; i < order_.size(); ++i)
        for (std::size_t j = i + 1; j < order_.size(); ++j) {
            const std::int32_t a = order_[i], b = order_[j];
            if (box(b).min().x() > box(a).max().x() + 2.0 * thickest + std::max(envelope, 2.0 * thickest)) break;
            const double reach =
                surfaces_[to_index(a)].radius + surfaces_[to_index(b)].radius + std::max(envelope, 2.0 * thickest);
            if (enlarged(box(a), reach).intersects(box(b))) pairs_.emplace_back(std::min(a, b), std::max(a, b));
        }
    std::sort(pairs_.begin(), pairs_.end());
}

void MeshContacts::touch(std::int32_t a, std::int32_t b, double envelope, std::vector<MeshContact>& contacts) {
    const Surface &one = surfaces_[to_index(a)], &other = surfaces_[to_index(b)];
    radii_ = one.radius + other.radius;
    envelope_ = envelope > 0.0 ? envelope : radii_;
    still_ = one.surface.longest_way() + other.surface.longest_way() <= envelope_;
    met_.clear();
    for (auto& vertices : touching_) vertices.clear();
    for (auto& vertices : on_nodes_) vertices.clear();
    vertices_on_surface(a, b, false, contacts);
    std::sort(met_.begin(), met_.end());
    vertices_on_surface(b, a, true, contacts);
    sides_on_surface(a, b, false, contacts);
    sides_on_surface(b, a, true, contacts);
    crossing_edges(a, b, contacts);
}

void MeshContacts::vertices_on_surface(std::int32_t a, std::int32_t b, bool second,
                                       std::vector<MeshContact>& contacts) {
    a_ = &surfaces_[to_index(a)].surface;
    b_ = &surfaces_[to_index(b)].surface;
    depth_ = depth_share * b_->edge_length();
    edge_seen_.assign(b_->edges().size(), -1);
    vertex_seen_.assign(b_->nodes().size(), -1);
    const double margin = radii_ + std::max(envelope_, depth_);
    const Box3d region = enlarged(b_->box(), margin);
    for (std::int32_t vertex = 0; vertex < static_cast<std::int32_t>(a_->nodes().size()); ++vertex) {
        const Box3d box = around(a_->at(vertex), a_->way(vertex), 0.0);
        if (!region.intersects(box)) continue;
        b_->near(enlarged(box, margin), triangles_);
        if (triangles_.empty()) continue;
        candidates_.clear();
        for (const std::int32_t t : triangles_)
            on_triangle(a_->vertex_point(vertex), a_->normal(vertex), vertex, b_->triangles()[to_index(t)]);
        for (const std::int32_t t : triangles_)
            for (const std::int32_t e : b_->triangles()[to_index(t)].edges) {
                const MeshSurface::Edge& edge = b_->edges()[to_index(e)];
                if (edge.convex && std::exchange(edge_seen_[to_index(e)], vertex) != vertex) on_edge(vertex, edge);
            }
        for (const std::int32_t t : triangles_)
            for (const std::int32_t corner : b_->triangles()[to_index(t)].corners)
                if (b_->has_convex_edge(corner) && std::exchange(vertex_seen_[to_index(corner)], vertex) != vertex)
                    on_vertex(vertex, corner, b_->triangles()[to_index(t)].patch);
        leave_out_copies();
        for (const Candidate& candidate : candidates_) {
            touching_[second ? 1 : 0].push_back(vertex);
            const bool on_node = candidate.foot_vertex >= 0;
            if (on_node) on_nodes_[second ? 1 : 0].push_back(vertex);
            if (on_node && second &&
                std::binary_search(met_.begin(), met_.end(), std::pair(candidate.foot_vertex, vertex)))
                continue;
            MeshContact contact;
            contact.a = a_->vertex_point(vertex);
            contact.b = candidate.foot;
            if (held_together(contact.a, contact.b)) continue;
            if (on_node && !second) met_.emplace_back(vertex, candidate.foot_vertex);
            contact.surface_a = a;
            contact.surface_b = b;
            contact.normal = -candidate.normal;
            contact.gap = candidate.gap;
            contact.feature = {static_cast<std::uint64_t>(contact.a.nodes[0]), static_cast<std::uint64_t>(b),
                               static_cast<std::uint64_t>(candidate.patch)};
            contacts.push_back(contact);
        }
    }
}

// Over triangles only: at edges the nodes about it hold.
void MeshContacts::sides_on_surface(std::int32_t a, std::int32_t b, bool second, std::vector<MeshContact>& contacts) {
    a_ = &surfaces_[to_index(a)].surface;
    b_ = &surfaces_[to_index(b)].surface;
    depth_ = depth_share * b_->edge_length();
    const auto& on_nodes = on_nodes_[second ? 1 : 0];
    const double margin = radii_ + std::max(envelope_, depth_);
    const Box3d region = enlarged(b_->box(), margin);
    for (const MeshSurface::Triangle& middle : a_->triangles()) {
        if (middle.part != 3) continue;
        const CarriedPoint point = a_->point_of(middle, Vector3d::Constant(1.0 / 3.0));
        const Box3d box = around(a_->place_of(point), a_->way_of(point), 0.0);
        if (!region.intersects(box)) continue;
        if (std::all_of(middle.corners.begin(), middle.corners.end(), [&](std::int32_t vertex) {
                return std::binary_search(on_nodes.begin(), on_nodes.end(), vertex);
            }))
            continue;
        b_->near(enlarged(box, margin), triangles_);
        candidates_.clear();
        for (const std::int32_t t : triangles_) on_triangle(point, middle.normal, -1, b_->triangles()[to_index(t)]);
        leave_out_copies();
        for (const Candidate& candidate : candidates_) {
            if (held_together(point, candidate.foot)) continue;
            MeshContact contact;
            contact.kind = MeshContact::Kind::Side;
            contact.a = second ? candidate.foot : point;
            contact.b = second ? point : candidate.foot;
            contact.surface_a = second ? b : a;
            contact.surface_b = second ? a : b;
            contact.normal = second ? candidate.normal : Vector3d(-candidate.normal);
            contact.gap = candidate.gap;
            contact.feature = {static_cast<std::uint64_t>(surfaces_[to_index(a)].first_side + middle.side),
                               static_cast<std::uint64_t>(b), static_cast<std::uint64_t>(candidate.patch)};
            contacts.push_back(contact);
        }
    }
}

// What is in the envelope counts where it is. But what moves fast past a ridge would be held up by the leaning normal
// that the ridge has now: there, as of all that is farther away, the gap has to close.
template <class Gap>
double MeshContacts::meeting(bool over_face, Gap&& gap) const {
    constexpr double never = -1.0;
    constexpr int most_advances = 32;
    const double closed = 0.05 * envelope_;
    double share = 0.0;
    for (int i = 0; i < most_advances; ++i) {
        const GapAndRate now = gap(share);
        if (now.gap < (i == 0 && (over_face || still_) ? envelope_ : closed)) return share;
        if (still_ || !(now.rate < 0.0)) return never;
        share += (now.gap - 0.5 * closed) / -now.rate;
        if (share > 1.0) return never;
    }
    return never;
}

bool MeshContacts::faces(std::int32_t vertex, const Vector3d& normal, bool sharp, double share) const {
    if (normal.dot(a_->normal(vertex)) > -facing_cosine) return false;
    return !sharp || a_->is_top(vertex, -normal, flat_angle, share);
}

// How far a foot lies beyond the sharp edges of a triangle; more than that if it is beyond another edge.
double MeshContacts::beyond_rim(const MeshSurface::Triangle& triangle, const Vector3d& foot, double share) const {
    double beyond = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
        const double l = foot[static_cast<Eigen::Index>((k + 2) % 3)];  // 0 at the edge from corner k to k + 1
        if (l >= -inside_tolerance) continue;
        const MeshSurface::Edge& edge = b_->edges()[to_index(triangle.edges[k])];
        if (!edge.sharp) return HUGE_VAL;
        const Vector3d third = b_->at(triangle.corners[(k + 2) % 3], share) - b_->at(edge.tail, share);
        beyond = std::hypot(beyond, -l * third.dot(b_->inward(triangle, edge, share)));
    }
    return beyond;
}

void MeshContacts::on_triangle(const CarriedPoint& point, const Vector3d& outward, std::int32_t vertex,
                               const MeshSurface::Triangle& triangle) {
    const Vector3d begin = a_->place_of(point), own_way = a_->way_of(point);
    Vector3d normal, foot;
    double height = 0.0;
    const auto measure = [&](double share) -> GapAndRate {
        normal = share == 0.0 ? triangle.normal : b_->normal_at(triangle, share);
        const Vector3d p = begin + share * own_way, a = b_->at(triangle.corners[0], share);
        height = normal.dot(p - a);
        foot =
            barycentric(a, b_->at(triangle.corners[1], share), b_->at(triangle.corners[2], share), p - height * normal);
        Vector3d way = own_way;
        for (std::size_t k = 0; k < 3; ++k)
            way -= std::clamp(foot[static_cast<Eigen::Index>(k)], 0.0, 1.0) * b_->way(triangle.corners[k]);
        return {height - radii_, normal.dot(way)};
    };
    double share = meeting(true, measure);
    if (share < 0.0) return;
    // Near its plane already and beside it, it may still come over the triangle before it touches.
    if (!still_ && foot.minCoeff() < -inside_tolerance) {
        const GapAndRate now = measure(share);
        if (now.gap > 0.0 && now.gap < -now.rate * (1.0 - share)) {
            share += now.gap / -now.rate;
            measure(share);
        }
    }
    if (height < -depth_ || normal.dot(outward) > -facing_cosine) return;
    double beyond = 0.0;
    if (foot.minCoeff() < -inside_tolerance) {
        if (vertex < 0 || height <= 0.0) return;
        beyond = beyond_rim(triangle, foot, share);
        if (beyond > rim_share * radii_ || !a_->is_top(vertex, -normal, rim_angle, share)) return;
        foot = foot.cwiseMax(0.0);
        foot /= foot.sum();
    }
    Candidate candidate;
    candidate.foot = b_->project(triangle, foot, begin + share * own_way, share, normal);
    candidate.normal = normal;
    candidate.gap = normal.dot(begin - b_->place_of(candidate.foot)) - radii_;
    if (beyond > 0.0) candidate.gap += std::hypot(height, beyond) - height;
    candidate.patch = triangle.patch & static_cast<std::int32_t>(patch_bits);
    Eigen::Index nearest = 0;
    if (foot.maxCoeff(&nearest) > 1.0 - same_vertex)
        candidate.foot_vertex = triangle.corners[static_cast<std::size_t>(nearest)];
    candidates_.push_back(candidate);
}

void MeshContacts::on_edge(std::int32_t vertex, const MeshSurface::Edge& edge) {
    Vector3d normal;
    double along = 0.0;
    const auto measure = [&](double share) -> GapAndRate {
        const Vector3d p = a_->at(vertex, share), tail = b_->at(edge.tail, share),
                       span = b_->at(edge.head, share) - tail;
        along = (p - tail).dot(span) / span.squaredNorm();
        const double inside = std::clamp(along, 0.0, 1.0);
        normal = p - tail - inside * span;
        const double distance = normal.norm();
        normal /= std::max(distance, 1e-300);
        const Vector3d way = a_->way(vertex) - (1.0 - inside) * b_->way(edge.tail) - inside * b_->way(edge.head);
        return {distance - radii_, normal.dot(way)};
    };
    const double share = meeting(false, measure);
    if (share < 0.0 || along <= 0.0 || along >= 1.0) return;
    for (const auto t : edge.triangles)
        if (t >= 0 && normal.dot(b_->inward(b_->triangles()[to_index(t)], edge, share)) > rounding_angle) return;
    if (!faces(vertex, normal, edge.sharp, share)) return;
    const MeshSurface::Triangle& triangle = b_->triangles()[to_index(edge.triangles[0])];
    Vector3d coordinates = Vector3d::Zero();
    for (Eigen::Index k = 0; k < 3; ++k) {
        const auto corner = triangle.corners[static_cast<std::size_t>(k)];
        if (corner == edge.tail) coordinates[k] = 1.0 - along;
        if (corner == edge.head) coordinates[k] = along;
    }
    Candidate candidate;
    candidate.foot = b_->point_of(triangle, coordinates);
    candidate.normal = normal;
    candidate.gap = normal.dot(a_->at(vertex) - b_->place_of(candidate.foot)) - radii_;
    candidate.patch = triangle.patch & static_cast<std::int32_t>(patch_bits);
    if (edge.sharp) candidate.patch |= static_cast<std::int32_t>(ridge_flag);
    if (along < same_vertex) candidate.foot_vertex = edge.tail;
    if (along > 1.0 - same_vertex) candidate.foot_vertex = edge.head;
    candidates_.push_back(candidate);
}

void MeshContacts::on_vertex(std::int32_t vertex, std::int32_t other, std::int32_t patch) {
    Vector3d normal;
    const auto measure = [&](double share) -> GapAndRate {
        normal = a_->at(vertex, share) - b_->at(other, share);
        const double distance = normal.norm();
        normal /= std::max(distance, 1e-300);
        return {distance - radii_, normal.dot(a_->way(vertex) - b_->way(other))};
    };
    const double share = meeting(false, measure);
    if (share < 0.0 || !b_->is_top(other, normal, rounding_angle, share)) return;
    const bool sharp = b_->has_sharp_edge(other);
    if (!faces(vertex, normal, sharp, share)) return;
    Candidate candidate;
    candidate.foot = b_->vertex_point(other);
    candidate.normal = normal;
    candidate.gap = normal.dot(a_->at(vertex) - b_->at(other)) - radii_;
    candidate.patch = patch & static_cast<std::int32_t>(patch_bits);
    if (sharp) candidate.patch |= static_cast<std::int32_t>(ridge_flag);
    candidate.foot_vertex = other;
    candidates_.push_back(candidate);
}

// Of candidates along nearly one direction the nearest stays, of equals the first: triangles come before edges, edges
// before vertices. What is behind several triangles leaves through the nearest.
void MeshContacts::leave_out_copies() {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
        const Candidate candidate = candidates_[i];
        const auto end = candidates_.begin() + static_cast<std::ptrdiff_t>(kept);
        const auto copy = std::find_if(candidates_.begin(), end, [&](const Candidate& other) {
            const bool behind = candidate.gap < -radii_ && other.gap < -radii_;
            return behind || (candidate.normal - other.normal).norm() <= same_angle;
        });
        if (copy == end) {
            candidates_[kept++] = candidate;
            continue;
        }
        const bool behind = candidate.gap < -radii_ && copy->gap < -radii_;
        const double less = copy->gap - candidate.gap;
        if (behind ? less < 0.0 : less > 1e-9 * radii_) *copy = candidate;
    }
    candidates_.resize(kept);
}

void MeshContacts::crossing_edges(std::int32_t a, std::int32_t b, std::vector<MeshContact>& contacts) {
    a_ = &surfaces_[to_index(a)].surface;
    b_ = &surfaces_[to_index(b)].surface;
    depth_ = depth_share * std::min(a_->edge_length(), b_->edge_length());
    const double margin = radii_ + std::max(envelope_, depth_);
    for (auto& vertices : crossed_) vertices.clear();
    // The edges near a sharp edge of one surface that are of the other.
    const auto for_each_sharp_edge = [&](const MeshSurface& one, const MeshSurface& other, auto&& visit) {
        const Box3d region = enlarged(other.box(), margin);
        for (const std::int32_t sharp : one.sharp_edges()) {
            const MeshSurface::Edge& edge = one.edges()[to_index(sharp)];
            Box3d box = around(one.at(edge.tail), one.way(edge.tail), margin);
            box.extend(around(one.at(edge.head), one.way(edge.head), margin));
            if (!region.intersects(box)) continue;
            other.near(box, triangles_);
            near_edges_.clear();
            for (const std::int32_t t : triangles_)
                for (const std::int32_t e : other.triangles()[to_index(t)].edges)
                    if (!other.edges()[to_index(e)].inner) near_edges_.push_back(e);
            sort_unique(near_edges_);
            for (const std::int32_t e : near_edges_) visit(sharp, e);
        }
    };
    for_each_sharp_edge(*a_, *b_,
                        [&](std::int32_t of_a, std::int32_t of_b) { edge_on_edge(a, b, of_a, of_b, contacts); });
    for_each_sharp_edge(*b_, *a_, [&](std::int32_t of_b, std::int32_t of_a) {
        if (!a_->edges()[to_index(of_a)].sharp) edge_on_edge(a, b, of_a, of_b, contacts);
    });
}

void MeshContacts::edge_on_edge(std::int32_t a, std::int32_t b, std::int32_t of_a, std::int32_t of_b,
                                std::vector<MeshContact>& contacts) {
    const MeshSurface::Edge &one = a_->edges()[to_index(of_a)], &other = b_->edges()[to_index(of_b)];
    const auto outward = [](const MeshSurface& surface, const MeshSurface::Edge& edge) {
        Vector3d sum = Vector3d::Zero();
        for (const auto t : edge.triangles)
            if (t >= 0) sum += surface.triangles()[to_index(t)].normal;
        return sum;
    };
    const Vector3d out_of_a = outward(*a_, one), out_of_b = outward(*b_, other);
    Vector3d normal = Vector3d::Zero();  // from b to a
    double on_a = -1.0, on_b = -1.0;
    bool crosses = true;
    const auto measure = [&](double share) -> GapAndRate {
        const Vector3d p = a_->at(one.tail, share), u = a_->at(one.head, share) - p;
        const Vector3d q = b_->at(other.tail, share), w = b_->at(other.head, share) - q;
        normal = u.cross(w);
        const double area = normal.norm();
        crosses = area > parallel_sine * u.norm() * w.norm();
        if (!crosses) return {HUGE_VAL, 0.0};
        normal /= normal.dot(out_of_b) < 0.0 ? -area : area;
        crosses = normal.dot(out_of_b) > 0.0 && normal.dot(out_of_a) < 0.0;
        if (!crosses) return {HUGE_VAL, 0.0};
        // p + s u and q + t w, nearest: (s, t) from p − q + s u − t w ∥ u × w.
        const Vector3d between = q - p, across = u.cross(w) / (area * area);
        on_a = between.cross(w).dot(across);
        on_b = between.cross(u).dot(across);
        const double s = std::clamp(on_a, 0.0, 1.0), t = std::clamp(on_b, 0.0, 1.0);
        const Vector3d way = (1.0 - s) * a_->way(one.tail) + s * a_->way(one.head) - (1.0 - t) * b_->way(other.tail) -
                             t * b_->way(other.head);
        return {normal.dot(p + on_a * u - q - on_b * w) - radii_, normal.dot(way)};
    };
    const double share = meeting(false, measure);
    if (share < 0.0 || on_a < 0.0 || on_a > 1.0 || on_b < 0.0 || on_b > 1.0) return;
    // An edge that is not sharp may be hollow: then directions between its normals are let pass.
    const auto in_cone = [&](const MeshSurface& surface, const MeshSurface::Edge& edge, double sign) {
        double angle = edge_angle;
        if (!edge.sharp)
            angle += surface.triangles()[to_index(edge.triangles[0])]
                         .normal.cross(surface.triangles()[to_index(edge.triangles[1])].normal)
                         .norm();
        return std::all_of(edge.triangles.begin(), edge.triangles.end(), [&](std::int32_t t) {
            return t < 0 || sign * normal.dot(surface.inward(surface.triangles()[to_index(t)], edge, share)) <= angle;
        });
    };
    if (!in_cone(*a_, one, -1.0) || !in_cone(*b_, other, 1.0)) return;
    // A vertex at the crossing has its own contact, or the first of the crossings there.
    const auto taken = [](const MeshSurface::Edge& edge, double along, const std::vector<std::int32_t>& touching,
                          std::vector<std::int32_t>& crossed) {
        if (along > same_crossing && along < 1.0 - same_crossing) return false;
        const std::int32_t vertex = along < 0.5 ? edge.tail : edge.head;
        if (std::binary_search(touching.begin(), touching.end(), vertex)) return true;
        if (std::find(crossed.begin(), crossed.end(), vertex) != crossed.end()) return true;
        crossed.push_back(vertex);
        return false;
    };
    if (taken(one, on_a, touching_[0], crossed_[0]) || taken(other, on_b, touching_[1], crossed_[1])) return;
    const auto point_on = [](const MeshSurface& surface, const MeshSurface::Edge& edge, double along) {
        const MeshSurface::Triangle& triangle = surface.triangles()[to_index(edge.triangles[0])];
        Vector3d coordinates = Vector3d::Zero();
        for (Eigen::Index k = 0; k < 3; ++k) {
            const auto corner = triangle.corners[static_cast<std::size_t>(k)];
            if (corner == edge.tail) coordinates[k] = 1.0 - along;
            if (corner == edge.head) coordinates[k] = along;
        }
        return surface.point_of(triangle, coordinates);
    };
    MeshContact contact;
    contact.kind = MeshContact::Kind::Edges;
    contact.a = point_on(*a_, one, on_a);
    contact.b = point_on(*b_, other, on_b);
    if (held_together(contact.a, contact.b)) return;
    contact.surface_a = a;
    contact.surface_b = b;
    contact.normal = -normal;
    contact.gap = normal.dot(a_->place_of(contact.a) - b_->place_of(contact.b)) - radii_;
    if (contact.gap < -radii_ - depth_) return;
    contact.feature = {static_cast<std::uint64_t>(surfaces_[to_index(a)].first_edge + of_a),
                       static_cast<std::uint64_t>(surfaces_[to_index(b)].first_edge + of_b), 0};
    contacts.push_back(contact);
}

bool MeshContacts::held_together(const CarriedPoint& a, const CarriedPoint& b) const {
    const std::int32_t hold = holds_[to_index(a.nodes[0])];
    if (hold == free) return false;
    for (const CarriedPoint* point : {&a, &b})
        for (std::size_t k = 0; k < point->count; ++k)
            if (std::abs(point->weights[k]) > 1e-12 && holds_[to_index(point->nodes[k])] != hold) return false;
    return true;
}

}  // namespace delassus::mechanics
