# SPDX-License-Identifier: BSD-3-Clause
"""The plugins by the folders they are looked for in, classes that are solvers, and options as texts."""
from __future__ import annotations

import contextlib
import functools
import importlib
import importlib.metadata
import os
import sys
from typing import Any, Iterator, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import _delassus
from ._delassus import InputError, PluginError

Path = Union[str, "os.PathLike[str]"]


own_plugins: list = []  # of register()


@functools.lru_cache(maxsize=None)
def registry(folders: Tuple[str, ...] = ()) -> _delassus.Registry:
    """The plugins of these folders (absolute), of the installation, and of register(); read once in a process."""
    result = _delassus.Registry(list(folders))
    for plugin in own_plugins:
        result._add(plugin)
    return result


def folders(plugin_path: Sequence[Path]) -> Tuple[str, ...]:
    """What registry() takes, from one folder or several."""
    if isinstance(plugin_path, (str, os.PathLike)):
        plugin_path = [plugin_path]
    return tuple(os.path.abspath(os.fspath(folder)) for folder in plugin_path)


#: What register() takes a class to be capable of, unless it says otherwise.
_CAPABILITIES = ("free", "nonnegative", "box", "friction", "associated", "coulomb", "h_diagonal", "h_blocks",
                 "h_definite", "reduced", "compliance", "redundant", "warm_start")

#: The group of the entry points by which packages bring solvers.
GROUP = "delassus.solvers"

_loading: Optional[List[type]] = None  # while a module is loaded: the classes that it registers


def plugin_of(solver: type) -> _delassus.Plugin:
    """The plugin of a class, as register() describes it."""
    if not isinstance(solver, type) or not callable(getattr(solver, "solve", None)):
        raise InputError("a solver is a class with a method solve(self, problem, request)")
    line = (solver.__doc__ or "").strip().split("\n")[0]
    return _delassus._plugin_of(
        solver, getattr(solver, "name", solver.__name__.lower()), getattr(solver, "version", "0"),
        getattr(solver, "description", line), getattr(solver, "licence", "unknown"),
        list(getattr(solver, "options", {}).items()), list(getattr(solver, "capabilities", _CAPABILITIES)))


def add(solver: type) -> None:
    """What register() does. A module that is loaded for its solver registers nothing: it says which class it is."""
    if _loading is not None:
        _loading.append(solver)
        return
    plugin = plugin_of(solver)
    registry()._add(plugin)
    own_plugins.append(plugin)
    registry.cache_clear()


@contextlib.contextmanager
def _importing_from(folder: str) -> Iterator[List[type]]:
    """Modules come from this folder first, without leaving compiled files there; the classes that they register."""
    global _loading
    before, _loading = _loading, []
    without_files, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    if folder:
        sys.path.insert(0, folder)
    try:
        yield _loading
    finally:
        if folder:
            sys.path.remove(folder)
            sys.path.append(folder)  # for what the module imports later
        _loading, sys.dont_write_bytecode = before, without_files


def find_class(target: str, folder: str = "") -> type:
    """The class "module:Class"; of "module:" the one that the module registers. Raises PluginError, in one sentence."""
    module_name, _, path = target.partition(":")
    with _importing_from(folder) as registered:
        try:
            module = importlib.import_module(module_name)
            found: Any = module
            for name in filter(None, path.split(".")):
                found = getattr(found, name)
        except Exception as error:
            sentence = " ".join(f"{type(error).__name__}: {error}".split())
            raise PluginError(f"{target} cannot be imported: {sentence}") from None
    origin = os.path.realpath(getattr(module, "__file__", None) or "")
    if folder and not origin.startswith(os.path.realpath(folder) + os.sep):
        raise PluginError(f"the module {module_name} comes from {origin}; it must be that of {folder}")
    if path:
        return found
    classes = list(dict.fromkeys(registered))
    if len(classes) != 1:
        names = ", ".join(f"{one.__module__}:{one.__qualname__}" for one in classes)
        raise PluginError(f"the module {module_name} registers " + (f"several solvers, {names}: only one can be "
                          "installed from a folder, several by entry points of a package" if classes else
                          "no solver: decorate its class with @delassus.register"))
    return classes[0]


def load(target: str, folder: str = "") -> _delassus.Plugin:
    """The plugin of such a class. Raises an Error, in one sentence."""
    return plugin_of(find_class(target, folder))


def packaged() -> list:
    """The solvers that packages bring by entry points, not imported: dicts of texts. solver/python_process.cpp has the
    same for the command."""
    rows: dict = {}
    for package in importlib.metadata.distributions():
        for point in package.entry_points:
            if point.group == GROUP:
                known = package.metadata
                rows.setdefault(point.name, {
                    "name": point.name, "python": point.value, "version": package.version,
                    "description": known.get("Summary") or "", "package": f"{known['Name']} {package.version}",
                    "licence": (known.get("License-Expression") or known.get("License") or "unknown").split("\n")[0]})
    return sorted(rows.values(), key=lambda row: row["name"])


def text(key: str, value: Any) -> str:
    """An option's value as a configuration file has it."""
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, str):
        return value
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    raise InputError(f"option {key} is of type {type(value).__name__}; it must be a number, a bool or a text")
