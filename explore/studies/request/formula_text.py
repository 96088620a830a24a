"""Read the formulas of users, such as ``(coupler + ground) / 2`` or ``atan2(stroke, 2 * crank)``.

The grammar is arithmetic only, so a text from an untrusted source runs no code:

* sum: product (("+" | "-") product)*
* product: factor (("*" | "/") factor)*
* factor: "-"* power
* power: operand ("**" "-"* operand)*, from the right, as in Python
* operand: number | "pi" | name | function "(" sum ("," sum)* ")" | "(" sum ")"

Sines, cosines and tangents take degrees and atan2 gives degrees, because all angles of a study are in degrees.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from explore.base.errors import RequestError
from explore.base.grammar import NAME, NUMBER, Descent
from explore.base.suggest import format_value, suggestion
from explore.model.expressions import FUNCTIONS, Expression

#: Length of the longest text of a formula.
MOST_CHARACTERS = 1000
#: Words of the grammars of formulas and of conditions, which are not names of columns.
RESERVED = (*FUNCTIONS, "pi", "and", "or", "not")
#: Notations of other languages, and their replacements.
_REPLACEMENTS = (("^", "**"), ("·", "*"), ("×", "*"), ("÷", "/"), ("−", "-"), (";", "a comma"), ("[", "round brackets"))
#: Functions of an angle, which is in degrees.
ANGULAR = ("sin", "cos", "tan")


@dataclass(frozen=True)
class FormulaText:
    """A formula whose names are not resolved, as an expression of its operations.

    The names are those it uses with their positions in the text as written, in the order of the inputs of the
    expression.
    """

    names: Mapping[str, int]
    expression: Expression


def parse_formula(text: str) -> FormulaText:
    """Parse a formula; the message of a `RequestError` has the position of the first error."""
    if len(text) > MOST_CHARACTERS:
        raise RequestError(f"has {len(text):,} characters, but a formula has at most {MOST_CHARACTERS:,}; split it")
    if not text.strip():
        raise RequestError('is empty; write a formula such as "coupler + ground"')
    return _FormulaParser(text).parse()


class _FormulaParser(Descent):
    """Emits the steps in postfix order while it descends."""

    _PATTERN = re.compile(
        rf"\s*(?:(?P<number>{NUMBER})(?!\w)|(?P<name>{NAME})|(?P<sign>\*\*|[-+*/,])|(?P<bracket>[()])|(?P<end>$))"
    )

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._names: dict[str, int] = {}
        self._steps: list[tuple[str, float]] = []

    def parse(self) -> FormulaText:
        self._sum()
        if self._tokens[self._next][0] != "end":
            raise self._error(self._explain_extra())
        return FormulaText(self._names, Expression(self._even_text(), tuple(self._steps)))

    def _even_text(self) -> str:
        """The text with a space around each operator but the power, so that equal formulas have equal texts."""
        text, before = "", "("
        for _, word, _ in self._tokens[:-1]:
            is_binary = word in ("+", "-", "*", "/") and before not in ("(", ",", "+", "-", "*", "/", "**")
            text += f" {word} " if is_binary else ", " if word == "," else word
            before = word
        return text

    def _explain_unknown(self, rest: str) -> str:
        for wrong, right in _REPLACEMENTS:
            if rest.startswith(wrong):
                return f"{format_value(wrong)} is not supported; write {right}"
        if rest[0].isdigit() or rest[0] == ".":
            word = re.match(r"[\w.]*", rest)
            return (
                f"{format_value(word[0] if word else rest)} is not a number; write a product with *, such as 2 * crank"
            )
        return f"unexpected {format_value(rest[0])}; a formula has names, numbers, functions, + - * / ** and ()"

    def _explain_extra(self) -> str:
        kind, word, _ = self._tokens[self._next]
        if word == ")":
            return "this closing bracket has no opening one"
        if word == ",":
            return "a comma separates the values of a function; write 0.5, not 0,5"
        what = format_value(word) if kind in ("name", "number") else f"'{word}'"
        return f"expected an operator before {what}: + - * / or **"

    def _emit(self, operation: str, operand: float = 0.0) -> None:
        self._steps.append((operation, operand))

    def _sum(self) -> None:
        self._product()
        while sign := self._take("+", "-"):
            self._product()
            self._emit(sign)

    def _product(self) -> None:
        self._factor()
        while sign := self._take("*", "/"):
            self._factor()
            self._emit(sign)

    def _factor(self) -> None:
        is_negative = self._minus()
        self._power()
        if is_negative:
            self._emit("negate")

    def _minus(self) -> bool:
        """Consume minus signs; return whether their number is odd."""
        is_negative = False
        while self._take("-"):
            is_negative = not is_negative
        return is_negative

    def _power(self) -> None:
        self._operand()
        negative_exponents = []
        while self._take("**"):
            negative_exponents.append(self._minus())
            self._operand()
        for is_negative in reversed(negative_exponents):
            if is_negative:
                self._emit("negate")
            self._emit("**")

    def _operand(self) -> None:
        kind, word, position = self._tokens[self._next]
        if self._take("("):
            self._in_brackets(self._sum)
            return
        if kind not in ("number", "name"):
            raise self._error("expected a number, a name or a function here")
        self._next += 1
        is_call = self._tokens[self._next][1] == "("
        if kind == "number":
            if not math.isfinite(float(word)):
                raise self._error("the number is too large", position)
            self._emit("number", float(word))
        elif is_call or word in FUNCTIONS:
            self._call(word, position, is_call=is_call)
        elif word == "pi":
            self._emit("number", math.pi)
        else:
            self._names.setdefault(word, position)
            self._emit("input", float(list(self._names).index(word)))

    def _call(self, name: str, position: int, *, is_call: bool) -> None:
        if name not in FUNCTIONS:
            raise self._error(f"unknown function {format_value(name)}; {suggestion(name, FUNCTIONS)}", position)
        if not is_call:
            raise self._error(f"{name} is a function; write its values in brackets after it", position)
        self._next += 1
        start = self._next
        count = self._in_brackets(self._values)
        least, most = FUNCTIONS[name]
        if count < least or (most is not None and count > most):
            wanted = f"{least}{'' if most == least else ' or more'} value{'s' if least > 1 else ''}"
            raise self._error(f"{name} takes {wanted}, got {count}", position)
        if name in ANGULAR:
            self._refuse_radians(name, start, position)
        for _ in range(max(count - 1, 1)):
            self._emit(name)

    def _values(self) -> int:
        """The values of a function; return their number."""
        count = 1
        self._sum()
        while self._take(","):
            self._sum()
            count += 1
        return count

    def _refuse_radians(self, name: str, start: int, position: int) -> None:
        """Raise where pi in the values of a function looks like radians; a division by it converts them to degrees."""
        is_divisor, outer, before = False, [False], "("
        for _, word, _ in self._tokens[start : self._next]:
            if before not in FUNCTIONS:  # the brackets of a function are divisors if the function is one
                is_divisor = outer[-1] != (before == "/")
            if word == "pi" and not is_divisor:
                raise self._error(
                    f"{name} takes degrees, as all angles of a study are; write them without a conversion by pi, or "
                    "name degrees that need pi by a formula of their own",
                    position,
                )
            if word == "(":
                outer.append(is_divisor)
            elif word == ")":
                outer.pop()
            before = before if word == "-" else word  # x / -pi
