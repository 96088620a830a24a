"""Forces in the joints of a linkage whose pins have friction, by Newton's method on the sizes of its forces.

A pin of the radius r, which presses on a link with F, turns it back with mu r |F|. The forces are linear in the loads,
and so in the sizes z of those that friction follows from, of pins and of slots::

    z_i = |a_i + sum_j G_ij z_j|

While the sums of |G_ij| over j are all below 1, this has one solution, to which repeated substitution leads; else
friction may lock the linkage, and there is no number.
"""

from collections.abc import Sequence
from functools import reduce

from explore.mechanisms.linkages.equations import Equations
from explore.mechanisms.linkages.graph import CORNER, LENGTHS, LENGTHS_OF, Number, operands
from explore.mechanisms.linkages.loads import Joint, Loading
from explore.mechanisms.linkages.reactions import Reactions

#: Steps of Newton's method.
_STEPS = 6
#: Largest change of a size by the last step, relative to the sum of all; what is left is about its square.
_LAST_CHANGE = 1e-8
#: A size below this is 0, N; its square is still a normal number.
_LEAST = 1e-150

Force = tuple[Number, ...]


def balance_friction(equations: Equations, loading: Loading) -> tuple[Reactions, dict[Joint, Number], Number | None]:
    """The forces in the joints, the sizes of those of pins with friction, and the largest sum of the module.

    Friction in slots alone is that of `Reactions`, unless they hold groups: then there are no sizes and no sum.
    """
    if not loading.needs_sizes:
        return Reactions(equations, loading), {}, None
    joints: list[Joint] = [*loading.bearings, *loading.friction]
    zero, one = equations.graph.constant(0.0), equations.graph.constant(1.0)
    nothing, unloaded = dict.fromkeys(joints, zero), loading.unloaded()
    own = _forces(Reactions(equations, loading, nothing), loading, joints)
    by_one = [_forces(Reactions(equations, unloaded, nothing | {joint: one}), loading, joints) for joint in joints]
    forwards = [[column[i] for column in by_one] for i in range(len(joints))]
    senses = [*(each.sense for each in loading.bearings.values()), *(sense for _, sense in loading.friction.values())]
    gains = [[tuple(p * sense for p in force) for force, sense in zip(row, senses, strict=True)] for row in forwards]
    sums = [reduce(lambda total, force: total + _size(force), row, zero) for row in forwards]
    different = {total.index: total for total in sums}.values()
    largest = reduce(lambda first, second: first.call("maximum", second), different)
    certain = _name_sizes(own, gains) if equations.graph.is_exact else _find_sizes(own, gains, 1.0 - largest)
    of_joints = dict(zip(joints, certain, strict=True))
    return Reactions(equations, loading, of_joints), of_joints, largest


def _name_sizes(own: Sequence[Force], gains: Sequence[Sequence[Force]]) -> list[Number]:
    """The sizes as operations of the graph, which whoever takes them solves."""
    zero = own[0][0].graph.constant(0.0)
    parts = [part for row in (own, *gains) for force in row for part in (*force, zero)[:2]]
    lengths = parts[0].call(LENGTHS, *parts[1:])
    return [lengths.call(name).call(CORNER) for name, _ in zip(LENGTHS_OF, own, strict=False)]


def _find_sizes(own: Sequence[Force], gains: Sequence[Sequence[Force]], spare_gain: Number) -> list[Number]:
    """The sizes by Newton's method; none where the sums of gains spare nothing, or where it does not lead there."""
    zero = own[0][0].graph.constant(0.0)
    sizes = [_size(force) for force in own]
    changes = sizes
    for _ in range(_STEPS):
        changes = _newton_step(own, gains, sizes)
        sizes = [size + change for size, change in zip(sizes, changes, strict=True)]
    found = [_size(_total(force, row, sizes)) for force, row in zip(own, gains, strict=True)]
    allowed = sum(found, zero) * _LAST_CHANGE
    spare = reduce(lambda least, change: least.call("minimum", allowed - abs(change)), changes, allowed)
    checks = spare_gain.sqrt(), spare.sqrt()
    return [reduce(lambda size, check: size.call("maximum", -check), checks, size) for size in found]


def _forces(reactions: Reactions, loading: Loading, joints: Sequence[Joint]) -> list[Force]:
    """The forces that friction follows from: of pins two parts, of slots one."""
    result: list[Force] = []
    for joint in joints:
        if isinstance(joint, str):
            result.append((reactions.across[joint],))
        else:
            bearing = loading.bearings[joint]
            result.append(reactions.on_bodies[bearing.pin, bearing.body])
    return result


def _size(force: Force) -> Number:
    if len(force) == 1:
        return abs(force[0])
    x, y = (Number(part.graph, operands(part.node)[0]) if part.node[0] == "neg" else part for part in force)
    return (x * x + y * y).sqrt()


def _total(force: Force, row: Sequence[Force], sizes: Sequence[Number]) -> Force:
    """The force with these sizes of those that friction follows from."""
    return tuple(
        reduce(lambda total, part: total + part[0][k] * part[1], zip(row, sizes, strict=True), force[k])
        for k in range(len(force))
    )


def _newton_step(own: Sequence[Force], gains: Sequence[Sequence[Force]], sizes: Sequence[Number]) -> list[Number]:
    """What a step adds to the sizes, by elimination in a matrix whose diagonal dominates."""
    matrix, rest = [], []
    least = own[0][0].graph.constant(_LEAST)
    for i, (force, row) in enumerate(zip(own, gains, strict=True)):
        total = _total(force, row, sizes)
        size = _size(total)
        unit = [part / size.call("maximum", least) for part in total]
        slopes = [-sum((u * g for u, g in zip(unit, gain, strict=True)), 0.0 * least) for gain in row]
        slopes[i] = 1.0 + slopes[i]
        matrix.append(slopes)
        rest.append(size - sizes[i])
    return _solve(matrix, rest)


def _solve(matrix: list[list[Number]], right: list[Number]) -> list[Number]:
    """The solution of linear equations, without exchanges of rows."""
    n = len(right)
    for k in range(n):
        inverse = 1.0 / matrix[k][k]
        for i in range(k + 1, n):
            factor = matrix[i][k] * inverse
            matrix[i] = [entry - factor * above for entry, above in zip(matrix[i], matrix[k], strict=True)]
            right[i] = right[i] - factor * right[k]
    result: list[Number] = [*right]
    for k in reversed(range(n)):
        known = sum((matrix[k][j] * result[j] for j in range(k + 1, n)), 0.0 * right[k])
        result[k] = (right[k] - known) / matrix[k][k]
    return result
