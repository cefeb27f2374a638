// SPDX-License-Identifier: BSD-3-Clause
// What a library that reads models passes over without a word: found in the file itself.
#pragma once

#include <span>
#include <string>

#include "importers/xml_tree.hpp"
#include "model_import/model.hpp"

namespace delassus::importers {

/// What is known of an element: names with blanks between them. "x" is taken, and looked into. "x~" is said elsewhere
/// or does not act, with all that is in it. "x=v" acts where it has another value than v. An element that has no entry
/// has neither attributes nor children.
struct KnownElement {
    const char* name;  ///< "axis", or, with the element around it, "friction/ode"
    const char* attributes;
    const char* children;
};

/// Lists as losses all elements and attributes below an element that no entry knows. format: in the reason. of: names
/// what is around the element. Namespaces are declared freely.
void note_unknown(const XmlElement& element, std::span<const KnownElement> known, const std::string& format,
                  model_import::Model& model, const std::string& around = "", const std::string& of = "");

}  // namespace delassus::importers
