// SPDX-License-Identifier: BSD-3-Clause
// XML files as trees of elements that know where they stand.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace delassus::importers {

struct XmlAttribute {
    std::string name, value;
    mutable bool read = false;  ///< whether anybody asked for it
};

struct XmlElement {
    std::string name;
    std::string content;  ///< its text, up to its first child
    std::vector<XmlAttribute> attributes;
    std::vector<XmlElement> children;
    std::shared_ptr<const std::string> file;  ///< its name, empty for the first file
    int line = 0;

    /// The text of an attribute, which counts as read; null where it is absent.
    [[nodiscard]] const std::string* find(std::string_view attribute) const;
    [[nodiscard]] std::string text(std::string_view attribute, const std::string& otherwise = "") const;
    /// "line 7", with the file's name before it unless it is the first file.
    [[nodiscard]] std::string where() const;
    /// Throws InputError "line 7: <geom>: what".
    [[noreturn]] void refuse(const std::string& what) const;
    /// All numbers of an attribute; nothing where it is absent. Throws InputError for what is no finite number.
    [[nodiscard]] std::optional<std::vector<double>> numbers(std::string_view attribute) const;
    /// Fills as many of the values as are given. Throws InputError for more, and for fewer than `least`. Returns how
    /// many were given.
    std::size_t read(std::string_view attribute, double* values, std::size_t most, std::size_t least) const;
    bool read(std::string_view attribute, double& value) const { return read(attribute, &value, 1, 1) > 0; }
    bool read(std::string_view attribute, int& value) const;
    bool read(std::string_view attribute, bool& value) const;
    bool read(std::string_view attribute, std::string& value) const;
    /// Which of the words an attribute is; −1 where it is absent. Throws InputError for another word.
    [[nodiscard]] int word(std::string_view attribute, std::initializer_list<const char*> words) const;
};

/// The root element of a file. name: of the file in messages, empty for the first. Throws InputError with the line
/// where the text is no XML.
[[nodiscard]] XmlElement read_xml(const std::filesystem::path& file, const std::string& name);

/// Puts the children of the files' roots in the place of all <include file="…"/>. folder: of the first file, from which
/// paths start, or else from the folder of the file that includes. Throws InputError for a file that is not there or
/// includes itself.
void expand_includes(XmlElement& root, const std::filesystem::path& folder);

}  // namespace delassus::importers
