# SPDX-License-Identifier: BSD-3-Clause
"""The plugins by the folders they are looked for in, and options as texts."""
from __future__ import annotations

import functools
import os
from typing import Any, Sequence, Tuple, Union

import numpy as np

from . import _delassus
from ._delassus import InputError

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
