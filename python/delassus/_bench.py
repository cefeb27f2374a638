# SPDX-License-Identifier: BSD-3-Clause
"""Benchmark suites, run by the command."""
from __future__ import annotations

import csv
import json
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Optional, Sequence, Union

import numpy as np

from ._builder import SceneBuilder
from ._command import run_command
from ._compare import COLUMNS, Comparison
from ._delassus import InputError, Problem, fill_folder
from ._plugins import folders
from ._view import View
from ._yaml import yaml_of


class Benchmark(Comparison):
    """The runs of solvers as dicts, one a run, with the keys of `columns` and 'curve'; `pandas.DataFrame(benchmark)`
    works. Times are in s, memory in bytes; 'cause' says why a run failed; 'velocity' is the error against the reference.
    A notebook shows the report."""

    columns = COLUMNS + ("cause", "velocity", "processes", "peak_memory")

    def __init__(self, rows: Sequence[dict], simulations: list, cells: list, summary: str, report: Optional[View]):
        super().__init__(rows)
        self.simulations: list = simulations  #: a dict for each run of a scene (simulations.csv)
        self.cells: list = cells  #: a dict for each cell of an axis (cells.csv)
        self.summary: str = summary  #: the tables in Markdown
        self.report: Optional[View] = report  #: the page; None where the build has no chart library

    def best(self) -> dict:
        """By problem, the run that solved it to the tightest tolerance in the least time, or None."""
        result: dict = {}
        for row in self:
            found = result.setdefault(row["problem"], None)
            if row["solved"] and (found is None or
                                  (row["tolerance"], row["seconds"]) < (found["tolerance"], found["seconds"])):
                result[row["problem"]] = row
        return result

    def _repr_html_(self) -> str:
        return self.report._repr_html_() if self.report is not None else super()._repr_html_()


def bench(suite: Any, output: Optional[Union[str, "os.PathLike[str]"]] = None, only: Sequence[str] = (),
          cache: Optional[Union[str, "os.PathLike[str]"]] = None, plugin_path: Sequence[Any] = ()) -> Benchmark:
    """Run a suite of benchmarks (docs/benchmarks.md), each run in a process of its own, by the command `delassus`.

    Parameters
    ----------
    suite : a suite's file, the name of one of those that come with the library ('quick', 'full', …), or a dict of the
        keys of a suite file. In a dict, 'problems' may hold Problems, and 'scenes' and 'leaving_out' SceneBuilders;
        relative paths count from the working directory
    output : a folder for results, report and tables, which is kept, and where the same suite goes on; None: none is kept
    only : names of axes, to run only these
    cache : folder of reference solutions; None: that of the command

    Returns a Benchmark: a list of dicts, ready for pandas, with .simulations, .cells, .report and .plot(). A run that
    fails is a row with its cause. Raises InputError for a wrong suite, with the command's sentence. Ctrl-C ends the run,
    and raises KeyboardInterrupt when its processes have ended. Solvers of register() are not known to the command.
    """
    with tempfile.TemporaryDirectory(prefix="delassus-bench-") as scratch:
        folder = Path(scratch) / "results" if output is None else Path(output)
        if isinstance(suite, Mapping):
            fill_folder(str(folder), "bench", ["suite.yaml"])
            file = folder / "suite.yaml"
            file.write_text(yaml_of(_with_files(suite, folder)) + "\n", encoding="utf-8")
            suite = file
            said_of = str(file)
        else:
            said_of = ""
        arguments = ["bench", "run", os.fspath(suite), "--output", str(folder)]
        for name in [only] if isinstance(only, str) else only:
            arguments += ["--only", name]
        if cache is not None:
            arguments += ["--cache", os.fspath(cache)]
        if folders(plugin_path):
            arguments += ["--plugin-path", *folders(plugin_path)]
        code, said = run_command(arguments)
        if code != 0:
            sentence = said.strip().removeprefix("delassus: ") or f"the command ended with code {code}"
            raise InputError(sentence.replace(said_of, "the suite") if said_of else sentence)
        return _read(folder)


def _with_files(suite: Mapping, folder: Path) -> dict:
    """The suite with problems and scenes in files, and paths that do not depend on where the suite lies."""
    made = [0]

    def item(value: Any) -> Any:
        if isinstance(value, Problem):
            made[0] += 1
            path = folder / "given" / f"{value.name or 'problem'}-{made[0]}".replace("/", "_")
            fill_folder(str(folder), "bench", ["given/", f"given/{path.name}"])
            value.write(path)
            return {"path": str(path.resolve()), "name": value.name or f"problem {made[0]}"}
        if isinstance(value, SceneBuilder):
            made[0] += 1
            path = folder / "given" / f"scene-{made[0]}.yaml"
            fill_folder(str(folder), "bench", ["given/", f"given/{path.name}"])
            value.write(path)
            return {"path": str(path.resolve()), "name": str(value.get("title", f"scene {made[0]}"))}
        if isinstance(value, Mapping):
            return {key: place(entry) if key in ("path", "folder", "scene") else entry for key, entry in value.items()}
        return place(value)

    def place(value: Any) -> Any:
        if isinstance(value, os.PathLike):
            value = os.fspath(value)
        if isinstance(value, str) and not value.startswith("$") and not value.startswith("pile:") and value != "pile":
            return os.path.abspath(value)
        return value

    result = dict(suite)
    for key in ("problems", "scenes", "leaving_out", "axes"):
        if isinstance(result.get(key), (list, tuple)):
            result[key] = [item(value) for value in result[key]]
    return result


def _read(folder: Path) -> Benchmark:
    lines = [json.loads(line) for line in (folder / "results.jsonl").read_text(encoding="utf-8").splitlines() if line]
    asked = set([line for line in lines if line["kind"] == "session"][-1]["keys"])
    problems = {line["problem"]: line for line in lines if line["kind"] == "problem"}
    runs = {line["key"]: line for line in lines if line["kind"] == "solve" and line["key"] in asked}  # the last of each
    rows = []
    for line in runs.values():
        problem = problems[line["problem"]]
        error, seconds, curve = line.get("error") or {}, line["seconds"], (line.get("curve") or {}).get("samples")
        setup, solve = seconds.get("setup"), seconds.get("solve")
        rows.append(dict(
            problem=problem["name"], n=problem["n"], m=problem["m"], law=line["law"], solver=line["label"],
            tolerance=line["tolerance"], status=line["status"], solved=line["status"] == "solved",
            natural=error.get("natural"), balance=error.get("balance"), iterations=line["iterations"],
            seconds_setup=setup, seconds_solve=solve, seconds=None if setup is None or solve is None else setup + solve,
            message=line["message"], cause=line["cause"], velocity=error.get("velocity"), processes=line["processes"],
            peak_memory=line["peak_memory"], curve=np.array(curve) if curve else None))
    report, summary = folder / "report.html", folder / "summary.md"
    return Benchmark(rows, _table(folder / "simulations.csv"), _table(folder / "cells.csv"),
                     summary.read_text(encoding="utf-8") if summary.exists() else "",
                     View(report.read_text(encoding="utf-8")) if report.exists() else None)


def _table(path: Path) -> list:
    if not path.exists():
        return []
    with open(path, newline="", encoding="utf-8") as file:
        return [{key: _value(text) for key, text in row.items()} for row in csv.DictReader(file)]


def _value(text: str) -> Any:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            pass
    return text or None
