// SPDX-License-Identifier: BSD-3-Clause
// Products by groups of rows, the scaled problem and acceleration: what some plugins use.
#include "delassus/sdk/anderson_bodies.hpp"
#include "delassus/sdk/block_rows_bodies.hpp"
#include "delassus/sdk/column_shares_bodies.hpp"
#include "delassus/sdk/face_step_bodies.hpp"
#include "delassus/sdk/scaled_problem_bodies.hpp"
#include "delassus/sdk/scaled_rows_bodies.hpp"
