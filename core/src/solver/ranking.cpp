// SPDX-License-Identifier: BSD-3-Clause
#include "solver/ranking.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "delassus/error.hpp"
#include "delassus/sdk/cones.hpp"
#include "problem/need_of.hpp"
#include "support/json.hpp"
#include "support/nearest_name.hpp"
#include "support/sentence.hpp"
#include "support/text_file.hpp"

namespace delassus {

namespace {

void check_keys(const nlohmann::json& object, const std::vector<std::string_view>& known, std::string_view where) {
    if (!object.is_object()) throw InputError(fmt::format("{} must be an object", where));
    for (const auto& [key, value] : object.items())
        if (std::find(known.begin(), known.end(), key) == known.end())
            throw InputError(fmt::format("{} has no key \"{}\"{}", where, key, nearest_name_hint(key, known)));
}

Range read_range(const nlohmann::json& bounds) {
    Range range;
    range.smallest = bounds.at(0).get<double>();
    if (!bounds.at(1).is_null()) range.largest = bounds.at(1).get<double>();
    return range;
}

RankedSolver read_solver(const nlohmann::json& json) {
    check_keys(json, {"solver", "options", "iterations", "law"}, "a solver of an order");
    RankedSolver ranked;
    ranked.solver = json.at("solver").get<std::string>();
    if (json.contains("options")) ranked.options = json.at("options").get<OptionTexts>();
    if (json.contains("law")) ranked.law = law_of(json.at("law").get<std::string>());
    ranked.iterations = json.at("iterations").get<double>();
    if (!(ranked.iterations > 0.0))
        throw InputError(fmt::format("{} has {} iterations", ranked.solver, ranked.iterations));
    return ranked;
}

Order read_order(const nlohmann::json& json) {
    check_keys(json, {"name", "when", "solvers"}, "an order");
    Order order;
    order.name = json.at("name").get<std::string>();
    const nlohmann::json& when = json.at("when");
    check_keys(when, {"linear", "step", "partitioned", "law", "m", "rows_per_velocity"},
               fmt::format("\"when\" of \"{}\"", order.name));
    if (when.contains("linear")) order.linear = when.at("linear").get<bool>();
    if (when.contains("step")) order.step = when.at("step").get<bool>();
    if (when.contains("partitioned")) order.partitioned = when.at("partitioned").get<bool>();
    if (when.contains("law")) order.law = law_of(when.at("law").get<std::string>());
    if (when.contains("m")) order.m = read_range(when.at("m"));
    if (when.contains("rows_per_velocity")) order.rows_per_velocity = read_range(when.at("rows_per_velocity"));
    for (const auto& solver : json.at("solvers")) order.solvers.push_back(read_solver(solver));
    return order;
}

}  // namespace

bool Order::matches(const RankedNeeds& asked) const {
    if (linear && *linear != ((asked.needs & sdk::cones_not_linear) == 0)) return false;
    if (step && *step != asked.step) return false;
    if (partitioned && *partitioned != ((asked.needs & DELASSUS_CAN_PARTITIONED) != 0)) return false;
    return !law || (asked.needs & need_of(*law)) != 0;
}

Ranking::Ranking(const std::filesystem::path& file) {
    try {
        const nlohmann::json json = parse_json(read_file(file, most_bytes_of_text));
        check_keys(json, {"format", "made_by", "orders"}, "a ranking");
        if (json.at("format") != 2) throw InputError("its format is not 2");
        for (const auto& order : json.at("orders")) orders_.push_back(read_order(order));
        if (orders_.empty() || !json.at("orders").back().at("when").empty())
            throw InputError("its last order must match everything: \"when\": {}");
    } catch (const nlohmann::json::exception& error) {
        throw InputError(fmt::format("the ranking {} cannot be read: {}", file.string(), sentence_of(error)));
    } catch (const InputError& error) {
        throw InputError(fmt::format("the ranking {} cannot be used: {}", file.string(), error.what()));
    }
}

const Order& Ranking::order(const RankedNeeds& asked, const RankedSize& size) const {
    return *std::find_if(orders_.begin(), orders_.end(), [&](const Order& order) {
        return order.matches(asked) && order.m.takes(size.m) && order.rows_per_velocity.takes(size.rows_per_velocity);
    });
}

std::vector<const Order*> Ranking::orders(const RankedNeeds& asked) const {
    std::vector<const Order*> found;
    for (const auto& order : orders_) {
        if (!order.matches(asked)) continue;
        found.push_back(&order);
        if (order.m == Range{} && order.rows_per_velocity == Range{}) break;  // none comes after it
    }
    return found;
}

}  // namespace delassus
