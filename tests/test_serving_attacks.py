"""The service where its surroundings go wrong: clocks that are set, full disks, links in its folder, damaged files."""

import json
import os
import random
import re
import time
from datetime import UTC, datetime, timedelta

import pytest
from faults.disks import mounted
from served import Served, build_index, serving, submit_and_wait, wait_settled
from studies import FEW, GOOD
from test_serving_jobs import reopened
from waiting import wait_until

from explore.service import jobs as jobs_module
from explore.service.folder import State
from explore.service.plans import Limits
from explore.service.runner import Work
from explore.service.station import open_station
from explore.studies.config.study_file import starter
from explore.studies.request.names import find_mechanism
from explore.synthesis.tasks.task_files import task_starter

# --- clocks -----------------------------------------------------------------------------------------------------------


def test_clocks_that_are_set_back_and_forth_change_no_order_and_no_duration(tmp_path, monkeypatch):
    class Clock(datetime):
        """A clock that is set at each look: an hour back, a day forth, and so on."""

        looks = 0

        @classmethod
        def now(cls, tz=None):
            cls.looks += 1
            return datetime(2026, 1, 15, tzinfo=UTC) + timedelta(hours=[0, -1, 24, -48, 7][cls.looks % 5])

    monkeypatch.setattr(jobs_module, "datetime", Clock)
    monkeypatch.setattr(time, "time", lambda: 1e9 * (Clock.looks % 3))
    names = [f"job-{number}" for number in range(4)]
    with open_station(tmp_path / "served", Limits(), Work(workers=1)) as station:
        for name in names:
            station.jobs.submit(name, GOOD.encode())
        end = time.monotonic() + 240
        while any(job.state in (State.queued, State.running) for job in station.jobs.in_order()):
            assert time.monotonic() < end
            assert all(job.seconds >= 0 for job in station.jobs.in_order())
            time.sleep(0.01)
        ended = station.jobs.in_order()
    assert Clock.looks > 10
    assert [job.name for job in ended] == names[::-1], "the last to end first"
    assert [job.name for job in ended] != [job.name for job in sorted(ended, key=lambda job: job.ended, reverse=True)]
    assert all(job.state == State.done and 0 <= job.seconds < 240 for job in ended)
    assert [job.name for job in reopened(tmp_path).in_order()] == names[::-1], "also after a restart"


# --- full disks -------------------------------------------------------------------------------------------------------


@pytest.fixture
def disk(tmp_path):
    """A disk of 3 MB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    with mounted(folder, "3m"):
        yield folder


def fill_disk(disk):
    """Write until not one more byte fits."""
    with (disk / "filler").open("wb", buffering=0) as file:
        for size in (1 << 16, 1):
            try:
                while file.write(bytes(size)) == size:
                    pass
            except OSError:
                continue


def test_a_full_disk_is_said_and_ends_nothing(disk):
    with Served(disk / "served") as server, server.client() as client:
        submit_and_wait(client, "before", FEW)
        fill_disk(disk)
        refused = client.post("/api/studies", json={"name": "after", "study": FEW})
        assert refused.status_code in (400, 507), refused.text
        assert "free" in refused.text or "No space left" in refused.text
        assert [job["name"] for job in client.get("/api/jobs").json()["jobs"]] == ["before"]
        for route in ("", "/rank?metric=cv", "/columns", "/design/0", "/file", "/index?build=true", "/browsing"):
            assert client.get(f"/api/results/before{route}").status_code < 500
        wait_until(lambda: client.get("/api/results/before/index").json().get("state") != "building")
        index = client.get("/api/results/before/index")
        assert index.status_code in (200, 409), index.text
        assert client.get("/healthz").status_code == 200
        (disk / "filler").unlink()
        submit_and_wait(client, "after", FEW)
        assert build_index(client, "before")["state"] == "ready"
        assert server.stop() == 0


def test_a_disk_that_fills_while_a_job_runs_fails_the_job_or_lets_it_wait(disk):
    """What a job can do then depends on what it had still to write; the service works on in any case."""
    long = FEW.replace("[80, 100, 150, 160]", "{ start = 100, stop = 140, num = 1_000 }")
    with Served(disk / "served") as server, server.client() as client:
        client.post("/api/studies", json={"name": "long", "study": long}).raise_for_status()
        fill_disk(disk)
        time.sleep(2)
        assert client.get("/api/jobs/long").status_code == 200
        assert client.get("/healthz").status_code == 200
        (disk / "filler").unlink()
        job = wait_settled(client, "long")
        if job["state"] == "failed":
            assert "space" in job["reason"] or "free" in job["reason"], job["reason"]
            client.post("/api/jobs/long/retry").raise_for_status()
            job = wait_settled(client, "long")
        assert (job["state"], job["done"]) == ("done", 2000)
        assert server.stop() == 0


# --- links ------------------------------------------------------------------------------------------------------------


def test_links_and_pipes_in_the_folder_are_not_followed(tmp_path):
    outside = tmp_path / "outside"
    outside.mkdir()
    secret = outside / "secret.toml"
    secret.write_text(GOOD)
    (outside / "results.h5").write_bytes(b"mine")
    with serving(tmp_path / "served", few=FEW):
        pass
    folder = tmp_path / "served"
    (folder / "queue/1-000001-linked.toml").symlink_to(secret)
    (folder / "studies/done/shown.toml").symlink_to(secret)
    os.mkfifo(folder / "studies/done/pipe.toml")
    (folder / "studies/done/named.toml").write_text(GOOD)
    os.mkfifo(folder / "log/named.jsonl")
    (folder / "log/few.stderr.txt").unlink()
    for name in ("log/few.stderr.txt", "log/later.jsonl", "log/later.stderr.txt", "results/named.h5"):
        (folder / name).symlink_to(outside / "results.h5")
    (folder / "results/later.h5").symlink_to(outside / "results.h5")
    (folder / "log/server.jsonl").unlink()
    (folder / "log/server.jsonl").symlink_to(outside / "results.h5")
    (folder / "index/few").symlink_to(outside)
    with Served(folder) as server, server.client() as client:
        assert {job["name"] for job in client.get("/api/jobs").json()["jobs"]} == {"few", "named"}
        for route in ("", "/file", "/columns", "/rank", "/index?build=true", "/browsing", "/design/0"):
            answer = client.get(f"/api/results/named{route}")
            assert (answer.status_code, "is a link" in answer.text) == (409, True), (route, answer.text)
            assert str(tmp_path) not in answer.text
        client.post("/api/studies", json={"name": "later", "study": GOOD}).raise_for_status()
        later = wait_settled(client, "later")
        assert (later["state"], "results/later.h5 is a link" in later["reason"]) == ("failed", True)
        assert build_index(client, "few")["state"] == "ready"
        for name in ("named", "later", "few"):
            client.delete(f"/api/jobs/{name}").raise_for_status()
        assert server.stop() == 0
    assert (outside / "results.h5").read_bytes() == b"mine"
    assert secret.read_text() == GOOD
    assert {file.name for file in outside.iterdir()} == {"secret.toml", "results.h5"}


# --- damaged and senseless files --------------------------------------------------------------------------------------


def damaged(content, draw):
    """A copy with some bytes changed, left out, put in or repeated."""
    content = bytearray(content)
    for _ in range(draw.choice([1, 1, 2, 5, 20])):
        place, length = draw.randrange(len(content) + 1), draw.choice([1, 1, 3, 30])
        content[place : place + draw.choice([0, length])] = draw.choice(
            [
                b"",
                bytes(draw.randrange(256) for _ in range(length)),
                content[: length * 3],
                b"[[",
                b'"""',
                b"= nan",
                b"1e999",
            ]
        )
        content = content or bytearray(b"\0")
    return bytes(content)


@pytest.fixture(scope="module")
def attacked(tmp_path_factory):
    with serving(tmp_path_factory.mktemp("attacked") / "served", few=FEW) as server:
        yield server


def ask_quickly(client, method, path, **arguments):
    """The answer, which comes in bounded time and is no internal error."""
    start = time.monotonic()
    answer = client.request(method, path, **arguments)
    assert answer.status_code < 500, (method, path, arguments, answer.text)
    assert time.monotonic() - start < 120, (method, path, arguments)
    if answer.status_code >= 400:
        assert answer.json()["detail"]
    return answer


@pytest.mark.parametrize("count", [60, pytest.param(2000, marks=pytest.mark.slow)])
def test_damaged_studies_and_tasks_are_told_in_words(count, attacked):
    draw = random.Random(count)
    texts = [FEW, starter(find_mechanism("slider-crank")), *(task_starter(name) for name in ("path", "function"))]
    statuses = set()
    with attacked.client() as client:
        for number in range(count):
            text = damaged(texts[number % len(texts)].encode(), draw).decode("utf-8", "replace")
            kind = draw.choice(["study", "task"])
            route = {"study": "/api/studies", "task": "/api/tasks"}[kind]
            name = f"damaged-{number}"
            answer = ask_quickly(client, "POST", route, json={"name": name, kind: text, "priority": 9})
            statuses.add(answer.status_code)
            if answer.status_code == 201:
                ask_quickly(client, "POST", f"/api/jobs/{name}/cancel")
    assert 422 in statuses


@pytest.mark.parametrize("count", [100, pytest.param(3000, marks=pytest.mark.slow)])
def test_bodies_of_any_bytes_are_told_in_words(count, attacked):
    draw = random.Random(count)
    valid = json.dumps({"name": "x", "study": FEW, "keep": "all", "priority": 5}).encode()
    oddities = [
        b"",
        b"{",
        b"null",
        b"[" * 100_000,
        b'{"a":' * 50_000,
        b"\xff\xfe",
        b"9" * 10_000,
        b'{"name": NaN}',
        b"\0" * 99,
    ]
    routes = ["/api/studies?dry_run=true", "/api/tasks?dry_run=true", "/api/refinements", "/api/session", "/api/links"]
    routes += ["/api/jobs/few/priority", "/api/jobs/few/retry", "/api/jobs/few/cancel"]
    types = [
        "application/json",
        "text/plain",
        "multipart/form-data; boundary=x",
        "application/json; charset=utf-7",
        "é",
    ]
    with attacked.client() as client:
        for _ in range(count):
            body = damaged(valid, draw) if draw.random() < 0.5 else draw.choice(oddities)
            headers = {"Content-Type": draw.choice(types).encode()}
            answer = ask_quickly(client, "POST", draw.choice(routes), content=body, headers=headers)
            assert answer.status_code != 201 or "link" in answer.json()


@pytest.mark.parametrize("count", [25, pytest.param(1000, marks=pytest.mark.slow)])
def test_damaged_results_and_indexes_are_told_in_words_by_every_route(count, attacked):
    draw, results = random.Random(count), attacked.folder / "results/few.h5"
    sound = results.read_bytes()
    routes = ["", "/rank?metric=cv", "/columns", "/design/3", "/file", "/browsing", "/histograms?columns=crank,cv"]
    routes += ["/density?x=crank&y=cv", "/points?x=crank&y=cv", "/design/3/motion", "/motion.js", "/index?build=true"]
    routes += [f"/design/3/export/{kind}" for kind in ("csv", "dxf", "svg", "toml")]
    with attacked.client() as client:
        paths = client.get("/api/openapi.json").json()["paths"]
        own = {path.partition("{name}")[2] for path in paths if "/results/" in path}
        asked = {re.sub(r"/export/\w+", "/export/{kind}", route.partition("?")[0]) for route in routes}
        assert {route.replace("/3", "/{number}") for route in asked} == own
        build_index(client, "few")
        for number in range(count):
            if number % 2:
                results.write_bytes(damaged(sound, draw))
            elif files := [file for file in (attacked.folder / "index/few").glob("*") if file.is_file()]:
                chosen = draw.choice(files)
                chosen.write_bytes(damaged(chosen.read_bytes() or b"x", draw))
            for route in routes:
                ask_quickly(client, "GET", f"/api/results/few{route}")
        results.write_bytes(sound)
        assert client.get("/api/results/few").status_code == 200
        assert client.get("/healthz").status_code == 200
    log = (attacked.folder / "log/server.jsonl").read_text().splitlines()
    assert [line for line in log if '"event": "error"' in line] == []
