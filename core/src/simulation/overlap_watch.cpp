// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/overlap_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

namespace delassus {

namespace {

std::string quoted_name(const MultibodySystem& system, BodyIndex body) {
    return fmt::format("\"{}\"", body == world_body ? "world" : system.body(body).name);
}

/// Of this pair in a list that ascends.
double depth_in(const std::vector<BodyOverlap>& list, const BodyOverlap& pair) {
    const auto found =
        std::lower_bound(list.begin(), list.end(), pair, [](const BodyOverlap& one, const BodyOverlap& other) {
            return std::tie(one.a, one.b) < std::tie(other.a, other.b);
        });
    return found != list.end() && found->a == pair.a && found->b == pair.b ? found->depth : 0.0;
}

}  // namespace

OverlapWatch::OverlapWatch(MultibodySystem& system, double accuracy, const State& start, double h)
    : system_(system), accuracy_(accuracy) {
    system.collect_overlaps(start, h, {}, start_);
    const BodyOverlap* worst = nullptr;
    std::size_t others = 0;
    for (const BodyOverlap& pair : start_) {
        if (pair.depth <= allowed(pair)) continue;
        if (worst) ++others;
        if (!worst || pair.depth > worst->depth) worst = &pair;
    }
    if (!worst) return;
    at_start_ = fmt::format(
        "bodies {} and {} overlap by {:.3g} m at the start{}, and are pushed apart; move them, or name them in "
        "\"keep_apart\" if they are not to touch",
        quoted_name(system, worst->a), quoted_name(system, worst->b), worst->depth,
        others == 0 ? "" : fmt::format(" ({} other pairs less)", others));
}

bool OverlapWatch::any_at_start() const {
    return std::ranges::any_of(start_, [this](const auto& pair) { return pair.depth > system_.gap_resolution(); });
}

double OverlapWatch::allowed(const BodyOverlap& pair) const {
    constexpr double share_of_thickness = 0.1;
    return std::min(accuracy_ * pair.extent, share_of_thickness * pair.thickness);
}

void OverlapWatch::require_within(const State& state, double h, const sdk::Team& team) {
    std::swap(now_, last_);
    system_.collect_overlaps(state, h, team, now_);
    const BodyOverlap* worst = nullptr;
    double beyond = 1.0, grown = 0.0;
    for (const BodyOverlap& pair : now_) {
        const double more = pair.depth - depth_in(before_, pair);
        if (more <= beyond * allowed(pair) || given_up_.contains({pair.a, pair.b})) continue;
        worst = &pair;
        beyond = more / allowed(pair);
        grown = more;
    }
    if (!worst) return;
    throw StepTooDeep(
        fmt::format("bodies {} and {} come to overlap by {:.2g} m in the step until t = {:.9g} s, {:.2g} "
                    "times what its accuracy allows",
                    quoted_name(system_, worst->a), quoted_name(system_, worst->b), grown, state.t, beyond),
        worst->a, worst->b, grown, depth_in(last_, *worst) - depth_in(before_, *worst));
}

std::string OverlapWatch::too_deep(std::span<const ContactPoint> contacts) const {
    BodyOverlap worst{};
    double beyond = 1.0;
    for (const ContactPoint& contact : contacts) {
        if (!(contact.gap < 0.0)) continue;
        const BodyOverlap pair = system_.overlap_of(contact);
        const double share = (pair.depth - depth_in(start_, pair)) / allowed(pair);
        if (!(share > beyond)) continue;
        worst = pair;
        beyond = share;
    }
    if (!(beyond > 1.0)) return {};
    return fmt::format("bodies {} and {} overlap by {:.2g} m, {:.3g} times what the accuracy allows",
                       quoted_name(system_, worst.a), quoted_name(system_, worst.b), worst.depth, beyond);
}

std::vector<BodyIndex> OverlapWatch::given_up() const {
    std::vector<BodyIndex> pairs;
    for (const auto& [a, b] : given_up_) pairs.insert(pairs.end(), {a, b});
    return pairs;
}

void OverlapWatch::set_given_up(const std::vector<BodyIndex>& pairs) {
    given_up_.clear();
    for (std::size_t i = 0; i + 1 < pairs.size(); i += 2) given_up_.insert({pairs[i], pairs[i + 1]});
}

void OverlapWatch::end() {
    std::erase_if(given_up_, [&](const std::pair<BodyIndex, BodyIndex>& bodies) {
        return std::none_of(now_.begin(), now_.end(),
                            [&](const BodyOverlap& pair) { return std::pair(pair.a, pair.b) == bodies; });
    });
}

}  // namespace delassus
