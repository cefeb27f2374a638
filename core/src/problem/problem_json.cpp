// SPDX-License-Identifier: BSD-3-Clause
#include "problem/problem_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "delassus/error.hpp"
#include "problem/cone_kinds.hpp"
#include "support/json.hpp"
#include "support/nearest_name.hpp"

namespace delassus {
namespace {

using Json = nlohmann::json;
using OrderedJson = nlohmann::ordered_json;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::array<std::string_view, 9> top_keys = {"format", "version", "n",     "m",    "law",
                                                      "cones",  "source",  "notes", "extra"};

/// The keys of a run of cones: rows one by one, or `count` blocks of `dimension` rows.
std::vector<std::string_view> keys_of(const sdk::ConeOperations& kind) {
    std::vector<std::string_view> keys = {"kind"};
    if (kind.is_separable()) {
        keys.emplace_back("rows");
    } else {
        keys.insert(keys.end(), {"count", "dimension"});
    }
    for (const auto& parameter : kind.named_parameters()) keys.push_back(parameter.key);
    if (kind.has_bounds) keys.insert(keys.end(), {"lo", "hi"});
    return keys;
}

/// A JSON value with the place where it stands, for messages.
class Node {
public:
    Node(const Json& json, std::string place) : json_(json), place_(std::move(place)) {}

    template <class... Arguments>
    [[noreturn]] void refuse(fmt::format_string<Arguments...> text, Arguments&&... arguments) const {
        throw InputError(fmt::format("{} {}.", place_, fmt::format(text, std::forward<Arguments>(arguments)...)));
    }

    void keys(std::span<const std::string_view> known) const {
        if (!json_.is_object()) refuse("must be an object, but is {}", shown());
        for (const auto& item : json_.items()) {
            if (std::find(known.begin(), known.end(), item.key()) == known.end()) {
                refuse("has the unknown key \"{}\"{}", item.key().substr(0, 80), nearest_name_hint(item.key(), known));
            }
        }
    }

    [[nodiscard]] bool has(std::string_view key) const { return json_.contains(key); }

    [[nodiscard]] Node at(std::string_view key) const {
        const auto found = json_.find(key);
        if (found == json_.end()) refuse("lacks the key \"{}\"", key);
        return {*found, fmt::format("{}{}\"{}\"", place_, place_.back() == ':' ? " " : ": ", key)};
    }

    [[nodiscard]] std::int32_t integer(std::int32_t least) const {
        if (!json_.is_number_integer()) refuse("must be an integer, but is {}", shown());
        constexpr auto most = std::numeric_limits<std::int32_t>::max() - 1;
        const bool too_large = json_.is_number_unsigned() && json_.get<std::uint64_t>() > most;
        if (too_large || json_.get<std::int64_t>() < least) {
            refuse("is {}, but must be an integer from {} to {}", shown(), least, most);
        }
        return static_cast<std::int32_t>(json_.get<std::int64_t>());
    }

    [[nodiscard]] std::string text() const {
        if (!json_.is_string()) refuse("must be a text in quotes, but is {}", shown());
        return json_.get<std::string>();
    }

    [[nodiscard]] const Json& json() const { return json_; }

    /// One number, or a list of `count` numbers. null stands for if_null; NaN there means that null is refused.
    [[nodiscard]] std::vector<double> numbers(std::int32_t count, double if_null) const {
        if (!json_.is_array()) return {number(json_, if_null)};
        if (json_.size() != static_cast<std::size_t>(count)) {
            refuse("has {} numbers; one number or a list of {} must stand here", json_.size(), count);
        }
        std::vector<double> values;
        values.reserve(json_.size());
        for (const Json& element : json_) values.push_back(number(element, if_null));
        return values;
    }

private:
    [[nodiscard]] double number(const Json& json, double if_null) const {
        if (json.is_null() && !std::isnan(if_null)) return if_null;
        if (!json.is_number()) {
            refuse("must hold numbers{}, but holds {}", std::isnan(if_null) ? "" : " or null (infinite)", shown(json));
        }
        return json.get<double>();
    }

    [[nodiscard]] static std::string shown(const Json& json) {
        if (json.is_structured()) return json.is_array() ? "a list" : "an object";
        std::string text = json.dump(-1, ' ', true, Json::error_handler_t::replace);
        if (text.size() > 60) text = text.substr(0, 60) + "…";
        return text;
    }
    [[nodiscard]] std::string shown() const { return shown(json_); }

    const Json& json_;
    std::string place_;
};

ProblemJson::Run parse_run(const Node& node) {
    if (!node.json().is_object()) node.refuse("must be an object like {{\"kind\": \"free\", \"rows\": 3}}");
    const std::string kind = node.at("kind").text();
    const auto* found = find_cone_kind(kind);
    if (!found) {
        std::vector<std::string_view> names;
        for (const auto& row : sdk::cone_table) names.push_back(row.name);
        node.refuse("has the unknown kind \"{}\"{}", kind.substr(0, 80), nearest_name_hint(kind, names));
    }
    ProblemJson::Run run;
    run.kind = static_cast<ConeKind>(found->kind);
    node.keys(keys_of(*found));
    if (found->is_separable()) {
        run.rows = node.at("rows").integer(1);
    } else {
        run.count = node.at("count").integer(1);
        run.rows = found->usual_rows;
    }
    for (const auto& parameter : found->named_parameters()) {
        const Node values = node.at(parameter.key);
        run.parameters.push_back(values.numbers(run.count, std::numeric_limits<double>::quiet_NaN()));
        for (const double value : run.parameters.back()) {
            if (!parameter.takes(value))
                values.refuse("is {}, but a {} must be {}", value, parameter.name, domain_of(parameter));
        }
    }
    if (!found->is_separable() && node.has("dimension")) {
        const Node dimension = node.at("dimension");
        run.rows = dimension.integer(0);
        if (run.rows < found->least_rows || run.rows > found->most_rows)
            dimension.refuse("is {}, but must be {}", run.rows, found->allowed_rows);
    }
    if (found->has_bounds) {
        run.lo = node.at("lo").numbers(run.rows, -infinity);
        run.hi = node.at("hi").numbers(run.rows, infinity);
    }
    return run;
}

OrderedJson bounds_json(const std::vector<double>& bounds) {
    OrderedJson list = OrderedJson::array();
    for (const double bound : bounds) list.push_back(std::isinf(bound) ? OrderedJson(nullptr) : OrderedJson(bound));
    const bool same = std::all_of(bounds.begin(), bounds.end(), [&](double bound) {
        return bound == bounds[0] && std::signbit(bound) == std::signbit(bounds[0]);
    });
    return same ? list[0] : list;
}

/// Parameter k of all cones of a run.
OrderedJson parameter_json(std::span<const Cone> cones, std::size_t k) {
    const double first = cones[0].parameters[k];
    const bool same = std::all_of(cones.begin(), cones.end(), [&](const Cone& cone) {
        return cone.parameters[k] == first && std::signbit(cone.parameters[k]) == std::signbit(first);
    });
    if (same) return first;
    OrderedJson list = OrderedJson::array();
    for (const Cone& cone : cones) list.push_back(cone.parameters[k]);
    return list;
}

}  // namespace

ProblemJson parse_problem_json(std::string_view text, const std::string& file) {
    Json document;
    try {
        document = parse_json(text);
    } catch (const Json::exception& error) {
        // "[json.exception.parse_error.101] parse error at line 2, column 5: …": without the number of the exception.
        std::string reason = error.what();
        const std::size_t bracket = reason.find("] ");
        if (bracket != std::string::npos) reason.erase(0, bracket + 2);
        if (reason.size() > 300) reason = reason.substr(0, 300) + "…";
        throw InputError(fmt::format("{} is not valid JSON: {}.", file, reason));
    }
    const Node top(document, file + ":");
    top.keys(top_keys);
    const Node format = top.at("format");
    if (format.text() != "delassus-problem") {
        format.refuse("is \"{}\", but must be \"delassus-problem\"", format.text().substr(0, 80));
    }
    const Node version = top.at("version");
    const std::int32_t number = version.integer(0);
    if (number != 1) version.refuse("is {}, but this library reads version 1", number);

    ProblemJson result;
    result.n = top.at("n").integer(0);
    result.m = top.at("m").integer(0);
    if (top.has("source")) result.source = top.at("source").text();
    if (top.has("notes")) result.notes = top.at("notes").text();
    const Node cones = top.at("cones");
    if (!cones.json().is_array()) cones.refuse("must be a list of runs of cones");
    std::int64_t rows = 0;
    std::string lawful;  // a kind of cone that asks for a law
    for (std::size_t k = 0; k < cones.json().size(); ++k) {
        result.runs.push_back(parse_run({cones.json()[k], fmt::format("{}: cones[{}]", file, k)}));
        const ProblemJson::Run& run = result.runs.back();
        rows += std::int64_t{run.rows} * run.count;
        if (const auto& kind = operations_of(run.kind); kind.has_law()) lawful = kind.plural;
        if (rows > result.m) break;
    }
    if (rows != result.m) {
        cones.refuse("cover {}{} rows, but m is {}", rows > result.m ? "at least " : "", rows, result.m);
    }
    if (top.has("law")) {
        const Node law = top.at("law");
        try {
            result.law = law_of(law.text());
        } catch (const InputError& error) {
            throw InputError(fmt::format("{}: {}", file, error.what()));
        }
    } else if (!lawful.empty()) {
        top.refuse("lacks the key \"law\", which must say associated or coulomb where there are {}", lawful);
    }
    return result;
}

std::vector<Cone> expand_cones(const ProblemJson& json) {
    const auto spread = [](const std::vector<double>& values, std::int32_t count) {
        return values.size() == 1 ? std::vector<double>(static_cast<std::size_t>(count), values[0]) : values;
    };
    std::vector<Cone> cones;
    for (const ProblemJson::Run& run : json.runs) {
        Cone cone{run.kind, run.rows, {}, spread(run.lo, run.rows), spread(run.hi, run.rows)};
        for (std::int32_t block = 0; block < run.count; ++block) {
            for (std::size_t k = 0; k < run.parameters.size(); ++k) {
                const auto& values = run.parameters[k];
                cone.parameters[k] = values.size() == 1 ? values[0] : values[static_cast<std::size_t>(block)];
            }
            cones.push_back(cone);
        }
    }
    return cones;
}

std::string problem_json_text(const Problem& problem) {
    OrderedJson document = OrderedJson::object();  // nlohmann crashes where memory ends as a null becomes one
    document["format"] = "delassus-problem";
    document["version"] = 1;
    document["n"] = problem.n();
    document["m"] = problem.m();
    document["law"] = name_of(problem.law);
    OrderedJson runs = OrderedJson::array();
    const std::span<const Cone> cones(problem.cones);
    for (std::size_t first = 0, last = 0; first < cones.size(); first = last) {
        const Cone& cone = cones[first];
        last = first + 1;
        OrderedJson run = OrderedJson::object();
        const sdk::ConeOperations& kind = operations_of(cone);
        run["kind"] = kind.name;
        if (kind.is_separable()) {
            run["rows"] = cone.rows;
        } else {
            while (last < cones.size() && cones[last].kind == cone.kind && cones[last].rows == cone.rows) ++last;
            run["count"] = last - first;
        }
        for (std::size_t k = 0; k < kind.named_parameters().size(); ++k)
            run[std::string(kind.parameters[k].key)] = parameter_json(cones.subspan(first, last - first), k);
        if (!kind.is_separable() && cone.rows != kind.usual_rows) run["dimension"] = cone.rows;
        if (kind.has_bounds) {
            run["lo"] = bounds_json(cone.lo);
            run["hi"] = bounds_json(cone.hi);
        }
        runs.push_back(std::move(run));
    }
    document["cones"] = std::move(runs);
    if (!problem.source.empty()) document["source"] = problem.source;
    if (!problem.notes.empty()) document["notes"] = problem.notes;
    return json_text(document, 1) + "\n";
}

}  // namespace delassus
