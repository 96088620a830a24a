"""The line of each key of a TOML text, which `tomllib` does not report, and a check of its depth before parsing."""

import bisect
import re
import tomllib

from explore.base.errors import KeyPath

_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_SPACES = re.compile(r"[ \t]*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_BARE_VALUE = re.compile(r"[^,\]}\n#]+")
_STRING = re.compile(
    # A string in three quotes may end with two quotes of its own. Possessive quantifiers keep the time linear.
    r'"""(?:[^"\\]++|\\.|"{1,2}(?!"))*+"{3,5}'
    r"|'''(?:[^']++|'{1,2}(?!'))*+'{3,5}"
    r'|"(?!"")(?:[^"\\\n]++|\\.)*+"'
    r"|'(?!'')[^'\n]*+'",
    re.DOTALL,
)
_TOKEN = re.compile(rf"{_STRING.pattern}|#[^\n]*|[][{{}}.,=\n\"']", re.DOTALL)
# The time and memory of `tomllib` grow with the square of both, and a study needs at most four.
#: Largest number of parts of a key.
MOST_PARTS = 16
#: Largest number of levels of tables and lists.
MOST_NESTED = 16
#: Length of the longest path whose line is recorded; messages name shorter ones.
_DEEPEST = 8


def find_excess_depth(text: str) -> tuple[int, str] | None:
    """Line (from 1) and kind of the first key or table that is too deep, or None. The text may be invalid TOML."""
    line, parts, nested = 1, 1, 0
    for match in _TOKEN.finditer(text):
        symbol = match[0]
        if symbol in ('"', "'"):  # an unclosed string is not TOML: `tomllib` stops there
            return None
        if symbol == ".":
            parts += 1
        else:
            line += symbol.count("\n")
            nested += (symbol in "[{") - (symbol in "]}")
            parts = parts if symbol[0] in "\"'" else 1
        if parts > MOST_PARTS:
            return line, f"a key of more than {MOST_PARTS} parts"
        if nested > MOST_NESTED:
            return line, f"more than {MOST_NESTED} nested tables or lists"
    return None


def locate(text: str) -> dict[KeyPath, int]:
    """Line (from 1) of every table, key and list item of a valid TOML text, by its path of keys and positions."""
    return _Scanner(text).document()


def line_of(lines: dict[KeyPath, int], path: KeyPath) -> int:
    """Line of a key, or of the nearest table around it that is in the text."""
    return next((lines[path[:n]] for n in range(len(path), 0, -1) if path[:n] in lines), 1)


class _Scanner:
    """Walks over a text that `tomllib` has accepted and that is therefore valid."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.position = 0
        self.lines: dict[KeyPath, int] = {}
        self.ends = [match.start() for match in re.finditer("\n", text)]

    def document(self) -> dict[KeyPath, int]:
        table: KeyPath = ()
        while self.skip(_BLANK):
            if self.text[self.position] == "[":
                table = self.header()
            else:
                self.pair(table)
        return self.lines

    def skip(self, pattern: re.Pattern[str]) -> bool:
        """Move past what the pattern matches; False at the end of the text."""
        self.take(pattern)
        return self.position < len(self.text)

    def take(self, pattern: re.Pattern[str]) -> str:
        match = pattern.match(self.text, self.position)
        if match is None:
            raise ValueError(f"not TOML at position {self.position}")
        self.position = match.end()
        return match[0]

    def note(self, path: KeyPath, start: int) -> None:
        """Record the line of a path where it first occurs, and of the tables around it that are new."""
        line = bisect.bisect_left(self.ends, start) + 1
        while path and path not in self.lines:
            self.lines[path] = line
            path = path[:-1]

    def header(self) -> KeyPath:
        start = self.position
        brackets = 2 if self.text.startswith("[[", self.position) else 1
        self.position += brackets
        path = self.key()
        self.position += brackets
        self.note(path[:_DEEPEST], start)
        if brackets == 1 and len(path) <= _DEEPEST:
            self.lines[path] = bisect.bisect_left(self.ends, start) + 1
        return path[:_DEEPEST]

    def key(self) -> KeyPath:
        parts: list[str] = []
        while True:
            self.skip(_SPACES)
            if self.text[self.position] in "\"'":
                parts.append(tomllib.loads(f"key = {self.take(_STRING)}")["key"])
            else:
                parts.append(self.take(_BARE_KEY))
            self.skip(_SPACES)
            if self.text[self.position] != ".":
                return tuple(parts)
            self.position += 1

    def pair(self, table: KeyPath) -> None:
        start = self.position
        path = (table + self.key())[:_DEEPEST]
        self.note(path, start)
        self.position += 1  # the equals sign
        self.skip(_SPACES)
        self.value(path)

    def value(self, path: KeyPath) -> None:
        first = self.text[self.position]
        if first in "\"'":
            self.take(_STRING)
        elif first == "[":
            self.items(path)
        elif first == "{":
            self.pairs(path)
        else:
            self.take(_BARE_VALUE)

    def items(self, path: KeyPath) -> None:
        """An array, from its opening bracket to its closing one."""
        self.position += 1
        index = 0
        while self.skip(_BLANK) and self.text[self.position] != "]":
            if self.text[self.position] == ",":
                self.position += 1
                continue
            item = (*path, index)[:_DEEPEST]
            self.note(item, self.position)
            self.value(item)
            index += 1
        self.position += 1

    def pairs(self, path: KeyPath) -> None:
        """An inline table, from its opening brace to its closing one."""
        self.position += 1
        while self.skip(_BLANK) and self.text[self.position] != "}":
            if self.text[self.position] == ",":
                self.position += 1
            else:
                self.pair(path)
        self.position += 1
