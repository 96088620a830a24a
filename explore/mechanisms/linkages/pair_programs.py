"""Programs on pairs of doubles as tables, for `pair_operations.fill_pairs`."""

from collections.abc import Hashable, Sequence
from typing import NamedTuple

from explore.base.lanes.disturbance import PERIOD
from explore.mechanisms.linkages.graph import FOLLOWS, PARTS
from explore.mechanisms.linkages.pair_operations import COLUMNS, PAIR_CODES, PairSizes
from explore.mechanisms.linkages.programs import EXACT, Program


class PairPlan(NamedTuple):
    """A program as tables: literals and the rests of their rounding; rows that are read; operations; rows written."""

    sizes: PairSizes
    literals: list[float]
    integers: list[int]


def knows_pairs(program: Program) -> bool:
    """Whether all operations of a program are known for pairs."""
    return all(operation.name in (*PAIR_CODES, *PARTS, "exact_sum") for operation in program.operations)


def plan_pairs(program: Program) -> PairPlan:
    """The tables of a program."""
    numbers: dict[Hashable, int] = {k: number for number, k in enumerate((*program.literals, *program.reads))}
    still: list[int] = []
    moving: list[int] = []
    of_angle = set[Hashable]()
    followed: dict[int, tuple[str, tuple[int, ...]]] = {}

    def put(name: str, operands: Sequence[Hashable], result: Hashable, factor: int) -> None:
        is_moving = name == "tangent" or not of_angle.isdisjoint(operands)
        first, second = (*(numbers[each] for each in operands), 0, 0)[:2]
        numbers[result] = len(numbers)
        (moving if is_moving else still).extend([PAIR_CODES[name], first, second, numbers[result], factor])
        if is_moving:
            of_angle.add(result)

    for result, name, operands in program.operations:
        factor = result % PERIOD if result >= 0 and name not in EXACT else -1
        if name in FOLLOWS:
            followed[result] = name, operands
        elif name in PARTS:
            group, operands = followed[operands[0]]
            name = f"{group}{name}"
        if name == "exact_sum":
            a, b, c, d = operands
            put("add", (a, b), (result, 2), factor)
            put("add", ((result, 2), c), (result, 3), factor)
            put("add", ((result, 3), d), result, factor)
        else:
            put(name, operands, result, factor)
    sizes = PairSizes(
        len(program.literals), len(program.reads), len(numbers), len(still) // COLUMNS,
        (len(still) + len(moving)) // COLUMNS, len(program.writes), program.first_group,
    )  # fmt: skip
    literals = [*program.literals.values(), *(program.rests.get(k, 0.0) for k in program.literals)]
    writes = [numbers[k] for _, k in program.writes]
    return PairPlan(sizes, literals, [*program.reads.values(), *still, *moving, *writes])
