"""The service over HTTP: a real server over TCP, its rights, its words and its events."""

import contextlib
import json
import os
import random
import socket
import ssl
import string
import subprocess
import sys
import threading
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path
from urllib.parse import quote

import httpx
import psutil
import pytest
from command_line import call, run
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from fastapi import HTTPException
from prometheus_client.parser import text_string_to_metric_families
from served import Served, events_of, serving, submit_and_wait, wait_settled
from studies import FEW, GOOD
from waiting import PATIENCE, wait_until

import explore
from explore.base.errors import RequestError
from explore.cli.commands import serve as serve_command
from explore.cli.options import name_options
from explore.service import access, server
from explore.service.access import Access, Right
from explore.service.plans import Limits
from explore.service.server import Place
from explore.service.turns import Turns

ROOT = Path(__file__).parents[1]
LONG = FEW.replace("[80, 100, 150, 160]", "{ start = 100, stop = 140, num = 300_000 }")


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    with serving(tmp_path_factory.mktemp("http") / "served", few=FEW) as server:
        yield server
    assert not (server.folder / "token").exists()
    logs = b"".join(file.read_bytes() for file in (server.folder / "log").iterdir())
    for secret in (server.token, server.link, server.link_to_look):
        assert secret.encode() not in logs


@pytest.fixture
def start_server():
    """Start a server that ends with the test, however the test ends."""
    with contextlib.ExitStack() as servers:
        yield lambda *arguments, **options: servers.enter_context(Served(*arguments, **options))


# --- rights -----------------------------------------------------------------------------------------------------------


def test_a_link_opens_one_browser_once(served):
    link = served.new_link()
    with httpx.Client(base_url=served.url, headers={"Origin": served.url}) as browser:
        assert browser.get("/api/jobs").status_code == 401
        answer = browser.post("/api/session", json={"token": link})
        cookie = answer.headers["set-cookie"]
        assert cookie.startswith(f"explore-{served.url.rpartition(':')[2]}=")
        assert {"HttpOnly", "SameSite=strict", "Path=/"} <= set(cookie.split("; "))
        assert link not in cookie
        assert browser.get("/api/jobs").status_code == 200
        assert browser.get("/api/session").json() == {"right": "full"}
        assert browser.post("/api/session", json={"token": link}).status_code == 401, "the second time"
        del browser.headers["Origin"]
        answer = browser.post("/api/jobs/few/cancel")
        assert (answer.status_code, answer.json()["detail"]) == (403, "a browser's request must have the header Origin")


def test_jobs_have_the_owner_that_a_link_was_made_for_and_the_date(client, served):
    link = client.post("/api/links", json={"right": "full", "name": "Anna"}).json()["link"].partition("#token=")[2]
    with served.browser(link) as browser:
        browser.post("/api/studies", json={"name": "annas", "study": GOOD}).raise_for_status()
        assert "was used already" in browser.post("/api/session", json={"token": link}).json()["detail"]
    job = wait_settled(client, "annas")
    assert (job["owner"], job["submitted"][:2]) == ("Anna", "20")
    assert client.get("/api/jobs/few").json()["owner"] == ""
    client.delete("/api/jobs/annas").raise_for_status()


def test_the_files_of_tokens_are_for_their_owner_alone(tmp_path):
    before = os.umask(0)
    try:
        Access("http://127.0.0.1:1").write_tokens(tmp_path)
    finally:
        os.umask(before)
    assert {file.name: file.stat().st_mode & 0o777 for file in tmp_path.iterdir()} == {
        "token": 0o600, "token.read-only": 0o600
    }  # fmt: skip


def test_sessions_end_after_a_month_and_the_oldest_for_a_newer_one(monkeypatch):
    monkeypatch.setattr(access, "_MOST_SESSIONS", 2)
    ours = Access("http://127.0.0.1:1")

    def open_session():
        return ours.open_session(ours.make_link(Right.full).partition("#token=")[2])[0]

    sessions = [open_session() for _ in range(3)]
    assert [ours.of_session(session) for session in sessions] == [None, Right.full, Right.full]
    now = time.monotonic()
    for days, right in ((29.9, Right.full), (30.1, None)):
        monkeypatch.setattr(access.time, "monotonic", lambda later=now + 86_400.0 * days: later)
        assert ours.of_session(sessions[-1]) == right
    late = ours.make_link(Right.full).partition("#token=")[2]
    monkeypatch.setattr(access.time, "monotonic", lambda: now + 86_400.0 * 31.2)
    assert ours.open_session(late) is None


@pytest.mark.parametrize("other", ['settings={"theme": "dark"}', "a=b c", 'q="unfinished', "=", "é=1"])
def test_cookies_of_other_services_on_the_host_do_no_harm(served, other):
    with served.browser(served.new_link()) as browser:
        ours = "; ".join(f"{cookie.name}={cookie.value}" for cookie in browser.cookies.jar)
        for header in (f"{other}; {ours}", f"{ours}; {other}"):
            answer = httpx.get(f"{served.url}/api/session", headers={"Cookie": header.encode()})
            assert answer.json() == {"right": "full"}


def test_who_may_look_may_not_change(served):
    with (
        served.browser(served.link_to_look) as browser,
        served.client((served.folder / "token.read-only").read_text().strip()) as script,
    ):
        for viewer in (browser, script):
            assert viewer.get("/api/jobs").status_code == 200
            assert viewer.get("/api/results/few/rank").status_code == 200
            for method, path in (
                ("POST", "/api/studies"),
                ("POST", "/api/links"),
                ("DELETE", "/api/jobs/few"),
                ("POST", "/api/jobs/few/cancel"),
            ):
                answer = viewer.request(method, path, json={})
                assert (answer.status_code, answer.json()["detail"]) == (403, "this token or link may only look")


@pytest.mark.parametrize("header", ["Bearer wrong", "Bearer", "Basic Zm9vOmJhcg==", "Bearer \xe9", "token"])
def test_without_the_token_nothing_is_told(served, header):
    paths = [
        "/api/jobs",
        "/api/jobs/few",
        "/api/events",
        "/api/results/few",
        "/metrics",
        "/api/openapi.json",
        "/nowhere",
    ]
    with httpx.Client(base_url=served.url, headers={"Authorization": header.encode("latin-1")}) as stranger:
        for path in [*paths, "/page/../token", "/token"]:
            assert stranger.get(path).status_code == 401
        assert stranger.get("/healthz").json() == {"status": "ok"}
        assert stranger.get("/").status_code == 200


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "evil.example"}, 421),
        ({"Host": "127.0.0.1"}, 421),
        ({"Host": "127.0.0.1.evil.example:{port}"}, 421),
        ({"Host": "localhost:{port}"}, 200),
        ({"Host": "127.0.0.1:{port}"}, 200),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": "https://127.0.0.1:{port}"}, 403),
        ({"Origin": "http://127.0.0.1:{port}"}, 200),
        ({"Origin": "http://localhost:{port}"}, 200),
    ],
)
def test_other_hosts_and_origins_are_refused(client, served, headers, status):
    port = served.url.rpartition(":")[2]
    headers = {name: value.format(port=port) for name, value in headers.items()}
    assert client.get("/api/jobs", headers=headers).status_code == status
    assert client.get("/healthz", headers=headers).status_code == status


@pytest.mark.parametrize(
    ("site", "status"), [("same-origin", 200), ("none", 200), ("same-site", 403), ("cross-site", 403), ("?", 403)]
)
def test_pages_of_other_ports_cannot_use_the_cookie_to_look(served, site, status):
    """Browsers send the cookie there, because a port makes no other site, and no Origin with images and scripts."""
    with served.browser(served.new_link()) as browser:
        assert browser.get("/api/jobs", headers={"Sec-Fetch-Site": site}).status_code == status
        assert browser.get("/", headers={"Sec-Fetch-Site": site}).status_code == 200, "a link to the page works"


def test_every_answer_has_the_headers_that_protect(client):
    for path in ("/", "/healthz", "/api/jobs", "/api/nothing", "/api/results/few/file", "/page/nothing.js"):
        headers = client.get(path).headers
        assert "default-src 'none'" in headers["content-security-policy"]
        assert "unsafe" not in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["x-frame-options"] == "DENY"
        assert headers["referrer-policy"] == "no-referrer"
        assert headers["cache-control"] == "no-store"
    assert client.get("/api/jobs").headers.get("access-control-allow-origin") is None
    assert client.get("/docs").status_code == 404, "it would load scripts from elsewhere"
    assert client.get("/api/jobs/").status_code == 404, "a redirect would not know of a proxy's TLS"


def test_tokens_change_at_a_restart_and_a_second_server_says_who_runs(tmp_path, start_server):
    first = start_server(tmp_path)
    second = run_second(tmp_path)
    assert f"is served by process {first.process.pid} on host" in second
    assert first.stop() == 0
    again = start_server(tmp_path)
    assert again.token != first.token
    with again.client(first.token) as client:
        assert client.get("/api/jobs").status_code == 401
    assert again.stop() == 0


#: A service that gets a signal between its announcement and the start of its server.
SIGNALLED = """
import os, signal, sys
from pathlib import Path
from explore.service.plans import Limits
from explore.service.runner import Work
from explore.service.server import Place, serve
serve(Path(sys.argv[1]), Place(port=0), Limits(), Work(), lambda *_: os.kill(os.getpid(), signal.SIGTERM))
"""


def test_a_service_stops_in_order_as_soon_as_it_has_said_its_address(tmp_path):
    done = subprocess.run([sys.executable, "-c", SIGNALLED, tmp_path], capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr
    assert not (tmp_path / "token").exists()


def run_second(folder):
    code, _, err = call("serve", str(folder), "--port", "0")
    assert code == 1
    return err


# --- bounds -----------------------------------------------------------------------------------------------------------


def test_bodies_are_bounded(client):
    answer = client.post("/api/studies", content=b"x" * (6 << 20))
    assert (answer.status_code, answer.json()["detail"]) == (413, "the body has more than 5,242,880 bytes")
    answer = client.post("/api/studies", content=(b"x" * (1 << 20) for _ in range(8)))  # without its length
    assert answer.status_code == 413
    answer = client.post("/api/studies", content=b"[" * 1_000_000, headers={"Content-Type": "application/json"})
    assert answer.status_code in (400, 422)


def test_without_a_right_only_a_link_is_read(served):
    answer = httpx.post(f"{served.url}/api/session", content=b" " * 5000)
    assert (answer.status_code, answer.json()["detail"]) == (413, "the body has more than 4,096 bytes")


def test_the_log_of_the_service_belongs_to_no_job(client):
    answer = client.post("/api/studies", json={"name": "server", "study": FEW})
    assert answer.status_code == 400
    assert answer.json()["detail"].startswith("server is the name of the service's own log; choose another")


def test_files_that_a_person_removed_are_told_in_words(client, served):
    submit_and_wait(client, "removed", GOOD)
    (served.folder / "results/removed.h5").unlink()
    (served.folder / "studies/done/removed.toml").unlink()
    for path, reason in (
        ("/api/results/removed/file", "the results of removed were removed from the folder"),
        ("/api/jobs/removed/study", "the study of removed was removed from the folder"),
    ):
        answer = client.get(path)
        assert (answer.status_code, answer.json()["detail"]) == (409, reason)
    assert client.delete("/api/jobs/removed").status_code == 204


def test_turns_are_bounded():
    turns = Turns(at_a_time=1, waiting=0)
    with turns.taken(), pytest.raises(HTTPException, match="busy with other requests"), turns.taken():
        pass
    with turns.taken():
        pass


def test_names_never_leave_the_folder(client, served):
    (served.folder.parent / "secret.toml").write_text("secret")
    for name in ("..", "../secret", "%2e%2e%2fsecret", "..%5csecret", "a%00", "A", "few.h5", "few%0a"):
        for path in (f"/api/jobs/{name}", f"/api/jobs/{name}/study", f"/api/results/{name}/file"):
            answer = client.get(path)
            assert answer.status_code in (404, 422), path
            assert "secret" not in answer.text.replace(name, "")
    before = sorted(served.folder.parent.rglob("*.toml"))
    answer = client.post("/api/studies", json={"name": "../evil", "study": FEW})
    assert (answer.status_code, answer.json()["detail"][:30]) == (400, "a job's name has 1 to 64 lower")
    assert sorted(served.folder.parent.rglob("*.toml")) == before


def test_errors_of_results_do_not_tell_where_the_folder_is(client, served):
    submit_and_wait(client, "damaged", GOOD)
    (served.folder / "results/damaged.h5").write_bytes(b"no results")
    answer = client.get("/api/results/damaged")
    assert (answer.status_code, answer.json()["detail"][:36]) == (409, "results/damaged.h5 is not an HDF5 fi")
    client.delete("/api/jobs/damaged").raise_for_status()


def test_a_request_has_one_length(served):
    """A proxy and the server must not see the end of a request at different places."""
    host, port = served.url.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=240) as connection, connection.makefile("rb") as answer:
        head = (
            f"POST /api/session HTTP/1.1\r\nHost: {host}:{port}\r\nContent-Length: 4\r\nTransfer-Encoding: chunked\r\n"
        )
        connection.sendall(f"{head}\r\n0\r\n\r\nGET / HTTP/1.1\r\nHost: {host}:{port}\r\n\r\n".encode())
        content = answer.read()
    assert content.startswith(b"HTTP/1.1 400 ")
    assert b"a request has Content-Length or Transfer-Encoding, not both" in content
    assert content.count(b"HTTP/1.1") == 1


def test_problems_of_a_study_come_with_their_lines(client):
    answer = client.post("/api/studies", json={"name": "wrong", "study": FEW.replace("crank =", "cranc =")})
    assert answer.status_code == 422
    assert answer.json()["problems"][0] == {
        "line": 3,
        "text": "wrong.toml:3: parameters.cranc: unknown parameter; did you mean 'crank'?",
    }
    surrogate, json_type = '{"name": "s", "study": "\\ud800"}', {"Content-Type": "application/json"}
    answer = client.post("/api/studies", content=surrogate, headers=json_type)
    assert answer.status_code == 422
    assert client.post("/api/studies", json={"name": "few", "study": FEW}).status_code == 409
    assert client.get("/api/jobs/nothing").json() == {"detail": "there is no job nothing"}


def test_a_dry_run_counts_and_queues_nothing(client):
    answer = client.post("/api/studies?dry_run=true", json={"name": "plan", "study": FEW})
    plan = answer.json()
    assert (answer.status_code, plan["designs"], plan["mechanism"]) == (200, 8, "crank-rocker")
    assert 0 < plan["seconds"] < 60
    assert plan["note"] == ""
    assert client.get("/api/jobs/plan").status_code == 404
    mistyped = client.post("/api/studies?dryrun=true", json={"name": "plan", "study": FEW})
    assert (mistyped.status_code, client.get("/api/jobs/plan").status_code) == (400, 404)
    assert "did you mean 'dry_run'?" in mistyped.json()["detail"]


def test_dry_runs_are_measured_by_one_process(client, served):
    """It stays, with its imports and kernels, without which a dry run takes 2 s."""
    measuring = []
    for _ in range(3):
        assert client.post("/api/studies?dry_run=true", json={"name": "plan", "study": FEW}).json()["seconds"] > 0
        children = psutil.Process(served.process.pid).children()
        measuring.append({child.pid for child in children if "spawn_main" in " ".join(child.cmdline())})  # others sweep
    assert measuring[0]
    assert measuring[0] == measuring[1] == measuring[2]


def test_a_dry_run_does_not_wait_for_kernels_that_compile(tmp_path, monkeypatch, start_server):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "no kernels yet"))
    with start_server(tmp_path / "served") as server, server.client() as client:
        for _ in range(2):
            plan = client.post("/api/studies?dry_run=true", json={"name": "plan", "study": GOOD}).json()
            assert (plan["designs"], plan["seconds"]) == (1, None)
            assert "are being compiled, once per machine" in plan["note"]


def fuzzed(schema, draw):
    """A value for a schema of the OpenAPI document: often valid, often not."""
    texts = [
        "few",
        "",
        "..",
        "cv",
        "swing_angle:max",
        "a" * 70,
        "\0",
        "é😀",
        FEW,
        "crank > 1 and",
        "crank>=1",
        "-1",
        "nan",
    ]
    texts += ["".join(draw.choices(string.printable, k=draw.randrange(40)))]
    anything = [*texts, 0, -1, 2**70, 1.5, True, None, [], {}, ["x"], {"a": {"b": []}}]
    if draw.random() < 0.15:
        return draw.choice(anything)
    if "enum" in schema:
        return draw.choice(schema["enum"])
    kind = schema.get("type")
    if kind == "integer":
        return draw.choice([0, 1, 5, 9, 10, -1, 2**63, 2**63 - 1, 10**25])
    if kind == "boolean":
        return draw.choice([True, False])
    if kind == "array":
        return [fuzzed(schema["items"], draw) for _ in range(draw.randrange(4))]
    return draw.choice(texts)


@pytest.mark.parametrize("count", [120, pytest.param(10_000, marks=pytest.mark.slow)])
def test_no_request_breaks_the_server_or_leaves_the_folder(count, client, served):
    document = client.get("/api/openapi.json").json()
    models, draw = document["components"]["schemas"], random.Random(count)
    operations = [
        (path, method, facts) for path, methods in document["paths"].items() for method, facts in methods.items()
    ]
    assert len(operations) >= 18
    outside = {file for file in served.folder.parent.rglob("*") if not file.is_relative_to(served.folder)}
    seen = set()
    for number in range(count):
        path, method, facts = operations[number % len(operations)]
        if path.endswith("/events"):  # never ends; its own test reads it
            continue
        query = []
        for parameter in facts.get("parameters", []):
            value = fuzzed(parameter["schema"].get("anyOf", [parameter["schema"]])[0], draw)
            if parameter["in"] == "path":
                place = "few" if draw.random() < 0.5 and "name" in parameter["name"] else str(value)
                path = path.replace(f"{{{parameter['name']}}}", quote(place, safe=""))
            elif parameter["in"] == "query" and draw.random() < 0.7:
                query += [(parameter["name"], str(part)) for part in (value if isinstance(value, list) else [value])]
        arguments = {"params": query}
        if "requestBody" in facts:
            name = facts["requestBody"]["content"]["application/json"]["schema"]["$ref"].rpartition("/")[2]
            body = {key: fuzzed(schema, draw) for key, schema in models[name]["properties"].items()}
            arguments["json"] = body if draw.random() < 0.9 else draw.choice([[], None, 7, "x", {"x": 1}])
        if method == "delete" and path.endswith("/few"):
            continue
        answer = client.request(method, path, **arguments)
        seen.add(answer.status_code)
        assert answer.status_code < 500, (method, path, arguments, answer.text)
    assert {200, 404, 422} <= seen
    assert {file for file in served.folder.parent.rglob("*") if not file.is_relative_to(served.folder)} == outside
    for job in client.get("/api/jobs").json()["jobs"]:
        if job["name"] != "few":
            client.post(f"/api/jobs/{job['name']}/cancel")
            wait_settled(client, job["name"])
    log = (served.folder / "log/server.jsonl").read_text().splitlines()
    errors = [line for line in log if '"event": "error"' in line]
    assert errors == []


# --- events -----------------------------------------------------------------------------------------------------------


def test_events_tell_everything_and_go_on_where_a_client_left(client, served):
    stream = events_of(client)
    last, kind, first = next(stream)
    assert kind == "jobs"
    assert "few" in {job["name"] for job in first["jobs"]}
    with served.client() as other:
        start = time.monotonic()
        other.post("/api/studies", json={"name": "events", "study": GOOD}).raise_for_status()
        states, ids, delay = [], [], None
        for number, kind, job in stream:
            assert kind == "job"
            if job["name"] == "events":
                delay = delay or time.monotonic() - start
                ids.append(number)
                states.append(job["state"])
                if job["state"] == "done":
                    break
        stream.close()
        assert states[0] == "queued"
        assert list(dict.fromkeys(states)) == ["queued", "running", "done"]
        assert delay < 12  # 0.05 s on a free machine; the next sign of life comes after 15 s

        missed = events_of(other, last=last)
        again = [next(missed) for _ in ids]
        assert [number for number, *_ in again] == ids
        missed.close()
        rest = events_of(other, last=ids[1])
        assert next(rest)[0] == ids[2]
        rest.close()
        for stale in ("00000000-1", "nonsense", f"{last.partition('-')[0]}-999999", "x-\u0663"):
            fresh = events_of(other, last=stale.encode())
            assert next(fresh)[1] == "jobs"
            fresh.close()
        other.delete("/api/jobs/events")


def test_many_watchers_see_the_same(served):
    with served.client() as client:
        ready, outcomes = threading.Barrier(9), []

        def watch():
            with served.client() as own:
                stream, seen = events_of(own), []
                next(stream)
                ready.wait(240)
                for number, kind, job in stream:
                    seen.append(number)
                    if kind == "deleted" and job["name"] == "watched":
                        break
                outcomes.append(seen)

        threads = [threading.Thread(target=watch) for _ in range(8)]
        for thread in threads:
            thread.start()
        ready.wait(240)
        submit_and_wait(client, "watched", GOOD)
        wait_until(lambda: client.delete("/api/jobs/watched").status_code == 204)
        for thread in threads:
            thread.join(30)
    assert len(outcomes) == 8
    assert all(seen == outcomes[0] for seen in outcomes)
    assert len(outcomes[0]) >= 4


# --- results ----------------------------------------------------------------------------------------------------------


def test_results_are_told_in_the_words_of_the_command_line(client, served):
    file = served.folder / "results/few.h5"
    ranked = json.loads(run("rank", str(file), "--metric", "cv", "--limit", "cv<=0.6", "--json", cwd=ROOT).stdout)
    answer = client.get("/api/results/few/rank", params={"metric": "cv", "limit": "cv<=0.6"}).json()
    assert answer["designs"] == ranked
    assert len(ranked) > 0
    assert (answer["order_by"], answer["found"]) == ("cv", len(ranked))
    two = json.loads(run("rank", str(file), "--metric", "cv", "--metric", "swing_angle:max", "--fronts", "2", "--json",
                         cwd=ROOT).stdout)  # fmt: skip
    query = {"metric": ["cv", "swing_angle:max"], "fronts": 2}
    assert client.get("/api/results/few/rank", params=query).json()["designs"] == two
    assert {row["front"] for row in two} == {1, 2}
    design = json.loads(run("show", str(file), "--design", "2", "--json", cwd=ROOT).stdout)
    assert client.get("/api/results/few/design/2").json() == design
    shown = json.loads(run("show", str(file), "--json", cwd=ROOT).stdout)
    summary = client.get("/api/results/few").json()
    assert {key: summary[key] for key in shown if key != "path"} == {k: v for k, v in shown.items() if k != "path"}
    assert str(served.folder) not in json.dumps(summary)
    columns = client.get("/api/results/few/columns").json()["columns"]
    assert {column["name"]: column["unit"] for column in columns} == shown["units"]
    for path, reason in (
        ("rank?metric=cvv", "no column 'cvv'"),
        ("rank?where=cv%20%3E", "where: at the end"),
        ("rank?limit=cv", "limit"),
        ("rank?wehre=cv%20%3E%201", "unknown parameter 'wehre'; did you mean 'where'?"),
        ("rank?where=cv%20%3E%201&where=cv%20%3C%202", "where is given more than once; give one"),
        ("design/0?units=mm", "unknown parameter 'units'; this address takes none"),
        ("design/99", "99"),
    ):
        answer = client.get(f"/api/results/few/{path}")
        assert 400 <= answer.status_code < 500
        assert reason in answer.json()["detail"]


@pytest.mark.parametrize("kind", ["toml", "csv", "dxf", "svg", "gif"])
def test_a_design_is_exported_as_by_the_command_line(kind, client, served, tmp_path):
    number = int(
        served.folder.joinpath("results/few.h5").exists() and explore.rank(served.folder / "results/few.h5").index[0]
    )
    answer = client.get(f"/api/results/few/design/{number}/export/{kind}")
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-disposition"] == f'attachment; filename="few-{number}.{kind}"'
    expected = tmp_path / f"few.{kind}"
    explore.export(served.folder / "results/few.h5", expected, design=number)
    if kind == "dxf":  # which has the time of its making
        assert answer.content[:20] == expected.read_bytes()[:20]
        assert abs(len(answer.content) - expected.stat().st_size) < 200
    else:
        assert answer.content == expected.read_bytes()
    assert str(served.folder).encode() not in answer.content


def test_designs_without_a_motion_and_formats_that_are_none_are_told_in_words(client, served):
    cv = explore.read_results(served.folder / "results/few.h5")["cv"]
    blocked = int(cv[cv.isna()].index[0])
    answer = client.get(f"/api/results/few/design/{blocked}/export/svg")
    assert (answer.status_code, "turn" in answer.text or "motion" in answer.text) == (409, True), answer.text
    assert client.get("/api/results/few/design/0/export/exe").status_code == 422
    assert client.get("/api/results/few/design/99/export/toml").status_code == 409


def test_parts_of_the_file_can_be_fetched(client, served):
    content = (served.folder / "results/few.h5").read_bytes()
    whole = client.get("/api/results/few/file")
    assert whole.content == content
    assert whole.headers["content-disposition"] == 'attachment; filename="few.h5"'
    part = client.get("/api/results/few/file", headers={"Range": "bytes=100-199"})
    assert (part.status_code, part.content) == (206, content[100:200])
    assert client.get("/api/results/few/file", headers={"Range": "bytes=-10"}).content == content[-10:]
    assert client.get("/api/results/few/file", headers={"Range": "bytes=999999999-"}).status_code == 416


def test_metrics_are_those_of_prometheus(client):
    answer = client.get("/metrics")
    assert answer.headers["content-type"] == "text/plain; version=0.0.4; charset=utf-8"
    done = sum(job["state"] == "done" for job in client.get("/api/jobs").json()["jobs"])
    families = {family.name: family for family in text_string_to_metric_families(answer.text)}
    states = {sample.labels["state"]: sample.value for sample in families["explore_jobs"].samples}
    assert (set(states), states["done"]) == ({"queued", "running", "done", "failed", "cancelled"}, done)
    assert {"explore_build_info", "explore_free_bytes", "process_resident_memory_bytes"} < set(families)
    assert families["explore_runner_up"].samples[0].value == 1
    counters = {name for name, family in families.items() if family.type == "counter"}
    assert counters == {"explore_events", "process_cpu_seconds"}


# --- stopping, the Python client and the command line -----------------------------------------------------------------


def test_a_stop_or_a_kill_in_a_sweep_loses_nothing_and_watchers_come_back(tmp_path, start_server):
    server = start_server(tmp_path / "served")
    (tmp_path / "long.toml").write_text(LONG)
    service = explore.Service(server.url, tmp_path / "served/token")
    job = service.submit(LONG, name="long")
    for end in (Served.stop, Served.kill):
        wait_until(lambda job=job: job.progress().done > 0 or job.progress().state == "done")
        end(server)
        with pytest.raises(explore.ServiceError, match="no service answers at|is it running"):
            service.jobs()
        server = start_server(tmp_path / "served")
        service = explore.Service(server.url, tmp_path / "served/token")
        job = service.job("long")
    assert job.wait().state == "done"
    run("sweep", "long.toml", cwd=tmp_path)
    results = job.results(tmp_path / "fetched.h5")
    assert results.is_complete
    assert (tmp_path / "fetched.h5").read_bytes() == (tmp_path / "results/long.h5").read_bytes()
    assert server.stop() == 0


@pytest.mark.parametrize(
    "url", ["http://[::1", "http://x:99999", "ftp://x", "x", "http://", "http://me:word@127.0.0.1:8765"]
)
def test_addresses_that_are_none(url):
    with pytest.raises(RequestError, match="is no address of a service; write one such as"):
        explore.Service(url)


@pytest.mark.parametrize("token", ["a\nX-Evil: 1", "é", "a\0"])
def test_tokens_that_are_none(token):
    with pytest.raises(RequestError, match="the token is none of a service"):
        explore.Service("http://127.0.0.1:9", token).jobs()


def test_the_end_of_a_line_after_a_token_does_no_harm(served):
    assert explore.Service(served.url, f"{served.token}\n").jobs()


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (b"HTTP/1.1 200 OK\r\nContent-Length: 4\r\n\r\n<p>x", "answers no JSON; is it a service of explore"),
        (b'HTTP/1.1 200 OK\r\nContent-Length: 40\r\n\r\n{"jo', "broke off its answer"),
        (b"no HTTP\r\n\r\n", "no service answers at"),
        (b"HTTP/1.1 302 Found\r\nLocation: http://127.0.0.1:9/\r\nContent-Length: 0\r\n\r\n", "answers 302 Found"),
    ],
)
def test_answers_of_other_servers_and_broken_ones_are_told_in_words(answer, reason):
    with answering(answer) as url, pytest.raises(explore.ServiceError, match=reason):
        explore.Service(url, "token").jobs()


def test_a_download_that_breaks_off_leaves_no_file(tmp_path):
    answer = b"HTTP/1.1 200 OK\r\nContent-Length: 40\r\n\r\nHDF5"
    with answering(answer) as url, pytest.raises(explore.ResultsError, match="4 of 40 bytes arrived; fetch it again"):
        explore.Service(url, "token").job("few").results(tmp_path / "few.h5")
    assert list(tmp_path.iterdir()) == []


@contextlib.contextmanager
def answering(answer):
    """A server that gives one answer of these bytes."""
    with socket.create_server(("127.0.0.1", 0)) as other:

        def reply():
            connection, _ = other.accept()
            with connection:
                connection.recv(65_536)
                connection.sendall(answer)

        thread = threading.Thread(target=reply)
        thread.start()
        yield f"http://127.0.0.1:{other.getsockname()[1]}"
        thread.join(10)


def test_submit_on_the_command_line(served, tmp_path, monkeypatch):
    (tmp_path / "Small Study.toml").write_text(FEW)
    at = ("--server", served.url, "--token-file", str(served.folder / "token"))
    out = run("submit", "Small Study.toml", *at, "-o", "small.h5", cwd=tmp_path)
    assert "small-study is done: 8 designs" in out.stderr
    assert explore.open_results(tmp_path / "small.h5").is_complete
    out = run("submit", "Small Study.toml", *at, "--dry-run", "--json", cwd=tmp_path)
    assert json.loads(out.stdout)["designs"] == 8
    again = run("submit", "Small Study.toml", *at, cwd=tmp_path, code=1)
    assert "there is a job small-study already (done); choose another name, such as small-study-2" in again.stderr
    (tmp_path / "wrong.toml").write_text(FEW.replace("crank =", "cranc ="))
    wrong = run("submit", "wrong.toml", *at, cwd=tmp_path, code=2)
    assert wrong.stderr == "error: wrong.toml:3: parameters.cranc: unknown parameter; did you mean 'crank'?\n"
    monkeypatch.setenv("EXPLORE_TOKEN", "wrong")
    refused = run("submit", "wrong.toml", "--server", served.url, cwd=tmp_path, code=1)
    assert "it does not know the token, which is new after each start of the service" in refused.stderr
    monkeypatch.delenv("EXPLORE_TOKEN")
    nobody = run("submit", "wrong.toml", "--server", "http://127.0.0.1:9", cwd=tmp_path, code=2)
    assert "the service asks for a token; give one, or set EXPLORE_TOKEN" in nobody.stderr


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"host": "0.0.0.0"}, "--host 0.0.0.0 would send tokens and results unencrypted; give --certificate and --key"),
        ({"host": "192.168.1.5"}, "ssh -L 8765:127.0.0.1:8765 SERVER"),
        ({"host": "::"}, "--host :: would send"),
        ({"host": "0.0.0.0", "is_behind_proxy": True}, "--host 0.0.0.0 needs --public-url https://NAME"),
        ({"certificate": Path("c.pem")}, "TLS needs both --certificate and --key"),
        ({"certificate": Path("c.pem"), "key": Path("k.pem")}, "k.pem cannot be used: No such file or directory"),
        ({"certificate": Path(__file__), "key": Path(__file__)}, "give the files of a certificate and of its private"),
        ({"public_url": "https://x.example/path"}, "--public-url: write https://HOST or"),
        ({"public_url": "x.example"}, "--public-url: write https://HOST or"),
        ({"public_url": "https://x.example:99999"}, "--public-url: write https://HOST or"),
        ({"public_url": "https://[::1"}, "--public-url: write https://HOST or"),
        ({"public_url": "https://me@x.example"}, "--public-url: write https://HOST or"),
        ({"public_url": "http://x.example"}, "--public-url http://x.example would send tokens and results unencrypted"),
    ],
)
def test_places_that_are_not_safe_are_refused(options, reason):
    with pytest.raises(RequestError) as caught:
        Place(**options).check()
    assert reason in name_options(str(caught.value))


@pytest.mark.parametrize(
    ("url", "origin", "host"),
    [
        ("https://Explore.Example.org", "https://explore.example.org", "explore.example.org"),
        ("https://x.example:443/", "https://x.example", "x.example"),
        ("http://x.example:80", "http://x.example", "x.example"),
        ("https://x.example:8765", "https://x.example:8765", "x.example:8765"),
    ],
)
def test_origin_and_host_are_those_that_browsers_send(url, origin, host):
    access = Access(url)
    assert (access.origins, access.hosts) == ({origin}, {host})


def test_places_that_are_safe():
    for host in ("127.0.0.1", "::1", "localhost", "127.0.0.7"):
        Place(host=host).check()
    Place(public_url="http://localhost:9000").check()  # the other end of ssh -L 9000:127.0.0.1:8765
    Place(host="0.0.0.0", public_url="https://x.example", is_behind_proxy=True).check()


def test_tls_by_the_server(tmp_path, start_server):
    certificate, key = self_signed(tmp_path)
    url = f"https://localhost:{free_port()}"
    options = ("--certificate", str(certificate), "--key", str(key), "--public-url", url, "--host", "0.0.0.0")
    server = start_server(tmp_path / "served", *options, port=url.rpartition(":")[2])
    assert server.url == url
    context = ssl.create_default_context(cafile=certificate)
    with httpx.Client(base_url=url, headers={"Origin": url}, verify=context, timeout=240) as browser:
        cookie = browser.post("/api/session", json={"token": server.link}).headers["set-cookie"]
        assert cookie.startswith(f"__Host-explore-{url.rpartition(':')[2]}=")
        assert {"Secure", "HttpOnly", "SameSite=strict", "Path=/"} == {*cookie.split("; ")[1:]}
        assert browser.get("/api/jobs").json() == {"jobs": []}
        assert browser.get("/api/jobs", headers={"Host": "evil.example"}).status_code == 421
    assert server.stop() == 0


def self_signed(folder):
    """A certificate of localhost for an hour, and its key."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "localhost")])
    start = datetime.now(UTC) - timedelta(minutes=1)
    builder = x509.CertificateBuilder(name, name, key.public_key(), x509.random_serial_number())
    builder = builder.not_valid_before(start).not_valid_after(start + timedelta(hours=1))
    builder = builder.add_extension(x509.SubjectAlternativeName([x509.DNSName("localhost")]), critical=False)
    builder = builder.add_extension(x509.BasicConstraints(ca=True, path_length=None), critical=True)
    certificate = builder.sign(key, hashes.SHA256())
    (folder / "cert.pem").write_bytes(certificate.public_bytes(Encoding.PEM))
    (folder / "key.pem").write_bytes(key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()))
    return folder / "cert.pem", folder / "key.pem"


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


def test_without_the_extra_one_line_names_it(monkeypatch, tmp_path):
    monkeypatch.setattr(serve_command, "find_spec", lambda name: None)
    code, _, err = call("serve", str(tmp_path / "served"))
    assert code == 2
    assert (
        err.strip()
        == 'error: explore serve needs fastapi, prometheus_client, uvicorn: pip install "linkage-explore[serve]"'
    )
    assert not (tmp_path / "served").exists()


def test_a_port_that_is_taken_is_one_line(served, tmp_path):
    code, _, err = call("serve", str(tmp_path), "--port", served.url.rpartition(":")[2])
    assert code == 2
    assert "choose another with --port" in err


def test_what_is_wrong_is_said_before_anything_is_served(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "grid.h5").write_bytes(b"")
    wrong = {
        ("mine",): "mine holds other files, such as grid.h5; name a new folder, such as mine/served",
        ("mine/grid.h5",): "mine/grid.h5 is no folder; name one, such as served",
        ("new", "--scheduler", "foo"): "'foo' is no address of a scheduler; write one such as tcp://host:8786",
        ("new", "--scheduler", "tls://a:1"): "tls://a:1 needs certificates; name them in dask's configuration",
    }
    for arguments, reason in wrong.items():
        assert reason in run("serve", *arguments, cwd=tmp_path, code=2).stderr
    assert [file.name for file in tmp_path.iterdir()] == ["mine"]
    assert [file.name for file in (tmp_path / "mine").iterdir()] == ["grid.h5"]


def test_limits_on_the_command_line(tmp_path, monkeypatch):
    given = []
    monkeypatch.setattr(server, "serve", lambda folder, place, limits, *_: given.append(limits))
    options = ("--max-designs", "1", "--max-bytes", "2", "--max-queue", "3", "--max-hours", "0.5")
    run("serve", "new", *options, cwd=tmp_path)
    assert given == [Limits(designs=1, bytes=2, queue=3, seconds=1800.0)]


def test_a_folder_to_fetch_into_is_refused_before_the_sweep(served, tmp_path):
    (tmp_path / "few.toml").write_text(FEW)
    at = ("--server", served.url, "--token-file", str(served.folder / "token"))
    refused = run("submit", "few.toml", *at, "--name", "nowhere", "-o", ".", cwd=tmp_path, code=2)
    assert "-o . is a folder; name a file, such as results.h5" in refused.stderr
    with served.client() as client:
        assert client.get("/api/jobs/nowhere").status_code == 404
