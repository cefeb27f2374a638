# SPDX-License-Identifier: BSD-3-Clause
"""A solver of Python for another process, which started this one (core/src/solver/python_process.cpp)."""
from __future__ import annotations

import os
import signal

from . import _delassus
from ._plugins import find_class, plugin_of


def serve(target: str, folder: str) -> None:
    """Load the solver "module:Class" and answer the calls that come from standard input, a socket, to its end."""
    socket = os.dup(0)
    with open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), 0)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the host is asked, and tells the solver when it next shows an iterate
    try:
        solver = find_class(target, folder)
        plugin = plugin_of(solver)
    except BaseException as error:  # a module may also end the process
        _delassus._refuse(socket, str(error) or type(error).__name__)
        return
    _delassus._serve(plugin, f"{solver.__module__}:{solver.__qualname__}", socket)
