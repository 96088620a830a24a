"""The peers of the benchmarks answer the question that they are timed on."""

from pathlib import Path

import numpy as np
import pytest


@pytest.fixture
def peers(monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "benchmarks")
    import peers

    monkeypatch.setattr(peers, "DESIGNS", peers.JAX_BLOCK)
    monkeypatch.setattr(peers, "REPETITIONS", 1)
    return peers


@pytest.fixture
def designs(peers):
    rng = np.random.default_rng(1)
    return {name: rng.uniform(*bounds, peers.DESIGNS) for name, bounds in peers.RANGES.items()}


@pytest.mark.parametrize("window", ["cycle", "drive"])
def test_numpy_and_explore_agree(peers, designs, window):
    lengths = np.column_stack(list(designs.values()))
    values, nodes = peers.by_explore(window, designs)
    assert (nodes > 0).all()
    # both are more accurate than the tolerance of 1e-9: 128 samples, and nodes for the worst of four signals
    assert peers.worst_error(peers.by_numpy(window, 128, lengths), values) < 1e-10


@pytest.mark.parametrize("window", ["cycle", "drive"])
def test_jax_and_numpy_agree(peers, designs, window):
    pytest.importorskip("jax")
    lengths = np.column_stack(list(designs.values()))
    by_jax = np.asarray(peers.jax_function(window, 32)(lengths))
    # the squares of the mean and their difference cost a digit
    assert peers.worst_error(by_jax, peers.by_numpy(window, 32, lengths)) < 1e-13


def test_without_jax_one_line_says_so(peers, monkeypatch, capsys):
    monkeypatch.setattr(peers, "find_spec", lambda name: None)
    peers.main()
    first, *table = capsys.readouterr().out.splitlines()
    assert first == "JAX is left out: it is not installed; pip install '.[jax]'"
    assert [line.split()[0] for line in table] == ["full", "explore", "NumPy", "slower", "explore", "NumPy"]
    assert all(float(line.split()[2]) <= peers.TOLERANCE for line in table if line.split()[0] in {"explore", "NumPy"})
