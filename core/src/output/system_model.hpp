// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "delassus/scene.hpp"
#include "output/trajectory_model.hpp"

namespace delassus {

/// What a picture of the system needs beside its motion. Gears, motors and loads are not in it.
TrajectoryModel trajectory_model(const SceneSystem& system);

}  // namespace delassus
