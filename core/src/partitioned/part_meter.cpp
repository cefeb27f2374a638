// SPDX-License-Identifier: BSD-3-Clause
#include "partitioned/part_meter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "delassus/error.hpp"
#include "delassus/sdk/residual.hpp"
#include "partitioned/bytes.hpp"
#include "partitioned/local_entries.hpp"

namespace delassus {

namespace {

double square(double value) {
    return value * value;
}

/// Sums up so many rows at once: they are a copy, and each time costs a vector of all columns.
std::size_t rows_at_once(std::int64_t rows) {
    return std::clamp<std::size_t>(static_cast<std::size_t>(rows) / 16, 4096, 65536);
}

}  // namespace

PartMeter::PartMeter(const PreparedPart::Implementation& part) : part_(part) {
    std::int32_t largest = 0;
    for (const auto& cone : part_.cones) largest = std::max(largest, cone.rows);
    work_.resize(3 * static_cast<std::size_t>(largest));
    if (part_.stands_in()) magnitude_ = part_.magnitude_of_diagonal();
    scaling_ = part_.cone_scaling(diagonal_of_N());
    renew();
}

// The part of a row of D that lies in the columns of one process contributes d H⁻¹ dᵀ on its own, since H couples no
// processes. Foreign parts are sent to the owners of the columns, which return one number each.
void PartMeter::add_squares_of_rows(std::vector<double>& diagonal) const {
    const auto& problem = part_.problem;
    const Communicator& run = *part_.communicator;
    const auto processes = static_cast<std::size_t>(run.size());
    const std::int64_t first_own = problem.column_start[static_cast<std::size_t>(run.rank())];
    struct Foreign {
        RowParts parts;
        std::vector<std::int64_t> row;
    };
    std::vector<Foreign> foreign(processes);
    RowParts own;
    std::vector<double> squares;
    std::int64_t first = 0;
    const auto flush_own = [&](std::int64_t next) {
        squares.assign(own.rows(), 0.0);
        part_.inverse->add_squares(own, squares);
        for (std::size_t i = 0; i < squares.size(); ++i) diagonal[static_cast<std::size_t>(first) + i] += squares[i];
        own.clear();
        first = next;
    };
    const std::size_t at_once = rows_at_once(problem.m());
    for (std::int64_t row = 0; row < problem.m(); ++row) {
        std::size_t last = processes;
        for_entries(problem.D, row, [&](std::int64_t j, double value) {
            if (part_.columns.is_own(j)) return own.put(j - first_own, value);
            const std::size_t p = part_.columns.owner(j);
            if (last != processes && last != p) foreign[last].parts.end_row();
            if (last != p) foreign[p].row.push_back(row);
            last = p;
            foreign[p].parts.put(j - problem.column_start[p], value);
        });
        if (last != processes) foreign[last].parts.end_row();
        own.end_row();
        if (own.rows() == at_once) flush_own(row + 1);
    }
    if (own.rows() > 0) flush_own(problem.m());
    std::vector<Bytes> to(processes);
    for (std::size_t p = 0; p < processes; ++p) {
        put(to[p], foreign[p].parts.row_start);
        put(to[p], foreign[p].parts.column);
        put(to[p], foreign[p].parts.value);
        foreign[p].parts = {};
    }
    auto from = run.exchange(to);
    for (std::size_t p = 0; p < processes; ++p) {
        RowParts parts;
        ByteReader reader(from[p]);
        parts.row_start = reader.next<std::int32_t>();
        parts.column = reader.next<std::int32_t>();
        parts.value = reader.next<double>();
        squares.assign(parts.rows(), 0.0);
        if (parts.rows() > 0) part_.inverse->add_squares(parts, squares);
        to[p].clear();
        put(to[p], squares);
    }
    from = run.exchange(to);
    for (std::size_t p = 0; p < processes; ++p) {
        squares = ByteReader(from[p]).next<double>();
        for (std::size_t k = 0; k < squares.size(); ++k)
            diagonal[static_cast<std::size_t>(foreign[p].row[k])] += squares[k];
    }
}

// Blocks of rows of D are right-hand sides: each process has of each row what lies in its columns, solves with the
// others, and multiplies what it has of the solution by what it has of the row.
void PartMeter::add_squares_by_solves(std::vector<double>& diagonal) const {
    const auto& problem = part_.problem;
    const Communicator& run = *part_.communicator;
    const auto rank = static_cast<std::size_t>(run.rank()), processes = static_cast<std::size_t>(run.size());
    const auto n = static_cast<std::size_t>(problem.n());
    struct Entry {
        std::int64_t row, column;
        double value;
    };
    constexpr std::int64_t largest_block = 8 << 20;  // entries of the right-hand sides on one process
    const std::int64_t at_once =
        std::clamp<std::int64_t>(largest_block / std::max<std::int64_t>(1, part_.largest(problem.n())), 1, 128);
    const std::int64_t first_own = problem.row_start[rank], first_column = problem.column_start[rank];
    std::vector<double> right, solved, sums;
    for (std::int64_t first = 0; first < problem.m_all(); first += at_once) {
        const std::int64_t last = std::min(first + at_once, problem.m_all());
        const auto count = static_cast<std::size_t>(last - first);
        std::vector<std::vector<Entry>> leaving(processes);
        for (std::int64_t row = std::max(first, first_own); row < std::min(last, first_own + problem.m()); ++row)
            for_entries(problem.D, row - first_own, [&](std::int64_t j, double value) {
                leaving[part_.columns.owner(j)].push_back({row - first, j, value});
            });
        std::vector<Bytes> to(processes);
        for (std::size_t p = 0; p < processes; ++p) put(to[p], leaving[p]);
        right.assign(n * count, 0.0);
        for (const Bytes& bytes : run.exchange(to))
            for (const Entry& entry : ByteReader(bytes).next<Entry>()) {
                const auto i = static_cast<std::size_t>(entry.column - first_column);
                right[static_cast<std::size_t>(entry.row) * n + i] = part_.C[i] * entry.value;
            }
        solved = right;
        part_.factors->apply(solved.data(), static_cast<std::int32_t>(count));
        sums.assign(count, 0.0);
        for (std::size_t k = 0; k < count; ++k)
            for (std::size_t i = 0; i < n; ++i) sums[k] += right[k * n + i] * solved[k * n + i];
        run.sum(sums);
        for (std::int64_t row = std::max(first, first_own); row < std::min(last, first_own + problem.m()); ++row)
            diagonal[static_cast<std::size_t>(row - first_own)] += sums[static_cast<std::size_t>(row - first)];
    }
}

std::vector<double> PartMeter::diagonal_of_N() const {
    const auto& problem = part_.problem;
    std::vector<double> diagonal(static_cast<std::size_t>(problem.m()), 0.0);
    if (part_.stands_in()) {
        std::vector<double> h = magnitude_;
        part_.columns.fetch(*part_.communicator, h);
        for (std::int64_t row = 0; row < problem.m(); ++row)
            for_entries(problem.D, row, [&](std::int64_t j, double value) {
                diagonal[static_cast<std::size_t>(row)] += value * value / h[part_.columns.place(j)];
            });
    } else if (part_.structure != Structure::Reduced) {
        part_.coupled ? add_squares_by_solves(diagonal) : add_squares_of_rows(diagonal);
    }
    const std::int64_t first = problem.row_start[static_cast<std::size_t>(part_.communicator->rank())];
    if (part_.compliant)
        for (std::int64_t row = 0; row < problem.m(); ++row)
            for_entries(problem.E, row, [&](std::int64_t j, double value) {
                if (j == first + row) diagonal[static_cast<std::size_t>(row)] += value;
            });
    return diagonal;
}

void PartMeter::renew() {
    const auto& problem = part_.problem;
    const auto n = static_cast<std::size_t>(problem.n());
    std::vector<double> v = problem.a;
    if (part_.stands_in()) {
        for (std::size_t i = 0; i < n; ++i) v[i] /= magnitude_[i];
    } else if (part_.structure != Structure::Reduced) {
        part_.apply_inverse(v);
    }
    part_.columns.fetch(*part_.communicator, v);
    std::vector<double> sums = {0.0, 0.0};
    for (std::size_t c = 0; c < scaling_.size(); ++c) {
        const double scale = square(scaling_[c]);
        if (!(scale > 0.0 && std::isfinite(scale))) sums[0] = std::numeric_limits<double>::quiet_NaN();
        const auto& cone = part_.cones[c];
        for (std::int64_t row = cone.first_row; row < cone.first_row + cone.rows; ++row) {
            double r = problem.b[static_cast<std::size_t>(row)];
            for_entries(problem.D, row, [&](std::int64_t j, double value) { r += value * v[part_.columns.place(j)]; });
            sums[0] += square(scaling_[c] * r);
            sums[1] += square(r);
        }
    }
    part_.communicator->sum(sums);
    reference_ = sdk::reference_of(sums[0]);
    r_norm_ = std::sqrt(sums[1]);
}

void PartMeter::take_x(const double* x) {
    x_.assign(x, x + part_.problem.n());
    part_.columns.fetch(*part_.communicator, x_);
}

void PartMeter::take_lambda(const double* lambda) {
    lambda_.assign(lambda, lambda + part_.problem.m());
    if (part_.compliant) part_.rows.fetch(*part_.communicator, lambda_);
}

ConeSums PartMeter::sums_over_cones(const double* lambda, bool with_impulse) {
    const auto& problem = part_.problem;
    if (with_impulse) impulse_.assign(part_.columns.size(), 0.0);
    const bool coulomb = problem.law == Law::Coulomb;
    ConeSums sums;
    for (std::size_t c = 0; c < part_.cones.size(); ++c) {
        const auto& cone = part_.cones[c];
        double *u = work_.data(), *magnitude = u + cone.rows, *trial = magnitude + cone.rows;
        for (std::int32_t i = 0; i < cone.rows; ++i) {
            const std::int64_t row = cone.first_row + i;
            u[i] = problem.b[static_cast<std::size_t>(row)];
            magnitude[i] = std::abs(u[i]);
            const double reaction = lambda[row];
            for_entries(problem.D, row, [&](std::int64_t j, double value) {
                const std::size_t place = part_.columns.place(j);
                const double term = value * x_[place];
                u[i] += term;
                magnitude[i] += std::abs(term);
                if (with_impulse) impulse_[place] += value * reaction;
            });
            if (part_.compliant)
                for_entries(problem.E, row, [&](std::int64_t j, double value) {
                    const double term = value * lambda_[part_.rows.place(j)];
                    u[i] += term;
                    magnitude[i] += std::abs(term);
                });
        }
        add_block(cone, scaling_[c], coulomb, lambda + cone.first_row, u, magnitude, trial, sums);
    }
    return sums;
}

Errors PartMeter::measure(const double* x, const double* lambda) {
    const auto& problem = part_.problem;
    take_x(x);
    take_lambda(lambda);
    ConeSums own = sums_over_cones(lambda, true);
    part_.columns.add(*part_.communicator, impulse_);
    double difference = 0.0, momentum = 0.0, impulse = 0.0, force = 0.0, reactions = 0.0;
    for (std::int64_t i = 0; i < problem.n(); ++i) {
        double h = 0.0;
        for_entries(problem.H, i, [&](std::int64_t j, double value) { h += value * x_[part_.columns.place(j)]; });
        const double d = impulse_[static_cast<std::size_t>(i)], a = problem.a[static_cast<std::size_t>(i)];
        difference += square(h - d - a);
        momentum += square(h);
        impulse += square(d);
        force += square(a);
    }
    for (std::int64_t i = 0; i < problem.m(); ++i) reactions += square(lambda[i]);
    std::vector<double> sums = {own.natural,  own.cone,   own.dual, own.gap, own.siconos, own.velocity,
                                own.rounding, difference, momentum, impulse, force,       reactions};
    part_.communicator->sum(sums);
    const ConeSums all{sums[0], sums[1], sums[2], sums[3], sums[4], sums[5], sums[6]};
    const double balance = part_.structure == Structure::Reduced
                               ? 0.0
                               : ratio(std::sqrt(sums[7]), std::sqrt(std::max({sums[8], sums[9], sums[10]})));
    return errors_of(all, reference_, r_norm_, std::sqrt(sums[11]), balance);
}

double PartMeter::natural(const double* x, const double* lambda) {
    // A process without columns has no address to show.
    const bool given = part_.largest(static_cast<std::int64_t>(!x && part_.problem.n() > 0)) == 0;
    std::vector<double> own;
    if (!given && part_.structure != Structure::Reduced) {
        if (part_.stands_in()) return std::numeric_limits<double>::quiet_NaN();
        part_.velocity_of(lambda, own);
        x = own.data();
    }
    take_x(x);
    take_lambda(lambda);
    std::vector<double> sums = {sums_over_cones(lambda, false).natural};
    part_.communicator->sum(sums);
    return std::sqrt(sums[0]) / reference_;
}

double PartMeter::norm_in_rows(const double* v) {
    take_x(v);
    std::vector<double> sum = {0.0};
    for (std::size_t c = 0; c < part_.cones.size(); ++c) {
        const auto& cone = part_.cones[c];
        for (std::int64_t row = cone.first_row; row < cone.first_row + cone.rows; ++row) {
            double speed = 0.0;
            for_entries(part_.problem.D, row,
                        [&](std::int64_t j, double value) { speed += value * x_[part_.columns.place(j)]; });
            sum[0] += square(scaling_[c] * speed);
        }
    }
    part_.communicator->sum(sum);
    return std::sqrt(sum[0]);
}

RoundingOfBalance PartMeter::rounding_of_balance(const double* x, const double* lambda) {
    const auto& problem = part_.problem;
    take_x(x);
    std::vector<double> forces(part_.columns.size(), 0.0), sizes(part_.columns.size(), 0.0);
    for (std::int64_t row = 0; row < problem.m(); ++row)
        for_entries(problem.D, row, [&](std::int64_t j, double value) {
            const std::size_t place = part_.columns.place(j);
            forces[place] += value * lambda[row];
            sizes[place] += std::abs(value * lambda[row]);
        });
    part_.columns.add(*part_.communicator, forces);
    part_.columns.add(*part_.communicator, sizes);
    std::vector<double> sums(5, 0.0);
    for (std::int64_t i = 0; i < problem.n(); ++i) {
        const auto k = static_cast<std::size_t>(i);
        double h = 0.0, size = std::abs(problem.a[k]) + sizes[k];
        for_entries(problem.H, i, [&](std::int64_t j, double value) {
            const double term = value * x_[part_.columns.place(j)];
            h += term;
            size += std::abs(term);
        });
        sums[0] += square(h);
        sums[1] += square(forces[k]);
        sums[2] += square(problem.a[k]);
        sums[3] += square(size);
        sums[4] += square(sizes[k]);
    }
    part_.communicator->sum(sums);
    const double divisor = std::sqrt(std::max({sums[0], sums[1], sums[2]}));
    if (!(divisor > 0.0)) return {};
    const double unit = 0.5 * std::numeric_limits<double>::epsilon() / divisor;
    return {unit * std::sqrt(sums[3]), unit * std::sqrt(sums[4])};
}

}  // namespace delassus
