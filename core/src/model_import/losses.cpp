// SPDX-License-Identifier: BSD-3-Clause
// Lists of losses for people: one line a kind.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "delassus/model_import.hpp"

namespace delassus {

namespace {

/// A reason without its numbers and names: those of one kind are alike.
std::string kind_of(const std::string& text) {
    std::string kind;
    bool quoted = false;
    for (const char c : text) {
        if (c == '"') {
            quoted = !quoted;
            kind += '"';
        } else if (!quoted && std::isdigit(static_cast<unsigned char>(c)) == 0 && c != '.' && c != '-' && c != 'e') {
            kind += c;
        }
    }
    return kind;
}

struct Group {
    std::string word, kind, why;
    std::vector<std::string> items;
    std::size_t count = 0;
    bool alike = true;
};

}  // namespace

std::vector<NotCarriedOver> grouped(const std::vector<NotCarriedOver>& all) {
    constexpr std::size_t most_named = 3;
    std::vector<Group> groups;
    for (const NotCarriedOver& one : all) {
        const std::string word = one.what.substr(0, one.what.find(' ')), kind = kind_of(one.why);
        auto found = std::find_if(groups.begin(), groups.end(),
                                  [&](const Group& group) { return group.word == word && group.kind == kind; });
        if (found == groups.end()) found = groups.insert(groups.end(), Group{word, kind, one.why, {}, 0, true});
        found->alike = found->alike && found->why == one.why;
        ++found->count;
        if (found->items.size() < most_named) found->items.push_back(one.what);
    }
    std::vector<NotCarriedOver> result;
    for (const Group& group : groups) {
        std::string what = fmt::format("{}", fmt::join(group.items, ", "));
        if (group.count > group.items.size()) what += fmt::format(" and {} more", group.count - group.items.size());
        result.push_back(
            {group.count == 1 ? group.items.front() : fmt::format("{} × {}", group.count, what),
             group.alike ? group.why : group.why + " (the first; the others have other numbers or names)"});
    }
    return result;
}

}  // namespace delassus
