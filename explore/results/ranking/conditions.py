"""Conditions on columns, such as ``20 < swing_angle <= 40 and (crank < 4 in or not cv > 0.5)``.

The grammar has comparisons only, so a text from an untrusted source runs no code:

* disjunction: conjunction ("or" conjunction)*
* conjunction: negation ("and" negation)*
* negation: "not"* ("(" disjunction ")" | comparison)
* comparison: operand (sign operand)+, where ``a < b < c`` means ``a < b and b < c``
* operand: the name of a column, or a number, which a unit may follow

A number without a unit is in the unit in which the column that it is compared with is shown: the declared one, unless
others were chosen. Columns in the same declared unit are compared as they are stored, others as they are shown.
"""

# `ast.parse` with a list of allowed nodes would replace the descent only, a third of this file. It takes the column
# 'ſ' for 's', refuses a column 'lambda', ignores what follows '#', warns at '1or', and in '(a < 20 deg)' points at 'a';
# the tokens below would still be needed to exclude all that.

import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from explore.base.errors import RequestError
from explore.base.grammar import NAME, NUMBER, Descent
from explore.base.suggest import format_value, suggestion
from explore.base.units.shown import PLAIN, Scale
from explore.model.columns import Arrays

Mask = npt.NDArray[np.bool_]
_Test = Callable[[Arrays], Mask]

_SIGNS: dict[str, Callable[[Any, Any], Any]] = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq, "!=": operator.ne,
}  # fmt: skip
_KEYWORDS = ("and", "or", "not")
#: Notations of other languages, and their replacements.
_REPLACEMENTS = (("=", "=="), (",", "0.5, not 0,5"), ("&", "and"), ("|", "or"), ("!", "not or !="), ("~", "not"))

# A unit after a number: factors such as "mm", "rad/s^2" or "N m", none of them a keyword.
_FACTOR = r"(?!(?i:and|or|not)\b)(?:[^\W\d_]|[°%])+(?:(?:\^|\*\*)-?[1-9])?(?!\w)"
_UNIT = rf"{_FACTOR}(?:\s*[*/·]\s*{_FACTOR}|\s+{_FACTOR})*"
_EXPECTED_COMPARISON = "expected a comparison here, such as swing_angle > 20"


@dataclass(frozen=True)
class Condition:
    """A condition on designs, as written, with the names of the columns that it uses.

    The numbers that it compares with are in declared units: between two of them, the values of a single column all meet
    it or all do not. `test` takes columns of shape (n,) and returns which designs meet the condition, (n,). A
    comparison with an undefined value (NaN) is false, including ``!=``.
    """

    text: str
    names: tuple[str, ...]
    numbers: tuple[float, ...]
    test: _Test


@dataclass(frozen=True)
class _Operand:
    """A column, or a number as it is written, with its position in the text."""

    word: str
    position: int
    is_number: bool


def parse_condition(text: str, columns: Sequence[str], scales: Mapping[str, Scale] | None = None) -> Condition:
    """Parse a condition, in the grammar of this module, on some columns with their declared and shown units.

    The message of a `RequestError` has the position of the first error.
    """
    return _ConditionParser(text, columns, scales or {}).parse()


class _ConditionParser(Descent):
    _PATTERN = re.compile(
        rf"\s*(?:(?P<number>[+-]?{NUMBER}(?:\s*{_UNIT}|(?!\w)))|(?P<name>{NAME})|(?P<sign><=|>=|==|!=|<|>)|(?P<bracket>[()])|(?P<end>$))"
    )
    _SUBJECT = "where: "

    def __init__(self, text: str, columns: Sequence[str], scales: Mapping[str, Scale]) -> None:
        super().__init__(text)
        self._columns, self._scales = columns, scales
        self._names: dict[str, None] = {}
        self._numbers: list[float] = []

    def parse(self) -> Condition:
        test = self._disjunction()
        if self._tokens[self._next][0] != "end":
            raise self._error(self._explain_extra())
        return Condition(self._text, tuple(self._names), tuple(self._numbers), test)

    def _explain_unknown(self, rest: str) -> str:
        for wrong, right in _REPLACEMENTS:
            if rest.startswith(wrong):
                return f"{format_value(wrong)} is not supported; write {right}"
        if rest[0].isdigit():
            word = re.match(r"\w*", rest)
            return f"{format_value(word[0] if word else rest)} is not a number"
        vocabulary = "names of columns, numbers, comparisons, and, or, not, ()"
        return f"unexpected {format_value(rest[0])}; a condition has {vocabulary}"

    def _explain_extra(self) -> str:
        kind, word, _ = self._tokens[self._next]
        if word == ")":
            return "this closing bracket has no opening one"
        if kind == "name" and word.lower() in _KEYWORDS:
            return f"write {word.lower()} in lower case"
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
        return _combine([self._compare(*pair) for pair in pairs], np.logical_and)

    def _operand(self) -> _Operand:
        kind, word, position = self._tokens[self._next]
        if kind == "number":
            self._next += 1
            return _Operand(word, position, is_number=True)
        if kind != "name" or word in _KEYWORDS:
            raise self._error(_EXPECTED_COMPARISON)
        if word not in self._columns and word.lower() in _KEYWORDS:
            raise self._error(f"write {word.lower()} in lower case")
        if word not in self._columns:
            raise self._error(f"no column {format_value(word)}; {suggestion(word, self._columns)}", position)
        self._next += 1
        self._names[word] = None
        return _Operand(word, position, is_number=False)

    def _compare(self, sign: Callable[[Any, Any], Any], left: _Operand, right: _Operand) -> _Test:
        scales = [self._scales.get(operand.word, PLAIN) for operand in (left, right) if not operand.is_number]
        # A number takes the unit of the column beside it. Values of one declared unit need no conversion.
        scale = scales[0] if scales else PLAIN
        as_stored = all(other.declared == scale.declared for other in scales)

        def values(operand: _Operand) -> Callable[[Arrays], Any]:
            if operand.is_number:
                number = self._number(operand, scale)
                self._numbers.append(number)
                return lambda _: number
            if as_stored:
                return lambda columns: columns[operand.word]
            own = self._scales.get(operand.word, PLAIN)
            return lambda columns: own.show_all(columns[operand.word])

        first, second = values(left), values(right)

        def test(columns: Arrays) -> Mask:
            a, b = first(columns), second(columns)
            # IEEE 754 has NaN != x true; here every comparison with an undefined value is false.
            mask = sign(a, b) & (a == a) & (b == b)
            return np.broadcast_to(mask, len(next(iter(columns.values()))))

        return test

    def _number(self, operand: _Operand, scale: Scale) -> float:
        """The number in the declared unit of what it is compared with."""
        try:
            return scale.read(operand.word)
        except RequestError as error:
            last = operand.word.split()[-1]
            if last in self._columns:  # a column was taken for a unit
                reason, position = "expected 'and' or 'or' here", operand.position + operand.word.rindex(last)
                raise self._error(reason, position) from None
            raise self._error(str(error), operand.position) from None


def _combine(parts: Sequence[_Test], operation: Callable[[Any, Any], Any]) -> _Test:
    if len(parts) == 1:
        return parts[0]

    def test(columns: Arrays) -> Mask:
        mask = parts[0](columns)
        for part in parts[1:]:
            mask = operation(mask, part(columns))
        return mask

    return test
