// SPDX-License-Identifier: BSD-3-Clause
#include "complementarity.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "delassus/sdk/cones.hpp"

namespace delassus::ipm {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

double tangent_norm(const Triple& v) {
    return std::sqrt(v[1] * v[1] + v[2] * v[2]);
}

double dot(const Triple& a, const Triple& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

double determinant(const Triple& v) {
    const double t = tangent_norm(v);
    return (v[0] - t) * (v[0] + t);
}

/// a ∘ b = (aᵀb, a₀ b₁ + b₀ a₁).
Triple jordan_product(const Triple& a, const Triple& b) {
    return {dot(a, b), a[0] * b[1] + b[0] * a[1], a[0] * b[2] + b[0] * a[2]};
}

/// The y with ℓ ∘ y = v.
Triple jordan_divide(const Triple& ell, const Triple& v) {
    const double y0 = (ell[0] * v[0] - ell[1] * v[1] - ell[2] * v[2]) / determinant(ell);
    return {y0, (v[1] - y0 * ell[1]) / ell[0], (v[2] - y0 * ell[2]) / ell[0]};
}

Triple plus(const Triple& a, double factor, const Triple& b) {
    return {a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]};
}

Triple load_rows(const sdk::Vector& v, std::int32_t first, std::int32_t rows) {
    return {v[first], v[first + 1], rows == 3 ? v[first + 2] : 0.0};
}

void store_rows(const Triple& t, std::int32_t first, std::int32_t rows, sdk::Vector& v) {
    for (std::int32_t i = 0; i < rows; ++i) v[first + i] = t[static_cast<std::size_t>(i)];
}

/// Qᵀ v and Q v; columns of Q are the basis vectors.
Triple into(const Basis& basis, const Triple& v) {
    return {dot(basis[0], v), dot(basis[1], v), dot(basis[2], v)};
}
Triple out_of(const Basis& basis, const Triple& v) {
    Triple result{};
    for (std::size_t k = 0; k < 3; ++k) result = plus(result, v[k], basis[k]);
    return result;
}

/// The smallest eigenvalue of ℓ ∘ ℓ, (ℓ₀ − ‖ℓ₁‖)², for ℓ = W z = W⁻¹ s, from zᵀs and det z det s: the sum of both
/// eigenvalues is 2 zᵀs, their product det z det s.
double smallest_eigenvalue(double product, double squared) {
    return squared / (product + std::sqrt(std::max(product * product - squared, 0.0)));
}

/// The largest α with ℓ + α d in the cone: 1/α is minus the smallest eigenvalue of d seen from ℓ̄ = ℓ/√det ℓ
/// (Vandenberghe 2010, section 5.2).
double longest_step_in_cone(const Triple& ell, const Triple& d) {
    const double root = std::sqrt(determinant(ell));
    const Triple unit{ell[0] / root, ell[1] / root, ell[2] / root};
    const double rho0 = unit[0] * d[0] - unit[1] * d[1] - unit[2] * d[2];
    const double factor = (rho0 + d[0]) / (unit[0] + 1.0);
    const double rho1 = std::hypot(d[1] - factor * unit[1], d[2] - factor * unit[2]);
    const double inverse = (rho1 - rho0) / root;
    return inverse > 0.0 ? 1.0 / inverse : infinity;
}

}  // namespace

void Complementarity::load(const sdk::ProblemView& problem, const sdk::Vector& z_scale) {
    path_ = problem.coulomb ? Path::Product : Path::Associated;
    share_ = 1.0;
    intervals_.clear();
    free_.clear();
    blocks_.clear();
    block_of_group_.clear();
    held_.assign(static_cast<std::size_t>(problem.m), 0);
    held_value_.setZero(problem.m);
    const auto add_interval = [&](std::int32_t row, double lower, double upper) {
        const double lo = lower / z_scale[row], hi = upper / z_scale[row];
        if (!(lo < hi)) {
            held_[static_cast<std::size_t>(row)] = 1;
            held_value_[row] = lo;
        } else if (std::isfinite(lo) || std::isfinite(hi)) {
            intervals_.push_back({row, std::isfinite(lo), std::isfinite(hi), lo, hi, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
        } else {
            free_.push_back(row);
        }
    };
    for (const delassus_cone& cone : problem.cones) {
        if (cone.kind == DELASSUS_CONE_FRICTION && sdk::friction_coefficient(cone) > 0.0) {
            block_of_group_.push_back(static_cast<std::int32_t>(blocks_.size()));
            Block block{};
            block.first = cone.first_row;
            block.rows = cone.rows;
            blocks_.push_back(block);
            continue;
        }
        const auto groups = cone.kind == DELASSUS_CONE_FRICTION ? 1 : cone.rows;
        block_of_group_.insert(block_of_group_.end(), static_cast<std::size_t>(groups), -1);
        for (std::int32_t i = 0; i < cone.rows; ++i) {
            const std::int32_t row = cone.first_row + i;
            if (cone.kind == DELASSUS_CONE_FRICTION) {
                add_interval(row, 0.0, i == 0 ? infinity : 0.0);
            } else if (cone.kind == DELASSUS_CONE_NONNEGATIVE) {
                add_interval(row, 0.0, infinity);
            } else if (cone.kind == DELASSUS_CONE_BOX) {
                add_interval(row, cone.lo[i], cone.hi[i]);
            } else {
                free_.push_back(row);
            }
        }
    }
    count_products();
}

void Complementarity::count_products() {
    degree_ = static_cast<double>(blocks_.size()) * (path_ == Path::Product ? 2.0 : 1.0);
    for (const Interval& row : intervals_) degree_ += (row.has_lower ? 1.0 : 0.0) + (row.has_upper ? 1.0 : 0.0);
}

void Complementarity::start(const sdk::Vector& z, const sdk::Vector& s, double z_margin, double s_margin) {
    z_ = z;
    s_.setZero(z.size());
    for (Eigen::Index i = 0; i < z.size(); ++i)
        if (is_held(i)) z_[i] = held_value_[i];
    for (Interval& row : intervals_) {
        double value = z[row.row];
        // Between two bounds the margin is at most a quarter of the width.
        const double room =
            row.has_lower && row.has_upper ? std::min(z_margin, 0.25 * (row.upper - row.lower)) : z_margin;
        if (row.has_lower) value = std::max(value, row.lower + room);
        if (row.has_upper) value = std::min(value, row.upper - room);
        row.p = row.has_lower ? value - row.lower : 0.0;
        row.q = row.has_upper ? row.upper - value : 0.0;
        row.wl = row.has_lower ? std::max(s[row.row], 0.0) + s_margin : 0.0;
        row.wu = row.has_upper ? std::max(-s[row.row], 0.0) + s_margin : 0.0;
        z_[row.row] = value;
        s_[row.row] = row.wl - row.wu;
    }
    for (Block& block : blocks_) {
        Triple zb = load_rows(z, block.first, block.rows), sb = load_rows(s, block.first, block.rows);
        zb[0] = std::max(zb[0], tangent_norm(zb) + z_margin);
        sb[0] = std::max(sb[0], tangent_norm(sb) + s_margin);
        store_rows(zb, block.first, block.rows, z_);
        store_rows(sb, block.first, block.rows, s_);
        block.det_z = determinant(zb);
        block.det_s = determinant(sb);
        block.product = dot(zb, sb);
        block.v = std::max(sb[0] - tangent_norm(sb), 0.01 * sb[0]);
    }
    renew_velocity();
}

void Complementarity::renew_velocity() {
    u_ = s_;
    if (path_ == Path::Associated) return;
    for (Block& block : blocks_) {
        if (path_ == Path::Shift) {
            const Triple s = load_rows(s_, block.first, block.rows);
            const double length = tangent_norm(s);  // s₀ − ‖s_t‖ = det s/(s₀ + ‖s_t‖) keeps its digits
            block.v = block.det_s / (s[0] + length) + (1.0 - share_) * (length - block.shift);
        }
        u_[block.first] = block.v;
    }
}

double Complementarity::shift_of(const Block& block) const {
    return (1.0 - share_) * block.shift + share_ * tangent_norm(load_rows(s_, block.first, block.rows));
}

void Complementarity::take_shift_path() {
    path_ = Path::Shift;
    for (Block& block : blocks_) {
        const Triple s = load_rows(s_, block.first, block.rows);
        block.shift = tangent_norm(s);
        s_[block.first] = block.v + block.shift;
        block.det_s = block.v * (block.v + 2.0 * block.shift);
        block.product = dot(load_rows(z_, block.first, block.rows), load_rows(s_, block.first, block.rows));
    }
    count_products();
    set_share(1.0);
}

void Complementarity::take_product_path() {
    set_share(1.0);
    path_ = Path::Product;
    count_products();
}

void Complementarity::set_share(double share) {
    share_ = share;
    renew_velocity();
}

void Complementarity::advance_shift() {
    for (Block& block : blocks_) block.shift = shift_of(block);
}

double Complementarity::shift_lag() const {
    double sum = 0.0;
    for (const Block& block : blocks_) {
        const double lag = tangent_norm(load_rows(s_, block.first, block.rows)) - shift_of(block);
        sum += lag * lag;
    }
    return std::sqrt(sum);
}

double Complementarity::distance_from_centre(double tau) const {
    double largest = 0.0;
    for (const Interval& row : intervals_) {
        if (row.has_lower) largest = std::max(largest, std::abs(row.p * row.wl - tau));
        if (row.has_upper) largest = std::max(largest, std::abs(row.q * row.wu - tau));
    }
    for (const Block& block : blocks_) {
        const Triple rest = plus(jordan_product(block.ell, block.ell), -1.0, {tau, 0.0, 0.0});
        largest = std::max(largest, std::sqrt(dot(rest, rest)));
        if (path_ == Path::Product) largest = std::max(largest, std::abs(normal_product(block, 0.0) - tau));
    }
    return largest / tau;
}

double Complementarity::products(double step) const {
    double sum = 0.0;
    for (const Interval& row : intervals_) {
        if (row.has_lower) sum += (row.p + step * row.dz) * (row.wl + step * row.dwl);
        if (row.has_upper) sum += (row.q - step * row.dz) * (row.wu + step * row.dwu);
    }
    for (const Block& block : blocks_) {
        sum += step == 0.0 ? block.product : dot(plus(block.ell, step, block.dz), plus(block.ell, step, block.ds));
        if (path_ == Path::Product) sum += normal_product(block, step);
    }
    return sum;
}

double Complementarity::smallest_product(double step) const {
    double smallest = infinity;
    for (const Interval& row : intervals_) {
        if (row.has_lower) smallest = std::min(smallest, (row.p + step * row.dz) * (row.wl + step * row.dwl));
        if (row.has_upper) smallest = std::min(smallest, (row.q - step * row.dz) * (row.wu + step * row.dwu));
    }
    for (const Block& block : blocks_) {
        double product = block.product, squared = block.det_z * block.det_s;
        if (step > 0.0) {
            const Triple z = plus(block.ell, step, block.dz), s = plus(block.ell, step, block.ds);
            product = dot(z, s);
            squared = determinant(z) * determinant(s);
        }
        smallest = std::min(smallest, smallest_eigenvalue(product, squared));
        if (path_ == Path::Product) smallest = std::min(smallest, normal_product(block, step));
    }
    return smallest;
}

void Complementarity::scale(sdk::Vector& theta) {
    theta.setZero(z_.size());
    for (Eigen::Index i = 0; i < z_.size(); ++i)
        if (is_held(i)) theta[i] = held;
    for (const Interval& row : intervals_)
        theta[row.row] = (row.has_lower ? row.wl / row.p : 0.0) + (row.has_upper ? row.wu / row.q : 0.0);
    for (Block& block : blocks_) {
        scale_block(block);
        Triple value{};
        find_theta(block, value);
        store_rows(value, block.first, block.rows, theta);
    }
}

void Complementarity::find_theta(Block& block, Triple& diagonal) const {
    for (std::size_t k = 0; k < 3; ++k) diagonal[k] = block.root_theta[k] * block.root_theta[k];
    block.beside = {};
    if (path_ == Path::Associated) return;
    const double small = diagonal[1], along = 0.5 * (diagonal[0] + small);
    block.beside.below = -small;
    diagonal = {block.v / z_[block.first], along, diagonal[2]};
    if (path_ == Path::Product) return;
    const Triple s = load_rows(s_, block.first, block.rows);
    const double length = tangent_norm(s);
    const Triple seen =
        into(block.rows_in, {0.0, length > 0.0 ? s[1] / length : 0.0, length > 0.0 ? s[2] / length : 0.0});
    block.c = share_ * seen[1];
    block.d = share_ * seen[2];
    const double rest = seen[1] > 0.0 ? seen[2] * seen[2] / (1.0 + seen[1]) : 1.0 - seen[1];  // 1 − c/φ
    const double one_less = (1.0 - share_) + share_ * rest;
    diagonal[0] = (1.0 + block.c) * small;
    block.beside.right = one_less * along - small;
    block.beside.far = -block.d * diagonal[2];
}

void Complementarity::scale_block(Block& block) {
    const Triple z = load_rows(z_, block.first, block.rows), s = load_rows(s_, block.first, block.rows);
    const double root_z = std::sqrt(block.det_z), root_s = std::sqrt(block.det_s);
    const double cosine = std::max(1.0, block.product / (root_z * root_s));  // z̄ᵀs̄
    const double gamma = std::sqrt(0.5 * (1.0 + cosine));
    const Triple zn{z[0] / root_z, z[1] / root_z, z[2] / root_z};
    const Triple sn{s[0] / root_s, s[1] / root_s, s[2] / root_s};
    const double wy = (sn[1] - zn[1]) / (2.0 * gamma), wz = (sn[2] - zn[2]) / (2.0 * gamma);
    const double length = std::sqrt(wy * wy + wz * wz);
    const double omega = length + std::sqrt(1.0 + length * length);  // w̄₀ + ‖w̄₁‖ with det w̄ = 1
    block.eta = std::sqrt(root_s / root_z);
    block.root_theta = {block.eta * omega, block.eta / omega, block.eta};
    const double ny = length > 0.0 ? wy / length : 1.0, nz = length > 0.0 ? wz / length : 0.0;
    const double half = std::sqrt(0.5);
    const Triple across = block.rows == 3 ? Triple{0.0, -nz, ny} : Triple{0.0, 0.0, 1.0};
    block.eigen = {Triple{half, half * ny, half * nz}, Triple{half, -half * ny, -half * nz}, across};
    if (path_ != Path::Associated) {
        const Triple normal{1.0, 0.0, 0.0}, along{0.0, ny, nz};
        block.rows_in = {normal, along, across};
        block.reactions_in = {plus(normal, -1.0, along), along, across};
    } else {
        block.rows_in = block.reactions_in = block.eigen;
    }

    // ℓ = (det z det s)^(1/4) ℓ̄, ℓ̄₀ = γ, det ℓ̄ = 1 (Vandenberghe 2010, section 5.1).
    const double size = std::sqrt(root_z * root_s), weight = 1.0 / (sn[0] + zn[0] + 2.0 * gamma);
    Triple ell{gamma, weight * ((gamma + sn[0]) * zn[1] + (gamma + zn[0]) * sn[1]),
               weight * ((gamma + sn[0]) * zn[2] + (gamma + zn[0]) * sn[2])};
    const double wanted = std::sqrt(0.5 * (cosine - 1.0)), found = tangent_norm(ell);
    const double correction = found > 0.0 ? wanted / found : 0.0;
    block.ell = {size * ell[0], size * correction * ell[1], size * correction * ell[2]};
}

void Complementarity::rows_to_basis(sdk::Vector& v) const {
    for (const Block& block : blocks_)
        store_rows(into(block.rows_in, load_rows(v, block.first, block.rows)), block.first, block.rows, v);
}

void Complementarity::reactions_from_basis(sdk::Vector& v) const {
    for (const Block& block : blocks_)
        store_rows(out_of(block.reactions_in, load_rows(v, block.first, block.rows)), block.first, block.rows, v);
}

// W q in the block's basis. With exact Coulomb its first row has the target of v, or that of s₀ − σ.
void Complementarity::store_target(Block& block, sdk::Vector& t) const {
    Triple value = into(block.eigen, block.q);
    for (std::size_t k = 0; k < 3; ++k) value[k] *= block.root_theta[k];
    if (path_ != Path::Associated) {
        const double half = std::sqrt(0.5), along = half * (value[0] - value[1]);
        // (W q)₀ − c (W q)_ŵ − d (W q)_t, with (W q)₀ = (W q)_ŵ + √2 value₁
        const double shifted = (1.0 - block.c) * along + 2.0 * half * value[1] - block.d * value[2];
        value = {path_ == Path::Product ? block.tv : shifted, along, value[2]};
    }
    store_rows(value, block.first, block.rows, t);
}

void Complementarity::target_zero(sdk::Vector& t) {
    t.setZero(z_.size());
    for (Interval& row : intervals_) {
        row.tl = -row.wl;
        row.tu = -row.wu;
        t[row.row] = row.tl - row.tu;
    }
    for (Block& block : blocks_) {
        block.q = {-block.ell[0], -block.ell[1], -block.ell[2]};
        block.tv = -block.v;
        store_target(block, t);
    }
}

void Complementarity::target(double tau, bool second_order, sdk::Vector& t) {
    t.setZero(z_.size());
    const double second = second_order ? 1.0 : 0.0;
    for (Interval& row : intervals_) {
        row.tl = row.has_lower ? (tau - second * row.dz * row.dwl) / row.p - row.wl : 0.0;
        row.tu = row.has_upper ? (tau + second * row.dz * row.dwu) / row.q - row.wu : 0.0;
        t[row.row] = row.tl - row.tu;
    }
    for (Block& block : blocks_) {
        Triple rest = jordan_product(block.ell, block.ell);
        if (second_order) rest = plus(rest, 1.0, jordan_product(block.ds, block.dz));
        block.q = jordan_divide(block.ell, {tau - rest[0], -rest[1], -rest[2]});
        block.tv = (tau - second * block.dz0 * block.dv) / z_[block.first] - block.v;
        store_target(block, t);
    }
}

// Gondzio (1996) for the pairs of intervals. A block has two products, the eigenvalues v₀ ± ‖v₁‖ of the trial point
// v = (W z + α W δz) ∘ (W⁻¹ s + α W⁻¹ δs), with the directions (1, ±v₁/‖v₁‖)/2; what moves them is divided by ℓ, as in
// target(). No product is pushed down by more than high, or one that has grown far too large would outweigh all others.
void Complementarity::correct(double step, double low, double high, sdk::Vector& t) {
    const auto correction = [&](double product) { return std::max(std::clamp(product, low, high) - product, -high); };
    for (Interval& row : intervals_) {
        row.old_tl = row.tl;
        row.old_tu = row.tu;
        if (row.has_lower) row.tl += correction((row.p + step * row.dz) * (row.wl + step * row.dwl)) / row.p;
        if (row.has_upper) row.tu += correction((row.q - step * row.dz) * (row.wu + step * row.dwu)) / row.q;
        t[row.row] = row.tl - row.tu;
    }
    for (Block& block : blocks_) {
        block.old_q = block.q;
        const Triple v = jordan_product(plus(block.ell, step, block.dz), plus(block.ell, step, block.ds));
        const double length = tangent_norm(v);
        const double larger = correction(v[0] + length), smaller = correction(v[0] - length);
        if (larger == 0.0 && smaller == 0.0) continue;
        const double along = length > 0.0 ? 0.5 * (larger - smaller) / length : 0.0;
        block.q = plus(block.q, 1.0, jordan_divide(block.ell, {0.5 * (larger + smaller), along * v[1], along * v[2]}));
        store_target(block, t);
    }
}

void Complementarity::undo_correction() {
    for (Interval& row : intervals_) {
        row.tl = row.old_tl;
        row.tu = row.old_tu;
    }
    for (Block& block : blocks_) block.q = block.old_q;
}

void Complementarity::set_direction(const sdk::Vector& dz) {
    direction_ = dz;
    reactions_from_basis(direction_);
    for (Interval& row : intervals_) {
        row.dz = dz[row.row];
        row.dwl = row.has_lower ? row.tl - row.wl / row.p * row.dz : 0.0;
        row.dwu = row.has_upper ? row.tu + row.wu / row.q * row.dz : 0.0;
    }
    for (Block& block : blocks_) {
        Triple eigen = load_rows(dz, block.first, block.rows);
        if (path_ != Path::Associated) {
            block.dz0 = eigen[0];
            block.dv = block.tv - block.v / z_[block.first] * block.dz0;
            eigen = {std::sqrt(0.5) * eigen[1], std::sqrt(0.5) * (2.0 * eigen[0] - eigen[1]), eigen[2]};
        }
        for (std::size_t k = 0; k < 3; ++k) eigen[k] *= block.root_theta[k];
        block.dz = out_of(block.eigen, eigen);
        block.ds = plus(block.q, -1.0, block.dz);
    }
}

double Complementarity::longest_step() const {
    double longest = infinity;
    const auto limit = [&longest](double value, double change) {
        if (change < 0.0) longest = std::min(longest, -value / change);
    };
    for (const Interval& row : intervals_) {
        if (row.has_lower) {
            limit(row.p, row.dz);
            limit(row.wl, row.dwl);
        }
        if (row.has_upper) {
            limit(row.q, -row.dz);
            limit(row.wu, row.dwu);
        }
    }
    for (const Block& block : blocks_) {
        longest =
            std::min({longest, longest_step_in_cone(block.ell, block.dz), longest_step_in_cone(block.ell, block.ds)});
        if (path_ == Path::Product) limit(block.v, block.dv);
    }
    return longest;
}

void Complementarity::advance(double step) {
    z_ += step * direction_;
    for (Interval& row : intervals_) {
        row.p += step * row.dz;
        row.q -= step * row.dz;
        row.wl += step * row.dwl;
        row.wu += step * row.dwu;
        // ẑ follows from the smaller distance, and the larger one from ẑ, so that rounding does not part them.
        if (row.has_lower && (!row.has_upper || row.p <= row.q)) {
            z_[row.row] = row.lower + row.p;
            if (row.has_upper) row.q = row.upper - z_[row.row];
        } else {
            z_[row.row] = row.upper - row.q;
            if (row.has_lower) row.p = z_[row.row] - row.lower;
        }
        s_[row.row] = row.wl - row.wu;
    }
    for (Block& block : blocks_) {
        Triple eigen = into(block.eigen, block.ds);
        for (std::size_t k = 0; k < 3; ++k) eigen[k] *= step * block.root_theta[k];
        store_rows(plus(load_rows(s_, block.first, block.rows), 1.0, out_of(block.eigen, eigen)), block.first,
                   block.rows, s_);
        // det W v = η² det v.
        const Triple z = plus(block.ell, step, block.dz), s = plus(block.ell, step, block.ds);
        block.det_z = determinant(z) / (block.eta * block.eta);
        block.det_s = determinant(s) * (block.eta * block.eta);
        block.product = dot(z, s);
        if (path_ == Path::Product) block.v += step * block.dv;
        renew_products(block);
    }
    renew_velocity();
}

// z and s themselves are the better source while rounding leaves them enough digits: the values carried along agree
// with them only up to the rounding of the largest z and s so far.
void Complementarity::renew_products(Block& block) const {
    constexpr double clear = 1e-6;
    const Triple z = load_rows(z_, block.first, block.rows), s = load_rows(s_, block.first, block.rows);
    if (const double det = determinant(z); det > clear * z[0] * z[0]) block.det_z = det;
    if (const double det = determinant(s); det > clear * s[0] * s[0]) block.det_s = det;
    if (const double product = dot(z, s); product > clear * z[0] * s[0]) block.product = product;
}

void Complementarity::project_to_recession(sdk::Vector& z) const {
    for (Eigen::Index i = 0; i < z.size(); ++i)
        if (is_held(i)) z[i] = 0.0;
    for (const Interval& row : intervals_) {
        if (row.has_lower) z[row.row] = std::max(z[row.row], 0.0);
        if (row.has_upper) z[row.row] = std::min(z[row.row], 0.0);
    }
    for (const Block& block : blocks_) sdk::FrictionCone::project_with_slope(1.0, block.rows, z.data() + block.first);
}

double Complementarity::distance_to_recession_dual(const sdk::Vector& s) const {
    double sum = 0.0;
    for (const auto row : free_) sum += s[row] * s[row];
    for (const Interval& row : intervals_) {
        if (row.has_lower && row.has_upper) continue;
        const double outside = row.has_lower ? std::min(s[row.row], 0.0) : std::max(s[row.row], 0.0);
        sum += outside * outside;
    }
    for (const Block& block : blocks_) {
        const Triple v = load_rows(s, block.first, block.rows);
        Triple inside = v;
        sdk::FrictionCone::project_with_slope(1.0, 3, inside.data());
        const Triple outside = plus(v, -1.0, inside);
        sum += dot(outside, outside);
    }
    return std::sqrt(sum);
}

}  // namespace delassus::ipm
