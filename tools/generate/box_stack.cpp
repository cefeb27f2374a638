// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "generate/bodies.hpp"
#include "generate/family.hpp"

namespace delassus {
namespace generating {
namespace {

const Field<BoxStackParameters> box_stack_fields[] = {
    {"towers", &BoxStackParameters::towers, 1, 1e6, "", "independent towers"},
    {"boxes", &BoxStackParameters::boxes, 1, 1e6, "", "boxes in a tower"},
    {"width", &BoxStackParameters::width, 1e-6, 1e6, "m", "edge of a box along its x"},
    {"depth", &BoxStackParameters::depth, 1e-6, 1e6, "m", "edge of a box along its y"},
    {"height", &BoxStackParameters::height, 1e-6, 1e6, "m", "edge of a box along z"},
    {"mass", &BoxStackParameters::mass, 1e-9, 1e9, "kg", "mass of the lowest box"},
    {"mass_ratio", &BoxStackParameters::mass_ratio, 1e-12, 1e12, "", "mass of the top box over that of the lowest"},
    {"heavy_top", &BoxStackParameters::heavy_top, 0, 1, "",
     "1: only the top box has another mass; 0: geometric grading"},
    {"gap", &BoxStackParameters::gap, 0, 1e3, "m", "between faces"},
    {"mu", &BoxStackParameters::mu, 0, 1e4, "", "friction coefficient; 0: one nonnegative row a contact"},
    {"speed", &BoxStackParameters::speed, 0, 1e3, "m/s", "amplitude of random velocities"},
    {"glue", &BoxStackParameters::glue, 0, 1, "", "1: all contacts stick: free rows with b = 0"},
    {"gravity", &BoxStackParameters::gravity, 0, 1e3, "m/s^2", "along -z"},
    {"step", &BoxStackParameters::step, 1e-9, 10, "s", "time step h"},
    {"seed", &BoxStackParameters::seed, 0, kLargestSeed, "", "seed of the random velocities"},
};

}  // namespace

Family box_stack_family() {
    return make_family<BoxStackParameters>("box_stack",
                                           "towers of boxes with four contacts on each face: redundant rows",
                                           box_stack_fields, &generate_box_stack);
}

}  // namespace generating

// The four contact points of a face see only the relative twist of its two boxes, 6 numbers: 12 rows with friction have
// rank 6. Four normal rows without friction see one translation and two rotations: rank 3.
Problem generate_box_stack(const BoxStackParameters& parameters) {
    using namespace generating;
    check_parameters<BoxStackParameters>("box_stack", box_stack_fields, parameters);
    check_count("box_stack", "boxes", static_cast<double>(parameters.towers) * parameters.boxes);
    Random random(parameters.seed);
    Assembly assembly({parameters.gravity, parameters.step, false, false});
    const Vector3d edges(parameters.width, parameters.depth, parameters.height);
    const double spacing = 2.0 * std::max(parameters.width, parameters.depth);
    const double pitch = parameters.height + parameters.gap;
    for (std::int32_t tower = 0; tower < parameters.towers; ++tower) {
        const Matrix3d orientation = rotation({0.0, 0.0, 0.3 * tower});
        std::int32_t below = kWorld;
        for (std::int32_t k = 0; k < parameters.boxes; ++k) {
            Body body;
            body.orientation = orientation;
            body.position = {tower * spacing, 0.0, parameters.gap + 0.5 * parameters.height + k * pitch};
            body.mass = graded(parameters.mass, parameters.mass_ratio, parameters.heavy_top, k, parameters.boxes);
            body.inertia = box_inertia(body.mass, edges);
            shake(body, parameters.speed, parameters.speed / parameters.width, random);
            const std::int32_t box = assembly.add(body);
            const double halfway = -0.5 * (parameters.height + parameters.gap);
            for (const double y : {-0.5, 0.5}) {
                for (const double x : {-0.5, 0.5}) {
                    const Vector3d corner(x * parameters.width, y * parameters.depth, halfway);
                    assembly.contact(below, box, body.position + orientation * corner, Vector3d::UnitZ(),
                                     parameters.gap, parameters.mu);
                }
            }
            below = box;
        }
    }
    Problem problem = assembly.finish(fmt::format("box_stack-{}x{}", parameters.towers, parameters.boxes));
    return parameters.glue ? glued(problem) : problem;
}

}  // namespace delassus
