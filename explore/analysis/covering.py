"""Swing ranges of exchangeable cranks with an adjustable coupler, and their overlaps and gaps, in closed form.

The couplers with which the crank turns, and those that keep the bounds of the transmission angle, are intervals:
|rocker - ground| + crank < coupler < rocker + ground - crank for a crank shorter than both, and the transmission angle
is smallest at crank angle 0 and largest at 180 deg. Over the coupler the swing has one stationary point, its minimum,
where coupler^2 = crank^2 + |ground^2 - rocker^2| and sin(swing / 2) is the crank over the shorter of rocker and ground;
so the swing is smallest there or at an end of the travel, and largest at an end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from explore.base.errors import RequestError
from explore.base.units.shown import ShownUnits, in_units
from explore.evaluation.evaluate import evaluate_columns
from explore.mechanisms.crank_rocker.declaration import CRANK_ROCKER
from explore.model.quantities import FloatArray
from explore.studies.request.requests import make_request

if TYPE_CHECKING:
    import pandas as pd


#: Distance to keep from a change point, where the motion is undefined and the swing has a limit, over the lengths.
_CLEARANCE = 2e-15


@dataclass(frozen=True, repr=False)
class Coverage:
    """The swing range of each of several cranks over the travel of the coupler.

    Attributes
    ----------
    table
        One row per crank, ascending, in mm and deg unless shown in other units: ``crank``; ``coupler_min`` and
        ``coupler_max``, the usable part of the travel; ``swing_min`` and ``swing_max`` over it; ``overlap``, the width
        of the range that a smaller crank reaches too, negative for a gap, NaN for the smallest. All but ``crank`` are
        NaN where no coupler is usable.
        ``table.attrs["units"]`` has the units.
    rocker, ground
        Lengths, mm.
    """

    table: pd.DataFrame
    rocker: float
    ground: float
    _declared: Coverage | None = field(default=None, compare=False)
    _units: ShownUnits = field(default=ShownUnits(), compare=False)

    @property
    def units(self) -> tuple[str, str]:
        """The units of lengths and of angles."""
        units = self.table.attrs["units"]
        return units["crank"], units["swing_min"]

    @property
    def total(self) -> tuple[float, float]:
        """The smallest and the largest swing of all cranks, deg; NaN if no crank turns."""
        return float(self.table["swing_min"].min()), float(self.table["swing_max"].max())

    @property
    def gaps(self) -> tuple[tuple[float, float], ...]:
        """The ranges within `total` that no crank reaches, (start, end) in deg."""
        has_gap = self.table["overlap"] < 0.0
        ends, sizes = self.table.loc[has_gap, "swing_min"], -self.table.loc[has_gap, "overlap"]
        return tuple((end - size, end) for end, size in zip(ends.tolist(), sizes.tolist(), strict=True))

    def curves(self, points: int = 200) -> pd.DataFrame:
        """Swing angle over the coupler length, in columns crank, coupler (mm) and swing_angle (deg)."""
        import pandas as pd

        if self._declared is not None:
            curves = self._declared.curves(points)
            return in_units(curves, self._units.scales(curves.attrs["units"]))
        usable = self.table.dropna(subset=["swing_min"])
        cranks = np.repeat(usable["crank"].to_numpy(), points)
        couplers = np.linspace(usable["coupler_min"], usable["coupler_max"], points, axis=1).ravel()
        swings = _swings(cranks, couplers, self.rocker, self.ground)
        return _add_units(pd.DataFrame({"crank": cranks, "coupler": couplers, "swing_angle": swings}))

    def in_units(self, units: ShownUnits) -> Coverage:
        """The same with all values in the chosen units."""
        table = in_units(self.table, units.scales(self.table.attrs["units"]))
        rocker, ground = (units.scale("mm").show(length) for length in (self.rocker, self.ground))
        return Coverage(table, rocker, ground, self, units)

    def __repr__(self) -> str:
        low, high = self.total
        _, unit = self.units
        gaps = ", ".join(f"{start:.6g} to {end:.6g}" for start, end in self.gaps)
        summary = f"{low:.6g} to {high:.6g} {unit}, " + (f"but not {gaps} {unit}" if gaps else "without a gap")
        if np.isnan(low):
            summary = "no crank turns with any of these couplers"
        return f"{self.table.to_string(index=False)}\n{summary}"


def coverage(
    cranks: Sequence[float],
    *,
    rocker: float,
    ground: float,
    coupler: tuple[float, float],
    transmission_angle: tuple[float, float] = (0.0, 180.0),
) -> Coverage:
    """Compute the swing ranges of exchangeable cranks over the travel of an adjustable coupler.

    Parameters
    ----------
    cranks
        Lengths, mm.
    rocker, ground
        Lengths, mm.
    coupler
        Shortest and longest length of the travel, mm.
    transmission_angle
        Smallest and largest allowed transmission angle over the turn, deg, on both sides of 90 deg.

    Returns
    -------
    Coverage

    Raises
    ------
    RequestError
        If a length is not positive and finite, bounds are not ascending, or those of the transmission angle are not on
        both sides of 90 deg.
    """
    import pandas as pd

    lengths = np.unique(_to_array("cranks", cranks))
    _check(lengths, rocker, ground, coupler, transmission_angle)
    low, high = _travel(lengths, rocker, ground, coupler, transmission_angle)
    stationary = np.sqrt(lengths**2 + abs(ground - rocker) * (ground + rocker))
    couplers = [low, high, np.where((stationary > low) & (stationary < high), stationary, low)]
    swings = np.array([_swings(lengths, coupler, rocker, ground) for coupler in couplers])
    smallest, largest = swings.min(axis=0), swings.max(axis=0)
    table = {
        "crank": lengths,
        "coupler_min": low,
        "coupler_max": high,
        "swing_min": smallest,
        "swing_max": largest,
        "overlap": _overlaps(smallest, largest),
    }
    return Coverage(_add_units(pd.DataFrame(table)), float(rocker), float(ground))


def _check(
    cranks: FloatArray,
    rocker: float,
    ground: float,
    coupler: tuple[float, float],
    transmission_angle: tuple[float, float],
) -> None:
    if cranks.ndim != 1 or len(cranks) == 0:
        raise RequestError("cranks: give at least one length")
    for name, length in (("cranks", cranks), ("rocker", rocker), ("ground", ground), ("coupler", coupler)):
        values = _to_array(name, length)
        if not np.all((values > 0.0) & np.isfinite(values)):
            raise RequestError(f"{name}: lengths must be positive and finite, got {length}")
    for name, bounds in (("coupler", coupler), ("transmission_angle", transmission_angle)):
        values = _to_array(name, bounds)
        if values.shape != (2,) or not values[0] <= values[1]:
            raise RequestError(f"{name}: must be two numbers, the smaller first, got {bounds}")
    for name, length in (("rocker", rocker), ("ground", ground)):
        if np.ndim(length) > 0:
            raise RequestError(f"{name}: must be one length, got {length}")
    if not 0.0 <= transmission_angle[0] <= 90.0 <= transmission_angle[1] <= 180.0:
        raise RequestError(f"transmission_angle: bounds must lie on both sides of 90 deg, got {transmission_angle}")


def _to_array(name: str, value: object) -> FloatArray:
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise RequestError(f"{name}: must be numbers, got {value!r}") from None


def _travel(
    crank: FloatArray,
    rocker: float,
    ground: float,
    coupler: tuple[float, float],
    transmission_angle: tuple[float, float],
) -> tuple[FloatArray, FloatArray]:
    """Shortest and longest usable coupler for each crank, mm, each (n,); NaN where no coupler is usable."""
    clearance = _CLEARANCE * (crank + rocker + ground)
    angle_min, angle_max = np.radians(transmission_angle)
    with np.errstate(invalid="ignore"):
        # Couplers at which the transmission angle is at a bound: law of cosines for coupler, rocker and diagonal.
        half_width = np.sqrt((ground - crank) ** 2 - (rocker * np.sin(angle_min)) ** 2)
        lower_limit = rocker * np.cos(angle_max) + np.sqrt((ground + crank) ** 2 - (rocker * np.sin(angle_max)) ** 2)
    # NaN where the rocker is so long that no coupler reaches the upper bound.
    lower_limit = np.where(np.isnan(lower_limit), 0.0, lower_limit)
    low = np.maximum.reduce(np.broadcast_arrays(
        coupler[0], abs(rocker - ground) + crank + clearance, rocker * np.cos(angle_min) - half_width, lower_limit
    ))  # fmt: skip
    high = np.minimum.reduce(np.broadcast_arrays(
        coupler[1], rocker + ground - crank - clearance, rocker * np.cos(angle_min) + half_width
    ))  # fmt: skip
    is_usable = low <= high  # only if the crank is shorter than rocker and ground
    return np.where(is_usable, low, np.nan), np.where(is_usable, high, np.nan)


def _swings(crank: FloatArray, coupler: FloatArray, rocker: float, ground: float) -> FloatArray:
    """Swing angle of each linkage, deg, (n,); NaN where the crank cannot turn."""
    n = len(crank)
    lengths = {"crank": crank, "coupler": coupler, "rocker": np.full(n, rocker), "ground": np.full(n, ground)}
    request = make_request(CRANK_ROCKER, metrics=["swing_angle"])
    return np.asarray(evaluate_columns(request, lengths).columns["swing_angle"], dtype=np.float64)


def _add_units(frame: pd.DataFrame) -> pd.DataFrame:
    """Add the units of the columns to a table: swings and overlaps are angles, all others lengths."""
    angles = {"swing_angle", "swing_min", "swing_max", "overlap"}
    frame.attrs["units"] = {name: "deg" if name in angles else "mm" for name in frame.columns}
    return frame


def _overlaps(smallest: FloatArray, largest: FloatArray) -> FloatArray:
    """Width of the part of each range that lies within the ranges before it, deg, (n,); negative for a gap."""
    largest_before = np.fmax.accumulate(np.concatenate([[np.nan], largest[:-1]]))
    return np.minimum(largest_before, largest) - smallest
