"""Sweeps that keep only the Pareto set: the same set as of a full sweep, the same bytes however they ran."""

import hashlib

import numpy as np
import pandas as pd
import pytest
from stopping import Stop, poisoned_at_1, stop
from store_files import sha256
from studies import box, grid

import explore
from explore.running import collectors, runs
from explore.running.clusters import local_cluster
from explore.studies.designs.spaces import BLOCK_SIZE

GRID = grid("""\
[constraints]
transmission_angle_min = { min = 20 }
[rank]
metrics = ["cv", "swing_angle:max", "transmission_angle_min:max"]
""")
SOBOL = box("""\
count = 400_000
[constraints]
transmission_angle_min = { min = 30 }
""")


@pytest.fixture
def study(tmp_path):
    (tmp_path / "study.toml").write_text(GRID)  # 151,200 designs, three blocks
    return explore.load_study(tmp_path / "study.toml")


def sweep(study, path, workers=2, **options):
    return runs.run_study(study, path, local_cluster(workers, processes=False), keep="front", **options)


@pytest.mark.parametrize("text", [GRID, SOBOL], ids=["grid", "sobol"])
def test_the_front_is_that_of_all_designs(text, tmp_path):
    (tmp_path / "study.toml").write_text(text)
    study = explore.load_study(tmp_path / "study.toml")
    whole = explore.sweep(study, tmp_path / "all.h5")
    kept = explore.sweep(study, tmp_path / "front.h5", keep="front")

    expected = explore.rank(whole).drop(columns="front").sort_index()
    assert len(expected) > 20
    pd.testing.assert_frame_equal(kept.to_pandas(), expected, check_exact=True)
    assert kept.counts == whole.counts
    assert (kept.n_designs, kept.n_studied, kept.keep) == (len(expected), whole.n_designs, "front")
    assert explore.rank(kept).equals(explore.rank(whole))
    assert sorted(p.name for p in tmp_path.glob("front*")) == ["front.h5", "front.h5.log.jsonl"]


def test_an_unfinished_front_is_no_results_file_yet(study, tmp_path):
    with pytest.raises(Stop):
        sweep(study, tmp_path / "a.h5", progress=stop)
    assert not (tmp_path / "a.h5").exists()
    with pytest.raises(explore.ResultsError, match="a.h5 is not finished: 1 of 3 blocks are done, .*; run the sweep"):
        explore.open_results(tmp_path / "a.h5")
    with pytest.raises(explore.ResultsError, match="journal holds an unfinished sweep that keeps only the front"):
        explore.sweep(study, tmp_path / "a.h5")
    (tmp_path / "other.toml").write_text(GRID.replace("swing_angle:max", "swing_angle:min"))
    with pytest.raises(explore.ResultsError, match="objectives: .*swing_angle:max.* -> .*swing_angle:min"):
        sweep(explore.load_study(tmp_path / "other.toml"), tmp_path / "a.h5")
    assert explore.sweep(study, tmp_path / "a.h5", restart=True).keep == "all"
    assert (tmp_path / "a.h5.journal.old").exists()


def test_a_front_and_all_designs_do_not_share_a_file(study, tmp_path):
    explore.sweep(study, tmp_path / "all.h5")
    explore.sweep(study, tmp_path / "front.h5", keep="front")
    before = sha256(tmp_path / "all.h5"), sha256(tmp_path / "front.h5")
    with pytest.raises(explore.ResultsError, match='keep: "all" -> "front"\nuse `restart=True`'):
        sweep(study, tmp_path / "all.h5")
    with pytest.raises(explore.ResultsError, match='keep: "front" -> "all"'):
        explore.sweep(study, tmp_path / "front.h5")
    assert sweep(study, tmp_path / "front.h5").n_computed == 0
    assert (sha256(tmp_path / "all.h5"), sha256(tmp_path / "front.h5")) == before
    assert sweep(study, tmp_path / "front.h5", restart=True).n_computed == 151_200
    assert sha256(tmp_path / "front.h5.old") == sha256(tmp_path / "front.h5") == before[1]


def test_nothing_feasible_is_an_empty_front(tmp_path):
    (tmp_path / "study.toml").write_text(GRID.replace("min = 20", "min = 89"))
    results = explore.sweep(explore.load_study(tmp_path / "study.toml"), tmp_path / "a.h5", keep="front")

    assert results.is_complete
    assert len(results) == len(results.to_pandas()) == len(explore.rank(results)) == 0
    assert sum(results.counts.values()) == results.n_studied == 151_200
    assert len(pd.read_hdf(tmp_path / "a.h5")) == 0


def test_a_failed_block_leaves_the_front_unfinished(study, tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(runs, "evaluate_block", poisoned_at_1)
        assert list(sweep(study, tmp_path / "a.h5").failures) == [1]
    assert not (tmp_path / "a.h5").exists()
    assert sweep(study, tmp_path / "a.h5").n_computed == BLOCK_SIZE
    assert np.array_equal(explore.read_results(tmp_path / "a.h5").index, np.sort(explore.rank(tmp_path / "a.h5").index))


def test_a_study_without_aims_has_no_front(tmp_path):
    text = GRID.split("[constraints]")[0] + '[evaluate]\nmetrics = ["rocker_velocity_mean"]'
    (tmp_path / "study.toml").write_text(text)
    study = explore.load_study(tmp_path / "study.toml")
    assert study.objectives == ()
    with pytest.raises(explore.RequestError, match="give objectives"):
        sweep(study, tmp_path / "a.h5")


def test_a_digest_is_that_of_all_values_in_the_order_of_names():
    arrays = {"rod": np.array([1.0, 2.0]), "crank": np.array([3, 4])}
    together = arrays["crank"].tobytes() + arrays["rod"].tobytes()
    assert collectors.digest_of(arrays) == hashlib.sha256(together).hexdigest()


def test_ranking_a_front_says_what_it_cannot_know(study, tmp_path):
    explore.sweep(study, tmp_path / "a.h5", keep="front")

    with pytest.warns(RuntimeWarning, match="keeps only the Pareto set of its study"):
        explore.rank(tmp_path / "a.h5", objectives=["cv"])
    with pytest.raises(explore.RequestError, match="kept the first front only"):
        explore.rank(tmp_path / "a.h5", fronts=2)


@pytest.mark.parametrize(
    "meta",
    [{"block": 3}, {"block": -1}, {"block": "0"}, {}],
    ids=["beyond", "below", "text", "no"],
)
def test_a_journal_with_foreign_records_is_refused(study, tmp_path, meta):
    with collectors.FrontCollector(study, tmp_path / "a.h5", restart=False) as kept:
        kept.add(runs.evaluate_block(study.request, study.space, 0, study.objectives))
        front = runs.evaluate_block(study.request, study.space, 1, study.objectives).arrays
        kept._writer.append({"counts": {}, "tally": "{}", **meta}, front)

    with pytest.raises(explore.ResultsError, match="has a record that is not a block of this study"):
        sweep(study, tmp_path / "a.h5")


def test_a_block_that_is_in_the_journal_twice_counts_once(study, tmp_path):
    explore.sweep(study, tmp_path / "whole.h5", keep="front")
    with collectors.FrontCollector(study, tmp_path / "a.h5", restart=False) as kept:
        block = runs.evaluate_block(study.request, study.space, 0, study.objectives)
        kept.add(block)
        kept.add(block)
    sweep(study, tmp_path / "a.h5")
    assert sha256(tmp_path / "a.h5") == sha256(tmp_path / "whole.h5")


def test_designs_that_are_done_are_counted_by_block(study, tmp_path):
    """The last block is shorter than the others, and counts as what it is, once it is done."""
    with collectors.FrontCollector(study, tmp_path / "a.h5", restart=False) as kept:
        done = []
        for number in (1, 2, 0):
            kept.add(runs.evaluate_block(study.request, study.space, number, study.objectives))
            done.append(kept.n_committed)
    assert done == [BLOCK_SIZE, 151_200 - BLOCK_SIZE, 151_200]
