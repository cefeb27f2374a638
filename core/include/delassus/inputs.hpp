// SPDX-License-Identifier: BSD-3-Clause
// Numbers that a program sets while a simulation runs: torques, forces and set points of a controller.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "delassus/export.hpp"
#include "delassus/multibody.hpp"

namespace delassus {

/// How a motion follows an input u: offset + scale · u.
struct InputUse {
    double scale = 1.0, offset = 0.0;
    std::optional<double> start{};                 ///< u until it is set; none: 0
    std::optional<std::array<double, 2>> range{};  ///< where u is cut off; none: nowhere
};

/// Inputs by name. Each is constant from one setting to the next. Copies share the inputs.
class DELASSUS_API Inputs {
public:
    /// Follows the input of this name, which is made if there is none: as a load, as the speed of a motor, or as the
    /// position or speed of an actuator. Throws InputError if it has another start or range, or the range is empty or
    /// has not the start.
    [[nodiscard]] Motion motion(const std::string& name, const InputUse& use);

    /// In the order in which they were made.
    [[nodiscard]] std::vector<std::string> names() const;
    /// Throws InputError, with the nearest name, if there is none.
    [[nodiscard]] double value(std::string_view name) const;
    /// From the time t on, s; later times come in later calls. Throws InputError if there is none of this name or the
    /// value is not finite.
    void set(std::string_view name, double value, double t);

    /// All values, with what the integrals of speeds need; three numbers for each.
    [[nodiscard]] std::vector<double> save() const;
    /// The same of before anything was set.
    [[nodiscard]] std::vector<double> at_start() const;
    /// Throws InputError if these are not so many.
    void load(const std::vector<double>& saved);

private:
    struct Input {
        std::string name;
        std::optional<double> start;
        std::optional<std::array<double, 2>> range;
        double value = 0.0, since = 0.0;
        double integral = 0.0;  // from 0 to `since`
    };
    [[nodiscard]] Input& find(std::string_view name) const;

    std::vector<std::shared_ptr<Input>> inputs_;
};

}  // namespace delassus
