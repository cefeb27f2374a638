// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "delassus/export.hpp"
#include "delassus/scene.hpp"
#include "output/trajectory_model.hpp"

namespace delassus {

/// What a picture of the system needs beside its motion. Gears, motors and loads are not in it.
DELASSUS_API TrajectoryModel trajectory_model(const SceneSystem& system);

}  // namespace delassus
