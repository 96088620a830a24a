"""Tasks and refinements as jobs of a service: as the command line makes them, refused in words where they cannot be."""

import json
import time
from dataclasses import replace

import pytest
from command_line import run
from refinable import BASE, TASK
from studies import FEW, swept
from waiting import wait_until

from explore.base.errors import ConfigError, RequestError, ResultsError
from explore.running.runs import Progress
from explore.service.folder import Folder, State
from explore.service.job_files import Kind, Refinement, read_job_file
from explore.service.plans import Limits
from explore.service.queue import Jobs, StateError, UnknownJobError
from explore.service.runner import Work
from explore.service.station import open_station
from explore.service.sweep_process import _Printer, _synthesize
from explore.synthesis.tasks.task_files import TaskFile, parse_task, task_starter

#: A text of a path, whose search takes seconds.
PATH_TASK = task_starter("path")
#: The results of the study to refine.
base = swept(BASE, "base", give=lambda results: results.path)


@pytest.fixture
def jobs(tmp_path, base):
    """Jobs of a folder in which the results of `base` are, and another job waits."""
    folder = Folder(tmp_path / "served")
    with folder.locked():
        found = Jobs(folder, Limits(), lambda *_: None)
        found.submit("base", BASE.encode())
        found.take()
        folder.results_path("base").write_bytes(base.read_bytes())
        found.settle("base", State.done)
        found.release()
        found.submit("waits", FEW.encode())
        yield found


def refinement(**changes):
    return replace(Refinement("base", evaluations=4096), **changes).to_toml().encode()


def wait_done(station, *names):
    for name in names:
        wait_until(lambda name=name: station.jobs.get(name).state not in (State.queued, State.running))
        job = station.jobs.get(name)
        assert (job.state, job.reason) == (State.done, "")


# --- results ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("processes", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_results_are_those_of_the_command_line_to_the_byte(processes, tmp_path):
    (tmp_path / "base.toml").write_text(BASE)
    (tmp_path / "task.toml").write_text(TASK)
    run("sweep", "base.toml", "-o", "base.h5", cwd=tmp_path)
    run("sweep", "base.toml", "--keep", "front", "-o", "front.h5", cwd=tmp_path)
    run("synthesize", "task.toml", "-o", "task.h5", cwd=tmp_path)
    options = ("--metric", "cv", "--metric", "swing_angle", "--evaluations", "2000", "--seed", "7")
    run("refine", "base.h5", *options, "-o", "refined.h5", cwd=tmp_path)
    run("refine", "task.h5", "--evaluations", "300", "-o", "task-refined.h5", cwd=tmp_path)
    with open_station(tmp_path / "served", Limits(), Work(workers=2, processes=processes)) as station:
        station.jobs.submit("base", BASE.encode())
        station.jobs.submit("front", BASE.encode(), keep="front")
        station.jobs.submit("task", TASK.encode(), kind=Kind.task)
        wait_done(station, "base", "front", "task")
        chosen = refinement(metric=("cv", "swing_angle"), evaluations=2000, seed=7)
        station.jobs.submit("refined", chosen, kind=Kind.refinement)
        of_task = refinement(refine="task", evaluations=300)
        station.jobs.submit("task-refined", of_task, kind=Kind.refinement)
        wait_done(station, "refined", "task-refined")
        found = {job.name: job for job in station.jobs.in_order()}
    for name, designs in (("base", 1024), ("front", 1024), ("task", 7), ("refined", 2000), ("task-refined", 300)):
        assert (tmp_path / f"served/results/{name}.h5").read_bytes() == (tmp_path / f"{name}.h5").read_bytes(), name
        assert (found[name].done, found[name].designs) == (designs, designs)
    assert [found[name].kind for name in ("base", "task", "refined")] == ["study", "task", "refinement"]
    assert found["refined"].refine == "base"
    with Folder(tmp_path / "served").locked():
        again = Jobs(Folder(tmp_path / "served"), Limits(), lambda *_: None)
        assert {job.name: job for job in again.in_order()} == {
            name: replace(job, number=0, priority=5) for name, job in found.items()
        }


def test_a_search_tells_its_steps_and_begins_again_when_it_was_cancelled(tmp_path):
    with open_station(tmp_path, Limits(), Work(workers=1)) as station:
        station.jobs.submit("path", PATH_TASK.encode(), kind=Kind.task)
        end = time.monotonic() + 240
        while not (job := station.jobs.get("path")).steps_done:
            assert time.monotonic() < end
            assert job.state in (State.queued, State.running), job
            time.sleep(0.005)
        assert job.steps_done <= job.steps
        assert job.to_json()["seconds_left"] >= 0.0
        assert (job.done, job.designs) == (0, 0)
        station.runner.cancel("path")
        job = station.jobs.retry("path")
        assert (job.state, job.designs) == (State.queued, 0)
        station.runner.cancel("path")
    assert not (tmp_path / "results/path.h5").exists()


def test_a_part_of_a_search_is_no_result_of_a_job(tmp_path, monkeypatch):
    """A search that was stopped after it found something leaves no file, which would keep it from running again."""
    task = parse_task(task_starter("dead-positions"), "task.toml")
    found = replace(task.find(), is_interrupted=True)
    monkeypatch.setattr(TaskFile, "find", lambda *_: found)
    with pytest.raises(KeyboardInterrupt):
        _synthesize(task, tmp_path / "task.h5")
    assert not list(tmp_path.iterdir())


def test_what_a_sweep_on_other_machines_waits_for_is_told(capfd):
    """Workers do not tell when they compile: until the first designs come, the job says why that may take long."""

    def told(printer, event, **facts):
        printer.event(event, facts)
        return [json.loads(line)["reason"] for line in capfd.readouterr().out.splitlines()]

    remote = _Printer({"scheduler": "tcp://host:8786"})
    assert "workers compile the kernels before" in told(remote, "workers", joined=["tcp://a"], left=[])[0]
    assert told(remote, "waiting", reason="the cluster has no worker") == ["the cluster has no worker"]
    assert told(remote, "workers", joined=[], left=["tcp://a"]) == []
    assert told(remote, "failure", block=3, problem="no memory") == ["block 3 failed: no memory"]
    assert told(_Printer({"scheduler": None}), "workers", joined=["tcp://a"], left=[]) == []
    remote.progress(Progress(256, 1024, 0, 256, 10))
    first = json.loads(capfd.readouterr().out)
    assert (first["event"], first["done"], first["computed"], first["feasible"]) == ("progress", 256, 256, 10)
    assert told(remote, "workers", joined=["tcp://b"], left=[]) == [], "others compute already"


# --- what is refused --------------------------------------------------------------------------------------------------


def test_a_task_names_no_file_of_the_server(jobs, tmp_path):
    secret = tmp_path / "secret.csv"
    secret.write_text("hunter2,1\n")
    text = f'task = "path"\n[target]\nfile = "{secret}"\n'
    with pytest.raises(
        ConfigError, match="task.toml:3: target.file: a server reads no file of points; write"
    ) as caught:
        jobs.submit("task", text.encode(), kind=Kind.task)
    assert "hunter2" not in str(caught.value)
    inline = text.replace(f'file = "{secret}"', "points = [[0, 0], [10, 0], [10, 10], [0, 10]]\nclosed = true")
    assert jobs.submit("task", inline.encode(), kind=Kind.task).kind == "task"


@pytest.mark.parametrize(
    ("text", "kind", "reason"),
    [
        (TASK, Kind.study, "this is a task, but a study was announced; submit it as a task"),
        (FEW, Kind.task, "mechanism: this is a study, but a task was announced"),
        (TASK.replace("task =", "taks ="), Kind.task, "x.toml:1: task: is missing"),
        (Refinement("base").to_toml(), Kind.study, "x.toml:1: refine: this is a refinement, but a study was announced"),
        ('refine = "base"\nseed = 1.5\nmetric = "cv"\nsede = 1\n', Kind.refinement, "x.toml:2: seed: must be a whole"),
        ('refine = "base"\nmetric = "cv"\n', Kind.refinement, "x.toml:2: metric: must be a list of metrics"),
        ("refine = 7\n", Kind.refinement, "x.toml:1: refine: must be the name of a job"),
        ('refine = "base"\nsede = 1\n', Kind.refinement, "x.toml:2: sede: unknown key"),
        ("mechanism = 1\nrefine = 1\n", Kind.refinement, "this is a study, but a refinement was announced"),
    ],
)
def test_a_file_of_another_kind_or_of_none_is_refused(text, kind, reason):
    with pytest.raises(ConfigError, match=reason):
        read_job_file("x", text.encode(), kind)


@pytest.mark.parametrize(
    ("changes", "error", "reason"),
    [
        ({"refine": "nothing"}, UnknownJobError, "there is no job nothing"),
        ({"refine": "../base"}, RequestError, "a job's name has 1 to 64"),
        ({"refine": "waits"}, StateError, "waits is queued; its results can be refined when it is done"),
        ({"metric": ("cv",)}, RequestError, "cv alone has one best design, not a front"),
        (
            {"evaluations": 2_000_000_000},
            RequestError,
            "this server takes 1,000,000,000 at most; evaluate",
        ),
    ],
)
def test_refinements_that_are_not_possible_are_refused(changes, error, reason, jobs):
    with pytest.raises(error, match=reason) as caught:
        jobs.submit("refined", refinement(**changes), kind=Kind.refinement)
    assert str(jobs._folder.path) not in str(caught.value)
    with pytest.raises(UnknownJobError):
        jobs.get("refined")


def test_results_that_are_damaged_are_named_without_the_folder(jobs):
    jobs._folder.results_path("base").write_bytes(b"no results")
    with pytest.raises(ResultsError, match=r"^base\.h5") as caught:
        jobs.submit("refined", refinement(), kind=Kind.refinement)
    assert str(jobs._folder.path) not in str(caught.value)


def test_results_that_a_refinement_needs_are_not_deleted(jobs):
    jobs.submit("refined", refinement(), kind=Kind.refinement)
    with pytest.raises(StateError, match="refined refines the results of base; cancel it, or wait until it is done"):
        jobs.delete("base")
    jobs.cancel("refined")
    jobs.delete("base")
