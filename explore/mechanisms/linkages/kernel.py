"""The functions `close` and `fill` of a linkage, for the signals that are asked for.

Names of the table never enter the texts of functions: parameters, links and signals are rows.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, INTEGRALS_SIGNATURE, address_of
from explore.mechanisms.linkages import calling_code, page_code, statuses, vector_code, vector_text
from explore.mechanisms.linkages.closing import CLOSING_SIGNATURE, Sizes, close_designs
from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.following import FOLLOW_SIGNATURE, follow
from explore.mechanisms.linkages.graph import Number, Series
from explore.mechanisms.linkages.group_steps import groups_of
from explore.mechanisms.linkages.harmonics import MOST_HARMONICS
from explore.mechanisms.linkages.loads import SPEED
from explore.mechanisms.linkages.mark_errors import BOUND_MARKS_SIGNATURE, bound_marks
from explore.mechanisms.linkages.native_code import NativeFunction
from explore.mechanisms.linkages.operations import OPERATE_SIGNATURE, operate
from explore.mechanisms.linkages.pair_marks import MARKS_SIGNATURE, sharpen_marks
from explore.mechanisms.linkages.pair_operations import PAIRS_SIGNATURE, fill_pairs
from explore.mechanisms.linkages.pair_programs import knows_pairs, plan_pairs
from explore.mechanisms.linkages.programs import Program, Rows
from explore.mechanisms.linkages.reaches import MOST_LINES
from explore.mechanisms.linkages.table import LinkageTable
from explore.mechanisms.linkages.trace import Loop
from explore.mechanisms.linkages.turn_moments import TURN_MOMENTS_SIGNATURE, fill_turn_moments
from explore.mechanisms.targets.path_errors.curve import CURVE_SIGNATURE, CURVE_SIZE, ROWS_SIGNATURE


@dataclass(frozen=True)
class Kernel:
    """The functions of a linkage.

    Attributes
    ----------
    close, fill, disturbed_fill, precise_close, precise_fill, disturbed_precise_fill
        As `explore.model.mechanism.Mechanism` says.
    curve
        What `fill` gives of one design at one angle, from its constants; see `explore.mechanisms.targets`.
    rows_of_curve
        The same at many angles.
    turn_moments
        As `explore.model.mechanism.Mechanism.integrals`, over the turn.
    n_constants
        Constants of a design that `fill` reads; `close` computes more than it keeps.
    closes_quickly
        Whether `close` takes less time than memory does to keep the constants.
    knows_places
        Whether the angle above which the nearest singularity stands is known of all designs that have strokes.
    """

    close: NativeFunction
    fill: NativeFunction
    disturbed_fill: NativeFunction
    precise_close: NativeFunction | None
    precise_fill: NativeFunction | None
    disturbed_precise_fill: NativeFunction | None
    curve: NativeFunction
    rows_of_curve: NativeFunction
    turn_moments: NativeFunction | None
    n_constants: int
    closes_quickly: bool
    knows_places: bool


def make_kernel(
    equations: Equations,
    outputs: Sequence[Number],
    links: Sequence[str],
    joints: Sequence[str],
    rate: Sequence[Number],
    squares: Sequence[Series],
    *,
    tells_reach: bool,
    loops: Mapping[Loop, Sequence[int]] | None = None,
) -> Kernel:
    """Make the functions that fill rows of signals, the `outputs`; they are translated when they are needed.

    `links` are those whose angles are among them, in the order of their references, `joints` in that of their statuses,
    and `squares` those of distances that loads divide by, beside those of the equations. The `rate` of the output,
    with slope and size, is given where its reversals are asked for; `tells_reach` where the intervals are at which a
    design assembles that does not turn. Of `loops` the moments over the turn are asked for, at the given places.
    """
    rows = Rows(equations.graph, links, groups=len(equations.groups))
    rows.add(outputs)
    rows.add_parameters([*outputs, *rate[:2]])
    status = rows.count
    functions = [*_functions(equations), *squares]
    directions = [term.terms[0] for link in links for term in equations.directions[link]]
    of_nodes = {"check": _check_rows(equations, functions), "direct": directions, "rate": rate}
    for others in of_nodes.values():
        rows.add(others)
    parameters = {name: row for row, name in enumerate(parameter_names(equations.table), status + 1)}
    factors, harmonics = len(equations.factors), _harmonics(functions)
    sizes = Sizes(
        factors, len(functions), len(functions) - len(squares), len(links), rows.count, status,
        status + 1 + len(parameters), harmonics, int(harmonics == (1 << len(functions)) - 1), len(equations.groups),
        rows.first_group, int(bool(rate)), int(tells_reach),
        sum(1 << k for k, factor in enumerate(equations.factors[:MOST_LINES]) if factor.of_lines),
    )  # fmt: skip
    closing = _Closing(
        sizes,
        [float(statuses.blocked_at(joints.index(each.joint))) for each in equations.factors],
        _starts(equations, joints),
        rows.of_design("design", parameters),
        rows.of_ties("ties", list(chain(*equations.groups)), parameters) if equations.groups else None,
        {name: rows.of_angle(name, numbers) for name, numbers in of_nodes.items() if numbers},
        rows.from_parameters("disturbed_rate", rate[:2]),
    )
    fill, whole = rows.of_angle("fill", outputs), rows.from_parameters("disturbed_fill", outputs)
    close = NativeFunction("close", CLOSE_SIGNATURE, closing.text, _addresses, closing.javascript)
    ray = rows.of_angle("curve", outputs, is_ray=True)
    curve = NativeFunction(
        ray.name, CURVE_SIGNATURE, lambda: vector_code.HEAD + vector_code.curve_function(ray), _addresses
    )  # fmt: skip
    rows_of_curve = NativeFunction(
        f"{ray.name}_rows", ROWS_SIGNATURE,
        lambda: vector_code.HEAD + vector_code.rows_of_curve_function(ray, CURVE_SIZE), _addresses,
    )  # fmt: skip
    is_exact = not equations.graph.has_rounded_constants and knows_pairs(whole) and knows_pairs(closing.reversals)
    return Kernel(
        close, _fill_function(fill), _fill_function(whole, is_disturbed=True),
        _close_precisely(closing) if is_exact and rate else None,
        _pairs_function("precise_fill", whole) if is_exact else None,
        _pairs_function("disturbed_precise_fill", whole, is_disturbed=True) if is_exact else None,
        curve, rows_of_curve, _moments_function(loops, parameters) if loops else None, status,
        closes_quickly=bool(sizes.is_harmonic) and not (sizes.links or sizes.groups or sizes.has_strokes),
        knows_places=bool(sizes.is_harmonic and sizes.has_strokes),
    )  # fmt: skip


def _starts(equations: Equations, joints: Sequence[str]) -> list[float]:
    """Where each group is sketched, rad, and the status of a crank that it blocks; see `following`."""
    ends = [group.joint for group in groups_of(equations.steps)]
    codes = [float(statuses.blocked_at(joints.index(end))) for end in ends]
    starts = equations.table.starts
    return [each for start, code in zip(starts, codes, strict=True) for each in (*map(math.radians, start), code)]


def parameter_names(table: LinkageTable) -> list[str]:
    """The parameters of a record, in the order of their rows."""
    is_dynamic = table.loads is not None and table.loads.is_dynamic
    return [*(parameter.name for parameter in table.parameters), *([SPEED] if is_dynamic else [])]


def _functions(equations: Equations) -> list[Series]:
    """What must not vanish: the factors, then the squares of distances."""
    return [*(factor.value for factor in equations.factors), *equations.squares]


def _harmonics(functions: Sequence[Series]) -> int:
    """Bits of the functions that are first harmonics of the angle, as those of a dyad on the driver."""
    return sum(1 << k for k, each in enumerate(functions[:MOST_HARMONICS]) if each.terms[0].order <= 1)


def _check_rows(equations: Equations, functions: Sequence[Series]) -> list[Number]:
    """The rows that `turning` takes."""
    zero = equations.graph.constant(0.0)
    return [
        *(function.terms[0] for function in functions),
        *(function.terms[1] for function in functions),
        *(factor.size or zero for factor in equations.factors),
    ]


@dataclass(frozen=True)
class _Closing:
    """What `close` passes to `close_designs`: sizes, statuses of factors, where groups are sketched, and programs.

    `reversals` gives the output's rate and its slope from the parameters.
    """

    sizes: Sizes
    blocked: Sequence[float]
    starts: Sequence[float]
    design: Program
    ties: Program | None
    of_nodes: Mapping[str, Program]
    reversals: Program

    def text(self) -> str:
        """The function, and those that it passes, in LLVM's language."""
        return "".join([
            vector_code.HEAD, vector_code.design_function(self.design),
            vector_code.design_function(self.ties) if self.ties else "",
            *map(vector_code.node_function, self.of_nodes.values()),
            *([vector_code.fill_function(self.reversals, is_disturbed=True)] if self.sizes.has_strokes else ()),
            calling_code.close_function(
                self.sizes, self.blocked, self.starts,
                ["design", "ties" if self.ties else "", *_present(self.of_nodes)],
            ),
        ])  # fmt: skip

    def javascript(self, name: str, word_of: Callable[[Any], str]) -> str:
        """The same in JavaScript."""
        of_nodes = [self.of_nodes.get(name) for name in _present(self.of_nodes)]
        functions = [
            page_code.design_function(self.design, word_of),
            page_code.design_function(self.ties, word_of) if self.ties else "null",
            *(page_code.node_function(program, word_of) if program else "null" for program in of_nodes),
        ]
        return page_code.close_function(
            name, word_of, self.sizes, (self.blocked, self.starts), functions,
            page_code.disturbed_function(self.reversals, word_of),
        )  # fmt: skip


def _present(of_nodes: Mapping[str, Program]) -> list[str]:
    """Names of the functions of nodes in the order in which they are passed; empty for one that is not there."""
    return [name if name in of_nodes else "" for name in ("check", "direct", "rate")]


def _fill_function(program: Program, *, is_disturbed: bool = False) -> NativeFunction:
    return NativeFunction(
        program.name,
        FILL_SIGNATURE,
        lambda: vector_code.HEAD + vector_code.fill_function(program, is_disturbed=is_disturbed),
        _addresses,
        lambda name, word_of: page_code.fill_function(name, program, word_of),
    )


def _close_precisely(closing: _Closing) -> NativeFunction:
    def text() -> str:
        return closing.text() + calling_code.precise_close_function(
            plan_pairs(closing.reversals), closing.sizes.interval + 2
        )

    return NativeFunction("precise_close", CLOSE_SIGNATURE, text, _addresses)


def _pairs_function(name: str, program: Program, *, is_disturbed: bool = False) -> NativeFunction:
    return NativeFunction(
        name,
        FILL_SIGNATURE,
        lambda: calling_code.pairs_function(name, plan_pairs(program), is_disturbed=is_disturbed),
        _addresses,
    )


def _moments_function(loops: Mapping[Loop, Sequence[int]], parameters: Mapping[str, int]) -> NativeFunction:
    rows = [float(parameters[name] if name else -1) for loop in loops for name, _ in loop.lengths]
    lengths = [value for loop in loops for _, value in loop.lengths]
    places = [float(place) for of_links in loops.values() for place in of_links]
    return NativeFunction(
        "turn_moments",
        INTEGRALS_SIGNATURE,
        lambda: calling_code.moments_function(rows, lengths, places),
        _addresses,
    )


def _addresses(text: str) -> dict[str, int]:
    """The addresses of those functions of the package that a text calls."""
    functions = {
        calling_code.CLOSE: (close_designs, CLOSING_SIGNATURE),
        vector_text.OPERATE: (operate, OPERATE_SIGNATURE),
        vector_text.FOLLOW: (follow, FOLLOW_SIGNATURE),
        calling_code.FILL_PAIRS: (fill_pairs, PAIRS_SIGNATURE),
        calling_code.BOUND_MARKS: (bound_marks, BOUND_MARKS_SIGNATURE),
        calling_code.SHARPEN: (sharpen_marks, MARKS_SIGNATURE),
        calling_code.TURN_MOMENTS: (fill_turn_moments, TURN_MOMENTS_SIGNATURE),
    }
    return {name: address_of(*each) for name, each in functions.items() if f"call ptr @{name}(" in text}
