"""A service as a process of its own, for the tests."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Self

import httpx
from waiting import wait_until


class Served:
    """`explore serve` on a folder, at a port that the system chose."""

    def __init__(self, folder: Path, *options: str, port: str = "0") -> None:
        self.folder = folder
        command = [sys.executable, "-m", "explore", "serve", str(folder), "--port", port, "--workers", "1", *options]
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**os.environ, "COLUMNS": "300"}, text=True
        )
        try:
            line = self.process.stdout.readline()
            assert line, self.process.stderr.read()
            self.url, self.link = re.search(r"open (\S+)/#token=(\S+)", line).groups()
            self.link_to_look = re.search(r"#token=(\S+)", self.process.stderr.readline())[1]
            self.token = (folder / "token").read_text().strip()
        except BaseException:
            self.kill()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """End it, also after a test that failed midway."""
        if self.process.poll() is None:
            self.kill()

    def client(self, token: str | None = None) -> httpx.Client:
        """A client with the token for everything, or another."""
        headers = {"Authorization": f"Bearer {self.token if token is None else token}"}
        return httpx.Client(base_url=self.url, headers=headers, timeout=180)  # a dry run may compile

    def new_link(self) -> str:
        """The token of one more link, for everything."""
        with self.client() as client:
            return client.post("/api/links", json={"right": "full"}).json()["link"].partition("#token=")[2]

    @contextlib.contextmanager
    def browser(self, link: str) -> Iterator[httpx.Client]:
        """A client with the cookie of a link."""
        with httpx.Client(base_url=self.url, headers={"Origin": self.url}, timeout=240) as client:
            assert client.post("/api/session", json={"token": link}).status_code == 200
            yield client

    def stop(self) -> int:
        """Stop it as systemd does; returns the exit code."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        _, errors = self.process.communicate(timeout=240)
        assert "Traceback" not in errors, errors
        return self.process.returncode

    def kill(self) -> None:
        """Kill it with SIGKILL."""
        self.process.kill()
        self.process.communicate()


@contextlib.contextmanager
def serving(folder: Path, **studies: str) -> Iterator[Served]:
    """A service in which these studies are done, by name; it must stop in order."""
    with Served(folder) as server:
        with server.client() as client:
            for name, text in studies.items():
                client.post("/api/studies", json={"name": name, "study": text}).raise_for_status()
            for name in studies:
                assert wait_settled(client, name)["state"] == "done"
        yield server
        assert server.stop() == 0


def build_index(client: httpx.Client, name: str) -> dict:
    """Make the index of results; the state of it that the service tells."""
    client.get(f"/api/results/{name}/index", params={"build": True}).raise_for_status()

    def built() -> dict | None:
        state = client.get(f"/api/results/{name}/index").json()
        assert state["state"] in ("building", "ready")
        return state if state["state"] == "ready" else None

    return wait_until(built)


def wait_settled(client: httpx.Client, name: str) -> dict:
    """The job, when nothing more happens to it."""

    def settled() -> dict | None:
        job = client.get(f"/api/jobs/{name}").json()
        return None if job["state"] in ("queued", "running") else job

    return wait_until(settled)


def submit_and_wait(client: httpx.Client, name: str, study: str) -> None:
    """Submit a study, and wait until it is swept."""
    client.post("/api/studies", json={"name": name, "study": study}).raise_for_status()
    assert wait_settled(client, name)["state"] == "done"


def events_of(client, path="/api/events", last=None):
    """Id, kind and content of each event, until the server ends the stream."""
    end = time.monotonic() + 240
    with client.stream("GET", path, headers={} if last is None else {"Last-Event-ID": last}) as answer:
        assert answer.status_code == 200
        assert answer.headers["content-type"].startswith("text/event-stream")
        facts = {}
        for line in answer.iter_lines():
            assert time.monotonic() < end
            if line:
                name, _, value = line.partition(": ")
                facts[name] = value
            elif "data" in facts:
                yield facts["id"], facts["event"], json.loads(facts["data"])
                facts = {}
