// SPDX-License-Identifier: BSD-3-Clause
// What must hold between runs of one scene.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/registry.hpp"
#include "relations/scene_document.hpp"

namespace delassus::relations {

/// In the order in which they are judged and shown.
inline constexpr std::array<std::string_view, 12> relation_names = {"sound", "refusal",     "placed", "mirrored",
                                                                    "units", "order",       "pieces", "refined",
                                                                    "told",  "coordinates", "cut",    "solver"};

/// A sentence on the relation of that name.
[[nodiscard]] std::string_view meaning_of(std::string_view relation);

enum class Verdict {
    Held,
    Chaotic,   ///< it held as long as the scene's own sensitivity let it be judged
    Reported,  ///< it did not hold, and a run says that it may be wrong
    Violated,
    OnlyOneRefused,  ///< one of the two runs ends with a sentence, the other does not
    NotJudged,       ///< the scene is refused, or has nothing to which the relation applies
    TooLong          ///< a run took longer than its time
};

[[nodiscard]] std::string_view name_of(Verdict verdict);

struct Outcome {
    std::string_view relation;
    Verdict verdict = Verdict::NotJudged;
    std::string detail;  ///< of what did not hold: a clause with figures
};

struct JudgeOrder {
    double run_limit = 5.0;             ///< wall seconds of a run; those with half the step have twice and four times
    std::filesystem::path scratch;      ///< a folder for checkpoints and refused runs
    std::filesystem::path command;      ///< the program `delassus`
    std::set<std::string> only;         ///< relations; empty: all
    std::function<void()> still_alive;  ///< called before each run
    std::function<bool()> interrupted;  ///< asked before each run; true: the rest is not judged
};

/// What the scene's runs say of each relation that was asked for, in the order of relation_names.
[[nodiscard]] std::vector<Outcome> judge_scene(const Json& scene, const Registry& registry, const JudgeOrder& order);

}  // namespace delassus::relations
