// SPDX-License-Identifier: BSD-3-Clause
#include "relations/random_bodies.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace delassus::relations {
namespace {

void set_material(Draw& draw, const Json& scene, Json& shape) {
    const auto& materials = scene["materials"];
    if (materials.empty() || draw.chance(0.1)) return;
    auto chosen = materials.begin();
    std::advance(chosen, draw.below(static_cast<int>(materials.size())));
    shape["material"] = chosen.key();
}

/// A shape as it stands upright, and half its height.
struct Standing {
    Json shape;
    double half_height = 0.0;
    double width = 0.0;  ///< along x
    bool flat = false;   ///< has a flat bottom and top
};

Standing random_shape(Draw& draw, const Json& scene) {
    Standing result;
    const double size = draw.one_of({0.1, 0.2, 0.2, 0.3, 0.4});
    const double kind = draw.share();
    if (kind < 0.25) {
        const double radius = Draw::rounded(0.5 * size);
        result = {{{"sphere", {{"radius", radius}}}}, radius, 2.0 * radius, false};
    } else if (kind < 0.6) {
        Point edges = {size, size, size};
        if (draw.chance(0.5))
            for (double& edge : edges) edge = Draw::rounded(size * draw.one_of({0.1, 0.5, 1.0, 1.5, 2.0}));
        result = {{{"box", {{"size", edges}}}}, 0.5 * edges[2], edges[0], true};
    } else if (kind < 0.72) {
        const double radius = Draw::rounded(0.25 * size);
        const double length = Draw::rounded(size * draw.one_of({0.5, 1.0, 2.0}));
        result = {{{"capsule", {{"radius", radius}, {"length", length}}}}, radius + 0.5 * length, 2.0 * radius, false};
    } else if (kind < 0.86) {
        const double radius = Draw::rounded(0.5 * size);
        const double length = Draw::rounded(size * draw.one_of({0.2, 1.0, 2.0}));
        result = {{{"cylinder", {{"radius", radius}, {"length", length}}}}, 0.5 * length, 2.0 * radius, true};
    } else {
        // Corners of a brick, each pushed about, so that the hull has volume and holds the origin.
        Json points = Json::array();
        double lowest = 0.0;
        for (int corner = 0; corner < 8; ++corner) {
            Point point{};
            for (std::size_t axis = 0; axis < 3; ++axis)
                point[axis] = Draw::rounded((((corner >> axis) & 1) != 0 ? 0.5 : -0.5) * size * draw.uniform(0.6, 1.2));
            lowest = std::max(lowest, -point[2]);
            points.push_back(point);
        }
        result = {{{"convex", {{"points", points}}}}, lowest, size, false};
    }
    set_material(draw, scene, result.shape);
    return result;
}

/// Mass and moments of a brick of these half widths, turned at will.
void set_mass(Draw& draw, Json& body, double size) {
    const double mass = draw.one_of({0.001, 0.1, 1.0, 1.0, 2.0, 50.0});
    body["mass"] = mass;
    Point square{};
    for (double& entry : square) {
        const double half = size * draw.uniform(0.4, 1.0);
        entry = half * half;
    }
    const double third = mass / 3.0;
    // Twelve digits: nine more than the triangle inequality of the moments needs.
    const auto moment = [&](double a, double b) { return std::stod(fmt::format("{:.12e}", third * (a + b))); };
    body["inertia"] = {{"xx", moment(square[1], square[2])},
                       {"yy", moment(square[0], square[2])},
                       {"zz", moment(square[0], square[1])}};
}

void set_velocities(Draw& draw, Json& body, double probability) {
    body["velocity"] = draw.chance(probability) ? draw.vector(draw.one_of({0.1, 1.0, 5.0})) : Point{};
    body["angular_velocity"] = draw.chance(probability) ? draw.vector(draw.one_of({0.5, 5.0, 20.0})) : Point{};
}

Json turned_by(const Point& axis, int degrees) {
    return {{"axis", axis}, {"angle", degrees}};
}

Json random_turn(Draw& draw, bool any) {
    if (any) return turned_by(draw.direction(0.2), draw.whole(0, 359));
    return turned_by({0.0, 0.0, 1.0}, draw.chance(0.7) ? 0 : draw.whole(0, 359));
}

/// Mass from the shape, or as given.
void set_solid(Draw& draw, Json& body, const Standing& standing) {
    if (standing.shape.contains("convex") || draw.chance(0.3)) {
        set_mass(draw, body, 0.5 * standing.width);
    } else {
        body["density"] = draw.one_of({100.0, 1000.0, 7800.0});
    }
    body["shapes"] = Json::array({standing.shape});
}

/// A second shape beside the first: a dumbbell, a hammer. The mass is then given.
void add_second_shape(Draw& draw, const Json& scene, Json& body) {
    Standing second = random_shape(draw, scene);
    second.shape["position"] = draw.vector(0.2);
    second.shape["orientation"] = random_turn(draw, draw.chance(0.5));
    body.erase("density");
    body.erase("mass");
    body.erase("inertia");
    set_mass(draw, body, 0.15);
    body["shapes"].push_back(second.shape);
}

Json wave(Draw& draw, const Point& direction) {
    Json components = Json::array();
    const bool sine = draw.chance(0.6);
    const double amplitude = draw.uniform(0.01, 0.1), rate = draw.uniform(-1.0, 1.0);
    const double frequency = draw.one_of({0.5, 1.0, 2.0, 5.0});
    for (const double entry : direction)
        if (sine) {
            components.push_back(
                {{"sine", {{"amplitude", Draw::rounded(amplitude * entry)}, {"frequency", frequency}}}});
        } else {
            components.push_back({{"linear", {{"rate", Draw::rounded(rate * entry)}}}});
        }
    return components;
}

void set_motion(Draw& draw, Json& body) {
    Json motion = Json::object();
    const bool turns = draw.chance(0.5);
    if (turns)
        motion["rotation"] = {{"axis", draw.direction()},
                              {"angle", {{"linear", {{"rate", draw.uniform(-3.0, 3.0)}}}}},
                              {"point", body["position"]}};
    if (!turns || draw.chance(0.3)) motion["translation"] = wave(draw, draw.direction());
    body["motion"] = motion;
}

}  // namespace

void add_materials(Draw& draw, Json& scene) {
    Json materials = Json::object();
    const bool friction = draw.chance(0.75), bounces = draw.chance(0.33);
    for (int k = 0, count = draw.whole(0, 3); k < count; ++k) {
        Json material = Json::object();
        material["friction"] = friction ? draw.one_of({0.0, 0.1, 0.3, 0.5, 0.8, 1.5}) : 0.0;
        material["restitution"] = bounces ? draw.one_of({0.0, 0.3, 0.5, 0.9, 1.0}) : 0.0;
        materials[fmt::format("m{}", k)] = material;
    }
    scene["materials"] = materials;
}

void add_ground(Draw& draw, Json& scene) {
    const double kind = draw.share();
    if (kind < 0.15) return;
    Json ground = {{"name", "ground"}, {"position", Point{}}, {"orientation", turned_by({0.0, 0.0, 1.0}, 0)}};
    Json shape = Json::object();
    if (kind < 0.5) {
        shape["plane"] = Json::object();
    } else if (kind < 0.8) {
        shape["box"] = {{"size", Point{4.0, 4.0, 0.4}}};
        ground["position"] = Point{0.0, 0.0, -0.2};
    } else if (kind < 0.9) {
        Json heights = Json::array();
        const double height = draw.one_of({0.0, 0.02, 0.2});
        for (int row = 0; row < 5; ++row) {
            Json line = Json::array();
            for (int column = 0; column < 5; ++column) line.push_back(-draw.uniform(0.0, height));
            heights.push_back(line);
        }
        shape["height_field"] = {{"size", {4.0, 4.0}}, {"heights", heights}};
    } else {
        shape["box"] = {{"size", Point{4.0, 4.0, 0.4}}};
        ground["position"] = Point{0.0, 0.0, -0.2};
        set_motion(draw, ground);
    }
    if (!ground.contains("motion")) ground["fixed"] = true;
    set_material(draw, scene, shape);
    ground["shapes"] = Json::array({shape});
    scene["bodies"].push_back(ground);
}

void add_stacks(Draw& draw, Json& scene, int count) {
    double x = -0.5, top = 0.0, last_width = 0.0;
    bool flush = false;
    for (int number = 0; number < count; ++number) {
        const Standing standing = random_shape(draw, scene);
        const bool lies = !standing.flat && standing.shape.contains("capsule") && draw.chance(0.8);
        const double half = lies ? 0.5 * standing.width : standing.half_height;
        const double gap = draw.one_of({0.0, 0.0, 0.0, 0.01, 0.1, 0.3});
        if (number == 0 || draw.chance(0.4)) {  // a new column
            flush = draw.chance(0.4);
            x = Draw::rounded(x + (number == 0 ? 0.0 : 0.5 * (last_width + standing.width) + (flush ? 0.0 : 0.4)));
            last_width = standing.width;
            top = 0.0;
        }
        const double place = Draw::rounded(top + gap + half);
        top = Draw::rounded(place + half);
        Json body = {{"name", fmt::format("b{}", number)}, {"position", Point{x, 0.0, place}}};
        body["orientation"] = lies ? turned_by({1.0, 0.0, 0.0}, 90) : random_turn(draw, false);
        set_velocities(draw, body, number + 1 == count ? 0.5 : 0.1);
        set_solid(draw, body, standing);
        scene["bodies"].push_back(body);
    }
}

void add_loose_bodies(Draw& draw, Json& scene, int count, bool shapes) {
    int moving = 0;
    for (int number = 0; number < count; ++number) {
        Json body = {{"name", fmt::format("b{}", number)}};
        // Cells of a metre: nothing reaches beyond half of it.
        const Point cell = {static_cast<double>(number % 2), static_cast<double>(number / 2 % 2),
                            static_cast<double>(number / 4) + 0.6};
        Point position{};
        for (std::size_t axis = 0; axis < 3; ++axis)
            position[axis] = Draw::rounded(cell[axis] + (draw.chance(0.5) ? 0.0 : draw.uniform(-0.1, 0.1)));
        if (number > 0 && draw.chance(0.07)) position[0] = Draw::rounded(position[0] * 0.5);
        if (draw.chance(0.2)) position[2] = Draw::rounded(position[2] - 0.3);
        body["position"] = position;
        body["orientation"] = random_turn(draw, draw.chance(0.6));
        const double state = draw.share();
        const bool held = number + 1 < count || moving > 0;
        if (held && state < 0.1) {
            body["fixed"] = true;
        } else if (held && state < 0.18) {
            set_motion(draw, body);
        } else {
            ++moving;
            set_velocities(draw, body, 0.5);
        }
        if (shapes && draw.chance(0.9)) {
            set_solid(draw, body, random_shape(draw, scene));
            if (draw.chance(0.15)) add_second_shape(draw, scene, body);
        } else {
            set_mass(draw, body, draw.uniform(0.1, 0.3));
        }
        if (!moves(body))
            for (const char* key : {"mass", "inertia", "density"}) body.erase(key);
        scene["bodies"].push_back(body);
    }
}

}  // namespace delassus::relations
