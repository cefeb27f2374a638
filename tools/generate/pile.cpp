// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <numeric>

#include "delassus/generate_partitioned.hpp"
#include "generate/bodies.hpp"
#include "generate/counted_random.hpp"
#include "generate/family.hpp"
#include "generate/sphere_lattice.hpp"
#include "support/nearest_name.hpp"

namespace delassus {
namespace generating {
namespace {

const Field<PileParameters> pile_fields[] = {
    {"contacts", &PileParameters::contacts, 1, 1e10, "", "the base is the smallest with at least so many contacts"},
    {"layers", &PileParameters::layers, 1, 10000, "", "layers of spheres; every other one is one sphere narrower"},
    {"walls", &PileParameters::walls, 0, 1, "", "1: four fixed walls that touch the wider layers"},
    {"radius", &PileParameters::radius, 1e-6, 1e6, "m", "largest radius of a sphere"},
    {"density", &PileParameters::density, 1e-3, 1e6, "kg/m^3", "of the spheres"},
    {"jitter", &PileParameters::jitter, 0, 0.2, "", "radii are smaller by a random share up to this"},
    {"envelope", &PileParameters::envelope, 0, 0.5, "",
     "neighbours with a gap up to this multiple of the radius are contacts"},
    {"mu", &PileParameters::mu, 0, 1e4, "", "friction coefficient; 0: one nonnegative row a contact"},
    {"speed", &PileParameters::speed, 0, 1e3, "m/s", "amplitude of random velocities"},
    {"gravity", &PileParameters::gravity, 0, 1e3, "m/s^2", "along -z"},
    {"step", &PileParameters::step, 1e-9, 10, "s", "time step h"},
    {"seed", &PileParameters::seed, 0, kLargestSeed, "", "seed of radii and velocities"},
};

/// The lattice of at least so many contacts: the smallest square base, then the narrowest strip of that length. A
/// second layer needs a base of 2 × 2.
SphereLattice lattice_of(const PileParameters& parameters, std::int32_t& columns, std::int32_t& rows) {
    const double wanted = static_cast<double>(parameters.contacts);
    const std::int32_t least = parameters.layers > 1 ? 2 : 1;
    const auto enough = [&](std::int32_t i, std::int32_t j) {
        return SphereLattice(i, j, parameters.layers).contacts(parameters.walls) >= wanted;
    };
    columns = least;
    while (!enough(columns, columns)) ++columns;
    rows = columns;
    while (rows > least && enough(columns, rows - 1)) --rows;
    return {columns, rows, parameters.layers};
}

/// Rows of a LocalMatrix; exact zeros are left out.
class LocalRows {
public:
    explicit LocalRows(LocalMatrix& matrix) : matrix_(matrix) {}
    void put(std::int64_t column, double value) {
        if (value == 0.0) return;
        matrix_.column.push_back(column);
        matrix_.value.push_back(value);
    }
    void put(std::int64_t first, const Vector3d& values) {
        for (int i = 0; i < 3; ++i) put(first + i, values[i]);
    }
    void end_row() {
        matrix_.row_start.push_back(matrix_.entries());
        ++matrix_.rows;
    }

private:
    LocalMatrix& matrix_;
};

/// Two unit vectors that are an orthonormal frame with a unit vector, from the axis with its smallest component.
std::array<Vector3d, 2> tangents_of(const Vector3d& normal) {
    int least = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(normal[i]) < std::abs(normal[least])) least = i;
    const Vector3d first = (Vector3d::Unit(least) - normal[least] * normal).normalized();
    return {first, normal.cross(first)};
}

class PileMaker {
public:
    explicit PileMaker(const PileParameters& parameters)
        : parameters_(parameters), lattice_(lattice_of(parameters, columns_, rows_)), random_(parameters.seed) {}

    [[nodiscard]] const SphereLattice& lattice() const { return lattice_; }

    /// The bodies first … last − 1 with the contacts that belong to them.
    void make(std::int64_t first, std::int64_t last, PartitionedProblem& part) const {
        const auto bodies = static_cast<std::size_t>(last - first);
        part.H.rows = 6 * (last - first);
        part.H.columns = part.D.columns = 6 * lattice_.count();
        for (auto* array : {&part.H.column, &part.H.row_start}) array->reserve(6 * bodies + 1);
        part.H.value.reserve(6 * bodies);
        part.a.reserve(6 * bodies);
        part.body_start.reserve(bodies);
        reserve_contacts(first, last, part);
        LocalRows jacobian(part.D);
        lattice_.visit(first, last, [&](std::int64_t number, const Place& place) {
            put_body(number, place, part);
            put_contacts(number, place, jacobian, part);
        });
    }

private:
    [[nodiscard]] static std::uint64_t name_of(const Place& place) {
        // Distinct for lattices of up to 2²¹ spheres along each side.
        return (static_cast<std::uint64_t>(place[2]) << 42) | (static_cast<std::uint64_t>(place[1]) << 21) |
               static_cast<std::uint64_t>(place[0]);
    }
    [[nodiscard]] double radius_of(const Place& place) const {
        return parameters_.radius * (1.0 - parameters_.jitter * random_.share(name_of(place), 0));
    }
    /// In units of the largest radius.
    [[nodiscard]] static Vector3d lattice_point(const Place& place) {
        const int shift = place[2] & 1;
        return {2.0 * place[0] + shift, 2.0 * place[1] + shift, 1.0 + std::numbers::sqrt2 * place[2]};
    }
    /// A gap that is only rounding of a distance of about two radii is none.
    [[nodiscard]] double gap_of(double gap) const { return std::abs(gap) < 1e-14 * parameters_.radius ? 0.0 : gap; }

    /// Memory for what make() puts in, at most: growing arrays would take up to twice as much for a while.
    void reserve_contacts(std::int64_t first, std::int64_t last, PartitionedProblem& part) const {
        std::size_t fixed = 0, pairs = 0;
        lattice_.visit(first, last, [&](std::int64_t number, const Place& place) {
            each_contact(number, place,
                         [&](std::int64_t other, const Vector3d&, double, double) { ++(other < 0 ? fixed : pairs); });
        });
        const std::size_t rows = parameters_.mu > 0.0 ? 3 : 1, contacts = fixed + pairs;
        const std::size_t entries = rows == 3 ? 15 * fixed + 30 * pairs : 3 * fixed + 6 * pairs;
        part.cones.reserve(contacts);
        part.b.reserve(rows * contacts);
        part.D.row_start.reserve(rows * contacts + 1);
        part.D.column.reserve(entries);
        part.D.value.reserve(entries);
    }

    /// Calls action(other, normal, gap, radius of the other) for the contacts of a sphere with the world (other = −1)
    /// and with spheres of larger numbers, which ascend. The normal points from the world, or to the other.
    template <class Action>
    void each_contact(std::int64_t number, const Place& place, Action&& action) const {
        const double r = parameters_.radius, own = radius_of(place), widest = parameters_.envelope * r;
        const auto fixed = [&](const Vector3d& normal) {
            const double gap = gap_of(r - own);
            if (gap <= widest) action(std::int64_t{-1}, normal, gap, 0.0);
        };
        if (place[2] == 0) fixed(Vector3d::UnitZ());
        if (parameters_.walls && (place[2] & 1) == 0) {
            if (place[0] == 0) fixed(Vector3d::UnitX());
            if (place[0] == columns_ - 1) fixed(-Vector3d::UnitX());
            if (place[1] == 0) fixed(Vector3d::UnitY());
            if (place[1] == rows_ - 1) fixed(-Vector3d::UnitY());
        }
        std::array<std::pair<std::int64_t, Place>, 12> later;  // kept in order; numbers differ
        std::size_t count = 0;
        for (const Place& neighbour : SphereLattice::neighbours_of(place)) {
            if (!lattice_.has(neighbour)) continue;
            const auto other = lattice_.number_of(neighbour);
            if (other <= number) continue;
            std::size_t at = count++;
            for (; at > 0 && later[at - 1].first > other; --at) later[at] = later[at - 1];
            later[at] = {other, neighbour};
        }
        for (std::size_t k = 0; k < count; ++k) {
            const Vector3d between = lattice_point(later[k].second) - lattice_point(place);
            const double length = between.norm(), theirs = radius_of(later[k].second);
            const double gap = gap_of(r * length - own - theirs);
            if (gap <= widest) action(later[k].first, Vector3d(between / length), gap, theirs);
        }
    }

    void put_body(std::int64_t number, const Place& place, PartitionedProblem& part) const {
        const double radius = radius_of(place);
        const double mass = 4.0 / 3.0 * std::numbers::pi * radius * radius * radius * parameters_.density;
        const double inertia = sphere_inertia(mass, radius).x();
        const double fall = parameters_.step * parameters_.gravity;
        for (std::uint64_t i = 0; i < 6; ++i) {
            const double value = i < 3 ? mass : inertia;
            double velocity = parameters_.speed * random_.symmetric(name_of(place), 1 + i);
            if (i >= 3) velocity /= parameters_.radius;
            if (i == 2) velocity -= fall;
            part.H.column.push_back(6 * number + static_cast<std::int64_t>(i));
            part.H.value.push_back(value);
            part.H.row_start.push_back(part.H.entries());
            part.a.push_back(value * velocity);
        }
        part.body_start.push_back(6 * number);
    }

    // A point of a sphere at s from its centre has the velocity v + ω × s, along a direction d: d · v + (s × d) · ω.
    // Along the normal s × n = 0. With u = n · (ṗ_b − ṗ_a) + gap/h as in Assembly::contact(), where a is the world, or
    // the sphere of the smaller number.
    void put_contacts(std::int64_t number, const Place& place, LocalRows& jacobian, PartitionedProblem& part) const {
        const double own = radius_of(place);
        each_contact(number, place, [&](std::int64_t other, const Vector3d& normal, double gap, double theirs) {
            const bool fixed = other < 0;
            const Vector3d here = fixed ? Vector3d(-own * normal) : Vector3d((own + 0.5 * gap) * normal);
            const Vector3d there = -(theirs + 0.5 * gap) * normal;
            const double sign = fixed ? 1.0 : -1.0;
            jacobian.put(6 * number, Vector3d(sign * normal));
            if (!fixed) jacobian.put(6 * other, normal);
            jacobian.end_row();
            part.b.push_back(gap / parameters_.step);
            if (parameters_.mu == 0.0) {
                part.cones.push_back(Cone::nonnegative(1));
                return;
            }
            for (const Vector3d& tangent : tangents_of(normal)) {
                jacobian.put(6 * number, Vector3d(sign * tangent));
                jacobian.put(6 * number + 3, Vector3d(sign * here.cross(tangent)));
                if (!fixed) {
                    jacobian.put(6 * other, tangent);
                    jacobian.put(6 * other + 3, Vector3d(there.cross(tangent)));
                }
                jacobian.end_row();
                part.b.push_back(0.0);
            }
            part.cones.push_back(Cone::friction(parameters_.mu));
        });
    }

    PileParameters parameters_;
    std::int32_t columns_ = 0, rows_ = 0;
    SphereLattice lattice_;
    CountedRandom random_;
};

}  // namespace

Family pile_family() {
    return make_family<PileParameters>("pile", "spheres in a box, made in parts by several processes", pile_fields,
                                       &generate_pile);
}

}  // namespace generating

PartitionedProblem generate_partitioned(const Communicator& communicator, const PileParameters& parameters) {
    using namespace generating;
    PartitionedProblem part;
    std::int64_t bodies = 0;
    const int rank = communicator.rank(), processes = communicator.size();
    const auto first = [&](int process) {
        return bodies / processes * process + bodies % processes * process / processes;
    };
    together(communicator, [&] {
        check_parameters<PileParameters>("pile", pile_fields, parameters);
        const PileMaker maker(parameters);
        bodies = maker.lattice().count();
        maker.make(first(rank), first(rank + 1), part);
    });
    part.name = fmt::format("pile-{}", bodies);
    part.source = fmt::format("{}", to_text(parameters));
    part.column_start.clear();
    part.cone_start = part.row_start = {0};
    for (int process = 0; process <= processes; ++process) part.column_start.push_back(6 * first(process));
    for (const auto cones : communicator.all(static_cast<std::int64_t>(part.cones.size())))
        part.cone_start.push_back(part.cone_start.back() + cones);
    for (const auto rows : communicator.all(part.m())) part.row_start.push_back(part.row_start.back() + rows);
    return part;
}

Problem generate_pile(const PileParameters& parameters) {
    constexpr std::uint64_t most = 20'000'000;
    if (parameters.contacts > most)
        throw InputError(
            fmt::format("pile: a whole problem may have {} contacts; write more into a file that ends in .h5", most));
    return gathered(*single_process(), generate_partitioned(*single_process(), parameters));
}

bool is_generated_problem(std::string_view text) {
    std::error_code error;
    return (text == "pile" || text.starts_with("pile:")) && !std::filesystem::exists(text, error);
}

PileParameters pile_parameters(std::string_view text) {
    using namespace generating;
    if (text != "pile" && !text.starts_with("pile:"))
        throw InputError(fmt::format("\"{}\" is no generated problem; they read pile:KEY=VALUE,KEY=VALUE", text));
    PileParameters parameters;
    std::vector<std::string_view> keys;
    for (const auto& field : pile_fields) keys.push_back(field.key);
    text.remove_prefix(std::min<std::size_t>(text.size(), 5));
    while (!text.empty()) {
        const std::string_view setting = text.substr(0, text.find(','));
        text.remove_prefix(std::min(text.size(), setting.size() + 1));
        const auto equals = setting.find('=');
        const std::string_view key = setting.substr(0, equals);
        const auto field = std::find_if(std::begin(pile_fields), std::end(pile_fields),
                                        [&](const auto& known) { return known.key == key; });
        if (field == std::end(pile_fields))
            throw InputError(fmt::format("pile has no parameter \"{}\"{}", key, nearest_name_hint(key, keys)));
        const std::string_view number = equals == std::string_view::npos ? "" : setting.substr(equals + 1);
        double value = 0.0;
        const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value);
        if (number.empty() || error != std::errc{} || end != number.data() + number.size())
            throw InputError(fmt::format("parameter \"{}\" is \"{}\"; it must be a number", key, number));
        field->check("pile", value);
        field->set(parameters, value);
    }
    return parameters;
}

std::string to_text(const PileParameters& parameters) {
    using namespace generating;
    const PileParameters defaults;
    std::string text = "pile";
    for (const auto& field : pile_fields)
        if (field.get(parameters) != field.get(defaults))
            text += fmt::format("{}{}={}", text == "pile" ? ":" : ",", field.key, field.get(parameters));
    return text;
}

}  // namespace delassus
