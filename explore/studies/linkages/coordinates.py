"""Coordinates of tables: read from numbers and expressions, written as text again, and their values."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from explore.base.entries import note_unknown
from explore.base.errors import KeyPath, Problems, RequestError
from explore.base.suggest import format_value
from explore.base.units.quantities import UnitError, quantity
from explore.evaluation.propagation import Bounded, propagate
from explore.mechanisms.linkages.coordinate import ZERO, Coordinate, Place, constant, joined
from explore.model.expressions import Expression, run
from explore.studies.request.formula_text import ANGULAR, MOST_CHARACTERS, parse_formula

_POLAR = ("radius", "angle")
_FORMS = 'a number, an expression, [x, y] or { radius = "r", angle = 30 }'
# Ranks of operations by how strongly they bind their operands, as in formulas.
_SUM, _PRODUCT, _NEGATION, _POWER, _OPERAND = range(1, 6)
_OPERATORS = {"+": _SUM, "-": _SUM, "*": _PRODUCT, "/": _PRODUCT, "**": _POWER}


def read_place(entry: object, key: KeyPath, problems: Problems) -> Place:
    """The place of a point in one of its forms; the origin after its problems are appended."""
    if isinstance(entry, Mapping):
        return _polar(entry, key, problems)
    if isinstance(entry, list | tuple):
        return read_pair(entry, key, problems)
    return _coordinate(entry, key, problems, _FORMS), ZERO


def read_pair(entry: object, key: KeyPath, problems: Problems, form: str = "[x, y]") -> Place:
    """The place ``[x, y]``, or another pair of coordinates."""
    if not isinstance(entry, list | tuple) or len(entry) != 2:
        problems.append((key, f"must be a pair {form}, got {format_value(entry)}"))
        return ZERO, ZERO
    x, y = (_coordinate(each, (*key, number), problems) for number, each in enumerate(entry))
    return x, y


def _polar(entry: Mapping[str, object], key: KeyPath, problems: Problems) -> Place:
    """The place ``{ radius, angle }``."""
    unknown = note_unknown(entry, _POLAR, problems, key)
    missing = [] if unknown else [word for word in _POLAR if word not in entry]
    problems += [(key, f"the key '{word}' is missing; a place is {_FORMS}") for word in missing]
    if unknown or missing:
        return ZERO, ZERO
    radius, angle = (
        _coordinate(entry[word], (*key, word), problems, unit=unit)
        for word, unit in zip(_POLAR, ("mm", "deg"), strict=True)
    )
    return turned((radius, ZERO), angle, key, problems)


def read_amount(entry: object, key: KeyPath, problems: Problems, unit: str) -> Coordinate:
    """A number in a unit, or an expression."""
    return _coordinate(entry, key, problems, unit=unit)


def turned(place: Place, angle: Coordinate, key: KeyPath, problems: Problems) -> Place:
    """A place turned about the origin by an angle, deg."""
    (x, y), (cosine, sine) = place, (joined(function, angle) for function in ("cos", "sin"))
    along, across = x * cosine, x * sine
    if y != ZERO:
        along, across = along - y * sine, across + y * cosine
    return _checked(along, key, problems), _checked(across, key, [])  # the two have the same problems


def moved(place: Place, by: Place, operation: str) -> Place:
    """The sum (operation "+") or the difference ("-") of two places."""
    x, y = (one if other == ZERO else joined(operation, one, other) for one, other in zip(place, by, strict=True))
    return x, y


def _coordinate(
    entry: object, key: KeyPath, problems: Problems, forms: str = "a number or an expression", unit: str = "mm"
) -> Coordinate:
    try:
        if not isinstance(entry, str):
            if isinstance(entry, bool) or not isinstance(entry, int | float):
                raise RequestError(f"must be {forms}, got {format_value(entry)}")  # noqa: TRY301  # one way to note it
            return constant(quantity(entry, unit))
        formula = parse_formula(entry)
    except RequestError as error:
        reason = str(error)
        try:
            return constant(quantity(entry, unit))
        except UnitError as wrong:
            reason = f"{wrong}; before a parameter write an operator: + - * / or **"
        except RequestError:
            pass
        problems.append((key, reason))
        return ZERO
    return _checked(Coordinate(tuple(formula.names), formula.expression.steps), key, problems)


def _checked(coordinate: Coordinate, key: KeyPath, problems: Problems) -> Coordinate:
    """The coordinate, one without parameters as its number; 0 if a study could not hold its text."""
    if coordinate.names:
        try:
            parse_formula(text_of(coordinate))
        except RequestError:
            problems.append((key, "is too long; shorten it"))
            return ZERO
        return coordinate
    value = value_of(coordinate, {})
    if not math.isfinite(value):
        problems.append((key, "is not a finite number"))
        return ZERO
    return constant(value)


def value_of(coordinate: Coordinate, values: Mapping[str, float]) -> float:
    """The value of a coordinate, mm; NaN where it is undefined."""
    inputs = [Bounded.exact(np.array([values[name]])) for name in coordinate.names]
    expression = Expression("", coordinate.steps)
    return float(propagate(expression, inputs or [Bounded.exact(np.zeros(1))]).value[0])


@dataclass(frozen=True)
class _Text:
    """A part of an expression: its text, how strongly it binds, and the function that it is a call of, if any."""

    text: str
    strength: int = _OPERAND
    function: str = ""

    def within(self, strength: int) -> str:
        """The text as an operand of an operation that binds so strongly."""
        return self.text if self.strength >= strength else f"({self.text})"


def text_of(coordinate: Coordinate) -> str:
    """The expression that `parse_formula` reads as the same steps; of a number that number."""
    if len(coordinate.steps) == 1 and coordinate.steps[0][0] == "number":
        return _number_text(coordinate.steps[0][1])
    text = run(
        coordinate.steps, lambda number: _Text(_number_text(number)), lambda k: _Text(coordinate.names[k]), _joined
    ).text
    return text if len(text) <= MOST_CHARACTERS else text.replace(" ", "")


def _joined(operation: str, left: _Text, right: _Text | None = None) -> _Text:
    """An operation of one or two values."""
    if right is None:
        negated = operation == "negate"
        return _Text(f"-{left.within(_POWER)}", _NEGATION) if negated else _Text(f"{operation}({left.text})")
    if operation not in _OPERATORS:
        # min(a, b, c) is min(a, min(b, c)).
        rest = right.text[len(operation) + 1 : -1] if right.function == operation else right.text
        return _Text(f"{operation}({left.text}, {rest})", function=operation)
    strength = _OPERATORS[operation]
    if operation == "**":
        return _Text(f"{left.within(_OPERAND)}**{right.within(_POWER)}", strength)
    return _Text(f"{left.within(strength)} {operation} {right.within(strength + 1)}", strength)


def _number_text(number: float) -> str:
    if number == math.pi:
        return "pi"
    return repr(int(number)) if number.is_integer() and abs(number) < 1e16 else repr(number)


def uses_of(coordinate: Coordinate) -> tuple[set[str], set[str]]:
    """The parameters that a coordinate uses as lengths, and those that it uses as angles."""
    lengths: set[str] = set()
    angles: set[str] = set()

    def apply(operation: str, *values: set[str]) -> set[str]:
        used = set().union(*values)
        if operation in ANGULAR or operation == "atan2":
            (angles if operation in ANGULAR else lengths).update(used)
            return set()
        return used

    whole = run(coordinate.steps, lambda _: set(), lambda place: {coordinate.names[place]}, apply)
    return lengths | whole, angles
