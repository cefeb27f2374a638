// SPDX-License-Identifier: BSD-3-Clause
// H⁻¹, N and errors: what libdelassus and all plugins use.
#include "delassus/sdk/delassus_operator_bodies.hpp"
#include "delassus/sdk/dense_algebra_bodies.hpp"
#include "delassus/sdk/h_inverse_bodies.hpp"
#include "delassus/sdk/monitor_bodies.hpp"
#include "delassus/sdk/residual_bodies.hpp"
#include "delassus/sdk/saddle_point_bodies.hpp"
#include "delassus/sdk/sparse_factor_bodies.hpp"
#include "delassus/sdk/sparse_lu_bodies.hpp"
