// SPDX-License-Identifier: BSD-3-Clause
// Parsed by tinyxml2, which MuJoCo uses too: what one takes the other does.
#include "importers/xml_tree.hpp"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <charconv>
#include <cmath>

#include "delassus/error.hpp"
#include "support/text_file.hpp"

namespace delassus::importers {

const std::string* XmlElement::find(std::string_view attribute) const {
    for (const XmlAttribute& one : attributes)
        if (one.name == attribute) {
            one.read = true;
            return &one.value;
        }
    return nullptr;
}

std::string XmlElement::text(std::string_view attribute, const std::string& otherwise) const {
    const std::string* found = find(attribute);
    return found != nullptr ? *found : otherwise;
}

std::string XmlElement::where() const {
    return file && !file->empty() ? fmt::format("{}, line {}", *file, line) : fmt::format("line {}", line);
}

void XmlElement::refuse(const std::string& what) const {
    throw InputError(fmt::format("{}: <{}>: {}", where(), name, what));
}

std::optional<std::vector<double>> XmlElement::numbers(std::string_view attribute) const {
    const std::string* given = find(attribute);
    if (given == nullptr) return std::nullopt;
    std::vector<double> result;
    const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == ','; };
    const char *at = given->data(), *const end = at + given->size();
    while (true) {
        while (at != end && is_blank(*at)) ++at;
        if (at == end) return result;
        const char* stop = at;
        while (stop != end && !is_blank(*stop)) ++stop;
        double value = 0.0;
        const char* const begin = *at == '+' ? at + 1 : at;
        const auto [rest, error] = std::from_chars(begin, stop, value);
        if (error == std::errc::result_out_of_range && rest == stop) value = 0.0;  // 1e-400
        if ((error != std::errc{} && error != std::errc::result_out_of_range) || rest != stop || !std::isfinite(value))
            refuse(fmt::format("{}=\"{}\" is to be numbers, and \"{}\" is none", attribute,
                               given->size() > 60 ? given->substr(0, 60) + "…" : *given, std::string(at, stop)));
        result.push_back(value);
        at = stop;
    }
}

std::size_t XmlElement::read(std::string_view attribute, double* values, std::size_t most, std::size_t least) const {
    const auto given = numbers(attribute);
    if (!given) return 0;
    if (given->size() > most || given->size() < least)
        refuse(fmt::format("{} has {} numbers in place of {}", attribute, given->size(),
                           least == most ? fmt::format("{}", most) : fmt::format("{} to {}", least, most)));
    std::copy(given->begin(), given->end(), values);
    return given->size();
}

bool XmlElement::read(std::string_view attribute, int& value) const {
    double number = 0.0;
    if (!read(attribute, number)) return false;
    if (std::abs(number) > 2147483647.0 || number != std::floor(number))
        refuse(fmt::format("{} is to be a whole number, not {}", attribute, number));
    value = static_cast<int>(number);
    return true;
}

bool XmlElement::read(std::string_view attribute, bool& value) const {
    const int which = word(attribute, {"false", "true"});
    if (which >= 0) value = which == 1;
    return which >= 0;
}

bool XmlElement::read(std::string_view attribute, std::string& value) const {
    const std::string* given = find(attribute);
    if (given != nullptr) value = *given;
    return given != nullptr;
}

int XmlElement::word(std::string_view attribute, std::initializer_list<const char*> words) const {
    const std::string* given = find(attribute);
    if (given == nullptr) return -1;
    int index = 0;
    for (const char* one : words) {
        if (*given == one) return index;
        ++index;
    }
    refuse(fmt::format("{}=\"{}\" is none of {}", attribute, *given, fmt::join(words, ", ")));
}

namespace {

constexpr int most_nested = 1000;
constexpr std::size_t most_elements = 2000000;

XmlElement element_of(const tinyxml2::XMLElement& from, const std::shared_ptr<const std::string>& file) {
    XmlElement result;
    result.name = from.Name();
    result.file = file;
    result.line = from.GetLineNum();
    if (const char* text = from.GetText()) result.content = text;
    for (const auto* one = from.FirstAttribute(); one != nullptr; one = one->Next())
        result.attributes.push_back({one->Name(), one->Value()});
    for (const auto* child = from.FirstChildElement(); child != nullptr; child = child->NextSiblingElement())
        result.children.push_back(element_of(*child, file));
    return result;
}

struct Including {
    std::filesystem::path folder;
    std::vector<std::filesystem::path> open;  // files, from the first to the one that is being read
    std::size_t elements = 0;
};

void expand(XmlElement& element, Including& state, int depth) {
    if (depth > most_nested) element.refuse(fmt::format("elements are nested more than {} deep", most_nested));
    if (++state.elements > most_elements)
        element.refuse(fmt::format("the model has more than {} elements", most_elements));
    std::vector<XmlElement> children;
    for (XmlElement& child : element.children) {
        if (child.name != "include") {
            expand(child, state, depth + 1);
            children.push_back(std::move(child));
            continue;
        }
        const std::string* given = child.find("file");
        if (given == nullptr || given->empty()) child.refuse("it names no file");
        const std::filesystem::path own = state.open.empty() ? state.folder : state.open.back().parent_path();
        std::filesystem::path path = state.folder / *given;
        if (!std::filesystem::is_regular_file(path)) path = own / *given;
        if (!std::filesystem::is_regular_file(path)) child.refuse(fmt::format("there is no file \"{}\"", *given));
        path = std::filesystem::weakly_canonical(path);
        for (const auto& one : state.open)
            if (one == path) child.refuse(fmt::format("the file \"{}\" includes itself", *given));
        XmlElement included = read_xml(path, *given);
        state.open.push_back(path);
        expand(included, state, depth + 1);
        state.open.pop_back();
        for (XmlElement& one : included.children) children.push_back(std::move(one));
    }
    element.children = std::move(children);
}

}  // namespace

XmlElement read_xml(const std::filesystem::path& file, const std::string& name) {
    const std::string text = read_file(file);
    tinyxml2::XMLDocument document;
    document.Parse(text.data(), text.size());
    const auto at = [&](int line) {
        return name.empty() ? fmt::format("line {}", line) : fmt::format("{}, line {}", name, line);
    };
    if (document.Error()) {
        std::string reason = document.ErrorStr() != nullptr ? document.ErrorStr() : "";
        // Error=XML_ERROR_X ErrorID=14 (0xe) Line number=2: details
        const auto begin = reason.find("Line number=");
        const auto colon = begin == std::string::npos ? begin : reason.find(": ", begin);
        const std::string details = colon == std::string::npos ? "" : reason.substr(colon + 2);
        std::string kind = document.ErrorName();
        if (kind.starts_with("XML_ERROR_")) kind = kind.substr(10);
        for (char& c : kind) c = c == '_' ? ' ' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        throw InputError(fmt::format("{}: it is no XML: {}{}", at(document.ErrorLineNum()), kind,
                                     details.empty() ? "" : fmt::format(" ({})", details)));
    }
    const tinyxml2::XMLElement* root = document.RootElement();
    if (root == nullptr) throw InputError(at(1) + ": it has no XML element");
    return element_of(*root, std::make_shared<const std::string>(name));
}

void expand_includes(XmlElement& root, const std::filesystem::path& folder) {
    Including state;
    state.folder = folder;
    expand(root, state, 0);
}

}  // namespace delassus::importers
