# SPDX-License-Identifier: BSD-3-Clause
"""Dynamical systems written in Python, and how the library asks them."""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Callable, List, NamedTuple, Optional, Tuple, Union

import numpy as np
import scipy.sparse

from ._delassus import Cone, InputError


class State(NamedTuple):
    """Time, positions and velocities of a system, in its own units: SI as a rule."""

    t: float
    q: np.ndarray  #: as many as initial_state() has
    v: np.ndarray  #: n


@dataclass
class Unilateral:
    """A block of rows whose reactions have bounds: a contact, a stop, a motor with a limit. With
    u = jacobian v + rate (+ gap/h in a step of size h), λ ∈ Υ ⊥ u ∈ Υ* (docs/problem.md)."""

    cone: Cone  #: Cone.nonnegative(), Cone.friction(mu) (normal row first), or Cone.box(lo, hi) with bounds of forces
    jacobian: Any  #: (cone.rows, n), dense or sparse; (n,) where there is one row
    gap: Any = 0.0  #: of the first row, its own unit (m); or of every row
    rate: Any = 0.0  #: prescribed part of u: one value, or one for each row
    key: Optional[int] = None  #: the same constraint has the same key in the next step; None: its place in the list
    restitution: float = 0.0  #: e in [0, 1] of Newton's law, of the first row
    compliance: float = 0.0  #: u has compliance · force more; m/(N s)


@dataclass
class FreeSpin:
    """How a body turns in a step of size h where no torque acts on it (delassus::FreeSpin)."""

    column: int  #: the first of the three of its angular velocity ω in v
    torque: Any  #: (3,) the part of force() that turns ω, now
    impulse: Any  #: (3,) what it gives in the step, J (ω⁺ − ω)
    speed: Any  #: (3,) ω⁺
    turn: Any  #: (3,) θ: the orientation becomes that of now ∘ exp(θ)
    alone: bool = False  #: no constraint holds it and no force but weight acts on it


class DynamicalSystem:
    """A mechanical system of your own, for every timestepper and solver: derive from it and pass an instance to
    Simulation or simulate.

        M(q) v̇ = f(q, v, t) + C_qᵀ λ + D_Aᵀ λ_A,   C(q, t) = 0,   λ_A ∈ Υ ⊥ u_A ∈ Υ*

    Each method but initial_state, increment, difference and inverse_tangent takes a State, whose arrays are the
    method's own. Vectors are arrays, matrices are arrays or scipy matrices. Needed are

    initial_state() : a State, or (q, v) at t = 0; n is the length of v
    mass(state) : (n, n), symmetric positive definite
    force(state) : (n,) all of f, inertial forces that depend on velocities included

    and where they apply

    constraint(state) : (m,) C, zero where the constraints hold
    constraint_jacobian(state) : (m, n) C_q, with d/dt C = C_q v + C_t
    unilateral(state, h) : a list of Unilateral that may become active within a step of size h
    energy(state) : kinetic plus potential energy, for reports
    increment(q, delta), difference(q_from, q_to) : q ∘ exp(δ), and the δ between; where q is not a plain vector
    inverse_tangent(delta) : a list of (first, (3, 3) block) in which T(δ)⁻¹ differs from the identity

    What implicit and constrained methods want besides. Where it is not given, it is found by central differences of
    the methods above, which suits smooth functions of values of about 1, good to some nine digits:

    stiffness(state), damping(state) : (n, n) −∂f/∂q along increments, −∂f/∂v; none where has_stiffness is False
    inertial_stiffness(state, acceleration) : (n, n) ∂(M a)/∂q for a fixed a
    constraint_rate(state) : (m,) ∂C/∂t
    constraint_curvature(state) : (m,) d²C/dt² at v̇ = 0: (C_q v)_q v + 2 C_qt v + C_tt
    constraint_stiffness(state, multipliers) : (n, n) ∂(C_qᵀ λ)/∂q for a fixed λ (m)

    And for special needs, nothing without them: constraint_blocks() (a list of rows that belong together, as those of a
    joint; [m]), acceleration(state) ((n,) M⁻¹ f by a faster way), multiply_mass(state, x) ((n,) M x),
    gyroscopic_damping(state) and free_spins(state, h) (a list of FreeSpin), definite_constraint_stiffness(state,
    multipliers); and the attributes recovery_speed (0.01), free_fall (0), gap_resolution (0). They mean what those of
    the C++ class mean (delassus/dynamical_system.hpp).
    """

    has_stiffness: bool = True  #: False: f depends on neither q nor v, and stiffness and damping are not asked for
    recovery_speed: float = 0.01  #: largest speed with which a step pushes apart what penetrates
    free_fall: float = 0.0  #: acceleration of what is let go at rest; 0: not known
    gap_resolution: float = 0.0  #: gaps nearer to 0 count as 0

    def initial_state(self) -> Any:
        """A State, or (q, v) at t = 0."""
        raise NotImplementedError(f"{type(self).__name__} has no method initial_state(self)")

    def mass(self, state: State) -> Any:
        """M(q), (n, n)."""
        raise NotImplementedError(f"{type(self).__name__} has no method mass(self, state)")

    def force(self, state: State) -> Any:
        """f(q, v, t), (n,)."""
        raise NotImplementedError(f"{type(self).__name__} has no method force(self, state)")

    def derivative_errors(self, state: Optional[State] = None) -> dict:
        """By method, how far the derivatives that the class gives are from central differences, as a share of their
        size: some 1e-9 where they are right. At a state, by default the initial one."""
        asked = _Asked(self)
        if state is None:
            state = State(*asked.initial_state())
        t, q, v = float(state[0]), np.asarray(state[1], float), np.asarray(state[2], float)
        vectors = {"inertial_stiffness": np.linspace(1.0, 2.0, asked.n),
                   "constraint_stiffness": np.linspace(1.0, 2.0, asked.m)}
        errors = {}
        for name, difference in asked.differences.items():
            if name not in asked.methods or not asked.given(name):
                continue
            more = [vectors[name]] if name in vectors else []
            own, other = getattr(asked, name)(t, q, v, *more), difference(t, q, v, *more)
            if name not in ("constraint_rate", "constraint_curvature"):
                own, other = _dense(own, asked.n), _dense(other, asked.n)
            size = max(np.abs(own).max(initial=0.0), np.abs(other).max(initial=0.0))
            errors[name] = float(np.abs(own - other).max(initial=0.0) / size) if size > 0.0 else 0.0
        if asked.m:
            own = _dense(asked.constraint_jacobian(t, q, v), asked.n, asked.m)
            other = asked.columns(lambda moved: asked.constraint(t, moved, v), q, asked.n, asked.m)
            size = max(np.abs(own).max(), np.abs(other).max(), 1e-300)
            errors["constraint_jacobian"] = float(np.abs(own - other).max() / size)
        return errors


Entries = Union[np.ndarray, Tuple]  #: a dense matrix, or (rows, columns, values); () is nothing


def _sparse(matrix: Entries, n: int) -> scipy.sparse.csr_matrix:
    if isinstance(matrix, np.ndarray) or not matrix:
        return scipy.sparse.csr_matrix(matrix if len(matrix) else (n, n))
    i, j, values = matrix
    return scipy.sparse.csr_matrix((values, (i, j)), (n, n))


def _dense(matrix: Entries, columns: int, rows: Optional[int] = None) -> np.ndarray:
    if isinstance(matrix, np.ndarray):
        return matrix
    shape = (columns if rows is None else rows, columns)
    if not matrix:
        return np.zeros(shape)
    i, j, values = matrix
    return scipy.sparse.coo_matrix((values, (i, j)), shape).toarray()


def _times(matrix: Entries, x: np.ndarray, rows: int) -> np.ndarray:
    if isinstance(matrix, np.ndarray):
        return matrix @ x
    i, j, values = matrix
    return np.bincount(i, values * x[j], rows)


def _transposed_times(matrix: Entries, x: np.ndarray, columns: int) -> np.ndarray:
    if isinstance(matrix, np.ndarray):
        return x @ matrix
    i, j, values = matrix
    return np.bincount(j, values * x[i], columns)


_OPTIONAL = ("acceleration", "gyroscopic_damping", "free_spins", "definite_constraint_stiffness", "unilateral", "energy",
             "increment", "difference", "inverse_tangent")

#: Step of a central difference whose values are exact to rounding, for quantities of about 1.
_STEP = np.finfo(float).eps ** (1 / 3)


class _Asked:
    """A system as the extension module asks it: states as (t, q, v), shapes checked, matrices as Entries,
    derivatives by differences where the class gives none."""

    def __init__(self, system: DynamicalSystem):
        self._system = system
        self._name = type(system).__name__
        self.not_finite = ""  #: the method that last returned a value that is not finite, and where
        start = system.initial_state()
        if not isinstance(start, (tuple, list)) or len(start) not in (2, 3):
            raise InputError(f"{self._name}.initial_state() returned a {type(start).__name__}; it must be a State, or "
                             "(q, v)")
        t, q, v = start if len(start) == 3 else (0.0, *start)
        v = np.asarray(v)
        self.n = v.size
        self._start = (float(t), self._vector("initial_state", q, np.size(q), "q"),
                       self._vector("initial_state", v, self.n, "n"))
        self.position_size = self._start[1].size
        if self.n == 0:
            raise InputError(f"{self._name}.initial_state() has no velocities")
        self._own_group = self.given("increment") or self.given("difference")
        if self._own_group and not (self.given("increment") and self.given("difference")):
            raise InputError(f"{self._name} has one of the methods increment and difference; it must have both or none")
        if not self._own_group and self.position_size != self.n:
            raise InputError(f"{self._name}.initial_state() has {self.position_size} positions and {self.n} velocities; "
                             "where these differ the class must have the methods increment and difference")
        self.m, self.constraint_blocks = 0, []
        if self.given("constraint"):
            if not self.given("constraint_jacobian"):
                raise InputError(f"{self._name} has a method constraint; it must have constraint_jacobian, too")
            self.m = np.size(system.constraint(self._state(*self._start)))
            blocks = system.constraint_blocks() if self.given("constraint_blocks") else [self.m] if self.m else []
            self.constraint_blocks = [int(rows) for rows in blocks]
            if sum(self.constraint_blocks) != self.m or any(rows < 1 for rows in self.constraint_blocks):
                raise InputError(f"{self._name}.constraint_blocks() returned {self.constraint_blocks}; it must be "
                                 f"positive numbers with the sum {self.m}, the length of constraint(state)")
        self.recovery_speed = float(system.recovery_speed)
        self.free_fall = float(system.free_fall)
        self.gap_resolution = float(system.gap_resolution)
        self.differences: dict = {"inertial_stiffness": self._inertial_stiffness}
        if system.has_stiffness:
            self.differences.update(stiffness=self._stiffness, damping=self._damping)
        if self.m:
            self.differences.update(constraint_rate=self._rate, constraint_curvature=self._curvature,
                                    constraint_stiffness=self._constraint_stiffness)
        self.methods = set(self.differences) | {name for name in _OPTIONAL if self.given(name)}
        # What is wrong at the start is said before the first step.
        for name in ("mass", "force", "constraint", "constraint_jacobian", "energy"):
            if name in ("mass", "force") or (self.given(name) and (self.m or name == "energy")):
                getattr(self, name)(*self._start)
        if self.not_finite:
            raise InputError(f"{self.not_finite}: a value is not finite")
        self._check_mass()

    def given(self, name: str) -> bool:
        """Whether the class has the method."""
        return callable(getattr(self._system, name, None))

    def _check_mass(self) -> None:
        """At the start only, and whether it is definite only where that costs little."""
        mass = _sparse(self.mass(*self._start), self.n)
        size = abs(mass).max()
        if abs(mass - mass.T).max() > 1e-10 * size:
            raise InputError(f"{self._name}.mass() returned a matrix that is not symmetric")
        least = np.linalg.eigvalsh(mass.toarray())[0] if self.n <= 200 else mass.diagonal().min()
        if least < -1e-10 * size:
            raise InputError(f"{self._name}.mass() returned a matrix that is not positive definite: it has the "
                             f"{'eigenvalue' if self.n <= 200 else 'diagonal entry'} {least:.3g}")

    # ---- What methods return ----

    @staticmethod
    def _state(t: float, q: np.ndarray, v: np.ndarray) -> State:
        return State(t, q, v)

    def _numbers(self, name: str, value: Any) -> np.ndarray:
        if value is None:
            raise InputError(f"{self._name}.{name}() returned None")
        value = np.asarray(value)
        if value.dtype != np.float64:
            if not np.can_cast(value.dtype, np.float64, "same_kind"):
                raise InputError(f"{self._name}.{name}() returned values of type {value.dtype}; they must be real "
                                 "numbers")
            value = value.astype(np.float64)
        return value

    def _note(self, name: str, values: np.ndarray, t: Optional[float]) -> None:
        # The methods of the library know what to do in a trial step: shorten it, or fail.
        if not math.isfinite(values.sum()):
            self.not_finite = f"{self._name}.{name}()" + ("" if t is None else f" at t = {t:.9g}")

    def _vector(self, name: str, value: Any, size: int, letter: str, t: Optional[float] = None) -> np.ndarray:
        value = self._numbers(name, value)
        if value.shape != (size,):
            raise InputError(f"{self._name}.{name}() returned an array of shape {value.shape}; it must be ({size},), "
                             f"({letter},)")
        self._note(name, value, t)
        return value

    def _matrix(self, name: str, value: Any, shape: Tuple[int, int], letters: str,
                t: Optional[float] = None) -> Entries:
        if scipy.sparse.issparse(value):
            entries = value.tocoo()
            values = self._numbers(name, entries.data)
            result: Entries = (entries.row, entries.col, values)
        else:
            result = value = values = self._numbers(name, value)
        if value.shape != shape:
            raise InputError(f"{self._name}.{name}() returned a matrix of shape {value.shape}; it must be {shape}, "
                             f"{letters}")
        self._note(name, values, t)
        return result

    # ---- The user's methods ----

    def initial_state(self) -> Tuple[float, np.ndarray, np.ndarray]:
        return self._start

    def increment(self, q, delta):
        return self._vector("increment", self._system.increment(q, delta), self.position_size, "len(q)")

    def difference(self, q_from, q_to):
        return self._vector("difference", self._system.difference(q_from, q_to), self.n, "n")

    def inverse_tangent(self, delta):
        blocks = []
        for first, block in self._system.inverse_tangent(delta):
            block = self._numbers("inverse_tangent", block)
            if block.shape != (3, 3) or not 0 <= first <= self.n - 3:
                raise InputError(f"{self._name}.inverse_tangent() returned a block of shape {block.shape} at {first}; "
                                 f"it must be (3, 3), at 0 to {self.n - 3}")
            blocks.append((int(first), np.ascontiguousarray(block).ravel()))
        return blocks

    def mass(self, t, q, v):
        return self._matrix("mass", self._system.mass(self._state(t, q, v)), (self.n, self.n), "(n, n)", t)

    def multiply_mass(self, t, q, v, x):
        if self.given("multiply_mass"):
            return self._vector("multiply_mass", self._system.multiply_mass(self._state(t, q, v), x), self.n, "n", t)
        return _times(self.mass(t, q, v), x, self.n)

    def force(self, t, q, v):
        return self._vector("force", self._system.force(self._state(t, q, v)), self.n, "n", t)

    def acceleration(self, t, q, v):
        return self._vector("acceleration", self._system.acceleration(self._state(t, q, v)), self.n, "n", t)

    def energy(self, t, q, v):
        value = self._numbers("energy", self._system.energy(self._state(t, q, v)))
        if value.size != 1:
            raise InputError(f"{self._name}.energy() returned an array of shape {value.shape}; it must be a number")
        return float(value.reshape(()))

    def _tangent(self, name: str, t, q, v, *more):
        method = getattr(self._system, name, None)
        if not callable(method):
            return self.differences[name](t, q, v, *more)
        value = method(self._state(t, q, v), *more)
        if value is None:  # nothing
            return ()
        return self._matrix(name, value, (self.n, self.n), "(n, n)", t)

    def stiffness(self, t, q, v):
        return self._tangent("stiffness", t, q, v)

    def damping(self, t, q, v):
        return self._tangent("damping", t, q, v)

    def gyroscopic_damping(self, t, q, v):
        return self._tangent("gyroscopic_damping", t, q, v)

    def inertial_stiffness(self, t, q, v, acceleration):
        return self._tangent("inertial_stiffness", t, q, v, acceleration)

    def constraint_stiffness(self, t, q, v, multipliers):
        return self._tangent("constraint_stiffness", t, q, v, multipliers)

    def definite_constraint_stiffness(self, t, q, v, multipliers):
        return self._tangent("definite_constraint_stiffness", t, q, v, multipliers)

    def free_spins(self, t, q, v, h):
        spins = []
        for spin in self._system.free_spins(self._state(t, q, v), h):
            spins.append((int(spin.column), bool(spin.alone),
                          *(self._vector("free_spins", vector, 3, "3", t)
                            for vector in (spin.torque, spin.impulse, spin.speed, spin.turn))))
        return spins

    def constraint(self, t, q, v):
        return self._vector("constraint", self._system.constraint(self._state(t, q, v)), self.m, "m", t)

    def constraint_jacobian(self, t, q, v):
        return self._matrix("constraint_jacobian", self._system.constraint_jacobian(self._state(t, q, v)),
                            (self.m, self.n), "(m, n)", t)

    def constraint_rate(self, t, q, v):
        if not self.given("constraint_rate"):
            return self._rate(t, q, v)
        return self._vector("constraint_rate", self._system.constraint_rate(self._state(t, q, v)), self.m, "m", t)

    def constraint_curvature(self, t, q, v):
        if not self.given("constraint_curvature"):
            return self._curvature(t, q, v)
        return self._vector("constraint_curvature", self._system.constraint_curvature(self._state(t, q, v)), self.m, "m",
                            t)

    def unilateral(self, t, q, v, h) -> List[Tuple]:
        result = []
        blocks = self._system.unilateral(self._state(t, q, v), h)
        if not isinstance(blocks, (list, tuple)):
            raise InputError(f"{self._name}.unilateral() returned a {type(blocks).__name__}; it must be a list")
        for place, block in enumerate(blocks):
            name = f"unilateral()[{place}]"
            if not isinstance(block, Unilateral):
                raise InputError(f"{self._name}.{name} is of type {type(block).__name__}; it must be a Unilateral")
            if not isinstance(block.cone, Cone):
                raise InputError(f"{self._name}.{name}.cone is of type {type(block.cone).__name__}; make it by "
                                 "Cone.nonnegative, Cone.friction or Cone.box")
            if block.cone.kind == "free":
                raise InputError(f"{self._name}.{name}.cone is free; a bilateral row belongs into constraint")
            if not 0.0 <= block.restitution <= 1.0:
                raise InputError(f"{self._name}.{name}.restitution is {block.restitution}; it must be in [0, 1]")
            if not block.compliance >= 0.0:
                raise InputError(f"{self._name}.{name}.compliance is {block.compliance}; it must be 0 or positive")
            rows = block.cone.rows
            jacobian = block.jacobian
            if not scipy.sparse.issparse(jacobian):
                jacobian = np.atleast_2d(self._numbers("unilateral", jacobian))
            if jacobian.shape != (rows, self.n):
                raise InputError(f"{self._name}.{name}.jacobian is of shape {jacobian.shape}; it must be "
                                 f"{(rows, self.n)}, as the cone has {rows} rows and n is {self.n}")
            matrix = scipy.sparse.csr_matrix(jacobian)
            matrix.sum_duplicates()
            self._note("unilateral", matrix.data, t)
            gap, rate = np.zeros(rows), np.zeros(rows)
            for to, values, letter in ((gap, block.gap, "gap"), (rate, block.rate, "rate")):
                values = self._numbers("unilateral", values)
                if values.ndim == 0 and letter == "gap":
                    to[0] = values
                elif values.ndim == 0 or values.shape == (rows,):
                    to[:] = values
                else:
                    raise InputError(f"{self._name}.{name}.{letter} is of shape {values.shape}; it must be a number or "
                                     f"{(rows,)}")
                self._note("unilateral", to, t)
            result.append((block.cone, gap, rate, matrix.indptr.astype(np.int32), matrix.indices.astype(np.int32),
                           matrix.data, (place if block.key is None else int(block.key)) & 0xFFFFFFFFFFFFFFFF,
                           float(block.restitution), float(block.compliance)))
        return result

    # ---- Central differences of them ----

    def _moved(self, q: np.ndarray, delta: np.ndarray) -> np.ndarray:
        return self.increment(q, delta) if self._own_group else q + delta

    def columns(self, function: Callable, q: np.ndarray, columns: int, rows: int) -> np.ndarray:
        """(rows, columns): the derivative of a function of positions along increments of them."""
        result, delta = np.zeros((rows, columns)), np.zeros(columns)
        for j in range(columns):
            step = _STEP * (1.0 if self._own_group else max(1.0, abs(q[j])))
            delta[j] = step
            ahead = function(self._moved(q, delta))
            delta[j] = -step
            result[:, j] = (ahead - function(self._moved(q, delta))) / (2.0 * step)
            delta[j] = 0.0
        return result

    def _stiffness(self, t, q, v):
        return self.columns(lambda moved: -self.force(t, moved, v), q, self.n, self.n)

    def _damping(self, t, q, v):
        result = np.zeros((self.n, self.n))
        for j in range(self.n):
            step = np.zeros(self.n)
            step[j] = _STEP * max(1.0, abs(v[j]))
            result[:, j] = (self.force(t, q, v - step) - self.force(t, q, v + step)) / (2.0 * step[j])
        return result

    def _inertial_stiffness(self, t, q, v, acceleration):
        return self.columns(lambda moved: self.multiply_mass(t, moved, v, acceleration), q, self.n, self.n)

    def _constraint_stiffness(self, t, q, v, multipliers):
        return self.columns(
            lambda moved: _transposed_times(self.constraint_jacobian(t, moved, v), multipliers, self.n), q, self.n,
            self.n)

    def _rate(self, t, q, v):
        step = _STEP * max(1.0, abs(t))
        return (self.constraint(t + step, q, v) - self.constraint(t - step, q, v)) / (2.0 * step)

    # d/ds of C_q v + C_t where the velocity stays: at s = 0 that is the curvature.
    def _curvature(self, t, q, v):
        # A rate that is a difference itself is exact to the two-third power of rounding only.
        step = (_STEP if self.given("constraint_rate") else _STEP ** 0.5) / max(1.0, np.abs(v).max(initial=0.0))

        def speed(s):
            moved = self._moved(q, s * v)
            return _times(self.constraint_jacobian(t + s, moved, v), v, self.m) + self.constraint_rate(t + s, moved, v)

        return (speed(step) - speed(-step)) / (2.0 * step)
