# SPDX-License-Identifier: BSD-3-Clause
"""Solvers side by side: each run in a process of its own, errors measured by the library and not by the solver."""
from __future__ import annotations

import csv
import io
import math
import multiprocessing
import os
import signal
import time
import warnings
from html import escape
from typing import Any, Mapping, Optional, Sequence, Union

import numpy as np

from ._files import write_whole

#: Columns of a comparison, in their order; 'curve' comes besides.
COLUMNS = ("problem", "n", "m", "law", "solver", "tolerance", "status", "solved", "natural", "balance", "iterations",
           "seconds_setup", "seconds_solve", "seconds", "message")

#: What a run may take beyond its time limit before it is ended from outside: start and judgement.
_GRACE = 5.0


class Comparison(list):
    """The runs as dicts, one a run, with the keys of `columns` and 'curve'. `pandas.DataFrame(comparison)` works."""

    columns = COLUMNS

    def best(self) -> dict:
        """By problem, the run that solved it in the least time, or None."""
        result: dict = {}
        for row in self:
            found = result.setdefault(row["problem"], None)
            if row["solved"] and (found is None or row["seconds"] < found["seconds"]):
                result[row["problem"]] = row
        return result

    def to_csv(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """Write the columns as CSV (RFC 4180), without the curves."""
        text = io.StringIO()
        writer = csv.DictWriter(text, self.columns, extrasaction="ignore")
        writer.writeheader()
        writer.writerows(self)
        write_whole(path, text.getvalue())

    def plot(self, axes: Any = None) -> Any:
        """Error against time of each run, with matplotlib, on axes or on new ones; returns the axes."""
        try:
            import matplotlib.pyplot as plt
        except ImportError:
            raise ImportError("plot() needs matplotlib (python3-matplotlib)") from None
        if axes is None:
            axes = plt.subplots()[1]
        keys = [key for key in ("problem", "law", "tolerance") if len({row[key] for row in self}) > 1]
        for row in self:
            curve = row["curve"]
            if curve is None or not len(curve):
                continue
            label = ", ".join([row["solver"], *(_text(row[key]) for key in keys)])
            axes.loglog(np.maximum(curve[:, 1], 1e-7), curve[:, 2], ".-", label=label)
        axes.set_xlabel("time in the solver, s")
        axes.set_ylabel("natural error")
        axes.grid(True, alpha=0.3)
        axes.legend()
        return axes

    def _repr_html_(self) -> str:
        shown = ("problem", "solver", "law", "status", "natural", "iterations", "seconds")
        head = "".join(f"<th>{name}</th>" for name in shown)
        cells = "".join("<tr>" + "".join(f"<td>{escape(_text(row[name]))}</td>" for name in shown) + "</tr>"
                        for row in self)
        return f"<table><thead><tr>{head}</tr></thead><tbody>{cells}</tbody></table>"


def _text(value: Any) -> str:
    return f"{value:.3g}" if isinstance(value, float) else "" if value is None else str(value)


def _row(problem: Any, name: str, law: str, tolerance: float, status: str, message: str) -> dict:
    row = dict.fromkeys(COLUMNS)
    row.update(problem=problem.name or "problem", n=problem.n, m=problem.m, law=law, solver=name, tolerance=tolerance,
               status=status, solved=False, message=message, curve=None)
    return row


def _run(make: Any, problem: Any, repeats: int, settings: Mapping[str, Any], connection: Any) -> None:
    """In the child: the least time of some solves, and their result."""
    from . import InputError, Unsupported
    try:
        best = None
        begin = time.monotonic()
        for repeat in range(repeats):
            # What a solver kept from the solve before would count for nothing.
            result = make().solve(problem, curve=repeat == 0, **settings)
            if repeat == 0:
                curve = result.curve
            if best is None or result.seconds < best.seconds:
                best = result
            if time.monotonic() - begin > 5.0:
                break
        fields = dict(status=best.status, solved=bool(best.solved), natural=best.errors["natural"],
                      balance=best.errors["balance"], iterations=best.iterations, seconds_setup=best.seconds_setup,
                      seconds_solve=best.seconds_solve, seconds=best.seconds, message=best.message,
                      curve=np.array(curve))
    except Unsupported as error:
        fields = dict(status="unsupported", message=str(error))
    except InputError as error:
        fields = dict(error=str(error))
    except Exception as error:  # of a solver written in Python
        fields = dict(status="error", message=f"{type(error).__name__}: {error}")
    connection.send(fields)
    connection.close()


def _how_it_ended(process: Any) -> str:
    code = process.exitcode
    if code is not None and code < 0:
        return f"the process was ended by {signal.Signals(-code).name}"
    return f"the process ended with code {code} and no answer"


def compare(problems: Any, solvers: Sequence[Any], tolerance: float = 1e-6, law: Optional[str] = None,
            time_limit: float = 30.0, repeats: int = 3, plugin_path: Sequence[Any] = ()) -> Comparison:
    """Run each solver on each problem, in a process of its own.

    Parameters
    ----------
    problems : a Problem, a path, or a list of these
    solvers : names as Solver takes them ('pgs', 'apgd(key=value)'), those of register() among them
    tolerance : of the natural error, dimensionless
    law : 'associated' or 'coulomb' in place of the problems' own
    time_limit : s, of the solver's own time in one run; what does not answer soon after it is ended
    repeats : solves, each by a new solver, of which the least time counts; only as many as fit in 5 s

    Returns a Comparison: a list of dicts, ready for pandas. A solver that crashes, hangs or refuses is a row with its
    status ('crashed', 'time_limit', 'unsupported', 'error') and a message. Raises InputError for an unknown solver, a
    wrong option or an impossible setting.
    """
    from . import InputError, Problem, Solver, read
    if isinstance(problems, (str, os.PathLike, Problem)):
        problems = [problems]
    if isinstance(solvers, str):
        solvers = [solvers]
    if repeats < 1:
        raise InputError(f"repeats is {repeats}; it must be at least 1")
    if not time_limit > 0.0:
        raise InputError(f"time_limit is {time_limit}; it must be positive")
    for name in solvers:
        if Solver(name, plugin_path=plugin_path).optimized is False:  # an unknown name or option is said here, too
            warnings.warn(f"{name} was built without optimisation: its times say little", stacklevel=2)
    context = multiprocessing.get_context("fork")
    settings = dict(tolerance=tolerance, law=law, time_limit=None if math.isinf(time_limit) else time_limit)
    result = Comparison()
    for problem in problems:
        if not isinstance(problem, Problem):
            problem = read(problem)
        for name in solvers:
            receiver, sender = context.Pipe(duplex=False)
            process = context.Process(target=_run, daemon=True, args=(
                lambda name=name: Solver(name, plugin_path=plugin_path), problem, repeats, settings, sender))
            process.start()
            sender.close()
            row = _row(problem, name, law or problem.law, tolerance, "crashed", "")
            try:
                if receiver.poll(repeats * time_limit + _GRACE if not math.isinf(time_limit) else None):
                    fields = receiver.recv()
                    if "error" in fields:
                        raise InputError(fields["error"])
                    row.update(fields)
                else:
                    row.update(status="time_limit", message=f"no answer long after the time limit of {time_limit:g} s")
            except EOFError:
                process.join()
                row["message"] = _how_it_ended(process)
            finally:
                process.kill()
                process.join()
                receiver.close()
            result.append(row)
    return result
