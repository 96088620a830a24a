"""Benchmarks find what they import; the peers of that of requests answer the questions that they are timed on."""

import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

import explore

FOLDER = Path(__file__).parents[1] / "benchmarks"


@pytest.mark.parametrize("name", sorted(path.stem for path in FOLDER.glob("*.py")))
def test_a_benchmark_starts(name, monkeypatch):
    monkeypatch.setattr(sys, "path", [str(FOLDER), *sys.path])
    assert runpy.run_path(str(FOLDER / f"{name}.py"), run_name="benchmark")["__doc__"]


@pytest.fixture
def requests(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    return runpy.run_path(str(FOLDER / "requests.py"), run_name="benchmark")


@pytest.mark.parametrize("number", range(6))
def test_peers_and_explore_agree(requests, number):
    title, mechanism, ranges, question, peer = requests["COMPARED"][number]
    designs, peers = requests["drawn"](ranges, 2048), requests["peers"]
    source = mechanism() if callable(mechanism) else mechanism
    arrays = explore.evaluate(source, designs, **{"window": "cycle", **question}, table=False)
    values = np.array([arrays[name] for name in question["metrics"]])
    parameters = np.array(list(designs.values()))
    count = peers.MANY_FOR_PEAKS if peer.statistic == "peak" else peers.MANY
    by_numpy = peers.by_numpy(peer, count, parameters)
    # far more samples than are needed: only rounding and the tolerance of explore remain
    assert peer.error(by_numpy, values) < 1e-9, title
    # one function writes the loops of all questions for JAX, which takes seconds to compile each
    for make in (peers.numba_function, *([peers.jax_function] if number in (0, 2) else ())):
        if make is peers.jax_function:
            pytest.importorskip("jax")
        # the squares of the mean and their difference cost a digit
        assert peer.error(np.asarray(make(peer, 64)(parameters)), peers.by_numpy(peer, 64, parameters)) < 1e-12, title
