// SPDX-License-Identifier: BSD-3-Clause
#include "relations/scene_document.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "delassus/error.hpp"

namespace delassus::relations {
namespace {

/// The shortest text that is the same number; YAML 1.1 wants a point in a number with an exponent.
std::string number_text(double value) {
    std::string text = fmt::format("{}", value);
    const auto e = text.find('e');
    if (e != std::string::npos && text.find('.') == std::string::npos) text.insert(e, ".0");
    return text;
}

void write_flow(const Json& value, std::string& out) {
    if (value.is_object()) {
        out += '{';
        bool first = true;
        for (const auto& [key, entry] : value.items()) {
            if (!first) out += ", ";
            first = false;
            out += key + ": ";
            write_flow(entry, out);
        }
        out += '}';
    } else if (value.is_array()) {
        out += '[';
        for (std::size_t i = 0; i < value.size(); ++i) {
            if (i > 0) out += ", ";
            write_flow(value[i], out);
        }
        out += ']';
    } else if (value.is_number_float()) {
        out += number_text(value.get<double>());
    } else if (value.is_string()) {
        out += value.get<std::string>();
    } else {
        out += json_text(value);
    }
}

Json converted(const YAML::Node& node) {
    if (node.IsMap()) {
        Json object = Json::object();
        for (const auto& entry : node) object[entry.first.as<std::string>()] = converted(entry.second);
        return object;
    }
    if (node.IsSequence()) {
        Json array = Json::array();
        for (const auto& entry : node) array.push_back(converted(entry));
        return array;
    }
    const std::string text = node.IsNull() ? "" : node.Scalar();
    if (text == "true") return true;
    if (text == "false") return false;
    const char *begin = text.data(), *end = begin + text.size();
    std::int64_t whole = 0;
    if (const auto read = std::from_chars(begin, end, whole); read.ec == std::errc() && read.ptr == end && text != "-0")
        return whole;
    double real = 0.0;
    if (const auto read = std::from_chars(begin, end, real); read.ec == std::errc() && read.ptr == end) return real;
    return text;
}

double length_of(const Json& vector) {
    double sum = 0.0;
    for (const auto& entry : vector) sum += entry.get<double>() * entry.get<double>();
    return std::sqrt(sum);
}

double radius_of_shape(const Json& shape) {
    double radius = 0.0;
    if (shape.contains("sphere")) radius = shape["sphere"]["radius"].get<double>();
    if (shape.contains("box")) radius = 0.5 * length_of(shape["box"]["size"]);
    for (const char* round : {"capsule", "cylinder"})
        if (shape.contains(round))
            radius = shape[round]["radius"].get<double>() + 0.5 * shape[round]["length"].get<double>();
    if (shape.contains("convex"))
        for (const auto& point : shape["convex"]["points"]) radius = std::max(radius, length_of(point));
    return radius + (radius > 0.0 && shape.contains("position") ? length_of(shape["position"]) : 0.0);
}

}  // namespace

std::string scene_yaml(const Json& document, const std::vector<std::string>& head) {
    std::string out;
    for (const auto& line : head) out += line.empty() ? "#\n" : "# " + line + "\n";
    for (const auto& [key, value] : document.items()) {
        out += key + ":";
        if (value.is_array() && !value.empty() && (value.front().is_object() || key == "keep_apart")) {
            for (const auto& item : value) {
                out += "\n  - ";
                write_flow(item, out);
            }
        } else if (key == "materials") {
            for (const auto& [name, material] : value.items()) {
                out += "\n  " + name + ": ";
                write_flow(material, out);
            }
        } else {
            out += ' ';
            write_flow(value, out);
        }
        out += '\n';
    }
    return out;
}

Json read_document(const std::filesystem::path& file) {
    try {
        return converted(YAML::LoadFile(file.string()));
    } catch (const YAML::BadFile&) {
        throw InputError(fmt::format("{} cannot be read", file.string()));
    } catch (const YAML::Exception& error) {
        throw InputError(fmt::format("{}: {}", file.string(), error.what()));
    }
}

std::vector<SystemDocument> read_systems(const std::filesystem::path& file) {
    const Json document = read_document(file);
    std::vector<SystemDocument> result;
    if (document.is_object() && document.contains("systems"))
        for (const auto& [name, system] : document["systems"].items()) result.push_back({name, system});
    else
        result.push_back({"main", document});
    for (auto& [name, scene] : result) {
        if (!scene.is_object() || !scene.contains("step") || !scene.contains("bodies"))
            throw InputError(fmt::format(
                "{}: system \"{}\": relations compare bodies in fixed steps; \"bodies\" and \"step\" are needed",
                file.string(), name));
        if (!scene.contains("gravity")) scene["gravity"] = Json::array({0.0, 0.0, -9.81});
        for (auto& body : scene["bodies"])
            if (!body.contains("position")) body["position"] = Json::array({0.0, 0.0, 0.0});
    }
    return result;
}

bool moves(const Json& body) {
    return !body.value("fixed", false) && !body.contains("motion");
}

double radius_of(const Json& body) {
    double radius = 0.0;
    if (body.contains("shapes"))
        for (const auto& shape : body["shapes"]) radius = std::max(radius, radius_of_shape(shape));
    if (!body.contains("inertia") || !body.contains("mass")) return radius;
    double trace = 0.0;
    for (const char* moment : {"xx", "yy", "zz"}) trace += body["inertia"].value(moment, 0.0);
    return std::max(radius, std::sqrt(0.5 * trace / body["mass"].get<double>()));
}

const Json* find_named(const Json& document, const char* list, const std::string& name) {
    if (!document.contains(list)) return nullptr;
    for (const auto& item : document[list])
        if (item.value("name", std::string()) == name) return &item;
    return nullptr;
}

}  // namespace delassus::relations
