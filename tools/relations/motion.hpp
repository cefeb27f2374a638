// SPDX-License-Identifier: BSD-3-Clause
// A scene run in this process, and what is kept of its motion.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "delassus/registry.hpp"
#include "relations/scene_document.hpp"
#include "relations/transform.hpp"

namespace delassus::relations {

/// How a run came to its end.
enum class End {
    Reached,
    Refused,  ///< with a sentence: the scene when it was read or begun, or a step
    TooLong,  ///< its time was over
    Broken    ///< an exception that is no sentence for a person
};

struct Motion {
    End end = End::Reached;
    std::string message;  ///< of a refusal
    bool began = false;   ///< it came to its first step
    std::string integrator, coordinates;
    double error_limit = 0.0;         ///< of a method that divides its steps by one, m and rad; 0: it has none
    bool inexact = false;             ///< it says that steps err by more than the accuracy
    bool divides = false;             ///< fixed steps are divided by their error, to an accuracy
    double parts = 0.0;               ///< steps of the method at most: those shown, and what they were divided into
    std::vector<std::string> bodies;  ///< that move
    std::map<std::string, MassOf> masses;    ///< of these
    std::vector<double> t;                   ///< s; the start, then each step
    std::vector<std::vector<double>> poses;  ///< at these: position, unit quaternion w x y z of each body, one by one
    std::vector<double> natural;             ///< at these: the largest natural error that a solve of the step left
    std::vector<double> said;  ///< at these: the error that the steps so far say they have, of what moves, or rad
    bool finite = true;
    bool driven = false;     ///< motors, servos, loads or kinematic bodies supply energy
    bool acted = false;      ///< a contact, a stop or a limited motor was in some step's problem
    double growth = 0.0;     ///< of the energy above the start's, at most, J
    double available = 0.0;  ///< what can have moved: kinetic energy of the start and the largest fall of the potential
    double energy_rounding = 0.0;                       ///< that a step cannot tell from rest, J
    double start_penetration = 0.0, penetration = 0.0;  ///< the deepest contact at the start, and ever, m
    double drift = 0.0;                                 ///< of joints at most, m or rad
    bool rows_left_out = false;                         ///< joints repeat, or nearly contradict, one another
    std::vector<std::string> warnings;
    bool solved = true;  ///< every solve met its tolerance
};

struct RunOrder {
    double time_limit = 5.0;  ///< wall seconds
    /// A folder for a checkpoint: the run is stopped in the middle, written, read again and gone on with. Empty: it is
    /// not.
    std::filesystem::path checkpoint;
};

/// Runs the scene. Throws nothing of what the library throws.
[[nodiscard]] Motion run(const Json& scene, const Registry& registry, const RunOrder& order = {});

}  // namespace delassus::relations
