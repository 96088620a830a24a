"""Lines of the keys of a TOML text, which `tomllib` does not tell."""

from __future__ import annotations

import bisect
import re
import tomllib

Path = tuple[str | int, ...]

_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_SPACES = re.compile(r"[ \t]*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_BARE_VALUE = re.compile(r"[^,\]}\n#]+")
_TEXT = re.compile(
    # Three quotes: the text may end with up to two quotes of its own.
    r'"""(?:[^\\]|\\.)*?"""(?:"{0,2})'
    r"|'''.*?'''(?:'{0,2})"
    r'|"(?:[^"\\\n]|\\.)*"'
    r"|'[^'\n]*'",
    re.DOTALL,
)


def locate(text: str) -> dict[Path, int]:
    """Line (from 1) of every table, key and list item of a valid TOML text, by its path of keys and positions."""
    return _Scanner(text).document()


def line_of(lines: dict[Path, int], path: Path) -> int:
    """Line of a key, or of the nearest table around it that is in the text."""
    return next((lines[path[:n]] for n in range(len(path), 0, -1) if path[:n] in lines), 1)


class _Scanner:
    """Walks over a text that `tomllib` has accepted, so that nothing has to be checked again."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.lines: dict[Path, int] = {}
        self.ends = [match.start() for match in re.finditer("\n", text)]

    def document(self) -> dict[Path, int]:
        table: Path = ()
        while self.skip(_BLANK):
            if self.text[self.at] == "[":
                table = self.header()
            else:
                self.pair(table)
        return self.lines

    def skip(self, pattern: re.Pattern[str]) -> bool:
        """Move past what the pattern matches; False at the end of the text."""
        self.take(pattern)
        return self.at < len(self.text)

    def take(self, pattern: re.Pattern[str]) -> str:
        match = pattern.match(self.text, self.at)
        if match is None:
            raise ValueError(f"not TOML at position {self.at}")
        self.at = match.end()
        return match[0]

    def note(self, path: Path, start: int) -> None:
        """Keep the line of a path where it first occurs, and of the tables around it."""
        line = bisect.bisect_left(self.ends, start) + 1
        for n in range(1, len(path) + 1):
            self.lines.setdefault(path[:n], line)

    def header(self) -> Path:
        start = self.at
        brackets = 2 if self.text.startswith("[[", self.at) else 1
        self.at += brackets
        path = self.key()
        self.at += brackets
        self.note(path, start)
        self.lines[path] = self.lines[path] if brackets == 2 else bisect.bisect_left(self.ends, start) + 1
        return path

    def key(self) -> Path:
        parts: list[str] = []
        while True:
            self.skip(_SPACES)
            if self.text[self.at] in "\"'":
                parts.append(tomllib.loads(f"key = {self.take(_TEXT)}")["key"])
            else:
                parts.append(self.take(_BARE_KEY))
            self.skip(_SPACES)
            if self.text[self.at] != ".":
                return tuple(parts)
            self.at += 1

    def pair(self, table: Path) -> None:
        start = self.at
        path = table + self.key()
        self.note(path, start)
        self.at += 1  # the equals sign
        self.skip(_SPACES)
        self.value(path)

    def value(self, path: Path) -> None:
        first = self.text[self.at]
        if first in "\"'":
            self.take(_TEXT)
        elif first == "[":
            self.items(path)
        elif first == "{":
            self.pairs(path)
        else:
            self.take(_BARE_VALUE)

    def items(self, path: Path) -> None:
        """An array, from its opening bracket to its closing one."""
        self.at += 1
        position = 0
        while self.skip(_BLANK) and self.text[self.at] != "]":
            if self.text[self.at] == ",":
                self.at += 1
                continue
            self.note((*path, position), self.at)
            self.value((*path, position))
            position += 1
        self.at += 1

    def pairs(self, path: Path) -> None:
        """An inline table, from its opening brace to its closing one."""
        self.at += 1
        while self.skip(_BLANK) and self.text[self.at] != "}":
            if self.text[self.at] == ",":
                self.at += 1
            else:
                self.pair(path)
        self.at += 1
