// SPDX-License-Identifier: BSD-3-Clause
#include "relations/judge_apart.hpp"

#include <fmt/format.h>

#include <optional>
#include <string_view>

#include "bench/ask.hpp"
#include "bench/event_lines.hpp"
#include "delassus/error.hpp"
#include "process/child_process.hpp"
#include "relations/relations.hpp"

namespace delassus::relations {
namespace {

constexpr double start_limit = 60.0;

Json request_of(const ApartSettings& settings, const std::vector<std::string>& only) {
    Json folders = Json::array();
    for (const auto& folder : settings.plugin_path) folders.push_back(folder.string());
    return {{"plugin_path", folders},
            {"run_limit", settings.run_limit},
            {"scratch", settings.scratch.string()},
            {"only", only}};
}

std::string how_it_ended(const ChildResult& child, double silent) {
    if (child.timed_out) return fmt::format("the process did not react for {:.3g} s and was killed", silent);
    std::string text = child.signal != 0
                           ? signal_name(child.signal)
                           : fmt::format("the process ended with exit code {}", child.exit_code.value_or(0));
    if (const auto line = bench::last_line(child.errors); !line.empty()) text += ": " + line;
    return text;
}

/// Asks until all of them are answered. ask_for: the request for those from this place on. number_at: of a place.
void ask_all(const ApartSettings& settings, std::size_t count, const std::function<Json(std::size_t)>& ask_for,
             const std::function<std::uint64_t(std::size_t)>& number_at,
             const std::function<bool(const ScenesAnswer&)>& hear) {
    // The longest run has a quarter of the step, and four times the time; whoever reacts to its end at all, does so
    // soon.
    const double silent = 4.0 * settings.run_limit + 30.0;
    bool wanted = true;
    for (std::size_t place = 0; place < count && wanted;) {
        bool done = false;
        std::string failure;
        bench::EventLines lines([&](const Json& line) {
            const std::string event = line.at("event");
            if (event == "done") done = true;
            if (event == "failed") failure = line.at("message");
            if (event != "judged" || !wanted) return;
            ScenesAnswer answer{number_at(place++), line.at("seconds"), {}};
            for (const auto& outcome : line.at("outcomes"))
                answer.outcomes.push_back({outcome.at("relation"), outcome.at("verdict"), outcome.at("detail")});
            wanted = hear(answer);
        });
        ChildSettings child;
        child.program = settings.command;
        child.arguments = {"worker", "relations"};
        child.input = json_text(ask_for(place));
        child.environment = {{"OMP_NUM_THREADS", "1"}, {"OPENBLAS_NUM_THREADS", "1"}, {"MKL_NUM_THREADS", "1"}};
        child.timeout = start_limit + silent;
        child.cancelled = [&] { return !wanted || (settings.cancelled && settings.cancelled()); };
        child.on_output = [&](std::string_view piece) {
            lines.add(piece);
            return silent;
        };
        const ChildResult result = run_child(child);
        if (!failure.empty()) throw Error(failure);
        if (result.cancelled || !wanted) return;
        if (done) return;
        wanted = hear({number_at(place++),
                       result.seconds,
                       {{"sound", std::string(name_of(Verdict::Violated)), how_it_ended(result, silent)}}});
    }
}

}  // namespace

void judge_random(const ApartSettings& settings, std::uint64_t seed, std::vector<std::uint64_t> numbers,
                  const std::vector<std::string>& only, const std::function<bool(const ScenesAnswer&)>& hear) {
    const auto ask_for = [&](std::size_t from) {
        Json request = request_of(settings, only);
        request["seed"] = seed;
        request["numbers"] =
            std::vector<std::uint64_t>(numbers.begin() + static_cast<std::ptrdiff_t>(from), numbers.end());
        return request;
    };
    ask_all(
        settings, numbers.size(), ask_for, [&](std::size_t place) { return numbers[place]; }, hear);
}

void judge_documents(const ApartSettings& settings, const std::vector<Json>& documents,
                     const std::vector<std::string>& only, const std::function<bool(const ScenesAnswer&)>& hear) {
    const auto ask_for = [&](std::size_t from) {
        Json request = request_of(settings, only);
        request["scenes"] = std::vector<Json>(documents.begin() + static_cast<std::ptrdiff_t>(from), documents.end());
        return request;
    };
    ask_all(
        settings, documents.size(), ask_for, [](std::size_t place) { return place; }, hear);
}

}  // namespace delassus::relations
