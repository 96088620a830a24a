"""The service under load, with clients that read nothing or too many at a time."""

import asyncio
import contextlib
import importlib
import resource
import signal
import socket
import time
from pathlib import Path

import anyio
import pytest
import uvicorn
from served import Served, submit_and_wait
from studies import FEW, GOOD
from uvicorn.server import ServerState
from waiting import PATIENCE

from explore.service import browsing_routes, connections, job_routes, results_routes
from explore.service.events import MOST_KEPT, Events
from explore.service.folder import State
from explore.service.jobs import Job
from explore.service.server import Place, _allow_open_files, _listen


@pytest.fixture
def benchmark(monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "benchmarks")
    return importlib.import_module("serve")


def test_a_full_queue_and_many_watchers_lose_no_event_and_no_memory(benchmark, tmp_path):
    """The load of ``benchmarks/serve.py`` in small; there 100 studies and 50 watchers for five minutes."""
    with benchmark.started(tmp_path / "served", workers=1, queue=10) as service:
        watchers = benchmark.Watchers(service.client.url, service.token, 20)
        found = benchmark.load(service, watchers, FEW + '[rank]\nmetrics = ["cv"]\n', seconds=4, studies=10)
        watchers.stop()
    assert found.swept >= 2
    assert found.events >= 2 * 10  # each of those that wait is queued, and cancelled at the end
    assert all(seen.told.keys() == watchers.seen[0].told.keys() for seen in watchers.seen)
    assert found.lost == 0
    assert found.memory[1] < found.memory[0] + 5e6


def test_the_benchmark_counts_events_that_are_missing(benchmark):
    events, seen = Events(), benchmark.Seen()
    texts = [events.text(0, "jobs", {"jobs": []})]
    texts += [events.text(number, "job", {"name": "few"}) for number in (1, 2, 5, 6)]
    seen.take(b"HTTP/1.1 200 OK\r\n\r\nretry: 1000\n\n" + texts[0] + texts[1][:20])
    seen.take(texts[1][20:] + b"".join(texts[2:]))
    assert (seen.last, seen.lost, list(seen.told)) == (6, 2, ["few"])
    seen.take(events.text(9, "jobs", {"jobs": []}))
    assert (seen.last, seen.lost) == (9, 5)


def test_events_after_a_number():
    events, woken = Events(), []
    with events.watched(lambda: woken.append(True)):
        for number in range(MOST_KEPT + 10):
            events.note_job(f"job-{number}", Job(f"job-{number}", State.queued))
        events.note_job("job-0", None)
    last = MOST_KEPT + 11
    assert len(woken) == last == events.last
    assert events.after(last) == []
    assert events.after(-1) is events.after(last + 1) is events.after(last - MOST_KEPT - 1) is None
    position, seen = last - MOST_KEPT, []
    while missed := events.after(position):
        seen += missed
        position = missed[-1].number
    assert [event.number for event in seen] == list(range(last - MOST_KEPT + 1, last + 1))
    assert seen[-1].text == f'id: {events.epoch}-{last}\nevent: deleted\ndata: {{"name": "job-0"}}\n\n'.encode()


# --- clients that read nothing ----------------------------------------------------------------------------------------


async def serve_connections(application, visit):
    config = uvicorn.Config(application, lifespan="off", log_level="critical")
    state, loop = ServerState(), asyncio.get_running_loop()
    server = await loop.create_server(lambda: connections.Connection(config, state, {}), "127.0.0.1", 0)
    async with server, asyncio.timeout(30):
        return await visit(server.sockets[0].getsockname(), state)


def test_a_client_that_reads_nothing_is_left_and_holds_little(monkeypatch):
    """The answer never ends; what the service holds of it is a chunk, and what the system takes is bounded."""
    n_sent = 0

    async def answer(scope, receive, send):
        nonlocal n_sent
        await send({"type": "http.response.start", "status": 200, "headers": []})
        while True:
            await send({"type": "http.response.body", "body": bytes(1 << 16), "more_body": True})
            n_sent += 1
            message = asyncio.ensure_future(receive())
            await asyncio.sleep(0)
            if message.done() and message.result()["type"] == "http.disconnect":
                return
            message.cancel()

    async def visit(address, state):
        _, writer = await asyncio.open_connection(*address, limit=1)
        writer.write(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
        while not state.tasks:
            await asyncio.sleep(0.01)
        (connection,) = state.connections
        held, sizes = connection.transport, []
        while state.connections:
            sizes.append(held.get_write_buffer_size())
            await asyncio.sleep(0.01)
        writer.close()
        return max(sizes)

    monkeypatch.setattr(connections, "_TAKE_SECONDS", 0.5)
    assert asyncio.run(serve_connections(answer, visit)) <= 2 << 16
    assert 0 < n_sent < 1000


@pytest.mark.parametrize("begun", [b"", b"GET / HTTP/1.1\r\nHost: x", b"GET / HTTP/1.1\r\nHost: x\r\n\r\nGET / H"])
def test_a_client_that_completes_no_request_is_left(begun, monkeypatch):
    async def answer(scope, receive, send):
        await asyncio.sleep(0.5)  # longer than a client may take: answers are not bounded
        await send({"type": "http.response.start", "status": 204, "headers": []})
        await send({"type": "http.response.body"})

    async def visit(address, state):
        reader, writer = await asyncio.open_connection(*address)
        writer.write(begun)
        if b"\r\n\r\n" in begun:
            assert (await reader.readuntil(b"\r\n\r\n")).startswith(b"HTTP/1.1 204")
            writer.write(b"TT")
        assert await reader.read() == b""
        writer.close()

    monkeypatch.setattr(connections, "_HEAD_SECONDS", 0.2)
    asyncio.run(serve_connections(answer, visit))


def test_a_client_that_reads_slowly_gets_everything(monkeypatch):
    async def answer(scope, receive, send):
        await send({"type": "http.response.start", "status": 200, "headers": []})
        for _ in range(480):
            await send({"type": "http.response.body", "body": bytes(1 << 16), "more_body": True})
        await send({"type": "http.response.body"})

    async def visit(address, state):
        reader, writer = await asyncio.open_connection(*address, limit=1 << 16)
        writer.write(b"GET / HTTP/1.0\r\nHost: x\r\n\r\n")
        size = len(await reader.read(1 << 18))
        while data := await reader.read(1 << 18):
            size += len(data)
            await asyncio.sleep(0.005)  # in all longer than it has for one part
        writer.close()
        return size

    monkeypatch.setattr(connections, "_TAKE_SECONDS", 0.3)
    assert asyncio.run(serve_connections(answer, visit)) > 480 << 16


async def answer_at_once(scope, receive, send):
    """Answers 204; the path of who has a right is not /."""
    scope["state"]["right"] = "full" if scope["path"] != "/" else ""
    await send({"type": "http.response.start", "status": 204, "headers": []})
    await send({"type": "http.response.body"})


async def ask(reader, writer, path):
    writer.write(f"GET {path} HTTP/1.1\r\nHost: x\r\n\r\n".encode())
    assert (await reader.readuntil(b"\r\n\r\n")).startswith(b"HTTP/1.1 204")


def test_the_oldest_connection_without_a_right_gives_way_and_then_the_oldest_that_waits(monkeypatch):
    async def visit(address, state):
        opened = [await asyncio.open_connection(*address) for _ in range(3)]
        known, idle, answered = opened
        await ask(*known, "/with-a-right")
        await ask(*answered, "/")
        for gone in (idle, answered):
            newer = await asyncio.open_connection(*address)
            opened.append(newer)
            with contextlib.suppress(ConnectionError):
                assert await gone[0].read() == b""
            await ask(*newer, "/with-a-right")  # and from then on it stays longer than those without
        await ask(*known, "/with-a-right")  # now the one that has waited for the shortest time
        last = await asyncio.open_connection(*address)
        await ask(*last, "/")
        assert len(state.connections) == 3
        await ask(*known, "/with-a-right")
        for _, writer in (*opened, last):
            writer.close()

    monkeypatch.setattr(connections, "_MOST_CONNECTIONS", 3)
    asyncio.run(serve_connections(answer_at_once, visit))


def test_a_connection_that_is_answered_with_a_right_never_gives_way(monkeypatch):
    async def visit(address, state):
        busy = [await asyncio.open_connection(*address) for _ in range(3)]
        for _, writer in busy:
            writer.write(b"GET /with-a-right HTTP/1.1\r\nHost: x\r\n\r\n")
        while len(state.tasks) < 3:
            await asyncio.sleep(0.01)
        reader, writer = await asyncio.open_connection(*address)
        with contextlib.suppress(ConnectionError):
            assert await reader.read() == b""
        go_on.set()
        for reader, own in busy:
            assert (await reader.readline()).startswith(b"HTTP/1.1 204")
            own.close()
        writer.close()

    async def answer(scope, receive, send):
        scope["state"]["right"] = "full"
        await go_on.wait()
        await answer_at_once(scope, receive, send)

    go_on = asyncio.Event()
    monkeypatch.setattr(connections, "_MOST_CONNECTIONS", 3)
    asyncio.run(serve_connections(answer, visit))


#: What a client without a token sends before it waits: nothing, half a head, or a head whose body does not come.
ATTACKS = {
    "idle": b"",
    "half-sent heads": b"GET /api/jobs HTTP/1.1\r\nHost: ",
    "bodies that do not come": b"POST /api/session HTTP/1.1\r\nHost: {host}\r\nContent-Length: 100\r\n\r\n{{",
}


@pytest.mark.parametrize(
    ("attack", "count"),
    [
        ("idle", 450),
        ("half-sent heads", 1000),
        pytest.param("idle", 1000, marks=pytest.mark.slow),
        pytest.param("bodies that do not come", 1000, marks=pytest.mark.slow),
    ],
)
def test_clients_without_a_token_keep_out_nobody_who_has_one(attack, count, tmp_path):
    """The client asks on one connection that stays, on a new one each time, and just before all others connect."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with Served(tmp_path / "served") as server, contextlib.ExitStack() as attackers:
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 4096), hard))
        attackers.callback(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
        host, port = server.url.removeprefix("http://").split(":")
        sent, slowest = ATTACKS[attack].replace(b"{host}", f"{host}:{port}".encode()), 0.0
        with server.client() as client:
            client.get("/api/jobs").raise_for_status()
            server.process.send_signal(signal.SIGSTOP)
            first, *_ = (
                attackers.enter_context(socket.create_connection((host, int(port)), timeout=60)) for _ in range(count)
            )
            first.sendall(f"GET /api/jobs HTTP/1.0\r\nHost: {host}:{port}\r\n".encode())
            first.sendall(f"Authorization: Bearer {server.token}\r\n\r\n".encode())
            server.process.send_signal(signal.SIGCONT)
            assert first.recv(100).startswith(b"HTTP/1.1 200")
            for number in range(count):
                attacker = attackers.enter_context(socket.create_connection((host, int(port)), timeout=5))
                with contextlib.suppress(ConnectionError):
                    attacker.sendall(sent)
                if number % 50 == 49:
                    start = time.monotonic()
                    assert client.get("/api/jobs").status_code == 200
                    with server.client() as another:
                        assert another.get("/api/jobs").status_code == 200
                    slowest = max(slowest, time.monotonic() - start)
            submit_and_wait(client, "good", GOOD)
        assert slowest < 15  # 0.1 s on a free machine; the service leaves such clients after 20 s and more
        assert server.stop() == 0


def test_as_many_files_as_the_system_allows_may_be_open():
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (100, hard))
        _allow_open_files()
        assert resource.getrlimit(resource.RLIMIT_NOFILE) == (min(hard, 65_536), hard)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_turns_leave_threads_for_requests_that_need_none():
    async def threads():
        return anyio.to_thread.current_default_thread_limiter().total_tokens

    turns = [job_routes._PLANS, results_routes._RANKINGS, browsing_routes._COUNTS]
    assert sum(kind.most for kind in turns) <= anyio.run(threads) - 10


# --- watchers of a server that runs -----------------------------------------------------------------------------------


def test_a_stop_does_not_wait_for_watchers_that_read_nothing(tmp_path):
    with Served(tmp_path / "served") as server, contextlib.ExitStack() as open_sockets:
        host, port = server.url.removeprefix("http://").split(":")
        head = f"GET /api/events HTTP/1.1\r\nHost: {host}:{port}\r\nAuthorization: Bearer {server.token}\r\n\r\n"
        watchers = [open_sockets.enter_context(socket.create_connection((host, int(port)))) for _ in range(20)]
        for watcher in watchers:
            watcher.sendall(head.encode())
        with server.client() as client:
            submit_and_wait(client, "good", GOOD)
            assert "explore_watchers 20.0" in client.get("/metrics").text.splitlines()
        assert server.stop() == 0
        for watcher in watchers:
            assert watcher.makefile("rb").read().endswith(b"0\r\n\r\n"), "ended in order, not when the server gave up"


def watched(events):
    """The stream of the events of a service that has no jobs."""
    station = type("Station", (), {"events": events, "jobs": type("Jobs", (), {"in_order": lambda _: []})()})()
    return job_routes._stream(station, "", "", lambda: False)


def test_a_watcher_is_told_by_the_event(monkeypatch):
    """Not with the next sign of life."""

    async def watch():
        events = Events()
        stream = watched(events)
        for _ in range(2):
            await anext(stream)
        telling = asyncio.create_task(asyncio.to_thread(events.note_job, "few", None))
        text = await anext(stream)
        await telling
        await stream.aclose()
        return text

    monkeypatch.setattr(job_routes, "_HEARTBEAT", PATIENCE)
    assert b"event: deleted" in asyncio.run(watch())


def test_a_stream_ends_after_a_while(monkeypatch):
    """A client comes back then, with its right checked again, for what it missed."""

    async def watch():
        return [text async for text in watched(Events())]

    monkeypatch.setattr(job_routes, "_STREAM_SECONDS", 0.2)
    monkeypatch.setattr(job_routes, "_HEARTBEAT", 0.05)
    texts = asyncio.run(asyncio.wait_for(watch(), PATIENCE))
    assert texts[0] == b"retry: 1000\n\n"
    assert b"event: jobs" in texts[1]
    assert texts[-1] == b": nothing new\n\n"
    assert len(texts) < 8


def test_no_part_of_an_answer_waits_until_the_client_has_acknowledged_the_one_before():
    """Each would wait for 40 ms, the delay of acknowledgements."""
    with _listen(Place(port=0)) as listener, socket.create_connection(listener.getsockname()):
        connection, _ = listener.accept()
        with connection:
            assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
