// SPDX-License-Identifier: BSD-3-Clause
// Loads an MJCF file by libmujoco, whose compiler resolves defaults, includes, frames and inertias.
#include <fmt/format.h>

#include <array>
#include <memory>
#include <string>

#include "delassus/error.hpp"
#include "delassus/export.hpp"
#include "importers/mjcf_reader.hpp"

namespace {

using delassus::InputError;

std::string warnings;

/// One line, without what libmujoco prefixes.
std::string sentence(std::string text) {
    for (char& c : text)
        if (c == '\n' || c == '\r') c = ' ';
    while (!text.empty() && text.back() == ' ') text.pop_back();
    return text;
}

/// While it lives, what libmujoco reports comes here: unless told otherwise it writes a file, or ends the process.
class Reports {
public:
    Reports() : error_(mju_user_error), warning_(mju_user_warning) {
        warnings.clear();
        mju_user_error = [](const char* text) { throw InputError("libmujoco: " + sentence(text)); };
        mju_user_warning = [](const char* text) { warnings = sentence(text); };
    }
    ~Reports() {
        mju_user_error = error_;
        mju_user_warning = warning_;
    }
    Reports(const Reports&) = delete;
    Reports& operator=(const Reports&) = delete;

private:
    void (*error_)(const char*);
    void (*warning_)(const char*);
};

}  // namespace

extern "C" DELASSUS_API void delassus_import_mjcf_read(const std::filesystem::path& file,
                                                       const delassus::ImportSettings& settings,
                                                       delassus::model_import::Model& model) {
    const Reports reports;
    std::array<char, 1000> error{};
    const std::unique_ptr<mjModel, void (*)(mjModel*)> compiled(
        mj_loadXML(file.c_str(), nullptr, error.data(), static_cast<int>(error.size())), mj_deleteModel);
    const std::string said = sentence(error.data());
    if (!compiled) throw InputError("libmujoco refuses the model: " + said);
    model.title = compiled->names;  // the model's own name comes first
    if (!said.empty()) model.without_effect.push_back({"warning of libmujoco", said});
    delassus::importers::MjcfReader(*compiled, settings.keyframe, model).read();
    if (!warnings.empty() && warnings != said) model.without_effect.push_back({"warning of libmujoco", warnings});
}
