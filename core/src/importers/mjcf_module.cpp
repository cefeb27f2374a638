// SPDX-License-Identifier: BSD-3-Clause
// Reads an MJCF file.
#include "delassus/export.hpp"
#include "importers/mjcf_reader.hpp"

extern "C" DELASSUS_API void delassus_import_mjcf_read(const std::filesystem::path& file,
                                                       const delassus::ImportSettings& settings,
                                                       delassus::model_import::Model& model) {
    delassus::importers::mjcf::Spec spec = delassus::importers::mjcf::read_spec(file, model);
    delassus::importers::MjcfReader(spec, settings, model).read();
}
