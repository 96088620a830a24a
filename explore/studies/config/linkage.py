"""Linkages that a user describes by a table: in Python, in a file of their own, in a study, and in results."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Mapping
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from explore.base.errors import ConfigError, KeyPath, Problems, ResultsError
from explore.mechanisms.linkages.table import PREFIX, LinkageTable
from explore.mechanisms.registry import MECHANISMS
from explore.model.mechanism import Mechanism
from explore.studies.config import toml_text
from explore.studies.config.key_lines import line_of, locate
from explore.studies.linkages.content import content_of
from explore.studies.linkages.parameters import note_unused
from explore.studies.linkages.reading import read_table
from explore.studies.linkages.structure import SECTION
from explore.studies.request.names import find_mechanism

if TYPE_CHECKING:
    from explore.results.store.results import Results


@dataclass(frozen=True, init=False, repr=False)
class Linkage:
    """A planar linkage that a table describes; it stands wherever the name of a mechanism does.

    Linkages are immutable, can be pickled, and are equal if their tables are.

    Parameters
    ----------
    content
        The keys of the section [linkage] of a study: `driver`, `output`, `frame`, `links`, `slots`, `slides`, `branch`
        or `sketch`, and `parameters`. Or all of a file: this section under "linkage", and "parameters".
    parameters
        Values of parameters, as of a study, for which a sketch is drawn: of a list the first counts, of a range its
        middle.

    Attributes
    ----------
    table
        The table as data, with the side of each joint.

    Raises
    ------
    ConfigError
        With one line ``key: reason; suggestion`` for each of the first twenty problems, and the number of the others.

    Examples
    --------
    >>> linkage = Linkage(
    ...     {
    ...         "driver": "crank",
    ...         "frame": {"O": [0, 0], "C": ["r4", 0]},
    ...         "links": {"crank": {"O": 0, "A": "r1"}, "rod": {"A": 0, "B": "r2"}, "rocker": {"C": 0, "B": "r3"}},
    ...         "branch": {"B": "left of A C"},
    ...     }
    ... )
    >>> linkage
    Linkage(links=['crank', 'rod', 'rocker'], points=['O', 'C', 'A', 'B'], parameters=['r4', 'r1', 'r2', 'r3'])
    """

    table: LinkageTable

    def __init__(self, content: Mapping[str, Any], *, parameters: Mapping[str, Any] | None = None) -> None:
        sections = toml_text.toml_value(content)
        if isinstance(sections, Mapping) and SECTION in sections and "links" not in sections:
            parameters = sections.get("parameters") if parameters is None else parameters
            sections = sections[SECTION]
        problems: Problems = []
        values = toml_text.toml_value({} if parameters is None else parameters)
        table = read_table(sections, values, problems, Path())
        if table is not None:
            note_unused(table.parameters, values, problems)
        if problems or table is None:
            lines = [f"{toml_text.dotted(key)}: {reason}" for key, reason in problems]
            raise ConfigError(toml_text.first_problems("", list(dict.fromkeys(lines))))
        object.__setattr__(self, "table", table)

    @property
    def content(self) -> dict[str, Any]:
        """The section [linkage] of a study that describes the same table, with the side of each joint in words."""
        return content_of(self.table)

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism of the table: its signals, metrics and statuses, as `explore mechanisms FILE` lists them."""
        return MECHANISMS.of_table(self.table)

    def to_toml(self) -> str:
        """The text of a file from which `load_linkage` reads an equal linkage."""
        return toml_text.format_toml({SECTION: self.content})

    def __repr__(self) -> str:
        table = self.table
        names = [[link.name for link in table.links], list(table.points), [p.name for p in table.parameters]]
        fields = zip(("links", "points", "parameters"), names, strict=True)
        return f"Linkage({', '.join(f'{name}={value}' for name, value in fields)})"

    def _repr_html_(self) -> str:
        """For notebooks: the text of the table."""
        return f"<p><b>linkage</b> of {len(self.table.links)} links</p><pre>{escape(self.to_toml())}</pre>"


def make_linkage(table: LinkageTable) -> Linkage:
    """The linkage of a table that was read without problems."""
    linkage = object.__new__(Linkage)
    object.__setattr__(linkage, "table", table)
    return linkage


def load_linkage(path: str | os.PathLike[str]) -> Linkage:
    """Read the linkage of a TOML file.

    Parameters
    ----------
    path
        A study with [linkage], or a file with this section alone, and with [parameters] if it has a sketch.

    Raises
    ------
    ConfigError
        With one line ``file:line: key: reason; suggestion`` for each problem; of these the first twenty and the number
        of the others.
    """
    file = os.fspath(path)
    text = toml_text.read_text(file)
    sections = toml_text.parse_toml(file, text)
    named = sections.get(SECTION)
    if isinstance(named, str):
        file_problems: list[str] = []
        problems: Problems = []
        linkage = read_linkage(named, _values(sections), Path(file).parent, problems, file_problems)
        lines = toml_text.first_problems(f"{file}: ", toml_text.locate_problems(file, text, problems)) + file_problems
        if linkage is None or lines:
            raise ConfigError(lines)
        return linkage
    return _linkage_of_text(file, text, sections)


def _linkage_of_text(file: str, text: str, sections: Mapping[str, Any]) -> Linkage:
    problems: Problems = []
    if SECTION not in sections:
        problems.append(((SECTION,), "is missing; describe the linkage in the section [linkage]"))
    values = _values(sections)
    table = None if problems else read_table(sections[SECTION], values, problems, Path(file).parent)
    if table is not None:
        note_unused(table.parameters, values, problems)
    if problems or table is None:
        raise ConfigError(toml_text.first_problems(f"{file}: ", toml_text.locate_problems(file, text, problems)))
    return make_linkage(table)


def _values(sections: Mapping[str, Any]) -> Mapping[str, Any]:
    entries = sections.get("parameters")
    return entries if isinstance(entries, Mapping) else {}


def read_linkage(
    entry: object, entries: Mapping[str, Any], folder: Path, problems: Problems, file_problems: list[str]
) -> Linkage | None:
    """The linkage of a study, in its text or in a file that it names, valid only without problems.

    `entry` is the section [linkage], or the name of a file in `folder` that has it, and `entries` the section
    [parameters] of the study; a sketch in a file with such a section is of the values there. The problems of both are
    appended.
    """
    key: KeyPath = (SECTION,)
    if entry is None:
        reason = 'is missing; describe the linkage in the section [linkage], or name its file, linkage = "shaper.toml"'
        problems.append((key, reason))
        return None
    table = _read_file(entry, entries, folder, problems, file_problems) if isinstance(entry, str) else read_table(
        entry, entries, problems, folder
    )  # fmt: skip
    if table is None:
        return None
    note_unused(table.parameters, entries, problems)
    return make_linkage(table)


def _read_file(
    name: str, entries: Mapping[str, Any], folder: Path, problems: Problems, file_problems: list[str]
) -> LinkageTable | None:
    """The table of a file that a study names; None after its problems are appended."""
    file = os.fspath(folder / name)
    try:
        text = toml_text.read_text(file)
    except ConfigError as error:
        problems.append(((SECTION,), str(error)))
        return None
    try:
        sections = toml_text.parse_toml(file, text)
        if "parameters" in sections or isinstance(sections.get(SECTION), str):
            return _linkage_of_text(file, text, sections).table
        found: Problems = []
        table = None
        if SECTION in sections:
            table = read_table(sections[SECTION], entries, found, Path(file).parent)
        else:
            found.append(((SECTION,), "is missing; describe the linkage in the section [linkage]"))
    except ConfigError as error:
        file_problems += error.problems
        return None
    # The values of a sketch are those of the study.
    problems += [(key, reason) for key, reason in found if key[0] == "parameters"]
    own = [(key, reason) for key, reason in found if key[0] != "parameters"]
    file_problems += toml_text.first_problems(f"{file}: ", toml_text.locate_problems(file, text, own))
    return table


def inlined(text: str, linkage: Linkage | None) -> str:
    """The text of a study, with its table, and points of curves, in place of the names of the files that have them."""
    own = tomllib.loads(text)
    lines = text.replace("\r\n", "\n").split("\n")
    if linkage is None:
        return text
    if isinstance(own.get(SECTION), str):
        wanted = {**own, SECTION: linkage.content}
        del lines[line_of(locate("\n".join(lines)), (SECTION,)) - 1]
        written = "\n".join(lines).rstrip() + f"\n\n{linkage.to_toml()}"
    elif curves := curve_files(own):
        wanted, written = deepcopy(own), "\n".join(lines)
        for name, file in curves.items():
            points = linkage.content["loads"]["curves"][name]["points"]
            del wanted[SECTION]["loads"]["curves"][name]["file"]
            wanted[SECTION]["loads"]["curves"][name]["points"] = points
            written = re.sub(rf"\bfile\s*=\s*([\"']){re.escape(file)}\1", f"points = {points}", written)
    else:
        return text
    with suppress(tomllib.TOMLDecodeError):
        if tomllib.loads(written) == wanted:
            return written
    return toml_text.format_toml(wanted)


def curve_files(sections: Mapping[str, Any]) -> dict[str, str]:
    """The files that curves of a study name, by the names of the curves."""
    part: object = sections
    for key in (SECTION, "loads", "curves"):
        part = part.get(key) if isinstance(part, Mapping) else None
    entries = part.items() if isinstance(part, Mapping) else ()
    return {name: str(entry["file"]) for name, entry in entries if isinstance(entry, Mapping) and "file" in entry}


def mechanism_of(results: Results) -> Mechanism:
    """The mechanism of results, with their points and their target; its name is known while it is in use.

    Raises `RequestError` if this version does not have it, and `ResultsError` if the study of the results does not
    describe their linkage.
    """
    return find_mechanism(mechanism_source(results), results.points, results.target)


def mechanism_source(results: Results) -> str | Linkage:
    """The name of the mechanism of results, or the linkage that their study describes; errors as of `mechanism_of`."""
    if not results.mechanism.startswith(PREFIX):
        return results.mechanism
    problems: Problems = []
    sections = results.sections
    table = read_table(sections.get(SECTION), _values(sections), problems)
    if table is None or problems:
        reason = next((f"{toml_text.dotted(key)}: {reason}" for key, reason in problems), "")
        raise ResultsError(f"{results.path} is damaged: its study does not describe its linkage: {reason}")
    linkage = make_linkage(table)
    if linkage.mechanism.name != results.mechanism:
        raise ResultsError(
            f"{results.path} is damaged: its study describes {linkage.mechanism.name}, not {results.mechanism}"
        )
    return linkage


def mechanism_entries(source: str | Linkage) -> dict[str, object]:
    """What a study says of its mechanism; of a linkage the side of each joint in words, since a sketch is of others."""
    return {"mechanism": "linkage", "linkage": source.content} if isinstance(source, Linkage) else {"mechanism": source}
