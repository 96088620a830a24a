"""A service as its clients see it: over HTTP, from Python and on the command line, also with tasks and refinements."""

import json
import time
import tomllib

import pytest
from command_line import on_terminal, run
from refinable import BASE, TASK
from served import events_of, serving, submit_and_wait, wait_settled
from studies import FEW, GOOD
from waiting import wait_until

import explore
from explore.base.errors import ConfigError, RequestError
from explore.cli import progress
from explore.service.client import JobProgress
from explore.service.inlined_points import text_with_points, with_points
from explore.service.job_files import Refinement, read_job_file
from explore.synthesis.tasks.registry import TASK_TYPES


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    with serving(tmp_path_factory.mktemp("clients") / "served", base=BASE) as server:
        yield server


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
    for dry_run in ((), ("--dry-run",)):
        out = run("submit", "--refine", "base", "--name", "Base 2", *at, *dry_run, cwd=tmp_path, code=1)
        assert "a job's name has 1 to 64 lower-case letters" in out.stderr
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


def test_points_of_a_file_are_sent_with_the_text(served, tmp_path):
    at = ("--server", served.url, "--token-file", str(served.folder / "token"))
    points = [[600.0, 300.0], [650.5, 330.25], [700.0, 310.0], [650.0, 280.0]]
    (tmp_path / "path.csv").write_text("x,y\n" + "".join(f"{x},{y}\n" for x, y in points))
    study = 'mechanism = "crank-rocker"\n[parameters]\ncrank = 100\ncoupler = 1000\nrocker = 500\nground = 700\n'
    target = '[points.pen]\nalong = 300\nacross = 100\n[target]\nkind = "path"\npoint = "pen"\n'
    target += 'file = "path.csv"\nclosed = true\n'
    (tmp_path / "drawn.toml").write_text(study + target)
    run("submit", "drawn.toml", *at, "--wait", cwd=tmp_path)
    with served.client() as client:
        sent = client.get("/api/jobs/drawn/study").text
        assert tomllib.loads(sent)["target"] == {"kind": "path", "point": "pen", "points": points, "closed": True}
        client.delete("/api/jobs/drawn").raise_for_status()
    (tmp_path / "task.toml").write_text('task = "path"\n[target]\nfile = "path.csv"\nclosed = true\n')
    assert tomllib.loads(with_points((tmp_path / "task.toml").read_text(), tmp_path / "task.toml"))["target"] == {
        "points": points, "closed": True,
    }  # fmt: skip
    (tmp_path / "path.csv").write_text("x,y\n1,2\n3\n")
    assert "drawn.toml:13: target.file: " in run("submit", "drawn.toml", *at, cwd=tmp_path, code=2).stderr


def test_points_of_a_curve_in_braces_are_sent_with_the_text(served, tmp_path):
    at = ("--server", served.url, "--token-file", str(served.folder / "token"))
    (tmp_path / "pull.csv").write_text("place,value\n0,-800\n250.5,-900\n360,-800\n")
    curve = 'pull = { over = "crank_angle", file = "pull.csv" }'
    run("init", "pump.toml", "--linkage", "pump-jack", cwd=tmp_path)
    text = (tmp_path / "pump.toml").read_text().replace('"-pull"', '"pull"').replace("pull = 800 ", "#")
    text = text.replace("# Lengths are", f"[linkage.loads.curves]\n{curve}\n# Lengths are")
    (tmp_path / "pump.toml").write_text(text)
    run("submit", "pump.toml", *at, "--priority", "9", cwd=tmp_path)
    run("jobs", "pump", *at, "--cancel", cwd=tmp_path)
    with served.client() as client:
        sent = tomllib.loads(client.get("/api/jobs/pump/study").text)
    assert sent["linkage"]["loads"]["curves"] == {
        "pull": {"over": "crank_angle", "points": [[0.0, -800.0], [250.5, -900.0], [360.0, -800.0]]}
    }


@pytest.mark.parametrize(
    ("target", "rows", "key"),
    [
        ('task = "path"\n[target]\nclosed = true\n', "x,y\n600,300\n650.5,330.25\n700,310\n650,280\n", "points"),
        ('kind = "path"\npoint = "pen"\n', "y,x\n300,600\n330.25,650.5\n310,700\n", "points"),
        ('task = "motion"\n[target]\n', "x,y,angle\n12.06,13.06,37.7\n10.46,16.81,29.3\n5.8,18.66,23.6\n", "poses"),
        (
            'task = "function"\n[target]\ninput_angle = 60\noutput_angle = 60\n',
            "x,y\n1,0\n2,0.3\n3,0.48\n4,0.6\n",
            "table",
        ),
        ('kind = "poses"\npoint = "pen"\n', "x,y,angle\n600,300,37.7\n650.5,330,29.3\n", "poses"),
        ('kind = "function"\n', "input,output\n0.1,20\n30,25.7\n60,25\n", "table"),
    ],
)
def test_python_sends_the_points_of_a_file_too(served, tmp_path, monkeypatch, target, rows, key):
    """Those that were read when the object was made, wherever the file is now."""
    monkeypatch.chdir(tmp_path)
    pen = "[points.pen]\nalong = 300\nacross = 100\n" if "pen" in target else ""
    is_task = target.startswith("task")
    text = f'{target if is_task else f"{GOOD}{pen}[target]{chr(10)}{target}"}file = "rows.csv"\n'
    (tmp_path / "rows.csv").write_text(rows)
    (tmp_path / "drawn.toml").write_text(text)
    loaded = (explore.load_task if is_task else explore.load_study)("drawn.toml")
    (tmp_path / "rows.csv").unlink()
    service = explore.Service(served.url, served.token)
    name = f"python-{len(text)}"
    service.submit(loaded, name=name).cancel()
    with served.client() as client:
        sent = client.get(f"/api/jobs/{name}/study").text
    values = [[float(value) for value in row.split(",")] for row in rows.splitlines()[1:]]
    values = [[x, y] for y, x in values] if rows.startswith("y") else values
    assert tomllib.loads(sent) == {
        **tomllib.loads(text),
        "target": {**{k: v for k, v in tomllib.loads(text)["target"].items() if k != "file"}, key: values},
    }
    with pytest.raises(ConfigError, match="target.file"):
        service.submit(text, name="python-text")


def test_crank_angles_of_a_path_are_sent_too(tmp_path):
    (tmp_path / "rows.csv").write_text("crank_angle,x [in],y [in]\n0,6,3\n30,6.5,3.3\n60,7,3\n90,6.5,2.8\n120,6,2.7\n")
    (tmp_path / "task.toml").write_text('task = "path"\n[target]\nfile = "rows.csv"\nangles_from = "free"\n')
    loaded = explore.load_task(tmp_path / "task.toml")
    (tmp_path / "sent.toml").write_text(text_with_points(loaded))
    sent = explore.load_task(tmp_path / "sent.toml")
    assert tomllib.loads(sent.text)["target"]["crank_angles"] == [0, 30, 60, 90, 120]
    assert sent.task.target == loaded.task.target
    assert sent.task.given == loaded.task.given


def test_what_cannot_be_sent_with_the_text_is_refused(served, tmp_path):
    (tmp_path / "rows.csv").write_text("x,y,angle\n12.06,13.06,37.7\n10.46,16.81,29.3\n5.8,18.66,23.6\n")
    (tmp_path / "task.toml").write_text('task = "motion"\ntarget = { file = "rows.csv" }\n')
    with pytest.raises(RequestError, match=r"^line 2: target.file: a service reads no file by its name"):
        explore.Service(served.url, served.token).submit(explore.load_task(tmp_path / "task.toml"), name="moved")


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
        wait_until(lambda job=job: is_deleted(job))
    assert not {"first", "second"} & {job["name"] for job in service.jobs()}


def is_deleted(job):
    """Delete a job, unless its process is still ending."""
    try:
        job.delete()
    except explore.ServiceError:
        return False
    return True


def test_starters_are_those_of_the_command_line(client, served, tmp_path):
    told = client.get("/api/starters").json()
    assert [task["name"] for task in told["tasks"]] == list(TASK_TYPES)
    assert {"crank-rocker", "slider-crank", "test-rig", "gears", "variable-crank"} <= {
        s["name"] for s in told["studies"]
    }
    assert {"watt-2", "jansen", "crank-shaper"} <= {s["name"] for s in told["linkages"]}
    assert all(entry["summary"] for entries in told.values() for entry in entries)
    options = {"studies": "--mechanism", "linkages": "--linkage", "tasks": "--task"}
    with served.client((served.folder / "token.read-only").read_text().strip()) as viewer:
        for kind, entries in told.items():
            # The classics come from one folder: two stand for all.
            for name in [entry["name"] for entry in entries][: 2 if kind == "linkages" else None]:
                run("init", f"{name}.toml", options[kind], name, cwd=tmp_path)
                answer = viewer.get(f"/api/starters/{kind}/{name}")
                assert answer.headers["content-type"] == "text/plain; charset=utf-8"
                assert answer.text == (tmp_path / f"{name}.toml").read_text(encoding="utf-8")
                (tmp_path / f"{name}.toml").unlink()
    for path, reason in (
        ("studies/crank-rock", "did you mean 'crank-rocker'?"),
        ("linkages/wat-2", "did you mean 'watt-2'?"),
        ("tasks/pth", "did you mean 'path'?"),
    ):
        answer = client.get(f"/api/starters/{path}")
        assert answer.status_code == 400
        assert reason in answer.json()["detail"]


def test_each_starter_is_accepted_as_it_is(client):
    told = client.get("/api/starters").json()
    told["linkages"] = [entry for entry in told["linkages"] if entry["name"] == "four-bar"]
    for kind, key in (("studies", "study"), ("linkages", "study"), ("tasks", "task")):
        for name in (entry["name"] for entry in told[kind]):
            text = client.get(f"/api/starters/{kind}/{name}").text
            answer = client.post(
                f"/api/{'tasks' if key == 'task' else 'studies'}", json={"name": f"start-{key}-{name}", key: text}
            )
            assert answer.status_code == 201, answer.text
            client.post(f"/api/jobs/start-{key}-{name}/cancel")
            assert client.get(f"/api/jobs/start-{key}-{name}/study").text == text


def test_the_list_of_jobs_says_what_is_not_known_of_a_search(client, served, tmp_path):
    at = ("--server", served.url, "--token-file", str(served.folder / "token"))
    client.post("/api/studies", json={"name": "before", "study": BASE.replace("num = 32", "num = 2000")})
    client.post("/api/tasks", json={"name": "search", "task": TASK})
    assert "when found" in run("jobs", "search", *at, cwd=tmp_path).stdout
    client.post("/api/jobs/before/cancel")
    assert wait_settled(client, "search")["state"] == "done"
    assert "when found" not in run("jobs", "search", *at, cwd=tmp_path).stdout


def test_the_list_of_jobs_has_their_remarks(client, served, tmp_path):
    at = ("--server", served.url, "--token-file", str(served.folder / "token"))
    client.post("/api/tasks", json={"name": "doubtful", "task": TASK + '[units]\nlength = "in"\n'})
    (remark,) = client.get("/api/jobs/doubtful").json()["remarks"]
    assert "although [units] shows in" in remark
    for words in ((), ("doubtful",)):
        assert run("jobs", *words, *at, cwd=tmp_path).stdout.count(f"doubtful: perhaps not meant: {remark}\n") == 1


def test_who_waits_is_told_how_far_a_job_is(served, tmp_path, monkeypatch):
    at = ("--server", served.url, "--token-file", str(served.folder / "token"), "--wait", "--keep", "front")
    (tmp_path / "told.toml").write_text(BASE.replace("num = 32", "num = 1500"))
    monkeypatch.setattr(progress, "LINE_INTERVAL", 0.0)
    lines = run("submit", "told.toml", *at, cwd=tmp_path).stderr.splitlines()
    assert lines[-1] == "told is done: 2,250,000 designs"
    assert any(line.startswith(("told: queued", "told: running", "told: compiling")) for line in lines[:-1])
    assert any(" of 2,250,000 designs, " in line for line in lines[:-1]), lines
    _, terminal = on_terminal("submit", "told.toml", *at, "--name", "terminal", cwd=tmp_path)
    assert "terminal: running" in terminal
    assert "terminal is done: 2,250,000 designs" in terminal


@pytest.mark.parametrize(
    ("facts", "text"),
    [
        ({"state": "queued"}, "queued"),
        ({"state": "failed", "reason": "no [bold]memory"}, "failed: no [bold]memory"),
        ({"reason": "compiling"}, "running: compiling"),
        ({}, "running"),
        ({"steps": 7, "steps_done": 3, "seconds_left": 4.2}, "step 3 of 7, 4 s left"),
        (
            {"designs": 5000, "done": 1000, "rate": 200.4, "seconds_left": 20.0},
            "1,000 of 5,000 designs, 200/s, 20 s left",
        ),
    ],
)
def test_progress_of_a_job_in_words(facts, text):
    unknown = {"done": 0, "designs": 0, "steps": 0, "steps_done": 0, "rate": None, "seconds_left": None}
    assert progress._job_text(JobProgress(**({"state": "running", "reason": ""} | unknown | facts))) == text


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


def test_events_of_a_job_are_its_own_until_it_is_deleted(client, served):
    client.post("/api/studies", json={"name": "watched", "study": FEW}).raise_for_status()
    stream = events_of(client, "/api/jobs/watched/events")
    with served.client() as other:
        first = next(stream)
        assert (first[1], first[2]["name"]) == ("job", "watched")
        submit_and_wait(other, "besides", FEW)
        assert other.delete("/api/jobs/besides").status_code in (204, 409)
        assert wait_settled(other, "watched")["state"] == "done"
        deadline = time.monotonic() + 240
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
