"""The blind solution of the five equations of a gear pair's law from random starts, against its scalar equation.

Publications give five equations for the constants k, C0 … C3 of the sine law and solve them by a root finder from a
start. With L = ln m, A = 1/(k L), B = A/m^b and the return f = C0 sin(C1 (phi - C2)) + C3 they are

    f(b) = B,  f(2 pi) = A,  f'(b) = -L B,  f'(2 pi) = -L A,  k (m^b - 1) + integral of dphi/f from b to 2 pi = 2 pi.

They have one solution for each branch, of which the first is of use. `explore.mechanisms.gears.sine_law` solves a
scalar equation for the branch that is asked for.
"""

import math
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import optimize

from explore.evaluation.evaluate import evaluate_columns
from explore.mechanisms.gears.declaration import GEARS
from explore.model.quantities import FloatArray
from explore.studies.request.requests import make_request

#: Name of the mechanism with this law.
MECHANISM = GEARS.name
#: Growth of the published pair, 1/rad.
GROWTH = 1.5
#: Sector of the published pair, rad.
SECTOR = 4.2
#: Title of the table of outcomes.
TITLE = f"fsolve on the five equations of gears of growth {GROWTH:g}, sector {SECTOR:g} rad"
#: Number of starts.
START_COUNT = 2000
#: Box from which starts are drawn, k, C0, C1, C2, C3; it holds the constants of three branches.
START_BOX = np.array([[0.1, 3.0], [0.1, 3.0], [0.1, 8.0], [0.0, 2.0 * math.pi], [0.1, 3.0]])
#: Number of branches whose constants are known.
_BRANCHES = 12
#: Outcomes in the order of tables; "inaccurate" is a success that the solver reports away from all branches.
OUTCOMES = ("branch 1", "branch 2", "branch 3", "higher branches", "inaccurate", "reported failure")

_HIGHER, _INACCURATE, _FAILED = OUTCOMES[3:]
#: Metrics of a gear pair that are the constants k, C0, C1, C2, C3.
_CONSTANTS = ("law_constant", "return_amplitude", "return_frequency", "return_shift", "return_mean")
# Gauss-Legendre rule for the integral: with 48 nodes the third branch would have five digits.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(128)


def five_equations(constants: FloatArray, growth: float, sector: float) -> FloatArray:
    """Residuals of the five equations at k, C0, C1, C2, C3."""
    k, c0, c1, c2, c3 = constants
    log_growth, ends = math.log(growth), np.array([sector, 2.0 * math.pi])
    ratios = 1.0 / (k * log_growth) * np.array([growth**-sector, 1.0])
    half = 0.5 * (2.0 * math.pi - sector)
    angles = sector + half * (1.0 + _NODES)
    turned = k * (growth**sector - 1.0) + half * _WEIGHTS @ (1.0 / (c0 * np.sin(c1 * (angles - c2)) + c3))
    return np.array([
        *(c0 * np.sin(c1 * (ends - c2)) + c3 - ratios),
        *(c0 * c1 * np.cos(c1 * (ends - c2)) + log_growth * ratios),
        turned - 2.0 * math.pi,
    ])  # fmt: skip


def solve_from_starts(
    goal: float, count: int, seed: int = 0, progress: Callable[[str], None] | None = None
) -> list[dict[str, Any]]:
    """Solve the five equations from random starts by `scipy.optimize.fsolve` at its default tolerance.

    The goal is the largest relative difference of constants from those of a branch. Rows with the keys start_k …
    start_c3 and k … c3 (the starts and what they lead to), outcome (of `OUTCOMES`), evaluations.
    """
    low, high = START_BOX.T
    starts = np.random.default_rng(seed).uniform(low, high, (count, len(START_BOX)))
    branches, names = solve_scalar_equation(), ("k", "c0", "c1", "c2", "c3")
    rows = []
    for start in starts:
        if progress is not None:
            progress("fsolve")
        with np.errstate(all="ignore"):  # a blind iteration may cross poles
            found, info, code, _ = optimize.fsolve(five_equations, start, (GROWTH, SECTOR), full_output=True)
        rows.append({
            **{f"start_{name}": float(value) for name, value in zip(names, start, strict=True)},
            **{name: float(value) for name, value in zip(names, found, strict=True)},
            "outcome": _outcome(found, branches, goal) if code == 1 else _FAILED,
            "evaluations": int(info["nfev"]),
        })  # fmt: skip
    return rows


def solve_scalar_equation() -> FloatArray:
    """The constants k, C0 … C3 of the branches 1, 2 … of the published pair, shape (branches, 5)."""
    request = make_request(GEARS, metrics=list(_CONSTANTS))
    branch = np.arange(1.0, _BRANCHES + 1.0)
    design = {"growth": GROWTH, "sector": SECTOR, "centre_distance": 1.0}
    inputs = {name: np.full(_BRANCHES, value) for name, value in design.items()}
    columns = evaluate_columns(request, {**inputs, "branch": branch}).columns
    return np.stack([columns[name] for name in _CONSTANTS], axis=1)


def _outcome(found: FloatArray, branches: FloatArray, goal: float) -> str:
    """The branch of a solution, whose C0, C1 may have other signs and C2 other periods."""
    known = branches[:, [0, 1, 2, 4]]
    difference = np.abs(np.array([found[0], abs(found[1]), abs(found[2]), found[4]]) / known - 1.0).max(axis=1)
    nearest = int(difference.argmin())
    if difference[nearest] > goal:
        return _INACCURATE
    return OUTCOMES[min(nearest, OUTCOMES.index(_HIGHER))]


def count_outcomes(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Number and share of the starts with each outcome: keys outcome, starts, share."""
    counts = Counter(row["outcome"] for row in rows)
    return [{"outcome": name, "starts": counts[name], "share": counts[name] / len(rows)} for name in OUTCOMES]
