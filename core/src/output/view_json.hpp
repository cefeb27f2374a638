// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "output/view_page.hpp"

namespace delassus {

/// The data of the page. Long lists of numbers are base64 of little-endian numbers: f32 for what is drawn in space, f64
/// for times and figures, i32 for indices. Nodes inside elastic blocks, which nothing shows, are left out.
std::string view_json(const RecordedRun& run);

}  // namespace delassus
