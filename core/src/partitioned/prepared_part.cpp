// SPDX-License-Identifier: BSD-3-Clause
#include "partitioned/prepared_part.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "delassus/error.hpp"
#include "partitioned/bytes.hpp"
#include "partitioned/local_entries.hpp"
#include "partitioned/part_meter.hpp"
#include "partitioned/part_proof.hpp"
#include "problem/cone_kinds.hpp"
#include "problem/need_of.hpp"
#include "problem/parallel_rows.hpp"
#include "problem/symmetry.hpp"
#include "support/finite.hpp"
#include "support/module.hpp"

namespace delassus {

namespace {

delassus_local_matrix raw_of_local(const LocalMatrix& matrix) {
    return {matrix.rows,          matrix.columns,     matrix.entries(), matrix.row_start.data(),
            matrix.column.data(), matrix.value.data()};
}

LocalMatrix zero_rows(std::int64_t rows, std::int64_t columns) {
    LocalMatrix matrix;
    matrix.rows = rows;
    matrix.columns = columns;
    matrix.row_start.assign(static_cast<std::size_t>(rows) + 1, 0);
    return matrix;
}

/// Own rows and columns as a matrix of its own; entries elsewhere are left out.
SparseMatrix own_square(const LocalMatrix& matrix, std::int64_t first) {
    if (matrix.rows >= std::numeric_limits<std::int32_t>::max() ||
        matrix.entries() >= std::numeric_limits<std::int32_t>::max())
        throw InputError("one process has more than 2147483646 rows or entries of H; start more processes");
    SparseMatrix own =
        SparseMatrix::zero(static_cast<std::int32_t>(matrix.rows), static_cast<std::int32_t>(matrix.rows));
    for (std::size_t row = 0; row < static_cast<std::size_t>(matrix.rows); ++row) {
        for (auto k = static_cast<std::size_t>(matrix.row_start[row]);
             k < static_cast<std::size_t>(matrix.row_start[row + 1]); ++k) {
            const std::int64_t column = matrix.column[k] - first;
            if (column < 0 || column >= matrix.rows) continue;
            own.column.push_back(static_cast<std::int32_t>(column));
            own.value.push_back(matrix.value[k]);
        }
        own.row_start[row + 1] = own.entries();
    }
    return own;
}

/// The largest |A_ij − A_ji| and |A_ij| over all processes. Entries in foreign columns are compared by the owner of the
/// column, which has the mirrored ones in its rows.
struct Differences {
    double asymmetry = 0.0, size = 0.0;
    [[nodiscard]] double relative() const { return size > 0.0 ? asymmetry / size : 0.0; }
};

Differences differences(const Communicator& run, const LocalMatrix& matrix, const std::vector<std::int64_t>& start) {
    struct Entry {
        std::int64_t row, column;
        double value;
    };
    const auto rank = static_cast<std::size_t>(run.rank()), processes = static_cast<std::size_t>(run.size());
    const std::int64_t first = start[rank], last = start[rank + 1];
    std::vector<std::vector<Entry>> leaving(processes);
    Differences found;
    for (std::int64_t row = first; row < last; ++row)
        for (auto k = matrix.row_start[static_cast<std::size_t>(row - first)];
             k < matrix.row_start[static_cast<std::size_t>(row - first) + 1]; ++k) {
            const std::int64_t column = matrix.column[static_cast<std::size_t>(k)];
            const double value = matrix.value[static_cast<std::size_t>(k)];
            found.size = std::max(found.size, std::abs(value));
            if (column >= first && column < last) {
                found.asymmetry = std::max(found.asymmetry, std::abs(value - entry_of(matrix, column - first, row)));
            } else {
                const auto owner =
                    static_cast<std::size_t>(std::upper_bound(start.begin(), start.end(), column) - start.begin()) - 1;
                leaving[owner].push_back({row, column, value});
            }
        }
    std::vector<Bytes> to(processes);
    for (std::size_t p = 0; p < processes; ++p) put(to[p], leaving[p]);
    for (const Bytes& bytes : run.exchange(to))
        for (const Entry& entry : ByteReader(bytes).next<Entry>())
            found.asymmetry =
                std::max(found.asymmetry, std::abs(entry.value - entry_of(matrix, entry.column - first, entry.row)));
    std::vector<double> both = {found.asymmetry, found.size};
    run.max(both);
    return {both[0], both[1]};
}

}  // namespace

PreparedPart::PreparedPart(std::shared_ptr<const Communicator> communicator, PartitionedProblem problem)
    : implementation_(std::make_unique<Implementation>()) {
    auto& self = *implementation_;
    self.communicator = std::move(communicator);
    self.problem = std::move(problem);
    auto& part = self.problem;
    const Communicator& run = *self.communicator;
    if (part.H.rows == 0 && part.H.columns == 0) part.H = zero_rows(part.n(), part.n_all());
    if (part.D.rows == 0 && part.D.columns == 0) part.D = zero_rows(part.m(), part.n_all());
    if (part.E.rows == 0 && part.E.columns == 0) part.E = zero_rows(part.m(), part.m_all());
    validate(run, part);
    self.compliant = self.largest(part.E.entries()) > 0;
    self.count_cones();
    self.find_halos();
    self.lay_out();
    self.detect_structure();
    self.derive_needs();
    self.identify();
}

CoupledInverse::~CoupledInverse() = default;

PreparedPart::~PreparedPart() = default;
PreparedPart::PreparedPart(PreparedPart&&) noexcept = default;
PreparedPart& PreparedPart::operator=(PreparedPart&&) noexcept = default;

const Communicator& PreparedPart::communicator() const {
    return *implementation_->communicator;
}
const PartitionedProblem& PreparedPart::problem() const {
    return implementation_->problem;
}
const delassus_local_problem& PreparedPart::raw() const {
    return implementation_->raw;
}
Structure PreparedPart::structure() const {
    return implementation_->structure;
}
std::uint64_t PreparedPart::needs() const {
    return implementation_->raw.needs;
}
std::string PreparedPart::describe(std::uint64_t missing) const {
    return describe_needs(missing, implementation_->counts);
}
std::int64_t PreparedPart::ghosts() const {
    return implementation_->columns.ghosts();
}

void PreparedPart::set_law(Law law) {
    auto& self = *implementation_;
    self.problem.law = law;
    self.raw.law = static_cast<std::int32_t>(law);
    self.set_law_needs();
}

void PreparedPart::set_right_hand_side(std::vector<double> a, std::vector<double> b) {
    auto& self = *implementation_;
    together(*self.communicator, [&] {
        if (a.size() != self.problem.a.size() || b.size() != self.problem.b.size())
            throw InputError(fmt::format("the right-hand side has {} and {} entries; the part has n = {} and m = {}",
                                         a.size(), b.size(), self.problem.n(), self.problem.m()));
        if (!all_finite(a) || !all_finite(b)) throw InputError("the right-hand side holds a value that is not finite");
    });
    self.problem.a = std::move(a);
    self.problem.b = std::move(b);
    self.raw.a = self.problem.a.data();
    self.raw.b = self.problem.b.data();
    if (self.meter) self.meter->renew();
}

Errors PreparedPart::measure(std::span<const double> x, std::span<const double> lambda) const {
    const auto& self = *implementation_;
    together(*self.communicator, [&] {
        if (static_cast<std::int64_t>(x.size()) != self.raw.n || static_cast<std::int64_t>(lambda.size()) != self.raw.m)
            throw InputError(fmt::format("a solution with {} and {} entries does not fit a part with n = {}, m = {}",
                                         x.size(), lambda.size(), self.raw.n, self.raw.m));
    });
    return self.measuring().measure(x.data(), lambda.data());
}

double PreparedPart::natural(const double* x, const double* lambda) const {
    return implementation_->measuring().natural(x, lambda);
}

double PreparedPart::reference() const {
    return implementation_->measuring().reference();
}

double PreparedPart::norm_in_rows(std::span<const double> v) const {
    return implementation_->measuring().norm_in_rows(v.data());
}

void PreparedPart::velocity_of(std::span<const double> lambda, std::vector<double>& x) const {
    if (!is_definite()) throw Unsupported("several processes find velocities from reactions only where H is definite");
    implementation_->velocity_of(lambda.data(), x);
}

void PreparedPart::free_velocities(std::vector<double>& x) const {
    if (!is_definite())
        throw Unsupported("several processes find velocities without reactions only where H is definite");
    x = problem().a;
    if (structure() != Structure::Reduced) implementation_->apply_inverse(x);
}

RoundingOfBalance PreparedPart::rounding_of_balance(const Solution& solution) const {
    if (structure() == Structure::Reduced) return {};
    return implementation_->measuring().rounding_of_balance(solution.x.data(), solution.lambda.data());
}

double PreparedPart::proven_size(const Solution& answer) const {
    return PartProof(*implementation_).size(answer.x, answer.lambda);
}

double PreparedPart::diagonal(std::size_t i) const {
    const auto& self = *implementation_;
    const auto row = static_cast<std::int64_t>(i);
    return entry_of(self.problem.H, row,
                    self.problem.column_start[static_cast<std::size_t>(self.communicator->rank())] + row);
}

std::unique_ptr<Prepared> PreparedPart::under(Law) const {
    return nullptr;
}

void PreparedPart::Implementation::velocity_of(const double* lambda, std::vector<double>& x) const {
    x = problem.a;
    std::vector<double> impulse(columns.size(), 0.0);
    for (std::int64_t row = 0; row < problem.m(); ++row)
        for_entries(problem.D, row,
                    [&](std::int64_t j, double value) { impulse[columns.place(j)] += value * lambda[row]; });
    columns.add(*communicator, impulse);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += impulse[i];
    if (structure != Structure::Reduced) apply_inverse(x);
}

PartMeter& PreparedPart::Implementation::measuring() const {
    if (structure == Structure::Unsymmetric)
        throw Unsupported("the errors of a partitioned problem cannot be measured where H is unsymmetric");
    if (!meter) meter = std::make_unique<PartMeter>(*this);
    return *meter;
}

double PreparedPart::Implementation::largest(double value) const {
    communicator->max(std::span(&value, 1));
    return value;
}

std::int64_t PreparedPart::Implementation::largest(std::int64_t value) const {
    communicator->max(std::span(&value, 1));
    return value;
}

void PreparedPart::Implementation::count_cones() {
    const auto own = counts_of(problem.cones);
    std::copy(own.begin(), own.end(), counts.begin());
    communicator->sum(counts);
}

void PreparedPart::Implementation::find_halos() {
    coupled =
        largest(static_cast<std::int64_t>(foreign_numbers(*communicator, problem.column_start, {&problem.H}).size())) >
        0;
    columns = Halo(*communicator, problem.column_start,
                   foreign_numbers(*communicator, problem.column_start, {&problem.H, &problem.D}));
    rows = Halo(*communicator, problem.row_start, foreign_numbers(*communicator, problem.row_start, {&problem.E}));
}

void PreparedPart::Implementation::lay_out() {
    const int rank = communicator->rank();
    raw.struct_size = sizeof raw;
    raw.law = static_cast<std::int32_t>(problem.law);
    raw.communicator = communicator->handle();
    raw.processes = communicator->size();
    raw.process = rank;
    raw.cone_stride = sizeof(delassus_cone);
    raw.n = problem.n();
    raw.m = problem.m();
    raw.n_all = problem.n_all();
    raw.m_all = problem.m_all();
    raw.column_start = problem.column_start.data();
    raw.row_start = problem.row_start.data();
    raw.H = raw_of_local(problem.H);
    raw.D = raw_of_local(problem.D);
    raw.E = raw_of_local(problem.E);
    raw.a = problem.a.data();
    raw.b = problem.b.data();
    std::int32_t first_row = 0;
    together(*communicator, [&] {
        if (raw.m >= std::numeric_limits<std::int32_t>::max())
            throw InputError("one process has more than 2147483646 rows of D; start more processes");
        cones.reserve(problem.cones.size());
        for (const Cone& cone : problem.cones) {
            cones.push_back(raw_cone(cone, first_row));
            first_row += cone.rows;
        }
    });
    put_side_by_side(cones, parameters);
    raw.cone_count = static_cast<std::int64_t>(cones.size());
    raw.cones = cones.data();
}

// As for a whole problem: a matrix that its pattern makes a candidate is definite if its factorisation succeeds with
// pivots above rounding.
void PreparedPart::Implementation::detect_structure() {
    if (const auto of_E = differences(*communicator, problem.E, problem.row_start);
        of_E.relative() > symmetry_tolerance)
        throw InputError(
            fmt::format("E is not symmetric: an entry differs from its mirror image by {:.1e} of the "
                        "largest; at most {:.0e} is taken for rounding.",
                        of_E.relative(), symmetry_tolerance));
    if (problem.n_all() == 0) {
        structure = Structure::Reduced;
        return;
    }
    if (const auto of_H = differences(*communicator, problem.H, problem.column_start);
        of_H.relative() > symmetry_tolerance) {
        for (const auto& kind : sdk::cone_table)
            if (!kind.is_linear && counts[static_cast<std::size_t>(kind.kind)] > 0)
                throw InputError(fmt::format(
                    "H is not symmetric (an entry differs from its mirror image by {:.1e} of the largest), but there "
                    "are {}; an unsymmetric H is for free rows only.",
                    of_H.relative(), kind.plural));
        structure = Structure::Unsymmetric;
        return;
    }
    if (coupled) return factorize_coupled();
    together(*communicator, [&] {
        H = own_square(problem.H, problem.column_start[static_cast<std::size_t>(communicator->rank())]);
        blocks = connected_components(H);
    });
    const std::int64_t size = largest(static_cast<std::int64_t>(blocks.largest()));
    structure = size <= 1                       ? Structure::Diagonal
                : size <= largest_inertia_block ? Structure::Blocks
                                                : Structure::Definite;
    double pivot = 0.0;
    together(*communicator, [&] {
        try {
            inverse = std::make_unique<LocalInverse>(H, blocks, structure);
            pivot = problem.n() > 0 ? inverse->smallest_relative_pivot() : 1.0;
        } catch (const sdk::NumericalFailure&) {
        }
    });
    if (-largest(-pivot) > 1e-14) {
        if (structure == Structure::Definite) return;
        block_start.assign(blocks.start.begin(), blocks.start.end());
        block_index.assign(blocks.index.begin(), blocks.index.end());
        raw.h_block_count = static_cast<std::int64_t>(block_start.size()) - 1;
        if (raw.h_block_count > 0) {
            raw.h_block_start = block_start.data();
            raw.h_block_index = block_index.data();
        }
        return;
    }
    inverse.reset();
    std::int64_t negative = 0;
    together(*communicator, [&] { negative = structure_of_singular(H, blocks) == Structure::Indefinite ? 1 : 0; });
    structure = largest(negative) > 0 ? Structure::Indefinite : Structure::Semidefinite;
}

std::vector<double> PreparedPart::Implementation::magnitude_of_diagonal() const {
    std::vector<double> magnitude(static_cast<std::size_t>(problem.n()), 0.0);
    const std::int64_t first = problem.column_start[static_cast<std::size_t>(communicator->rank())];
    std::array<double, 2> sums = {0.0, 0.0};
    for (std::size_t i = 0; i < magnitude.size(); ++i) {
        const auto row = static_cast<std::int64_t>(i);
        magnitude[i] = std::abs(entry_of(problem.H, row, first + row));
        sums[0] += magnitude[i];
        sums[1] += magnitude[i] > 0.0 ? 1.0 : 0.0;
    }
    communicator->sum(sums);
    const double mean = sums[1] > 0.0 ? sums[0] / sums[1] : 1.0;
    for (double& one : magnitude)
        if (!(one > 0.0)) one = mean;
    return magnitude;
}

std::vector<double> PreparedPart::Implementation::cone_scaling(const std::vector<double>& diagonal) const {
    std::vector<double> scaling(cones.size());
    std::array<double, 2> sums = {0.0, 0.0};
    for (std::size_t c = 0; c < scaling.size(); ++c) {
        double trace = 0.0;
        for (std::int32_t i = 0; i < cones[c].rows; ++i)
            trace += diagonal[static_cast<std::size_t>(cones[c].first_row + i)];
        scaling[c] = trace / cones[c].rows;
        if (scaling[c] > 0.0) {
            sums[0] += scaling[c];
            sums[1] += 1.0;
        }
    }
    communicator->sum(sums);
    const double fallback = sums[1] > 0.0 ? sums[0] / sums[1] : 1.0;
    for (double& s : scaling) s = 1.0 / std::sqrt(s > 0.0 ? s : fallback);
    return scaling;
}

// With C = |diag H|^(−½), the pivots of C H C are the relative ones of H. A matrix without negative ones, of which some
// are null, is semidefinite if it is definite after a shift by 1e-10 of the diagonal: see structure_of_singular().
void PreparedPart::Implementation::factorize_coupled() {
    constexpr double semidefinite_shift = 1e-10;
    const auto make = reinterpret_cast<DelassusCoupledInverse>(module_symbol(
        "delassus_petsc_inverse", "delassus_petsc_inverse_make",
        "an H that couples bodies of different processes cannot be factored", "PETSc", "; start one process"));
    LocalMatrix scaled = problem.H;
    C = magnitude_of_diagonal();
    for (double& c : C) c = 1.0 / std::sqrt(c);
    std::vector<double> factor = C;
    columns.fetch(*communicator, factor);
    const std::int64_t first = problem.column_start[static_cast<std::size_t>(communicator->rank())];
    for (std::size_t i = 0; i < C.size(); ++i)
        for (auto k = static_cast<std::size_t>(scaled.row_start[i]);
             k < static_cast<std::size_t>(scaled.row_start[i + 1]); ++k)
            scaled.value[k] *= C[i] * factor[columns.place(scaled.column[k])];
    const delassus_local_matrix raw_rows = raw_of_local(scaled);
    make(raw.communicator, raw_rows, first, factors);
    structure = Structure::Definite;
    if (factors->negative_pivots() == 0 && factors->null_pivots() == 0) return;
    for (std::size_t i = 0; i < C.size(); ++i)
        for (auto k = static_cast<std::size_t>(scaled.row_start[i]);
             k < static_cast<std::size_t>(scaled.row_start[i + 1]); ++k)
            if (scaled.column[k] == first + static_cast<std::int64_t>(i)) scaled.value[k] += semidefinite_shift;
    factors.reset();
    make(raw.communicator, raw_rows, first, factors);
    structure = factors->negative_pivots() == 0 ? Structure::Semidefinite : Structure::Indefinite;
    factors.reset();
}

void PreparedPart::Implementation::apply_inverse(std::vector<double>& v) const {
    if (!coupled) {
        sdk::Vector own = sdk::VectorView(v.data(), problem.n());
        inverse->apply(own);
        std::copy(own.begin(), own.end(), v.begin());
        return;
    }
    for (std::size_t i = 0; i < C.size(); ++i) v[i] *= C[i];
    factors->apply(v.data(), 1);
    for (std::size_t i = 0; i < C.size(); ++i) v[i] *= C[i];
}

void PreparedPart::Implementation::derive_needs() {
    raw.needs = need_of(structure) | DELASSUS_CAN_PARTITIONED;
    for (const auto& kind : sdk::cone_table)
        if (counts[static_cast<std::size_t>(kind.kind)] > 0) raw.needs |= kind.capability();
    set_law_needs();
    if (raw.n_all > 0 && compliant) raw.needs |= DELASSUS_CAN_COMPLIANCE;
    if (raw.n_all > 0 && raw.m_all > 0 && certain_redundancy()) raw.needs |= DELASSUS_CAN_REDUNDANT;
}

// The certificates of RedundancyCheck. Parallel rows are looked for within each process: those of two bodies belong to
// one, as a rule.
bool PreparedPart::Implementation::certain_redundancy() const {
    if (!compliant && raw.m_all > raw.n_all) return true;
    const auto is_rigid = [&](std::int64_t row) { return raw.E.row_start[row] == raw.E.row_start[row + 1]; };
    std::vector<double> touched(columns.size(), 0.0);
    std::array<std::int64_t, 3> sums = {0, 0, 0};  // rigid rows, empty ones, columns that they touch
    for (std::int64_t row = 0; row < raw.m; ++row) {
        if (!is_rigid(row)) continue;
        ++sums[0];
        if (raw.D.row_start[row] == raw.D.row_start[row + 1]) ++sums[1];
        for (auto k = raw.D.row_start[row]; k < raw.D.row_start[row + 1]; ++k)
            touched[columns.place(raw.D.column[k])] = 1.0;
    }
    columns.add(*communicator, touched);
    sums[2] = std::count_if(touched.begin(), touched.begin() + raw.n, [](double times) { return times > 0.0; });
    communicator->sum(sums);
    if (sums[1] > 0 || sums[0] > sums[2]) return true;
    std::int64_t parallel = 0;
    together(*communicator, [&] {
        std::vector<RowDirection> directions;
        parallel = has_parallel_rows(problem.D, is_rigid, directions) ? 1 : 0;
    });
    return largest(parallel) > 0;
}

void PreparedPart::Implementation::set_law_needs() {
    raw.needs &= ~static_cast<std::uint64_t>(DELASSUS_CAN_COULOMB | DELASSUS_CAN_ASSOCIATED);
    if (raw.needs & sdk::cones_with_law) raw.needs |= need_of(problem.law);
}

void PreparedPart::Implementation::identify() {
    Hash pattern, values;
    for (const LocalMatrix* matrix : {&problem.H, &problem.D, &problem.E}) {
        pattern.add(matrix->row_start);
        pattern.add(matrix->column);
        values.add(matrix->value);
    }
    for (const auto& cone : cones) {
        pattern.add(&cone.kind, sizeof cone.kind);
        pattern.add(&cone.rows, sizeof cone.rows);
    }
    for (const auto* start : {&problem.column_start, &problem.row_start, &problem.cone_start}) pattern.add(*start);
    pattern.add_size(need_of(structure));
    const auto patterns = communicator->all(static_cast<std::int64_t>(pattern.value()));
    const auto contents = communicator->all(static_cast<std::int64_t>(values.value()));
    Hash whole;
    whole.add(patterns);
    raw.pattern_id = whole.value();
    whole.add(contents);
    raw.values_id = whole.value();
}

}  // namespace delassus
