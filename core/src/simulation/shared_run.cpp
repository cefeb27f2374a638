// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/shared_run.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "delassus/error.hpp"
#include "partitioned/bytes.hpp"

namespace delassus {

// ---- Ghosts ----
//
// Two bodies can get a contact in a step if their balls are nearer than the envelope and what both move in the step. So
// where ghosts are looked for, each body's ball is larger than the body by half of the envelope and by an allowance; as
// long as no body has moved, and will have moved by the end of the coming step, by more than its allowance, no contact
// is missed. The allowance is a quarter of the median size, and more for what is fast: some steps' way.

namespace {

constexpr double share_of_size = 0.25, steps_ahead = 6.0;
/// The largest load over the mean, beyond which bodies are shared out anew, but not more often than in so many steps.
constexpr double imbalance = 1.2;
constexpr std::int64_t fewest_steps = 10;

constexpr std::size_t positions = 7, velocities = 6;

std::vector<Bytes> to_all(const Communicator& communicator, const Bytes& bytes) {
    std::vector<Bytes> to(static_cast<std::size_t>(communicator.size()), bytes);
    return communicator.exchange(to);
}

}  // namespace

std::string SharedRun::obstacle(const SceneSystem& system) {
    if (system.system->node_count() > 0 || !system.elastic_blocks.empty()) return "elastic bodies or nodes";
    if (!system.beams.empty()) return "beams";
    return {};
}

SharedRun::SharedRun(SceneSystem& system, SteppingMethod method, std::shared_ptr<const Communicator> communicator,
                     const Registry& registry, StepSolver& solver)
    : system_(system),
      method_(std::move(method)),
      communicator_(std::move(communicator)),
      steps_(communicator_, registry, solver.config()),
      domains_(system),
      weights_(domains_.moving().size(), 1.0) {
    solver.share(&steps_);
}
SharedRun::~SharedRun() = default;

// Bodies come first in q and v, so that the k-th moving body has q from 7 k and v from 6 k on.
Vector3 SharedRun::centre_of(std::size_t body, const State& whole) const {
    const double* q = whole.q.data() + positions * body;
    return {q[0], q[1], q[2]};
}

double SharedRun::way_of(std::size_t body, const State& whole, double h) const {
    const double* v = whole.v.data() + velocities * body;
    const Vector3& g = system_.system->gravity();
    return h * (std::hypot(v[0], v[1], v[2]) + h * std::hypot(g[0], g[1], g[2]));
}

bool SharedRun::ghosts_suffice(const State& whole, double h) const {
    for (std::size_t k = 0; k < centres_.size(); ++k) {
        if (domains_.radii()[k] < 0.0) continue;
        const Vector3 now = centre_of(k, whole);
        const double moved = std::hypot(now[0] - centres_[k][0], now[1] - centres_[k][1], now[2] - centres_[k][2]);
        if (moved + way_of(k, whole, h) > allowance_[k]) return false;
    }
    return true;
}

void SharedRun::restart() {
    part_ = {};
    has_begin_ = false;
}

void SharedRun::set_memory(StepMemory memory) {
    restart();
    begin_ = std::move(memory);
    has_begin_ = true;
}

void SharedRun::prepare(const State& whole, double h, std::unique_ptr<Timestepper>& timestepper) {
    if (part_.system && !unbalanced_ && ghosts_suffice(whole, h)) return;
    share_out(whole, h, timestepper);
}

void SharedRun::share_out(const State& whole, double h, std::unique_ptr<Timestepper>& timestepper) {
    const std::size_t count = domains_.moving().size();
    const int rank = communicator_->rank(), processes = communicator_->size();
    if (part_.system) {
        begin_ = memory(*timestepper);
        has_begin_ = true;
        // What a body costs: its columns, and the rows that it has on its process.
        weights_.assign(count, 0.0);
        const auto& rows = steps_.rows_of_bodies();
        for (std::size_t k = 0; k < local_.size(); ++k)
            if (const auto body = static_cast<std::size_t>(local_[k]); owners_[body] == rank)
                weights_[body] = static_cast<double>(velocities) + (k < rows.size() ? rows[k] : 0);
        communicator_->sum(weights_);
    }
    centres_.resize(count);
    allowance_.resize(count);
    std::vector<Reach> reach(count);
    const double size = system_.system->size_of_shapes();
    for (std::size_t k = 0; k < count; ++k) {
        centres_[k] = centre_of(k, whole);
        allowance_[k] = std::max(share_of_size * size, steps_ahead * way_of(k, whole, h));
        reach[k].centre = centres_[k];
        const double radius = domains_.radii()[k];
        reach[k].radius = radius < 0.0 ? radius : radius + allowance_[k] + 0.5 * system_.system->envelope();
    }
    owners_ = domains_.owners(centres_, weights_, processes);
    const std::vector<bool> needed = domains_.needed(owners_, reach, rank);

    StepShares shares;
    shares.column_start.assign(static_cast<std::size_t>(processes) + 1, 0);
    std::vector<std::int64_t> number(count);  // of a body among those of its process
    for (std::size_t k = 0; k < count; ++k) number[k] = shares.column_start[static_cast<std::size_t>(owners_[k]) + 1]++;
    for (std::size_t p = 0; p < static_cast<std::size_t>(processes); ++p)
        shares.column_start[p + 1] =
            shares.column_start[p] + static_cast<std::int64_t>(velocities) * shares.column_start[p + 1];
    local_.clear();
    std::vector<BodyIndex> bodies, touched;
    for (std::size_t k = 0; k < count; ++k) {
        if (!needed[k]) continue;
        shares.bodies.push_back({static_cast<std::int32_t>(velocities * local_.size()),
                                 static_cast<std::int32_t>(velocities), owners_[k],
                                 shares.column_start[static_cast<std::size_t>(owners_[k])] +
                                     static_cast<std::int64_t>(velocities) * number[k],
                                 domains_.decides(k)});
        local_.push_back(static_cast<std::int32_t>(k));
        bodies.push_back(domains_.moving()[k]);
        if (domains_.large()[k]) touched.push_back(domains_.moving()[k]);
    }
    // What one process alone cannot do ends the step on all.
    steps_.step([&] {
        part_ = part_of_system(system_, bodies, touched);
        timestepper = make_timestepper(method_.integrator, *part_.system, method_.options);
        if (!has_begin_) return;
        StepMemory own;
        own.numbers = begin_.numbers;
        own.impulses = begin_.impulses;
        for (const auto& all : begin_.of_columns) {
            auto& to = own.of_columns.emplace_back();
            if (all.empty()) continue;
            for (const std::int32_t body : local_)
                to.insert(to.end(), all.begin() + static_cast<std::ptrdiff_t>(velocities) * body,
                          all.begin() + static_cast<std::ptrdiff_t>(velocities) * (body + 1));
        }
        for (const auto& all : begin_.of_rows) {
            auto& to = own.of_rows.emplace_back();
            if (all.empty()) continue;
            for (const std::int32_t row : part_.rows) to.push_back(all[static_cast<std::size_t>(row)]);
        }
        timestepper->set_memory(std::move(own));
    });
    begin_ = {};
    has_begin_ = false;
    shares.rows = part_.rows;
    shares.all_rows = system_.system->m();
    steps_.set_shares(std::move(shares));
    unbalanced_ = false;
    steps_since_ = 0;
    ++divisions_;
}

State SharedRun::local_state(const State& whole) const {
    State local;
    local.t = whole.t;
    for (const std::int32_t body : local_) {
        const auto k = static_cast<std::size_t>(body);
        local.q.insert(local.q.end(), whole.q.begin() + static_cast<std::ptrdiff_t>(positions * k),
                       whole.q.begin() + static_cast<std::ptrdiff_t>(positions * (k + 1)));
        local.v.insert(local.v.end(), whole.v.begin() + static_cast<std::ptrdiff_t>(velocities * k),
                       whole.v.begin() + static_cast<std::ptrdiff_t>(velocities * (k + 1)));
    }
    for (const std::int32_t place : part_.angles) local.q.push_back(whole.q[static_cast<std::size_t>(place)]);
    return local;
}

void SharedRun::exchange_states(const State& local, State& whole) const {
    const int rank = communicator_->rank();
    std::vector<double> own;
    for (std::size_t k = 0; k < local_.size(); ++k) {
        if (owners_[static_cast<std::size_t>(local_[k])] != rank) continue;
        own.insert(own.end(), local.q.begin() + static_cast<std::ptrdiff_t>(positions * k),
                   local.q.begin() + static_cast<std::ptrdiff_t>(positions * (k + 1)));
        own.insert(own.end(), local.v.begin() + static_cast<std::ptrdiff_t>(velocities * k),
                   local.v.begin() + static_cast<std::ptrdiff_t>(velocities * (k + 1)));
    }
    for (std::size_t k = 0; k < part_.angles.size(); ++k)
        whole.q[static_cast<std::size_t>(part_.angles[k])] = local.q[positions * local_.size() + k];
    const auto angles = angles_of_owners();
    for (const auto& [place, owner] : angles)
        if (owner == rank) own.push_back(whole.q[place]);
    Bytes bytes;
    put(bytes, own);
    const std::vector<Bytes> from = to_all(*communicator_, bytes);
    std::vector<std::vector<double>> values;
    for (const Bytes& one : from) values.push_back(ByteReader(one).next<double>());
    std::vector<std::size_t> next(values.size(), 0);
    for (std::size_t k = 0; k < owners_.size(); ++k) {
        const auto p = static_cast<std::size_t>(owners_[k]);
        const auto first = values[p].begin() + static_cast<std::ptrdiff_t>(next[p]);
        std::copy_n(first, positions, whole.q.begin() + static_cast<std::ptrdiff_t>(positions * k));
        std::copy_n(first + positions, velocities, whole.v.begin() + static_cast<std::ptrdiff_t>(velocities * k));
        next[p] += positions + velocities;
    }
    for (const auto& [place, owner] : angles) {
        const auto p = static_cast<std::size_t>(owner);
        whole.q[place] = values[p][next[p]++];
    }
    whole.t = local.t;
}

std::vector<std::pair<std::size_t, std::int32_t>> SharedRun::angles_of_owners() const {
    const MultibodySystem& all = *system_.system;
    std::vector<std::pair<std::size_t, std::int32_t>> angles;
    for (std::int32_t k = 0; k < all.joint_count(); ++k) {
        const std::int32_t place = all.angle_position(k);
        if (place < 0) continue;
        const std::int32_t column = std::max(all.body_column(all.joint(k).first), all.body_column(all.joint(k).second));
        if (column >= 0)
            angles.emplace_back(static_cast<std::size_t>(place),
                                owners_[static_cast<std::size_t>(column) / velocities]);
    }
    return angles;
}

void SharedRun::step(State& whole, double h, Timestepper& timestepper, StepSolver& solver, StepReport& report) {
    State local;
    steps_.step([&] {
        local = local_state(whole);
        timestepper.step(local, h, solver, report);
    });
    exchange_states(local, whole);
    complete(report, h);
    ++steps_since_;
}

void SharedRun::complete(StepReport& report, double h) {
    // The blocks that fell to this process, which come after those of the bilateral rows.
    const std::vector<bool>& own = steps_.own_cones();
    const std::size_t bilateral = own.size() - report.reactions.size();
    const std::size_t first_contact = report.reactions.size() - report.contacts.size();
    std::vector<BlockReaction> reactions;
    std::vector<ContactPoint> contacts;
    for (std::size_t k = 0; k < report.reactions.size(); ++k) {
        if (!own[bilateral + k]) continue;
        reactions.push_back(report.reactions[k]);
        if (k < first_contact) continue;
        ContactPoint contact = report.contacts[k - first_contact];
        contact.shape_a = part_.shapes[static_cast<std::size_t>(contact.shape_a)];
        contact.shape_b = part_.shapes[static_cast<std::size_t>(contact.shape_b)];
        contacts.push_back(contact);
    }
    report.reactions = std::move(reactions);
    report.contacts = std::move(contacts);

    double deepest = 0.0;
    for (const ContactPoint& contact : report.contacts) deepest = std::max(deepest, -contact.gap);
    std::array<double, 3> largest = {deepest, report.linearization, report.linearization_rounding};
    communicator_->max(largest);
    penetration_ = largest[0];
    report.linearization = largest[1];
    report.linearization_rounding = largest[2];
    std::array<double, 4> sums = {static_cast<double>(report.reactions.size()),
                                  static_cast<double>(report.active_blocks), report.energy.recovered,
                                  report.energy.damped};
    communicator_->sum(sums);
    report.unilateral_blocks = static_cast<std::int32_t>(sums[0]);
    report.active_blocks = static_cast<std::int32_t>(sums[1]);
    report.energy.recovered = sums[2];
    report.energy.damped = sums[3];
    report.multipliers = steps_.bilateral();
    for (double& multiplier : report.multipliers) multiplier /= h;

    const auto& rows = steps_.rows_of_bodies();
    std::int64_t load = std::accumulate(rows.begin(), rows.end(), std::int64_t{0});
    for (const std::int32_t body : local_)
        if (owners_[static_cast<std::size_t>(body)] == communicator_->rank())
            load += static_cast<std::int64_t>(velocities);
    const std::vector<std::int64_t> loads = communicator_->all(load);
    const double mean = static_cast<double>(std::accumulate(loads.begin(), loads.end(), std::int64_t{0})) /
                        static_cast<double>(loads.size());
    const auto most = static_cast<double>(*std::max_element(loads.begin(), loads.end()));
    unbalanced_ = steps_since_ + 1 >= fewest_steps && most > imbalance * mean;
}

void SharedRun::collect_contacts(StepReport& report) const {
    const std::size_t first_contact = report.reactions.size() - report.contacts.size();
    std::vector<Bytes> to(static_cast<std::size_t>(communicator_->size()));
    put(to[0], std::span<const BlockReaction>(report.reactions).first(first_contact));
    put(to[0], std::span<const BlockReaction>(report.reactions).subspan(first_contact));
    put(to[0], report.contacts);
    const std::vector<Bytes> from = communicator_->exchange(to);
    if (communicator_->rank() != 0) return;
    std::vector<BlockReaction> others, reactions;
    std::vector<ContactPoint> contacts;
    for (const Bytes& bytes : from) {
        ByteReader reader(bytes);
        reader.append(others);
        reader.append(reactions);
        reader.append(contacts);
    }
    std::vector<std::size_t> order(contacts.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return reactions[a].key < reactions[b].key; });
    std::sort(others.begin(), others.end(),
              [](const BlockReaction& a, const BlockReaction& b) { return a.key < b.key; });
    report.contacts.clear();
    report.reactions = std::move(others);
    for (const std::size_t k : order) {
        report.contacts.push_back(contacts[k]);
        report.reactions.push_back(reactions[k]);
    }
}

StepMemory SharedRun::memory(const Timestepper& timestepper) const {
    if (!part_.system) return begin_;
    const int rank = communicator_->rank();
    StepMemory own = timestepper.memory();
    own.impulses.drop_zeros();
    Bytes bytes;
    for (const auto& values : own.of_columns) {
        std::vector<double> of_own;
        for (std::size_t k = 0; k < local_.size() && !values.empty(); ++k)
            if (owners_[static_cast<std::size_t>(local_[k])] == rank)
                of_own.insert(of_own.end(), values.begin() + static_cast<std::ptrdiff_t>(velocities * k),
                              values.begin() + static_cast<std::ptrdiff_t>(velocities * (k + 1)));
        put(bytes, of_own);
    }
    std::vector<double> impulses;
    own.impulses.append_to(impulses);
    put(bytes, impulses);
    const std::vector<Bytes> from = to_all(*communicator_, bytes);
    std::vector<ByteReader> readers(from.begin(), from.end());

    StepMemory all;
    all.numbers = own.numbers;
    for (std::size_t i = 0; i < own.of_columns.size(); ++i) {
        std::vector<std::vector<double>> parts;
        bool known = false;
        for (ByteReader& reader : readers) {
            parts.push_back(reader.next<double>());
            known = known || !parts.back().empty();
        }
        auto& values = all.of_columns.emplace_back();
        std::vector<std::size_t> next(parts.size(), 0);
        for (std::size_t k = 0; k < owners_.size() && known; ++k) {
            const auto p = static_cast<std::size_t>(owners_[k]);
            const auto first = parts[p].begin() + static_cast<std::ptrdiff_t>(next[p]);
            values.insert(values.end(), first, first + velocities);
            next[p] += velocities;
        }
    }
    // Each process has λ of all rows of the joints of its bodies, the same as the others.
    for (const auto& values : own.of_rows) {
        std::int64_t known = values.empty() ? 0 : 1;
        communicator_->max(std::span(&known, 1));
        auto& of_all = all.of_rows.emplace_back();
        if (known == 0) continue;
        of_all.assign(static_cast<std::size_t>(system_.system->m()), -std::numeric_limits<double>::infinity());
        for (std::size_t k = 0; k < part_.rows.size() && !values.empty(); ++k)
            of_all[static_cast<std::size_t>(part_.rows[k])] = values[k];
        communicator_->max(of_all);
    }
    impulses.clear();
    for (ByteReader& reader : readers) reader.append(impulses);
    all.impulses.load(impulses);
    return all;
}

std::vector<Simulation::Share> SharedRun::shares() const {
    const int rank = communicator_->rank();
    Simulation::Share own;
    for (const std::int32_t body : local_)
        ++(owners_[static_cast<std::size_t>(body)] == rank ? own.bodies : own.ghosts);
    const auto& rows = steps_.rows_of_bodies();
    own.rows = std::accumulate(rows.begin(), rows.end(), std::int64_t{0});
    own.bytes_sent = communicator_->bytes_sent();
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    own.peak_memory = static_cast<std::int64_t>(usage.ru_maxrss) * 1024;
    Bytes bytes;
    put(bytes, std::vector<Simulation::Share>{own});
    std::vector<Simulation::Share> all;
    for (const Bytes& one : to_all(*communicator_, bytes)) ByteReader(one).append(all);
    return all;
}

}  // namespace delassus
