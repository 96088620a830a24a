"""Sweeps on real clusters: same bytes everywhere, resume, failing blocks, refusals."""

import contextlib
import pickle
import socket
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from distributed import Client, LocalCluster
from stopping import Stop, poisoned, poisoned_at_1, stop
from store_files import sha256
from studies import grid

import explore
from explore.results.store.layout_reader import read_layout
from explore.running import runs
from explore.running.blocks import environment_of
from explore.running.clusters import check_environment, local_cluster, remote_cluster
from explore.studies.designs.spaces import BLOCK_SIZE

CONSTRAINED = "[constraints]\ntransmission_angle_min = { min = 20 }\n"


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(grid(CONSTRAINED, 16))  # 151,200 designs, three blocks
    return explore.load_study(path)


def run(study, path, **options):
    return runs.run_study(study, path, local_cluster(None, processes=False), **options)


def test_the_file_holds_what_evaluate_says_of_every_design(study, tmp_path):
    summary = run(study, tmp_path / "a.h5")

    frame = explore.read_results(tmp_path / "a.h5")
    designs = study.space.designs(0, study.space.n_designs)
    expected = explore.evaluate("crank-rocker", designs, constraints={"transmission_angle_min": {"min": 20}})
    expected.index.name = "design"
    assert summary.n_designs == summary.n_computed == len(frame) == 151_200
    assert summary.n_feasible == frame["feasible"].sum()
    assert set(frame["status"]) >= {1, 3, 6}
    for name in expected:
        np.testing.assert_array_equal(frame[name], expected[name], err_msg=name)


@pytest.mark.parametrize("keep", ["all", "front"])
def test_a_resumed_sweep_computes_the_rest(keep, study, tmp_path):
    """And writes the same bytes; those of threads, processes and clusters are compared in clusters/test_determinism."""
    explore.sweep(study, tmp_path / "one.h5", workers=1, keep=keep)

    for _ in range(2):
        with pytest.raises(Stop):
            explore.sweep(study, tmp_path / "resumed.h5", keep=keep, report_progress=stop)
    summary = run(study, tmp_path / "resumed.h5", keep=keep)

    assert summary.n_resumed == 2 * BLOCK_SIZE or summary.n_resumed == BLOCK_SIZE + 151_200 % BLOCK_SIZE
    assert sha256(tmp_path / "resumed.h5") == sha256(tmp_path / "one.h5")


def test_two_sweeps_at_a_time_do_not_disturb_each_other(study, tmp_path):
    # Warnings are errors here: a port that both want would be one.
    with socket.socket() as taken:
        with contextlib.suppress(OSError):  # taken by somebody else is as good
            taken.bind(("0.0.0.0", 8787))
            taken.listen()
        explore.sweep(study, tmp_path / "b.h5")

    assert explore.open_results(tmp_path / "b.h5").is_complete


def test_a_finished_file_is_left_as_it_is(study, tmp_path):
    explore.sweep(study, tmp_path / "a.h5")
    before = (tmp_path / "a.h5").stat().st_mtime_ns, sha256(tmp_path / "a.h5")

    summary = run(study, tmp_path / "a.h5")

    assert summary.n_computed == 0
    assert summary.n_resumed == 151_200
    assert ((tmp_path / "a.h5").stat().st_mtime_ns, sha256(tmp_path / "a.h5")) == before


def test_a_block_that_fails_twice_is_reported_and_the_others_finish(study, tmp_path, monkeypatch):
    real, tries = runs.evaluate_block, tmp_path / "tries"

    def failing(request, space, number, *others):
        if number == 1:
            with tries.open("a") as stream:  # a file, because the function travels to the worker as a copy
                stream.write("tried\n")
            raise ZeroDivisionError("poison")
        return real(request, space, number, *others)

    with monkeypatch.context() as patch:
        patch.setattr(runs, "evaluate_block", failing)
        summary = run(study, tmp_path / "a.h5")

    assert tries.read_text() == "tried\ntried\n"
    assert list(summary.failures) == [1]
    assert "poison" in summary.failures[1]
    results = explore.open_results(tmp_path / "a.h5")
    assert not results.is_complete
    assert results.n_committed == 151_200 - BLOCK_SIZE
    assert run(study, tmp_path / "a.h5").failures == {}
    assert explore.open_results(tmp_path / "a.h5").is_complete


def test_sweep_returns_the_results_and_warns_of_blocks_left_out(study, tmp_path, monkeypatch):
    real = runs.evaluate_block

    def full(request, space, number, *others):
        if number == 2:
            raise OSError(28, "No space left on device")  # on the worker: not our file, and not the cluster's loss
        return real(request, space, number, *others)

    with monkeypatch.context() as patch:
        patch.setattr(runs, "evaluate_block", full)
        with pytest.warns(explore.FailedBlocksWarning, match="block 2 failed and was left out") as warnings:
            results = explore.sweep(study, tmp_path / "a.h5")

    (failures,) = (pickle.loads(pickle.dumps(warning.message)).failures for warning in warnings)
    assert failures == {2: "OSError: [Errno 28] No space left on device"}
    assert results.n_committed == 2 * BLOCK_SIZE
    assert explore.rank(explore.sweep(study, tmp_path / "a.h5"), objectives="cv").shape[0] >= 1


def test_any_synchronous_client_will_do(study, tmp_path):
    settings = {"processes": False, "n_workers": 1, "dashboard_address": "127.0.0.1:0"}
    with LocalCluster(**settings) as cluster, Client(cluster, set_as_default=False) as client:
        assert explore.sweep(study, tmp_path / "a.h5", client=client).is_complete


def test_a_lost_cluster_ends_the_sweep_in_one_line_and_loses_nothing(tmp_path):
    (tmp_path / "long.toml").write_text(grid(CONSTRAINED, 160))  # 23 blocks, so that some are still under way
    study = explore.load_study(tmp_path / "long.toml")
    settings = {"processes": False, "n_workers": 1, "dashboard_address": "127.0.0.1:0"}
    with LocalCluster(**settings) as cluster, Client(cluster) as client:

        def lose(*_):
            cluster.close()

        with pytest.raises(explore.ClusterError, match="cluster was lost"):
            explore.sweep(study, tmp_path / "a.h5", client=client, report_progress=lose)
    assert explore.open_results(tmp_path / "a.h5").n_committed > 0
    assert explore.sweep(study, tmp_path / "a.h5").is_complete


def test_ranking_a_file_agrees_with_ranking_its_table(study, tmp_path):
    explore.sweep(study, tmp_path / "a.h5")

    streamed = explore.rank(tmp_path / "a.h5", objectives=["cv", "swing_angle:max"], order_by="cv")
    at_once = explore.rank(explore.read_results(tmp_path / "a.h5"), objectives=["cv", "swing_angle:max"], order_by="cv")
    second = explore.rank(tmp_path / "a.h5", objectives=["cv", "swing_angle:max"], fronts=2)
    usual = explore.rank(explore.read_results(tmp_path / "a.h5"))

    assert len(streamed) > 10
    assert streamed.index.tolist() == at_once.index.tolist()
    assert second[second["front"] == 1].index.tolist() == streamed.index.tolist()
    assert (second["front"] == 2).any()
    assert usual.index.tolist() == explore.rank(tmp_path / "a.h5").index.tolist()


@pytest.mark.parametrize(("num", "keep"), [(100_000_000_000_000, "all"), (160_000_000_000, "front")])
def test_a_sweep_beyond_all_bounds_is_refused_in_words(tmp_path, num, keep):
    path = tmp_path / "huge.toml"
    path.write_text(grid(CONSTRAINED, num))

    with pytest.raises(explore.RequestError, match="designs are more than a sweep can do"):
        explore.sweep(explore.load_study(path), tmp_path / "huge.h5", keep=keep)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("wrong", [{"keep": "frnt"}, {"workers": 0}])
def test_wrong_arguments_are_refused(study, tmp_path, wrong):
    with pytest.raises(explore.RequestError, match=next(iter(wrong))):
        explore.sweep(study, tmp_path / "a.h5", **wrong)
    assert not (tmp_path / "a.h5").exists()


def test_a_damaged_front_is_not_called_complete(study, tmp_path):
    path = tmp_path / "a.h5"
    explore.sweep(study, path, keep="front")
    layout = read_layout(path)
    content = bytearray(path.read_bytes())
    content[layout.offset(layout.columns[1], 0)] ^= 1
    path.write_bytes(content)

    with pytest.raises(explore.ResultsError, match="is damaged; use `restart=True`"):
        explore.sweep(study, path, keep="front")
    assert path.read_bytes() == content


def test_an_address_that_dask_cannot_read_is_one_line():
    reached = remote_cluster("tcp://[::1:9", "crank-rocker")
    with (
        pytest.raises(explore.ClusterError, match=r"no dask scheduler answers at tcp://\[::1:9: invalid addr"),
        reached,
    ):
        pytest.fail("it was reached")


@pytest.mark.parametrize("name", ["explore", "kernel", "numpy", "numba", "scipy"])
def test_workers_must_have_our_version_of_all_that_computes(name):
    ours = environment_of("crank-rocker")
    check_environment(ours, "tcp://far:1", "crank-rocker")
    with pytest.raises(
        explore.ClusterError, match=rf"tcp://far:1 has other versions: {name} 0\.1 there, .* here; make"
    ):
        check_environment({**ours, name: "0.1"}, "tcp://far:1", "crank-rocker")
    without = {other: version for other, version in ours.items() if other != name}
    with pytest.raises(explore.ClusterError, match=f"far:1 has other versions: {name} unknown there, .* here; make"):
        check_environment(without, "tcp://far:1", "crank-rocker")
    check_environment({**ours, "python": "0.1", "processor": "other"}, "tcp://far:1", "crank-rocker")


def test_the_log_lists_the_types_of_processors_once_there_are_two():
    lines, ours = [], environment_of("crank-rocker")
    environments = runs.Environments("crank-rocker", lambda event, **facts: lines.append((event, facts)))
    for processor in ("zen", "zen", "arm", "zen", "vax"):
        environments.check({**ours, "processor": processor}, "tcp://far:1")
    assert lines == [("processors", {"types": types}) for types in (["arm", "zen"], ["arm", "vax", "zen"])]


def test_a_block_of_other_versions_is_refused(study, tmp_path, monkeypatch):
    """A worker may join after the versions of all were compared."""
    real = runs.evaluate_block

    def foreign(*arguments):
        result = real(*arguments)
        return replace(result, environment={**result.environment, "numpy": "0.1"})

    monkeypatch.setattr(runs, "evaluate_block", foreign)
    with pytest.raises(explore.ClusterError, match="that computed block [012] has other versions: numpy 0.1 there"):
        run(study, tmp_path / "a.h5")
    assert explore.open_results(tmp_path / "a.h5").n_committed == 0


def test_no_failure_may_be_allowed(study, tmp_path, monkeypatch):
    monkeypatch.setattr(runs, "evaluate_block", poisoned)
    with pytest.raises(explore.ClusterError, match="stopped after 1 failed block"):
        explore.sweep(study, tmp_path / "a.h5", max_failures=0)


def test_as_many_blocks_may_fail_as_allowed(study, tmp_path, monkeypatch):
    monkeypatch.setattr(runs, "evaluate_block", poisoned_at_1)
    with pytest.warns(explore.FailedBlocksWarning, match="block 1 failed and was left out"):
        results = explore.sweep(study, tmp_path / "a.h5", max_failures=1)
    assert results.n_committed == 151_200 - BLOCK_SIZE


def test_the_log_names_the_designs_of_a_failed_block(study, tmp_path, monkeypatch):
    events = []
    monkeypatch.setattr(runs, "evaluate_block", poisoned)
    run(study, tmp_path / "a.h5", listener=lambda event, facts: events.append((event, facts)))

    designs = {facts["block"]: facts["designs"] for event, facts in events if event == "failure"}
    assert designs == {0: [0, 65_535], 1: [65_536, 131_071], 2: [131_072, 151_199]}


def test_a_sweep_does_not_import_what_it_does_not_need(tmp_path):
    (tmp_path / "drawn.toml").write_text(
        'mechanism = "crank-rocker"\nparameters.crank = {min = 40, max = 60}\n'
        "parameters.coupler = 200\nparameters.rocker = 80\nparameters.ground = 201\nparameters.speed = 40\n"
        'sampling = {method = "sobol", count = 64}\n',
        encoding="utf-8",
    )
    program = (  # in a process of its own: other tests import them
        "import sys, explore\n"
        f"explore.sweep(explore.load_study({str(tmp_path / 'drawn.toml')!r}), {str(tmp_path / 'a.h5')!r})\n"
        "import explore.running.motions\n"  # as `explore simulate`, the report and the service
        "unneeded = {'distributed', 'pandas', 'pint', 'scipy.integrate', 'scipy.optimize', 'scipy.stats'}\n"
        "print(unneeded.intersection(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"
