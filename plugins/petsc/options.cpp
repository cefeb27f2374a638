// SPDX-License-Identifier: BSD-3-Clause
#include "options.hpp"

#include <algorithm>
#include <cctype>
#include <set>
#include <sstream>
#include <stdexcept>

#include "library.hpp"

namespace delassus::petsc {

namespace {

bool is_key(const std::string& word) {
    return word.size() > 1 && word[0] == '-' && std::isalpha(static_cast<unsigned char>(word[1]));
}

// The numbers of the existing solvers, used under a Session. PETSc remembers every prefix that it has ever seen, so
// numbers are used again.
std::set<int>& numbers_in_use() {
    static std::set<int> numbers;
    return numbers;
}

// A solver never prints: these options do nothing else.
bool prints(const std::string& key) {
    for (const char* part : {"view", "monitor", "print", "converged_reason", "_test_", "mat_mumps_icntl_1",
                             "mat_mumps_icntl_2", "mat_mumps_icntl_3", "mat_mumps_icntl_4"}) {
        const auto position = key.find(part);
        if (position == std::string::npos) continue;
        const bool numbered = std::string(part).find("icntl") != std::string::npos;
        if (!numbered || position + std::string(part).size() == key.size()) return true;
    }
    return false;
}

}  // namespace

OptionsDatabase::OptionsDatabase() {
    auto& numbers = numbers_in_use();
    while (numbers.contains(number_)) ++number_;
    numbers.insert(number_);
    prefix_ = "delassus" + std::to_string(number_) + "_";
}

OptionsDatabase::~OptionsDatabase() {
    if (petsc_is_running()) clear();
    numbers_in_use().erase(number_);
}

void OptionsDatabase::clear() {
    for (const auto& name : entered_) PetscOptionsClearValue(nullptr, name.c_str());
    entered_.clear();
}

void OptionsDatabase::parse(const std::string& text) {
    std::istringstream words(text);
    std::string word;
    user_.clear();
    while (words >> word) {
        if (is_key(word)) {
            if (prints(word))
                throw std::invalid_argument("petsc_options: " + word +
                                            " would make PETSc print, which a solver must not do");
            user_.emplace_back(word.substr(1), "");
        } else if (user_.empty() || !user_.back().second.empty()) {
            throw std::invalid_argument("petsc_options: \"" + word +
                                        "\" is neither an option nor a value; write \"-name value\"");
        } else {
            user_.back().second = word;
        }
    }
}

void OptionsDatabase::enter(const std::vector<std::pair<std::string, std::string>>& own) {
    clear();
    for (const auto* list : {&own, static_cast<const decltype(user_)*>(&user_)})
        for (const auto& [key, value] : *list) {
            const std::string name = "-" + prefix_ + key;
            check(PetscOptionsSetValue(nullptr, name.c_str(), value.empty() ? nullptr : value.c_str()));
            if (std::find(entered_.begin(), entered_.end(), name) == entered_.end()) entered_.push_back(name);
        }
}

std::vector<std::string> OptionsDatabase::unused() const {
    std::vector<std::string> names;
    for (const auto& [key, value] : user_) {
        PetscBool used = PETSC_FALSE;
        check(PetscOptionsUsed(nullptr, (prefix_ + key).c_str(), &used));
        if (!used) names.push_back("-" + key);
    }
    return names;
}

}  // namespace delassus::petsc
