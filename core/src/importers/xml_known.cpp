// SPDX-License-Identifier: BSD-3-Clause
#include "importers/xml_known.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <string_view>

namespace delassus::importers {

namespace {

/// Numbers are equal as numbers, and words of truth are numbers.
bool same_value(const std::string& a, const std::string& b) {
    const auto number = [](const std::string& text, double& value) {
        if (text == "true" || text == "false") {
            value = text == "true" ? 1.0 : 0.0;
            return true;
        }
        char* end = nullptr;
        value = std::strtod(text.c_str(), &end);
        return end != text.c_str() && std::string_view(end).find_first_not_of(" \t\r\n") == std::string_view::npos;
    };
    double of_a = 0.0, of_b = 0.0;
    return number(a, of_a) && number(b, of_b) ? of_a == of_b : a == b;
}

enum class Takes { Nothing, All, NoPart };  // NoPart: it is known, and what is in it is not looked at

Takes takes(std::string_view words, std::string_view name, const std::string& value) {
    while (!words.empty()) {
        const std::string_view word = words.substr(0, words.find(' '));
        words.remove_prefix(std::min(words.size(), word.size() + 1));
        if (word == name) return Takes::All;
        if (word.substr(0, name.size()) != name) continue;
        const std::string_view rest = word.substr(name.size());
        if (rest == "~") return Takes::NoPart;
        if (rest.starts_with('=')) return same_value(value, std::string(rest.substr(1))) ? Takes::All : Takes::Nothing;
    }
    return Takes::Nothing;
}

const KnownElement* find(std::span<const KnownElement> known, std::string_view name, const std::string& around) {
    const KnownElement* found = nullptr;
    for (const KnownElement& one : known) {
        if (one.name == around + "/" + std::string(name)) return &one;
        if (one.name == name) found = &one;
    }
    return found;
}

}  // namespace

void note_unknown(const XmlElement& element, std::span<const KnownElement> known, const std::string& format,
                  model_import::Model& model, const std::string& around, const std::string& of) {
    const KnownElement* own = find(known, element.name, around);
    const std::string name = element.text("name");
    const std::string what = !name.empty() ? fmt::format("{} \"{}\"", element.name, name)
                             : of.empty()  ? fmt::format("<{}>", element.name)
                                           : fmt::format("<{}> of {}", element.name, of);
    const std::string why = fmt::format("{} as it is read here does not have it", format);
    for (const XmlAttribute& one : element.attributes)
        if (!one.name.starts_with("xmlns") &&
            takes(own == nullptr ? "" : own->attributes, one.name, one.value) == Takes::Nothing)
            model.lose(fmt::format("attribute {}=\"{}\" of {}", one.name, one.value, what), why);
    for (const XmlElement& child : element.children) {
        const Takes how = takes(own == nullptr ? "" : own->children, child.name, child.content);
        if (how == Takes::Nothing)
            model.lose(fmt::format("element <{}> of {}", child.name, what), why);
        else if (how == Takes::All)
            note_unknown(child, known, format, model, element.name, what);
    }
}

}  // namespace delassus::importers
