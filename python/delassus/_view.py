# SPDX-License-Identifier: BSD-3-Clause
"""Pages of HTML that are shown in a notebook."""
from __future__ import annotations

import os
from html import escape
from typing import Union

from ._files import write_whole


class View:
    """A page for a browser, whole in one text: shown in a frame by Jupyter, written to a file by write()."""

    def __init__(self, html: str, height: int = 640):
        self.html = html  #: the page
        self.height = height  #: of the frame in a notebook, pixels

    def write(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """Write the page to a file; one that is there is replaced whole or stays as it was."""
        write_whole(path, self.html)

    def _repr_html_(self) -> str:
        # Links within the page (#…) would lead to the notebook without the base.
        page = self.html.replace("<head>", '<head><base href="about:srcdoc">', 1)
        return (f'<iframe srcdoc="{escape(page)}" style="width: 100%; height: {self.height}px; border: 0" '
                'sandbox="allow-scripts" title="Delassus"></iframe>')

    def __repr__(self) -> str:
        return f"<delassus.View: {len(self.html) / 1e6:.1f} MB of HTML; write(path) puts it into a file>"
