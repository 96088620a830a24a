"""Conditions on columns as people write them: ``swing_angle > 20 and (time_ratio < 1.3 or not cv > 0.5)``.

A grammar of our own, in which nothing but comparisons can be said, so that a text from anywhere runs no code:

* any: all ("or" all)*
* all: denial ("and" denial)*
* denial: "not"* ("(" any ")" | comparison)
* comparison: operand (sign operand)+, where ``a < b < c`` is ``a < b and b < c``
* operand: the name of a column or a number
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.errors import RequestError
from explore.suggest import shown, suggestion
from explore.vocabulary import Columns

Mask = npt.NDArray[np.bool_]
_Test = Callable[[Columns], Mask]
_Operand = Callable[[Columns], Any]

_TOKEN = re.compile(
    r"\s*(?:(?P<number>[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)(?!\w)"
    r"|(?P<name>[^\W\d]\w*)|(?P<sign><=|>=|==|!=|<|>)|(?P<bracket>[()])|(?P<end>$))"
)
_SIGNS: dict[str, Callable[[Any, Any], Any]] = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq, "!=": operator.ne,
}  # fmt: skip
_WORDS = ("and", "or", "not")
#: What other languages write, and what is written here.
_INSTEAD = (("=", "=="), (",", "0.5, not 0,5"), ("&", "and"), ("|", "or"), ("!", "not or !="), ("~", "not"))
#: Brackets within brackets; far below what Python's own stack bears.
_DEEPEST = 50
_WANTED = "a comparison is wanted here, such as swing_angle > 20"


@dataclass(frozen=True)
class Condition:
    """A condition on designs.

    Attributes
    ----------
    text
        As written.
    names
        The columns that it uses.
    test
        From columns of shape (n,) to whether each design meets the condition. A comparison with an undefined value
        (NaN) is false, that by ``!=`` too.
    """

    text: str
    names: tuple[str, ...]
    test: _Test


def parse_condition(text: str, columns: Sequence[str]) -> Condition:
    """A condition from its text.

    Parameters
    ----------
    columns
        The columns there are.

    Raises
    ------
    RequestError
        With the character at which the text goes wrong.
    """
    return _Parser(text, columns).parse()


class _Parser:
    """Recursive descent over the tokens; `_at` is the one that comes next."""

    def __init__(self, text: str, columns: Sequence[str]) -> None:
        self._text, self._columns = text, columns
        self._names: dict[str, None] = {}
        self._tokens, self._at, self._depth = self._split(), 0, 0

    def parse(self) -> Condition:
        test = self._any()
        kind, word, _ = self._tokens[self._at]
        if kind != "end":
            raise self._wrong(self._beyond(kind, word))
        return Condition(self._text, tuple(self._names), test)

    def _beyond(self, kind: str, word: str) -> str:
        """What is wrong with a token where the condition might have ended."""
        if word == ")":
            return "this closing bracket opens nowhere"
        if kind == "name" and word.lower() in _WORDS:
            return f"write {word.lower()} in small letters"
        if kind == "name" and word not in self._columns and self._tokens[self._at - 1][0] == "number":
            return f"{shown(word)} is one too many; numbers are in the column's unit, without it"
        return "'and' or 'or' is wanted here"

    def _split(self) -> list[tuple[str, str, int]]:
        """The tokens as (kind, text, place)."""
        tokens: list[tuple[str, str, int]] = []
        place = 0
        while not tokens or tokens[-1][0] != "end":
            match = _TOKEN.match(self._text, place)
            if match is None:
                place += len(self._text[place:]) - len(self._text[place:].lstrip())
                raise self._wrong(_advice(self._text[place:]), place)
            kind = str(match.lastgroup)
            tokens.append((kind, match[kind], match.start(kind)))
            place = match.end()
        return tokens

    def _wrong(self, reason: str, place: int | None = None) -> RequestError:
        place = self._tokens[self._at][2] if place is None else place
        where = f"character {place + 1}" if place < len(self._text.rstrip()) else "the end"
        return RequestError(f"where: at {where}: {reason}")

    def _take(self, *words: str) -> bool:
        """Whether the next token is one of these words or brackets; if so it is passed."""
        kind, word, _ = self._tokens[self._at]
        found = kind in ("name", "bracket") and word in words
        self._at += found
        return found

    def _any(self) -> _Test:
        parts = [self._all()]
        while self._take("or"):
            parts.append(self._all())
        return _joined(parts, np.logical_or)

    def _all(self) -> _Test:
        parts = [self._denial()]
        while self._take("and"):
            parts.append(self._denial())
        return _joined(parts, np.logical_and)

    def _denial(self) -> _Test:
        denied = False
        while self._take("not"):
            denied = not denied
        test = self._bracket() if self._take("(") else self._comparison()
        return (lambda columns: ~test(columns)) if denied else test

    def _bracket(self) -> _Test:
        self._depth += 1
        if self._depth > _DEEPEST:
            raise self._wrong(f"more than {_DEEPEST} brackets within each other")
        test = self._any()
        if not self._take(")"):
            raise self._wrong("a closing bracket is missing")
        self._depth -= 1
        return test

    def _comparison(self) -> _Test:
        operands = [self._operand()]
        signs = []
        while self._tokens[self._at][0] == "sign":
            signs.append(_SIGNS[self._tokens[self._at][1]])
            self._at += 1
            operands.append(self._operand())
        if not signs:
            raise self._wrong("a comparison is wanted here: < <= > >= == or != and what to compare with")
        pairs = zip(signs, operands, operands[1:], strict=False)
        return _joined([_compared(*pair) for pair in pairs], np.logical_and)

    def _operand(self) -> _Operand:
        kind, word, place = self._tokens[self._at]
        if kind == "number":
            value = float(word)
            if not math.isfinite(value):
                raise self._wrong("the number is too large")
            self._at += 1
            return lambda _: value
        if kind != "name" or word in _WORDS:
            raise self._wrong(_WANTED)
        if word not in self._columns and word.lower() in _WORDS:
            raise self._wrong(f"write {word.lower()} in small letters")
        if word not in self._columns:
            raise self._wrong(f"no column {shown(word)}; {suggestion(word, self._columns)}", place)
        self._at += 1
        self._names[word] = None
        return lambda columns: columns[word]


def _compared(sign: Callable[[Any, Any], Any], left: _Operand, right: _Operand) -> _Test:
    def test(columns: Columns) -> Mask:
        a, b = left(columns), right(columns)
        # NaN differs from everything in floating point; nothing can be said of an undefined value, not that either.
        met = sign(a, b) & (a == a) & (b == b)
        return np.broadcast_to(met, len(next(iter(columns.values()))))

    return test


def _joined(parts: Sequence[_Test], join: Callable[[Any, Any], Any]) -> _Test:
    if len(parts) == 1:
        return parts[0]

    def test(columns: Columns) -> Mask:
        mask = parts[0](columns)
        for part in parts[1:]:
            mask = join(mask, part(columns))
        return mask

    return test


def _advice(rest: str) -> str:
    """What to write in place of what is no token."""
    for wrong, right in _INSTEAD:
        if rest.startswith(wrong):
            return f"{shown(wrong)} is not known; write {right}"
    if rest[0].isdigit():
        word = re.match(r"\w*", rest)
        return f"{shown(word[0] if word else rest)} is no number; numbers are in the column's unit, without it"
    return f"{shown(rest[0])} has no meaning; a condition has names of columns, numbers, comparisons, and, or, not, ()"
