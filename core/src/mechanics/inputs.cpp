// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/inputs.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "delassus/error.hpp"
#include "support/nearest_name.hpp"

namespace delassus {

Motion Inputs::motion(const std::string& name, const InputUse& use) {
    auto found = std::find_if(inputs_.begin(), inputs_.end(), [&](const auto& input) { return input->name == name; });
    if (found == inputs_.end()) {
        inputs_.push_back(std::make_shared<Input>());
        inputs_.back()->name = name;
        found = std::prev(inputs_.end());
    }
    const std::shared_ptr<Input> input = *found;
    if (use.start) {
        if (input->start.value_or(*use.start) != *use.start)
            throw InputError(
                fmt::format("the input \"{}\" starts at {}, elsewhere at {}", name, *use.start, *input->start));
        input->start = use.start;
        input->value = *use.start;
    }
    if (use.range) {
        if (input->range.value_or(*use.range) != *use.range)
            throw InputError(fmt::format("the input \"{}\" has the range [{}], elsewhere [{}]", name,
                                         fmt::join(*use.range, ", "), fmt::join(*input->range, ", ")));
        input->range = use.range;
    }
    if (input->range) {
        const auto [lower, upper] = *input->range;
        if (!(lower <= input->value && input->value <= upper))
            throw InputError(fmt::format("the input \"{}\" starts at {}, outside its range [{}, {}]", name,
                                         input->value, lower, upper));
    }
    const double scale = use.scale, offset = use.offset;
    return {.value = [=](double) { return offset + scale * input->value; },
            .rate = [](double) { return 0.0; },
            .acceleration = [](double) { return 0.0; },
            .integral =
                [=](double t) { return offset * t + scale * (input->integral + input->value * (t - input->since)); }};
}

std::vector<std::string> Inputs::names() const {
    std::vector<std::string> result;
    for (const auto& input : inputs_) result.push_back(input->name);
    return result;
}

Inputs::Input& Inputs::find(std::string_view name) const {
    for (const auto& input : inputs_)
        if (input->name == name) return *input;
    if (inputs_.empty()) throw InputError(fmt::format("there is no input \"{}\": the scene has none", name));
    std::vector<std::string_view> choices;
    for (const auto& input : inputs_) choices.push_back(input->name);
    throw InputError(fmt::format("there is no input \"{}\"{}", name, nearest_name_hint(name, choices)));
}

double Inputs::value(std::string_view name) const {
    return find(name).value;
}

void Inputs::set(std::string_view name, double value, double t) {
    Input& input = find(name);
    if (!std::isfinite(value)) throw InputError(fmt::format("the input \"{}\" is {}; it must be finite", name, value));
    input.integral += input.value * (t - input.since);
    input.since = t;
    input.value = input.range ? std::clamp(value, (*input.range)[0], (*input.range)[1]) : value;
}

std::vector<double> Inputs::at_start() const {
    std::vector<double> saved;
    for (const auto& input : inputs_) saved.insert(saved.end(), {input->start.value_or(0.0), 0.0, 0.0});
    return saved;
}

std::vector<double> Inputs::save() const {
    std::vector<double> saved;
    for (const auto& input : inputs_) saved.insert(saved.end(), {input->value, input->since, input->integral});
    return saved;
}

void Inputs::load(const std::vector<double>& saved) {
    if (saved.size() != 3 * inputs_.size())
        throw InputError(fmt::format("{} numbers of inputs for {} inputs", saved.size(), inputs_.size()));
    auto from = saved.begin();
    for (const auto& input : inputs_) {
        input->value = *from++;
        input->since = *from++;
        input->integral = *from++;
    }
}

}  // namespace delassus
