// SPDX-License-Identifier: BSD-3-Clause
// FCLib HDF5 files (https://frictionalcontactlibrary.github.io), with its names of groups and datasets:
//
//   fclib_local    u = W r + V λ + q,   0 = Vᵀ r + R λ + s                    E = [W V; Vᵀ R], b = {q; s}
//   fclib_global   M v = H r + G λ + f, u = Hᵀ v + w, 0 = Gᵀ v + b            H = M, D = [H G]ᵀ, a = f, b = {w; b}
//
// V, R, s and G, b are the bilateral part and may be absent; its rows come last, as one block of free rows. The law is
// exact Coulomb friction with `spacedim` rows a contact, normal first.
#pragma once

#include <filesystem>
#include <string>

#include "delassus/problem.hpp"

namespace delassus::fclib {

/// Reads and validates; throws InputError. A matrix that must be symmetric and is not is replaced by its symmetric
/// part, and notes say by how much it was not.
Problem read_file(const std::filesystem::path& file);

/// Creates the file, which must not exist: local for a problem with n = 0, global otherwise. Rows of friction come
/// first and free rows last, whatever their order in the problem. Throws InputError, which calls the file `name`, if
/// the problem is not of FCLib's kind.
void write_file(const Problem& problem, const std::filesystem::path& file, const std::string& name);

}  // namespace delassus::fclib
