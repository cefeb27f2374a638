// SPDX-License-Identifier: BSD-3-Clause
#include "generate/bodies.hpp"
#include "generate/family.hpp"

namespace delassus {
namespace generating {
namespace {

const Field<NetParameters> net_fields[] = {
    {"rows", &NetParameters::rows, 3, 1e5, "", "nodes along y"},
    {"columns", &NetParameters::columns, 3, 1e5, "", "nodes along x"},
    {"spacing", &NetParameters::spacing, 1e-6, 1e6, "m", "between neighbours, in plan"},
    {"sag", &NetParameters::sag, 0, 1e6, "m",
     "how far each edge hangs down in its middle; 0: flat, with redundant edges"},
    {"mass", &NetParameters::mass, 1e-9, 1e9, "kg", "mass of the first node"},
    {"mass_ratio", &NetParameters::mass_ratio, 1e-12, 1e12, "", "mass of the last node over that of the first"},
    {"diagonals", &NetParameters::diagonals, 0, 2, "", "braces in each cell; 2 give redundant rows"},
    {"repeated", &NetParameters::repeated, 1, 10, "",
     "how often each string is written; more than once gives redundant rows"},
    {"speed", &NetParameters::speed, 0, 1e3, "m/s", "amplitude of random velocities"},
    {"drift", &NetParameters::drift, -1, 1, "s",
     "for how long each node has moved by its own velocity, stretching the strings"},
    {"gravity", &NetParameters::gravity, 0, 1e3, "m/s^2", "along -z"},
    {"step", &NetParameters::step, 1e-9, 10, "s", "time step h"},
    {"seed", &NetParameters::seed, 0, kLargestSeed, "", "seed of the random velocities"},
};

struct Node {
    Vector3d rest;             // where all strings have their own lengths
    Vector3d position;         // where the node is
    std::int32_t column = -1;  // its first in x; −1: fixed
};

}  // namespace

Family net_family() {
    return make_family<NetParameters>(
        "net", "point masses joined by strings that cannot stretch, fixed at four corners", net_fields, &generate_net);
}

}  // namespace generating

// A string between nodes i and j of length L: C = |d| − L with d = p_j − p_i, and Ċ = d/|d| · (v_j − v_i).
//
// The net at rest is z = −4 sag (ξ(1 − ξ) + η(1 − η)) over the unit square. Without braces its rows are independent if
// sag > 0: a self-stress needs equilibrium at each free node. An edge node's inward string is the only one there that
// leaves the edge's plane, so that it carries nothing; then the edge's own two strings, not in line, carry nothing; and
// so on inwards. If sag = 0 the pieces of each edge are in line between two fixed points, one row too many each.
Problem generate_net(const NetParameters& parameters) {
    using namespace generating;
    check_parameters<NetParameters>("net", net_fields, parameters);
    const std::int32_t rows = parameters.rows;
    const std::int32_t columns = parameters.columns;
    check_count("net", "nodes", static_cast<double>(rows) * columns);
    if (parameters.drift != 0.0 && (parameters.diagonals > 0 || parameters.sag == 0.0)) {
        throw InputError(
            "net: drift stretches a flat or braced net so that its redundant rows contradict one another; set drift to "
            "0, "
            "or diagonals to 0 and sag above 0");
    }
    Random random(parameters.seed);
    Problem problem;
    problem.name = fmt::format("net-{}x{}", rows, columns);

    const std::int32_t count = rows * columns;
    std::vector<Node> nodes;
    Rows mass;
    for (std::int32_t k = 0; k < count; ++k) {
        const std::int32_t i = k / columns;
        const std::int32_t j = k % columns;
        const double xi = static_cast<double>(j) / (columns - 1);
        const double eta = static_cast<double>(i) / (rows - 1);
        Node node;
        node.rest = {j * parameters.spacing, i * parameters.spacing,
                     -4.0 * parameters.sag * (xi * (1.0 - xi) + eta * (1.0 - eta))};
        node.position = node.rest;
        const bool corner = (i == 0 || i == rows - 1) && (j == 0 || j == columns - 1);
        if (!corner) {
            node.column = static_cast<std::int32_t>(problem.a.size());
            const double m = graded(parameters.mass, parameters.mass_ratio, false, k, count);
            const Vector3d velocity = random.vector(parameters.speed);
            node.position += parameters.drift * velocity;
            const Vector3d a = m * (velocity - Vector3d(0.0, 0.0, parameters.step * parameters.gravity));
            for (int axis = 0; axis < 3; ++axis) {
                mass.put(node.column + axis, m);
                mass.end_row();
                problem.a.push_back(a[axis]);
            }
        }
        nodes.push_back(node);
    }

    Rows jacobian;
    const auto string = [&](std::int32_t first, std::int32_t second) {  // first < second
        const Node& p = nodes[static_cast<std::size_t>(first)];
        const Node& q = nodes[static_cast<std::size_t>(second)];
        const Vector3d d = q.position - p.position;
        const Vector3d direction = d.normalized();
        const double error = d.norm() - (q.rest - p.rest).norm();
        for (std::int32_t copy = 0; copy < parameters.repeated; ++copy) {
            for (int axis = 0; axis < 3 && p.column >= 0; ++axis) jacobian.put(p.column + axis, -direction[axis]);
            for (int axis = 0; axis < 3 && q.column >= 0; ++axis) jacobian.put(q.column + axis, direction[axis]);
            jacobian.end_row();
            problem.b.push_back(error / parameters.step);
            problem.cones.push_back(Cone::free(1));
        }
    };
    for (std::int32_t i = 0; i < rows; ++i) {
        for (std::int32_t j = 0; j < columns; ++j) {
            const std::int32_t k = i * columns + j;
            const bool right = j + 1 < columns;
            const bool up = i + 1 < rows;
            if (right) string(k, k + 1);
            if (up) string(k, k + columns);
            if (right && up && parameters.diagonals > 0) string(k, k + columns + 1);
            if (right && up && parameters.diagonals > 1) string(k + 1, k + columns);
        }
    }
    problem.H = mass.finish(problem.n());
    problem.D = jacobian.finish(problem.n());
    return problem;
}

}  // namespace delassus
