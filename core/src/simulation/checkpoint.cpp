// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/checkpoint.hpp"

#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <nlohmann/json.hpp>

#include "delassus/error.hpp"
#include "support/atomic_file.hpp"
#include "support/text_file.hpp"

namespace delassus {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view format = "delassus-checkpoint";
constexpr int version = 2;
constexpr std::size_t digits = 16;

// Numbers are their 64 bits in hexadecimal, one after the other: no digit is lost, and zeros keep their signs.
std::string bits(const std::vector<double>& values) {
    std::string text;
    text.reserve(digits * values.size());
    for (const double value : values)
        fmt::format_to(std::back_inserter(text), "{:016x}", std::bit_cast<std::uint64_t>(value));
    return text;
}

std::vector<double> numbers(const Json& json) {
    const auto& text = json.get_ref<const std::string&>();
    std::vector<double> values;
    for (std::size_t at = 0; at < text.size(); at += digits) {
        std::uint64_t one = 0;
        const char* end = text.data() + std::min(at + digits, text.size());
        const auto [stop, error] = std::from_chars(text.data() + at, end, one, 16);
        if (error != std::errc() || stop != end || end != text.data() + at + digits)
            throw InputError("a number is damaged");
        values.push_back(std::bit_cast<double>(one));
    }
    return values;
}

Json json_of(const SimulationTotals& totals) {
    return {{"reals", bits({totals.start_energy, totals.energy, totals.worst_drift, totals.worst_penetration,
                            totals.worst_natural, totals.seconds, totals.solver_seconds, totals.smallest_step,
                            totals.largest_step, totals.start_kinetic, totals.potential_drop, totals.recovered,
                            totals.growth, totals.growth_share, totals.worst_linearization})},
            {"rejected", totals.rejected},
            {"impacts", totals.impacts},
            {"most_contacts", totals.most_contacts},
            {"newton_iterations", totals.newton_iterations},
            {"solver_iterations", totals.solver_iterations},
            {"plugin_solves", totals.plugin_solves},
            {"resting_parts", totals.resting_parts},
            {"unsolved_steps", totals.unsolved_steps},
            {"first_unsolved", totals.first_unsolved}};
}

SimulationTotals totals_of(const Json& json) {
    SimulationTotals totals;
    const auto reals = numbers(json.at("reals"));
    if (reals.size() != 15) throw InputError("the totals are not complete");
    totals.start_energy = reals[0];
    totals.energy = reals[1];
    totals.worst_drift = reals[2];
    totals.worst_penetration = reals[3];
    totals.worst_natural = reals[4];
    totals.seconds = reals[5];
    totals.solver_seconds = reals[6];
    totals.smallest_step = reals[7];
    totals.largest_step = reals[8];
    totals.start_kinetic = reals[9];
    totals.potential_drop = reals[10];
    totals.recovered = reals[11];
    totals.growth = reals[12];
    totals.growth_share = reals[13];
    totals.worst_linearization = reals[14];
    json.at("rejected").get_to(totals.rejected);
    json.at("impacts").get_to(totals.impacts);
    json.at("most_contacts").get_to(totals.most_contacts);
    json.at("newton_iterations").get_to(totals.newton_iterations);
    json.at("solver_iterations").get_to(totals.solver_iterations);
    json.at("plugin_solves").get_to(totals.plugin_solves);
    json.at("resting_parts").get_to(totals.resting_parts);
    json.at("unsolved_steps").get_to(totals.unsolved_steps);
    json.at("first_unsolved").get_to(totals.first_unsolved);
    return totals;
}

}  // namespace

void write_checkpoint(const Checkpoint& checkpoint, const std::filesystem::path& file) {
    Json json = {{"format", format},
                 {"version", version},
                 {"scene", checkpoint.scene},
                 {"contact_forces", checkpoint.contact_forces},
                 {"systems", Json::array()}};
    for (const auto& system : checkpoint.systems) {
        const auto& simulation = system.simulation;
        json["systems"].push_back({{"name", system.name},
                                   {"step", simulation.step},
                                   {"seconds", simulation.state.t},
                                   {"t", bits({simulation.state.t})},
                                   {"q", bits(simulation.state.q)},
                                   {"v", bits(simulation.state.v)},
                                   {"memory", bits(simulation.memory)},
                                   {"control", bits(simulation.control)},
                                   {"sleeping", bits(simulation.sleeping)},
                                   {"totals", json_of(simulation.totals)},
                                   {"frame_times", bits(system.frame_times)}});
    }
    write_file_atomically(file, json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

Checkpoint read_checkpoint(const std::filesystem::path& file) {
    const std::string text = read_file(file);
    try {
        const Json json = Json::parse(text);
        if (json.at("format") != format) throw InputError("it is not a checkpoint of Delassus");
        if (json.at("version") != version) throw InputError("it was written by another version of Delassus");
        Checkpoint checkpoint;
        json.at("scene").get_to(checkpoint.scene);
        json.at("contact_forces").get_to(checkpoint.contact_forces);
        for (const Json& one : json.at("systems")) {
            CheckpointedSystem system;
            one.at("name").get_to(system.name);
            one.at("step").get_to(system.simulation.step);
            const auto t = numbers(one.at("t"));
            if (t.size() != 1) throw InputError("it holds no time");
            system.simulation.state = {t[0], numbers(one.at("q")), numbers(one.at("v"))};
            system.simulation.memory = numbers(one.at("memory"));
            system.simulation.control = numbers(one.at("control"));
            system.simulation.sleeping = numbers(one.at("sleeping"));
            system.simulation.totals = totals_of(one.at("totals"));
            system.frame_times = numbers(one.at("frame_times"));
            checkpoint.systems.push_back(std::move(system));
        }
        return checkpoint;
    } catch (const Json::exception&) {
        throw InputError(fmt::format("{}: the checkpoint is damaged", file.string()));
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}: the checkpoint cannot be used: {}", file.string(), error.what()));
    }
}

}  // namespace delassus
