// SPDX-License-Identifier: BSD-3-Clause
#include "scene/overrides.hpp"

#include <charconv>
#include <optional>

namespace delassus::scene {
namespace {

/// The place of a list's item given by its position or its name.
std::optional<std::size_t> position_of(const YAML::Node& list, const std::string& step) {
    std::size_t position = 0;
    const auto [end, error] = std::from_chars(step.data(), step.data() + step.size(), position);
    if (error == std::errc() && end == step.data() + step.size())
        return position < list.size() ? std::optional(position) : std::nullopt;
    for (std::size_t i = 0; i < list.size(); ++i) {
        const YAML::Node item = list[i];
        if (item.IsMap() && std::as_const(item)["name"].IsDefined() && item["name"].IsScalar() &&
            item["name"].Scalar() == step)
            return i;
    }
    return std::nullopt;
}

/// The valid alternatives to a step that leads nowhere.
std::string choices(const YAML::Node& node, const std::string& step) {
    std::vector<std::string> names;
    if (node.IsMap())
        for (const auto& entry : node)
            if (entry.first.IsScalar()) names.push_back(entry.first.Scalar());
    if (node.IsSequence()) {
        for (const auto& item : node)
            if (item.IsMap() && item["name"].IsDefined() && item["name"].IsScalar())
                names.push_back(item["name"].Scalar());
        if (names.empty()) return fmt::format("; the list has {} items", node.size());
    }
    const std::vector<std::string_view> views(names.begin(), names.end());
    return nearest_name_hint(step, views);
}

}  // namespace

void set_value(Source& source, const YAML::Node& root, const std::string& path, const std::string& text) {
    const std::string place = fmt::format("--set {}={}", path, text);
    YAML::Node value;
    try {
        value = YAML::Load(text);
    } catch (const YAML::Exception& error) {
        throw InputError(fmt::format("{}: the value is not valid YAML: {}", place, error.msg));
    }
    source.comes_from(value, place);
    YAML::Node node = root;
    for (std::size_t begin = 0;;) {
        const auto dot = path.find('.', begin);
        const std::string step = path.substr(begin, dot == std::string::npos ? dot : dot - begin);
        const bool last = dot == std::string::npos;
        if (node.IsSequence()) {
            const auto position = position_of(node, step);
            if (!position)
                throw InputError(fmt::format("{}: there is no item \"{}\"{}", place, step, choices(node, step)));
            if (last) {
                node[*position] = value;
                return;
            }
            node.reset(node[*position]);
        } else if (node.IsMap()) {
            if (last) {
                node[step] = value;
                for (const auto& entry : node)
                    if (entry.first.IsScalar() && entry.first.Scalar() == step && entry.first.Mark().is_null())
                        source.comes_from(entry.first, place);
                return;
            }
            // solver.tolerance=1e-4 where the file names no solver, or says solver: pgs.
            const YAML::Node known = std::as_const(node)[step];
            const bool absent = !known.IsDefined() &&
                                (step == "solver" || step == "integrator" || step == "limits" || step == "options");
            const bool short_form = known.IsDefined() && known.IsScalar() && (step == "solver" || step == "integrator");
            if (absent || short_form) {
                YAML::Node section(YAML::NodeType::Map);
                if (short_form) section["name"] = known.Scalar();
                source.comes_from(section, place);
                node[step] = section;
            }
            const YAML::Node next = std::as_const(node)[step];
            if (!next.IsDefined())
                throw InputError(fmt::format("{}: there is no key \"{}\"{}", place, step, choices(node, step)));
            node.reset(next);
        } else {
            throw InputError(fmt::format("{}: \"{}\" leads into a single value", place, step));
        }
        begin = dot + 1;
    }
}

}  // namespace delassus::scene
