// SPDX-License-Identifier: BSD-3-Clause
// Orders of convergence of every method on every system, over four step sizes. DELASSUS_PRINT_ORDERS=1 prints them.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>

#include "support/order.hpp"
#include "support/systems/elastic_pendulum.hpp"
#include "support/systems/heavy_top.hpp"
#include "support/systems/planar_pendulum.hpp"
#include "support/systems/slider_crank.hpp"

namespace delassus::tests::order_test {
namespace {

/// A system with an end time, and the number of steps in which a method of order 2 is in its asymptotic range.
struct Subject {
    std::unique_ptr<DynamicalSystem> system;
    double t_end;
    int steps;
    Motion reference;
};

const Subject& subject(const std::string& name) {
    static std::map<std::string, Subject> kept;
    const auto found = kept.find(name);
    if (found != kept.end()) return found->second;
    Subject made;
    if (name == "elastic pendulum") made = {std::make_unique<ElasticPendulum>(), 1.0, 100, {}};
    if (name == "planar pendulum")
        made = {
            std::make_unique<PlanarPendulum>(State{0.0, {std::sqrt(0.75), -0.5}, {1.0, std::sqrt(3.0)}}), 1.0, 100, {}};
    if (name == "driven pendulum") made = {std::make_unique<DrivenPendulum>(), 1.0, 100, {}};
    if (name == "slider-crank") made = {std::make_unique<SliderCrank>(), 0.5, 400, {}};
    if (name == "heavy top") made = {std::make_unique<HeavyTop>(), 0.1, 150, {}};
    if (name == "heavy top, reduced") made = {std::make_unique<HeavyTopReduced>(), 0.1, 200, {}};
    made.reference = reference_solution(*made.system, made.t_end, 40 * made.steps);
    return kept.emplace(name, std::move(made)).first->second;
}

/// What λ does: nothing to measure, the method's order, that of a mean over the step, that of a stage of three, or no
/// convergence but of the smoothed sequence.
enum class Multipliers { None, Converge, Mean, OfStage, Oscillate };

struct Case {
    std::string method;
    OptionTexts options;
    int order;
    std::string system;
    Multipliers multipliers;
    double factor;  ///< more steps than the subject's
};

std::ostream& operator<<(std::ostream& out, const Case& c) {
    out << c.method;
    for (const auto& [key, text] : c.options) out << ' ' << key << '=' << text;
    return out << " on " << c.system;
}

std::vector<Case> cases() {
    struct Method {
        std::string name;
        OptionTexts options;
        int order;
        Multipliers multipliers = Multipliers::Converge;
    };
    const std::vector<Method> explicit_ones = {{"euler_explicit", {}, 1}};
    // The coarsest steps are too long to be trusted, but show the order.
    const std::vector<Method> others = {
        {"euler_implicit_linearized", {}, 1},
        {"euler_implicit", {}, 1},
        {"trapezoidal", {}, 2, Multipliers::Oscillate},
        {"trapezoidal_linearized", {{"linearization_limit", "inf"}}, 2, Multipliers::Oscillate},
        {"newmark", {}, 2, Multipliers::Oscillate},
        {"newmark", {{"gamma", "0.6"}, {"beta", "0.3025"}}, 1},
        {"hht", {{"alpha", "-0.1"}}, 2},
        {"hht", {{"alpha", "-0.3"}}, 2},
        {"generalized_alpha", {{"rho_infinity", "0.8"}}, 2},
        {"generalized_alpha", {{"rho_infinity", "0"}}, 2},
        {"generalized_alpha", {{"rho_infinity", "1"}}, 2, Multipliers::Oscillate},
        {"moreau_jean", {}, 2, Multipliers::Mean},
        {"moreau_jean", {{"theta", "0.6"}}, 1},
        {"nonsmooth_generalized_alpha", {}, 2},
        {"linearly_implicit_trapezoidal", {{"linearization_limit", "inf"}}, 2, Multipliers::Mean},
        {"rk4", {}, 4},
        {"dormand_prince", {}, 5},
        {"radau_iia", {{"newton_tolerance", "1e-13"}}, 5, Multipliers::OfStage}};
    std::vector<Case> result;
    const auto add = [&](const Method& method, const std::string& system, bool constrained) {
        auto options = method.options;
        const bool newton = method.order < 4 && method.name != "euler_explicit" &&
                            method.name != "euler_implicit_linearized" && method.name != "trapezoidal_linearized" &&
                            method.name != "linearly_implicit_trapezoidal";
        if (newton) options["newton_tolerance"] = "1e-12";
        const auto multipliers = constrained ? method.multipliers : Multipliers::None;
        const bool late = (method.name == "moreau_jean" && constrained) ||
                          method.name == "linearly_implicit_trapezoidal";  // their asymptotic range
        const double factor = method.order == 1   ? (constrained ? 2.0 : 4.0)
                              : late              ? 4.0
                              : method.order >= 4 ? 0.25
                                                  : 1.0;
        result.push_back({method.name, options, method.order, system, multipliers, factor});
    };
    for (const auto* system : {"elastic pendulum", "heavy top, reduced"}) {
        for (const auto& method : explicit_ones) add(method, system, false);
        for (const auto& method : others) add(method, system, false);
    }
    for (const auto* system : {"planar pendulum", "driven pendulum", "slider-crank", "heavy top"})
        for (const auto& method : others) add(method, system, true);
    return result;
}

class Order : public testing::TestWithParam<Case> {};

TEST_P(Order, IsTheOneClaimed) {
    const auto& c = GetParam();
    const auto& on = subject(c.system);
    const Registry registry;
    StepSolver solver(registry, {});
    const int coarsest = static_cast<int>(c.factor * on.steps);
    const std::vector<int> steps = {coarsest, 2 * coarsest, 4 * coarsest, 8 * coarsest};
    const auto measured = measure(*on.system, c.method, c.options, on.t_end, steps, on.reference, solver);
    const double q = measured.order(measured.position), v = measured.order(measured.velocity);
    // The leading errors of methods of order 5 are so small that longer steps show more of the next ones.
    const double below = c.order == 5 ? 0.3 : 0.15, above = c.order == 5 ? 1.0 : 0.15;
    const auto expect_order = [&](double measured_order, double order) {
        EXPECT_GE(measured_order, order - below);
        EXPECT_LE(measured_order, order + above);
    };
    expect_order(q, c.order);
    expect_order(v, c.order);
    const bool print = std::getenv("DELASSUS_PRINT_ORDERS") != nullptr;
    const std::string name = testing::PrintToString(c);
    if (print) std::printf("%s: q %.2f v %.2f", name.c_str(), q, v);
    if (c.multipliers != Multipliers::None && c.multipliers != Multipliers::Oscillate) {
        const double lambda = measured.order(measured.multiplier);
        expect_order(lambda, c.multipliers == Multipliers::Mean      ? 1
                             : c.multipliers == Multipliers::OfStage ? 3
                                                                     : c.order);
        if (print) std::printf(" lambda %.2f", lambda);
    }
    if (c.multipliers == Multipliers::Oscillate) {
        // The error of λ has the same size with every step; without its alternating part it is of order 2. One
        // iteration a step comes near that order with the smallest of these steps only.
        const auto smooth = measure(*on.system, c.method, c.options, on.t_end, steps, on.reference, solver, true);
        const double raw = measured.order(measured.multiplier), smoothed = smooth.order(smooth.multiplier);
        EXPECT_NEAR(raw, 0.0, 0.15);
        EXPECT_NEAR(smoothed, 2.0, c.method == "trapezoidal_linearized" ? 0.3 : 0.15);
        if (print) std::printf(" lambda %.2f, smoothed %.2f", raw, smoothed);
    }
    if (print) std::printf("\n");
}

INSTANTIATE_TEST_SUITE_P(Methods, Order, testing::ValuesIn(cases()), [](const auto& chosen) {
    std::string name = testing::PrintToString(chosen.param);
    for (char& letter : name)
        if (!std::isalnum(static_cast<unsigned char>(letter))) letter = '_';
    return name;
});

}  // namespace
}  // namespace delassus::tests::order_test
