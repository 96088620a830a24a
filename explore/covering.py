"""What a set of exchangeable cranks covers when the coupler is adjustable: the swings of each, overlaps and gaps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from explore.errors import RequestError
from explore.evaluation import evaluate_columns
from explore.mechanisms.crank_rocker import CRANK_ROCKER
from explore.request.requests import make_request
from explore.vocabulary import FloatArray

if TYPE_CHECKING:
    import pandas as pd

#: Part of the lengths by which to stay off a change point, where no motion is defined; the swing has a limit there.
_CLEARANCE = 2e-15


@dataclass(frozen=True, repr=False)
class Coverage:
    """The swings that each of several cranks reaches over the travel of the coupler.

    Attributes
    ----------
    table
        A row for each crank, ascending, in mm and deg: ``crank``; the part ``coupler_min`` to ``coupler_max`` of the
        travel that can be used; ``swing_min`` and ``swing_max`` over it; ``overlap``, the swings that a smaller crank
        reaches as well, negative where a gap lies between. NaN where no coupler can be used, and no smaller crank.
    rocker, ground
        mm.
    """

    table: pd.DataFrame
    rocker: float
    ground: float

    @property
    def total(self) -> tuple[float, float]:
        """The smallest and the largest swing, deg; NaN when there is none."""
        return float(self.table["swing_min"].min()), float(self.table["swing_max"].max())

    @property
    def gaps(self) -> tuple[tuple[float, float], ...]:
        """The swings between them that no crank reaches, each from and to, deg."""
        gapped = self.table["overlap"] < 0.0
        ends, sizes = self.table.loc[gapped, "swing_min"], -self.table.loc[gapped, "overlap"]
        return tuple((end - size, end) for end, size in zip(ends.tolist(), sizes.tolist(), strict=True))

    def curves(self, points: int = 200) -> pd.DataFrame:
        """The swing over the coupler's length: columns crank, coupler (mm) and swing_angle (deg)."""
        import pandas as pd

        usable = self.table.dropna(subset=["swing_min"])
        cranks = np.repeat(usable["crank"].to_numpy(), points)
        couplers = np.linspace(usable["coupler_min"], usable["coupler_max"], points, axis=1).ravel()
        swings = _swings(cranks, couplers, self.rocker, self.ground)
        return pd.DataFrame({"crank": cranks, "coupler": couplers, "swing_angle": swings})

    def __repr__(self) -> str:
        low, high = self.total
        gaps = ", ".join(f"{start:.6g} to {end:.6g}" for start, end in self.gaps)
        words = f"{low:.6g} to {high:.6g} deg, " + (f"but not {gaps} deg" if gaps else "without a gap")
        return f"{self.table.to_string(index=False)}\n{words}"


def coverage(
    cranks: Sequence[float],
    *,
    rocker: float,
    ground: float,
    coupler: tuple[float, float],
    transmission_angle: tuple[float, float] = (0.0, 180.0),
) -> Coverage:
    """The swings that exchangeable cranks reach over the travel of an adjustable coupler.

    Parameters
    ----------
    cranks
        Lengths, mm.
    rocker, ground
        mm.
    coupler
        The shortest and the longest that can be set, mm.
    transmission_angle
        Bounds that the transmission angle has to keep over the whole turn, deg; 90 deg lies between them.

    Returns
    -------
    Coverage

    Raises
    ------
    RequestError
        If a length is not positive and finite, or bounds are out of order.

    Notes
    -----
    All of it is closed form. The couplers with which the crank turns, and those that keep the bounds, are intervals:
    |rocker - ground| + crank < coupler < rocker + ground - crank for a crank shorter than both, and the transmission
    angle is smallest at crank angle 0 and largest at 180 deg. Over the coupler the swing has one stationary point, its
    minimum, where coupler^2 = crank^2 + |ground^2 - rocker^2| and sin(swing / 2) is the crank over the shorter of
    rocker and ground; so the swing is smallest there or at an end of the travel, and largest at an end.
    """
    import pandas as pd

    lengths = np.unique(_numbers("cranks", cranks))
    _check(lengths, rocker, ground, coupler, transmission_angle)
    low, high = _travel(lengths, rocker, ground, coupler, transmission_angle)
    stationary = np.sqrt(lengths**2 + abs(ground - rocker) * (ground + rocker))
    ends = [low, high, np.where((stationary > low) & (stationary < high), stationary, low)]
    swings = np.array([_swings(lengths, end, rocker, ground) for end in ends])
    smallest, largest = swings.min(axis=0), swings.max(axis=0)
    table = {
        "crank": lengths,
        "coupler_min": low,
        "coupler_max": high,
        "swing_min": smallest,
        "swing_max": largest,
        "overlap": _overlaps(smallest, largest),
    }
    return Coverage(pd.DataFrame(table), float(rocker), float(ground))


def _check(
    cranks: FloatArray,
    rocker: float,
    ground: float,
    coupler: tuple[float, float],
    transmission_angle: tuple[float, float],
) -> None:
    if cranks.ndim != 1 or len(cranks) == 0:
        raise RequestError("cranks: name at least one length")
    for name, length in (("cranks", cranks), ("rocker", rocker), ("ground", ground), ("coupler", coupler)):
        values = _numbers(name, length)
        if not np.all((values > 0.0) & np.isfinite(values)):
            raise RequestError(f"{name}: lengths must be positive and finite, got {length}")
    for name, bounds in (("coupler", coupler), ("transmission_angle", transmission_angle)):
        values = _numbers(name, bounds)
        if values.shape != (2,) or not values[0] <= values[1]:
            raise RequestError(f"{name}: must be two numbers, the smaller first, got {bounds}")
    for name, length in (("rocker", rocker), ("ground", ground)):
        if np.ndim(length) > 0:
            raise RequestError(f"{name}: coverage is of one rig, give one length, got {length}")
    if not 0.0 <= transmission_angle[0] <= 90.0 <= transmission_angle[1] <= 180.0:
        raise RequestError(f"transmission_angle: bounds lie on both sides of 90 deg, got {transmission_angle}")


def _numbers(name: str, given: object) -> FloatArray:
    try:
        return np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise RequestError(f"{name}: must be numbers, got {given!r}") from None


def _travel(
    crank: FloatArray,
    rocker: float,
    ground: float,
    coupler: tuple[float, float],
    transmission_angle: tuple[float, float],
) -> tuple[FloatArray, FloatArray]:
    """The shortest and the longest coupler that can be used with each crank, each (n,); NaN where there is none."""
    clearance = _CLEARANCE * (crank + rocker + ground)
    least, most = np.radians(transmission_angle)
    with np.errstate(invalid="ignore"):
        # Where the transmission angle has its bound, by the law of cosines in the triangle coupler, rocker, diagonal.
        half = np.sqrt((ground - crank) ** 2 - (rocker * np.sin(least)) ** 2)
        floor = rocker * np.cos(most) + np.sqrt((ground + crank) ** 2 - (rocker * np.sin(most)) ** 2)
    # A rocker so long that no coupler reaches the upper bound.
    floor = np.where(np.isnan(floor), 0.0, floor)
    low = np.maximum.reduce(np.broadcast_arrays(
        coupler[0], abs(rocker - ground) + crank + clearance, rocker * np.cos(least) - half, floor
    ))  # fmt: skip
    high = np.minimum.reduce(np.broadcast_arrays(
        coupler[1], rocker + ground - crank - clearance, rocker * np.cos(least) + half
    ))  # fmt: skip
    usable = (low <= high) & (crank < min(rocker, ground))
    return np.where(usable, low, np.nan), np.where(usable, high, np.nan)


def _swings(crank: FloatArray, coupler: FloatArray, rocker: float, ground: float) -> FloatArray:
    """Swing of each linkage, deg, (n,); NaN where the crank cannot turn."""
    others = {"rocker": np.full(len(crank), rocker), "ground": np.full(len(crank), ground)}
    request = make_request(CRANK_ROCKER, ["swing_angle"])
    swings: FloatArray = evaluate_columns(request, {"crank": crank, "coupler": coupler, **others}).columns[
        "swing_angle"
    ]
    return swings


def _overlaps(smallest: FloatArray, largest: FloatArray) -> FloatArray:
    """What each range has in common with those before it, or less than nothing where there is a gap, (n,)."""
    before = np.fmax.accumulate(np.concatenate([[np.nan], largest[:-1]]))
    return np.minimum(before, largest) - smallest
