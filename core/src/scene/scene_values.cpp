// SPDX-License-Identifier: BSD-3-Clause
#include "scene/scene_values.hpp"

#include <cmath>
#include <numbers>
#include <optional>
#include <span>

namespace delassus::scene {

double finite_number(const Source& source, const YAML::Node& node, std::string_view key) {
    const auto number = value<double>(source, node, key, "a number");
    if (!std::isfinite(number)) source.refuse(node, fmt::format("\"{}\" is {}; it must be finite", key, number));
    return number;
}

double positive_number(const Source& source, const YAML::Node& node, std::string_view key) {
    const double number = finite_number(source, node, key);
    if (number <= 0.0) source.refuse(node, fmt::format("\"{}\" is {}; it must be positive", key, number));
    return number;
}

double nonnegative_number(const Source& source, const YAML::Node& node, std::string_view key) {
    const double number = finite_number(source, node, key);
    if (number < 0.0) source.refuse(node, fmt::format("\"{}\" is {}; it must not be negative", key, number));
    return number;
}

bool truth(const Source& source, const YAML::Node& node, std::string_view key) {
    return value<bool>(source, node, key, "true or false");
}

std::vector<YAML::Node> elements(const Source& source, const YAML::Node& node, std::string_view key) {
    if (!node.IsSequence()) source.refuse(node, fmt::format("\"{}\" must be a list", key));
    std::vector<YAML::Node> result;
    for (const auto& element : node) result.push_back(element);
    return result;
}

namespace {

template <std::size_t count>
std::array<double, count> numbers(const Source& source, const YAML::Node& node, std::string_view key) {
    if (!node.IsSequence() || node.size() != count)
        source.refuse(node, fmt::format("\"{}\" must be a list of {} numbers", key, count));
    std::array<double, count> result{};
    for (std::size_t i = 0; i < count; ++i) result[i] = finite_number(source, node[i], key);
    return result;
}

/// A missing number is `fallback`; one without a fallback must be there.
double required(const Source& source, const YAML::Node& node, const std::optional<double>& number, std::string_view of,
                std::string_view key) {
    if (!number) source.refuse(node, fmt::format("{} lacks the key \"{}\"", of, key));
    return *number;
}

}  // namespace

Vector3 vector3(const Source& source, const YAML::Node& node, std::string_view key) {
    return numbers<3>(source, node, key);
}

Quaternion orientation(const Source& source, const YAML::Node& node) {
    if (node.IsSequence()) {
        auto q = numbers<4>(source, node, "orientation");
        const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        if (std::abs(norm - 1.0) > 1e-3)
            source.refuse(node,
                          fmt::format("\"orientation\" is a quaternion of length {:.4g}; it must have length 1", norm));
        for (double& part : q) part /= norm;
        return q;
    }
    Vector3 axis{0.0, 0.0, 0.0};
    std::optional<double> angle;
    read_map(source, node, "\"orientation\"",
             {{"axis", [&](const YAML::Node& n) { axis = vector3(source, n, "axis"); }},
              {"angle", [&](const YAML::Node& n) { angle = finite_number(source, n, "angle"); }}});
    const double degrees = required(source, node, angle, "\"orientation\"", "angle");
    const double length = std::hypot(axis[0], axis[1], axis[2]);
    if (length == 0.0) source.refuse(node, "the \"axis\" of \"orientation\" must be a vector that is not zero");
    const double half = 0.5 * degrees * std::numbers::pi / 180.0, s = std::sin(half) / length;
    return {std::cos(half), s * axis[0], s * axis[1], s * axis[2]};
}

namespace {

/// Adds the place to the sentence that a motion is refused with.
template <class Make>
Motion made(const Source& source, const YAML::Node& node, Make&& make) {
    try {
        return make();
    } catch (const InputError& error) {
        source.refuse(node, error.what());
    }
}

std::vector<double> list_of_numbers(const Source& source, const YAML::Node& node, std::string_view key) {
    std::vector<double> result;
    for (const YAML::Node& one : elements(source, node, key)) result.push_back(finite_number(source, one, key));
    return result;
}

Motion table(const Source& source, const YAML::Node& node) {
    std::vector<double> times, values;
    Interpolation interpolation = Interpolation::Linear;
    bool periodic = false;
    read_map(source, node, "\"table\"",
             {{"times", [&](const YAML::Node& n) { times = list_of_numbers(source, n, "times"); }},
              {"values", [&](const YAML::Node& n) { values = list_of_numbers(source, n, "values"); }},
              {"interpolation",
               [&](const YAML::Node& n) {
                   const std::string name = scalar(source, n, "interpolation");
                   if (name != "linear" && name != "cubic")
                       source.refuse(n, fmt::format("\"interpolation\" is \"{}\"; it must be linear or cubic", name));
                   interpolation = name == "cubic" ? Interpolation::Cubic : Interpolation::Linear;
               }},
              {"periodic", [&](const YAML::Node& n) { periodic = truth(source, n, "periodic"); }}});
    return made(source, node, [&] { return Motion::table(times, values, interpolation, periodic); });
}

Motion polynomial(const Source& source, const YAML::Node& node) {
    const auto coefficients = list_of_numbers(source, node, "polynomial");
    return made(source, node, [&] { return Motion::polynomial(coefficients); });
}

Motion ramp(const Source& source, const YAML::Node& node) {
    double from = 0.0, start = 0.0;
    std::int64_t smoothness = 2;
    std::optional<double> to, duration;
    read_map(source, node, "\"ramp\"",
             {{"from", [&](const YAML::Node& n) { from = finite_number(source, n, "from"); }},
              {"to", [&](const YAML::Node& n) { to = finite_number(source, n, "to"); }},
              {"start", [&](const YAML::Node& n) { start = finite_number(source, n, "start"); }},
              {"duration", [&](const YAML::Node& n) { duration = positive_number(source, n, "duration"); }},
              {"smoothness", [&](const YAML::Node& n) {
                   smoothness = value<std::int64_t>(source, n, "smoothness", "1 or 2");
                   if (smoothness != 1 && smoothness != 2)
                       source.refuse(n, fmt::format("\"smoothness\" is {}; it must be 1 or 2", smoothness));
               }}});
    const double end = required(source, node, to, "\"ramp\"", "to"),
                 time = required(source, node, duration, "\"ramp\"", "duration");
    return made(source, node, [&] { return Motion::ramp(from, end, start, time, static_cast<int>(smoothness)); });
}

// A name, or {name, scale, offset, start, range}.
Motion input(const Source& source, const YAML::Node& node, std::string_view key, Inputs* inputs) {
    if (!inputs)
        source.refuse(node,
                      fmt::format("\"{}\" cannot be an input, which jumps: give a motor with \"speed: true\" or an "
                                  "actuator one",
                                  key));
    std::string name;
    InputUse use;
    if (node.IsScalar()) {
        name = scalar(source, node, "input");
    } else {
        read_map(source, node, "\"input\"",
                 {{"name", [&](const YAML::Node& n) { name = scalar(source, n, "name"); }},
                  {"scale", [&](const YAML::Node& n) { use.scale = finite_number(source, n, "scale"); }},
                  {"offset", [&](const YAML::Node& n) { use.offset = finite_number(source, n, "offset"); }},
                  {"start", [&](const YAML::Node& n) { use.start = finite_number(source, n, "start"); }},
                  {"range", [&](const YAML::Node& n) { use.range = numbers<2>(source, n, "range"); }}});
    }
    if (name.empty()) source.refuse(node, "\"input\" lacks a name");
    return made(source, node, [&] { return inputs->motion(name, use); });
}

}  // namespace

Motion motion(const Source& source, const YAML::Node& node, std::string_view key, Inputs* inputs) {
    if (node.IsScalar()) return Motion::constant(finite_number(source, node, key));
    std::optional<Motion> result;
    const auto set = [&](const YAML::Node& n, Motion one) {
        if (result) source.refuse(n, fmt::format("\"{}\" must be one motion, not several", key));
        result = std::move(one);
    };
    read_map(
        source, node, fmt::format("\"{}\"", key),
        {{"table", [&](const YAML::Node& n) { set(n, table(source, n)); }},
         {"polynomial", [&](const YAML::Node& n) { set(n, polynomial(source, n)); }},
         {"ramp", [&](const YAML::Node& n) { set(n, ramp(source, n)); }},
         {"input", [&](const YAML::Node& n) { set(n, input(source, n, key, inputs)); }},
         {"constant", [&](const YAML::Node& n) { set(n, Motion::constant(finite_number(source, n, "constant"))); }},
         {"linear",
          [&](const YAML::Node& n) {
              double start = 0.0;
              std::optional<double> rate;
              read_map(source, n, "\"linear\"",
                       {{"start", [&](const YAML::Node& v) { start = finite_number(source, v, "start"); }},
                        {"rate", [&](const YAML::Node& v) { rate = finite_number(source, v, "rate"); }}});
              set(n, Motion::linear(start, required(source, n, rate, "\"linear\"", "rate")));
          }},
         {"sine", [&](const YAML::Node& n) {
              double phase = 0.0, offset = 0.0;
              std::optional<double> amplitude, frequency;
              read_map(source, n, "\"sine\"",
                       {{"amplitude", [&](const YAML::Node& v) { amplitude = finite_number(source, v, "amplitude"); }},
                        {"frequency", [&](const YAML::Node& v) { frequency = finite_number(source, v, "frequency"); }},
                        {"phase", [&](const YAML::Node& v) { phase = finite_number(source, v, "phase"); }},
                        {"offset", [&](const YAML::Node& v) { offset = finite_number(source, v, "offset"); }}});
              set(n, Motion::sine(required(source, n, amplitude, "\"sine\"", "amplitude"),
                                  required(source, n, frequency, "\"sine\"", "frequency"), phase, offset));
          }}});
    if (!result)
        source.refuse(
            node,
            fmt::format("\"{}\" is empty; it must be constant, linear, sine, table, polynomial, ramp or input", key));
    return *result;
}

std::vector<Copy> repeat(const Source& source, const YAML::Node& node) {
    std::array<std::int64_t, 3> count{1, 1, 1};
    bool counted = false;
    Vector3 spacing{0.0, 0.0, 0.0};
    const auto positive = [&](const YAML::Node& n) {
        const auto number = value<std::int64_t>(source, n, "count", "an integer");
        if (number < 1 || number > 1000000)
            source.refuse(n, fmt::format("\"count\" is {}; it must be from 1 to 1000000", number));
        return number;
    };
    read_map(
        source, node, "\"repeat\"",
        {{"count",
          [&](const YAML::Node& n) {
              counted = true;
              if (n.IsScalar()) {
                  count[0] = positive(n);
                  return;
              }
              const auto list = elements(source, n, "count");
              if (list.size() > 3) source.refuse(n, "\"count\" must be one number or a list of up to three");
              for (std::size_t i = 0; i < list.size(); ++i) count[i] = positive(list[i]);
              if (static_cast<double>(count[0]) * static_cast<double>(count[1]) * static_cast<double>(count[2]) > 1e6)
                  source.refuse(n, "\"count\" asks for more than a million copies");
          }},
         {"spacing", [&](const YAML::Node& n) { spacing = vector3(source, n, "spacing"); }}});
    if (!counted) source.refuse(node, "\"repeat\" lacks the key \"count\"");
    std::vector<Copy> copies;
    for (std::int64_t k = 0; k < count[2]; ++k)
        for (std::int64_t j = 0; j < count[1]; ++j)
            for (std::int64_t i = 0; i < count[0]; ++i) {
                Copy copy{true, {i, j, k}, {}};
                for (std::size_t axis = 0; axis < 3; ++axis)
                    copy.offset[axis] = static_cast<double>(copy.index[axis]) * spacing[axis];
                copies.push_back(copy);
            }
    return copies;
}

std::string name_in(const Source& source, const YAML::Node& node, std::string_view key, const Copy& copy) {
    std::string text = scalar(source, node, key);
    if (!copy.repeated) return text;
    std::string result;
    for (std::size_t at = 0; at < text.size();) {
        const auto close = text[at] == '{' ? text.find('}', at) : std::string::npos;
        if (close == std::string::npos) {
            result += text[at++];
            continue;
        }
        const std::string_view inside = std::string_view(text).substr(at + 1, close - at - 1);
        const bool letter = !inside.empty() && inside[0] >= 'i' && inside[0] <= 'k';
        const bool shifted = inside.size() == 3 && (inside[1] == '+' || inside[1] == '-') && inside[2] == '1';
        if (!letter || (inside.size() != 1 && !shifted))
            source.refuse(node, fmt::format("\"{}\" holds {{{}}}; a repeated name may hold {{i}}, {{j}}, {{k}}, and "
                                            "{{i+1}} or {{i-1}} for its neighbours",
                                            key, inside));
        const std::int64_t shift = !shifted ? 0 : inside[1] == '+' ? 1 : -1;
        result += std::to_string(copy.index[static_cast<std::size_t>(inside[0] - 'i')] + shift);
        at = close + 1;
    }
    return result;
}

Vector3 point_in(const Source& source, const YAML::Node& node, std::string_view key, const Copy& copy) {
    Vector3 point = vector3(source, node, key);
    for (std::size_t axis = 0; axis < 3; ++axis) point[axis] += copy.offset[axis];
    return point;
}

}  // namespace delassus::scene
