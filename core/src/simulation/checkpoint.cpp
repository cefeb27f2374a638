// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/checkpoint.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <charconv>
#include <type_traits>
#include <variant>

#include "delassus/error.hpp"
#include "simulation/step_columns.hpp"
#include "support/atomic_file.hpp"
#include "support/json.hpp"
#include "support/text_file.hpp"

namespace delassus {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view format = "delassus-checkpoint";
constexpr int version = 6;
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

/// By names; real numbers as bits.
Json json_of(const SimulationTotals& totals) {
    Json json = Json::object();
    const auto put = [&](const char* name, auto member) {
        if constexpr (std::is_same_v<decltype(member), double SimulationTotals::*>) {
            json[name] = bits({totals.*member});
        } else {
            json[name] = totals.*member;
        }
    };
    for (const TotalColumn& column : total_columns)
        std::visit([&](auto member) { put(column.name, member); }, column.value);
    return json;
}

double number(const Json& json) {
    const auto values = numbers(json);
    if (values.size() != 1) throw InputError("a number is damaged");
    return values[0];
}

SimulationTotals totals_of(const Json& json) {
    SimulationTotals totals;
    const auto take = [&](const Json& value, auto member) {
        if constexpr (std::is_same_v<decltype(member), double SimulationTotals::*>) {
            totals.*member = number(value);
        } else {
            value.get_to(totals.*member);
        }
    };
    for (const TotalColumn& column : total_columns) {
        if (!json.contains(column.name)) throw InputError(fmt::format("its totals lack \"{}\"", column.name));
        std::visit([&](auto member) { take(json.at(column.name), member); }, column.value);
    }
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
                                   {"turns", bits(simulation.turns)},
                                   {"memory", bits(simulation.memory)},
                                   {"control", bits(simulation.control)},
                                   {"ahead", bits(simulation.ahead)},
                                   {"rows_left_out", simulation.rows_left_out},
                                   {"sleeping", bits(simulation.sleeping)},
                                   {"totals", json_of(simulation.totals)},
                                   {"frame_times", bits(system.frame_times)},
                                   {"picture_times", bits(system.picture_times)}});
    }
    write_file_atomically(file, json_text(json, 1) + "\n");
}

Checkpoint read_checkpoint(const std::filesystem::path& file) {
    const std::string text = read_file(file);
    try {
        const Json json = parse_ordered_json(text);
        if (json.at("format") != format) throw InputError("it is not a checkpoint of Delassus");
        if (json.at("version") != version) throw InputError("it was written by another version of Delassus");
        Checkpoint checkpoint;
        json.at("scene").get_to(checkpoint.scene);
        json.at("contact_forces").get_to(checkpoint.contact_forces);
        for (const Json& one : json.at("systems")) {
            CheckpointedSystem system;
            one.at("name").get_to(system.name);
            one.at("step").get_to(system.simulation.step);
            system.simulation.state = {number(one.at("t")), numbers(one.at("q")), numbers(one.at("v"))};
            system.simulation.turns = numbers(one.at("turns"));
            system.simulation.memory = numbers(one.at("memory"));
            system.simulation.control = numbers(one.at("control"));
            system.simulation.ahead = numbers(one.at("ahead"));
            system.simulation.sleeping = numbers(one.at("sleeping"));
            one.at("rows_left_out").get_to(system.simulation.rows_left_out);
            system.simulation.totals = totals_of(one.at("totals"));
            system.frame_times = numbers(one.at("frame_times"));
            system.picture_times = numbers(one.at("picture_times"));
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
