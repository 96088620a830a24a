"""Workers that are missing, join late, leave, or have other versions."""

import asyncio
import shutil
import time

import pytest
from command_line import call
from distributed import Client, LocalCluster
from waiting import wait_until

import explore
from clusters.processes import PACKAGES, Cluster, Sweep, committed_blocks, digest, finish, study_file
from explore.mechanisms.registry import MECHANISMS
from explore.running import clusters
from explore.running.in_flight import SPARE_BLOCKS

BLOCKS = 12


@pytest.fixture
def config(folder):
    return study_file(folder, BLOCKS)


@pytest.fixture
def empty_package(folder):
    """A path on which a worker finds an empty package `explore`."""
    package = folder / "nothing" / "explore"
    package.mkdir(parents=True)
    (package / "__init__.py").touch()
    return package.parent


def other_package(folder, what):
    """A path on which a worker finds another version of `explore`, and the message about it."""
    copy = folder / "other"
    shutil.copytree(PACKAGES / "explore", copy / "explore")
    if what == "version":
        (copy / "explore" / "_version.py").write_text('__version__ = "9.8.7"\n')
        return copy, ["has other versions", f"explore 9.8.7 there, {explore.__version__} here", "make them equal"]
    declaration = copy / "explore" / "mechanisms" / "crank_rocker" / "declaration.py"
    text = declaration.read_text()
    version = MECHANISMS["crank-rocker"].kernel_version
    declaration.write_text(text.replace(f'kernel_version="{version}"', 'kernel_version="77"'))
    assert declaration.read_text() != text
    return copy, ["has other versions", f"kernel crank-rocker 77 there, crank-rocker {version} here", "make them equal"]


@pytest.mark.parametrize("what", ["version", pytest.param("kernel", marks=pytest.mark.slow)])
def test_workers_of_other_versions_are_refused_before_anything_is_computed(folder, config, cluster: Cluster, what):
    path, (copy, words) = folder / "a.h5", other_package(folder, what)
    cluster.add_worker()
    cluster.add_worker(copy)
    cluster.wait_for_workers(2)
    with Sweep(config, path, "--scheduler", cluster.address, "--quiet") as sweep:
        code, lines = sweep.end()
    assert (code, len(lines)) == (1, 1), lines
    assert lines[0].startswith("error: ")
    assert all(word in lines[0] for word in words), lines
    assert list(folder.glob("a.h5*")) == []  # not even a log


def test_workers_without_the_package_are_refused_in_one_line(folder, config, cluster: Cluster, empty_package):
    cluster.add_worker(empty_package)
    cluster.wait_for_workers(1)
    with Sweep(config, folder / "a.h5", "--scheduler", cluster.address, "--quiet") as sweep:
        code, lines = sweep.end()
    assert (code, len(lines)) == (1, 1), lines
    assert "cannot run explore" in lines[0]
    assert "No module named 'explore." in lines[0]
    assert lines[0].endswith(f"install linkage-explore {explore.__version__} there")
    assert list(folder.glob("a.h5*")) == []


def test_a_worker_without_the_package_that_joins_late_does_no_harm(
    folder, config, cluster: Cluster, expected_digest, empty_package
):
    """It cannot unpickle its task, so it ends, and its block is computed by another worker."""
    path = folder / "a.h5"
    cluster.add_worker()
    cluster.wait_for_workers(1)
    with Sweep(config, path, "--scheduler", cluster.address, "--quiet", seconds=0.5) as sweep:
        sweep.wait_for_blocks(1)
        worker = cluster.add_worker(empty_package)
        worker.process.wait(240)
        assert sweep.end() == (0, [])
    assert digest(path) == expected_digest(BLOCKS)


@pytest.mark.parametrize("what", ["kernel", pytest.param("version", marks=pytest.mark.slow)])
def test_workers_of_other_versions_are_refused_when_they_join(folder, config, cluster: Cluster, expected_digest, what):
    path, (copy, words) = folder / "a.h5", other_package(folder, what)
    cluster.add_worker()
    cluster.wait_for_workers(1)
    with Sweep(config, path, "--scheduler", cluster.address, "--quiet", seconds=0.5) as sweep:
        sweep.wait_for_blocks(1)
        cluster.add_worker(copy)
        code, lines = sweep.end()
    assert (code, len(lines)) == (1, 1), lines
    assert all(word in lines[0] for word in words), lines
    assert 1 <= len(committed_blocks(path)) < BLOCKS
    finish(config, path)
    assert digest(path) == expected_digest(BLOCKS)


def test_a_sweep_waits_for_workers_and_uses_those_that_join(folder, config, cluster: Cluster, expected_digest):
    path = folder / "a.h5"
    with Sweep(config, path, "--scheduler", cluster.address, "--quiet", seconds=0.3) as sweep:
        wait_until(lambda: "the cluster has no worker; waiting for one" in sweep.stderr)
        first = cluster.add_worker()
        sweep.wait_for_blocks(1)
        second = cluster.add_worker()
        code, lines = sweep.end()
    assert (code, lines) == (0, ["the cluster has no worker; waiting for one"])
    assert {pid for _, pid in sweep.executions} == {first.process.pid, second.process.pid}
    assert sweep.n_repetitions == 0
    threads = [event["threads"] for event in sweep.log() if event["event"] == "workers"]
    assert threads == [0, 1, 2]
    assert digest(path) == expected_digest(BLOCKS)


def test_the_number_of_blocks_in_flight_follows_the_workers():
    """At most one block in flight for each thread and two more."""
    from explore.running.in_flight import BlocksInFlight

    blocks_in_flight, most, threads = set(), {1: 0, 3: 0}, 1

    def submit(number, _):
        blocks_in_flight.add(number)
        most[threads] = max(most[threads], len(blocks_in_flight))
        return client.submit(time.sleep, 0.05, pure=False)

    def accept(number, _):
        nonlocal threads
        blocks_in_flight.discard(number)
        if number == 10:
            cluster.scale(3)
            client.wait_for_workers(3, timeout=240)
            threads = 3

    settings = {"processes": False, "threads_per_worker": 1, "dashboard_address": "127.0.0.1:0"}
    with LocalCluster(n_workers=1, **settings) as cluster, Client(cluster, set_as_default=False) as client:
        BlocksInFlight(client, submit, accept, pytest.fail, lambda *_, **__: None).run(range(120))
    assert most == {1: 1 + SPARE_BLOCKS, 3: 3 + SPARE_BLOCKS}


def test_a_scheduler_that_does_not_answer_is_named_in_one_line(folder, config, monkeypatch):
    assert clusters.CONNECT_TIMEOUT == 10
    monkeypatch.setattr(clusters, "CONNECT_TIMEOUT", 1)
    start = time.monotonic()
    code, _, err = call("sweep", config, "-o", folder / "a.h5", "--scheduler", "tcp://127.0.0.1:9", "--quiet")
    assert time.monotonic() - start < 110  # one for the connection, the rest for a loaded machine
    assert (code, err.count("\n")) == (1, 1), err
    assert err.startswith("error: no dask scheduler answers at tcp://127.0.0.1:9: ")
    assert err.endswith("start one with `dask scheduler`\n")


def test_an_asynchronous_client_is_refused(folder, config):
    async def sweep():
        settings = {"processes": False, "n_workers": 1, "dashboard_address": "127.0.0.1:0", "asynchronous": True}
        async with LocalCluster(**settings) as cluster, Client(cluster, asynchronous=True) as client:
            with pytest.raises(explore.ExploreError, match="the client is asynchronous; give a synchronous"):
                explore.sweep(explore.load_study(config), folder / "a.h5", client=client)

    asyncio.run(sweep())


@pytest.mark.parametrize("address", ["", "here", "tcp://127.0.0.1", "http://127.0.0.1:1", "tls://127.0.0.1:1"])
def test_a_mistyped_scheduler_is_refused_at_once(folder, config, address):
    code, _, err = call("sweep", config, "-o", folder / "a.h5", "--scheduler", address, "--quiet")
    assert (code, err.count("\n")) == (2, 1), err
    assert not (folder / "a.h5").exists()
