"""Work space and tables of the compiled loop, as named tuples of arrays, which Numba takes as their members.

The arrays are made by NumPy: compiling their creation would take seconds.
"""

from threading import Lock
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import types

from explore.base.compiling import LANES
from explore.evaluation.quadrature.bounds import BOUNDS_SIZE, CHUNK
from explore.evaluation.quadrature.chunks import CODES, MOST_KINDS
from explore.evaluation.quadrature.corners import SEARCH_SIZE
from explore.evaluation.quadrature.cutting import MOST_PARTS
from explore.evaluation.quadrature.extremes import STATE_SIZE
from explore.evaluation.quadrature.hand_over import HAND_OVER_SIZE
from explore.evaluation.quadrature.panels import PANEL_CAPACITY, PANELS_SIZE
from explore.evaluation.quadrature.resolving import PARTS_SIZE
from explore.evaluation.quadrature.rounding import STRIDE
from explore.evaluation.quadrature.tiles import NODE_CAPACITY, SHAPE_SIZE, SUMS_SIZE
from explore.evaluation.quadrature.zeros import MOST_ZEROS

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

_F1, _I1, _I2 = types.float64[::1], types.int64[::1], types.int64[:, ::1]
_INT, _FLOAT = types.int64, types.float64


class Sizes(NamedTuple):
    """Rows of a mechanism's arrays.

    Attributes
    ----------
    record_rows, first_parameter, n_constants, n_fill_constants
        Rows of a tile of records, the first of the parameters, the number of constants and of those that `fill` reads.
    rows
        Number of signal rows.
    noise_row, variant_row
        Rows of the constants that hold the amplification of rounding errors and the variant; -1 for none.
    is_disturbed
        Whether the mechanism has a disturbed kernel, which tells of rounding errors; 0 for no.
    """

    record_rows: int
    first_parameter: int
    n_constants: int
    n_fill_constants: int
    rows: int
    noise_row: int
    variant_row: int
    is_disturbed: int


class Tables(NamedTuple):
    """What to compute.

    Attributes
    ----------
    windows : (w, 8), intervals : (w, 3)
        Specifications of the windows, with the columns KIND … of `quadrature.slots`; of explicit ones anchor,
        start and length, as for `explore.evaluation.quadrature.windows.add_interval`.
    breaks : (b,)
        Rows of the constants that hold the half-tangents where laws change.
    singular_rows, singular_anchors : (3,)
        Rows of the constants that hold the half-tangents of the distances of singularities, and their anchors; -1 for
        none.
    needs : (w,), row_needs : (s,), flags : (w, s), orders : (w, s)
        Bits of the signals to fill, of all and of each row; for each row, flags of `quadrature.bounds` (0: skip) and
        pole order.
    term_rows : (s,)
        For a signal that is a sum of terms, the row with the size of the terms; -1 for other signals.
    lag_rows : (s,)
        For a signal that something follows with a lag, the row with the rate of this; -1 for other signals.
    references : (s,)
        Row of the parameters with the length that a signal is relative to; -1 for signals without a unit of length.
    corner_rows : (c, 2), corner_levels : (c,)
        Rows, the same one after another, at whose levels others have corners, which the adaptive rule cuts its panels
        at, and those with the sizes of their terms, -1 for none; and the levels.
    sense_count
        Number of the first of these rows whose signs are bits of the law.
    slots : (w, s, 10)
        Row of the statistics for each statistic (MEAN, VARIANCE, … of `quadrature.slots`) of a row over a
        window; -1 for none.
    tolerance
        Relative, in the norms of `explore.evaluation.evaluate`.
    is_adaptive
        Whether panels are halved as their samples demand; else their nodes follow from the singularities.
    is_located
        Whether these may stand above any angle: full turns have equal steps, and designs that would need too many are
        left to the adaptive rule.
    is_anchored
        Whether one stands at a known place, which panels are graded towards; see
        `explore.evaluation.quadrature.anchored`.
    is_resolved
        Whether turns have as many equal steps as resolve their signals, and their pieces, where they are cut, as many
        nodes; see `explore.evaluation.quadrature.resolving` and `explore.evaluation.quadrature.pieces`.
    size_of, row_of, rules
        From `explore.evaluation.quadrature.rules`.
    turn_factors, piece_factors
        From `explore.evaluation.quadrature.resolving` and `explore.evaluation.quadrature.pieces`.
    """

    windows: IntArray
    intervals: FloatArray
    breaks: IntArray
    singular_rows: IntArray
    singular_anchors: IntArray
    needs: IntArray
    row_needs: IntArray
    flags: IntArray
    orders: IntArray
    term_rows: IntArray
    lag_rows: IntArray
    references: IntArray
    corner_rows: IntArray
    corner_levels: FloatArray
    slots: IntArray
    sense_count: int
    tolerance: float
    is_adaptive: bool
    is_located: bool
    is_anchored: bool
    is_resolved: bool
    size_of: IntArray
    row_of: IntArray
    rules: FloatArray
    turn_factors: FloatArray
    piece_factors: FloatArray


class TileWork(NamedTuple):
    """Work space for one tile."""

    lane_panels: IntArray
    lane_designs: IntArray
    offsets: npt.NDArray[np.uint64]
    constants: FloatArray
    shape: FloatArray
    tangents: FloatArray
    weights: FloatArray
    roots: FloatArray
    factors: FloatArray
    signals: FloatArray
    sums: FloatArray
    state: FloatArray
    node: FloatArray
    node_signals: FloatArray
    few_tangents: FloatArray
    disturbed: FloatArray
    parts: FloatArray
    search: FloatArray
    values: FloatArray
    marks: FloatArray


class PanelSums(NamedTuple):
    """Weights of panels, one number each, and of their signals, row after row, the sums, extremes and tails.

    `quadrature.tails` says what a tail is; `earlier_tails` are those on the panel of which this one is a half, and
    `roundings` squares of amplifications of `quadrature.rounding`, and of extremes those of the largest ones and of the
    largest samples. `panel_errors` and `panel_sizes` are one number each, of one row.
    """

    masses: FloatArray
    integrals: FloatArray
    deviations: FloatArray
    lows: FloatArray
    highs: FloatArray
    tails: FloatArray
    earlier_tails: FloatArray
    roundings: FloatArray
    largest_roundings: FloatArray
    largest_samples: FloatArray
    panel_errors: FloatArray
    panel_sizes: FloatArray


class ChunkWork(NamedTuple):
    """Work space for one chunk of designs.

    Attributes
    ----------
    record, constants, positions, corners
        One tile of records, the constants of the chunk, the breaks of one design, the zeros of each panel.
    panels, owner, todo, order, codes, starts, kinds, histogram
        The panels of one window, the design of each, and their order by rule.
    first_panel, panel_count, live, averaging, rest, noise, worst, excess
        For each design its panels, whether it needs more nodes, lengths, amplification of rounding, bound, excess of
        `explore.evaluation.quadrature.tails.check_model`.
    bounds, means, variances, terms, row_bounds, final_bounds, estimates
        Statistics of the live designs, row after row; `estimates` are the errors that samples tell of.
    """

    record: FloatArray
    constants: FloatArray
    positions: FloatArray
    corners: FloatArray
    panels: FloatArray
    owner: IntArray
    todo: IntArray
    order: IntArray
    codes: IntArray
    starts: IntArray
    kinds: IntArray
    histogram: IntArray
    first_panel: IntArray
    panel_count: IntArray
    live: IntArray
    averaging: FloatArray
    rest: FloatArray
    noise: FloatArray
    worst: FloatArray
    excess: FloatArray
    bounds: FloatArray
    means: FloatArray
    variances: FloatArray
    terms: FloatArray
    row_bounds: FloatArray
    final_bounds: FloatArray
    estimates: FloatArray


SIZES_TYPE = types.NamedUniTuple(_INT, 8, Sizes)
TABLES_TYPE = types.NamedTuple(
    (_I2, types.float64[:, ::1], *[_I1] * 5, _I2, _I2, *[_I1] * 3, _I2, _F1, types.int64[:, :, ::1], _INT, _FLOAT,
     *[types.boolean] * 4, _I1, _I1, types.float64[:, ::1], _F1, _F1),
    Tables,
)  # fmt: skip
TILE_WORK_TYPE = types.NamedTuple((_I1, _I1, types.uint64[::1], *[_F1] * 17), TileWork)
PANEL_SUMS_TYPE = types.NamedUniTuple(_F1, 12, PanelSums)
CHUNK_WORK_TYPE = types.NamedTuple((*[_F1] * 5, *[_I1] * 10, *[_F1] * 12), ChunkWork)


#: Work spaces of earlier calls, each with their tables; zeroing new ones takes a quarter of the time of one design.
_SPARE: list[tuple[Tables, tuple[ChunkWork, TileWork, PanelSums]]] = []
#: Largest number of work spaces in the list.
_MOST_SPARE = 8
#: Guard of the list.
_LOCK = Lock()


def take_work_space(sizes: Sizes, tables: Tables, n_breaks: int) -> tuple[ChunkWork, TileWork, PanelSums]:
    """The work space of a call of the loop: one that an earlier call of the same tables has left, or a new one."""
    with _LOCK:
        found = next((k for k, (owner, _) in enumerate(_SPARE) if owner is tables), None)
        if found is not None:
            return _SPARE.pop(found)[1]
    return make_work_space(sizes, n_breaks)


def leave_work_space(tables: Tables, space: tuple[ChunkWork, TileWork, PanelSums]) -> None:
    """Leave a work space to later calls of the same tables, for which it is as after a chunk of their own."""
    with _LOCK:
        _SPARE.append((tables, space))
        del _SPARE[:-_MOST_SPARE]


def make_work_space(sizes: Sizes, n_breaks: int) -> tuple[ChunkWork, TileWork, PanelSums]:
    """The work space of one call of the loop."""
    n, rows, few = sizes.n_constants, sizes.rows, NODE_CAPACITY // STRIDE + 1
    chunk = ChunkWork(
        record=np.zeros(sizes.record_rows * LANES), constants=np.empty((CHUNK + LANES) * n),
        positions=np.empty(max(n_breaks, 1)), corners=np.empty(PANEL_CAPACITY // MOST_PARTS * MOST_ZEROS),
        panels=np.zeros(PANELS_SIZE), owner=_integers(PANEL_CAPACITY), todo=_integers(PANEL_CAPACITY),
        order=_integers(PANEL_CAPACITY), codes=_integers(PANEL_CAPACITY), starts=_integers(PANEL_CAPACITY + 1),
        kinds=_integers(MOST_KINDS), histogram=_integers(MOST_KINDS * CODES + 1),
        first_panel=_integers(CHUNK), panel_count=_integers(CHUNK), live=_integers(CHUNK), averaging=np.empty(CHUNK),
        rest=np.empty(CHUNK), noise=np.empty(CHUNK), worst=np.empty(CHUNK), excess=np.zeros(CHUNK),
        bounds=np.zeros(BOUNDS_SIZE), terms=np.empty(CHUNK), means=np.empty(rows * CHUNK),
        variances=np.empty(rows * CHUNK), row_bounds=np.empty(rows * CHUNK), final_bounds=np.empty(rows * CHUNK),
        estimates=np.empty(rows * CHUNK),
    )  # fmt: skip
    tile = TileWork(
        lane_panels=_integers(LANES), lane_designs=_integers(LANES), offsets=np.empty(LANES, np.uint64),
        constants=np.empty(n * LANES), shape=np.zeros(SHAPE_SIZE), tangents=np.empty(NODE_CAPACITY * LANES),
        weights=np.empty(NODE_CAPACITY * LANES), roots=np.empty(NODE_CAPACITY * LANES),
        factors=np.empty(2 * NODE_CAPACITY), signals=np.empty(rows * NODE_CAPACITY * LANES),
        sums=np.empty(rows * SUMS_SIZE), state=np.zeros(max(STATE_SIZE, HAND_OVER_SIZE)), node=np.empty(LANES),
        node_signals=np.empty(rows * LANES), few_tangents=np.empty(few * LANES),
        disturbed=np.empty(rows * few * LANES), parts=np.empty(PARTS_SIZE), search=np.zeros(SEARCH_SIZE),
        values=np.empty(NODE_CAPACITY * LANES), marks=np.empty(NODE_CAPACITY * LANES),
    )  # fmt: skip
    # Vectors read panels that are not there, too: what memory holds may be denormal numbers, which take much longer.
    of_rows = rows * PANEL_CAPACITY
    sums = PanelSums(
        np.zeros(PANEL_CAPACITY), *(np.zeros(of_rows) for _ in range(9)), *(np.zeros(PANEL_CAPACITY) for _ in range(2))
    )
    return chunk, tile, sums


def _integers(count: int) -> IntArray:
    return np.empty(count, np.int64)
