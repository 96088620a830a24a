"""Dwells of sliders: arcs of coupler points of many crank-rockers, with guides, fitted in stages and then polished.

Crank-rockers are drawn at random within the bound on the transmission angle. Each has up to two coupler points that
five positions of the dwell hold on a circle; over long dwells points whose arcs are farther from circles may be better,
so points anywhere are starts too. Each stage takes on the best, most of them with points that are not alike.
"""

import math

import numpy as np

from explore.base.errors import RequestError
from explore.model.quantities import FloatArray
from explore.synthesis.dwell_fitting import DwellTask, Fits, fit
from explore.synthesis.dwell_motions import ACROSS, ALONG, GROUND, slider_motions
from explore.synthesis.dwell_points import couplers, five_position_points
from explore.synthesis.dwell_polishing import Polished, polish
from explore.synthesis.dwells import Dwell, fit_circles, measure_slider
from explore.synthesis.linkages import ComplexArray, FourBar, distinct

#: Number of crank-rockers that are drawn.
N_DRAWN = 8_000
#: Largest number of rounds of drawing.
_N_ROUNDS = 4
#: Number of directions of guides tried with each point.
_N_DIRECTIONS = 16
#: Cosine of the transmission angle of the drawn crank-rockers nearest to locking, of which there is no end.
_LARGEST_COSINE = float(np.cos(np.radians(10.0)))
#: Number of crank angles over the dwell at which starts are compared.
_N_DWELL = 13
#: Number of crank angles over the turn at which starts are compared.
_N_TURN = 24
#: Penalty per unit of constraint violation when starts are ranked, in travels over the dwell.
_PRICE = 0.5
#: Number of starts that are fitted.
N_STARTS = 300
#: Number of starts for each linkage that is asked for, beside `N_STARTS`.
_PER_LINKAGE = 10
#: Number of starts for each linkage that is asked for that go on from each stage, beside the stage's own.
_MORE = 2
#: Steps, weight of limits, and starts that go on of each stage; light limits at first bring more to where the best are.
_STAGES = ((20, 0.1, 70), (60, 0.1, 20), (60, 0.5, 4))
#: Size of the cells in which starts are alike, in cranks.
_CELL = 0.6
#: Share of the starts that are taken from different cells.
_UNLIKE = 0.7
#: Difference of numbers below which linkages are the same.
_SAME = 1e-3


def find_dwells(task: DwellTask, count: int = 5, seed: int = 0) -> list[Dwell]:
    """Dwells of least travel that were found, each a local optimum, best first; the crank is 1.

    `count` are wanted; all that were found are returned. Where none is within the limits, they are the ones that miss
    them least; none where not even their links reach the guides over the whole turn. Raises `RequestError` if no
    crank-rocker is within the limits of transmission angle and lengths.
    """
    fits = _best(_starts(task, np.random.default_rng(seed)), N_STARTS + _PER_LINKAGE * count)
    for n_steps, weight, n_kept in _STAGES:
        fits = _best(fit(task, fits, n_steps, weight), n_kept + _MORE * count)
    polished = [polish(task, numbers, side) for numbers, side in zip(fits.numbers, fits.sides, strict=True)]

    def are_same(one: Polished, other: Polished) -> bool:
        return not np.abs(one.numbers - other.numbers).max() > _SAME

    found = distinct(sorted(polished, key=lambda each: each.cost), are_same)
    return [dwell for each in found if (dwell := _dwell(task, each)) is not None]


def _best(fits: Fits, count: int) -> Fits:
    """The best fits, most of them with unlike coupler points."""
    fits = fits.rows(np.argsort(fits.errors, kind="stable"))
    cells = np.column_stack([np.floor(fits.numbers[:, [ALONG, ACROSS, GROUND]] / _CELL), fits.sides])
    unlike = np.sort(np.unique(cells, axis=0, return_index=True)[1])[: int(_UNLIKE * count)]
    others = np.setdiff1d(np.arange(len(cells)), unlike)[: count - len(unlike)]
    return fits.rows(np.concatenate([unlike, others]))


def _dwell(task: DwellTask, found: Polished) -> Dwell | None:
    """The dwell of nine numbers, measured; None where the link does not reach the guide over the whole turn."""
    turned = np.linspace(0.0, task.span, _N_DWELL)
    rest = slider_motions(found.numbers[None], np.array([found.side]), turned).positions
    coupler, rocker, ground, along, across, start, direction, link, offset = found.numbers.tolist()
    linkage = FourBar(0j, complex(ground), 1.0, coupler, rocker, complex(along, across) / coupler)
    centre = complex(rest.max() + rest.min(), 2.0 * offset) / 2.0 * complex(math.cos(direction), math.sin(direction))
    start, direction = start % (2.0 * math.pi), direction % math.pi
    try:
        return measure_slider(linkage, start, task.span, direction, link, centre)
    except RequestError:
        return None


def _draw(task: DwellTask, rng: np.random.Generator) -> FloatArray:
    """Couplers, rockers and grounds, shape (n, 3), within the limits of the transmission angle and the lengths.

    With u the sum of the squares of coupler and rocker and v twice their product, the limits of the transmission angle
    with the crank along and against the ground are two lines in the plane of u and v, where v <= u is a third.
    """
    ratio, largest = task.link_ratio_max, math.cos(task.transmission_angle_min)
    best = 2.0 * ratio / (ratio**2 + 1.0)
    if largest <= best:
        raise RequestError(
            f"crank-rockers with links of at most {ratio:.4g} cranks have a transmission angle of at most "
            f"{math.degrees(math.acos(best)):.4g} deg; lower transmission_angle_min or raise link_ratio_max"
        )
    largest = min(largest, max(_LARGEST_COSINE, 0.5 * (1.0 + best)))
    # The least ground for which the three lines leave a triangle.
    least = (1.0 + math.sqrt(1.0 - largest**2)) / largest
    drawn: list[FloatArray] = []
    for _ in range(_N_ROUNDS):
        ground, place, share = rng.uniform(size=(3, N_DRAWN))
        ground = least + (ratio - least) * ground
        ends = np.sqrt((ground + 1.0) ** 2 / (1.0 + largest)), np.sqrt((ground - 1.0) ** 2 / (1.0 - largest))
        u = (ends[0] + (np.minimum(ends[1], math.sqrt(2.0) * ratio) - ends[0]) * place) ** 2
        v = np.maximum(u - (ground - 1.0) ** 2, (ground + 1.0) ** 2 - u) / largest
        difference = np.sqrt(np.maximum(u - v, 0.0)) * (2.0 * share - 1.0)
        total = np.sqrt(2.0 * u - difference**2)
        lengths = np.column_stack([total + difference, total - difference, 2.0 * ground]) / 2.0
        drawn.append(lengths[((lengths >= 1.0) & (lengths <= ratio)).all(axis=1)])
        if sum(map(len, drawn)) >= N_DRAWN:
            break
    return np.concatenate(drawn)[:N_DRAWN]


def _starts(task: DwellTask, rng: np.random.Generator) -> Fits:
    """Points of drawn crank-rockers with the guides through the centres of their arcs that miss the limits least."""
    lengths = _draw(task, rng)
    begins = rng.uniform(0.0, 2.0 * np.pi, len(lengths))
    # Chebyshev's places: the arc between them stays near the circle.
    places = 0.5 * (1.0 - np.cos(np.pi * (np.arange(5) + 0.5) / 5.0))
    held, centres = five_position_points(lengths, begins[:, None] + task.span * places)
    reach = task.link_ratio_max * np.sqrt(rng.uniform(size=len(lengths)))
    anywhere = reach * np.exp(1j * rng.uniform(0.0, 2.0 * np.pi, len(lengths)))
    dwell = couplers(lengths, begins[:, None] + np.linspace(0.0, task.span, _N_DWELL))
    fitted = fit_circles(dwell.pins + dwell.directions * anywhere[:, None])
    points, centres = np.concatenate([*held.T, anywhere]), np.concatenate([*centres.T, fitted])
    with np.errstate(invalid="ignore"):
        near = np.flatnonzero((np.abs(points) <= 1.5 * task.link_ratio_max) & np.isfinite(centres))
    of_lengths = near % len(lengths)
    return _with_guides(task, lengths[of_lengths], begins[of_lengths], points[near], centres[near])


def _with_guides(
    task: DwellTask, lengths: FloatArray, begins: FloatArray, points: ComplexArray, centres: ComplexArray
) -> Fits:
    """Starts with the direction of the guide through each centre that misses the limits least."""
    dwell = couplers(lengths, begins[:, None] + np.linspace(0.0, task.span, _N_DWELL))
    turn = couplers(lengths, begins[:, None] + np.arange(_N_TURN) * (2.0 * np.pi / _N_TURN))
    arcs, paths = (each.pins + each.directions * points[:, None] - centres[:, None] for each in (dwell, turn))
    links, travels = np.abs(arcs).mean(axis=1), np.ptp(np.abs(arcs), axis=1)
    directions = np.arange(_N_DIRECTIONS) * (np.pi / _N_DIRECTIONS)
    missed = np.empty((len(links), _N_DIRECTIONS))
    sides = np.where((arcs[:, :1] * np.exp(-1j * directions)).real > 0.0, -1.0, 1.0)
    for at, direction in enumerate(directions):
        own = paths * np.exp(-1j * direction)
        sines = own.imag / links[:, None]
        positions = own.real + (sides[:, at] * links)[:, None] * np.sqrt(np.maximum(1.0 - sines**2, 0.0))
        missed[:, at] = np.maximum(np.abs(sines).max(axis=1) - np.sin(task.pressure_angle_max), 0.0)
        missed[:, at] += np.maximum(task.stroke - np.ptp(positions, axis=1), 0.0)
    every, best = np.arange(len(links)), missed.argmin(axis=1)
    too_long = np.maximum(np.abs(points) - task.link_ratio_max, 0.0) + np.maximum(links - task.link_ratio_max, 0.0)
    offsets = (centres * np.exp(-1j * directions[best])).imag
    numbers = [*lengths.T, points.real, points.imag, begins, directions[best], links, offsets]
    costs = travels + _PRICE * (missed[every, best] + too_long)
    return Fits(np.column_stack(numbers), sides[every, best], costs)
