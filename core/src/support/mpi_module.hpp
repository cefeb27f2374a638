// SPDX-License-Identifier: BSD-3-Clause
// MPI through the module delassus_mpi, which the first run of several processes loads.
#pragma once

#include <memory>

#include "delassus/communicator.hpp"

// The module is built together with the library, so C++ types may cross here.
extern "C" {
using DelassusMpiMake = void (*)(std::shared_ptr<const delassus::Communicator>& communicator);
}
