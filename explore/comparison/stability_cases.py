"""Designs of each mechanism that approach a singular position, where the methods lose their accuracy or fail."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from explore.base.errors import RequestError
from explore.base.suggest import suggestion
from explore.comparison.methods.contract import Level, Task
from explore.comparison.methods.four_bar_loop import FOUR_BAR
from explore.comparison.methods.slider_crank_loop import SLIDER_CRANK
from explore.comparison.methods.variable_crank_loop import VARIABLE_CRANK, regular_position
from explore.comparison.methods.vector_loop import VectorLoop
from explore.model.quantities import FloatArray

#: Exponents of the powers of two that are added to a link, 64 mm to 9e-13 mm in steps of nearly a decade.
_MARGIN_EXPONENTS = (*range(6, -41, -3),)
#: Exponents of the powers of two that are subtracted from a link, mm, so that the crank is blocked.
_GAP_EXPONENTS = (2, -8, -20, -32)
#: Crank, coupler, rocker and ground, mm, that add up exactly: all links are collinear at crank angle 0.
_CHANGE_POINT = (150.0, 1083.5, 541.75, 691.75)
#: Crank, rod and offset, mm, that add up exactly: both are perpendicular to the guide at 270 deg.
_SLIDER_CHANGE_POINT = (150.0, 200.0, 50.0)
#: Slicer: rod, mm; slider's speed, mm/s; 100 revolutions per minute, rad/s; reversal time, s; blend order.
_SLICER = (500.0, 800.0, 100.0 * np.pi / 30.0, 0.1, 2.0)
#: Distances of a crank angle from the singular one, deg.
_DISTANCES = (0.5, *(10.0**-k for k in range(1, 14)), 0.0)


@dataclass(frozen=True, eq=False)
class StabilityCase:
    """Designs at several distances from a singular position, and on the other side of it where no full turn exists.

    The margin descends, 0 or negative beyond the singular position; `distance` says what it is, `beyond` what is at 0
    and less. The anchor of each design is a crank angle, rad, of every task, and a turn begins before it at `first` at
    the earliest. The singular angles, rad, are of the design at margin 0.
    """

    loop: VectorLoop
    distance: str
    beyond: str
    margin: FloatArray
    parameters: FloatArray
    anchor: FloatArray
    first: float
    singular_angles: tuple[float, ...]
    has_orders: bool = False

    def task(self, steps: int, designs: slice = slice(None)) -> Task:
        """A turn of some of the designs in so many steps, to velocities."""
        step = 2.0 * np.pi / steps
        anchor = self.anchor[designs, None]
        before = np.floor((anchor - self.first) / step + 1e-9)
        angles = anchor + (np.arange(steps + 1) - before) * step
        return Task(self.parameters[designs], np.ones(len(angles)), angles, Level.VELOCITIES, loop=self.loop)


def _with_margins(
    loop: VectorLoop, lengths: tuple[float, ...], link: int, distance: str, toggle: float, *, has_orders: bool
) -> StabilityCase:
    """A case of links whose margin is added to one of them; the turn begins a quarter after a dead centre."""
    margins = np.array([*(2.0**k for k in _MARGIN_EXPONENTS), 0.0, *(-(2.0**k) for k in reversed(_GAP_EXPONENTS))])
    parameters = np.tile(lengths, (len(margins), 1))
    parameters[:, link] += margins
    quarter = 0.5 * np.pi
    return StabilityCase(
        loop, distance, "no full turn exists", margins / loop.size(parameters.T), parameters,
        np.full(len(margins), quarter), quarter, (toggle,), has_orders,
    )  # fmt: skip


def _four_bar() -> StabilityCase:
    distance = "Grashof margin over the longest link"
    return _with_margins(FOUR_BAR, _CHANGE_POINT, 3, distance, 2.0 * np.pi, has_orders=True)


def _slider_crank() -> StabilityCase:
    distance = "length of the rod beyond crank plus offset, over the rod"
    return _with_margins(SLIDER_CRANK, _SLIDER_CHANGE_POINT, 1, distance, 1.5 * np.pi, has_orders=False)


def _variable_crank() -> StabilityCase:
    parameters = np.tile(_SLICER, (len(_DISTANCES), 1))
    regular, _, _ = regular_position(parameters.T)
    return StabilityCase(
        VARIABLE_CRANK, "distance of a crank angle from the singular one, deg", "it is the singular angle",
        np.array(_DISTANCES), parameters, regular + np.deg2rad(_DISTANCES), 0.0,
        (float(regular[0]), float(2.0 * np.pi - regular[0])),
    )  # fmt: skip


_CASES: dict[str, Callable[[], StabilityCase]] = {
    "crank-rocker": _four_bar,
    "slider-crank": _slider_crank,
    "variable-crank": _variable_crank,
}


def stability_case(mechanism: str) -> StabilityCase:
    """The case of a mechanism; `RequestError` if there is none."""
    if mechanism not in _CASES:
        raise RequestError(f"no stability map of {mechanism!r}; {suggestion(mechanism, [*_CASES, 'gears'])}")
    return _CASES[mechanism]()
