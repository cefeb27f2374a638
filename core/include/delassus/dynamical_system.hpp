// SPDX-License-Identifier: BSD-3-Clause
// A mechanical system as timesteppers see it:
//
//     M v̇ = f(q, v, t) + C_qᵀ λ + D_Aᵀ λ_A          n rows
//     C(q, t) = 0                                    m rows: bilateral constraints, λ are their reaction forces
//     λ_A ∈ Υ  ⊥  u_A ∈ Υ*                           contacts, stops, motors with limits: see UnilateralRows
//
// q lies on a Lie group (unit quaternions beside plain coordinates) and moves by an exponential increment; v has n
// entries, for a rigid body the velocity of its mass centre in the world frame and its angular velocity in the body
// frame. Units are the system's own, as a rule SI. Every array belongs to the caller; none is kept.
//
// A user's own system derives from DynamicalSystem and works with every timestepper and solver (examples/system).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "delassus/contact_point.hpp"
#include "delassus/export.hpp"
#include "delassus/matrix_assembler.hpp"
#include "delassus/problem.hpp"
#include "delassus/sdk/cones.hpp"
#include "delassus/sdk/team.hpp"

namespace delassus {

/// Time, positions and velocities of a system, in its own units.
struct State {
    double t = 0.0;
    std::vector<double> q;  ///< position_size()
    std::vector<double> v;  ///< n()
};

/// How tangent matrices are formed. Newton's residual is exact with either; cone problems need the symmetric one.
enum class Tangent {
    Exact,     ///< the derivative; unsymmetric where forces are gyroscopic or follow the body
    Symmetric  ///< its symmetric part, ½(A + Aᵀ), or less of it where that could make H indefinite
};

/// A 3 × 3 block on the diagonal of an n × n matrix that is the identity elsewhere.
struct DiagonalBlock3 {
    std::int32_t first = 0;
    double value[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};  ///< row-major
};

/// How a body turns in a step of size h where no torque acts on it.
struct FreeSpin {
    std::int32_t column = 0;          ///< the first of the three of its angular velocity ω
    bool alone = false;               ///< no constraint holds it and no force but weight acts on it; contacts apart
    std::array<double, 3> torque{};   ///< the part of add_force() that turns ω, now
    std::array<double, 3> impulse{};  ///< what it gives in the step, J (ω⁺ − ω)
    std::array<double, 3> speed{};    ///< ω⁺
    std::array<double, 3> turn{};     ///< θ: the orientation becomes that of now ∘ exp(θ)
};

/// How a system moves in a step of size h where nothing strikes: velocities are v + (v⁺ − v) t/h + c t (t − h), with c
/// of free spins.
struct SmoothMotion {
    const State& begin;
    const double* end;              ///< v⁺, n
    std::span<const double> curve;  ///< c, n, or empty: 0
    double h;

    /// Of a velocity's coordinate until so long after the beginning, along increments.
    [[nodiscard]] double way(std::size_t velocity, double time) const {
        const double first = begin.v[velocity], c = curve.empty() ? 0.0 : curve[velocity];
        return (first + (0.5 / h * (end[velocity] - first) + c * (time / 3.0 - 0.5 * h)) * time) * time;
    }
};

/// Unilateral rows and rows with bounded forces, collected block by block. A row is one of D_A with
///     u = D_A v + rate (+ gap/h in a step of size h)
class UnilateralRows {
public:
    /// One block: `rows` rows with one cone.
    struct Block {
        Cone cone;                 ///< for a box, bounds of the force (N, Nm); a stepper multiplies by h
        double restitution = 0.0;  ///< e in [0, 1] of Newton's law u_n⁺ ≥ −e u_n⁻; normal row of a contact
        std::uint64_t key = 0;     ///< the same constraint has the same key in the next step: for warm starts
        double speed = 0.0;        ///< of its first row, at the velocities of measure_speeds_at()
        double compliance = 0.0;   ///< of each of its rows: u has compliance · force more, m/(N s); E = compliance/h

        /// Whether its first row is the distance of two things that cannot overlap.
        [[nodiscard]] bool along_normal() const {
            const auto& kind = sdk::cone_table[static_cast<std::size_t>(cone.kind)];
            return kind.is_cone && !kind.is_linear;
        }
    };
    /// One row of a block.
    struct Row {
        double gap = 0.0;   ///< position-level value Φ of the row, 0 for tangential and box rows
        double rate = 0.0;  ///< ∂Φ/∂t, or the prescribed part of the velocity; it may be its mean over the step
        double rate_now = 0.0;  ///< that of a row of a contact at the state itself
    };

    /// Keeps the memory for the next rows, and the velocities of measure_speeds_at().
    DELASSUS_API void clear();
    /// v: n, valid as long as blocks are added; null: the speeds of blocks are 0. since: for how long the state that
    /// rows are collected at has moved on with v, s.
    void measure_speeds_at(const double* v, double since = 0.0) {
        velocity_ = v;
        since_ = since;
    }
    [[nodiscard]] double since() const { return since_; }

    /// Threads that may share the work of collecting rows; the rows are the same without them.
    sdk::Team team;

    /// Adds entries to the row that end_row() closes, in the columns from `column` on. Columns of one row may come in
    /// any order but not twice.
    void entries(std::int32_t column, std::span<const double> values) { put(column, values); }
    template <std::size_t size>
    void entries(std::int32_t column, const std::array<double, size>& values) {
        put(column, std::span<const double, size>(values));
    }
    void entry(std::int32_t column, double value) { entries(column, {&value, 1}); }
    void end_row(double gap = 0.0, double rate = 0.0) { end_row(gap, rate, rate); }
    void end_row(double gap, double rate, double rate_now) {
        if (!ascending_) sort_row();
        rows_.push_back({gap, rate, rate_now});
        row_start_.push_back(static_cast<std::int32_t>(used_));
    }
    /// Closes a block of the rows since the last one; throws InputError if their number is not cone.rows.
    DELASSUS_API void end_block(const Cone& cone, std::uint64_t key, double restitution = 0.0, double compliance = 0.0);

    [[nodiscard]] std::span<const Block> blocks() const { return {blocks_.data(), block_count_}; }
    [[nodiscard]] const std::vector<Row>& rows() const { return rows_; }
    [[nodiscard]] std::vector<Row>& rows() { return rows_; }  ///< their number stays
    /// The entries of D_A by compressed rows; columns ascend within a row.
    [[nodiscard]] std::span<const std::int32_t> column() const { return {column_.data(), used_}; }
    [[nodiscard]] std::span<const double> value() const { return {value_.data(), used_}; }
    /// rows() + 1 positions in column() and value().
    [[nodiscard]] const std::vector<std::int32_t>& row_start() const { return row_start_; }

    /// Where contacts touch: one for each of the last blocks, in their order. A system that knows it fills it in; the
    /// stepper hands it on (StepReport).
    [[nodiscard]] std::vector<ContactPoint>& contacts() { return contacts_; }
    [[nodiscard]] const std::vector<ContactPoint>& contacts() const { return contacts_; }

    /// D_A v + rate of a row; v: of the system's n.
    [[nodiscard]] DELASSUS_API double speed(std::size_t row, const double* v) const;

    /// Appends the rows to D, which has as many columns. If D has no rows, nothing is copied: the arrays are swapped,
    /// and D's serve the next rows. Only blocks(), rows() and contacts() may be used from then until clear().
    DELASSUS_API void move_into(SparseMatrix& D);

private:
    template <class Values>
    void put(std::int32_t column, Values values) {
        const std::size_t end = used_ + values.size();
        if (column_.size() < end) grow(end);
        if (used_ > static_cast<std::size_t>(row_start_.back()) && column <= column_[used_ - 1]) ascending_ = false;
        for (std::size_t i = 0; i < values.size(); ++i) {
            column_[used_ + i] = column + static_cast<std::int32_t>(i);
            value_[used_ + i] = values[i];
        }
        used_ = end;
    }
    DELASSUS_API void grow(std::size_t entries);
    /// The entries of the row that is being closed.
    DELASSUS_API void sort_row();

    // Blocks and entries stay where they are when cleared, so that the next step finds their memory.
    std::vector<Block> blocks_;
    std::vector<Row> rows_;
    std::vector<std::int32_t> column_;
    std::vector<double> value_;
    std::vector<std::int32_t> row_start_ = {0};
    std::vector<ContactPoint> contacts_;
    std::size_t block_count_ = 0, used_ = 0, rows_in_blocks_ = 0;
    bool ascending_ = true;  // the columns of the row that is being filled
    const double* velocity_ = nullptr;
    double since_ = 0.0;
};

/// What a timestepper asks of a system; derive from it for a system of your own.
class DELASSUS_API DynamicalSystem {
public:
    virtual ~DynamicalSystem();

    // ---- Sizes and the group ----

    /// Number of velocities n.
    [[nodiscard]] virtual std::int32_t n() const = 0;
    /// Length of q; n() unless the system says otherwise.
    [[nodiscard]] virtual std::int32_t position_size() const;
    /// Of velocities that are the three components of one vector, the first columns, ascending: what a method guesses
    /// of them does not depend on the axes. Default: none.
    [[nodiscard]] virtual std::vector<std::int32_t> vectors() const;
    /// For each velocity the number, from 0, of the body that it is of; n. A body moves or stands still as a whole, by
    /// what acts on it alone. Default: each is one by itself.
    [[nodiscard]] virtual std::vector<std::int32_t> bodies_of_columns() const;
    /// Rows of the bilateral constraints, by blocks that belong together (a joint); m() is their sum.
    [[nodiscard]] virtual std::vector<std::int32_t> constraint_blocks() const;
    [[nodiscard]] std::int32_t m() const;
    [[nodiscard]] virtual State initial_state() const = 0;

    /// result ← q ∘ exp(δ) (seed eq. 54); δ: n. result may be q. Default: q + δ, where position_size() = n.
    virtual void increment(const double* q, const double* delta, double* result) const;
    /// δ ← log(from⁻¹ ∘ to), the inverse: increment(from, δ) = to. Rotations by less than π. Default: to − from.
    virtual void difference(const double* from, const double* to, double* delta) const;
    /// The blocks in which T(δ)⁻¹ differs from the identity, where exp(δ + T⁻¹ε) = exp(δ) ∘ exp(ε) + O(ε²). Default:
    /// none.
    virtual void inverse_tangent(const double* delta, std::vector<DiagonalBlock3>& blocks) const;

    // ---- Forces: functions of the state, added to what the arrays hold ----

    /// M += factor · M(q), symmetric positive definite or semidefinite.
    virtual void add_mass(const State& state, double factor, MatrixAssembler& M) const = 0;
    /// result += factor · M(q) x; both n.
    virtual void multiply_mass(const State& state, double factor, const double* x, double* result) const = 0;
    /// result += factor · f(q, v, t); n. Gyroscopic and velocity-dependent inertial terms are part of f.
    virtual void add_force(const State& state, double factor, double* result) const = 0;
    /// v_dot ← M(q)⁻¹ f(q, v, t), n: accelerations without constraints, by a way of the system's own that is faster
    /// than assembling M. False: it has none, v_dot is as it was. Default.
    virtual bool accelerate(const State& state, double* v_dot) const;
    /// H += factor · K, K = −∂f/∂q along increments. Default: nothing (f does not depend on q).
    virtual void add_stiffness(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const;
    /// H += factor · R, R = −∂f/∂v without the gyroscopic part. Default: nothing.
    virtual void add_damping(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const;
    /// H += factor · R of the gyroscopic forces that free_spins() knows. Default: nothing.
    virtual void add_gyroscopic_damping(const State& state, double factor, Tangent tangent, MatrixAssembler& H) const;
    /// Of each body with a gyroscopic torque, its spin in a step of size h from this state, by a rule that keeps energy
    /// and momentum; the same bodies in the same order for any state. Default: none.
    virtual void free_spins(const State& state, double h, std::vector<FreeSpin>& spins) const;
    /// H += factor · ∂(M(q) a)/∂q for a fixed acceleration a; n. Default: nothing (M is constant).
    virtual void add_inertial_stiffness(const State& state, const double* acceleration, double factor, Tangent tangent,
                                        MatrixAssembler& H) const;
    /// Whether add_stiffness or add_damping ever adds anything: a step without them factorises nothing.
    [[nodiscard]] virtual bool has_stiffness() const;

    // ---- Stiff forces: of f, those that a step does not resolve; none by default ----

    /// stiff ← the numbers, the system's own, ascending, of forces −(k C + c Ċ) ∇C that at the start would, each by
    /// itself, move the system at √(k/m) or brake it at c/m faster than this rate, 1/s.
    virtual void find_stiff_forces(double rate, std::vector<std::int32_t>& stiff) const;
    /// tensions ← k C + c Ċ of each.
    virtual void stiff_tensions(const State& state, std::span<const std::int32_t> stiff,
                                std::vector<double>& tensions) const;
    /// result −= factor · Σ tension ∇C; n.
    virtual void add_stiff_forces(const State& state, std::span<const std::int32_t> stiff,
                                  std::span<const double> tensions, double factor, double* result) const;
    /// H += Σ (of_stiffness k + of_damping c) ∇C ∇Cᵀ.
    virtual void add_stiff_tangent(const State& state, std::span<const std::int32_t> stiff, double of_stiffness,
                                   double of_damping, MatrixAssembler& H) const;

    // ---- Bilateral constraints; nothing by default. Timesteppers ask for them only where m() > 0. ----

    /// C(q, t); m.
    virtual void constraint(const State& state, double* C) const;
    /// D += C_q along increments, so that d/dt C = C_q v + C_t; m × n, rows from first_row.
    virtual void add_constraint_jacobian(const State& state, std::int32_t first_row, MatrixAssembler& D) const;
    /// C_t ← ∂C/∂t; m.
    virtual void constraint_rate(const State& state, double* C_t) const;
    /// c ← d²C/dt² at v̇ = 0: (C_q v)_q v + 2 C_qt v + C_tt; m. For consistent initial accelerations.
    virtual void constraint_curvature(const State& state, double* c) const;
    /// H += factor · ∂(C_qᵀ λ)/∂q for fixed λ; m. Default: nothing.
    virtual void add_constraint_stiffness(const State& state, const double* lambda, double factor, Tangent tangent,
                                          MatrixAssembler& H) const;
    /// H += the part of −factor · ∂(C_qᵀ λ)/∂q that a step needs beside M: symmetric and positive semidefinite, so that
    /// H stays positive definite. Default: nothing.
    virtual void add_definite_constraint_stiffness(const State& state, const double* lambda, double factor,
                                                   MatrixAssembler& H) const;

    // ---- What time prescribes; nothing by default ----

    /// The first time after t, s, at which a force, or a value, rate or acceleration that time prescribes jumps;
    /// infinity if there is none.
    [[nodiscard]] virtual double next_jump(double t) const;
    /// The longest step from t on, s, that resolves what time prescribes; infinity: any does.
    [[nodiscard]] virtual double longest_step(double t) const;
    /// Whether forces, constraints or gaps at a state ever depend on its time. Default: true, as nobody knows.
    [[nodiscard]] virtual bool depends_on_time() const { return true; }

    // ---- Contacts, stops, bounded motors; nothing by default ----

    /// Whether collect_unilateral() ever finds anything; such a system needs a timestepper for unilateral rows.
    [[nodiscard]] virtual bool has_unilateral() const;
    /// The rows that may become active within a step of size h.
    virtual void collect_unilateral(const State& state, double h, UnilateralRows& rows);
    /// rows ← the block and the point of a contact alone, one of those that collect_unilateral() gave in this step, so
    /// long after the beginning of such a motion; of rates Row::rate_now counts. False where the system does not know
    /// it there, the default.
    virtual bool collect_contact(const SmoothMotion& motion, double time, const ContactPoint& contact,
                                 UnilateralRows& rows);
    /// The velocity at the time t of the point of a contact's shape_b, as far as it is prescribed, less that of
    /// shape_a, m/s, world frame. contact: where it is at t; one that is met on the way, as collect_unilateral() gave
    /// it at the time `begin`. Nothing where the system does not know: then rates between those of its rows are taken.
    /// Default: nothing.
    [[nodiscard]] virtual std::optional<Vector3> prescribed_velocity(const ContactPoint& contact, double begin,
                                                                     double t) const;

    /// Largest speed with which a step should push apart what penetrates, where its user says nothing. Default: 0.01,
    /// the source's advice in m/s (seed footnote 5).
    [[nodiscard]] virtual double recovery_speed() const;
    /// The acceleration of a body that is let go at rest, m/s². Default: 0, which stands for not known.
    [[nodiscard]] virtual double free_fall() const;
    /// Gaps nearer to 0 than this count as 0, in their own unit. Default: 0.
    [[nodiscard]] virtual double gap_resolution() const;

    // ---- What is conserved; for reports ----

    /// Kinetic plus potential energy, J; NaN where the system does not know it. Default: NaN.
    [[nodiscard]] virtual double energy(const State& state) const;
    /// Whether anything supplies energy or takes it away: loads, motors, actuators, bodies with a given motion.
    /// Default: false.
    [[nodiscard]] virtual bool is_driven() const { return false; }
    /// The power of loads and actuators, and of springs, dampers and beams at bodies with a given motion, that changes
    /// energy(), W; NaN where it is not known. What rows with a given rate supply is not in it. Default: 0.
    [[nodiscard]] virtual double supplied_power(const State&) const { return 0.0; }
};

/// ½ vᵀ M v with the mass matrix at a state, J; v: n. momentum ← M v.
[[nodiscard]] DELASSUS_API double kinetic_energy(const DynamicalSystem& system, const State& at,
                                                 std::span<const double> v, std::vector<double>& momentum);

}  // namespace delassus
