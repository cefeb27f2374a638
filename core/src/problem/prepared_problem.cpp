// SPDX-License-Identifier: BSD-3-Clause
#include "problem/prepared_problem.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "delassus/error.hpp"
#include "delassus/sdk/cones.hpp"
#include "problem/need_of.hpp"

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

PreparedProblem::PreparedProblem(Problem problem) : PreparedProblem() {
    implementation_->take(std::move(problem));
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

void PreparedProblem::set_right_hand_side(std::vector<double> a, std::vector<double> b) {
    auto& self = *implementation_;
    if (a.size() != self.problem.a.size() || b.size() != self.problem.b.size())
        throw InputError(fmt::format("the right-hand side has {} and {} entries; the problem has n = {} and m = {}",
                                     a.size(), b.size(), self.problem.n(), self.problem.m()));
    const auto finite = [](double value) { return std::isfinite(value); };
    if (!std::all_of(a.begin(), a.end(), finite) || !std::all_of(b.begin(), b.end(), finite))
        throw InputError("the right-hand side holds a value that is not finite");
    self.problem.a = std::move(a);
    self.problem.b = std::move(b);
    self.raw.a = self.problem.a.data();
    self.raw.b = self.problem.b.data();
    if (self.meter) self.meter->renew();
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
    to.operator_of_definite = from.operator_of_definite;
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
    auto& self = *implementation_;
    if (!self.same_places(other)) {
        self.meter.reset();
        self.take(other);
        return;
    }
    validate(other);
    const bool same_H = self.problem.H.value == other.H.value;
    const bool same_rows = same_H && self.problem.D.value == other.D.value && self.problem.E.value == other.E.value;
    self.copy_values(other);
    if (!same_rows) {
        self.prepare_matrices(same_H);
    } else {
        self.set_law_needs();
    }
    if (self.meter) self.meter->renew();
}

void PreparedProblem::Implementation::take(Problem other) {
    const auto n = other.n();
    const auto m = other.m();
    if (other.H.rows == 0) other.H = SparseMatrix::zero(n, n);
    if (other.D.rows == 0) other.D = SparseMatrix::zero(m, n);
    if (other.E.rows == 0) other.E = SparseMatrix::zero(m, m);
    validate(other);
    const bool same_H = operator_of_definite && problem.H.row_start == other.H.row_start &&
                        problem.H.column == other.H.column && problem.H.value == other.H.value;
    problem = std::move(other);
    lay_out();
    prepare_matrices(same_H);
}

void PreparedProblem::Implementation::prepare_matrices(bool same_H) {
    if (same_H && operator_of_definite.use_count() == 1) {
        raw.needs = need_of(structure);
        operator_of_definite->refresh(sdk::ProblemView(raw));
    } else {
        detect_structure();
    }
    derive_needs();
    identify();
}

bool PreparedProblem::Implementation::same_places(const Problem& other) const {
    const auto same = [](const SparseMatrix& here, const SparseMatrix& there) {
        if (there.rows == 0 && there.columns == 0) return here.value.empty();  // absent, here a zero matrix
        return here.rows == there.rows && here.columns == there.columns && here.row_start == there.row_start &&
               here.column == there.column;
    };
    return raw.n == other.n() && raw.m == other.m() && same(problem.H, other.H) && same(problem.D, other.D) &&
           same(problem.E, other.E) &&
           std::equal(problem.cones.begin(), problem.cones.end(), other.cones.begin(), other.cones.end(),
                      [](const Cone& here, const Cone& there) {
                          return here.kind == there.kind && here.rows == there.rows &&
                                 here.lo.size() == there.lo.size() && here.hi.size() == there.hi.size();
                      });
}

void PreparedProblem::Implementation::copy_values(const Problem& other) {
    problem.H.value = other.H.value;
    problem.D.value = other.D.value;
    problem.E.value = other.E.value;
    problem.a = other.a;
    problem.b = other.b;
    problem.cones = other.cones;
    problem.law = other.law;
    problem.name = other.name;
    problem.source = other.source;
    problem.notes = other.notes;
    point_to_arrays();
}

void PreparedProblem::Implementation::lay_out() {
    blocks = connected_components(problem.H);
    raw.struct_size = sizeof raw;
    raw.n = problem.n();
    raw.m = problem.m();
    cones.resize(problem.cones.size());
    point_to_arrays();
}

void PreparedProblem::Implementation::point_to_arrays() {
    std::int32_t first_row = 0;
    for (std::size_t c = 0; c < cones.size(); ++c) {
        const Cone& cone = problem.cones[c];
        const bool box = cone.kind == ConeKind::Box;
        cones[c] = {
            static_cast<std::int32_t>(cone.kind), first_row, cone.rows, 0, cone.mu, box ? cone.lo.data() : nullptr,
            box ? cone.hi.data() : nullptr};
        first_row += cone.rows;
    }
    raw.law = static_cast<std::int32_t>(problem.law);
    raw.H = raw_of(problem.H);
    raw.D = raw_of(problem.D);
    raw.E = raw_of(problem.E);
    raw.a = problem.a.data();
    raw.b = problem.b.data();
    raw.cone_count = static_cast<std::int32_t>(cones.size());
    raw.h_block_count = static_cast<std::int32_t>(blocks.start.size()) - 1;
    raw.cones = cones.data();
    raw.h_block_start = blocks.start.data();
    raw.h_block_index = blocks.index.data();
}

// A candidate by pattern counts as definite once its factorisation succeeds with pivots that are not rounding.
void PreparedProblem::Implementation::detect_structure() {
    const Structure before = structure;
    structure = structure_by_pattern(problem.H, blocks);
    std::shared_ptr<sdk::DelassusOperator> candidate = std::move(operator_of_definite);
    operator_of_definite.reset();
    if (structure == Structure::Unsymmetric) return;
    raw.needs = need_of(structure);
    const sdk::ProblemView view(raw);
    try {
        // One that was there keeps the analysis of a sparse H, if the pattern is still the same.
        if (!candidate || before != structure || candidate.use_count() > 1)
            candidate = std::make_shared<sdk::DelassusOperator>();
        candidate->analyze(view);
        candidate->factorize(view);
        if (candidate->inverse().smallest_relative_pivot() > 1e-14) {
            operator_of_definite = std::move(candidate);
            return;
        }
    } catch (const sdk::NumericalFailure&) {
    }
    structure = structure_of_singular(problem.H, blocks);
}

void PreparedProblem::Implementation::derive_needs() {
    raw.needs = need_of(structure);
    for (const auto& cone : cones) raw.needs |= sdk::operations_of(cone).capability;
    set_law_needs();
    if (raw.n > 0 && problem.E.entries() > 0) raw.needs |= DELASSUS_CAN_COMPLIANCE;
    if (raw.n > 0 && raw.m > 0 && redundancy(problem.D, problem.E)) raw.needs |= DELASSUS_CAN_REDUNDANT;
}

void PreparedProblem::Implementation::set_law_needs() {
    raw.needs &= ~static_cast<std::uint64_t>(DELASSUS_CAN_COULOMB | DELASSUS_CAN_ASSOCIATED);
    if (raw.needs & DELASSUS_CAN_FRICTION) raw.needs |= need_of(problem.law);
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

}  // namespace delassus
