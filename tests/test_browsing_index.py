"""The index of a results file: of one state of the file, complete or not there at all."""

import json
import os
import random
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from stopping import interrupt
from studies import crank_rockers, swept

import explore
from explore.base.errors import RequestError, ResultsError
from explore.results.browsing import building, cells, index_files
from explore.results.browsing.building import build_index
from explore.results.browsing.index_files import ColumnFacts, DamagedIndexError, identify, open_index

STUDY = crank_rockers((80, 260, 50), 1000, 500, [700, 720])
path = swept(STUDY, "grid", give=lambda results: results.path)


@pytest.fixture
def folder(tmp_path, path):
    build_index(explore.open_results(path), tmp_path / "grid", lambda share: None)
    return tmp_path / "grid"


def test_an_index_has_the_exact_values_and_their_facts(path, folder):
    index, frame = open_index(folder, identify(path)), explore.read_results(path).reset_index()
    assert index.n_designs == len(frame) == 100
    assert list(index.columns) == list(frame)
    for name, column in index.columns.items():
        values = frame[name].to_numpy(float)
        assert np.array_equal(column.values(np.arange(100)), values, equal_nan=True)
        finite = values[np.isfinite(values)]
        facts = column.facts
        assert (facts.low, facts.high, facts.missing) == (finite.min(), finite.max(), len(values) - len(finite))
        assert facts.distinct == len(np.unique(finite))
    assert index.columns["cv"].facts.missing > 0, "this study has designs without a motion"


def test_an_index_is_of_one_state_of_its_file(path, folder):
    identity = identify(path)
    assert open_index(folder, identity) is not None
    os.utime(path)
    assert identify(path) != identity
    assert open_index(folder, identify(path)) is None


def test_an_index_that_is_given_up_leaves_nothing(path, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        build_index(explore.open_results(path), tmp_path / "grid", interrupt)
    assert list(tmp_path.iterdir()) == []
    assert open_index(tmp_path / "grid", identify(path)) is None


def test_a_file_that_changes_meanwhile_is_not_indexed(path, tmp_path):
    with pytest.raises(ResultsError, match="were changed while their index was made"):
        build_index(explore.open_results(path), tmp_path / "grid", lambda share: os.utime(path))
    assert list(tmp_path.iterdir()) == []


def test_results_without_designs_have_no_index(path, tmp_path):
    results = explore.open_results(path)
    results._reader.is_committed[:] = False
    with pytest.raises(RequestError, match="hold no designs yet"):
        build_index(results, tmp_path / "grid", lambda share: None)
    assert list(tmp_path.iterdir()) == []


def test_every_file_of_an_index_is_durable(path, tmp_path, monkeypatch):
    synced, sync = set(), os.fsync

    def note(descriptor):
        synced.add(Path(f"/proc/self/fd/{descriptor}").readlink().name)
        sync(descriptor)

    monkeypatch.setattr(os, "fsync", note)
    build_index(explore.open_results(path), tmp_path / "grid", lambda share: None)
    assert {file.name for file in (tmp_path / "grid").iterdir()} <= synced


def test_the_space_of_an_index_is_looked_at_before_it_is_made(path, tmp_path, monkeypatch):
    results = explore.open_results(path)
    needed = 10 * 100 * len(results.columns)
    for free in (needed - 1, needed):
        monkeypatch.setattr(building.shutil, "disk_usage", lambda _, free=free: SimpleNamespace(free=free))
        refused = pytest.raises(RequestError, match="the index needs") if free < needed else nullcontext()
        with refused:
            build_index(results, tmp_path / "grid", lambda share: None)
    assert (tmp_path / "grid").exists()


def test_infinities_are_missing_values(tmp_path):
    writer = building._ColumnWriter(tmp_path, 0, 1)
    writer.note(np.array([1.0, np.inf, -np.inf, np.nan, 2.0]))
    unwritten: dict[str, list[int]] = {"cells": [], "ranges": [], "values": []}
    assert writer.facts("x") == ColumnFacts("x", 1.0, 2.0, missing=3, distinct=2, checksums=unwritten)


@pytest.mark.parametrize("damage", ["facts", "values", "designs"])
def test_a_damaged_index_is_refused(path, folder, damage):
    if damage == "facts":
        (folder / "facts.json").write_text("{")
    elif damage == "values":
        (folder / "001.cells").write_bytes(bytes(8))
    else:
        facts = json.loads((folder / "facts.json").read_text())
        (folder / "facts.json").write_text(json.dumps({**facts, "columns": 7}))
    with pytest.raises(ResultsError, match="the index grid is damaged; remove it"):
        open_index(folder, identify(path))


@pytest.fixture
def coarse(path, tmp_path, monkeypatch):
    """An index with all kinds of files, in seven blocks each."""
    for module, name, value in (
        (building, "MOST_DISTINCT", 30),
        (cells, "_EQUAL_WIDTHS", 10),
        (cells, "_EQUAL_NUMBERS", 10),
        (building, "BLOCK", 16),
        (index_files, "BLOCK", 16),
    ):
        monkeypatch.setattr(module, name, value)
    build_index(explore.open_results(path), tmp_path / "grid", lambda share: None)
    return tmp_path / "grid"


def everything(index):
    """All that is known from an index, in an order that goes back and forth through the blocks."""
    rows = np.argsort(np.arange(index.n_designs) * 37 % index.n_designs)
    return {
        name: (
            column.facts,
            *(part.tobytes() for part in (column.cells.least, column.cells.greatest, column.cells.counts)),
            column.values(rows).tobytes(),
            column.numbers[:].tobytes(),
        )
        for name, column in index.columns.items()
    }


@pytest.mark.parametrize("flips", [6, pytest.param(100, marks=pytest.mark.slow)])  # in each file
def test_a_flipped_bit_of_an_index_is_never_shown(path, coarse, flips):
    identity, chance, refused = identify(path), random.Random(1), set()
    right = everything(open_index(coarse, identity))
    assert {file.suffix for file in coarse.iterdir()} == {".json", ".cells", ".ranges", ".values"}
    for file in coarse.iterdir():
        sound = file.read_bytes()
        for place in (0, len(sound) - 1, *(chance.randrange(len(sound)) for _ in range(flips))):
            damaged = bytearray(sound)
            damaged[place] ^= 1 << chance.randrange(8)
            file.write_bytes(damaged)
            try:
                index = open_index(coarse, identity)
                assert index is None or everything(index) == right, (file.name, place)
            except DamagedIndexError:
                refused.add(file)
        file.write_bytes(sound)
    assert refused == set(coarse.iterdir())
    assert everything(open_index(coarse, identity)) == right


def test_only_what_is_read_is_checked(path, coarse):
    """A block that nothing was read of since the index was opened may be damaged; the others are given."""
    index = open_index(coarse, identify(path))
    file = coarse / "001.cells"
    damaged = bytearray(file.read_bytes())
    damaged[2 * 40] ^= 1  # of the third block
    file.write_bytes(damaged)
    numbers = index.columns["crank"].numbers
    assert np.array_equal(numbers[:32], np.frombuffer(damaged, "<u2")[:32])
    for rows in (slice(30, 33), np.array([99, 47]), slice(0, 100)):
        with pytest.raises(DamagedIndexError, match="the index grid is damaged"):
            numbers[rows]


def test_values_that_the_disk_gives_back_wrong_are_not_indexed(path, tmp_path):
    """Damage between the first and the second pass would else become the index."""

    def report(share):
        if share > 0.5:
            last = max(next(tmp_path.iterdir()).glob("*.values"))
            last.write_bytes(b"\x55" * last.stat().st_size)

    with pytest.raises(ResultsError, match="gives back other values than were written"):
        build_index(explore.open_results(path), tmp_path / "grid", report)
    assert list(tmp_path.iterdir()) == []
