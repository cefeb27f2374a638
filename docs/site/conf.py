# SPDX-License-Identifier: BSD-3-Clause
"""Sphinx's settings for the site (scripts/build-site)."""
import re

import delassus

project = "Delassus"
author = "the authors of Delassus"
version = release = delassus.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc"]
root_doc = "index"
html_theme = "furo"
html_title = f"Delassus {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_copyright = False
html_show_sphinx = False
smartquotes = False  # texts have their own, and options begin with --
myst_heading_anchors = 6
suppress_warnings = ["myst.header"]  # a page may begin with sections of the second level
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # docstrings say shapes and units as well
autodoc_inherit_docstrings = True


ITEM = re.compile(r"([\w.*(][^:]*?) : (.*)")


def escaped(text):
    """Docstrings are plain text, in which |x|, x* and x_ are no markup."""
    return re.sub(r"([\\*|`_])", r"\\\1", text)


def items(lines):
    """'name : text' with lines that go on, as bullets."""
    result = []
    for line in lines:
        match = ITEM.fullmatch(line)
        if match:
            result.append(f"- **{escaped(match[1])}**: {escaped(match[2])}")
        else:
            if line.startswith(" ") and line.strip()[0].isupper() and result[-1][-1].isalnum():
                result[-1] += "."  # after a type
            result.append("  " + escaped(line.strip()))
    return result


def as_rst(app, what, name, thing, options, lines):  # pylint: disable=unused-argument
    """The docstrings of this package: paragraphs, items 'name : text', headings underlined by hyphens, examples, and
    indented formulas."""
    result, listed = [], False
    for paragraph in "\n".join(lines).strip("\n").split("\n\n"):
        block = [line for line in paragraph.split("\n") if line.strip()]
        if len(block) > 1 and set(block[1].strip()) == {"-"}:
            result += [f"**{block[0].strip()}**", ""]
            block = block[2:]
        if not block:
            continue
        is_list = ITEM.fullmatch(block[0]) is not None
        if block[0].startswith(">>>"):
            result += block
        elif is_list:
            result += items(block)
        elif all(line.startswith(" ") for line in block):
            result += ["  " + escaped(line.strip()) for line in block] if listed else ["::", "", *block]
        else:
            result += [escaped(line.strip()) for line in block]
        listed = is_list
        result.append("")
    lines[:] = result


def public(app, what, name, thing, options, signature, returned):  # pylint: disable=unused-argument
    """Signatures without the extension module's own names."""
    def short(text):
        text = re.sub(r"delassus\._delassus\.|numpy\.(?=ndarray|float64)", "", text or "")
        return re.sub(r"^\(self: \w+(, )?", "(", text)

    return short(signature), short(returned)


def setup(app):
    """Sphinx calls it."""
    app.connect("autodoc-process-signature", public)
    app.connect("autodoc-process-docstring", as_rst)
