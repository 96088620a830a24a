"""Tasks and refinements as jobs of a service: as the command line makes them, refused in words where they cannot be."""

import json
import time
from dataclasses import replace

import pytest
from command_line import run
from served import Served, wait_settled
from studies import FEW

import explore
from explore.errors import ConfigError, RequestError, ResultsError
from explore.serving.folder import Folder, State
from explore.serving.job_files import Kind, Refinement, read_job_file
from explore.serving.plans import Limits
from explore.serving.queue import Jobs, StateError, UnknownJobError
from explore.serving.runner import Work
from explore.serving.station import open_station
from explore.synthesis.tasks.task_files import task_starter

#: 1024 designs with two objectives and ranges to refine.
BASE = """mechanism = "crank-rocker"
[parameters]
crank = { start = 100, stop = 140, num = 32 }
coupler = { start = 1000, stop = 1100, num = 32 }
rocker = 541.7118
ground = 691.7118
[rank]
metrics = ["cv", "swing_angle:max"]
"""
#: Linkages in closed form, seven with the best of each family: found within a second.
TASK = task_starter("dead-positions").replace("count = 20", "count = 6")
#: A text of a path, whose search takes seconds.
PATH_TASK = task_starter("path")


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    with Served(tmp_path_factory.mktemp("kinds") / "served") as server:
        with server.client() as client:
            client.post("/api/studies", json={"name": "base", "study": BASE}).raise_for_status()
            assert wait_settled(client, "base")["state"] == "done"
        yield server
        assert server.stop() == 0


@pytest.fixture
def client(served):
    with served.client() as client:
        yield client


@pytest.fixture
def jobs(tmp_path, served):
    """Jobs of a folder in which the results of `base` are, and another job waits."""
    folder = Folder(tmp_path / "served")
    with folder.locked():
        found = Jobs(folder, Limits(), lambda *_: None)
        found.submit("base", BASE.encode())
        found.take()
        folder.results_path("base").write_bytes((served.folder / "results/base.h5").read_bytes())
        found.settle("base", State.done)
        found.release()
        found.submit("waits", FEW.encode())
        yield found


def refinement(**changes):
    return replace(Refinement("base", evaluations=4096), **changes).to_toml().encode()


def wait_done(station, *names):
    end = time.monotonic() + 240
    for name in names:
        while (job := station.jobs.get(name)).state in (State.queued, State.running):
            assert time.monotonic() < end
            time.sleep(0.01)
        assert (job.state, job.reason) == (State.done, "")


# --- results ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("processes", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_results_are_those_of_the_command_line_to_the_byte(processes, tmp_path):
    (tmp_path / "base.toml").write_text(BASE)
    (tmp_path / "task.toml").write_text(TASK)
    run("sweep", "base.toml", "-o", "base.h5", cwd=tmp_path)
    run("synthesize", "task.toml", "-o", "task.h5", cwd=tmp_path)
    options = ("--metric", "cv", "--metric", "swing_angle", "--evaluations", "2000", "--seed", "7")
    run("refine", "base.h5", *options, "-o", "refined.h5", cwd=tmp_path)
    run("refine", "task.h5", "--evaluations", "300", "-o", "task-refined.h5", cwd=tmp_path)
    with open_station(tmp_path / "served", Limits(), Work(workers=2, processes=processes)) as station:
        station.jobs.submit("base", BASE.encode())
        station.jobs.submit("task", TASK.encode(), kind=Kind.task)
        wait_done(station, "base", "task")
        chosen = refinement(metric=("cv", "swing_angle"), evaluations=2000, seed=7)
        station.jobs.submit("refined", chosen, kind=Kind.refinement)
        of_task = refinement(refine="task", evaluations=300)
        station.jobs.submit("task-refined", of_task, kind=Kind.refinement)
        wait_done(station, "refined", "task-refined")
        found = {job.name: job for job in station.jobs.in_order()}
    for name, designs in (("base", 1024), ("task", 7), ("refined", 2000), ("task-refined", 300)):
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


# --- what is refused --------------------------------------------------------------------------------------------------


def test_all_problems_of_a_task_come_with_their_lines(jobs):
    wrong = TASK.replace("swing_angle = 40", "swing_angel = 40").replace("count = 6", 'count = "six"')
    with pytest.raises(ConfigError) as caught:
        jobs.submit("task", wrong.encode(), kind=Kind.task)
    lines = wrong.splitlines()
    places = [1 + next(number for number, line in enumerate(lines) if key in line) for key in ("swing_angel", '"six"')]
    starts = [
        f"task.toml:{places[0]}: target.swing_angel: unknown key",
        f"task.toml:{places[1]}: search.count: must be",
    ]
    assert len(caught.value.problems) == 2
    assert all(text.startswith(start) for text, start in zip(caught.value.problems, starts, strict=True))
    with pytest.raises(UnknownJobError):
        jobs.get("task")


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
        ({"metric": ("cv", "cvv")}, RequestError, "cvv"),
        ({"evaluations": 1}, RequestError, "evaluations = 1: the front to refine has"),
        ({"seed": -1}, RequestError, "seed = -1: must be at least 0"),
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


# --- over HTTP, from Python and on the command line -------------------------------------------------------------------


def test_routes_of_tasks_and_refinements(client):
    plan = client.post("/api/tasks?dry_run=true", json={"name": "plan", "task": TASK})
    assert plan.status_code == 200
    assert plan.json()["method"] == "dead-positions"
    assert plan.json()["designs"] is plan.json()["seconds"] is None
    body = {"name": "plan", "refine": "base", "metric": ["cv", "swing_angle:max"], "evaluations": 2048, "seed": 3}
    plan = client.post("/api/refinements?dry_run=true", json=body).json()
    assert (plan["kind"], plan["designs"], plan["blocks"]) == ("refinement", 2048, 8)
    assert plan["seconds"] > 0.0
    assert client.get("/api/jobs/plan").status_code == 404

    job = client.post("/api/refinements", json={**body, "name": "http-refined"})
    assert (job.status_code, job.json()["refine"]) == (201, "base")
    text = client.get("/api/jobs/http-refined/study").text
    assert read_job_file("x", text.encode()) == Refinement("base", ("cv", "swing_angle:max"), 2048, 3)
    assert client.post("/api/tasks", json={"name": "http-task", "task": TASK}).status_code == 201
    for name, designs in (("http-refined", 2048), ("http-task", 7)):
        assert wait_settled(client, name)["state"] == "done"
        assert client.get(f"/api/results/{name}").json()["designs"] == designs
    answer = client.post("/api/tasks", json={"name": "wrong", "task": TASK.replace("[bounds]", "[bound]")})
    assert answer.status_code == 422
    assert answer.json()["problems"][0]["line"] > 1
    assert client.post("/api/refinements", json={**body, "refine": "nothing"}).status_code == 404
    assert client.post("/api/refinements", json={**body, "seed": -1}).status_code == 422


def test_the_client_submits_tasks_and_refinements(served, tmp_path):
    service = explore.Service(served.url, served.token)
    (tmp_path / "task.toml").write_text(TASK)
    task = service.submit(explore.load_task(tmp_path / "task.toml"), name="client-task")
    assert service.plan(TASK)["kind"] == "task"
    assert service.plan_refinement("base", evaluations=2048)["designs"] == 2048
    refined = service.refine("base", objectives=["cv", "swing_angle:max"], evaluations=2048, seed=1)
    assert refined.name == "base-refined"
    assert task.wait().designs == 7
    assert refined.wait().state == "done"
    expected = explore.refine(served.folder / "results/base.h5", tmp_path / "here.h5", evaluations=2048, seed=1)
    fetched = refined.results(tmp_path / "there.h5")
    assert fetched.path.read_bytes() == expected.path.read_bytes()
    with pytest.raises(RequestError, match="a task keeps all its linkages"):
        service.submit(TASK, name="front", keep="front")


def test_the_command_line_submits_lists_and_changes(served, tmp_path):
    at = ("--server", served.url, "--token-file", str(served.folder / "token"))
    (tmp_path / "line.toml").write_text(TASK)
    out = run("submit", "line.toml", *at, "--dry-run", cwd=tmp_path)
    assert "linkages of a crank-rocker for a task (dead-positions)" in out.stderr
    out = run("submit", "line.toml", *at, "--wait", cwd=tmp_path)
    assert "line is done: 7 designs" in out.stderr
    refine = ("--refine", "base", "--evaluations", "2048", "--name", "line-refined")
    out = run("submit", *refine, *at, "--dry-run", cwd=tmp_path)
    assert "2,048 designs (refinement)" in out.stderr
    run("submit", *refine, *at, "-o", "refined.h5", cwd=tmp_path)
    assert len(explore.open_results(tmp_path / "refined.h5").to_pandas()) == 2048
    out = run("submit", "line.toml", *refine, *at, cwd=tmp_path, code=2)
    assert "name a file to submit, or a job by --refine, and not both" in out.stderr
    out = run("submit", "line.toml", *at, "--seed", "1", cwd=tmp_path, code=2)
    assert "--metric, --evaluations and --seed are for --refine" in out.stderr

    listed = json.loads(run("jobs", *at, "--json", cwd=tmp_path).stdout)
    assert {"base", "line", "line-refined"} <= {job["name"] for job in listed}
    assert "line-refined" in run("jobs", "line-refined", *at, cwd=tmp_path).stdout
    out = run("jobs", "line", *at, "--cancel", cwd=tmp_path, code=1)
    assert "line is done; only a job that is queued or running can be cancelled" in out.stderr
    out = run("jobs", "line", *at, "--retry", "--delete", cwd=tmp_path, code=2)
    assert "name one" in out.stderr
    run("jobs", "line", *at, "--delete", cwd=tmp_path)
    assert "there is no job line" in run("jobs", "line", *at, cwd=tmp_path, code=1).stderr


def test_a_job_is_prioritised_cancelled_retried_and_deleted_from_python(served):
    service = explore.Service(served.url, served.token)
    long = BASE.replace("num = 32", "num = 4000")
    first = service.submit(long, name="first")
    second = service.submit(long, name="second")
    second.prioritise(2)
    assert second.facts()["priority"] == 2
    second.cancel()
    assert second.progress().state == "cancelled"
    second.retry()
    assert second.progress().state == "queued"
    for job in (second, first):
        job.cancel()
        end = time.monotonic() + 60
        while not is_deleted(job):
            assert time.monotonic() < end
    assert not {"first", "second"} & {job["name"] for job in service.jobs()}


def is_deleted(job):
    """Delete a job, unless its process is still ending."""
    try:
        job.delete()
    except explore.ServiceError:
        return False
    return True


def test_head_is_answered_where_get_is(client):
    changing = ("/api/jobs", "/metrics")  # their times change from one request to the next, and so do their lengths
    for path in ("/healthz", "/api/jobs", "/api/jobs/base", "/api/results/base", "/api/results/base/file", "/metrics"):
        got, head = client.get(path), client.head(path)
        assert (head.status_code, head.content) == (200, b"")
        assert head.headers["content-type"] == got.headers["content-type"]
        assert path in changing or head.headers["content-length"] == got.headers["content-length"]
    for path in ("/api/events", "/api/jobs/base/events"):
        assert client.head(path).headers["content-type"].startswith("text/event-stream")
    assert client.head("/api/jobs/nothing").status_code == 404
    assert client.head("/api/studies").status_code == 405


# --- events of one job ------------------------------------------------------------------------------------------------


def events_of(client, path, last=None):
    """Id, kind and content of each event, until the server ends the stream."""
    with client.stream("GET", path, headers={} if last is None else {"Last-Event-ID": last}) as answer:
        assert answer.status_code == 200
        facts = {}
        for line in answer.iter_lines():
            if line:
                name, _, value = line.partition(": ")
                facts[name] = value
            elif "data" in facts:
                yield facts["id"], facts["event"], json.loads(facts["data"])
                facts = {}


def test_events_of_a_job_are_its_own_until_it_is_deleted(client, served):
    client.post("/api/studies", json={"name": "watched", "study": FEW}).raise_for_status()
    stream = events_of(client, "/api/jobs/watched/events")
    with served.client() as other:
        first = next(stream)
        assert (first[1], first[2]["name"]) == ("job", "watched")
        other.post("/api/studies", json={"name": "besides", "study": FEW}).raise_for_status()
        assert wait_settled(other, "besides")["state"] == "done"
        assert other.delete("/api/jobs/besides").status_code in (204, 409)
        assert wait_settled(other, "watched")["state"] == "done"
        deadline = time.monotonic() + 60
        while other.delete("/api/jobs/watched").status_code != 204:
            assert time.monotonic() < deadline
        events = [first, *stream]
    assert {job["name"] for _, _, job in events} == {"watched"}
    assert [kind for _, kind, _ in events[:-1]] == ["job"] * (len(events) - 1)
    assert events[-1][1] == "deleted"
    assert events[-2][2]["state"] == "done"
    assert client.get("/api/jobs/watched/events").status_code == 404

    client.post("/api/studies", json={"name": "watched", "study": FEW}).raise_for_status()
    with served.client() as other:
        again = events_of(other, "/api/jobs/watched/events", last=events[-2][0])
        assert next(again) == events[-1], "what was missed comes first"
        again.close()
        fresh = events_of(other, "/api/jobs/watched/events", last="00000000-1")
        assert next(fresh)[2]["name"] == "watched"
        fresh.close()


def test_the_first_event_comes_within_200_ms(served):
    """The best of some: others may use the processors of this machine at the same time."""
    delays = []
    for number in range(8):
        with served.client() as watching, served.client() as client:
            stream = events_of(watching, "/api/events")
            next(stream)
            start = time.monotonic()
            client.post("/api/studies", json={"name": f"quick-{number}", "study": FEW}).raise_for_status()
            next(event for event in stream if event[2]["name"] == f"quick-{number}")
            delays.append(time.monotonic() - start)
            stream.close()
    assert min(delays) < 0.2, delays
