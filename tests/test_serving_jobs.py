"""Jobs of a service: files that `ls` explains, kills that lose nothing, results as of the command line."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from command_line import run
from studies import FEW, GOOD
from waiting import wait_until

from explore.base.errors import ConfigError, RequestError
from explore.base.files import unfinished_name
from explore.service.folder import Folder, State, check_name
from explore.service.job_files import Kind, Refinement, read_job_file
from explore.service.jobs import Job, append_event, read_events
from explore.service.plans import Limits, check_limits, make_plan
from explore.service.queue import Jobs, StateError, UnknownJobError
from explore.service.runner import Runner, Work
from explore.service.station import Estimates, open_station
from explore.synthesis.tasks.task_files import task_starter

ROOT = Path(__file__).parents[1]
#: 20 blocks of designs that are simulated, a second of one thread: long enough to be killed at any moment.
LONG = """mechanism = "crank-rocker"
[parameters]
crank = { start = 100, stop = 140, num = 41 }
coupler = { start = 1000, stop = 1100, num = 80 }
rocker = { start = 520, stop = 620, num = 20 }
ground = { start = 650, stop = 750, num = 20 }
[evaluate]
metrics = ["cv", "swing_angle"]
"""


@pytest.fixture
def jobs(tmp_path):
    """Jobs of a new folder, without anything that sweeps them."""
    folder = Folder(tmp_path / "served")
    with folder.locked():
        yield Jobs(folder, Limits(), lambda *_: None)


def reopened(tmp_path):
    return Jobs(Folder(tmp_path / "served"), Limits(), lambda *_: None)


def files(tmp_path):
    """The studies of a folder, as `ls` shows them."""
    folder = tmp_path / "served"
    return sorted(str(file.relative_to(folder)) for file in folder.rglob("*.toml"))


def wait_settled(station, *names):
    settled = (State.done, State.failed, State.cancelled)
    wait_until(lambda: all(station.jobs.get(name).state in settled for name in names))


# --- names, places, order ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["a", "grid", "crank-rocker_2", "7", "x" * 64])
def test_names(name):
    assert check_name(name) == name


@pytest.mark.parametrize(
    "name", ["", ".", "..", "../x", "a/b", "a\\b", "A", "a.b", "-a", "a-", "é", "a\n", "a\0", "x" * 65, "a b", "/etc"]
)
def test_names_that_are_no_slugs(name, jobs):
    for act in (check_name, jobs.get, jobs.cancel, jobs.retry, jobs.delete, lambda name: jobs.submit(name, b"")):
        with pytest.raises(RequestError, match="a job's name has 1 to 64"):
            act(name)


def test_a_job_is_where_its_state_is(jobs, tmp_path):
    jobs.submit("one", FEW.encode())
    jobs.submit("two", GOOD.encode(), priority=2)
    jobs.submit("three", GOOD.encode())
    assert files(tmp_path) == ["queue/2-000002-two.toml", "queue/5-000001-one.toml", "queue/5-000003-three.toml"]
    assert [job.name for job in jobs.in_order()] == ["two", "one", "three"]

    assert jobs.take().name == "two"
    assert jobs.take().name == "two", "one sweep at a time"
    jobs.settle("two", State.done)
    assert jobs.take().name == "one"
    jobs.settle("one", State.failed, "block 0 failed")
    jobs.cancel("three")
    assert files(tmp_path) == ["studies/cancelled/three.toml", "studies/done/two.toml", "studies/failed/one.toml"]
    assert jobs.get("one").reason == "block 0 failed"
    assert (tmp_path / "served/studies/failed/one.toml").read_text() == FEW == jobs.study("one").decode()

    jobs.retry("one")
    assert jobs.get("one").reason == ""
    jobs.prioritise("one", 1)
    assert files(tmp_path)[0] == "queue/1-000004-one.toml"
    jobs.release()
    jobs.delete("two")
    assert [job.name for job in jobs.in_order()] == ["one", "three"]


def test_a_restart_knows_what_was_known(jobs, tmp_path):
    for name in ("done", "failed", "running", "queued", "cancelled"):
        jobs.submit(name, FEW.encode(), keep="front" if name == "failed" else "all")
    for name in ("done", "failed", "running"):
        assert jobs.take().name == name
        jobs.report(name, done=8, feasible=3, computed=8, seconds=0.5)
        if name != "running":
            jobs.settle(name, State(name), "for a reason" * (name == "failed"))
    jobs.cancel("cancelled")
    again = {job.name: job for job in reopened(tmp_path).in_order()}
    assert again.keys() == {job.name for job in jobs.in_order()}
    for job in jobs.in_order():
        if job.state == State.running:  # the file of results knows how far it is
            job = replace(job, done=0, feasible=0, computed=0, seconds=0.0)
        number = job.number if job.state == State.queued else 0
        assert again[job.name] == replace(job, number=number)
    assert again["failed"].keep == "front"
    assert again["failed"].reason == "for a reason"
    assert [job.name for job in reopened(tmp_path).in_order()][:2] == ["running", "queued"]


def test_what_cannot_be_done_in_a_state_is_refused(jobs):
    jobs.submit("grid", FEW.encode())
    with pytest.raises(
        StateError, match=r"there is a job grid already \(queued\); choose another name, such as grid-2"
    ):
        jobs.submit("grid", FEW.encode())
    with pytest.raises(StateError, match="grid is queued; only a job that is failed or cancelled can be retried"):
        jobs.retry("grid")
    jobs.take()
    with pytest.raises(StateError, match="grid is running; cancel it"):
        jobs.delete("grid")
    with pytest.raises(StateError, match="only a job that is queued has a priority"):
        jobs.prioritise("grid", 1)
    jobs.cancel("grid")
    with pytest.raises(StateError, match="grid is still ending; cancel it"):
        jobs.delete("grid")
    with pytest.raises(StateError, match="grid is cancelled; only a job that is queued or running"):
        jobs.cancel("grid")
    with pytest.raises(UnknownJobError, match="there is no job other"):
        jobs.get("other")


def test_other_files_and_damaged_logs_are_borne(jobs, tmp_path):
    jobs.submit("grid", FEW.encode())
    served = tmp_path / "served"
    (served / "queue/notes.txt").write_text("mine")
    (served / "queue/5-000009-..toml").write_text("no name")
    (served / "studies/done/UPPER.toml").write_text("no slug")
    log = served / "log/grid.jsonl"
    log.write_bytes(
        log.read_bytes() + b'\0\0\n[1]\n{"designs": "many", "keep": 7, "state": "done", "reason": 1}\n{"desi'
    )
    append_event(log, "queued", {"mechanism": "gears"})
    job = reopened(tmp_path).get("grid")
    assert (job.designs, job.keep, job.state, job.mechanism) == (8, "all", State.queued, "gears")
    assert [job.name for job in reopened(tmp_path).in_order()] == ["grid"]
    assert read_events(log)[-1]["mechanism"] == "gears", "on a line of its own"


# --- plans and limits -------------------------------------------------------------------------------------------------


def test_a_study_names_no_file_of_the_server(jobs, tmp_path):
    secret = tmp_path / "secret.csv"
    secret.write_text("crank,password\n1,hunter2\n")
    for section in (f'method = "table"\nfile = "{secret}"', f'file = "{secret}"', 'method = "table"'):
        with pytest.raises(
            ConfigError, match=r"grid.toml:\d: sampling.(file|method): a server reads no table"
        ) as caught:
            jobs.submit("grid", f"{GOOD}[sampling]\n{section}\n".encode())
        assert "hunter2" not in str(caught.value)
        assert "password" not in str(caught.value)


@pytest.mark.parametrize(
    "content", [b"\xff\xfe", b"", b"a" * (1 << 22), b"[[[[", b"\0", b"mechanism = 1", b"[" * 100_000]
)
def test_what_is_no_study_is_refused(content, jobs):
    with pytest.raises(ConfigError, match=r"^grid.toml"):
        jobs.submit("grid", content)


@pytest.mark.parametrize(
    ("facts", "left"),
    [
        ({"designs": 100, "done": 40, "computed": 20, "seconds": 10.0}, 30.0),
        ({"steps": 7, "steps_done": 2, "seconds": 10.0}, 25.0),
        ({"designs": 100}, None),
    ],
)
def test_the_seconds_left_are_those_of_what_is_not_done(facts, left):
    assert Job("x", State.running, **facts).to_json()["seconds_left"] == left


def test_threads_share_the_work_of_an_estimate(jobs, tmp_path, monkeypatch):
    estimates = Estimates(tmp_path, workers=4)
    monkeypatch.setattr(estimates._calls, "call", lambda *_: 2.0)
    assert estimates.seconds(FEW.encode(), jobs.plan("few", FEW.encode())) == (8 * 2.0 / 4, "")
    estimates.close()


def test_limits_refuse_in_words(jobs, tmp_path):
    plan = make_plan(read_job_file("grid", FEW.encode()))
    assert (plan.mechanism, plan.designs, plan.blocks) == ("crank-rocker", 8, 1)
    check_limits(plan, Limits(designs=8, bytes=plan.bytes), tmp_path)
    with pytest.raises(RequestError, match="the study has 8 designs, but this server takes 7 at most"):
        check_limits(plan, Limits(designs=7), tmp_path)
    with pytest.raises(RequestError, match=f"the results need {plan.bytes:,} bytes, but this server takes 10 at most"):
        check_limits(plan, Limits(bytes=10), tmp_path)
    check_limits(make_plan(read_job_file("grid", FEW.encode()), "front"), Limits(bytes=10), tmp_path)
    axis = "{ start = 1000, stop = 2000, num = 1_000_000 }"
    huge = make_plan(read_job_file("grid", GOOD.replace("1000", axis).replace("700", axis).encode()))
    with pytest.raises(RequestError, match="bytes, but only .* are free on the server"):
        check_limits(huge, Limits(designs=2**62, bytes=2**62), tmp_path)
    full = Jobs(Folder(tmp_path / "served"), Limits(queue=1), lambda *_: None)
    full.submit("one", FEW.encode())
    with pytest.raises(StateError, match="1 jobs wait already, which is this server's limit; try again later"):
        full.submit("two", FEW.encode())


# --- sweeps -----------------------------------------------------------------------------------------------------------


def test_what_a_kill_left_unfinished_in_the_queue_is_removed(tmp_path):
    folder = Folder(tmp_path)
    with folder.locked():
        pass
    waiting = folder.queue / "5-000001-grid.toml"
    kept = [waiting, waiting.with_name(f"{waiting.name}.unfinished-by-hand")]
    for file in [*kept, unfinished_name(waiting), unfinished_name(folder.queue / "5-000002-gone.toml")]:
        file.write_text(FEW, encoding="utf-8")
    with folder.locked():
        assert sorted(folder.queue.iterdir()) == kept


def test_indexes_of_no_job_are_removed_and_other_folders_stay(tmp_path):
    folder, outside = Folder(tmp_path / "served"), tmp_path / "outside"
    with folder.locked():
        pass
    kept = [folder.index_path("grid"), folder.index / "Of a person"]
    for made in [*kept, folder.index_path("gone"), unfinished_name(folder.index_path("grid")), outside]:
        made.mkdir()
        (made / "values").write_text("1", encoding="utf-8")
    link = folder.index / "elsewhere"
    link.symlink_to(outside)
    folder.remove_indexes_but(["grid", "other"])
    assert sorted(folder.index.iterdir()) == sorted([*kept, link])
    assert (outside / "values").exists()


def test_a_cancelled_sweep_goes_on_where_it_ended(tmp_path):
    text = LONG.replace("num = 80", "num = 160").encode()
    with open_station(tmp_path, Limits(), Work(workers=1)) as station:
        station.jobs.submit("long", text)
        wait_until(lambda: station.jobs.get("long").done > 0)
        station.runner.cancel("long")
        station.jobs.submit("few", FEW.encode())
        wait_settled(station, "few")
        done = station.jobs.get("long").done
        assert 0 < done < station.jobs.get("long").designs
        station.jobs.retry("long")
        wait_settled(station, "long")
        job = station.jobs.get("long")
    assert job.state == State.done
    assert job.done == job.designs == job.computed + (job.done - job.computed)
    assert 0 < job.computed <= job.designs - done


def test_a_sweep_that_takes_too_long_has_failed(tmp_path):
    with open_station(tmp_path, Limits(seconds=1.0), Work(workers=1)) as station:
        station.jobs.submit("long", LONG.replace("num = 80", "num = 8000").encode())
        wait_settled(station, "long")
        job = station.jobs.get("long")
    assert job.state == State.failed
    assert job.reason == "it took longer than 1 s, this server's limit; retry goes on from there"


def test_results_of_another_study_fail_the_job_in_words_and_the_log_tells(tmp_path):
    with open_station(tmp_path, Limits(), Work(workers=1)) as station:
        station.jobs.submit("few", FEW.encode())
        wait_settled(station, "few")
        (tmp_path / "results/good.h5").write_bytes((tmp_path / "results/few.h5").read_bytes())
        station.jobs.submit("good", GOOD.encode())
        wait_settled(station, "good")
        job = station.jobs.get("good")
        lines = (tmp_path / "log/few.jsonl").read_text().splitlines()
        assert [json.loads(line)["event"] for line in lines] == ["queued", "running", "done"]
        assert json.loads(lines[-1])["done"] == 8
        assert job.state == State.failed
        assert job.reason.startswith("results/good.h5")
        assert "Traceback" not in job.reason
        station.runner.join(0.1)
        wait_until(lambda: can_delete(station.jobs, "good"))
        assert not list(tmp_path.rglob("good*"))
        assert (tmp_path / "results/few.h5").exists()


def can_delete(jobs, name):
    try:
        jobs.delete(name)
    except StateError:
        return False
    return True


def test_a_study_that_a_person_removed_ends_no_service(tmp_path):
    folder = Folder(tmp_path)
    with folder.locked():
        Jobs(folder, Limits(), lambda *_: None).submit("gone", FEW.encode())
    with folder.locked():
        jobs = Jobs(folder, Limits(), lambda *_: None)
        next((tmp_path / "queue").iterdir()).unlink()
        with pytest.raises(UnknownJobError, match="the study of gone was removed from the folder"):
            jobs.take()
        assert jobs.in_order() == []


def test_a_study_that_a_person_removed_while_it_was_swept_ends_no_service(tmp_path):
    with open_station(tmp_path, Limits(), Work(workers=1)) as station:
        station.jobs.submit("gone", LONG.replace("num = 80", "num = 800").encode())
        wait_until(lambda: station.jobs.get("gone").done > 0)
        (tmp_path / "studies/running/gone.toml").unlink()
        with pytest.raises(UnknownJobError, match="the study of gone was removed from the folder"):
            station.runner.cancel("gone")
        station.jobs.submit("few", FEW.encode())
        wait_settled(station, "few")
        assert station.runner.is_alive()
        assert station.jobs.get("few").state == State.done


def test_a_sweep_that_is_killed_without_progress_has_failed(tmp_path):
    """The process of every attempt is killed as soon as it is there."""
    with open_station(tmp_path, Limits(), Work(workers=1)) as station:
        station.jobs.submit("long", LONG.encode())
        killed = set()
        while station.jobs.get("long").state in (State.queued, State.running):
            process = station.runner._process
            if process is not None and process.pid not in killed:
                killed.add(process.pid)
                process.kill()
            time.sleep(0.001)
        job = station.jobs.get("long")
    assert len(killed) == 3
    assert job.reason == "its process was killed by signal 9, 3 times without progress; is memory short?"


def test_kills_are_counted_from_the_last_progress(jobs, tmp_path, monkeypatch):
    jobs.submit("long", LONG.encode())
    runner = Runner(jobs, Folder(tmp_path / "served"), Work())
    done = iter([0, 0, 5, 5, 5, 5])

    def killed(job):
        jobs.report("long", done=next(done))
        return -9, ""

    monkeypatch.setattr(runner, "_sweep", killed)
    runner._run(jobs.take())
    assert jobs.get("long").state == State.failed
    assert list(done) == [5], "two kills, one after progress, two more"


@pytest.fixture
def start(tmp_path):
    """Start the process of a service, which ends with the test, however the test ends."""
    started = []

    def start():
        script = ROOT / "tests/serving_folder.py"
        started.append(subprocess.Popen([sys.executable, script, tmp_path / "served"], cwd=tmp_path))
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.wait()


#: What the kill test runs again and again: kind, text.
KILLED = {
    "one": (Kind.study, LONG),
    "two": (Kind.study, LONG),
    "refined": (Kind.refinement, Refinement("base", ("cv", "swing_angle:max"), evaluations=400_000).to_toml()),
    "found": (Kind.task, task_starter("dead-positions")),
}


@pytest.mark.parametrize("kills", [3, pytest.param(200, marks=pytest.mark.slow)])
def test_kills_at_any_moment_lose_nothing(kills, tmp_path, start):
    """Of the service, of the process of a job, or of both, at random moments: at the end as without them, to the byte.

    The jobs are two studies, a refinement and a task; one that is done is deleted and submitted again.
    """
    folder = Folder(tmp_path / "served")
    random_moments = random.Random(kills)
    expected = results_without_kills(tmp_path)
    with folder.locked():
        Jobs(folder, Limits(), lambda *_: None).submit("base", LONG.encode())
    assert start().wait(timeout=240) == 0

    n_killed = rounds = 0
    while n_killed < kills:
        rounds += 1
        assert rounds < 3 * kills
        with folder.locked():  # the kernel released the lock of the killed process
            submit_again(Jobs(folder, Limits(), lambda *_: None), folder, expected)
        server = start()
        time.sleep(random_moments.uniform(0.0, 2.0))
        whom = random_moments.choice(["server", "sweep", "both"])
        if whom != "server":
            n_killed += kill_sweeps(server.pid)
        if whom != "sweep":
            n_killed += server.poll() is None
            server.kill()
            server.wait()
        else:
            time.sleep(random_moments.uniform(0.0, 0.5))
            server.terminate()
            server.wait()
    server = start()
    assert server.wait(timeout=240) == 0
    for name, (_, text) in KILLED.items():
        assert folder.results_path(name).read_bytes() == expected[name]
        assert folder.study_path(name, State.done).read_text() == text
    assert list(folder.queue.iterdir()) == []


def results_without_kills(tmp_path):
    """What the command line makes of the jobs of the kill test."""
    (tmp_path / "base.toml").write_text(LONG)
    (tmp_path / "found.toml").write_text(KILLED["found"][1])
    run("sweep", "base.toml", "--workers", "1", cwd=tmp_path)
    options = ("--metric", "cv", "--metric", "swing_angle:max", "--evaluations", "400000", "--workers", "1")
    run("refine", "results/base.h5", *options, "-o", "results/refined.h5", cwd=tmp_path)
    run("synthesize", "found.toml", cwd=tmp_path)
    made = {"one": "base", "two": "base", "refined": "refined", "found": "found"}
    return {name: (tmp_path / f"results/{made[name]}.h5").read_bytes() for name in KILLED}


def submit_again(jobs, folder, expected):
    """Check and delete what is done, and queue what is not there or has failed of too many kills."""
    for name, (kind, text) in KILLED.items():
        state = {job.name: job.state for job in jobs.in_order()}.get(name)
        if state == State.done:
            assert folder.results_path(name).read_bytes() == expected[name]
            jobs.delete(name)
        if state in (None, State.done):
            jobs.submit(name, text.encode(), kind=kind)
        if state == State.failed:
            assert "killed by signal" in jobs.get(name).reason
            jobs.retry(name)


def kill_sweeps(parent):
    """Kill the processes that a process started; how many."""
    found = 0
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and int((entry / "stat").read_text().rpartition(")")[2].split()[1]) == parent:
                os.kill(int(entry.name), signal.SIGKILL)
                found += 1
        except (OSError, ValueError):
            continue
    return found
