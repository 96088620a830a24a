"""The TOML text of a study file: reading it, parsing it, and what to say when that fails."""

from __future__ import annotations

import json
import re
import stat
import tomllib
from pathlib import Path
from typing import Any

from explore.config.locate import Path as KeyPath
from explore.config.locate import locate
from explore.errors import ConfigError

_PLACE = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")
#: Bytes of a study file. One with ten thousand values has some hundred kB.
_LARGEST_FILE = 1 << 24
# What people write that is no TOML, and what to tell them.
_HINTS = (
    (re.compile(r"=\s*[+-]?[\d.]+(?:[eE][+-]?\d+)?\s*[A-Za-z°µ%]"), 'a number with a unit stands in quotes, "60 rpm"'),
    (re.compile(r"=\s*[+-]?\d+,\d+\s*(?:#.*)?$"), "decimals are written with a point, 541.7118"),
    (re.compile(r"=\s*(?!true\b|false\b|inf\b|nan\b)[A-Za-z]"), 'text stands in quotes, "sobol"'),
    (re.compile(r"\{[^}]*$"), "a table in { } stands on one line, without a comma at its end"),
    (re.compile(r"^\s*[\w.-]+\s*:"), "a value is given with =, not with a colon"),
)


def read_text(file: str) -> str:
    """Content of a text file.

    Raises
    ------
    ConfigError
        One line, when it is not there or cannot be read.
    """
    try:
        status = Path(file).stat()
        # A pipe may never end, nor does a device.
        if stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode):
            if status.st_size <= _LARGEST_FILE:
                # utf-8-sig: some editors on Windows begin a file with a byte-order mark.
                return Path(file).read_bytes().decode("utf-8-sig")
            reason = f"has {status.st_size:,} bytes, too many for a study file; name another file"
        else:
            reason = "is a pipe or a device; save the study as a file first"
    except FileNotFoundError:
        reason = "no such file; `explore init` writes one to start from"
    except IsADirectoryError:
        reason = "is a folder, not a study file"
    except UnicodeDecodeError as error:
        reason = f"is not a UTF-8 text (byte {error.start}); save it as UTF-8"
    except OSError as error:
        reason = f"cannot be read: {error.strerror}"
    except ValueError:
        reason = "is not a file name"
    raise ConfigError([f"{one_line(file)}: {reason}"])


def parse(file: str, text: str) -> tuple[dict[str, Any], dict[KeyPath, int]]:
    """Content of a TOML text, and the lines of its keys.

    Raises
    ------
    ConfigError
        One line ``file:line: reason`` for the first mistake: what follows it cannot be understood.
    """
    try:
        return tomllib.loads(text), locate(text.replace("\r\n", "\n"))
    except RecursionError:
        raise ConfigError([f"{file}:1: not TOML: tables or lists nested too deeply"]) from None
    except ValueError as error:  # TOMLDecodeError, or an integer of many thousand digits
        raise ConfigError([_syntax_error(file, text, str(error))]) from None


def _syntax_error(file: str, text: str, message: str) -> str:
    """The message of `tomllib` with its place in front and, for usual mistakes, a hint."""
    rows = text.split("\n")
    place = _PLACE.search(message)
    # Only an integer of thousands of digits has no place.
    longest = max(range(len(rows)), key=lambda row: len(rows[row]))
    line = int(place[1] or len(rows)) if place else longest + 1
    column = f" (column {place[2]})" if place and place[2] else ""
    reason = _PLACE.sub("", message).replace("Cannot overwrite a value", "a key is given twice; remove one of them")
    reason = re.sub(r"Cannot declare \(.*\) twice", "the table is given twice; join the two", reason, flags=re.DOTALL)
    written = rows[line - 1] if line <= len(rows) else ""
    hint = next((f"; {hint}" for pattern, hint in _HINTS if pattern.search(written)), "")
    return f"{file}:{line}: not TOML: {one_line(reason)}{column}{hint}"


def dotted(path: KeyPath) -> str:
    """A key as it is written in TOML, positions in lists left out."""
    parts = (part for part in path if isinstance(part, str))
    return ".".join(part if re.fullmatch(r"[A-Za-z0-9_-]+", part) else json.dumps(part) for part in parts)


def one_line(text: str) -> str:
    """The text without what would break or hide a line of a message."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
