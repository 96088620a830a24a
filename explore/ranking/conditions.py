"""Conditions on columns, such as ``20 < swing_angle <= 40 and (time_ratio < 1.3 or not cv > 0.5)``.

The grammar has comparisons only, so a text from an untrusted source runs no code:

* disjunction: conjunction ("or" conjunction)*
* conjunction: negation ("and" negation)*
* negation: "not"* ("(" disjunction ")" | comparison)
* comparison: operand (sign operand)+, where ``a < b < c`` means ``a < b and b < c``
* operand: the name of a column or a number
"""

# `ast.parse` with a list of allowed nodes would replace the descent only, a third of this file. It takes the column
# 'ſ' for 's', refuses a column 'lambda', ignores what follows '#', warns at '1or', and in '(a < 20 deg)' points at 'a';
# the tokens below would still be needed to exclude all that.

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.grammar import NAME, NUMBER, Descent
from explore.model.columns import Arrays
from explore.suggest import format_value, suggestion

Mask = npt.NDArray[np.bool_]
_Test = Callable[[Arrays], Mask]
_Operand = Callable[[Arrays], Any]

_SIGNS: dict[str, Callable[[Any, Any], Any]] = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq, "!=": operator.ne,
}  # fmt: skip
_KEYWORDS = ("and", "or", "not")
#: Notations of other languages, and what to write here.
_REPLACEMENTS = (("=", "=="), (",", "0.5, not 0,5"), ("&", "and"), ("|", "or"), ("!", "not or !="), ("~", "not"))
_UNIT_HINT = "write numbers in the column's unit, without the unit"
_EXPECTED_COMPARISON = "expected a comparison here, such as swing_angle > 20"


@dataclass(frozen=True)
class Condition:
    """A condition on designs.

    Attributes
    ----------
    text
        The condition as written.
    names
        Columns that the condition uses.
    test
        Takes columns of shape (n,) and returns which designs meet the condition, (n,). A comparison with an undefined
        value (NaN) is false, including ``!=``.
    """

    text: str
    names: tuple[str, ...]
    test: _Test


def parse_condition(text: str, columns: Sequence[str]) -> Condition:
    """Parse a condition.

    Parameters
    ----------
    text
        The condition, in the grammar of this module.
    columns
        Names that the condition may use.

    Raises
    ------
    RequestError
        If the text is not a condition; the message has the position of the first error.
    """
    return _Parser(text, columns).parse()


class _Parser(Descent):
    _PATTERN = re.compile(
        rf"\s*(?:(?P<number>[+-]?{NUMBER})(?!\w)|(?P<name>{NAME})|(?P<sign><=|>=|==|!=|<|>)|(?P<bracket>[()])|(?P<end>$))"
    )
    _SUBJECT = "where: "

    def __init__(self, text: str, columns: Sequence[str]) -> None:
        super().__init__(text)
        self._columns = columns
        self._names: dict[str, None] = {}

    def parse(self) -> Condition:
        test = self._disjunction()
        if self._tokens[self._next][0] != "end":
            raise self._error(self._explain_extra())
        return Condition(self._text, tuple(self._names), test)

    def _explain_unknown(self, rest: str) -> str:
        for wrong, right in _REPLACEMENTS:
            if rest.startswith(wrong):
                return f"{format_value(wrong)} is not supported; write {right}"
        if rest[0].isdigit():
            word = re.match(r"\w*", rest)
            return f"{format_value(word[0] if word else rest)} is not a number; {_UNIT_HINT}"
        vocabulary = "names of columns, numbers, comparisons, and, or, not, ()"
        return f"unexpected {format_value(rest[0])}; a condition has {vocabulary}"

    def _explain_extra(self) -> str:
        kind, word, _ = self._tokens[self._next]
        if word == ")":
            return "this closing bracket has no opening one"
        if kind == "name" and word.lower() in _KEYWORDS:
            return f"write {word.lower()} in lower case"
        if kind == "name" and word not in self._columns and self._tokens[self._next - 1][0] == "number":
            return f"unexpected {format_value(word)}; {_UNIT_HINT}"
        return "expected 'and' or 'or' here"

    def _disjunction(self) -> _Test:
        parts = [self._conjunction()]
        while self._take("or"):
            parts.append(self._conjunction())
        return _combine(parts, np.logical_or)

    def _conjunction(self) -> _Test:
        parts = [self._negation()]
        while self._take("and"):
            parts.append(self._negation())
        return _combine(parts, np.logical_and)

    def _negation(self) -> _Test:
        negated = False
        while self._take("not"):
            negated = not negated
        test = self._in_brackets(self._disjunction) if self._take("(") else self._comparison()
        return (lambda columns: ~test(columns)) if negated else test

    def _comparison(self) -> _Test:
        operands = [self._operand()]
        signs = []
        while sign := self._take(*_SIGNS):
            signs.append(_SIGNS[sign])
            operands.append(self._operand())
        if not signs:
            raise self._error("expected a comparison here: < <= > >= == or != and a second operand")
        pairs = zip(signs, operands, operands[1:], strict=False)
        return _combine([_compare(*pair) for pair in pairs], np.logical_and)

    def _operand(self) -> _Operand:
        kind, word, position = self._tokens[self._next]
        if kind == "number":
            value = float(word)
            if not math.isfinite(value):
                raise self._error("the number is too large")
            self._next += 1
            return lambda _: value
        if kind != "name" or word in _KEYWORDS:
            raise self._error(_EXPECTED_COMPARISON)
        if word not in self._columns and word.lower() in _KEYWORDS:
            raise self._error(f"write {word.lower()} in lower case")
        if word not in self._columns:
            raise self._error(f"no column {format_value(word)}; {suggestion(word, self._columns)}", position)
        self._next += 1
        self._names[word] = None
        return lambda columns: columns[word]


def _compare(sign: Callable[[Any, Any], Any], left: _Operand, right: _Operand) -> _Test:
    def test(columns: Arrays) -> Mask:
        a, b = left(columns), right(columns)
        # IEEE 754 has NaN != x true; here every comparison with an undefined value is false.
        mask = sign(a, b) & (a == a) & (b == b)
        return np.broadcast_to(mask, len(next(iter(columns.values()))))

    return test


def _combine(parts: Sequence[_Test], operation: Callable[[Any, Any], Any]) -> _Test:
    if len(parts) == 1:
        return parts[0]

    def test(columns: Arrays) -> Mask:
        mask = parts[0](columns)
        for part in parts[1:]:
            mask = operation(mask, part(columns))
        return mask

    return test
