// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace delassus::mumps {

/// What INFOG(1) < 0 means, in a sentence; detail is INFOG(2). (MUMPS 5.5 Users' guide, section 8.)
[[nodiscard]] std::string error_sentence(int code, int detail);

}  // namespace delassus::mumps
