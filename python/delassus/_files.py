# SPDX-License-Identifier: BSD-3-Clause
"""Files that are written whole or not at all."""
from __future__ import annotations

import os
import tempfile
from typing import Union


def write_whole(path: Union[str, "os.PathLike[str]"], text: str) -> None:
    """A file with the text; one that is there is replaced whole or stays as it was."""
    path = os.fspath(path)
    handle, part = tempfile.mkstemp(dir=os.path.dirname(path) or ".", prefix=".delassus-")
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as file:
            file.write(text)
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(part, 0o666 & ~mask)  # mkstemp's files are for their owner only
        os.replace(part, path)
    except BaseException:
        os.unlink(part)
        raise
