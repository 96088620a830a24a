"""The page of a report: the template, filled and written."""

import base64
import hashlib
import html
import re
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

from explore.figures.reporting.contents import Contents, data_elements
from explore.figures.reporting.figures import figure_elements
from explore.results.store.outputs import new_output

_PAGE = files("explore.figures.reporting") / "page"
_PLACEHOLDER = re.compile(r"\{\{([a-z_]+)\}\}")


def write_page(contents: Contents, path: Path) -> int:
    """Write a page and return its size in bytes; `ResultsError` if that fails, and no partial file stays."""
    with new_output(path) as unfinished, unfinished.open("w", encoding="utf-8", newline="\n") as file:
        for piece in _fill_template(contents):
            file.write(piece)
    return path.stat().st_size


def _fill_template(contents: Contents) -> Iterator[str]:
    """The page in pieces; placeholders within inserted texts stay as they are."""
    script, style = _read_part("bundle/report.js"), _read_part("page.css")
    parts = {
        # A file name may hold bytes that are not UTF-8.
        "title": html.escape(f"{contents.study['name']}: report".encode(errors="replace").decode()),
        "kernel": contents.kernel,
        "script": script,
        "style": style,
        # The content security policy allows these scripts and this style only, and no network.
        "kernel_hash": _hash(contents.kernel),
        "script_hash": _hash(script),
        "style_hash": _hash(style),
        "licences": html.escape(_read_part("bundle/THIRD_PARTY.txt")),
    }
    template = _read_part("template.html")
    end = 0
    for match in _PLACEHOLDER.finditer(template):
        yield template[end : match.start()]
        if match[1] == "data":
            yield from data_elements(contents)
        elif match[1] == "figures":
            yield from figure_elements(contents.figures)
        else:
            yield parts[match[1]]
        end = match.end()
    yield template[end:]


def _read_part(name: str) -> str:
    return (_PAGE / name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
