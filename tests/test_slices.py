"""Slow designs of one block on several threads: the same bytes, whatever their number, and the error of a slice."""

import threading
import time

import numpy as np
import pytest
from waiting import PATIENCE

import explore
from explore.running import slices
from explore.studies.request.names import find_mechanism
from explore.studies.request.requests import make_request

LENGTHS = {"coupler": 300.0, "rocker": 62.0, "ground": 305.0}
STUDY = """
mechanism = "crank-rocker"
[points]
M = { along = { min = -300, max = 900 }, across = { min = -300, max = 900 } }
[target]
kind = "path"
closed = true
points = [[420, 200], [300, 262], [175, 200], [320, 135]]
[parameters]
crank = { min = 60, max = 140 }
coupler = 950
rocker = 550
ground = { min = 700, max = 800 }
[sampling]
method = "sobol"
count = 700
[evaluate]
metrics = ["path_error_rms", "rocker_velocity_rms"]
"""


@pytest.fixture
def seen(monkeypatch):
    """The names of threads that evaluate slices; all requests are slow."""
    names = set()

    def evaluate(request, parameters):
        names.add(threading.current_thread().name)
        return evaluate_columns(request, parameters)

    evaluate_columns = slices.evaluate_columns
    monkeypatch.setattr(slices, "_LONG", 0.0)
    monkeypatch.setattr(slices, "evaluate_columns", evaluate)
    return names


def test_a_block_has_the_same_bytes_on_any_number_of_threads(tmp_path, seen):
    path = tmp_path / "paths.toml"
    path.write_text(STUDY)
    files = []
    for workers in (1, 3):
        seen.clear()
        files.append(tmp_path / f"{workers}.h5")
        explore.sweep(explore.load_study(path), files[-1], workers=workers)
        assert len(seen) == (1 if workers == 1 else 4)  # that of the block has the first designs
    assert files[0].read_bytes() == files[1].read_bytes()


def test_designs_whose_motions_are_shared_stay_together(seen):
    """The same lengths at other speeds are evaluated once, whatever varies slowest."""
    mechanism = find_mechanism("crank-rocker")
    request = make_request(mechanism, metrics=["rocker_acceleration_peak"])
    lengths = {"crank": np.linspace(30.0, 45.0, 400), **LENGTHS}
    for repeat in (np.tile, np.repeat):
        designs = {name: repeat(np.broadcast_to(value, 400), 3) for name, value in lengths.items()}
        designs["speed"] = np.repeat([5.0, 9.0, 20.0], 400) if repeat is np.tile else np.tile([5.0, 9.0, 20.0], 400)
        found = slices.evaluate_on_threads(request, designs, 3)
        assert found.kinematic_evaluations == 400
        assert len(seen) == 1
        alone = slices.evaluate_on_threads(request, {name: values[400:401] for name, values in designs.items()}, 1)
        assert alone.columns["rocker_acceleration_peak"] == found.columns["rocker_acceleration_peak"][400]


def test_fast_first_designs_do_not_decide_for_slow_ones(monkeypatch):
    """The first do not turn, and the others are evaluated on all threads."""
    request = make_request(find_mechanism("crank-rocker"), metrics=["rocker_velocity_rms"])
    names, crank = set(), np.where(np.arange(5000) < 300, 400.0, 45.0)
    designs = {"crank": crank, **{name: np.full(5000, value) for name, value in LENGTHS.items()}}
    both = threading.Barrier(2, timeout=PATIENCE)

    def evaluate(request, parameters):
        if slow := np.count_nonzero(parameters["crank"] < 100.0):
            thread = threading.current_thread()
            if thread is not threading.main_thread() and thread.name not in names:
                names.add(thread.name)
                both.wait()  # so that neither takes all slices
            time.sleep(2e-4 * slow)
        return evaluate_columns(request, parameters)

    evaluate_columns = slices.evaluate_columns
    monkeypatch.setattr(slices, "evaluate_columns", evaluate)
    assert len(slices.evaluate_on_threads(request, designs, 2).columns["status"]) == 5000
    assert len(names) == 2


def test_the_error_of_a_slice_is_that_of_the_block(monkeypatch):
    request = make_request(find_mechanism("crank-rocker"), metrics=["rocker_velocity_rms"])
    designs = {name: np.full(999, value) for name, value in {"crank": 45.0, **LENGTHS}.items()}

    def evaluate(request, parameters):
        if len(parameters["crank"]) < 256:
            raise MemoryError("no room")
        return evaluate_columns(request, parameters)

    evaluate_columns = slices.evaluate_columns
    monkeypatch.setattr(slices, "_LONG", 0.0)
    monkeypatch.setattr(slices, "evaluate_columns", evaluate)
    with pytest.raises(MemoryError, match="no room"):
        slices.evaluate_on_threads(request, designs, 2)
    monkeypatch.setattr(slices, "evaluate_columns", evaluate_columns)
    one, two = (slices.evaluate_on_threads(request, designs, threads) for threads in (1, 2))
    assert one.kinematic_evaluations == two.kinematic_evaluations
    assert one.columns.keys() == two.columns.keys()
