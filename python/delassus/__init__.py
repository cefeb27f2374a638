# SPDX-License-Identifier: BSD-3-Clause
"""Saddle-point and cone-complementarity problems of constrained mechanics, with solvers as plugins.

    H x − Dᵀ λ   = a          n rows: momentum balance
    D x + E λ + b = u         m rows: constraint velocities
    λ ∈ Υ  ⊥  u ∈ Υ*          one cone for each block of rows

x are velocities and λ reaction impulses in SI scenes (m/s, N s), but no unit is assumed.

>>> import delassus
>>> problem = delassus.Problem(H, D, a, b, [delassus.Cone.friction(mu=0.5)] * contacts)
>>> result = delassus.solve(problem, tolerance=1e-8)
>>> result.status, result.x, result.lam, result.errors["natural"]
"""
from __future__ import annotations

import os
from typing import Any, Optional, Sequence, Tuple, Union

import numpy as np
import scipy.sparse

from . import _delassus
from ._delassus import Cone, Error, InputError, PluginError, Result, SolveRequest, StepFailure, StepRecord, \
    Unsupported
from ._bench import Benchmark, bench
from ._builder import SceneBuilder
from ._compare import Comparison, compare
from ._derivative import Derivative
from ._plugins import Path, add as _add, folders as _folders, registry as _registry, text as _text
from ._scenes import Scene, Simulation, Trajectory, simulate
from ._system import DynamicalSystem, FreeSpin, State, Unilateral
from ._view import View

__version__: str = _delassus.version
__all__ = ["Benchmark", "Comparison", "Cone", "Derivative", "DynamicalSystem", "Error", "FreeSpin", "InputError",
           "PluginError", "Problem", "Result", "Scene", "SceneBuilder", "Simulation", "SolveRequest", "Solver", "State",
           "StepFailure", "StepRecord", "Trajectory", "Unilateral", "Unsupported", "View", "bench", "compare",
           "derivative", "plugins", "read", "register", "rejected", "simulate", "solve", "timesteppers", "unbuilt"]


def __dir__() -> list:
    return [*__all__, *(name for name in globals() if name.startswith("__"))]


Matrix = Any  #: a scipy.sparse matrix, or a dense array with two dimensions


def _reals(array: Any, name: str) -> np.ndarray:
    """The array itself where its type fits; else a copy in doubles. What is not real numbers is refused."""
    result = np.asarray(array)
    if result.dtype != np.float64:
        if not np.can_cast(result.dtype, np.float64, "same_kind"):
            raise InputError(f"{name} has values of type {result.dtype}; they must be real numbers")
        result = result.astype(np.float64)
    return result


def _rows(matrix: Optional[Matrix], name: str):
    """A matrix by compressed rows, columns ascending without repetition: (indptr, indices, data, shape)."""
    if matrix is None:
        return None
    if not scipy.sparse.issparse(matrix):
        matrix = _reals(matrix, name)
        if matrix.ndim != 2:
            raise InputError(f"{name} has {matrix.ndim} dimensions; it must be a matrix")
    rows = scipy.sparse.csr_matrix(matrix)  # new views of the same arrays where it is one already
    if not rows.has_canonical_format:
        rows = rows.copy()  # the user's matrix stays as it is
        rows.sum_duplicates()
    elif scipy.sparse.issparse(matrix) and matrix.format == "csr" and len(matrix.data) == len(rows.data):
        rows = matrix  # its own arrays, which can become read-only
    return rows.indptr, rows.indices, _reals(rows.data, name), rows.shape


class Problem(_delassus.Problem):
    """A problem, checked and made ready for solvers.

    Parameters
    ----------
    H : (n, n) sparse or dense matrix, or None
        Both triangles. None for a reduced problem, where n = 0 and E is the Delassus operator.
    D : (m, n) sparse or dense matrix, or None where n = 0
    a : (n,) array, momentum
    b : (m,) array, velocity
    cones : sequence of Cone, in the order of the rows; together m rows
    E : (m, m) sparse or dense matrix, or None
        Compliance: symmetric positive semidefinite, both triangles.
    law : 'associated' (the convex problem) or 'coulomb' (exact Coulomb friction)
    name : for messages and tables
    copy : True: copy every array and leave those given alone

    Nothing is copied where the types fit: a and b contiguous arrays of float64, matrices in CSR with values of float64,
    indices of int32, and columns ascending without repetition. Solvers then read the very memory of the arrays, so
    those become read-only: writing to one raises NumPy's ValueError. What does not fit is converted once, and what others
    could still write to (a view of an array in use, memory of PyTorch or of a file) is copied; both stay as they are. Raises InputError, with one sentence, where shapes, indices
    or values are wrong; the arrays are then as before.
    """

    def __init__(self, H: Optional[Matrix], D: Optional[Matrix], a: Any, b: Any, cones: Sequence[Cone],
                 E: Optional[Matrix] = None, law: str = "associated", name: str = "", copy: bool = False):
        for cone in cones:
            if not isinstance(cone, Cone):
                raise InputError(f"cones has an entry of type {type(cone).__name__}; "
                                 "make them by Cone.free, Cone.nonnegative, Cone.box or Cone.friction")
        super().__init__(_rows(H, "H"), _rows(D, "D"), _reals(a, "a"), _reals(b, "b"), list(cones), _rows(E, "E"), law,
                         name, copy)

    @classmethod
    def read(cls, path: Path) -> "Problem":
        """Read a problem folder, or a problem or an FCLib file in HDF5 if the path ends in .h5 or .hdf5 (docs/files.md)."""
        problem = cls.__new__(cls)
        _delassus.Problem.__init__(problem, os.fspath(path))
        return problem

    def write(self, path: Path) -> None:
        """Write a problem folder, or one HDF5 file if the path ends in .h5, or an FCLib file if it ends in .hdf5."""
        self._write(os.fspath(path))

    @property
    def H(self) -> scipy.sparse.csr_matrix:
        """(n, n), read-only, in the problem's own memory."""
        return _matrix(self._H)

    @property
    def D(self) -> scipy.sparse.csr_matrix:
        """(m, n), read-only, in the problem's own memory."""
        return _matrix(self._D)

    @property
    def E(self) -> scipy.sparse.csr_matrix:
        """(m, m), read-only, in the problem's own memory; without entries where there is no compliance."""
        return _matrix(self._E)

    def set_right_hand_side(self, a: Any, b: Any) -> None:
        """Replace a (n) and b (m) by copies of these. What a Solver analysed or factorised stays valid."""
        super().set_right_hand_side(_reals(a, "a"), _reals(b, "b"))

    def errors(self, x: Any, lam: Any) -> dict:
        """The error measures of (x, λ) by name, dimensionless (docs/errors.md); x: n, lam: m."""
        return self._errors(_reals(x, "x"), _reals(lam, "lam"))

    def inspect(self, plugin_path: Sequence[Path] = ()) -> dict:
        """Sizes, structure of H, cones, rank, needs, and the solvers that can take it, as `delassus inspect --json`."""
        return self._inspect(_registry(_folders(plugin_path)))

    def qualification(self, plugin_path: Sequence[Path] = ()) -> dict:
        """Whether reactions are unique ('licq') and bounded ('pointed'): True, False, or None where undecided.

        'rank' is that of N = D H⁻¹ Dᵀ + E; 'pointedness' the smallest net effect of normal reactions with a sum of 1;
        'cancelling' the reactions that cancel (m), where they are not bounded.
        """
        return self._qualification(_registry(_folders(plugin_path)))

    def __repr__(self) -> str:
        return f"<delassus.Problem: {self.name or 'without a name'}, n = {self.n}, m = {self.m}, law {self.law}>"


def _matrix(parts) -> scipy.sparse.csr_matrix:
    data, indices, indptr, shape = parts
    matrix = scipy.sparse.csr_matrix(shape)
    matrix.data, matrix.indices, matrix.indptr = data, indices, indptr  # the constructor would copy read-only arrays
    matrix.has_canonical_format = True
    return matrix


def _start(start: Any) -> Tuple[np.ndarray, np.ndarray]:
    """x and λ of what solve() takes as start."""
    if isinstance(start, _delassus.Result):
        return start.x, start.lam
    pair = isinstance(start, (tuple, list)) or getattr(start, "ndim", 0) == 2
    if not pair or len(start) != 2:
        what = f"{len(start)} entries" if pair else f"the type {type(start).__name__}"
        raise InputError(f"start has {what}; it must be a Result or (x, λ), a pair of arrays with n and m entries")
    return _reals(start[0], "the start's x"), _reals(start[1], "the start's λ")


class Solver(_delassus.Solver):
    """A solver that is kept between solves: what it analysed and factorised is used again where the problem allows.

    Parameters
    ----------
    name : a plugin's name (plugins()), 'auto', 'name(key=value, …)', or the path of a shared library
    plugin_path : folders to look for plugins in, before those of DELASSUS_PLUGIN_PATH and of the installation
    options : the plugin's own (docs/solvers.md), and 'finish', 'finish_at'

    One thread at a time works with a solver or a problem; others wait.
    """

    def __init__(self, name: str = "auto", *, plugin_path: Sequence[Path] = (), **options: Any):
        super().__init__(_registry(_folders(plugin_path)), name,
                         {key: _text(key, value) for key, value in options.items()} if options else {})

    def solve(self, problem: Problem, *, tolerance: float = 1e-8, law: Optional[str] = None,
              max_iterations: Optional[int] = None, time_limit: Optional[float] = None,
              start: Union[Result, Tuple[Any, Any], None] = None, curve: bool = False) -> Result:
        """Solve. Not converging is a status of the result; see solve() for the arguments."""
        if not isinstance(problem, _delassus.Problem):
            raise InputError(f"a solver takes a Problem, not a {type(problem).__name__}; read() makes one of a path")
        if start is not None:
            start = _start(start)
        return self._solve(problem, tolerance, max_iterations, time_limit, law, start, curve)

    def __repr__(self) -> str:
        return f"<delassus.Solver: {self.name} {self.version}>"


def solve(problem: Union[Problem, Path], solver: Union[str, Solver] = "auto", tolerance: float = 1e-8, law: Optional[str] = None,
          max_iterations: Optional[int] = None, time_limit: Optional[float] = None,
          start: Union[Result, Tuple[Any, Any], None] = None, curve: bool = False,
          plugin_path: Sequence[Path] = (), **options: Any) -> Result:
    """Solve a problem.

    Parameters
    ----------
    problem : a Problem, or the path of one as read() takes it
    solver : a name as Solver takes it, or a Solver
    tolerance : of the natural error, dimensionless (docs/errors.md)
    law : 'associated' or 'coulomb' for this solve; None: the problem's own
    max_iterations : None: a million
    time_limit : s, of the solver's own time; None: none
    start : a Result or (x, λ) to start from; solvers without a warm start ignore it
    curve : measure the error along the way; Result.curve then has the samples
    options : the solver's own, by keyword

    Returns a Result. Not converging is a status, so look at result.status or result.solved. Raises Unsupported where
    the solver cannot take the problem, InputError for a wrong option or setting. Ctrl-C ends the solve when the solver
    next shows an iterate, and raises KeyboardInterrupt. Other threads run meanwhile.
    """
    if isinstance(problem, (str, os.PathLike)):
        problem = read(problem)
    if isinstance(solver, _delassus.Solver):
        if options or plugin_path:
            raise InputError("options and plugin_path belong to the Solver: give them where it is made")
    else:
        solver = Solver(solver, plugin_path=plugin_path, **options)
    return solver.solve(problem, tolerance=tolerance, law=law, max_iterations=max_iterations, time_limit=time_limit,
                        start=start, curve=curve)


def derivative(problem: Problem, result: Result) -> Derivative:
    """The derivative of a solution by the data of its problem, for directions (jvp) and for gradients (vjp).

    result : of solving this very problem, well below the accuracy that is wanted of the derivative
    Raises InputError where the solution was not found, or where H is singular along what the constraints leave free.
    """
    if not result.solved:
        raise InputError(f"the problem was not solved ({result.status}), so that its solution has no derivative")
    if result.x.shape != (problem.n,) or result.lam.shape != (problem.m,):
        raise InputError(f"the result has n = {len(result.x)} and m = {len(result.lam)}; "
                         f"the problem has n = {problem.n} and m = {problem.m}")
    return Derivative(problem, result)


def _problem_of(prepared) -> Problem:
    problem = Problem.__new__(Problem)
    _delassus.Problem.__init__(problem, prepared)
    return problem


def register(solver: type) -> type:
    """Make a class a solver that can be chosen by its name: in solve, Solver, scenes and simulate. A decorator, too.

    The class needs

    solve(self, problem, request) : returns (x, lam) or (x, lam, status). problem is a Problem, request has tolerance,
        max_iterations, time_limit, start ((x, lam) or None) and show(iteration, lam, x=None). status is 'solved'
        (the default, unless show() said to end), 'iteration_limit', 'time_limit', 'stalled', 'infeasible' or
        'numerical_failure'. Delassus measures the answer: a wrong 'solved' is reported as 'false_claim'.

    and may have

    analyze(self, problem), factorize(self, problem) : called before solve when the pattern or the values of H, D and E
        are new
    refusal(self, problem) : a sentence why it cannot take the problem, or None
    name, description, version, licence : texts; without them the class's own name in lower case, the first line of its
        docstring, '0' and 'unknown'
    options : a dict of option names and defaults (bool, int, float or str), which come as keywords of __init__
    capabilities : names as in plugins(); without it all cones, both laws, and definite or reduced problems

    'auto' does not choose it. Raises InputError where the class is not as above or its name is taken, and PluginError
    for an impossible name.
    """
    if not isinstance(solver, type) or not callable(getattr(solver, "solve", None)):
        raise InputError("register() takes a class with a method solve(self, problem, request)")
    _add(solver)
    return solver


def read(path: Path) -> Problem:
    """Read a problem folder, or a problem or an FCLib file in HDF5 if the path ends in .h5 or .hdf5 (docs/files.md)."""
    return Problem.read(path)


def plugins(plugin_path: Sequence[Path] = ()) -> list:
    """The installed solvers: dicts of name, version, description, licence, capabilities, options, library, and
    optimized: whether the compiler optimised it, None where the plugin does not say. origin says where it was found:
    'delassus', 'user' or 'system' (`delassus plugins install`), 'folder', 'program' (register) or 'python package' (an
    entry point delassus.solvers), of which capabilities and options are empty: it is not loaded before it is chosen.
    rejected() has the others."""
    return _registry(_folders(plugin_path)).plugins()


def rejected(plugin_path: Sequence[Path] = ()) -> list:
    """Plugins, and files meant to be one, that cannot be used: dicts of name ('' for a folder), path and reason."""
    return _registry(_folders(plugin_path)).rejected()


def unbuilt() -> dict:
    """Solvers that this build left out, by name, each with the reason."""
    return _registry().unbuilt()


def timesteppers() -> list:
    """The methods that step a system in time: dicts of name, description, order, options with their defaults, and whether
    they take 'constraints' and 'unilateral' rows (contacts, stops, motors with limits)."""
    return _delassus._timesteppers()
