// SPDX-License-Identifier: BSD-3-Clause
#include "problem/prepared_problem.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <utility>

#include "delassus/error.hpp"
#include "problem/cone_kinds.hpp"
#include "problem/infeasibility.hpp"
#include "problem/need_of.hpp"
#include "problem/symmetry.hpp"
#include "problem/validate.hpp"
#include "support/finite.hpp"

namespace delassus {

namespace {

delassus_matrix raw_of(const SparseMatrix& matrix) {
    return {matrix.rows,          matrix.columns,     matrix.entries(), matrix.row_start.data(),
            matrix.column.data(), matrix.value.data()};
}

}  // namespace

std::uint64_t need_of(Structure structure) {
    switch (structure) {
        case Structure::Reduced:
            return DELASSUS_CAN_REDUCED;
        case Structure::Diagonal:
            return DELASSUS_CAN_H_DIAGONAL;
        case Structure::Blocks:
            return DELASSUS_CAN_H_BLOCKS;
        case Structure::Definite:
            return DELASSUS_CAN_H_DEFINITE;
        case Structure::Semidefinite:
            return DELASSUS_CAN_H_SEMIDEFINITE;
        case Structure::Indefinite:
            return DELASSUS_CAN_H_INDEFINITE;
        case Structure::Unsymmetric:
            return DELASSUS_CAN_H_UNSYMMETRIC;
    }
    return 0;
}

std::uint64_t need_of(Law law) {
    return law == Law::Coulomb ? DELASSUS_CAN_COULOMB : DELASSUS_CAN_ASSOCIATED;
}

PreparedProblem::PreparedProblem() : implementation_(std::make_unique<Implementation>()) {}

PreparedProblem::PreparedProblem(Problem problem, std::uint64_t also_needs) : PreparedProblem() {
    auto& self = *implementation_;
    self.also_needs = also_needs;
    self.problem = std::move(problem);
    const auto n = self.problem.n();
    const auto m = self.problem.m();
    if (self.problem.H.rows == 0) self.problem.H = SparseMatrix::zero(n, n);
    if (self.problem.D.rows == 0) self.problem.D = SparseMatrix::zero(m, n);
    if (self.problem.E.rows == 0) self.problem.E = SparseMatrix::zero(m, m);
    validate(self.problem);
    self.lay_out();
    self.detect_structure();
    self.derive_needs(true);
    self.identify();
}

PreparedProblem::~PreparedProblem() = default;
PreparedProblem::PreparedProblem(PreparedProblem&&) noexcept = default;
PreparedProblem& PreparedProblem::operator=(PreparedProblem&&) noexcept = default;

const Problem& PreparedProblem::problem() const {
    return implementation_->problem;
}
Structure PreparedProblem::structure() const {
    return implementation_->structure;
}
std::uint64_t PreparedProblem::needs() const {
    return implementation_->raw.needs;
}
const delassus_problem& PreparedProblem::raw() const {
    return implementation_->raw;
}
const Communicator& PreparedProblem::communicator() const {
    static const std::shared_ptr<const Communicator> alone = single_process();
    return *alone;
}
std::span<const double> PreparedProblem::a() const {
    return {implementation_->raw.a, static_cast<std::size_t>(implementation_->raw.n)};
}
std::span<const double> PreparedProblem::b() const {
    return {implementation_->raw.b, static_cast<std::size_t>(implementation_->raw.m)};
}
double PreparedProblem::diagonal(std::size_t i) const {
    const auto column = static_cast<std::int32_t>(i);
    return entry_of(problem().H, column, column);
}
Errors PreparedProblem::measure(std::span<const double> x, std::span<const double> lambda) const {
    return meter().measure(x, lambda);
}
double PreparedProblem::natural(const double* x, const double* lambda) const {
    return meter().natural(x, lambda);
}
double PreparedProblem::reference() const {
    return meter().reference();
}
double PreparedProblem::norm_in_rows(std::span<const double> v) const {
    return meter().norm_in_rows(v);
}
void PreparedProblem::velocity_of(std::span<const double> lambda, std::vector<double>& x) const {
    meter().velocity_of(lambda, x);
}
void PreparedProblem::free_velocities(std::vector<double>& x) const {
    meter().velocity_of({}, x);
}
double PreparedProblem::proven_size(const Solution& answer) const {
    return delassus::proven_size(*this, answer.x, answer.lambda);
}
std::unique_ptr<Prepared> PreparedProblem::under(Law law) const {
    return std::make_unique<PreparedProblem>(with_law(law));
}

void PreparedProblem::set_right_hand_side(Array<double> a, Array<double> b) {
    auto& self = *implementation_;
    if (a.size() != self.problem.a.size() || b.size() != self.problem.b.size())
        throw InputError(fmt::format("the right-hand side has {} and {} entries; the problem has n = {} and m = {}",
                                     a.size(), b.size(), self.problem.n(), self.problem.m()));
    if (!all_finite(a) || !all_finite(b)) throw InputError("the right-hand side holds a value that is not finite");
    self.problem.a = std::move(a);
    self.problem.b = std::move(b);
    self.raw.a = std::as_const(self.problem.a).data();
    self.raw.b = std::as_const(self.problem.b).data();
    if (self.meter) self.meter->renew();
}

void PreparedProblem::use(const sdk::Team& team) {
    implementation_->team = team;
}

void PreparedProblem::set_law(Law law) {
    auto& self = *implementation_;
    self.problem.law = law;
    self.raw.law = static_cast<std::int32_t>(law);
    self.set_law_needs();
    if (self.meter) self.meter->renew();
}

PreparedProblem PreparedProblem::with_law(Law law) const {
    const auto& from = *implementation_;
    PreparedProblem copy;
    auto& to = *copy.implementation_;
    to.problem = from.problem;
    to.problem.law = law;
    to.structure = from.structure;
    to.also_needs = from.also_needs;
    to.team = from.team;
    to.mobility = from.mobility;
    to.redundancy = from.redundancy;
    to.lay_out();
    to.raw.needs = from.raw.needs;
    to.set_law_needs();
    to.raw.pattern_id = from.raw.pattern_id;
    to.raw.values_id = from.raw.values_id;
    return copy;
}

const ErrorMeter& PreparedProblem::meter() const {
    auto& meter = implementation_->meter;
    if (!meter) meter = std::make_unique<ErrorMeter>(*this);
    return *meter;
}

void PreparedProblem::renew(const Problem& other) {
    renew(Problem(other));
}

// The error meter passes over all rows anyway and shows values that are not finite, which saves a pass here. Finite
// values that overflow there show as well, so the values themselves are then checked.
void PreparedProblem::renew(Problem&& other) {
    auto& self = *implementation_;
    if (!self.same_places_of_H(other)) {
        const sdk::Team team = self.team;
        *this = PreparedProblem(std::move(other), self.also_needs);
        use(team);
        other = {};
        return;
    }
    const bool new_places = !self.same_places_of_rows(other);
    const bool same_H = self.problem.H.value == other.H.value;
    const bool same_rows =
        same_H && !new_places && self.problem.D.value == other.D.value && self.problem.E.value == other.E.value;
    const bool small_blocks = self.structure == Structure::Diagonal || self.structure == Structure::Blocks;
    const bool met_by_meter = self.meter && small_blocks && self.mobility.use_count() == 1 && same_H && !same_rows &&
                              self.problem.E.entries() == 0 && other.D.rows == other.m();
    validate(other, {.places = !new_places, .H = same_H, .rows = met_by_meter});
    self.exchange(other, new_places);
    if (met_by_meter) {
        self.mobility->refresh();
        if (!self.meter->renew()) {
            self.exchange(other, new_places);
            self.mobility->refresh();
            self.meter->renew();
            validate(other, {.places = true, .H = true});
            self.exchange(other, new_places);
            self.mobility->refresh();
            self.meter->renew();
        }
    }
    if (!same_rows) {
        const Structure before = self.structure;
        if (!met_by_meter && same_H && self.mobility.use_count() == 1) {
            self.mobility->refresh();
        } else if (!met_by_meter) {
            self.detect_structure();
        }
        self.derive_needs(new_places);
        self.identify_anew(new_places || self.structure != before);
    } else {
        self.set_law_needs();
    }
    if (self.meter && !met_by_meter) self.meter->renew();
}

namespace {

bool absent(const SparseMatrix& matrix) {
    return matrix.rows == 0 && matrix.columns == 0;
}

bool same_places(const SparseMatrix& here, const SparseMatrix& there) {
    if (absent(there)) return here.value.empty();  // here a zero matrix
    return here.rows == there.rows && here.columns == there.columns && here.row_start == there.row_start &&
           here.column == there.column;
}

/// Solvers may keep the positions of bounds while the pattern stays.
void exchange_cones(std::vector<Cone>& here, std::vector<Cone>& there, bool new_places) {
    const auto has_bounds = [](const Cone& cone) { return operations_of(cone).has_bounds; };
    if (new_places || std::none_of(there.begin(), there.end(), has_bounds)) return here.swap(there);
    for (std::size_t c = 0; c < here.size(); ++c) {
        std::swap(here[c].parameters, there[c].parameters);
        std::swap_ranges(here[c].lo.begin(), here[c].lo.end(), there[c].lo.begin());
        std::swap_ranges(here[c].hi.begin(), here[c].hi.end(), there[c].hi.begin());
    }
}

/// An absent matrix becomes zero, rows × columns, and stays absent there.
void exchange_matrix(SparseMatrix& here, SparseMatrix& there, std::int32_t rows, std::int32_t columns) {
    if (!absent(there)) return std::swap(here, there);
    here.column.clear();
    here.value.clear();
    if (here.row_start.size() != static_cast<std::size_t>(rows) + 1 || here.row_start.back() != 0)
        here.row_start.assign(static_cast<std::size_t>(rows) + 1, 0);
    here.rows = rows;
    here.columns = columns;
}

}  // namespace

bool PreparedProblem::Implementation::same_places_of_H(const Problem& other) const {
    return raw.n == other.n() && same_places(problem.H, other.H);
}

bool PreparedProblem::Implementation::same_places_of_rows(const Problem& other) const {
    return raw.m == other.m() && same_places(problem.D, other.D) && same_places(problem.E, other.E) &&
           std::equal(problem.cones.begin(), problem.cones.end(), other.cones.begin(), other.cones.end(),
                      [](const Cone& here, const Cone& there) {
                          return here.kind == there.kind && here.rows == there.rows &&
                                 here.lo.size() == there.lo.size() && here.hi.size() == there.hi.size();
                      });
}

void PreparedProblem::Implementation::exchange(Problem& other, bool new_places) {
    const auto n = other.n(), m = other.m();
    std::swap(problem.H, other.H);
    exchange_matrix(problem.D, other.D, m, n);
    exchange_matrix(problem.E, other.E, m, m);
    problem.a.swap(other.a);
    problem.b.swap(other.b);
    exchange_cones(problem.cones, other.cones, new_places);
    std::swap(problem.law, other.law);
    problem.name.swap(other.name);
    problem.source.swap(other.source);
    problem.notes.swap(other.notes);
    raw.m = m;
    point_to_arrays();
    if (new_places) find_shared_columns();
}

void PreparedProblem::Implementation::lay_out() {
    blocks = connected_components(problem.H);
    raw.struct_size = sizeof raw;
    raw.n = problem.n();
    raw.m = problem.m();
    point_to_arrays();
    find_shared_columns();
}

void PreparedProblem::Implementation::find_shared_columns() {
    const auto& D = problem.D;
    shares_columns.assign(cones.size(), 0);
    for (std::size_t c = 0; c < cones.size(); ++c) {
        const auto first = cones[c].first_row, begin = D.row_start[first], length = D.row_start[first + 1] - begin;
        bool same = true;
        for (auto row = first + 1; same && row < first + cones[c].rows; ++row) {
            const auto* column = D.column.data() + D.row_start[row];
            same = D.row_start[row + 1] - D.row_start[row] == length &&
                   std::equal(column, column + length, D.column.data() + begin);
        }
        shares_columns[c] = same ? 1 : 0;
    }
}

void PreparedProblem::Implementation::point_to_arrays() {
    cones.resize(problem.cones.size());
    std::int32_t first_row = 0;
    for (std::size_t c = 0; c < cones.size(); ++c) {
        cones[c] = raw_cone(problem.cones[c], first_row);
        first_row += cones[c].rows;
    }
    put_side_by_side(cones, parameters);
    const Problem& shown = problem;  // const: what is borrowed stays where it is
    raw.law = static_cast<std::int32_t>(problem.law);
    raw.H = raw_of(problem.H);
    raw.D = raw_of(problem.D);
    raw.E = raw_of(problem.E);
    raw.a = shown.a.data();
    raw.b = shown.b.data();
    raw.cone_count = static_cast<std::int32_t>(cones.size());
    raw.h_block_count = static_cast<std::int32_t>(blocks.start.size()) - 1;
    raw.cone_stride = sizeof(delassus_cone);
    raw.cones = cones.data();
    raw.h_block_start = blocks.start.data();
    raw.h_block_index = blocks.index.data();
}

// A matrix that its pattern makes a candidate is definite if its factorisation succeeds with pivots above rounding.
void PreparedProblem::Implementation::detect_structure() {
    const Structure before = structure;
    structure = structure_by_pattern(problem.H, blocks);
    if ((also_needs & DELASSUS_CAN_H_DEFINITE) && (structure == Structure::Diagonal || structure == Structure::Blocks))
        structure = Structure::Definite;
    std::shared_ptr<Mobility> candidate = std::move(mobility);
    mobility.reset();
    if (structure == Structure::Unsymmetric) return;
    raw.needs = need_of(structure);
    const sdk::ProblemView view(raw);
    try {
        // An existing factorisation has analysed the same pattern.
        if (!candidate || before != structure || candidate.use_count() > 1) {
            candidate = std::make_shared<Mobility>();
            candidate->analyze(view);
        }
        candidate->factorize(view, useful_team());
        if (candidate->inverse().smallest_relative_pivot() > 1e-14) {
            mobility = std::move(candidate);
            return;
        }
    } catch (const sdk::NumericalFailure&) {
    }
    structure = structure_of_singular(problem.H, blocks);
}

void PreparedProblem::Implementation::derive_needs(bool new_places) {
    raw.needs = need_of(structure);
    raw.needs |= also_needs & sdk::all_cones;
    for (const auto& cone : cones) raw.needs |= DELASSUS_CAN_CONE(cone.kind);
    set_law_needs();
    if (raw.n > 0 && problem.E.entries() > 0) raw.needs |= DELASSUS_CAN_COMPLIANCE;
    if (raw.n > 0 && raw.m > 0 && redundancy(problem.D, problem.E, new_places)) raw.needs |= DELASSUS_CAN_REDUNDANT;
}

void PreparedProblem::Implementation::set_law_needs() {
    raw.needs &= ~static_cast<std::uint64_t>(DELASSUS_CAN_COULOMB | DELASSUS_CAN_ASSOCIATED);
    if (raw.needs & sdk::cones_with_law) raw.needs |= need_of(problem.law);
}

void PreparedProblem::Implementation::identify() {
    Hash pattern;
    for (const SparseMatrix* matrix : {&problem.H, &problem.D, &problem.E}) {
        pattern.add(matrix->row_start);
        pattern.add(matrix->column);
    }
    for (const auto& cone : cones) {
        pattern.add(&cone.kind, sizeof cone.kind);
        pattern.add(&cone.rows, sizeof cone.rows);
    }
    pattern.add_size(need_of(structure));
    Hash values = pattern;
    for (const SparseMatrix* matrix : {&problem.H, &problem.D, &problem.E}) values.add(matrix->value);
    raw.pattern_id = pattern.value();
    raw.values_id = values.value();
}

// Hashing every entry would cost as much as judging the step's solution. Numbers from a counter mark new content just
// as well.
void PreparedProblem::Implementation::identify_anew(bool new_places) {
    static std::atomic<std::uint64_t> drawn = 0;
    Hash hash;
    hash.add_size(++drawn);
    raw.values_id = hash.value();
    if (new_places) raw.pattern_id = raw.values_id;
}

}  // namespace delassus
