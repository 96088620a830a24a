"""What of a linkage meets targets: curves of its points with the directions of their links, and its output."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from explore.mechanisms.linkages.declared import add_points
from explore.mechanisms.linkages.table import LinkageTable
from explore.mechanisms.targets.dwell_errors.metrics import declare_dwells
from explore.mechanisms.targets.function_errors.metrics import declare_functions
from explore.mechanisms.targets.path_errors.metrics import declare_paths
from explore.mechanisms.targets.pose_errors.metrics import declare_poses
from explore.model.quantities import FloatArray
from explore.model.status import Status
from explore.model.target_kinds import BODY_POSE, POSE, TargetKind

if TYPE_CHECKING:
    from explore.mechanisms.linkages.equations import Equations
    from explore.mechanisms.linkages.graph import Number, Series
    from explore.mechanisms.linkages.kernel import Kernel

#: Meanings of the coordinates of a linkage's place in the plane of a target.
_ORIGIN = ("x of the frame's origin in the plane of the target", "y of the frame's origin in the plane of the target")
#: Number of motions of which kernels are kept.
_MOST_KEPT = 64


@dataclass(frozen=True)
class TableMotion:
    """The motion of a point, of a link, or of a point and the link that it is on; see `targets.measures.Motion`.

    Attributes
    ----------
    table
        The linkage.
    point, link
        Names; empty for none.
    is_output
        Whether it is the output of the table, with its rates, in place of a point or link.
    needs_turn
        Whether designs whose crank does not turn fully have no motion.
    turns
        Name of a metric that is NaN where the crank does not turn; empty where the factors of the table tell that.
    """

    table: LinkageTable
    point: str
    link: str = ""
    is_output: bool = False
    needs_turn: bool = True
    turns: str = ""

    @property
    def inputs(self) -> tuple[str, ...]:
        """All parameters of the table, and the metric if there is one."""
        return (*(parameter.name for parameter in self.table.parameters), *([self.turns] if self.turns else []))

    def function(self) -> Any:
        """The curve, a function of the constants of a design."""
        return self._kernel().curve

    def function_of_rows(self) -> Any:
        """The curve at rows of angles."""
        return self._kernel().rows_of_curve

    def _kernel(self) -> Kernel:
        return _kernel(self.table, self.point, self.link, self.is_output)

    def shapes(self, inputs: FloatArray) -> FloatArray:
        """The constants of designs, (n, k), from their parameters, (n, p)."""
        if inputs.shape[1] != len(self.inputs):  # the compiled functions would read beyond their rows
            raise ValueError(f"{len(self.inputs)} inputs of the motion are needed, not {inputs.shape[1]}")
        inputs_of_table = inputs[:, : len(self.table.parameters)]
        constants, status = close_table(self._kernel(), inputs_of_table)
        shapes = np.ascontiguousarray(constants.T)
        if self.turns:
            shapes[~np.isfinite(inputs).all(axis=1), 0] = np.nan
        elif self.needs_turn:
            shapes[status != Status.OK, 0] = np.nan
        return shapes


def close_table(
    kernel: Kernel, inputs: FloatArray, interval: tuple[float, float] = (0.0, 0.0)
) -> tuple[FloatArray, npt.NDArray[np.int8]]:
    """Constants (k, n) and status of designs from the parameters of their table, (n, p).

    `interval` is the start and the length of the crank angles, rad, a length of 0 for the turn.
    """
    from explore.base.lanes.designs import close_all  # imports Numba, needed only here
    from explore.mechanisms.linkages.metrics import CLOSED_METRICS

    first, count = kernel.n_constants + 1, len(inputs)
    parameters = np.vstack([inputs.T, np.repeat(np.array(interval)[:, None], count, axis=1)])
    rows = first + len(parameters) + len(CLOSED_METRICS)
    constants, status = np.empty((kernel.n_constants, count)), np.empty(count, np.int8)
    close_all(kernel.close, parameters, rows, first, rows, kernel.n_constants, constants, np.empty((0, count)), status)
    return constants, status


@lru_cache(_MOST_KEPT)
def _kernel(table: LinkageTable, point: str, link: str, is_output: bool = False) -> Kernel:
    """The kernel of a curve: the place of a point and its derivatives, then the same of the direction of a link.

    Or that of the output: the direction of its link, or its place and 0, then both derivatives of angle or place.
    """
    from explore.mechanisms.linkages.equations import Equations
    from explore.mechanisms.linkages.kernel import make_kernel
    from explore.mechanisms.linkages.steps import find_steps

    equations = Equations(replace(table, loads=None), find_steps(table))
    if is_output:
        outputs = _output_with_rates(equations)
    else:
        vectors = [equations.points[point]] if point else []
        vectors += [equations.directions[link]] if link else []
        # of a link alone, as the output of functions, its direction only
        outputs = [number for vector in vectors for number in _in_order(vector, 3 if point else 1)]
    joints = list(dict.fromkeys(factor.joint for factor in equations.factors))
    return make_kernel(equations, outputs, [], joints, (), (), tells_reach=False)


def _output_with_rates(equations: Equations) -> list[Number]:
    table = equations.table
    if table.output in table.sliders:
        place, *rates = equations.position_of(table.output).terms[:3]
        return [place, equations.graph.constant(0.0), *rates]
    return [*_in_order(equations.directions[table.output], 1), *equations.turning_of(table.output)]


def _in_order(vector: Sequence[Series], orders: int) -> list[Any]:
    """Both coordinates, then both first derivatives, then both second ones, or the first orders of these."""
    return [series.terms[order] for order in range(orders) for series in vector]


@dataclass(frozen=True)
class PointMotions:
    """Motions of points of a linkage by their names, with the links that they are on if `has_link`.

    Points are those of the table, or any that a user names of a floating link; for `turns` see `TableMotion`.
    """

    table: LinkageTable
    has_link: bool
    floating_link: str = ""
    turns: str = ""

    def __call__(self, point: str) -> TableMotion:
        """The motion of a point."""
        table = add_points(self.table, self.floating_link, (point,)) if self.floating_link else self.table
        return TableMotion(table, point, table.bodies_at(point)[0].name if self.has_link else "", turns=self.turns)


def declare_targets(table: LinkageTable, transmission: Sequence[str]) -> dict[str, TargetKind]:
    """How a linkage meets targets over its turn, by their kind, with the points of its table.

    `transmission` is the default objective of the transmission angle, if there is one.
    """
    if table.limits:
        return {}
    moving = tuple(point for point in table.points if point not in table.frame.place_of)
    single = tuple(point for point in moving if len(table.bodies_at(point)) == 1)
    pose, body_pose = (
        tuple(replace(each, long_name=words) for each, words in zip(parameters, _ORIGIN, strict=False))
        + parameters[len(_ORIGIN) :]
        for parameters in (POSE, BODY_POSE)
    )
    targets = {
        "path": declare_paths(PointMotions(table, has_link=False), ("path_error_rms", *transmission), pose, moving)
    }
    if single:
        errors = ("position_error_max", "angle_error_max", *transmission)
        targets["poses"] = declare_poses(PointMotions(table, has_link=True), errors, body_pose, single)
    travel = f"{table.output}_{'angle' if table.output_turns else 'position'}_peak_to_peak"
    return targets | _functions(table, transmission) | _dwells(table, travel, transmission)


def declare_targets_of_link(table: LinkageTable, link: str, transmission: str, travel: str) -> dict[str, TargetKind]:
    """The same with the points that a user names of a link.

    `transmission` is a metric that is to be large, NaN where the crank does not turn, and `travel` that of the output.
    """
    path, poses = (PointMotions(table, has_link, link, transmission) for has_link in (False, True))
    objectives = (f"{transmission}:max",)
    return {
        "path": declare_paths(path, ("path_error_rms", *objectives)),
        **_functions(table, objectives),
        "poses": declare_poses(poses, ("position_error_max", "angle_error_max", *objectives)),
        **_dwells(table, travel, objectives, transmission),
    }


def _functions(table: LinkageTable, transmission: Sequence[str]) -> dict[str, TargetKind]:
    """Functions of the output, if that is a link; a group of links has been followed where the crank turns fully."""
    if not table.output_turns:
        return {}
    output = TableMotion(table, "", table.output, needs_turn=bool(table.starts))
    return {"function": declare_functions(output, table.output, ("output_error_max", *transmission))}


def _dwells(table: LinkageTable, travel: str, objectives: Sequence[str], turns: str = "") -> dict[str, TargetKind]:
    """Dwells of the output, if there is one; `travel` is the metric of what this moves in a turn."""
    if not table.output:
        return {}
    output = TableMotion(table, "", is_output=True, turns=turns)
    return {"dwell": declare_dwells(output, table.output, travel, tuple(objectives), turns=table.output_turns)}
