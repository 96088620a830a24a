"""The page itself: its template filled, its parts from this package, written whole or not at all."""

from __future__ import annotations

import base64
import hashlib
import html
import os
import re
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

from explore.reporting.contents import Contents, pieces_of
from explore.store.creation import new_file
from explore.store.names import real_path

_PAGE = files("explore.reporting") / "page"
_PLACE = re.compile(r"\{\{([a-z_]+)\}\}")


def write_page(contents: Contents, path: Path) -> int:
    """Write a page and return its size in bytes.

    Raises
    ------
    ResultsError
        If the file cannot be written; nothing is left behind.
    """
    with new_file(real_path(path)) as unfinished, unfinished.open("w", encoding="utf-8", newline="\n") as file:
        for piece in _filled(contents):
            file.write(piece)
        file.flush()
        os.fsync(file.fileno())
    return path.stat().st_size


def _filled(contents: Contents) -> Iterator[str]:
    """The template with its places filled; what is filled in is not searched for places again."""
    script, style = _part("bundle/report.js"), _part("page.css")
    parts = {
        # A name of a file may hold bytes that are no text.
        "title": html.escape(f"{contents.study['name']}: report".encode(errors="replace").decode()),
        "script": script,
        "style": style,
        # The page runs this script and no other, and asks the network for nothing.
        "script_hash": _hash(script),
        "style_hash": _hash(style),
        "licences": html.escape(_part("bundle/THIRD_PARTY.txt")),
    }
    template = _part("template.html")
    end = 0
    for place in _PLACE.finditer(template):
        yield template[end : place.start()]
        if place[1] == "data":
            yield from pieces_of(contents)
        else:
            yield parts[place[1]]
        end = place.end()
    yield template[end:]


def _part(name: str) -> str:
    return (_PAGE / name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
