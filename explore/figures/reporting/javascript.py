"""A mechanism's compiled functions in JavaScript, so that a page computes motions by the same formulas.

The Python source of the functions, and of all that they call, is translated statement by statement, for one design in
place of LANES. The part of Python that `close` and `fill` are written in suffices: numbers, arrays that are filled in
place, loops over ranges, conditions, and calls of other compiled functions.
"""

import ast
import inspect
import itertools
import math
import textwrap
from collections.abc import Callable, Iterable
from numbers import Integral, Real
from types import ModuleType
from typing import Any, cast

import numpy as np

from explore.base.lanes import elementary

#: Words of JavaScript for functions whose Python source reads the bits of numbers.
_NATIVE: dict[Any, str] = {
    elementary.exponential: "Math.exp",
    elementary.exponential_less_one: "Math.expm1",
    elementary.sine: "Math.sin",
    elementary.cosine: "Math.cos",
    elementary.logarithm: "Math.log",
    elementary.spacing: "$spacing",
}

_PRELUDE = """const $spacing = (x) => {
  const view = new DataView(new ArrayBuffer(8));
  view.setFloat64(0, Math.abs(x));
  view.setBigInt64(0, view.getBigInt64(0) + 1n);
  return view.getFloat64(0) - Math.abs(x);
};
const $copysign = (a, b) => (b < 0 || Object.is(b, -0) ? -Math.abs(a) : Math.abs(a));
const $remainder = (a, b) => a - b * Math.floor(a / b);
"""
_BUILTIN: dict[Any, str] = {
    abs: "Math.abs", min: "Math.min", max: "Math.max", float: "Number", int: "Math.trunc", bool: "Boolean",
    np.int64: "Math.trunc", np.float64: "Number", math.isnan: "Number.isNaN", math.isfinite: "Number.isFinite",
    math.fabs: "Math.abs", math.copysign: "$copysign",
    **{getattr(math, name): f"Math.{name}" for name in (
        "sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "exp", "expm1", "log", "log1p", "sinh", "cosh",
        "tanh", "asinh", "acosh", "atanh", "floor", "ceil", "trunc", "hypot",
    )},
}  # fmt: skip
_ALLOCATIONS = (np.empty, np.zeros)
_OPERATORS: dict[type[ast.AST], str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**", ast.BitAnd: "&", ast.BitOr: "|",
    ast.BitXor: "^", ast.LShift: "<<", ast.RShift: ">>", ast.USub: "-", ast.UAdd: "+", ast.Not: "!", ast.Invert: "~",
    ast.And: "&&", ast.Or: "||", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=",
    ast.Eq: "==", ast.NotEq: "!=",  # not ===: a comparison joined by & is a number there
}  # fmt: skip
#: Names in Python that are words of JavaScript.
_RESERVED = frozenset(
    ("arguments", "case", "catch", "const", "debugger", "default", "delete", "do", "enum", "export", "extends", "eval",
     "function", "implements", "instanceof", "interface", "let", "new", "null", "package", "private", "protected",
     "public", "static", "super", "switch", "this", "throw", "typeof", "var", "void", "Math", "Number", "Boolean")
)  # fmt: skip


class TranslationError(ValueError):
    """A function uses something that has no translation."""


def translate(**functions: Any) -> str:
    """Translate compiled functions into an expression of JavaScript: an object with the same names.

    Raises `TranslationError` with the place of the first statement that has no translation.
    """
    program = _Program()
    entries = {name: program.name_of(function) for name, function in functions.items()}
    body = "\n".join(program.sources())
    exported = ", ".join(f"{name}: {translated}" for name, translated in entries.items())
    return f"(() => {{\n{_PRELUDE}{body}\nreturn {{ {exported} }};\n}})()"


class _Program:
    """All functions that some functions call, each translated once."""

    def __init__(self) -> None:
        self._names: dict[Any, str] = {}

    def name_of(self, dispatcher: Any) -> str:
        """The name of a compiled function in the translation."""
        if dispatcher not in self._names:
            function = getattr(dispatcher, "py_func", None)
            words = f"${function.__module__.split('.')[-1]}_{function.__name__}" if function else f"${dispatcher.name}"
            names = (f"{words}{number or ''}" for number in itertools.count())
            self._names[dispatcher] = next(name for name in names if name not in self._names.values())
        return self._names[dispatcher]

    def word_of(self, function: Any) -> str:
        """The word of JavaScript for a function, or its name in the translation."""
        return _NATIVE.get(function) or _BUILTIN.get(function) or self.name_of(function)

    def sources(self) -> Iterable[str]:
        """The translations, also of the functions that are called."""
        done: set[Any] = set()
        while remaining := [dispatcher for dispatcher in self._names if dispatcher not in done]:
            for dispatcher in remaining:
                done.add(dispatcher)
                name = self._names[dispatcher]
                if hasattr(dispatcher, "py_func"):
                    yield _Function(dispatcher.py_func, self).translate(name)
                else:
                    yield dispatcher.javascript(name, self.word_of)


class _Function:
    """One function."""

    def __init__(self, function: Callable[..., Any], program: _Program) -> None:
        self._program = program
        closure = inspect.getclosurevars(function)
        self._outer = {**function.__globals__, **closure.nonlocals, **closure.builtins}
        source, self._line = inspect.getsourcelines(function)
        self._file = function.__code__.co_filename
        (definition,) = ast.parse(textwrap.dedent("".join(source))).body
        self._definition = cast("ast.FunctionDef", definition)
        stored = [n for n in ast.walk(self._definition) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
        self._arguments = [argument.arg for argument in self._definition.args.args]
        self._local = {*self._arguments, *(name.id for name in stored)}

    def translate(self, name: str) -> str:
        """The function as a declaration of JavaScript."""
        variables = sorted(map(_identifier, self._local.difference(self._arguments)))
        head = f"function {name}({', '.join(map(_identifier, self._arguments))}) {{"
        lines = [head, f"let {', '.join(variables)};" if variables else "", *self._block(self._definition.body), "}"]
        return "\n".join(filter(None, lines))

    def _block(self, statements: Iterable[ast.stmt]) -> list[str]:
        return [line for statement in statements for line in self._statement(statement)]

    def _statement(self, node: ast.stmt) -> list[str]:
        match node:
            case ast.Assign(targets=[ast.Subscript(slice=ast.Slice())]):
                raise self._refusal(node)
            case ast.Assign(targets=targets, value=value):
                return [f"{self._expression(target)} = {self._expression(value)};" for target in targets]
            case ast.AugAssign(target=target, op=op, value=value):
                place = self._expression(target)
                return [f"{place} = {self._binary(node, op, place, self._expression(value))};"]
            case ast.If(test=test, body=body, orelse=orelse):
                lines = [f"if ({self._expression(test)}) {{", *self._block(body), "}"]
                return [*lines, "else {", *self._block(orelse), "}"] if orelse else lines
            case ast.While(test=test, body=body, orelse=[]):
                return [f"while ({self._expression(test)}) {{", *self._block(body), "}"]
            case ast.For(
                target=ast.Name(id=name), iter=ast.Call(func=ast.Name(id="range"), args=bounds), orelse=[]
            ) if (
                not _assigns(node.body, name)  # in JavaScript it would change how often the loop runs
            ):
                return self._loop(_identifier(name), bounds, node.body)
            case ast.Return(value=value):
                return [f"return {self._expression(value)};" if value else "return;"]
            case ast.Expr(value=ast.Constant()) | ast.Pass():
                return []
            case ast.Expr(value=value):
                return [f"{self._expression(value)};"]
            case ast.Break():
                return ["break;"]
            case ast.Continue():
                return ["continue;"]
        raise self._refusal(node)

    def _loop(self, name: str, bounds: list[ast.expr], body: list[ast.stmt]) -> list[str]:
        """A loop over a range, whose step is written out."""
        values = [self._expression(bound) for bound in bounds]
        start, stop = ("0", values[0]) if len(values) == 1 else values[:2]
        step = values[2] if len(values) == 3 else "1"
        compare = ">" if "-" in step else "<"
        return [f"for ({name} = {start}; {name} {compare} {stop}; {name} += {step}) {{", *self._block(body), "}"]

    def _expression(self, node: ast.expr) -> str:
        match node:
            case ast.Name(id=name) if name in self._local:
                return _identifier(name)
            case ast.Attribute(value=ast.Name(id=name), attr=member) if name in self._local:
                return f"{_identifier(name)}.{member}"
            case ast.Name() | ast.Attribute() | ast.Constant():
                return self._literal(node, self._constant(node))
            case ast.BinOp(left=left, op=op, right=right):
                return self._binary(node, op, self._expression(left), self._expression(right))
            case ast.UnaryOp(op=op, operand=operand):
                return f"({_OPERATORS[type(op)]}{self._expression(operand)})"
            case ast.BoolOp(op=op, values=values):
                return f"({f' {_OPERATORS[type(op)]} '.join(map(self._expression, values))})"
            case ast.Compare(left=left, ops=ops, comparators=others) if all(type(op) in _OPERATORS for op in ops):
                sides = [self._expression(each) for each in (left, *others)]
                parts = [f"{a} {_OPERATORS[type(op)]} {b}" for a, op, b in zip(sides, ops, sides[1:], strict=False)]
                return f"({' && '.join(parts)})"
            case ast.IfExp(test=test, body=body, orelse=orelse):
                return f"({self._expression(test)} ? {self._expression(body)} : {self._expression(orelse)})"
            case ast.Tuple(elts=elements):
                return f"[{', '.join(map(self._expression, elements))}]"
            case ast.Subscript(value=value, slice=ast.Slice(lower=lower, upper=upper, step=None)):
                ends = [self._expression(end) if end else "0" for end in (lower, *([upper] if upper else ()))]
                return f"{self._expression(value)}.subarray({', '.join(ends)})"
            case ast.Subscript(value=value, slice=index):
                return f"{self._expression(value)}[{self._expression(index)}]"
            case ast.Call(func=function, args=arguments, keywords=[]):
                return self._call(node, function, [self._expression(argument) for argument in arguments])
        raise self._refusal(node)

    def _binary(self, node: ast.AST, op: ast.operator, left: str, right: str) -> str:
        if isinstance(op, ast.FloorDiv):
            return f"Math.floor({left} / {right})"
        if isinstance(op, ast.Mod):
            return f"$remainder({left}, {right})"
        if type(op) not in _OPERATORS:
            raise self._refusal(node)
        return f"({left} {_OPERATORS[type(op)]} {right})"

    def _call(self, node: ast.Call, function: ast.expr, arguments: list[str]) -> str:
        if isinstance(function, ast.Name) and function.id in self._local:
            return f"{_identifier(function.id)}({', '.join(arguments)})"
        called = self._constant(function)
        if called is len:
            return f"{arguments[0]}.length"
        if called in _ALLOCATIONS:
            return f"new Float64Array({arguments[0]})"
        if called not in _NATIVE and called not in _BUILTIN and not hasattr(called, "py_func"):
            raise self._refusal(node)
        return f"{self._program.word_of(called)}({', '.join(arguments)})"

    def _constant(self, node: ast.expr) -> Any:
        """The object that a name outside the function stands for."""
        match node:
            case ast.Constant(value=value):
                return value
            case ast.Name(id="LANES"):
                return 1
            case ast.Name(id=name) if name in self._outer:
                return self._outer[name]
            case ast.Attribute(value=value, attr=name):
                owner = self._constant(value)
                if isinstance(owner, ModuleType | type) and hasattr(owner, name):
                    return getattr(owner, name)
        raise self._refusal(node)

    def _literal(self, node: ast.expr, value: Any) -> str:
        if isinstance(value, bool | np.bool_):
            return "true" if value else "false"
        if isinstance(value, Integral):
            return f"({int(value)})"
        if isinstance(value, Real):
            number = float(value)
            words = {math.inf: "Infinity", -math.inf: "(-Infinity)"}.get(number, repr(number))
            return "NaN" if math.isnan(number) else words if number >= 0.0 else f"({words})"
        if isinstance(value, tuple | list | np.ndarray):
            return f"[{', '.join(self._literal(node, each) for each in value)}]"
        raise self._refusal(node)

    def _refusal(self, node: ast.AST) -> TranslationError:
        line = self._line + getattr(node, "lineno", 1) - 1
        return TranslationError(f"{self._file}:{line}: `{ast.unparse(node).splitlines()[0]}` has no translation")


def _assigns(body: list[ast.stmt], name: str) -> bool:
    """Whether statements give a name another value."""
    names = (node for statement in body for node in ast.walk(statement) if isinstance(node, ast.Name))
    return any(node.id == name and isinstance(node.ctx, ast.Store) for node in names)


def _identifier(name: str) -> str:
    return f"{name}_" if name in _RESERVED else name
