// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/sdk/sparse_factor_bodies.hpp"
