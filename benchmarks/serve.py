"""A service under load: a full queue and clients that watch; what is lost, what grows, and what a sweep pays.

Run with ``python benchmarks/serve.py [--seconds 300] [--studies 100] [--watchers 50] [--workers 2] [folder]``. First
the same study is swept by the service, while all watch, and by ``explore sweep``, in turns: processor seconds of both,
with those of the service itself, and seconds from the clock. Then so many studies wait for so long: whenever one is
done, another one is submitted. Printed: events that a watcher did not get, memory of the service at the start and the
end, its share of a processor, and how soon all watchers are told of a study that is submitted.
"""

import argparse
import os
import re
import resource
import selectors
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlsplit

import explore

STUDY = """mechanism = "crank-rocker"
[parameters]
crank   = { start = 60, stop = 140, num = 80 }
coupler = { start = 900, stop = 1100, num = 50 }
rocker  = { start = 500, stop = 600, num = 40 }
ground  = { start = 650, stop = 800, num = 50 }
[rank]
metrics = ["cv"]
"""
_EVENT = re.compile(rb"id: \w+-(\d+)\nevent: (\w+)\ndata: (.*)\n\n")
_NAME = re.compile(rb'"name": "([^"]*)"')


@dataclass
class Seen:
    """What one watcher saw: the number of the last event, how many were missing, and when each job was first told."""

    last: int | None = None
    lost: int = 0
    told: dict[str, float] = field(default_factory=dict)
    buffer: bytes = b""

    def take(self, data: bytes) -> None:
        now, end = time.monotonic(), 0
        self.buffer += data
        for match in _EVENT.finditer(self.buffer):
            number, end = int(match[1]), match.end()
            if match[2] != b"jobs":
                self.lost += number - self.last - 1
                self.told.setdefault(_NAME.search(match[3])[1].decode(), now)
            elif self.last is not None:  # the list again: the service kept no more what this one missed
                self.lost += number - self.last
            self.last = number
        self.buffer = self.buffer[end:]


class Watchers(threading.Thread):
    """Clients that watch the events of a service, all in one thread, so that they take little of the processors."""

    def __init__(self, url: str, token: str, number: int) -> None:
        super().__init__(daemon=True)
        self.seen = [Seen() for _ in range(number)]
        self._selector, self._stopping = selectors.DefaultSelector(), False
        place = urlsplit(url)
        # HTTP/1.0: the answer is the events as they are, without the lengths of chunks between them.
        head = f"GET /api/events HTTP/1.0\r\nHost: {place.netloc}\r\nAuthorization: Bearer {token}\r\n\r\n"
        self._connections = [socket.create_connection((place.hostname, place.port)) for _ in self.seen]
        for connection, seen in zip(self._connections, self.seen, strict=True):
            connection.sendall(head.encode())
            self._selector.register(connection, selectors.EVENT_READ, seen)
        self.start()
        while any(seen.last is None for seen in self.seen):
            time.sleep(0.01)

    def run(self) -> None:
        while not self._stopping:
            for key, _ in self._selector.select(0.2):
                if not (data := key.fileobj.recv(1 << 16)):
                    self._selector.unregister(key.fileobj)
                key.data.take(data)

    def stop(self) -> None:
        self._stopping = True
        self.join()
        for connection in self._connections:
            connection.close()

    def wait(self, number: int, seconds: float = 30) -> None:
        """Wait until all have seen an event of this number or a later one, at most so long."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and any(seen.last < number for seen in self.seen):
            time.sleep(0.02)

    def delay(self, name: str, start: float) -> float:
        """Seconds until the last of them was told of a job."""
        return max(seen.told.get(name, time.monotonic()) for seen in self.seen) - start


@dataclass(frozen=True)
class Started:
    """A service that runs: its process, a client, and its address."""

    process: subprocess.Popen[str]
    client: explore.Service
    token: str

    def metrics(self) -> dict[str, float]:
        request = urllib.request.Request(
            f"{self.client.url}/metrics", headers={"Authorization": f"Bearer {self.token}"}
        )
        with urllib.request.urlopen(request) as answer:
            lines = answer.read().decode().splitlines()
        values = (line.rpartition(" ") for line in lines if not line.startswith("#"))
        return {name: float(value) for name, _, value in values}

    def cpu(self) -> tuple[float, float]:
        """Processor seconds of the service, and of its sweeps that have ended."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        ticks = [int(value) / os.sysconf("SC_CLK_TCK") for value in fields[11:15]]
        return sum(ticks[:2]), sum(ticks[2:])


@contextmanager
def started(folder: Path, workers: int, queue: int) -> Iterator[Started]:
    options = ["--port", "0", "--workers", str(workers), "--max-queue", str(queue)]
    command = [sys.executable, "-m", "explore", "serve", str(folder), *options]
    environment = {**os.environ, "COLUMNS": "300"}
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment, text=True
    ) as process:
        try:
            url = re.search(r"open (\S+)/#token=", process.stdout.readline())[1]
            token = (folder / "token").read_text().strip()
            yield Started(process, explore.Service(url, token), token)
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait()


@dataclass(frozen=True)
class Load:
    """What a load did: studies that were swept, lost events of all watchers, bytes of memory after the first sweep and
    at the end, the service's share of one processor, and seconds until all watchers were told of each submission."""

    swept: int
    events: int
    lost: int
    memory: tuple[float, float]
    share: float
    delays: list[float]


def load(service: Started, watchers: Watchers, text: str, seconds: float, studies: int) -> Load:
    """Keep so many studies waiting for so long, at least until two are swept."""
    begin, memory, delays, number, swept = time.monotonic(), [], [], 0, 0
    cpu = service.cpu()[0]
    while time.monotonic() < begin + seconds or swept < 2:
        metrics = service.metrics()
        if swept:
            memory.append(metrics["process_resident_memory_bytes"])
        for _ in range(studies - int(metrics['explore_jobs{state="queued"}'])):
            start = time.monotonic()
            service.client.submit(text, name=f"load-{number}", keep="front")
            watchers.wait(int(service.metrics()["explore_events_total"]))
            delays.append(watchers.delay(f"load-{number}", start))
            number += 1
        for job in service.client.jobs():
            if job["state"] == "done":
                service.client.job(job["name"]).delete()
                swept += 1
        time.sleep(0.5)
    share = (service.cpu()[0] - cpu) / (time.monotonic() - begin)
    for job in service.client.jobs():
        if job["state"] in ("queued", "running"):
            service.client.job(job["name"]).cancel()
    time.sleep(1)  # the last sweep ends
    last = int(service.metrics()["explore_events_total"])
    watchers.wait(last)
    lost = sum(seen.lost + last - seen.last for seen in watchers.seen)
    tenth = max(1, len(memory) // 10)
    ends = statistics.median(memory[:tenth]), statistics.median(memory[-tenth:])
    return Load(swept, last, lost, ends, share, delays)


def bare(folder: Path, workers: int) -> tuple[float, float]:
    """Processor seconds of `explore sweep`, and its seconds from the clock."""
    command = [sys.executable, "-m", "explore", "sweep", "study.toml", "--keep", "front", "--workers", str(workers)]
    used, start = _children(), time.monotonic()
    subprocess.run([*command, "-o", "bare.h5"], cwd=folder, check=True, capture_output=True)
    outcome = _children() - used, time.monotonic() - start
    (folder / "bare.h5").unlink()
    return outcome


def served(service: Started, text: str) -> tuple[float, float, float]:
    """Processor seconds of a sweep by a service and of the service itself, and seconds from the clock."""
    own, sweeps = service.cpu()
    start = time.monotonic()
    job = service.client.submit(text, name="pair", keep="front")
    while service.cpu()[1] == sweeps:  # its process has not ended
        time.sleep(0.02)
    seconds = time.monotonic() - start
    after = service.cpu()
    assert job.wait().state == "done"
    job.delete()
    return after[1] - sweeps, after[0] - own, seconds


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", default=".")
    for name, value in (("seconds", 300), ("studies", 100), ("watchers", 50), ("workers", 2), ("pairs", 7)):
        parser.add_argument(f"--{name}", type=int, default=value)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.folder) as name:
        folder = Path(name)
        (folder / "study.toml").write_text(STUDY)
        bare(folder, options.workers)  # compiles, and fills the caches
        with started(folder / "served", options.workers, options.studies) as service:
            watchers = Watchers(service.client.url, service.token, options.watchers)
            pairs = [(served(service, STUDY), bare(folder, options.workers)) for _ in range(options.pairs)]
            for (sweep, own, seconds), (bare_cpu, bare_seconds) in pairs:
                print(f"  served {sweep:.2f} + {own:.2f} s of processors, {seconds:.2f} s;", end=" ")
                print(f"bare {bare_cpu:.2f} s, {bare_seconds:.2f} s")
            cpu = statistics.median(pair[1][0] / (pair[0][0] + pair[0][1]) for pair in pairs)
            clock = statistics.median(pair[1][1] / pair[0][2] for pair in pairs)
            print(f"speed of a watched sweep, bare = 1: {cpu:.3f} by processor time, {clock:.3f} by the clock")
            found = load(service, watchers, STUDY, options.seconds, options.studies)
            watchers.stop()
    print(f"{found.swept} studies swept, {found.events:,} events to {options.watchers} watchers: {found.lost} lost")
    before, after = (size / 1e6 for size in found.memory)
    print(f"memory of the service {before:.1f} MB, then {after:.1f} MB; {100 * found.share:.1f} % of one processor")
    delays = sorted(found.delays)
    print(f"told of a submission: median {1e3 * statistics.median(delays):.0f} ms", end=", ")
    print(f"95 % within {1e3 * delays[int(0.95 * (len(delays) - 1))]:.0f} ms")


if __name__ == "__main__":
    main()
