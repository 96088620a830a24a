"""Designs that are certified on workers."""

import dataclasses
from contextlib import nullcontext

import pandas as pd
import pytest
from command_line import call

import explore
from explore.analysis.certifying import certification, certifiers
from explore.analysis.certifying.certifiers import Certifiers
from explore.analysis.certifying.public import certify_on
from explore.base.errors import ClusterError, RequestError
from explore.model.request import Objective
from explore.running.chosen import request_of
from explore.running.threads import LocalThreads

#: Workers of this process that certify all designs.
THREAD = Certifiers(lambda _, __: nullcontext(LocalThreads(1)), patience=0.0)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Results whose Pareto set has some tens of designs."""
    study = explore.Study(
        mechanism="crank-rocker",
        parameters={
            "crank": {"min": 60.0, "max": 180.0}, "coupler": {"min": 900.0, "max": 1300.0}, "rocker": 550.0,
            "ground": 1000.0, "speed": 10.0,
        },
        sampling={"method": "sobol", "count": 512, "seed": 1},
        metrics=["swing_angle", "transmission_angle_min"],
        objectives=["swing_angle:max", "transmission_angle_min:max"],
    )  # fmt: skip
    return explore.sweep(study, tmp_path_factory.mktemp("certify") / "designs.h5")


def test_workers_prove_the_same(results, monkeypatch):
    """Two processes, and a thread, which certify all designs."""
    here = explore.certify(results)
    assert len(here) > 10
    assert (here["verdict"] == "proved").all()
    pd.testing.assert_frame_equal(certify_on(THREAD, results, None, None), here)
    monkeypatch.setattr(certifiers, "PATIENCE", 0.0)
    done = []
    there = explore.certify(results, workers=2, report_progress=lambda *counts: done.append(counts))
    pd.testing.assert_frame_equal(there, here)
    assert there.attrs == here.attrs
    assert done[-1] == (len(here), len(here))
    assert sorted(done) == done


def test_what_is_left_after_some_time_goes_to_the_workers(results, monkeypatch):
    """The clock advances by a second with each look, so that the fourth design and those after it are left."""
    parts = []

    def certify_part(request, rows, objectives):
        parts.append(len(rows))
        return certify_rows(request, rows, objectives)

    certify_rows = certification._certify_part
    seconds = iter(range(1000))
    monkeypatch.setattr(certification, "_certify_part", certify_part)
    monkeypatch.setattr(certification.time, "perf_counter", lambda: next(seconds))
    here = explore.certify(results)
    assert not parts
    there = certify_on(dataclasses.replace(THREAD, patience=3.5), results, None, None)
    pd.testing.assert_frame_equal(there, here)
    assert sum(parts) == len(here) - 3


def test_dominated_and_false_designs_are_refuted_on_workers(results):
    """All designs are said to be Pareto-optimal; one has a false number."""
    table = results.to_pandas().head(40)
    rows = {number: dict(row) for number, row in zip(table.index, table.to_dict(orient="records"), strict=True)}
    rows[3]["swing_angle"] += 1e-9
    objectives = [Objective("swing_angle", "max"), Objective("transmission_angle_min", "max")]
    found = [
        certification.certify_designs(request_of(results.declared), rows, objectives, is_front=True, certifiers=each)
        for each in (None, THREAD)
    ]
    assert [proof for proof, _ in found[0].values()] == [proof for proof, _ in found[1].values()]
    assert any("dominates it" in proof.reason for proof, _ in found[1].values())
    assert "swing_angle" in found[1][3][0].reason


def test_a_worker_that_fails_is_told(results, monkeypatch):
    def fail(*_):
        raise ModuleNotFoundError("No module named 'flint'")

    monkeypatch.setattr(certification, "_certify_part", fail)
    with pytest.raises(ClusterError, match="a worker failed to certify the designs from .* No module named 'flint'"):
        certify_on(THREAD, results, None, None)


def test_wrong_workers_are_refused(results):
    with pytest.raises(RequestError, match="workers = 0: must be at least 1"):
        explore.certify(results, workers=0)
    with pytest.raises(RequestError, match="workers cannot be combined with client"):
        explore.certify(results, workers=2, client=object())
    code, _, error = call("certify", str(results.path), "--scheduler", "tcp://127.0.0.1:8786", "--workers", "2")
    assert code == 2
    assert "--scheduler brings its own workers" in error
