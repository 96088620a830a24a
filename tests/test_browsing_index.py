"""The index of a results file: of one state of the file, complete or not there at all."""

import json
import os

import numpy as np
import pytest

import explore
from explore.base.errors import RequestError, ResultsError
from explore.results.browsing.building import build_index
from explore.results.browsing.index_files import identify, open_index

STUDY = """mechanism = "crank-rocker"
[parameters]
crank = { start = 80, stop = 260, num = 50 }
coupler = 1000
rocker = 500
ground = [700, 720]
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    folder = tmp_path_factory.mktemp("index")
    (folder / "grid.toml").write_text(STUDY)
    explore.sweep(explore.load_study(folder / "grid.toml"), folder / "grid.h5")
    return folder / "grid.h5"


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
    def give_up(share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        build_index(explore.open_results(path), tmp_path / "grid", give_up)
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
