# SPDX-License-Identifier: BSD-3-Clause
"""The command `delassus`, in a process of its own."""
from __future__ import annotations

import os
import shutil
import signal
import subprocess
import tempfile
from pathlib import Path
from typing import Sequence, Tuple

from ._delassus import InputError

#: What an interrupted command may take to write down what it has, s.
_GRACE = 10.0


def find_command() -> str:
    """That of DELASSUS_COMMAND, of this package's installation, or of the path."""
    chosen = os.environ.get("DELASSUS_COMMAND")
    if chosen:
        return chosen
    package = Path(__file__).resolve().parent
    for folder in (package, *package.parents[:4]):  # pip has it in the package; else it is in PREFIX/bin
        if os.access(folder / "bin" / "delassus", os.X_OK):
            return str(folder / "bin" / "delassus")
    found = shutil.which("delassus")
    if not found:
        raise InputError("the command delassus was not found: install the package delassus, build the target "
                         "delassus_command, or name it in the environment variable DELASSUS_COMMAND")
    return found


def run_command(arguments: Sequence[str]) -> Tuple[int, str]:
    """The exit code and what it printed for errors. Ctrl-C ends it, with all processes that it started, and raises
    KeyboardInterrupt when it has ended."""
    with tempfile.TemporaryFile(mode="w+", encoding="utf-8", errors="replace") as errors:
        # In a session of its own, a terminal's Ctrl-C reaches it through here only, and it may end in order.
        process = subprocess.Popen([find_command(), *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                   stderr=errors, start_new_session=True)
        try:
            code = process.wait()
        except BaseException:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(_GRACE)
            except subprocess.TimeoutExpired:
                pass
            raise
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        errors.seek(0)
        return code, errors.read()
