// SPDX-License-Identifier: BSD-3-Clause
// Loads an SDF file by libsdformat, which resolves includes and frames.
#include <fmt/format.h>

#include <sdf/sdf.hh>
#include <string>

#include "delassus/error.hpp"
#include "delassus/export.hpp"
#include "importers/sdf_reader.hpp"
#include "importers/sdf_unread.hpp"

namespace {

using delassus::InputError;

std::string messages_of(const sdf::Errors& errors) {
    std::string text;
    for (const auto& error : errors) text += (text.empty() ? "" : "; ") + error.Message();
    for (char& c : text)
        if (c == '\n') c = ' ';
    return text;
}

}  // namespace

extern "C" DELASSUS_API void delassus_import_sdf_read(const std::filesystem::path& file,
                                                      const delassus::ImportSettings& settings,
                                                      delassus::model_import::Model& model) {
    sdf::Console::Instance()->SetQuiet(true);
    sdf::ParserConfig config = sdf::ParserConfig::GlobalConfig();
    config.SetFindCallback([&](const std::string& address) {
        return delassus::model_import::find_file(address, file, settings.package_paths).string();
    });
    sdf::Root root;
    sdf::Errors errors;
    try {
        errors = root.Load(file.string(), config);
    } catch (const std::exception& error) {
        throw InputError(fmt::format("libsdformat refuses the model: {}", error.what()));
    }
    if (!errors.empty()) throw InputError("libsdformat refuses the model: " + messages_of(errors));
    delassus::importers::note_unread_sdf(root, file, model);
    delassus::importers::SdfReader(file, model).read(root);
}
