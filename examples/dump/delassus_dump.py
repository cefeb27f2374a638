# SPDX-License-Identifier: BSD-3-Clause
"""Writes a problem of any engine as a problem folder of Delassus (docs/files.md), with NumPy and nothing else:

    from delassus_dump import dump
    dump("step_17", H=H, D=D, a=a, b=b, cones=[{"kind": "friction", "count": 40, "mu": 0.5}])

and `delassus compare step_17` compares solvers on it. The problem is

    H x - D^T lambda = a,   D x + E lambda + b = u,   lambda in the cones, u in their duals, perpendicular

or with E and b alone the reduced one, where E is the Delassus operator D H^-1 D^T. One page to copy and to change.
Where the package `delassus` is installed, delassus.write(delassus.Problem(...), path) does the same.
"""
import json
import os
import shutil

import numpy as np


def triplets_of(matrix, name, shape):
    """Rows, columns and values, sorted, with no place twice. matrix: what has two dimensions, a matrix of SciPy,
    ("csr", row_start, column, value) or ("triplets", row, column, value); entries in one place are added up."""
    if hasattr(matrix, "tocoo"):
        coo = matrix.tocoo()
        given, row, column, value = coo.shape, coo.row, coo.col, coo.data
    elif isinstance(matrix, tuple) and len(matrix) == 4 and matrix[0] == "csr":
        row_start, column, value = map(np.asarray, matrix[1:])
        if len(row_start) != shape[0] + 1 or row_start[0] != 0 or np.any(np.diff(row_start) < 0):
            raise ValueError(f"row_start of {name} must ascend from 0 and have {shape[0] + 1} places.")
        given, row = shape, np.repeat(np.arange(shape[0]), np.diff(row_start))
    elif isinstance(matrix, tuple) and len(matrix) == 4 and matrix[0] == "triplets":
        given, (row, column, value) = shape, map(np.asarray, matrix[1:])
    else:
        dense = np.asarray(matrix, dtype=float)
        given, (row, column) = dense.shape, np.nonzero(dense) if dense.ndim == 2 else ([], [])
        value = dense[row, column] if dense.ndim == 2 else []
    row, column, value = (np.asarray(x, dtype=t) for x, t in ((row, np.int64), (column, np.int64), (value, float)))
    if tuple(given) != tuple(shape):
        raise ValueError(f"{name} is {tuple(given)}, but it must be {tuple(shape)}.")
    if not len(row) == len(column) == len(value):
        raise ValueError(f"{name} has {len(row)} rows, {len(column)} columns and {len(value)} values.")
    if np.any((row < 0) | (row >= shape[0]) | (column < 0) | (column >= shape[1])):
        raise ValueError(f"{name} has an entry outside {tuple(shape)}.")
    places, where = np.unique(row * shape[1] + column, return_inverse=True)
    total = np.zeros(len(places))
    np.add.at(total, where, value)
    if not np.all(np.isfinite(total)):
        raise ValueError(f"{name} has an entry that is not finite.")
    return places // max(shape[1], 1), places % max(shape[1], 1), total


def run_of(cone):
    """A run of cones as problem.json has it, and its rows. Keys as there; numbers may be of NumPy, bounds infinite."""
    cone = {key: value.tolist() if hasattr(value, "tolist") else value for key, value in cone.items()}
    numbers = {key: cone[key] if isinstance(cone[key], (list, tuple)) else [cone[key]]
               for key in ("mu", "lo", "hi") if key in cone}
    if any(np.isnan(float(x)) for values in numbers.values() for x in values) or not np.all(
            np.isfinite(np.asarray(numbers.get("mu", []), dtype=float))):
        raise ValueError(f"the cone {cone} has a number that is none.")
    for key in {"lo", "hi"} & numbers.keys():
        values = [None if np.isinf(x) else float(x) for x in numbers[key]]
        cone[key] = values if isinstance(cone[key], (list, tuple)) else values[0]
    rows = cone["count"] * cone.get("dimension", 3) if cone.get("kind") == "friction" else cone["rows"]
    return cone, rows


def dump(folder, *, cones, b, H=None, D=None, E=None, a=(), law="coulomb", source="", notes=""):
    """Writes a new folder. Raises ValueError with one sentence, and then writes nothing.

    H: n x n, both triangles; D: m x n; E: m x m, symmetric; those left out are zero. a: n; b: m. cones: runs in the
    order of the rows, dicts as in problem.json. law: "coulomb", exactly, or "associated", convex.
    """
    vectors = {"a": np.asarray(a, dtype=float), "b": np.asarray(b, dtype=float)}
    for name, vector in vectors.items():
        if vector.ndim != 1 or not np.all(np.isfinite(vector)):
            raise ValueError(f"{name} must have one dimension and finite entries.")
    n, m = len(vectors["a"]), len(vectors["b"])
    if law not in ("coulomb", "associated"):
        raise ValueError(f'law is "{law}"; "coulomb" and "associated" exist.')
    runs = [run_of(cone) for cone in cones]
    if sum(rows for _, rows in runs) != m:
        raise ValueError(f"the cones have {sum(rows for _, rows in runs)} rows together, but b has {m}.")
    files = {"problem.json": json.dumps({
        "format": "delassus-problem", "version": 1, "n": n, "m": m, "law": law, "cones": [cone for cone, _ in runs],
        "source": source, "notes": notes}, indent=1, allow_nan=False)}
    for name, matrix, shape in (("H", H, (n, n)), ("D", D, (m, n)), ("E", E, (m, m))):
        if matrix is None:
            continue
        entries = list(zip(*(x.tolist() for x in triplets_of(matrix, name, shape))))
        files[f"{name}.mtx"] = "\n".join(
            ["%%MatrixMarket matrix coordinate real general", f"{shape[0]} {shape[1]} {len(entries)}"]
            + [f"{i + 1} {j + 1} {value!r}" for i, j, value in entries])
    for name, vector in vectors.items():
        if len(vector) == 0:
            continue
        files[f"{name}.mtx"] = "\n".join(["%%MatrixMarket matrix array real general", f"{len(vector)} 1"]
                                         + [repr(value) for value in vector.tolist()])
    folder = os.path.normpath(os.fspath(folder))
    if os.path.lexists(folder):
        raise ValueError(f"{folder} is there already.")
    partial = f"{folder}.partial-{os.getpid()}"
    try:
        os.mkdir(partial)
        for name, text in files.items():
            with open(os.path.join(partial, name), "w", encoding="utf-8") as file:
                file.write(text + "\n")
        os.rename(partial, folder)
    except BaseException:
        shutil.rmtree(partial, ignore_errors=True)
        raise
