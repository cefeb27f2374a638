// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Core>
#include <array>
#include <cmath>

#include "generate/bodies.hpp"
#include "generate/family.hpp"

namespace delassus {
namespace generating {
namespace {

const Field<ElasticBlockParameters> elastic_block_fields[] = {
    {"elements", &ElasticBlockParameters::elements, 1, 1000, "", "elements along x and along y"},
    {"layers", &ElasticBlockParameters::layers, 1, 1000, "", "elements along z"},
    {"size", &ElasticBlockParameters::size, 1e-6, 1e6, "m", "edge of an element"},
    {"young", &ElasticBlockParameters::young, 1e-3, 1e15, "Pa", "Young's modulus"},
    {"poisson", &ElasticBlockParameters::poisson, -0.9, 0.495, "", "Poisson's ratio"},
    {"density", &ElasticBlockParameters::density, 1e-3, 1e6, "kg/m^3", "of the block"},
    {"damping_mass", &ElasticBlockParameters::damping_mass, 0, 1e6, "1/s",
     "alpha of Rayleigh's damping R = alpha M + beta K"},
    {"damping_stiffness", &ElasticBlockParameters::damping_stiffness, 0, 1e3, "s", "beta of Rayleigh's damping"},
    {"squeeze", &ElasticBlockParameters::squeeze, -10, 10, "",
     "initial compression over that of a column under its own weight"},
    {"gap", &ElasticBlockParameters::gap, 0, 1e3, "m", "under the lowest nodes"},
    {"mu", &ElasticBlockParameters::mu, 0, 1e4, "", "friction coefficient; 0: one nonnegative row a contact"},
    {"slide", &ElasticBlockParameters::slide, -1e3, 1e3, "m/s", "initial velocity along x"},
    {"fall", &ElasticBlockParameters::fall, -1e3, 1e3, "m/s", "initial velocity along -z"},
    {"speed", &ElasticBlockParameters::speed, 0, 1e3, "m/s", "amplitude of random velocities"},
    {"glue", &ElasticBlockParameters::glue, 0, 1, "", "1: all contacts stick: free rows with b = 0"},
    {"gravity", &ElasticBlockParameters::gravity, 0, 1e3, "m/s^2", "along -z"},
    {"step", &ElasticBlockParameters::step, 1e-9, 10, "s", "time step h"},
    {"seed", &ElasticBlockParameters::seed, 0, kLargestSeed, "", "seed of the random velocities"},
};

// Corner c of an element lies at ((c & 1), (c >> 1) & 1, (c >> 2) & 1) edges from its first corner.
using Element = Eigen::Matrix<double, 24, 24>;

struct ElementMatrices {
    Element mass;
    Element stiffness;
};

// A cube with edge e, mapped from ξ ∈ [0, 1]³ by x = e ξ. Shape functions N_c = Π_i (ξ_i or 1 − ξ_i), their gradients
// in x are ∂N_c/∂ξ / e. Strain in Voigt's order ε = (ε_xx, ε_yy, ε_zz, γ_xy, γ_yz, γ_zx) = B u, stress σ = C ε with
// Lamé's λ = E ν/((1 + ν)(1 − 2ν)) and G = E/(2(1 + ν)):
//     K_e = ∫ Bᵀ C B dV        M_e = ∫ ρ Nᵀ N dV
// The integrands are of degree 2 in each ξ_i, so that Gauss's rule with 2 × 2 × 2 points is exact on a cube.
ElementMatrices element_matrices(const ElasticBlockParameters& parameters) {
    const double e = parameters.size;
    const double nu = parameters.poisson;
    const double lame = parameters.young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
    const double shear = parameters.young / (2.0 * (1.0 + nu));
    Eigen::Matrix<double, 6, 6> elasticity = Eigen::Matrix<double, 6, 6>::Zero();
    elasticity.topLeftCorner<3, 3>().setConstant(lame);
    elasticity.diagonal().head<3>().array() += 2.0 * shear;
    elasticity.diagonal().tail<3>().setConstant(shear);

    ElementMatrices result{Element::Zero(), Element::Zero()};
    const double offset = 0.5 / std::sqrt(3.0);
    const double weight = e * e * e / 8.0;
    for (int point = 0; point < 8; ++point) {
        Eigen::Vector3d xi;
        for (int i = 0; i < 3; ++i) xi[i] = 0.5 + (((point >> i) & 1) != 0 ? offset : -offset);
        Eigen::Matrix<double, 6, 24> strain = Eigen::Matrix<double, 6, 24>::Zero();
        Eigen::Matrix<double, 3, 24> shape = Eigen::Matrix<double, 3, 24>::Zero();
        for (int c = 0; c < 8; ++c) {
            Eigen::Vector3d factor, slope;
            for (int i = 0; i < 3; ++i) {
                const bool upper = ((c >> i) & 1) != 0;
                factor[i] = upper ? xi[i] : 1.0 - xi[i];
                slope[i] = upper ? 1.0 : -1.0;
            }
            const double dx = slope[0] * factor[1] * factor[2] / e;
            const double dy = factor[0] * slope[1] * factor[2] / e;
            const double dz = factor[0] * factor[1] * slope[2] / e;
            strain.block<6, 3>(0, 3 * c) << dx, 0, 0, 0, dy, 0, 0, 0, dz, dy, dx, 0, 0, dz, dy, dz, 0, dx;
            shape.block<3, 3>(0, 3 * c) = factor.prod() * Eigen::Matrix3d::Identity();
        }
        result.stiffness += weight * strain.transpose() * elasticity * strain;
        result.mass += weight * parameters.density * shape.transpose() * shape;
    }
    // Symmetric to the last bit.
    result.stiffness = (0.5 * (result.stiffness + result.stiffness.transpose())).eval();
    result.mass = (0.5 * (result.mass + result.mass.transpose())).eval();
    return result;
}

// The regular grid of nodes, numbered with i along x fastest.
struct Grid {
    std::int32_t elements, layers;

    [[nodiscard]] std::int32_t side() const { return elements + 1; }
    [[nodiscard]] std::int32_t count() const { return side() * side() * (layers + 1); }
    [[nodiscard]] std::int32_t node(int i, int j, int k) const { return i + side() * (j + side() * k); }
    [[nodiscard]] bool has_node(int i, int j, int k) const {
        return i >= 0 && j >= 0 && k >= 0 && i <= elements && j <= elements && k <= layers;
    }
    [[nodiscard]] bool has_element(int i, int j, int k) const {
        return i >= 0 && j >= 0 && k >= 0 && i < elements && j < elements && k < layers;
    }
};

// The 3 × 3 blocks between node (i, j, k) and its neighbour at (dx, dy, dz): the sum over the elements that have both.
// An element whose first corner is at node − corner(c) has the node as corner c and the neighbour as corner c + d,
// if that is one of its corners. Ascending c meets the elements in the same order from either node, so that both
// triangles of H agree bit for bit.
Matrix3d gather(const Grid& grid, const Element& element, const std::array<int, 3>& at, const std::array<int, 3>& d) {
    Matrix3d sum = Matrix3d::Zero();
    for (int c = 0; c < 8; ++c) {
        int other = 0;
        bool inside = true;
        std::array<int, 3> first{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const int corner = (c >> axis) & 1;
            const int moved = corner + d[axis];
            inside = inside && moved >= 0 && moved <= 1;
            other |= moved << axis;
            first[axis] = at[axis] - corner;
        }
        if (inside && grid.has_element(first[0], first[1], first[2])) sum += element.block<3, 3>(3 * c, 3 * other);
    }
    return sum;
}

}  // namespace

Family elastic_block_family() {
    return make_family<ElasticBlockParameters>("elastic_block",
                                               "finite elements on a plane with friction: H sparse, not block-diagonal",
                                               elastic_block_fields, &generate_elastic_block);
}

}  // namespace generating

// One step of the linearised implicit Euler method for M v̇ = f_g − K u − R v with u⁺ = u + h v⁺ and R = α M + β K:
//
//     (M + h R + h² K) v⁺ − Dᵀ λ = M v + h (f_g − K u)
//
// the DVI step of DESIGN section 5 with K and R in H. Gravity acts through the consistent mass, f_g = M (0, 0, −g).
// The initial displacement is a multiple of that of a column under its own weight, u_z = −(ρ g/E) (L z − z²/2).
Problem generate_elastic_block(const ElasticBlockParameters& parameters) {
    using namespace generating;
    check_parameters<ElasticBlockParameters>("elastic_block", elastic_block_fields, parameters);
    const Grid grid{parameters.elements, parameters.layers};
    // H has up to 81 entries a row.
    const double nodes = (parameters.elements + 1.0) * (parameters.elements + 1.0) * (parameters.layers + 1.0);
    check_count("elastic_block", "nodes", nodes);
    const double h = parameters.step;
    const ElementMatrices element = element_matrices(parameters);
    const double mass_factor = 1.0 + h * parameters.damping_mass;
    const double stiffness_factor = h * h + h * parameters.damping_stiffness;
    const Element h_element = mass_factor * element.mass + stiffness_factor * element.stiffness;

    Random random(parameters.seed);
    const double length = parameters.layers * parameters.size;
    const double compression = parameters.squeeze * parameters.density * parameters.gravity / parameters.young;
    std::vector<Vector3d> momentum_of;  // v − h g: what the consistent mass turns into M v + h f_g
    for (std::int32_t p = 0; p < grid.count(); ++p) {
        const Vector3d velocity = Vector3d(parameters.slide, 0.0, -parameters.fall) + random.vector(parameters.speed);
        momentum_of.push_back(velocity - Vector3d(0.0, 0.0, h * parameters.gravity));
    }
    const auto displacement = [&](int k) {
        const double z = k * parameters.size;
        return Vector3d(0.0, 0.0, -compression * (length * z - 0.5 * z * z));
    };

    Problem problem;
    problem.name = fmt::format("elastic_block-{}x{}", parameters.elements, parameters.layers);
    Rows matrix;
    for (int k = 0; k <= grid.layers; ++k) {
        for (int j = 0; j <= grid.elements; ++j) {
            for (int i = 0; i <= grid.elements; ++i) {
                std::array<std::int32_t, 27> neighbours{};
                std::array<Matrix3d, 27> blocks;
                std::size_t count = 0;
                Vector3d a = Vector3d::Zero();
                for (int dz = -1; dz <= 1; ++dz) {
                    for (int dy = -1; dy <= 1; ++dy) {
                        for (int dx = -1; dx <= 1; ++dx) {
                            if (!grid.has_node(i + dx, j + dy, k + dz)) continue;
                            const std::array<int, 3> at{i, j, k};
                            const std::array<int, 3> d{dx, dy, dz};
                            const std::int32_t q = grid.node(i + dx, j + dy, k + dz);
                            neighbours[count] = q;
                            blocks[count++] = gather(grid, h_element, at, d);
                            a += gather(grid, element.mass, at, d) * momentum_of[static_cast<std::size_t>(q)];
                            if (compression != 0.0) {
                                a -= h * (gather(grid, element.stiffness, at, d) * displacement(k + dz));
                            }
                        }
                    }
                }
                for (int row = 0; row < 3; ++row) {
                    for (std::size_t block = 0; block < count; ++block) {
                        for (int column = 0; column < 3; ++column) {
                            matrix.put(3 * neighbours[block] + column, blocks[block](row, column));
                        }
                    }
                    matrix.end_row();
                    problem.a.push_back(a[row]);
                }
            }
        }
    }
    problem.H = matrix.finish(problem.n());

    // The lowest nodes: normal z, tangents x and y; a node's velocity is its own three columns.
    Rows jacobian;
    for (std::int32_t p = 0; p < grid.side() * grid.side(); ++p) {
        const std::array<int, 3> axes{2, 0, 1};
        const std::size_t rows = parameters.mu == 0.0 ? 1 : 3;
        for (std::size_t row = 0; row < rows; ++row) {
            jacobian.put(3 * p + axes[row], 1.0);
            jacobian.end_row();
            problem.b.push_back(row == 0 ? parameters.gap / h : 0.0);
        }
        problem.cones.push_back(parameters.mu == 0.0 ? Cone::nonnegative(1) : Cone::friction(parameters.mu));
    }
    problem.D = jacobian.finish(problem.n());
    return parameters.glue ? glued(problem) : problem;
}

}  // namespace delassus
