"""Counts from an index are exactly those of NumPy on the values, for any conditions, bins and windows."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from explore.results.browsing import counting
from explore.results.browsing.building import build_index
from explore.results.browsing.cells import MOST_DISTINCT, Cells, find_bins, make_edges
from explore.results.browsing.counting import Range, count_density, count_histograms, find_designs, whole_range
from explore.results.browsing.fitting_bins import fitting_bins
from explore.results.browsing.index_files import ColumnFacts, IndexedColumn, identify, open_index
from explore.results.browsing.selections import Selection
from explore.results.ranking.conditions import parse_condition

N = 150_000


def make_values():
    """Columns of all kinds that results have, and of kinds that they should not have."""
    random = np.random.default_rng(1)
    smooth = random.normal(size=N)
    skewed = np.exp(12 * smooth)  # nearly all in one of the cells of equal width
    skewed[:7] = 1e300
    partly = np.where(random.random(N) < 0.3, np.nan, random.random(N))
    partly[5:9], partly[9:12] = np.inf, -np.inf
    return {
        "design": np.arange(N),
        "axis": np.repeat(np.linspace(80.0, 160.0, 30), N // 30),
        "smooth": smooth,
        "skewed": skewed,
        "partly": partly,
        "constant": np.full(N, 0.1),
        "empty": np.full(N, np.nan),
        "huge": random.choice([-1.7e308, 1.7e308, 0.0], N),
        "feasible": random.random(N) < 0.1,
    }


@pytest.fixture(autouse=True)
def several_tiles(monkeypatch):
    """As large results have: the last one is shorter."""
    monkeypatch.setattr(counting, "_TILE", 40_000)


@pytest.fixture(scope="module")
def values():
    return make_values()


@pytest.fixture(scope="module")
def index(tmp_path_factory, values):
    """An index of results that hold these columns, in blocks."""
    path = tmp_path_factory.mktemp("counts") / "made.h5"
    path.touch()
    blocks = [{name: own[a:b] for name, own in values.items()} for a, b in pairwise([0, 65536, 131072, N])]
    results = SimpleNamespace(
        path=path,
        n_committed=N,
        columns=[SimpleNamespace(name=name) for name in values],
        declared=SimpleNamespace(blocks=lambda names: iter(blocks)),
    )
    build_index(results, path.with_name("index"), lambda share: None)
    return open_index(path.with_name("index"), identify(path))


def conditions_of(texts, values):
    return [parse_condition(text, list(values)) for text in texts]


def expected_bins(own, edges):
    """By the definition: from an edge to below the next, the last bin with its upper edge."""
    if edges[0] == edges[-1]:
        return np.where(own == edges[0], 0, -1)
    bins = np.minimum(np.searchsorted(edges, own, side="right") - 1, len(edges) - 2)
    return np.where((own >= edges[0]) & (own <= edges[-1]), bins, -1)


def draw_condition(random, values):
    """A condition of any form whose limits are values, halves between values, or nothing near."""
    name = random.choice([name for name in values if name != "design"])
    finite = values[name][np.isfinite(values[name])]
    low, high = sorted(random.choice(finite, 2)) if len(finite) else (0.0, 1.0)
    middle = low / 2 + high / 2
    return random.choice(
        [
            f"{name} < {float(high)!r}",
            f"{name} <= {float(middle)!r}",
            f"{float(low)!r} <= {name} <= {float(high)!r}",
            f"not {name} > {float(middle)!r}",
            f"{name} < {float(low)!r} or {name} == {float(high)!r}",
            f"{name} != {float(high)!r}",
            f"smooth < {name}",
            "partly > smooth and not axis > 120",
            "1 < 2",
        ]
    )


@pytest.mark.parametrize("seed", range(12))
def test_counts_are_those_of_numpy(index, values, seed):
    random = np.random.default_rng(seed)
    conditions = conditions_of([draw_condition(random, values) for _ in range(random.integers(0, 5))], values)
    meets = {c: c.test({name: values[name].astype(float) for name in values}) for c in conditions}
    selection = Selection(index, conditions)
    selected = np.logical_and.reduce([np.ones(N, bool), *meets.values()])

    ranges = [draw_range(random, index, name) for name in values]
    counted = count_histograms(index, selection, ranges)
    assert counted.n_selected == selected.sum()
    for own, everything, chosen in zip(ranges, counted.everything, counted.selected, strict=True):
        bins = expected_bins(values[own.column].astype(float), own.edges)
        others = np.logical_and.reduce([np.ones(N, bool), *(m for c, m in meets.items() if c.names != (own.column,))])
        assert np.array_equal(everything, np.bincount(bins[bins >= 0], minlength=own.bins)), own
        assert np.array_equal(chosen, np.bincount(bins[(bins >= 0) & others], minlength=own.bins)), own

    x, y = random.choice(ranges, 2, replace=False)
    places = [expected_bins(values[own.column].astype(float), own.edges) for own in (x, y)]
    inside = selected & (places[0] >= 0) & (places[1] >= 0)
    expected = np.bincount((places[1] * x.bins + places[0])[inside], minlength=x.bins * y.bins)
    density = count_density(index, selection, x, y)
    assert density.n_selected == selected.sum()
    assert np.array_equal(density.counts.ravel(), expected), (x, y)

    limit = int(random.integers(1, 200))
    count, first = find_designs(index, selection, limit)
    assert count == selected.sum()
    assert np.array_equal(first, np.flatnonzero(selected)[:limit])


def draw_range(random, index, name):
    """The whole range of a column, with bins that fit its cells or not, or a narrow window."""
    bins = int(random.choice([1, 7, 64, 160, 333]))
    whole = whole_range(index.columns[name], bins)
    if random.random() < 0.5 or not whole.high > whole.low:
        return whole
    low, high = np.sort(random.choice(index.columns[name].values(np.arange(N)), 2))
    return Range(name, float(low), float(high), bins) if low < high < np.inf and low > -np.inf else whole


def test_bins_are_those_of_numpy_histograms(index, values):
    for name in ("axis", "smooth", "skewed"):
        own = whole_range(index.columns[name], 64)
        counted = count_histograms(index, Selection(index, []), [own])
        assert np.array_equal(counted.everything[0], np.histogram(values[name], 64)[0])
        assert np.array_equal(counted.selected[0], counted.everything[0])
    assert np.array_equal(make_edges(0.1, 0.7, 9), np.histogram_bin_edges([0.1, 0.7], 9))


def test_most_designs_are_counted_without_their_values(index, values):
    """Two bytes a design answer the usual questions, so that a large file need not be read again."""
    smooth = index.columns["smooth"].cells
    outcomes = smooth.outcomes(tuple(conditions_of(["-0.3 < smooth < 0.4"], values)))
    unsure = smooth.counts[outcomes == 2].sum()
    assert 0 < unsure < N / 1000
    for bins in (64, 120, 160):
        own = whole_range(index.columns["smooth"], bins)
        assert smooth.counts[smooth.bins(own.edges) == bins + 1].sum() == 0
    for name in ("axis", "constant", "feasible", "empty"):
        assert index.columns[name].cells.are_exact


@pytest.mark.parametrize("sign", ["<", "<=", ">", ">=", "==", "!="])
@pytest.mark.parametrize("end", ["least", "greatest"])
def test_a_limit_at_the_end_of_a_cell_divides_it(index, values, end, sign):
    cells = index.columns["smooth"].cells
    wide = np.flatnonzero((cells.counts > 3) & (cells.least < cells.greatest))[1000]
    conditions = conditions_of([f"smooth {sign} {float(getattr(cells, end)[wide])!r}"], values)
    count, _ = find_designs(index, Selection(index, conditions), 1)
    assert count == conditions[0].test({"smooth": values["smooth"]}).sum()


def column_of(distinct):
    """A column with a cell for each value, as the index of few values has."""
    least = np.concatenate([[np.nan, np.inf], distinct, [np.inf]])
    counts = np.concatenate([[3, 0], np.arange(1, len(distinct) + 1), [2]])
    facts = ColumnFacts("axis", float(distinct[0]), float(distinct[-1]), 5, len(distinct), {})
    return IndexedColumn(
        facts, Cells(least, np.where(counts == 0, -np.inf, least), counts), np.empty(0, np.uint16), None
    )


@pytest.mark.parametrize("ends", [(80.0, 260.0), (-1.0, 1.0), (1e-300, 3e-300), (4.0e15, 4.1e15)])
def test_each_bin_of_a_grid_holds_equally_many_values(ends):
    """Counted one by one for every number of values: no bin is above another because of its width."""
    for n in range(2, MOST_DISTINCT + 1):
        values = np.linspace(*ends, n)
        fitting = fitting_bins(column_of(values))
        own = fitting.range
        held = np.histogram(values, own.edges)[0]
        if fitting.values_per_bin is None:
            assert own.bins == 64
            assert 16 <= held.min() <= held.max() <= held.min() + 1, "a step that is hardly seen"
        else:
            assert set(held) == {fitting.values_per_bin}, n
            assert own.bins == n if n <= 128 else 48 <= own.bins <= 128 or own.bins == n <= 1024
        half = (values[1] - values[0]) / 2
        assert (own.low, own.high) == pytest.approx((ends[0] - half, ends[1] + half), rel=1e-12)


@pytest.mark.parametrize(
    "values",
    [
        [1.0, 2.0, 100.0],
        np.geomspace(1, 1000, 200),
        [-1.7e308, 0.0, 1.7e308],
    ],
)
def test_values_of_no_grid_have_the_usual_bins(values):
    fitting = fitting_bins(column_of(np.array(values)))
    assert fitting.values_per_bin is None
    assert (fitting.range.low, fitting.range.high, fitting.range.bins) == (values[0], values[-1], 64)


@pytest.mark.parametrize("start", [1.0, 5e-324, -1e308, 2.0**1023])
def test_neighbouring_floats_are_parted_or_have_the_usual_bins(start):
    values = start + abs(np.spacing(start)) * np.arange(5)
    fitting = fitting_bins(column_of(values))
    held = np.bincount(find_bins(values, fitting.range.edges))
    assert held.sum() == 5
    assert len(held) <= fitting.range.bins, "none is outside"
    assert fitting.range.bins == 64 or held.tolist() == [1] * 5


def test_fitting_bins_count_exactly(index, values):
    fitting = fitting_bins(index.columns["axis"])
    assert (fitting.range.bins, fitting.values_per_bin) == (30, 1)
    constant = fitting_bins(index.columns["constant"])
    assert (constant.range, constant.values_per_bin) == (Range("constant", 0.1, 0.1, 1), 1)
    assert count_histograms(index, Selection(index, []), [constant.range]).everything[0].tolist() == [N]
    assert np.isnan(fitting_bins(index.columns["empty"]).range.low)
    conditions = conditions_of(["smooth < 0.3", "axis >= 100"], values)
    counted = count_histograms(index, Selection(index, conditions), [fitting.range])
    assert counted.everything[0].tolist() == np.unique(values["axis"], return_counts=True)[1].tolist()
    chosen = values["smooth"] < 0.3
    assert counted.selected[0].tolist() == [
        (chosen & (values["axis"] == one)).sum() for one in np.unique(values["axis"])
    ]
