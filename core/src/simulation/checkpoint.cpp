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
#include "support/checksum.hpp"
#include "support/json.hpp"
#include "support/text_file.hpp"

namespace delassus {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view format = "delassus-checkpoint";
constexpr int version = 20;
constexpr std::size_t digits = 16;

/// How a checkpoint of this text ends.
std::string checksum_line(std::string_view text) {
    return fmt::format(" \"crc32\": \"{:08x}\"\n}}\n", checksum(text));
}

void require_whole(std::string_view text) {
    const auto line = text.rfind(" \"crc32\"");
    if (line == std::string_view::npos || text.substr(line) != checksum_line(text.substr(0, line)))
        throw InputError("it is damaged: its checksum is not that of its content");
}

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

std::vector<double> as_numbers(const std::vector<std::uint64_t>& words) {
    std::vector<double> values;
    for (const auto word : words) values.push_back(std::bit_cast<double>(word));
    return values;
}

std::vector<std::uint64_t> as_words(const std::vector<double>& values) {
    std::vector<std::uint64_t> words;
    for (const double value : values) words.push_back(std::bit_cast<std::uint64_t>(value));
    return words;
}

/// The text's last key is a checksum of all before it.
std::string with_checksum(std::string json) {
    json.erase(json.find_last_of('}'));
    while (json.ends_with('\n') || json.ends_with(' ')) json.pop_back();
    json += ",\n";
    return json + checksum_line(json);
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
    for (const TotalColumn& column : total_columns)
        std::visit([&](auto member) { take(json.at(column.name), member); }, column.value);
    return totals;
}

}  // namespace

void write_checkpoint(const Checkpoint& checkpoint, const std::filesystem::path& file) {
    Json json = {{"format", format},
                 {"version", version},
                 {"scene", checkpoint.scene},
                 {"contact_forces", checkpoint.contact_forces},
                 {"every", checkpoint.every},
                 {"pictures", checkpoint.pictures},
                 {"dump", checkpoint.dump.value_or(0)},
                 {"systems", Json::array()}};
    for (const auto& system : checkpoint.systems) {
        const auto& simulation = system.simulation;
        json["systems"].push_back({{"name", system.name},
                                   {"step", simulation.step},
                                   {"seconds", simulation.state.t},
                                   {"t", bits({simulation.state.t})},
                                   {"q", bits(simulation.state.q)},
                                   {"v", bits(simulation.state.v)},
                                   {"memory", bits(simulation.stepping.method)},
                                   {"control", bits(simulation.stepping.control)},
                                   {"ahead", bits(simulation.stepping.ahead)},
                                   {"rows_left_out", simulation.rows_left_out},
                                   {"sleeping", bits(simulation.sleeping)},
                                   {"overlapping", simulation.overlapping},
                                   {"inputs", bits(simulation.inputs)},
                                   {"totals", json_of(simulation.totals)},
                                   {"frame_times", bits(system.frame_times)},
                                   {"picture_times", bits(system.picture_times)},
                                   {"written", bits(as_numbers(system.written))}});
    }
    write_file_atomically(file, with_checksum(json_text(json, 1)));
}

Checkpoint read_checkpoint(const std::filesystem::path& file) {
    const std::string text = read_file(file);
    try {
        const Json json = parse_ordered_json(text);
        if (json.at("format") != format) throw InputError("it is not a checkpoint of Delassus");
        if (json.at("version") != version) throw InputError("it was written by another version of Delassus");
        require_whole(text);
        Checkpoint checkpoint;
        json.at("scene").get_to(checkpoint.scene);
        json.at("contact_forces").get_to(checkpoint.contact_forces);
        json.at("every").get_to(checkpoint.every);
        json.at("pictures").get_to(checkpoint.pictures);
        if (const auto dump = json.at("dump").get<std::int64_t>(); dump > 0) checkpoint.dump = dump;
        for (const Json& one : json.at("systems")) {
            CheckpointedSystem system;
            one.at("name").get_to(system.name);
            one.at("step").get_to(system.simulation.step);
            system.simulation.state = {number(one.at("t")), numbers(one.at("q")), numbers(one.at("v"))};
            system.simulation.stepping.method = numbers(one.at("memory"));
            system.simulation.stepping.control = numbers(one.at("control"));
            system.simulation.stepping.ahead = numbers(one.at("ahead"));
            system.simulation.sleeping = numbers(one.at("sleeping"));
            one.at("rows_left_out").get_to(system.simulation.rows_left_out);
            one.at("overlapping").get_to(system.simulation.overlapping);
            system.simulation.inputs = numbers(one.at("inputs"));
            system.simulation.totals = totals_of(one.at("totals"));
            system.frame_times = numbers(one.at("frame_times"));
            system.picture_times = numbers(one.at("picture_times"));
            system.written = as_words(numbers(one.at("written")));
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
