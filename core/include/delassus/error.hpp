// SPDX-License-Identifier: BSD-3-Clause
// Exceptions of the library. Misuse throws; an outcome of a solve is a status (solver.hpp).
#pragma once

#include <stdexcept>
#include <string>

#include "delassus/export.hpp"

namespace delassus {

/// Base of all exceptions of the library. what() is one sentence for a person: what, where, what would be right.
class DELASSUS_API Error : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// A file, a value or a call is wrong. The command ends with exit code 2.
class DELASSUS_API InputError : public Error {
public:
    using Error::Error;
};

/// The chosen solver cannot take the problem. The command ends with exit code 4.
class DELASSUS_API Unsupported : public Error {
public:
    using Error::Error;
};

/// A plugin could not be loaded or broke the rules of the border. The command ends with exit code 2.
class DELASSUS_API PluginError : public Error {
public:
    using Error::Error;
};

}  // namespace delassus
