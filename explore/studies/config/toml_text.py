"""Read, parse and write the TOML text of a study file."""

import json
import os
import re
import stat
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from explore.base.errors import ConfigError, KeyPath, Problems
from explore.base.suggest import one_line
from explore.base.units.quantities import WrittenNumber
from explore.studies.config.key_lines import find_excess_depth, line_of, locate
from explore.studies.config.schema import MOST_PROBLEMS

_PLACE = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")
_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
#: Largest size of a study file: a hundred thousand values need at most two million bytes.
_LARGEST_FILE = 1 << 21
#: Number of characters of a line that are searched for usual mistakes.
_LONGEST_LINE = 1000
#: Patterns of usual mistakes in TOML, with advice.
_HINTS = (
    (re.compile(r"=\s*[+-]?[\d.]+(?:[eE][+-]?\d+)?\s*[A-Za-z°µ%]"), 'write a number with a unit in quotes, "60 rpm"'),
    (re.compile(r"=\s*[+-]?\d+,\d+\s*(?:#.*)?$"), "write decimals with a point, 541.7118"),
    (re.compile(r"=\s*(?!true\b|false\b|inf\b|nan\b)[A-Za-z]"), 'write a string in quotes, "sobol"'),
    (re.compile(r"\{[^}]*$"), "write a table in { } on one line, without a trailing comma"),
    (re.compile(r"^\s*[\w.-]+\s*:"), "assign values with =, not with a colon"),
)


def read_text(file: str, shorten: str = "write values as { start, stop, num }, or designs as a CSV table") -> str:
    """Read a text file; `shorten` says how one that is too large can be shorter. A `ConfigError` has one line."""
    try:
        status = Path(file).stat()
        # Reading a pipe or a device may never end.
        if stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode):
            with Path(file).open("rb") as stream:
                content = stream.read(_LARGEST_FILE + 1)
            if content.startswith(_HDF5_SIGNATURE):
                reason = "holds results, not a study; give the study, a .toml file"
            elif len(content) <= _LARGEST_FILE:
                # utf-8-sig: some editors on Windows write a byte-order mark.
                return content.decode("utf-8-sig")
            else:
                reason = f"has {status.st_size:,} bytes, but a file has at most {_LARGEST_FILE:,}; {shorten}"
        else:
            reason = "is a pipe or a device; save the study as a file first"
    except FileNotFoundError:
        reason = "no such file; `explore init` writes one to start from"
    except IsADirectoryError:
        reason = "is a folder, not a study file"
    except UnicodeDecodeError as error:
        reason = f"is not UTF-8 text (byte {error.start}); save it as UTF-8"
    except OSError as error:
        reason = f"cannot be read: {error.strerror}"
    except ValueError:
        reason = "is not a valid file name"
    raise ConfigError([f"{one_line(file)}: {reason}"])


def parse_toml(file: str, text: str) -> dict[str, Any]:
    """Parse a TOML text; a `ConfigError` has one line, ``file:line: reason``, for the first syntax error."""
    excess = find_excess_depth(text)
    if excess is not None:
        line, kind = excess
        raise ConfigError([f"{file}:{line}: {kind}; a study needs at most four"])
    try:
        return tomllib.loads(text, parse_float=WrittenNumber)
    except ValueError as error:  # TOMLDecodeError, or an integer of many thousand digits
        raise ConfigError([_syntax_error(file, text, str(error))]) from None


def toml_value(value: object) -> Any:
    """A value for TOML: arrays and sequences become lists, NumPy scalars Python numbers; keys of None are left out."""
    if isinstance(value, Mapping):
        return {str(key): toml_value(item) for key, item in value.items() if item is not None}
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    return [toml_value(item) for item in value] if isinstance(value, list | tuple | range) else value


def format_toml(sections: Mapping[str, Any]) -> str:
    """The text of a study file with these sections; every number is read back exactly."""
    keys = [f"{key} = {_format(value)}" for key, value in sections.items() if not isinstance(value, Mapping)]
    tables = [
        "\n".join([f"[{name}]", *(f"{key} = {_format(value)}" for key, value in table.items())])
        for name, table in _tables(sections)
        if table
    ]
    return "\n\n".join([*(["\n".join(keys)] if keys else []), *tables]) + "\n"


def _tables(sections: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """The sections that are tables, and in place of the tables of a linkage sections of their own."""
    for name, table in sections.items():
        if name == "linkage" and isinstance(table, Mapping):
            parts = {key: part for key, part in table.items() if isinstance(part, Mapping)}
            yield name, {key: value for key, value in table.items() if key not in parts}
            yield from ((f"{name}.{key}", part) for key, part in parts.items())
        elif isinstance(table, Mapping):
            yield name, table


def _format(value: object) -> str:
    """A value as TOML text."""
    if isinstance(value, str):
        # TOML escapes what JSON does, and the delete character.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_format(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_format, value)) + "]"
    # Other numbers, such as fractions, are floats in a study.
    return repr(value if isinstance(value, int) else float(value))  # type: ignore[arg-type]  # a number


def _syntax_error(file: str, text: str, message: str) -> str:
    """The message of `tomllib` after the file and line, with a hint for usual mistakes."""
    rows = text.split("\n")
    place = _PLACE.search(message)
    # Only the message about an integer of thousands of digits has no line.
    longest = max(range(len(rows)), key=lambda index: len(rows[index]))
    line = int(place[1] or len(rows)) if place else longest + 1
    column = f" (column {place[2]})" if place and place[2] else ""
    reason = _PLACE.sub("", message).replace("Cannot overwrite a value", "a key occurs twice; remove one of them")
    reason = re.sub(r"Cannot declare \(.*\) twice", "the table occurs twice; merge the two", reason, flags=re.DOTALL)
    row = rows[line - 1][:_LONGEST_LINE] if line <= len(rows) else ""
    hint = next((f"; {hint}" for pattern, hint in _HINTS if pattern.search(row)), "")
    return f"{file}:{line}: not TOML: {one_line(shorten(reason, 200))}{column}{hint}"


def dotted(path: KeyPath) -> str:
    """A key in TOML notation, without positions in lists."""
    parts = (part for part in path if isinstance(part, str))
    quoted = (part if re.fullmatch(r"[A-Za-z0-9_-]+", part) else json.dumps(part) for part in parts)
    return ".".join(shorten(part, 60) for part in quoted)


def locate_problems(file: str, text: str, problems: Problems) -> list[str]:
    """One line ``file:line: key: reason`` for each problem, in the order of the lines."""
    lines = locate(text.replace("\r\n", "\n")) if problems else {}
    located = sorted((line_of(lines, key), dotted(key), reason) for key, reason in problems)
    return [f"{file}:{line}: {key}: {reason}" for line, key, reason in dict.fromkeys(located)]


def shorten(text: str, length: int) -> str:
    """The text, cut to at most `length` characters."""
    return text if len(text) <= length else f"{text[: length - 1]}…"


def first_problems(prefix: str, problems: list[str], *, is_abandoned: bool = False) -> list[str]:
    """The first problems, and a line with the number of the others, "at least" that many if reading stopped early."""
    n_more = len(problems) - MOST_PROBLEMS
    more = [f"{prefix}and {'at least ' if is_abandoned else ''}{n_more:,} more"] if n_more > 0 else []
    return problems[:MOST_PROBLEMS] + more
