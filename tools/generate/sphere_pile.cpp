// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <numbers>

#include "generate/bodies.hpp"
#include "generate/cell_grid.hpp"
#include "generate/family.hpp"

namespace delassus {
namespace generating {
namespace {

const Field<SpherePileParameters> sphere_pile_fields[] = {
    {"contacts", &SpherePileParameters::contacts, 1, 2e6, "",
     "the base is the smallest with at least so many contacts"},
    {"layers", &SpherePileParameters::layers, 1, 1000, "", "layers of spheres; a pyramid may end sooner"},
    {"pyramid", &SpherePileParameters::pyramid, 0, 1, "",
     "1: each layer is one sphere narrower; 0: full layers, as in a box"},
    {"walls", &SpherePileParameters::walls, 0, 1, "", "1: four fixed walls that touch the widest layers"},
    {"radius", &SpherePileParameters::radius, 1e-6, 1e6, "m", "largest radius of a sphere"},
    {"density", &SpherePileParameters::density, 1e-3, 1e6, "kg/m^3", "of the spheres"},
    {"jitter", &SpherePileParameters::jitter, 0, 0.2, "", "radii are smaller by a random share up to this"},
    {"envelope", &SpherePileParameters::envelope, 0, 0.5, "",
     "pairs with a gap up to this multiple of the radius are contacts"},
    {"mu", &SpherePileParameters::mu, 0, 1e4, "", "friction coefficient; 0: one nonnegative row a contact"},
    {"speed", &SpherePileParameters::speed, 0, 1e3, "m/s", "amplitude of random velocities"},
    {"glue", &SpherePileParameters::glue, 0, 1, "", "1: all contacts stick: free rows with b = 0"},
    {"gravity", &SpherePileParameters::gravity, 0, 1e3, "m/s^2", "along -z"},
    {"step", &SpherePileParameters::step, 1e-9, 10, "s", "time step h"},
    {"seed", &SpherePileParameters::seed, 0, kLargestSeed, "", "seed of radii and velocities"},
};

// The closest packing in square layers: a sphere lies in the hollow between four below, so that layers are √2 r apart
// and shifted by (r, r). A pyramid shrinks by one each layer; a box alternates between the full layer and the smaller
// one.
struct Layer {
    std::int32_t columns, rows;  // 0 × 0 above the top of a pyramid
    double shift;                // of the first sphere's centre, in radii
};

Layer layer_of(const SpherePileParameters& parameters, std::int32_t columns, std::int32_t rows, std::int32_t k) {
    const std::int32_t less = parameters.pyramid ? k : k % 2;
    if (columns <= less || rows <= less) return {0, 0, 0.0};
    return {columns - less, rows - less, static_cast<double>(less)};
}

bool touches_walls(const SpherePileParameters& parameters, std::int32_t layer) {
    return parameters.walls && (parameters.pyramid ? layer == 0 : layer % 2 == 0);
}

// Contacts without jitter: with the floor, within a layer, of each sphere of the smaller of two layers with four of the
// larger, and with the walls.
double count_contacts(const SpherePileParameters& parameters, std::int32_t columns, std::int32_t rows) {
    double contacts = static_cast<double>(columns) * rows;
    double below = 0.0;
    for (std::int32_t k = 0; k < parameters.layers; ++k) {
        const Layer layer = layer_of(parameters, columns, rows, k);
        if (layer.columns == 0) break;
        const double i = layer.columns;
        const double j = layer.rows;
        contacts += (i - 1) * j + i * (j - 1);
        if (k > 0) contacts += 4.0 * std::min(below, i * j);
        if (touches_walls(parameters, k)) contacts += 2.0 * (i + j);
        below = i * j;
    }
    return contacts;
}

}  // namespace

Family sphere_pile_family() {
    return make_family<SpherePileParameters>("sphere_pile", "spheres in the closest packing on a fixed floor",
                                             sphere_pile_fields, &generate_sphere_pile);
}

}  // namespace generating

Problem generate_sphere_pile(const SpherePileParameters& parameters) {
    using namespace generating;
    check_parameters<SpherePileParameters>("sphere_pile", sphere_pile_fields, parameters);
    // The smallest square base that is enough; then the narrowest strip of that length. A box needs 2 × 2 to have a
    // second layer.
    const double wanted = parameters.contacts;
    std::int32_t columns = 1;
    while (count_contacts(parameters, columns, columns) < wanted) ++columns;
    std::int32_t rows = columns;
    while (rows > 1 && count_contacts(parameters, columns, rows - 1) >= wanted) --rows;

    Random random(parameters.seed);
    Assembly assembly({parameters.gravity, parameters.step, false, false});
    const double r = parameters.radius;
    std::vector<Vector3d> centres;
    std::vector<double> radii;
    for (std::int32_t k = 0; k < parameters.layers; ++k) {
        const Layer layer = layer_of(parameters, columns, rows, k);
        for (std::int32_t j = 0; j < layer.rows; ++j) {
            for (std::int32_t i = 0; i < layer.columns; ++i) {
                centres.emplace_back((layer.shift + 2.0 * i) * r, (layer.shift + 2.0 * j) * r,
                                     (1.0 + std::numbers::sqrt2 * k) * r);
                radii.push_back(r * (1.0 - parameters.jitter * random.share()));
                Body body;
                body.position = centres.back();
                body.mass = 4.0 / 3.0 * std::numbers::pi * std::pow(radii.back(), 3) * parameters.density;
                body.inertia = sphere_inertia(body.mass, radii.back());
                shake(body, parameters.speed, parameters.speed / r, random);
                assembly.add(body);
            }
        }
    }

    // Lattice positions are rounded: what is within a few units in the last place of touching, touches.
    const double extent = 2.0 * r * (columns + parameters.layers);
    const auto gap_of = [&](double gap) { return std::abs(gap) < 1e-14 * extent ? 0.0 : gap; };
    const double widest = parameters.envelope * r;
    const auto fixed_contact = [&](std::size_t i, const Vector3d& normal, double distance) {
        const double gap = gap_of(distance - radii[i]);
        if (gap > widest) return;
        assembly.contact(kWorld, static_cast<std::int32_t>(i), centres[i] - radii[i] * normal, normal, gap,
                         parameters.mu);
    };
    const auto pairs = pairs_within(centres, (2.0 + parameters.envelope) * r + 1e-14 * extent);
    auto pair = pairs.begin();
    for (std::size_t i = 0; i < centres.size(); ++i) {
        // Contacts with the floor and walls before those with later spheres: the order follows the bodies.
        fixed_contact(i, Vector3d::UnitZ(), centres[i].z());
        if (parameters.walls) {
            fixed_contact(i, Vector3d::UnitX(), centres[i].x() + r);
            fixed_contact(i, -Vector3d::UnitX(), (2.0 * columns - 1.0) * r - centres[i].x());
            fixed_contact(i, Vector3d::UnitY(), centres[i].y() + r);
            fixed_contact(i, -Vector3d::UnitY(), (2.0 * rows - 1.0) * r - centres[i].y());
        }
        for (; pair != pairs.end() && pair->first == static_cast<std::int32_t>(i); ++pair) {
            const auto j = static_cast<std::size_t>(pair->second);
            const Vector3d d = centres[j] - centres[i];
            const double gap = gap_of(d.norm() - radii[i] - radii[j]);
            if (gap > widest) continue;
            const Vector3d normal = d.normalized();
            // Halfway between the two surfaces.
            const Vector3d point = centres[i] + (radii[i] + 0.5 * gap) * normal;
            assembly.contact(pair->first, pair->second, point, normal, gap, parameters.mu);
        }
    }
    Problem problem = assembly.finish(fmt::format("sphere_pile-{}", centres.size()));
    return parameters.glue ? glued(problem) : problem;
}

}  // namespace delassus
