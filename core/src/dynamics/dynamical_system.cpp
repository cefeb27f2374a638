// SPDX-License-Identifier: BSD-3-Clause
#include "delassus/dynamical_system.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "delassus/error.hpp"
#include "problem/copy_cone.hpp"

namespace delassus {

void UnilateralRows::clear() {
    rows_.clear();
    contacts_.clear();
    row_start_.assign(1, 0);
    block_count_ = used_ = rows_in_blocks_ = 0;
    ascending_ = true;
}

// An array that comes back from a step is as long as its rows then were. Growing by a share, rather than to all of its
// memory, writes few zeros where a step has about as many rows as the last.
void UnilateralRows::grow(std::size_t entries) {
    entries = std::max(entries, column_.size() + column_.size() / 8);
    column_.resize(entries);
    value_.resize(entries);
}

void UnilateralRows::sort_row() {
    // Rows are short, and consist of sorted runs.
    for (auto last = static_cast<std::size_t>(row_start_.back()) + 1; last < used_; ++last)
        for (auto k = last; k > static_cast<std::size_t>(row_start_.back()) && column_[k] < column_[k - 1]; --k) {
            std::swap(column_[k], column_[k - 1]);
            std::swap(value_[k], value_[k - 1]);
        }
    ascending_ = true;
}

void UnilateralRows::move_into(SparseMatrix& D) {
    if (D.rows == 0) {
        D.column.swap(column_);
        D.value.swap(value_);
        D.row_start.swap(row_start_);
        D.column.resize(used_);
        D.value.resize(used_);
    } else {
        const auto before = D.entries();
        const auto used = static_cast<std::ptrdiff_t>(used_);
        D.column.insert(D.column.end(), column_.begin(), column_.begin() + used);
        D.value.insert(D.value.end(), value_.begin(), value_.begin() + used);
        for (std::size_t row = 1; row < row_start_.size(); ++row) D.row_start.push_back(before + row_start_[row]);
    }
    D.rows += static_cast<std::int32_t>(rows_.size());
    row_start_.assign(1, 0);
    used_ = 0;
}

void UnilateralRows::end_block(const Cone& cone, std::uint64_t key, double restitution, double compliance) {
    const auto given = static_cast<std::int32_t>(rows_.size() - rows_in_blocks_);
    if (given != cone.rows)
        throw InputError(fmt::format("a block of {} rows was given a cone of {}", given, cone.rows));
    const std::size_t first_row = std::exchange(rows_in_blocks_, rows_.size());
    if (block_count_ == blocks_.size()) blocks_.emplace_back();
    Block& block = blocks_[block_count_++];
    copy_cone(cone, block.cone);
    block.restitution = restitution;
    block.compliance = compliance;
    block.key = key;
    block.speed = velocity_ ? speed(first_row, velocity_) : 0.0;
    // The processor's own prefetching ends at each page.
    if (const std::size_t ahead = used_ + 512; ahead < column_.size()) {
        __builtin_prefetch(&value_[ahead], 1);
        __builtin_prefetch(&column_[ahead], 1);
    }
}

double UnilateralRows::speed(std::size_t row, const double* v) const {
    double speed = rows_[row].rate;
    for (auto e = static_cast<std::size_t>(row_start_[row]); e < static_cast<std::size_t>(row_start_[row + 1]); ++e)
        speed += value_[e] * v[column_[e]];
    return speed;
}

DynamicalSystem::~DynamicalSystem() = default;

std::int32_t DynamicalSystem::position_size() const {
    return n();
}
std::vector<std::int32_t> DynamicalSystem::bodies_of_columns() const {
    std::vector<std::int32_t> bodies(static_cast<std::size_t>(n()));
    std::iota(bodies.begin(), bodies.end(), 0);
    return bodies;
}
std::vector<std::int32_t> DynamicalSystem::vectors() const {
    return {};
}
std::vector<std::int32_t> DynamicalSystem::constraint_blocks() const {
    return {};
}
std::int32_t DynamicalSystem::m() const {
    const auto blocks = constraint_blocks();
    return std::accumulate(blocks.begin(), blocks.end(), 0);
}

void DynamicalSystem::increment(const double* q, const double* delta, double* result) const {
    for (std::int32_t i = 0; i < n(); ++i) result[i] = q[i] + delta[i];
}
void DynamicalSystem::difference(const double* from, const double* to, double* delta) const {
    for (std::int32_t i = 0; i < n(); ++i) delta[i] = to[i] - from[i];
}
void DynamicalSystem::inverse_tangent(const double*, std::vector<DiagonalBlock3>& blocks) const {
    blocks.clear();
}

bool DynamicalSystem::accelerate(const State&, double*) const {
    return false;
}
void DynamicalSystem::add_stiffness(const State&, double, Tangent, MatrixAssembler&) const {}
void DynamicalSystem::add_damping(const State&, double, Tangent, MatrixAssembler&) const {}
void DynamicalSystem::add_gyroscopic_damping(const State&, double, Tangent, MatrixAssembler&) const {}
void DynamicalSystem::free_spins(const State&, double, std::vector<FreeSpin>& spins) const {
    spins.clear();
}
double DynamicalSystem::recovery_speed() const {
    return 0.01;
}
double DynamicalSystem::free_fall() const {
    return 0.0;
}
double DynamicalSystem::gap_resolution() const {
    return 0.0;
}
void DynamicalSystem::add_inertial_stiffness(const State&, const double*, double, Tangent, MatrixAssembler&) const {}
bool DynamicalSystem::has_stiffness() const {
    return true;
}
void DynamicalSystem::find_stiff_forces(double, std::vector<std::int32_t>& stiff) const {
    stiff.clear();
}
void DynamicalSystem::stiff_tensions(const State&, std::span<const std::int32_t>, std::vector<double>& tensions) const {
    tensions.clear();
}
void DynamicalSystem::add_stiff_forces(const State&, std::span<const std::int32_t>, std::span<const double>, double,
                                       double*) const {}
void DynamicalSystem::add_stiff_tangent(const State&, std::span<const std::int32_t>, double, double,
                                        MatrixAssembler&) const {}

void DynamicalSystem::constraint(const State&, double*) const {}
void DynamicalSystem::add_constraint_jacobian(const State&, std::int32_t, MatrixAssembler&) const {}
void DynamicalSystem::constraint_rate(const State&, double* C_t) const {
    std::fill_n(C_t, m(), 0.0);
}
void DynamicalSystem::constraint_curvature(const State&, double* c) const {
    std::fill_n(c, m(), 0.0);
}
void DynamicalSystem::add_constraint_stiffness(const State&, const double*, double, Tangent, MatrixAssembler&) const {}
void DynamicalSystem::add_definite_constraint_stiffness(const State&, const double*, double, MatrixAssembler&) const {}

double DynamicalSystem::next_jump(double /*t*/) const {
    return std::numeric_limits<double>::infinity();
}
double DynamicalSystem::longest_step(double /*t*/) const {
    return std::numeric_limits<double>::infinity();
}

bool DynamicalSystem::has_unilateral() const {
    return false;
}

bool DynamicalSystem::collect_contact(const SmoothMotion&, double, const ContactPoint&, UnilateralRows&) {
    return false;
}
void DynamicalSystem::collect_unilateral(const State&, double, UnilateralRows& rows) {
    rows.clear();
}

std::optional<Vector3> DynamicalSystem::prescribed_velocity(const ContactPoint&, double, double) const {
    return std::nullopt;
}

double DynamicalSystem::energy(const State&) const {
    return std::numeric_limits<double>::quiet_NaN();
}

double kinetic_energy(const DynamicalSystem& system, const State& at, std::span<const double> v,
                      std::vector<double>& momentum) {
    momentum.assign(v.size(), 0.0);
    system.multiply_mass(at, 1.0, v.data(), momentum.data());
    return 0.5 * std::inner_product(v.begin(), v.end(), momentum.begin(), 0.0);
}

}  // namespace delassus
